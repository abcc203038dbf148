//! The kind of chart that each triangle belongs in, and the places of its corners there.
//!
//! The sign of a triangle's area in UV space tells whether the image shows mirrored on it. A
//! triangle thinner there than the rounding of its UVs has no sign; if it has an area in space, it
//! is unfolded by position: projected along the axis that its normal is nearest to (box
//! projection), which keeps at least 1/√3 of its area.

use std::collections::HashMap;
use std::hash::Hash;

use glam::{DVec2, DVec3, Vec2};
use seamwise_attr::area_vector;

use super::UvMesh;

/// Twice the area over the square of the longest edge, below which a triangle is a line. In space
/// it may be generous: a line in the image colors a triangle of a thousandth of its length.
const LINE: f64 = 1e-3;

/// Triangles of different kinds share no chart, but that lines join either of their neighbors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// Laid out by its UVs: the image reads the right way round from outside.
    Upright,
    /// Has UVs, but no area in their space nor in space.
    Line,
    /// Laid out by its UVs, with u turned.
    Mirrored,
    /// Laid out by position: seen along this axis, 0…2 from its positive side, 3…5 from the other.
    Unfolded(u8),
    /// Without area and UVs.
    Spot,
}

/// The triangles of a mesh, looked at one by one.
pub(super) struct Faces<'a> {
    mesh: &'a UvMesh<'a>,
    /// One per triangle.
    pub(super) kinds: Vec<Kind>,
    /// One per vertex: the first one with the same position and UV, to the bit but for −0.
    same_uv: Vec<u32>,
    /// One per vertex: the first one with the same position.
    same_position: Vec<u32>,
}

impl<'a> Faces<'a> {
    /// Indices are checked before.
    pub(super) fn new(mesh: &'a UvMesh<'a>) -> Self {
        let position = |v: usize| mesh.positions[v].to_array().map(|x| (x + 0.0).to_bits());
        let uv = |v: usize| mesh.uvs[v].to_array().map(|x| (x + 0.0).to_bits());
        let count = mesh.positions.len();
        Self {
            kinds: mesh.triangles.iter().map(|triangle| kind(mesh, triangle)).collect(),
            same_uv: first_alike((0..count).map(|v| (position(v), uv(v)))),
            same_position: first_alike((0..count).map(position)),
            mesh,
        }
    }

    /// The vertices that stand for a triangle's corners when edges are matched: unfolded triangles
    /// are connected through positions, all others through UVs too.
    pub(super) fn corners(&self, triangle: usize) -> [u32; 3] {
        let same = match self.kinds[triangle] {
            Kind::Unfolded(_) => &self.same_position,
            _ => &self.same_uv,
        };
        self.mesh.triangles[triangle].map(|v| same[v as usize])
    }

    /// The place of a vertex in a chart of some kind. Triangles of a chart turn clockwise in
    /// numbers, which is counter-clockwise in an image whose v runs down.
    pub(super) fn place(&self, kind: Kind, vertex: u32) -> DVec2 {
        let uv = self.mesh.uvs[vertex as usize].as_dvec2();
        let p = self.mesh.positions[vertex as usize].as_dvec3();
        match kind {
            Kind::Upright | Kind::Line => uv,
            Kind::Mirrored => DVec2::new(-uv.x, uv.y),
            Kind::Unfolded(axis) => match axis {
                0 => DVec2::new(-p.z, -p.y),
                1 => DVec2::new(p.x, p.z),
                2 => DVec2::new(p.x, -p.y),
                3 => DVec2::new(p.z, -p.y),
                4 => DVec2::new(p.x, -p.z),
                _ => DVec2::new(-p.x, -p.y),
            },
            Kind::Spot => DVec2::ZERO,
        }
    }

    /// A triangle's corners in a chart of some kind.
    pub(super) fn flat(&self, kind: Kind, triangle: usize) -> [DVec2; 3] {
        self.mesh.triangles[triangle].map(|vertex| self.place(kind, vertex))
    }

    /// A triangle's area in space; 0 if a position is not finite.
    pub(super) fn area(&self, triangle: usize) -> f64 {
        let normal = normal(self.mesh, &self.mesh.triangles[triangle]);
        if normal.is_finite() { 0.5 * normal.length() } else { 0.0 }
    }
}

/// Twice the area of a triangle of a chart; positive unless it is folded over.
pub(super) fn turn(corners: [DVec2; 3]) -> f64 {
    let [a, b, c] = corners;
    (c - a).perp_dot(b - a)
}

