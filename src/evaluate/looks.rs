//! Base color and shading normal at a point of a scene's surface, and triangles whose UVs fold over.

use glam::{DVec3, Vec2, Vec3, Vec4};
use seamwise_attr::{Sample, TriangleId, area_vector};
use seamwise_texture::color::SrgbCurve;

use super::appearance::Appearance;
use super::distance::Correspondence;
use super::scene::{Scene, TextureRef};

impl Scene {
    /// The UVs of a triangle's corners in set 0; zero if there is none.
    fn corner_uvs(&self, triangle: TriangleId) -> [Vec2; 3] {
        let uv = |vertex: u32| self.uvs[0].get(vertex as usize).copied().unwrap_or_default();
        self.triangles[triangle].map(uv)
    }

    /// Twice the signed area of a triangle's UVs in set 0.
    fn uv_area(&self, triangle: TriangleId) -> f32 {
        let [a, b, c] = self.corner_uvs(triangle);
        (b - a).perp_dot(c - a)
    }

    fn longest_uv_edge(&self, triangle: TriangleId) -> f32 {
        let [a, b, c] = self.corner_uvs(triangle);
        a.distance(b).max(b.distance(c)).max(c.distance(a))
    }

    /// The UV in set 0 at a point of the surface.
    fn uv(&self, at: &Sample) -> Vec2 {
        let [a, b, c] = self.corner_uvs(at.triangle);
        let weights = at.barycentrics.as_vec3();
        a * weights.x + b * weights.y + c * weights.z
    }

    fn area_vector(&self, triangle: TriangleId) -> DVec3 {
        area_vector(self.triangles[triangle].map(|vertex| self.positions[vertex as usize]))
    }

    fn interpolate<T>(&self, values: &[T], triangle: TriangleId, at: Vec3) -> T
    where
        T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
    {
        let [a, b, c] = self.triangles[triangle].map(|vertex| values[vertex as usize]);
        a * at.x + b * at.y + c * at.z
    }

    /// A texture at a point of the surface, at full resolution.
    fn texel(&self, texture: &TextureRef, triangle: TriangleId, at: Vec3) -> Vec4 {
        let uv: Vec2 = self.interpolate(&self.uvs[texture.uv_set], triangle, at);
        let uv = texture.transform.transform_point2(uv);
        Vec4::from_array(texture.mips.sample_bilinear(0, uv, texture.wrap))
    }
}

impl Appearance for Scene {
    fn color(&self, triangle: TriangleId, at: Vec3) -> [f32; 3] {
        let material = &self.materials[self.triangle_materials[triangle] as usize];
        let texel = |texture| self.texel(texture, triangle, at);
        let texture = material.base_color_texture.as_ref().map_or(Vec4::ONE, texel);
        let color = material.base_color * texture * self.interpolate(&self.colors, triangle, at);
        let curve = SrgbCurve::get();
        [color.x, color.y, color.z].map(|x| curve.encode(x.clamp(0.0, 1.0)))
    }

    fn normal(&self, triangle: TriangleId, at: Vec3) -> Vec3 {
        let material = &self.materials[self.triangle_materials[triangle] as usize];
        // Not made unit before the map is applied, as MikkTSpace asks and the renderer does.
        let normal = self.interpolate(&self.normals, triangle, at);
        let Some(map) = &material.normal_texture else {
            return normal.normalize_or_zero();
        };
        let [a, b, c] = self.tangents[triangle];
        let tangent = (a * at.x + b * at.y + c * at.z).truncate();
        let bitangent = normal.cross(tangent) * a.w;
        let mapped = self.texel(map, triangle, at).truncate() * 2.0 - 1.0;
        let scale = material.normal_scale;
        (tangent * (mapped.x * scale) + bitangent * (mapped.y * scale) + normal * mapped.z)
            .normalize_or(normal.normalize_or_zero())
    }
}

/// Triangles of `candidate` that hold samples, all of which lie on triangles of `reference` whose
/// UVs in set 0 run the other way round. `pairs` are those at samples of the candidate; of these
/// only the ones on the same side of the surface and in the same chart count, since the nearest point
/// of a thin wall may be on its back, and charts may be mirrored there.
pub(super) fn count_foldovers(
    reference: &Scene,
    candidate: &Scene,
    pairs: &Correspondence,
) -> usize {
    let mut votes = vec![(0u32, 0u32); candidate.triangles.len()];
    for pair in &pairs.pairs {
        let (own, other) = (pair.sample.triangle, pair.target.triangle);
        let sides = (candidate.area_vector(own), reference.area_vector(other));
        let apart = candidate.uv(&pair.sample).distance(reference.uv(&pair.target));
        if sides.0.dot(sides.1) <= 0.0 || apart > candidate.longest_uv_edge(own) {
            continue;
        }
        let (same, turned) = &mut votes[own];
        if candidate.uv_area(own) * reference.uv_area(other) < 0.0 {
            *turned += 1;
        } else {
            *same += 1;
        }
    }
    votes.iter().filter(|(same, turned)| *same == 0 && *turned > 0).count()
}
