//! Pairs of points of two surfaces that belong together.

use glam::DVec3;
use rayon::prelude::*;

use super::sheet::{Sheet, SurfacePoint, neighbors};
use crate::id::TriangleId;
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
const MAX_SPACINGS: f64 = 20.0;

/// The surface that levels are fitted to.
pub(crate) struct Source<'a> {
    pub(super) sheet: Sheet<'a>,
    surface: Surface,
    /// One per point, or empty if all count alike.
    importance: &'a [f32],
}

impl<'a> Source<'a> {
    pub(crate) fn new(mesh: &'a Mesh, importance: &'a [f32]) -> Self {
        let sheet = Sheet::new(mesh, neighbors(mesh));
        Self { surface: sheet.surface(), sheet, importance }
    }

    /// How many times a pair counts: the importance of its place on the source.
    #[inline]
    pub(super) fn weight(&self, pair: &Pair) -> f64 {
        if self.importance.is_empty() {
            return 1.0;
        }
        let points = self.sheet.mesh.triangle_points(pair.source.triangle.index());
        let weights = points.map(|point| f64::from(self.importance[point]));
        pair.source.barycentrics().dot(DVec3::from_array(weights))
    }

    /// That of all of them.
    pub(super) fn total_weight(&self, pairs: &[Pair]) -> f64 {
        if self.importance.is_empty() {
            return pairs.len() as f64;
        }
        pairs.iter().map(|pair| self.weight(pair)).sum()
    }
}

/// A point of the source and its counterpart on the level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) source: SurfacePoint,
    pub(super) level: SurfacePoint,
}

/// Samples of both surfaces, each with the nearest point of the other on the same side.
pub(super) struct Pairs {
    /// The pairs of samples of the source, then the pairs of samples of the level.
    pub(super) all: Vec<Pair>,
    /// Number of pairs of samples of the source.
    pub(super) there: usize,
}

impl Pairs {
    /// Pairs `count` samples of either surface. One without a counterpart, or with a far one, is left
    /// out.
    pub(super) fn new(source: &Source<'_>, level: &Sheet<'_>, count: usize) -> Self {
        let surface = level.surface();
        let mut all = pair(&source.sheet, count, |point| {
            let found = level.find(&surface, &source.sheet, &point)?;
            Some(Pair { source: point, level: found })
        });
        let there = all.len();
        all.extend(pair(level, count, |point| {
            let found = source.sheet.find(&source.surface, level, &point)?;
            Some(Pair { source: found, level: point })
        }));
        Self { all, there }.without_far(source, level)
    }

    /// Leaves out what is farther apart than `MAX_SPACINGS` times the mean.
    fn without_far(mut self, source: &Source<'_>, level: &Sheet<'_>) -> Self {
        let apart: Vec<f64> = self
            .all
            .par_iter()
            .map(|pair| source.sheet.place(&pair.source).distance(level.place(&pair.level)))
            .collect();
        let most = MAX_SPACINGS * apart.iter().sum::<f64>() / apart.len().max(1) as f64;
        self.there = apart[..self.there].iter().filter(|&&apart| apart <= most).count();
        let mut apart = apart.into_iter();
        self.all.retain(|_| apart.next().is_some_and(|apart| apart <= most));
        self
    }

    /// The same samples with their nearest points after the level has moved a little.
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

/// The pairs that `meet` makes of `count` samples, in their order.
fn pair(
    sheet: &Sheet<'_>,
    count: usize,
    meet: impl Fn(SurfacePoint) -> Option<Pair> + Sync,
) -> Vec<Pair> {
    let triangles: Vec<[u32; 3]> = sheet.triangles().collect();
    let samples = Samples::new(&sheet.mesh.positions, &triangles, count, SEED);
    (0..triangles.len())
        .into_par_iter()
        .with_min_len(AT_ONCE)
        .map(TriangleId::new)
        .flat_map_iter(|triangle| {
            let points =
                samples.of(triangle).map(|s| SurfacePoint::new(s.triangle, s.barycentrics));
            points.filter_map(&meet)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
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
        let level = Sheet::new(&level, Arc::clone(&neighbors(&level)));
        let pairs = Pairs::new(&source, &level, 20_000);
        let apart =
            |pair: &Pair| source.sheet.place(&pair.source).distance(level.place(&pair.level));
        assert!(pairs.all.len() > 39_000 && pairs.there > 19_500, "{}", pairs.all.len());
        assert!(pairs.all.iter().map(apart).all(|apart| apart < 0.1));
    }
}
