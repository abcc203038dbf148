//! Pairs of points of two surfaces that belong together.

use std::sync::{Arc, OnceLock};

use glam::DVec3;
use rayon::prelude::*;

use super::edges::SheetEdge;
use super::fans::{Fans, NONE};
use super::seams::{Pull, SeamLines};
use super::sheet::{Sheet, SurfacePoint};
use super::silhouettes;
use crate::id::{PointId, TriangleId};
use crate::mesh::Mesh;
use crate::sample::Samples;
use crate::surface::Surface;

/// Seed of the samples; any would do, but it must stay.
const SEED: u64 = 2;
/// Triangles whose samples one thread pairs at least, and pairs that it follows.
const AT_ONCE: usize = 256;
/// Pairs that are farther apart than so many times the mean do not belong together: where a side of a
/// detail is gone, the nearest surface that faces its way may be anywhere. One such pair drew a point
/// of a bag at 1,124 triangles away by a sixth of its height. Lab note (command of [`super::Polish`]):
/// luminance, distance and color over those with all pairs, geometric mean, are 0.992, 0.998 and 1.007
/// with 10; 0.995, 0.994 and 0.994 with 20; 0.997, 0.994 and 1.001 with 40.
const MAX_SPACINGS: f32 = 20.0;

/// Pairs found by a walk that are farther apart than so many times the mean, and than such a share of the
/// least height of the level's triangle, are looked for everywhere: the walk may have ended on a side of a
/// fold, or in what once was another shell.
const LOST_SPACINGS: f32 = 4.0;
const LOST_HEIGHT: f64 = 0.25;
/// Where fewer pairs are lost than one for so many triangles, they are not looked for: the tree that it
/// takes costs more than they tell.
const TRIANGLES_PER_LOST: usize = 200;
/// Surfaces of so few triangles are searched for all pairs: a tree costs nothing there, and each triangle
/// counts. Of a fox of 576 triangles, levels of 288, 144 and 64 are at 1.001, 1.007 and 1.037 of the RMS
/// distance of those with a search if walks alone are believed.
const FEW_TRIANGLES: usize = 4_000;
/// The triangle of a point that no walk has found.
const NOWHERE: TriangleId = TriangleId(NONE);

/// The surface that levels are fitted to.
pub(crate) struct Source<'a> {
    pub(super) sheet: Sheet<'a>,
    /// Made when a walk was lost for the first time.
    surface: OnceLock<Surface>,
    /// Made when a level with seams is fitted.
    seams: OnceLock<SeamLines>,
    /// One per point, or empty if all count alike.
    importance: &'a [f32],
}

impl<'a> Source<'a> {
    pub(crate) fn new(mesh: &'a Mesh, importance: &'a [f32]) -> Self {
        let sheet = Sheet::new(mesh, Arc::new(Fans::of(mesh)));
        Self { surface: OnceLock::new(), seams: OnceLock::new(), sheet, importance }
    }

    fn surface(&self) -> &Surface {
        self.surface.get_or_init(|| self.sheet.surface())
    }

    /// Where `seams` of a level are wanted that has so many samples on a triangle.
    pub(super) fn pulls(&self, level: &Sheet<'_>, seams: &[SheetEdge], density: f64) -> Vec<Pull> {
        if seams.is_empty() {
            return Vec::new();
        }
        let lines = self.seams.get_or_init(|| SeamLines::new(&self.sheet));
        lines.pulls(level, seams, density)
    }

    /// How many times a pair counts: its weight, times the importance of its place on the source.
    #[inline]
    pub(super) fn weight(&self, pair: &Pair) -> f64 {
        if self.importance.is_empty() {
            return f64::from(pair.weight);
        }
        let points = self.sheet.fans.triangles[pair.source.triangle.index()];
        let weights = points.map(|point| f64::from(self.importance[point as usize]));
        f64::from(pair.weight) * pair.source.barycentrics().dot(DVec3::from_array(weights))
    }

    /// That of all of them.
    pub(super) fn total_weight(&self, pairs: &[Pair]) -> f64 {
        pairs.iter().map(|pair| self.weight(pair)).sum()
    }
}

/// A point of the source and its counterpart on the level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) source: SurfacePoint,
    pub(super) level: SurfacePoint,
    /// How many samples of triangles it counts for.
    pub(super) weight: f32,
}

