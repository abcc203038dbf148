//! Large surfaces go down in pieces that fit a cache, in parallel.
//!
//! A descent jumps all over its surface, and once that is larger than the cache, waiting for memory
//! is most of its time. So triangles are put in the order of a space-filling curve (Morton, "A
//! computer oriented geodetic data base", 1966) and cut into regions of equal size. Points that two
//! regions share are locked. Every region goes down to one common cost, so that what is taken is what
//! a single queue would have taken, but for the edges at the rims; those come next, in one queue over
//! all that is left. The common cost is guessed from a sample; should it take too much, regions that
//! went deepest keep their share instead.
//!
//! Regions and the common cost depend on the surface alone, so the result is the same at any number
//! of threads.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::id::TriangleId;
use crate::mesh::Mesh;
use crate::simplify::Descent;
use crate::stage::{Key, Numbers, Stage};

/// Triangles of a region. Its points and wedges take about a megabyte with five attributes.
const REGION: usize = 8192;
/// A surface of fewer triangles goes down in one queue.
const LEAST: usize = 1 << 16;
/// A target above this share of what is there is left to the one queue.
const NEAR: f64 = 0.93;
/// One region in so many is tried first, to find the common cost.
const SAMPLED: usize = 16;

/// Whether a surface of so many triangles is to go down in regions.
pub(crate) fn is_large(triangles: usize, target: usize) -> bool {
    triangles >= LEAST && target as f64 <= NEAR * triangles as f64
}

/// Takes `stage` near `target` triangles, and never below, if it is large.
pub(crate) fn descend(
    mut stage: Stage,
    source: &Mesh,
    target: usize,
    max_error: f64,
    removed: &AtomicUsize,
) -> Stage {
    for pass in 0.. {
        let now = stage.triangles.len();
        if !is_large(now, target) {
            break;
        }
        let cut = Cut::new(&stage, source, max_error, pass);
        let share = target as f64 / now as f64;
        let limit = cut.find_limit(share);
        let mut next = cut.descend(limit, 0.0);
        if next.triangles.len() < target {
            next = cut.descend(limit, share);
        }
        let gone = now - next.triangles.len();
        removed.fetch_add(gone, Ordering::Relaxed);
        stage = next;
        if (gone as f64) < 0.05 * now as f64 {
            break;
        }
    }
    stage
}

/// A surface cut into regions.
struct Cut<'a> {
    stage: &'a Stage,
    source: &'a Mesh,
    max_error: f64,
    regions: Vec<Vec<TriangleId>>,
    /// Per point: whether two regions share it.
    locked: Vec<bool>,
}

impl<'a> Cut<'a> {
    fn new(stage: &'a Stage, source: &'a Mesh, max_error: f64, pass: usize) -> Self {
        let mut keys: Vec<(u64, TriangleId)> = (0..stage.triangles.len())
            .into_par_iter()
            .map(TriangleId::new)
            .map(|t| {
                let sum: DVec3 = stage.points(t).iter().map(|&p| stage.metric.positions[p]).sum();
                (morton(sum / 3.0), t)
            })
            .collect();
        keys.par_sort_unstable();
        // Every other pass cuts in the middle of the regions of the one before.
        let (first, rest) = keys.split_at(if pass.is_multiple_of(2) { 0 } else { REGION / 2 });
        let regions: Vec<Vec<TriangleId>> = [first]
            .into_iter()
            .chain(rest.chunks(REGION))
            .filter(|region| !region.is_empty())
            .map(|region| region.iter().map(|&(_, t)| t).collect())
            .collect();
        let locked = shared_points(stage, &regions);
        Self { stage, source, max_error, regions, locked }
    }