fn normal(mesh: &UvMesh<'_>, triangle: &[u32; 3]) -> DVec3 {
    area_vector(triangle.map(|v| mesh.positions[v as usize]))
}

fn kind(mesh: &UvMesh<'_>, triangle: &[u32; 3]) -> Kind {
    let uvs = triangle.map(|v| mesh.uvs[v as usize]);
    let has_uvs = uvs.iter().all(|uv| uv.is_finite());
    if has_uvs && let Some(area) = uv_area(uvs) {
        return if area > 0.0 { Kind::Upright } else { Kind::Mirrored };
    }
    let normal = normal(mesh, triangle);
    let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].as_dvec3());
    let longest =
        (b - a).length_squared().max((c - b).length_squared().max((a - c).length_squared()));
    let has_area = normal.is_finite() && normal.length() > LINE * longest;
    match (has_area, has_uvs) {
        (true, _) => {
            let size = normal.abs();
            let axis = if size.x >= size.y && size.x >= size.z {
                0
            } else {
                2 - u8::from(size.y >= size.z)
            };
            Kind::Unfolded(if normal[axis.into()] > 0.0 { axis } else { axis + 3 })
        }
        (false, true) => Kind::Line,
        (false, false) => Kind::Spot,
    }
}

/// Twice the signed area, unless it is no more than what rounding the UVs to f32 makes.
fn uv_area(uvs: [Vec2; 3]) -> Option<f64> {
    let corners @ [a, b, c] = uvs.map(Vec2::as_dvec2);
    let longest = (b - a).length().max((c - b).length().max((a - c).length()));
    let area = turn(corners);
    (area.abs() > rounding(corners) * longest).then_some(area)
}

/// The largest error of UVs of this size by having been rounded to f32.
pub(super) fn rounding(corners: [DVec2; 3]) -> f64 {
    let largest = corners.iter().fold(0.0f64, |most, p| most.max(p.abs().max_element()));
    2.0 * f64::from(f32::EPSILON) * largest
}

/// One per key: the number of the first one equal to it.
fn first_alike<K: Hash + Eq>(keys: impl Iterator<Item = K>) -> Vec<u32> {
    let mut first = HashMap::with_capacity(keys.size_hint().0);
    (0u32..).zip(keys).map(|(at, key)| *first.entry(key).or_insert(at)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn faces_of(corners: [[f32; 3]; 3], uvs: [[f32; 2]; 3]) -> (Kind, f64) {
        let (positions, uvs) = (corners.map(Vec3::from), uvs.map(Vec2::from));
        let mesh =
            UvMesh { positions: &positions, uvs: &uvs, triangles: &[[0, 1, 2]], groups: &[0] };
        let faces = Faces::new(&mesh);
        (faces.kinds[0], turn(faces.flat(faces.kinds[0], 0)))
    }

    const FRONT: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn an_image_is_mirrored_where_it_reads_backwards_from_outside() {
        // u runs with x, v runs down as y runs up: it reads as it should.
        let (kind, area) = faces_of(FRONT, [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
        assert!(kind == Kind::Upright && area > 0.0);
        let (kind, area) = faces_of(FRONT, [[1.0, 1.0], [0.0, 1.0], [1.0, 0.0]]);
        assert!(kind == Kind::Mirrored && area > 0.0);
    }

    #[test]
    fn triangles_without_uvs_unfold_along_the_axis_they_face_the_right_way_round() {
        for axis in 0..3 {
            for sign in [1.0, -1.0] {
                let mut corners = FRONT.map(|mut p| {
                    p.rotate_right((axis + 1) % 3);
                    p
                });
                if sign < 0.0 {
                    corners.swap(1, 2);
                }
                let (kind, area) = faces_of(corners, [[f32::NAN, 0.0], [0.5; 2], [0.5; 2]]);
                assert_eq!(kind, Kind::Unfolded(axis as u8 + if sign < 0.0 { 3 } else { 0 }));
                assert_eq!(area, 1.0);
            }
        }
    }

    #[test]
    fn what_has_no_area_is_a_line_or_a_spot() {
        let flat = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 1e-4, 0.0]];
        assert_eq!(faces_of(flat, [[0.0, 0.0], [0.5, 0.5], [1.0, 1.0]]).0, Kind::Line);
        assert_eq!(faces_of(flat, [[f32::INFINITY, 0.0], [0.5, 0.5], [1.0, 1.0]]).0, Kind::Spot);
        assert_eq!(faces_of([[f32::NAN; 3]; 3], [[0.5; 2]; 3]).0, Kind::Line);
    }
}
