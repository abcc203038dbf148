//! A triangle's attributes at any sample of a tile of the image.
//!
//! Its numbers e (see `raster`) are taken in f64 once, at the middle of the tile, and go on from there
//! in f32: within a tile they differ by so little that nothing is lost. A patch knows nothing but its
//! triangle and its tile, so the order in which samples are asked for does not show.

use glam::{DVec2, DVec3, Vec2, Vec4};

use super::raster::{Facet, SAMPLES, View};
use super::scene::Scene;

/// Samples along each side of a tile.
pub(super) const TILE: usize = 64;

/// A triangle as its samples within one tile are shaded.
pub(super) struct Patch {
    /// The index of its material; that of none if the scene names none.
    pub(super) material: u32,
    /// Whether the eye sees the side from which the corners run counter-clockwise.
    pub(super) front: bool,
    /// In samples.
    middle: Vec2,
    /// e of the second and third corner and Σe at the middle of the tile, and their change to the next
    /// sample to the right and down; on any scale.
    numbers: [Vec4; 3],
    /// Shading normal, and the sign of the bitangent.
    normal: Corners,
    tangent: Corners,
    color: Corners,
    /// Both UV sets.
    uvs: Corners,
}

/// The attributes of a point of a patch.
pub(super) struct Point {
    /// Not made unit; the sign of the bitangent in `w`.
    pub(super) normal: Vec4,
    /// Not made unit.
    pub(super) tangent: Vec4,
    pub(super) color: Vec4,
    /// Both UV sets.
    pub(super) uvs: Vec4,
}

/// Four numbers at each corner, the second and third as differences to the first.
struct Corners([Vec4; 3]);

impl Corners {
    fn new([a, b, c]: [Vec4; 3]) -> Self {
        Self([a, b - a, c - a])
    }

    /// Exactly the values at the corners where these are equal.
    #[inline(always)]
    fn at(&self, [y, z]: [f32; 2]) -> Vec4 {
        self.0[0] + self.change([y, z])
    }

    #[inline(always)]
    fn change(&self, [y, z]: [f32; 2]) -> Vec4 {
        self.0[1] * y + self.0[2] * z
    }
}

impl Patch {
    /// Takes a triangle for the tile that holds the sample of a column and a row. Attributes that the
    /// scene lacks are white (color) or zero.
    pub(super) fn new(view: &View<'_>, facet: &Facet, [x, y]: [usize; 2]) -> Self {
        let middle = DVec2::new((x / TILE) as f64, (y / TILE) as f64) * TILE as f64
            + DVec2::splat(TILE as f64 * 0.5);
        let numbers = facet.numbers(view, middle);
        // Σe may be 0 at the middle, where the triangle need not be; the greatest of all is not.
        let greatest = numbers.map(|e| e.abs().max_element()).into_iter().fold(0.0, f64::max);
        let relative =
            |e: DVec3| (DVec3::new(e.y, e.z, e.element_sum()) / greatest).as_vec3().extend(0.0);
        let scene: &Scene = view.scene;
        let [a, b, c] = scene.triangles[facet.triangle];
        let [a, b, c] = [a as usize, b as usize, c as usize];
        let tangents = scene.tangents.get(facet.triangle).copied().unwrap_or_default();
        let sign = if tangents[0].w < 0.0 { -1.0 } else { 1.0 };
        let normal = |v: usize| scene.normals.get(v).map_or(Vec4::ZERO, |n| n.extend(0.0));
        let uv = |set: usize, v: usize| scene.uvs[set].get(v).copied().unwrap_or(Vec2::ZERO);
        let uvs = |v: usize| Vec4::from((uv(0, v), uv(1, v)));
        let color = |v: usize| scene.colors.get(v).copied().unwrap_or(Vec4::ONE);
        Self {
            material: scene.triangle_materials.get(facet.triangle).copied().unwrap_or(u32::MAX),
            front: facet.front,
            middle: middle.as_vec2(),
            numbers: numbers.map(relative),
            normal: Corners::new([normal(a), normal(b), normal(c)].map(|n| n.with_w(sign))),
            tangent: Corners::new(tangents),
            color: Corners::new([color(a), color(b), color(c)]),
            uvs: Corners::new([uvs(a), uvs(b), uvs(c)]),
        }
    }

