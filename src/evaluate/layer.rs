//! Which triangle each sample of a rectangle of an image sees.
//!
//! Two triangles that share an edge compute its number (see `raster`) from the same two points, one as
//! the exact negative of the other: no sample between them is missed. A sample on the edge belongs to
//! both, and of equal depths the triangle that comes first in the scene stays.

use glam::{DVec2, DVec3};

use super::raster::{Facet, View};

/// Triangles of at most so many samples across are drawn by a test of each sample, wider ones by where
/// their edges cut a row.
const NARROW: usize = 24;

/// No triangle.
pub(super) const NONE: u32 = u32::MAX;

/// The nearest triangle at each sample of a rectangle.
#[derive(Default)]
pub(super) struct Layer {
    /// Left and top of the rectangle, in samples of the image.
    corner: [usize; 2],
    /// Its width and height.
    size: [usize; 2],
    /// One per sample, row-major from the top: the number by which a triangle was drawn; [`NONE`] where
    /// nothing is seen.
    pub(super) triangles: Vec<u32>,
    /// One per sample: 1 / depth, in 1/m; 0 where nothing is seen.
    inverse_depths: Vec<f32>,
}

impl Layer {
    /// Makes it that of a rectangle in which nothing is seen yet: left and top, width and height, in
    /// samples of the image. The left is a multiple of 8.
    pub(super) fn begin(&mut self, corner: [usize; 2], size: [usize; 2]) {
        (self.corner, self.size) = (corner, size);
        self.triangles.clear();
        self.triangles.resize(size[0] * size[1], NONE);
        self.inverse_depths.clear();
        self.inverse_depths.resize(size[0] * size[1], 0.0);
    }

    /// 1 / depth at a sample, 0 where nothing is seen.
    pub(super) fn nearness(&self, sample: usize) -> f32 {
        self.inverse_depths[sample]
    }

    /// The samples that a triangle may cover, as [`bounds`].
    #[inline(always)]
    fn bounds(&self, view: &View<'_>, facet: &Facet) -> Option<[usize; 4]> {
        let [left, top, right, bottom] = bounds(view, facet)?;
        let ([x, y], [width, height]) = (self.corner, self.size);
        let (right, bottom) = (right.min(x + width - 1), bottom.min(y + height - 1));
        let (left, top) = (left.max(x), top.max(y));
        (left <= right && top <= bottom).then_some([left, top, right, bottom])
    }

    /// The place of the first sample of a row of the image.
    #[inline(always)]
    fn row(&self, y: usize) -> usize {
        (y - self.corner[1]) * self.size[0]
    }

    /// Draws a triangle by a number where it is nearer than what the layer holds.
    #[inline(always)]
    pub(super) fn cover(&mut self, view: &View<'_>, facet: &Facet, triangle: u32) {
        let Some([left, top, right, bottom]) = self.bounds(view, facet) else { return };
        let (nearest, planes) = (1.0 / view.camera.near, Planes::new(view, facet));
        let is_narrow = right - left < NARROW;
        // Whole vectors: a sample beyond the bounds lies outside.
        let last = self.corner[0] + self.size[0];
        let [from, to] = [left & !7, (right + 1).next_multiple_of(8).min(last)];
        for y in top..=bottom {
            let line = planes.line(view, facet, y);
            let [first, end] =
                if is_narrow { [from, to] } else { line.clip(&planes, left, right + 1) };
            if first < end {
                let row = self.row(y);
                let samples = row + first - self.corner[0]..row + end - self.corner[0];
                let triangles = &mut self.triangles[samples.clone()];
                let depths = &mut self.inverse_depths[samples][..triangles.len()];
                for k in 0..triangles.len() {
                    let x = f64::from((first as i32).wrapping_add(k as i32));
                    let inverse_depth = planes.slope * x + line.start;
                    let nearness = inverse_depth as f32;
                    let is_seen = planes.is_inside(&line, x)
                        & (nearness > depths[k])
                        & (inverse_depth <= nearest);
                    triangles[k] = if is_seen { triangle } else { triangles[k] };
                    depths[k] = if is_seen { nearness } else { depths[k] };
                }
            }
        }
    }

