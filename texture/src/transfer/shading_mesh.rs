//! A surface at a point: where it is, which way it faces, and the frame that its normal map is read in.

use glam::{Mat3, Vec2, Vec3, Vec4};
use seamwise_attr::Mesh;

/// A place on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfacePoint {
    /// The triangle.
    pub(super) triangle: usize,
    /// One per corner, sum 1.
    pub(super) barycentrics: Vec3,
}

/// A mesh with the tangents that its normal maps are read by.
#[derive(Clone, Copy, Debug)]
pub struct ShadingMesh<'a> {
    /// Positions, normals and UVs; a triangle's group tells which textures it uses.
    pub mesh: &'a Mesh,
    /// One triple per triangle, as [`compute_tangents`](seamwise_attr::compute_tangents) gives them;
    /// zero, or none at all, where no normal map is read.
    pub tangents: &'a [[Vec4; 3]],
    /// One per triangle: the chart of the source that it lies in, or comes from.
    pub charts: &'a [u32],
}

impl ShadingMesh<'_> {
    /// A triangle, ready for many places.
    pub(super) fn triangle(&self, triangle: usize) -> ShadingTriangle {
        self.triangle_in(triangle, self.face_normal(triangle))
    }

    /// The same, where the normal of its plane is known.
    pub(super) fn triangle_in(&self, triangle: usize, plane: Vec3) -> ShadingTriangle {
        let positions = self.mesh.triangle_positions(triangle);
        let layout = self.mesh.layout;
        let normal =
            |wedge| Vec3::from_slice(&self.mesh.row(wedge)[layout.normal()..layout.normal() + 3]);
        let normals = match layout.normal {
            true => self.mesh.triangles[triangle].map(normal),
            false => [plane; 3],
        };
        let tangents = self.tangents.get(triangle).copied().unwrap_or_default();
        ShadingTriangle { positions, normals, plane, tangents }
    }

    /// The UV in a set.
    pub(super) fn uv(&self, at: SurfacePoint, set: usize) -> Vec2 {
        let [a, b, c] = self.mesh.triangles[at.triangle].map(|wedge| self.mesh.uv(wedge, set));
        a * at.barycentrics.x + b * at.barycentrics.y + c * at.barycentrics.z
    }

    /// The color of the vertices, with alpha; white if they have none.
    pub(super) fn color(&self, at: SurfacePoint) -> Vec4 {
        let layout = self.mesh.layout;
        let corners = self.mesh.triangles[at.triangle].map(|wedge| {
            match self.mesh.row(wedge)[layout.color()..][..layout.color] {
                [r, g, b, a] => Vec4::new(r, g, b, a),
                [r, g, b] => Vec4::new(r, g, b, 1.0),
                _ => Vec4::ONE,
            }
        });
        let [a, b, c] = corners;
        a * at.barycentrics.x + b * at.barycentrics.y + c * at.barycentrics.z
    }

    /// The normal of the triangle's plane, zero if it has no area.
    pub(super) fn face_normal(&self, triangle: usize) -> Vec3 {
        let [a, b, c] = self.mesh.triangle_positions(triangle);
        // In f64, where the square of no f32 is lost to underflow.
        let area = (b - a).as_dvec3().cross((c - a).as_dvec3());
        area.normalize_or_zero().as_vec3()
    }

    /// See [`ShadingTriangle::frame`].
    pub(super) fn frame(&self, at: SurfacePoint) -> Mat3 {
        self.triangle(at.triangle).frame(at.barycentrics)
    }
}

/// A triangle with what shades it.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShadingTriangle {
    positions: [Vec3; 3],
    normals: [Vec3; 3],
    /// The normal of its plane, a unit or zero.
    pub(super) plane: Vec3,
    tangents: [Vec4; 3],
}

impl ShadingTriangle {
    /// The position.
    pub(super) fn position(&self, barycentrics: Vec3) -> Vec3 {
        mix(barycentrics, self.positions)
    }

    /// The vertex normal, interpolated and not made unit, as MikkTSpace asks; that of the plane where
    /// there is none.
    pub(super) fn smooth_normal(&self, barycentrics: Vec3) -> Vec3 {
        let smooth = mix(barycentrics, self.normals);
        if smooth.length_squared() > 0.0 { smooth } else { self.plane }
    }

    /// The matrix from the space of a normal map to that of the mesh: tangent, bitangent and
    /// normal, interpolated and not made unit, as MikkTSpace asks.
    pub(super) fn frame(&self, barycentrics: Vec3) -> Mat3 {
        let normal = self.smooth_normal(barycentrics);
        let [a, b, c] = self.tangents;
        let tangent = mix(barycentrics, [a.truncate(), b.truncate(), c.truncate()]);
        let sign = if a.w < 0.0 { -1.0 } else { 1.0 };
        Mat3::from_cols(tangent, normal.cross(tangent) * sign, normal)
    }
}

/// The mean of three corners by weights.
pub(super) fn mix(barycentrics: Vec3, [a, b, c]: [Vec3; 3]) -> Vec3 {
    a * barycentrics.x + b * barycentrics.y + c * barycentrics.z
}
