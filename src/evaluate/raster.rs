//! Which triangle each sample of an image sees.
//!
//! Rasterization in homogeneous coordinates (Olano & Greer, "Triangle scan conversion using 2D
//! homogeneous coordinates", Graphics Hardware 1997): for corners p₀ p₁ p₂ in the camera's frame and
//! a ray q = (x, y, 1) the numbers eᵢ = q·(pⱼ × pₖ) are the barycentrics times their sum Σe, and the
//! ray meets the plane at depth p₀·(p₁ × p₂) / Σe. So nothing is clipped, a triangle may reach
//! behind the camera, barycentrics are perspective-correct, and their change from pixel to pixel is
//! known in closed form.
//!
//! Two triangles that share an edge compute its number from the same two points, one as the exact
//! negative of the other: no sample between them is missed. A sample on the edge belongs to both,
//! and of equal depths the triangle that comes first in the scene stays.

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::camera::Camera;
use super::scene::Scene;

/// Samples per pixel along each axis.
pub(super) const SAMPLES: usize = 2;

/// No triangle.
pub(super) const NONE: u32 = u32::MAX;

/// A scene's vertices as one camera sees them.
pub(super) struct View<'a> {
    pub(super) scene: &'a Scene,
    pub(super) camera: &'a Camera,
    /// Pixels per axis.
    pub(super) resolution: usize,
    /// One per vertex, in the camera's frame.
    points: Vec<DVec3>,
}

impl<'a> View<'a> {
    pub(super) fn new(scene: &'a Scene, camera: &'a Camera, resolution: usize) -> Self {
        let points = scene.positions.iter().map(|point| camera.to_view(*point)).collect();
        Self { scene, camera, resolution, points }
    }

    /// Samples per axis.
    pub(super) fn size(&self) -> usize {
        self.resolution * SAMPLES
    }

    /// Where a point of the image, in samples from its top left corner, lies at depth 1.
    pub(super) fn ray(&self, at: DVec2) -> DVec3 {
        let scaled = (2.0 * at / self.size() as f64 - 1.0) * self.camera.half_width;
        DVec3::new(scaled.x, -scaled.y, 1.0)
    }

    /// Where a point of the camera's frame lies in the image, in samples from its top left corner.
    fn place(&self, point: DVec3) -> DVec2 {
        let scale = self.size() as f64 * 0.5;
        let tangent = point.truncate() / (point.z * self.camera.half_width);
        DVec2::new(1.0 + tangent.x, 1.0 - tangent.y) * scale
    }

    /// The triangle, ready to be intersected; nothing if it names a vertex that is not there, or is
    /// seen from no side.
    pub(super) fn facet(&self, triangle: usize) -> Option<Facet> {
        let [a, b, c] = self.scene.triangles[triangle];
        let point = |vertex: u32| self.points.get(vertex as usize).copied();
        Facet::new(triangle, [point(a)?, point(b)?, point(c)?])
    }
}

/// A triangle as intersected with rays from the eye.
pub(super) struct Facet {
    /// Its index in the scene.
    pub(super) triangle: usize,
    /// Whether the eye sees the side from which the corners run counter-clockwise.
    pub(super) front: bool,
    /// In the camera's frame.
    corners: [DVec3; 3],
    /// The numbers e of a ray are `edges · ray`, one per column's coordinate; at least 0 inside.
    edges: DMat3,
    /// Six times the volume of triangle and eye, above 0.
    volume: f64,
}

/// A point of a triangle under an image point.
pub(super) struct Hit {
    pub(super) barycentrics: Vec3,
    /// Change of the barycentrics from one pixel to the next to the right.
    pub(super) dx: Vec3,
    /// The same for the next pixel up.
    pub(super) dy: Vec3,
}

impl Facet {
    fn new(triangle: usize, corners: [DVec3; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let edge = b.cross(c);
        let volume = a.dot(edge);
        if !volume.is_finite() || volume == 0.0 {
            return None;
        }
        let front = volume > 0.0;
        let edges = DMat3::from_cols(edge, c.cross(a), a.cross(b)).transpose();
        let edges = if front { edges } else { -edges };
        Some(Self { triangle, front, corners, edges, volume: volume.abs() })
    }

    /// Unit normal in the camera's frame, towards the eye; zero if rounding leaves none.
    pub(super) fn normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        // Its dot product with a corner has the sign of the signed volume.
        if self.front { -normal } else { normal }
    }

    /// The numbers e at an image point, in samples, and their change from one sample to the next to the
    /// right and down.
    pub(super) fn numbers(&self, view: &View<'_>, at: DVec2) -> [DVec3; 3] {
        let sample = 2.0 * view.camera.half_width / view.size() as f64;
        let DMat3 { x_axis, y_axis, .. } = self.edges;
        [self.edges * view.ray(at), x_axis * sample, y_axis * -sample]
    }