    /// The cost at which about the share `share` of all triangles is left, as a sample of the
    /// regions has it.
    fn find_limit(&self, share: f64) -> f64 {
        let sampled: Vec<&Vec<TriangleId>> =
            self.regions.iter().skip(SAMPLED / 2).step_by(SAMPLED).collect();
        let traces: Vec<(Trace, f64)> =
            self.in_parallel(&sampled, |descent| trace(descent, share)).collect();
        let deepest = traces.iter().filter_map(|(trace, _)| trace.last());
        // Beyond where the shallowest trace ends, the sample says less than it seems to.
        let most = deepest.map(|&(cost, _)| cost).fold(f64::INFINITY, f64::min);
        let wanted: f64 = traces.iter().map(|(_, wanted)| wanted).sum();
        let mut steps: Trace = traces.into_iter().flat_map(|(trace, _)| trace).collect();
        steps.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut gone = 0.0;
        let reached = steps.iter().find(|(_, triangles)| {
            gone += *triangles as f64;
            gone >= wanted
        });
        reached.map_or(most, |&(cost, _)| cost.min(most))
    }

    /// Every region taken down to a cost, none below a share of its triangles, and all of them in one
    /// again.
    fn descend(&self, limit: f64, least_share: f64) -> Stage {
        let regions: Vec<&Vec<TriangleId>> = self.regions.iter().collect();
        let unheard = AtomicUsize::new(0);
        let parts: Vec<Stage> = self
            .in_parallel(&regions, |mut descent| {
                let least = (descent.triangles() as f64 * least_share).ceil() as usize;
                // A step takes up to fifteen triangles more than one.
                let goes_on = |cost, triangles| cost <= limit && triangles > least + 15;
                descent.descend_while(goes_on, &unheard);
                descent.into_stage()
            })
            .collect();
        let triangles = parts.iter().map(|part| part.triangles.len()).sum();
        let mut joined = self.stage.empty_like(triangles);
        let mut numbers = Numbers::new(self.source.positions.len(), self.source.wedge_points.len());
        for part in parts {
            joined.error = joined.error.max(part.error);
            for triangle in (0..part.triangles.len()).map(TriangleId::new) {
                joined.add(&part, triangle, Key::Source, &mut numbers);
            }
        }
        joined
    }

    /// Runs on each of the regions, in order.
    fn in_parallel<T: Send>(
        &self,
        regions: &[&Vec<TriangleId>],
        run: impl Fn(Descent<'a>) -> T + Sync,
    ) -> impl Iterator<Item = T> {
        let stage = self.stage;
        let results: Vec<T> = regions
            .par_iter()
            .with_min_len(regions.len() / (8 * rayon::current_num_threads()))
            .map_init(
                || Numbers::new(stage.point_sources.len(), stage.wedge_points.len()),
                |numbers, region| run(self.descent(region, numbers)),
            )
            .collect();
        results.into_iter()
    }

    fn descent(&self, region: &[TriangleId], numbers: &mut Numbers) -> Descent<'a> {
        numbers.clear();
        let mut piece = self.stage.empty_like(region.len());
        for &triangle in region {
            piece.add(self.stage, triangle, Key::Own, numbers);
        }
        let mut locked = vec![false; piece.point_sources.len()];
        for &triangle in region {
            for point in self.stage.points(triangle) {
                if let Some(number) = numbers.point(point) {
                    locked[number] = self.locked[point];
                }
            }
        }
        Descent::new(self.source, piece, &locked, self.max_error)
    }
}

/// Costs that rise, each with the triangles that went at it.
type Trace = Vec<(f64, usize)>;

/// What goes at which cost until a region has shrunk somewhat beyond `share`, and how many of its
/// triangles a descent of the whole surface would take, locked points not being held there.
fn trace(mut descent: Descent<'_>, share: f64) -> (Trace, f64) {
    let (whole, free) = (descent.triangles(), descent.free_share());
    let wanted = (1.0 - share) * whole as f64 * free;
    let end = whole - (1.8 * wanted).min(0.94 * whole as f64 * free) as usize;
    let (mut trace, mut highest, mut before) = (Trace::new(), 0.0f64, whole);
    descent.descend_while(
        |cost, triangles| {
            if triangles < before {
                trace.push((highest, before - triangles));
                before = triangles;
            }
            highest = highest.max(cost);
            triangles > end
        },
        &AtomicUsize::new(0),
    );
    (trace, wanted)
}