/// Samples of both surfaces, each with the nearest point of the other on the same side.
pub(super) struct Pairs {
    /// The pairs of samples of the source, then those of triangles of the level, then those of its edges.
    pub(super) all: Vec<Pair>,
    /// Number of pairs of samples of the source.
    pub(super) there: usize,
    /// Number of pairs of samples of triangles, of either surface.
    faces: usize,
}

impl Pairs {
    /// Pairs `count` samples of either surface, and some of the level's `edges`, walking from the points of the
    /// source that those of the level stand for. One without a counterpart, or with a far one, is left out.
    pub(super) fn new(
        source: &Source<'_>,
        level: &Sheet<'_>,
        edges: &[SheetEdge],
        point_sources: &[PointId],
        count: usize,
    ) -> Self {
        let nearest = source.sheet.fans.nearest_seeds(point_sources);
        let mut all = samples(&source.sheet, count, |source_point| Pair {
            source: source_point,
            level: walk(level, &source.sheet, &source_point, |p| nearest[p as usize]),
            weight: 1.0,
        });
        let there = all.len();
        drop(nearest);
        let meet = |point: SurfacePoint, weight: f32| {
            let found = walk(&source.sheet, level, &point, |p| point_sources[p as usize].0);
            Pair { source: found, level: point, weight }
        };
        all.extend(samples(level, count, |level_point| meet(level_point, 1.0)));
        let faces = all.len();
        all.extend(silhouettes::samples(level, edges, count, meet));
        let mut pairs = Self { all, there, faces };
        let apart = pairs.find_lost(source, level);
        pairs.without_far(&apart);
        pairs
    }

    /// How far apart the pairs are, infinite where a walk has found none. What walks have lost is looked for
    /// everywhere.
    fn find_lost(&mut self, source: &Source<'_>, level: &Sheet<'_>) -> Vec<f32> {
        let distance = |pair: &Pair| {
            if pair.source.triangle == NOWHERE || pair.level.triangle == NOWHERE {
                return f32::INFINITY;
            }
            source.sheet.place(&pair.source).distance(level.place(&pair.level)) as f32
        };
        let mut apart: Vec<f32> = self.all.par_iter().with_min_len(AT_ONCE).map(distance).collect();
        let far = LOST_SPACINGS * mean(&apart);
        let (there, back) = self.all.split_at_mut(self.there);
        let (apart_there, apart_back) = apart.split_at_mut(there.len());
        let lost_on = |sheet: &Sheet<'_>| {
            let are_few = sheet.fans.triangles.len() <= FEW_TRIANGLES;
            move |pair: &Pair, apart: f32| are_few || apart > far && is_wide(level, pair, apart)
        };
        // Rounded, a distance may be a little less than it is.
        let reach = |apart: f32| f64::from(apart) * (1.0 + 1e-6);
        let lost = lost_on(level);
        if are_many(there, apart_there, level, lost) {
            let surface = level.surface();
            let all = there.par_iter_mut().zip(apart_there).with_min_len(AT_ONCE);
            all.filter(|(pair, apart)| lost(pair, **apart)).for_each(|(pair, apart)| {
                let found = level.find(&surface, &source.sheet, &pair.source, reach(*apart));
                pair.level = found.unwrap_or(pair.level);
                *apart = distance(pair);
            });
        }
        let lost = lost_on(&source.sheet);
        if are_many(back, apart_back, &source.sheet, lost) {
            let surface = source.surface();
            let all = back.par_iter_mut().zip(apart_back).with_min_len(AT_ONCE);
            all.filter(|(pair, apart)| lost(pair, **apart)).for_each(|(pair, apart)| {
                let found = source.sheet.find(surface, level, &pair.level, reach(*apart));
                pair.source = found.unwrap_or(pair.source);
                *apart = distance(pair);
            });
        }
        apart
    }

    /// Keeps those of samples of triangles alone: edges count for positions, not for attributes.
    pub(super) fn leave_edges(&mut self) {
        self.all.truncate(self.faces);
    }

    /// Leaves out what is farther apart than `MAX_SPACINGS` times the mean.
    fn without_far(&mut self, apart: &[f32]) {
        let most = MAX_SPACINGS * mean(apart);
        let is_near = |apart: &f32| apart.is_finite() && *apart <= most;
        let near = |first: usize| apart[..first].iter().filter(|apart| is_near(apart)).count();
        (self.there, self.faces) = (near(self.there), near(self.faces));
        let mut apart = apart.iter();
        self.all.retain(|_| apart.next().is_some_and(is_near));
    }

    /// The samples with their nearest points after the level has moved a little.
    pub(super) fn follow(mut self, source: &Source<'_>, level: &Sheet<'_>) -> Self {
        let source = &source.sheet;
        let (there, back) = self.all.split_at_mut(self.there);
        there.par_iter_mut().with_min_len(AT_ONCE).for_each(|pair| {
            pair.level = level.follow(pair.level.triangle, source, &pair.source);
        });
        back.par_iter_mut().with_min_len(AT_ONCE).for_each(|pair| {
            pair.source = source.follow(pair.source.triangle, level, &pair.level);
        });
        self
    }
}