    /// The point under an image point inside the triangle.
    pub(super) fn hit(&self, view: &View<'_>, at: DVec2) -> Hit {
        let [numbers, right, down] = self.numbers(view, at);
        let sum = numbers.element_sum();
        let barycentrics = numbers / sum;
        // The quotient rule on eᵢ / Σe.
        let change = |numbers: DVec3| {
            let pixel = numbers * SAMPLES as f64;
            ((pixel - barycentrics * pixel.element_sum()) / sum).as_vec3()
        };
        Hit { barycentrics: barycentrics.as_vec3(), dx: change(right), dy: change(-down) }
    }
}

/// The nearest triangle at each sample.
pub(super) struct Layer {
    /// One per sample, row-major from the top; [`NONE`] where nothing is seen.
    pub(super) triangles: Vec<u32>,
    /// One per sample: 1 / depth, in 1/m; 0 where nothing is seen.
    inverse_depths: Vec<f32>,
}

impl Layer {
    pub(super) fn new(view: &View<'_>) -> Self {
        let samples = view.size() * view.size();
        Self { triangles: vec![NONE; samples], inverse_depths: vec![0.0; samples] }
    }

    /// 1 / depth at a sample, 0 where nothing is seen.
    pub(super) fn nearness(&self, sample: usize) -> f32 {
        self.inverse_depths[sample]
    }

    /// Draws a triangle where it is nearer than what the layer and `solid` hold and `keep` says so
    /// of the sample, by its column and row.
    pub(super) fn draw(
        &mut self,
        view: &View<'_>,
        facet: &Facet,
        solid: Option<&Self>,
        mut keep: impl FnMut([usize; 2]) -> bool,
    ) {
        let Some([left, top, right, bottom]) = bounds(view, facet) else { return };
        let nearest = 1.0 / view.camera.near;
        let per_depth = 1.0 / facet.volume;
        let slopes = facet.edges.x_axis * (view.ray(DVec2::X).x - view.ray(DVec2::ZERO).x);
        let inverses = -slopes.recip();
        let slope = slopes.element_sum() * per_depth;
        for y in top..=bottom {
            // The numbers over the row are slopes · x + starts.
            let starts = facet.edges * view.ray(DVec2::new(0.5, y as f64 + 0.5));
            let start = starts.element_sum() * per_depth;
            let (mut first, mut end) = (left, right + 1);
            clip(slopes.x, starts.x, inverses.x, &mut first, &mut end);
            clip(slopes.y, starts.y, inverses.y, &mut first, &mut end);
            clip(slopes.z, starts.z, inverses.z, &mut first, &mut end);
            let row = y * view.size();
            for x in first..end {
                let inverse_depth = slope * x as f64 + start;
                let (sample, nearness) = (row + x, inverse_depth as f32);
                if nearness > self.inverse_depths[sample]
                    && inverse_depth <= nearest
                    && solid.is_none_or(|solid| nearness > solid.inverse_depths[sample])
                    && keep([x, y])
                {
                    self.triangles[sample] = facet.triangle as u32;
                    self.inverse_depths[sample] = nearness;
                }
            }
        }
    }
}

/// Narrows a range to the x for which `slope · x + start`, as rounded, is at least 0: all of them lie
/// together, as neither rounding nor the line turns back. `inverse` is about −1 / slope.
#[inline]
fn clip(slope: f64, start: f64, inverse: f64, first: &mut usize, end: &mut usize) {
    let is_inside = |x: usize| slope * x as f64 + start >= 0.0;
    let (low, high) = (*first, *end);
    if low >= high {
        return;
    }
    // Where the line is 0 but for rounding; then stepped to where it is.
    let mut cut = ((start * inverse) as usize).clamp(low, high);
    if slope > 0.0 {
        while cut > low && is_inside(cut - 1) {
            cut -= 1;
        }
        while cut < high && !is_inside(cut) {
            cut += 1;
        }
        *first = cut;
    } else if slope < 0.0 {
        while cut < high && is_inside(cut) {
            cut += 1;
        }
        while cut > low && !is_inside(cut - 1) {
            cut -= 1;
        }
        *end = cut;
    } else if !is_inside(low) {
        *end = low;
    }
}