/// Per point: whether triangles of two regions meet there.
fn shared_points(stage: &Stage, regions: &[Vec<TriangleId>]) -> Vec<bool> {
    const NONE: u32 = u32::MAX;
    let mut owners = vec![NONE; stage.point_sources.len()];
    let mut shared = vec![false; owners.len()];
    for (owner, region) in (0..).zip(regions) {
        for point in region.iter().flat_map(|&triangle| stage.points(triangle)) {
            if owners[point.index()] == NONE {
                owners[point.index()] = owner;
            }
            shared[point.index()] |= owners[point.index()] != owner;
        }
    }
    shared
}

/// The place of a point of the unit cube around the origin along a Z curve of 2²¹ cells a side.
fn morton(p: DVec3) -> u64 {
    let cell = |x: f64| ((x + 0.5).clamp(0.0, 1.0) * f64::from((1 << 21) - 1)) as u64;
    spread(cell(p.x)) | spread(cell(p.y)) << 1 | spread(cell(p.z)) << 2
}

/// The lower 21 bits, two zeros between each and the next.
fn spread(x: u64) -> u64 {
    [(32, 0x1f_0000_0000_ffff), (16, 0x1f_0000_ff00_00ff), (8, 0x100f_00f0_0f00_f00f)]
        .into_iter()
        .chain([(4, 0x10c3_0c30_c30c_30c3), (2, 0x1249_2492_4924_9249)])
        .fold(x & 0x1f_ffff, |x, (shift, mask)| (x | x << shift) & mask)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metric::Weights;
    use crate::testing::{grid, sphere};

    #[test]
    fn the_curve_goes_through_the_octants_in_turn() {
        let at = |x: f64, y: f64, z: f64| morton(DVec3::new(x, y, z));
        assert_eq!(spread(0b1011), 0b001_000_001_001);
        assert_eq!(spread(u64::MAX).count_ones(), 21);
        assert!(at(0.4, -0.4, -0.4) < at(-0.4, 0.4, -0.4));
        assert!(at(0.4, 0.4, -0.4) < at(-0.4, -0.4, 0.4));
    }

    #[test]
    fn a_plain_where_nothing_costs_anything_does_not_go_below_its_target() {
        let mesh = grid(260);
        let stage = Stage::new(&mesh, &Weights::default());
        let target = mesh.triangles.len() / 2;
        let next = descend(stage, &mesh, target, f64::INFINITY, &AtomicUsize::new(0));
        assert!((target..target * 3 / 2).contains(&next.triangles.len()));
    }

    /// 131,768 triangles in 17 regions.
    fn large() -> Mesh {
        sphere(182)
    }

    #[test]
    fn regions_hold_every_triangle_once_and_rims_are_locked() {
        let mesh = large();
        let stage = Stage::new(&mesh, &Weights::default());
        for pass in 0..2 {
            let cut = Cut::new(&stage, &mesh, f64::INFINITY, pass);
            let mut all: Vec<TriangleId> = cut.regions.concat();
            all.sort_unstable();
            assert!(all.iter().enumerate().all(|(at, t)| t.index() == at));
            assert_eq!(all.len(), mesh.triangles.len());
            let share = cut.locked.iter().filter(|locked| **locked).count() as f64
                / cut.locked.len() as f64;
            assert!((0.01..0.15).contains(&share), "{share}");
        }
    }

    #[test]
    fn a_large_sphere_comes_near_its_target_and_stays_whole() {
        let mesh = large();
        let (target, removed) = (mesh.triangles.len() / 2, AtomicUsize::new(0));
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let stage = Stage::new(&mesh, &Weights::default());
            pool.install(|| descend(stage, &mesh, target, f64::INFINITY, &removed))
        };
        let (one, three) = (on(1), on(3));
        assert!((target..target * 5 / 4).contains(&one.triangles.len()));
        assert_eq!(one.triangles, three.triangles);
        assert_eq!(one.metric.positions, three.metric.positions);
        // Euler: a sphere has two triangles fewer than twice its points.
        assert_eq!(one.triangles.len(), 2 * one.point_sources.len() - 4);
    }
}