    /// Draws a triangle by a number where it is nearer than what the layer and `solid`, of the same
    /// rectangle, hold and `keep` says so of the sample, by its column and row in the image.
    pub(super) fn draw(
        &mut self,
        view: &View<'_>,
        facet: &Facet,
        triangle: u32,
        solid: Option<&Self>,
        mut keep: impl FnMut([usize; 2]) -> bool,
    ) {
        let Some([left, top, right, bottom]) = self.bounds(view, facet) else { return };
        let (nearest, planes) = (1.0 / view.camera.near, Planes::new(view, facet));
        for y in top..=bottom {
            let line = planes.line(view, facet, y);
            let [first, end] = line.clip(&planes, left, right + 1);
            let row = self.row(y);
            for x in first..end {
                let inverse_depth = planes.slope * x as f64 + line.start;
                let (sample, nearness) = (row + x - self.corner[0], inverse_depth as f32);
                if nearness > self.inverse_depths[sample]
                    && inverse_depth <= nearest
                    && solid.is_none_or(|solid| nearness > solid.inverse_depths[sample])
                    && keep([x, y])
                {
                    self.triangles[sample] = triangle;
                    self.inverse_depths[sample] = nearness;
                }
            }
        }
    }
}

/// What changes from sample to sample of a row.
struct Planes {
    /// Change of the numbers e to the next sample.
    slopes: DVec3,
    /// About −1 / slope.
    inverses: DVec3,
    /// Change of the inverse depth.
    slope: f64,
    per_depth: f64,
}

/// A row of samples: the numbers over it are slopes · x + starts.
struct Line {
    starts: DVec3,
    /// That of the inverse depth.
    start: f64,
}

impl Planes {
    #[inline(always)]
    fn new(view: &View<'_>, facet: &Facet) -> Self {
        let per_depth = 1.0 / facet.volume;
        let slopes = facet.edges.x_axis * (view.ray(DVec2::X).x - view.ray(DVec2::ZERO).x);
        let slope = slopes.element_sum() * per_depth;
        Self { slopes, inverses: -slopes.recip(), slope, per_depth }
    }

    #[inline(always)]
    fn line(&self, view: &View<'_>, facet: &Facet, y: usize) -> Line {
        let starts = facet.edges * view.ray(DVec2::new(0.5, y as f64 + 0.5));
        Line { starts, start: starts.element_sum() * self.per_depth }
    }

    /// Whether a sample of a row lies inside, as `Line::clip` finds it.
    #[inline(always)]
    fn is_inside(&self, line: &Line, x: f64) -> bool {
        let (slopes, starts) = (self.slopes, line.starts);
        (slopes.x * x + starts.x >= 0.0)
            & (slopes.y * x + starts.y >= 0.0)
            & (slopes.z * x + starts.z >= 0.0)
    }
}

impl Line {
    /// The part of a range that lies inside.
    #[inline(always)]
    fn clip(&self, planes: &Planes, mut first: usize, mut end: usize) -> [usize; 2] {
        let Planes { slopes, inverses, .. } = planes;
        clip(slopes.x, self.starts.x, inverses.x, &mut first, &mut end);
        clip(slopes.y, self.starts.y, inverses.y, &mut first, &mut end);
        clip(slopes.z, self.starts.z, inverses.z, &mut first, &mut end);
        [first, end]
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
pub(super) fn bounds(view: &View<'_>, facet: &Facet) -> Option<[usize; 4]> {
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

    use super::super::camera::Camera;
    use super::super::scene::Scene;
    use super::*;

    fn camera() -> Camera {
        Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, std::f64::consts::FRAC_PI_2, 0.1)
    }

    fn draw_all(scene: &Scene) -> Layer {
        let camera = camera();
        let view = View::new(scene, &camera, 8);
        let facets = || (0..scene.triangles.len()).filter_map(|triangle| view.facet(triangle));
        let draw = |corner: [usize; 2], size: [usize; 2]| {
            let [mut layer, mut tested] = [Layer::default(), Layer::default()];
            layer.begin(corner, size);
            tested.begin(corner, size);
            for facet in facets() {
                layer.cover(&view, &facet, facet.triangle as u32);
                tested.draw(&view, &facet, facet.triangle as u32, None, |_| true);
            }
            assert_eq!(layer.triangles, tested.triangles);
            layer
        };
        let layer = draw([0, 0], [16, 16]);
        let part = draw([8, 4], [7, 9]);
        for (at, triangle) in part.triangles.iter().enumerate() {
            assert_eq!(*triangle, layer.triangles[(4 + at / 7) * 16 + 8 + at % 7]);
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
