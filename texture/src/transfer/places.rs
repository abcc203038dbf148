//! The places of texels that lie beside each other, found together.
//!
//! In a block of texels the source's triangles around it are listed once for each chart (see
//! [`Vicinity`]); texels look at those. What a list can't tell is searched for in the whole source.
//!
//! Guaranteed: the places are those that [`Source::find`](super::correspond::Source::find) finds.

use glam::{DVec2, Vec3};
use seamwise_attr::Vicinity;

use super::Pair;
use super::correspond::LevelPoint;
use super::level_face::LevelFace;
use super::owners::{MOST_OWNERS, Spot};
use super::shading_mesh::{ShadingTriangle, SurfacePoint};

/// Texels along each side of a block.
pub(super) const BLOCK: usize = 8;
/// The most lists that are made in a block: where charts or sheets of the source change from texel to
/// texel none is of use for long.
const MOST_LISTS: usize = 6;

/// The triangles around a block on one chart.
#[derive(Default)]
struct List {
    pair: u32,
    group: u32,
    chart: u32,
    vicinity: Vicinity,
}

/// What is known of the places of a block.
#[derive(Default)]
pub(super) struct Places {
    lists: Vec<List>,
    /// How many of the lists are those of the block.
    count: usize,
    /// How many were made for it.
    made: usize,
    /// The middle and half the diagonal of the block, in parts of texels.
    middle: DVec2,
    radius: f64,
    /// The pair and the place that was searched for before, one per owner of a texel.
    last: [Option<(u32, SurfacePoint)>; MOST_OWNERS],
    /// The pair and the triangle of the source that were looked at before.
    triangle: Option<(u32, usize, ShadingTriangle)>,
}

/// What is looked for: the place of a texel in a face, which is one of its owners.
pub(super) struct Wanted<'a> {
    pub(super) pair: u32,
    pub(super) owner: usize,
    pub(super) face: &'a LevelFace,
    pub(super) spot: Spot,
    /// Its center in the image, in parts of texels.
    pub(super) center: DVec2,
}

impl Places {
    /// Begins a block of so many parts of texels each way; with 0 a place alone.
    pub(super) fn begin(&mut self, [x, y]: [usize; 2], side: usize) {
        let half = side as f64 * 0.5;
        (self.count, self.made) = (0, 0);
        self.middle = DVec2::new(x as f64, y as f64) + half;
        self.radius = half * std::f64::consts::SQRT_2;
    }

    /// The place of a point.
    #[inline]
    pub(super) fn find(
        &mut self,
        pair: &Pair<'_>,
        point: &LevelPoint,
        wanted: &Wanted<'_>,
    ) -> Option<SurfacePoint> {
        let known = self.lists[..self.count].iter().position(|list| {
            (list.pair, list.group, list.chart) == (wanted.pair, point.group, point.chart)
        });
        let found = known.and_then(|at| pair.source.find_among(point, &self.lists[at].vicinity));
        if found.is_some() {
            return found;
        }
        let last = &mut self.last[wanted.owner];
        let guess = last.filter(|last| last.0 == wanted.pair).map(|last| last.1);
        let found = pair.source.find(point, guess)?;
        *last = Some((wanted.pair, found));
        if self.made < MOST_LISTS && self.radius > 0.0 {
            self.made += 1;
            let at = known.unwrap_or(self.count);
            let about = match known {
                None => self.about(wanted),
                // The block lies otherwise there than its face has it.
                Some(_) => (point.position, self.about(wanted).1),
            };
            if at == self.count {
                self.count += 1;
                self.lists.resize_with(self.lists.len().max(self.count), List::default);
            }
            let list = &mut self.lists[at];
            (list.pair, list.group, list.chart) = (wanted.pair, point.group, point.chart);
            pair.source.gather(about, point, found, &mut list.vicinity);
        }
        Some(found)
    }

    /// The middle of the block in the plane of a face, and its radius there.
    fn about(&self, wanted: &Wanted<'_>) -> (Vec3, f32) {
        let middle = wanted.spot.center + self.middle - wanted.center;
        let at = |off: DVec2| wanted.face.position_at(middle + off);
        let place = at(DVec2::ZERO);
        let half = self.radius * std::f64::consts::FRAC_1_SQRT_2;
        let corners = [DVec2::new(half, half), DVec2::new(half, -half)].map(at);
        (place, corners.map(|corner| corner.distance(place)).into_iter().fold(0.0, f32::max))
    }

    /// The triangle of the source that a place lies on.
    #[inline]
    pub(super) fn triangle(
        &mut self,
        number: u32,
        pair: &Pair<'_>,
        place: SurfacePoint,
    ) -> &ShadingTriangle {
        let is_known =
            self.triangle.as_ref().is_some_and(|own| (own.0, own.1) == (number, place.triangle));
        if !is_known {
            self.triangle = None;
        }
        let found = || (number, place.triangle, pair.source.triangle(place.triangle));
        &self.triangle.get_or_insert_with(found).2
    }
}