/// The mean of those that are finite.
fn mean(apart: &[f32]) -> f32 {
    let finite = apart.iter().filter(|apart| apart.is_finite());
    let sum: f64 = finite.clone().map(|&apart| f64::from(apart)).sum();
    (sum / finite.count().max(1) as f64) as f32
}

/// Whether so many pairs are lost that it pays to search all of `sheet` for their counterparts.
fn are_many(
    pairs: &[Pair],
    apart: &[f32],
    sheet: &Sheet<'_>,
    lost: impl Fn(&Pair, f32) -> bool + Sync,
) -> bool {
    let all = pairs.par_iter().zip(apart).with_min_len(AT_ONCE);
    let count = all.filter(|(pair, apart)| lost(pair, **apart)).count();
    count * TRIANGLES_PER_LOST > sheet.fans.triangles.len()
}

/// Whether a pair is far apart for the triangle of the level that it lies on, if there is one.
fn is_wide(level: &Sheet<'_>, pair: &Pair, apart: f32) -> bool {
    if !apart.is_finite() {
        return true;
    }
    let [a, b, c] = level.corners(pair.level.triangle);
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
    let area = (b - a).cross(c - a).length_squared();
    f64::from(apart).powi(2) * longest > LOST_HEIGHT * LOST_HEIGHT * area
}

/// The point of `sheet` that a walk finds for one of `other`, from where `counterpart` has the nearest corner
/// of its triangle, or the next.
fn walk(
    sheet: &Sheet<'_>,
    other: &Sheet<'_>,
    point: &SurfacePoint,
    counterpart: impl Fn(u32) -> u32,
) -> SurfacePoint {
    let (corners, weights) = (other.fans.triangles[point.triangle.index()], point.barycentrics());
    let mut slots = [0, 1, 2];
    slots.sort_by(|&a, &b| weights[b].total_cmp(&weights[a]));
    slots
        .into_iter()
        .map(|slot| counterpart(corners[slot]))
        .filter(|&vertex| vertex != NONE)
        .find_map(|vertex| sheet.start(vertex, other, point))
        .and_then(|start| sheet.reach(start, other, point))
        .unwrap_or(SurfacePoint::new(NOWHERE, DVec3::X))
}

/// The pairs that `meet` makes of `count` samples, in their order.
fn samples(
    sheet: &Sheet<'_>,
    count: usize,
    meet: impl Fn(SurfacePoint) -> Pair + Sync,
) -> Vec<Pair> {
    let triangles = &sheet.fans.triangles;
    let samples = Samples::new(&sheet.mesh.positions, triangles, count, SEED);
    (0..triangles.len())
        .into_par_iter()
        .with_min_len(AT_ONCE)
        .map(TriangleId::new)
        .flat_map_iter(|triangle| {
            let points =
                samples.of(triangle).map(|s| SurfacePoint::new(s.triangle, s.barycentrics));
            points.map(&meet)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polish::edges::inner_edges;
    use crate::testing::grid;

    /// A sheet with a spike, too steep for what is flat to be its counterpart.
    fn spiked(side: usize, column: usize, row: usize) -> Mesh {
        let mut mesh = grid(side);
        mesh.positions[row * (side + 1) + column].z += 0.1;
        mesh
    }

    #[test]
    fn a_spike_is_not_paired_with_another_far_away() {
        let (source, level) = (spiked(64, 10, 10), spiked(64, 50, 50));
        let source = Source::new(&source, &[]);
        let sources: Vec<PointId> = (0..level.positions.len()).map(PointId::new).collect();
        let level = Sheet::new(&level, Arc::new(Fans::of(&level)));
        let pairs = Pairs::new(&source, &level, &inner_edges(&level), &sources, 20_000);
        let apart =
            |pair: &Pair| source.sheet.place(&pair.source).distance(level.place(&pair.level));
        assert!(pairs.all.len() > 39_000 && pairs.there > 19_500, "{}", pairs.all.len());
        assert!(pairs.all.iter().map(apart).all(|apart| apart < 0.1));
    }
}