/// The samples `[left, top, right, bottom]`, all included, that a triangle may cover; nothing if it
/// lies outside the frame.
fn bounds(view: &View<'_>, facet: &Facet) -> Option<[usize; 4]> {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let mut reach = |place: DVec2| {
        low = low.min(place);
        high = high.max(place);
    };
    let near = view.camera.near;
    if facet.corners.iter().all(|corner| corner.z >= near) {
        facet.corners.iter().for_each(|&corner| reach(view.place(corner)));
    } else {
        for slot in 0..3 {
            let (from, to) = (facet.corners[slot], facet.corners[(slot + 1) % 3]);
            if from.z >= near {
                reach(view.place(from));
            }
            if (from.z >= near) != (to.z >= near) {
                let crossing = from.lerp(to, (near - from.z) / (to.z - from.z));
                reach(view.place(DVec3::new(crossing.x, crossing.y, near)));
            }
        }
    }
    // A sample that rounding adds is refused by its barycentrics.
    let first = |at: f64| {
        let at = (at - 0.5 - 1e-6).max(0.0);
        (at as usize).saturating_add(usize::from(at > (at as usize) as f64))
    };
    let last = |at: f64| (at - 0.5 + 1e-6).min(view.size() as f64 - 1.0);
    let [right, bottom] = [last(high.x), last(high.y)];
    let [left, top] = [first(low.x), first(low.y)];
    (left as f64 <= right && top as f64 <= bottom).then_some([
        left,
        top,
        right as usize,
        bottom as usize,
    ])
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;

    fn camera() -> Camera {
        Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, std::f64::consts::FRAC_PI_2, 0.1)
    }

    fn draw_all(scene: &Scene) -> Layer {
        let camera = camera();
        let view = View::new(scene, &camera, 8);
        let mut layer = Layer::new(&view);
        for triangle in 0..scene.triangles.len() {
            if let Some(facet) = view.facet(triangle) {
                layer.draw(&view, &facet, None, |_| true);
            }
        }
        layer
    }

    /// A fan of triangles around `middle` whose rim is the frame seen at depth 1 and more.
    fn fan(middle: Vec3, rim: usize) -> Scene {
        let mut positions = vec![middle];
        positions.extend((0..rim).map(|i| {
            let angle = std::f32::consts::TAU * i as f32 / rim as f32;
            Vec3::new(angle.cos() * 2.2, angle.sin() * 2.2, -1.0)
        }));
        let rim = rim as u32;
        let triangles = (0..rim).map(|i| [0, 1 + i, 1 + (i + 1) % rim]).collect();
        Scene { positions, triangles, ..Scene::default() }
    }

    #[test]
    fn the_nearer_triangle_is_seen_and_the_first_of_equals() {
        let at =
            |z: f32| [Vec3::new(-9.0, -9.0, z), Vec3::new(9.0, -9.0, z), Vec3::new(0.0, 9.0, z)];
        let scene = Scene {
            positions: [at(-2.0), at(-1.5), at(-1.5)].concat(),
            triangles: vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]],
            ..Scene::default()
        };
        let layer = draw_all(&scene);
        assert_eq!(layer.triangles[8 * 16 + 8], 1);
        assert!((layer.inverse_depths[8 * 16 + 8] - 1.0 / 1.5).abs() < 1e-6);
    }

    #[test]
    fn a_triangle_that_reaches_behind_the_camera_is_seen_up_to_the_near_plane() {
        // A floor one metre below the eye, from far behind it to far ahead.
        let scene = Scene {
            positions: vec![
                Vec3::new(0.0, -1.0, -1000.0),
                Vec3::new(-1000.0, -1.0, 1000.0),
                Vec3::new(1000.0, -1.0, 1000.0),
            ],
            triangles: vec![[0, 1, 2]],
            ..Scene::default()
        };
        let layer = draw_all(&scene);
        let column: Vec<_> = (0..16).map(|y| layer.triangles[y * 16 + 8]).collect();
        assert_eq!(column[..8], [NONE; 8]);
        assert_eq!(column[8..], [0; 8]);
        // A ray that falls by t meets the floor at depth 1/t.
        for y in 8..16 {
            let fall = (y as f32 + 0.5) / 8.0 - 1.0;
            assert!((layer.inverse_depths[y * 16 + 8] - fall).abs() < 1e-6);
        }
    }

    #[test]
    fn barycentrics_change_from_pixel_to_pixel_as_the_derivative_says() {
        let scene = fan(Vec3::new(0.2, 0.1, -3.0), 3);
        let camera = camera();
        let view = View::new(&scene, &camera, 1000);
        let facet = view.facet(0).unwrap();
        let at = DVec2::new(1000.0, 900.0);
        let step = SAMPLES as f64;
        let change = |step: DVec2| {
            let [before, after] = [at - step, at + step].map(|at| facet.hit(&view, at));
            (after.barycentrics - before.barycentrics) / 2.0
        };
        let hit = facet.hit(&view, at);
        assert!((hit.dx - change(DVec2::X * step)).length() < 1e-6);
        assert!((hit.dy - change(DVec2::NEG_Y * step)).length() < 1e-6);
        assert!((hit.barycentrics.element_sum() - 1.0).abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn no_sample_between_triangles_is_missed(
            x in -0.5f32..0.5, y in -0.5f32..0.5, z in -4.0f32..-0.5, rim in 4usize..40,
        ) {
            let layer = draw_all(&fan(Vec3::new(x, y, z), rim));
            prop_assert!(layer.triangles.iter().all(|triangle| *triangle != NONE));
        }

        #[test]
        fn any_numbers_are_drawn_or_skipped(
            numbers in prop::collection::vec(
                prop_oneof![any::<f32>(), -2.0f32..2.0, Just(0.0), Just(f32::NAN)], 9,
            ),
            bad in 0u32..5,
        ) {
            let positions = numbers.chunks(3).map(Vec3::from_slice).collect();
            let triangles = vec![[0, 1, 2], [0, 0, 1], [1, 2, bad]];
            let layer = draw_all(&Scene { positions, triangles, ..Scene::default() });
            prop_assert!(layer.inverse_depths.iter().all(|depth| (0.0..=10.001).contains(depth)));
        }
    }
}