    /// The attributes at a place in the image, in samples.
    #[inline(always)]
    pub(super) fn at(&self, at: Vec2) -> Point {
        let weights = self.weights(at);
        Point {
            normal: self.normal.at(weights),
            tangent: self.tangent.at(weights),
            color: self.color.at(weights),
            uvs: self.uvs.at(weights),
        }
    }

    /// The barycentrics of the second and third corner.
    #[inline(always)]
    fn weights(&self, at: Vec2) -> [f32; 2] {
        let e = self.numbers_at(at);
        let weights = e / e.z;
        [weights.x, weights.y]
    }

    #[inline(always)]
    fn numbers_at(&self, at: Vec2) -> Vec4 {
        let off = at - self.middle;
        self.numbers[0] + self.numbers[1] * off.x + self.numbers[2] * off.y
    }

    /// The change of both UV sets at a place in the image from one pixel to the next to the right, and
    /// down.
    #[inline(always)]
    pub(super) fn uv_steps(&self, at: Vec2) -> [Vec4; 2] {
        let e = self.numbers_at(at);
        let (y, z) = (e.x / e.z, e.y / e.z);
        // The quotient rule on eᵢ / Σe.
        let change = |step: Vec4| {
            let step = step * (SAMPLES as f32 / e.z);
            self.uvs.change([step.x - y * step.z, step.y - z * step.z])
        };
        [change(self.numbers[1]), change(self.numbers[2])]
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::camera::Camera;
    use super::*;

    /// A triangle that fills the view and leans away from the eye.
    fn scene() -> Scene {
        Scene {
            positions: vec![
                Vec3::new(-3.0, -2.0, -1.0),
                Vec3::new(4.0, -3.0, -6.0),
                Vec3::new(0.0, 5.0, -3.0),
            ],
            uvs: [vec![Vec2::ZERO, Vec2::X, Vec2::Y], Vec::new()],
            triangles: vec![[0, 1, 2]],
            ..Scene::default()
        }
    }

    #[test]
    fn attributes_are_those_of_the_point_under_the_sample_in_every_tile() {
        let scene = scene();
        let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, 1.0, 0.1);
        let view = View::new(&scene, &camera, 96);
        let facet = view.facet(0).unwrap();
        for (x, y) in [(0, 0), (63, 63), (64, 64), (100, 90), (191, 10), (70, 191)] {
            let patch = Patch::new(&view, &facet, [x, y]);
            let at = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            let hit = facet.hit(&view, at);
            let uv = patch.at(at.as_vec2()).uvs;
            assert!((uv.x - hit.barycentrics.y).abs() < 1e-5);
            assert!((uv.y - hit.barycentrics.z).abs() < 1e-5);
            let [right, down] = patch.uv_steps(at.as_vec2());
            assert!((right.x - hit.dx.y).abs() < 1e-6 && (right.y - hit.dx.z).abs() < 1e-6);
            assert!((down.x + hit.dy.y).abs() < 1e-6 && (down.y + hit.dy.z).abs() < 1e-6);
        }
    }

    #[test]
    fn what_the_scene_lacks_is_white_or_zero() {
        let scene = scene();
        let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, 1.0, 0.1);
        let view = View::new(&scene, &camera, 96);
        let patch = Patch::new(&view, &view.facet(0).unwrap(), [96, 96]);
        let point = patch.at(Vec2::splat(96.5));
        assert_eq!((point.color, point.normal, point.tangent), (Vec4::ONE, Vec4::W, Vec4::ZERO));
    }
}
