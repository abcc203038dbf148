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

use crate::buckets::Buckets;
use crate::ground::Ground;
use crate::id::{CornerId, TriangleId};
use crate::mesh::Mesh;
use crate::simplify::Descent;
use crate::stage::{Numbers, Stage};

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

/// Takes a surface near `target` triangles, and never below, if it is large.
pub(crate) fn descend(
    mut ground: Ground<'_>,
    source: &Mesh,
    target: usize,
    max_error: f64,
    removed: &AtomicUsize,
) -> Stage {
    for pass in 0.. {
        let now = ground.triangles();
        if !is_large(now, target) {
            break;
        }
        let cut = Cut::new(&ground, source, max_error, pass);
        let share = target as f64 / now as f64;
        let limit = cut.find_limit(share);
        let mut next = cut.descend(limit, 0.0);
        if next.triangles.len() < target {
            next = cut.descend(limit, share);
        }
        let gone = now - next.triangles.len();
        removed.fetch_add(gone, Ordering::Relaxed);
        ground = Ground::Stage(Box::new(next));
        if (gone as f64) < 0.05 * now as f64 {
            break;
        }
    }
    ground.into_stage()
}

/// A surface cut into regions.
struct Cut<'a> {
    ground: &'a Ground<'a>,
    source: &'a Mesh,
    max_error: f64,
    regions: Vec<Vec<TriangleId>>,
    /// Per triangle: its region.
    owners: Vec<u32>,
    /// Per point: the corners there, if the ground is yet to be measured.
    corners: Option<Buckets>,
    /// Per point: whether two regions share it.
    locked: Vec<bool>,
}

impl<'a> Cut<'a> {
    fn new(ground: &'a Ground<'a>, source: &'a Mesh, max_error: f64, pass: usize) -> Self {
        let mut keys: Vec<(u64, TriangleId)> = (0..ground.triangles())
            .into_par_iter()
            .map(TriangleId::new)
            .map(|t| {
                let sum: DVec3 = ground.points(t).iter().map(|&p| ground.position(p)).sum();
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
        let mut owners = vec![0u32; ground.triangles()];
        for (owner, region) in (0..).zip(&regions) {
            region.iter().for_each(|t| owners[t.index()] = owner);
        }
        let corners = matches!(ground, Ground::Mesh(..)).then(|| {
            let points = (0..ground.triangles()).flat_map(|t| ground.points(TriangleId::new(t)));
            Buckets::new(points.map(|point| point.0), ground.sizes()[0])
        });
        let locked = shared_points(ground, &owners);
        Self { ground, source, max_error, regions, owners, corners, locked }
    }

    /// The cost at which about the share `share` of all triangles is left, as a sample of the
    /// regions has it.
    fn find_limit(&self, share: f64) -> f64 {
        let sampled: Vec<usize> =
            (0..self.regions.len()).skip(SAMPLED / 2).step_by(SAMPLED).collect();
        let traces = self.in_parallel(&sampled, |descent| trace(descent, share));
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
        let regions: Vec<usize> = (0..self.regions.len()).collect();
        let unheard = AtomicUsize::new(0);
        let pieces = self.in_parallel(&regions, |mut descent| {
            let least = (descent.triangles() as f64 * least_share).ceil() as usize;
            // A step takes up to fifteen triangles more than one.
            let goes_on = |cost, triangles| cost <= limit && triangles > least + 15;
            descent.descend_while(goes_on, &unheard);
            descent.into_stage()
        });
        let (points, wedges) = (self.source.positions.len(), self.source.wedge_points.len());
        Stage::join(pieces, &mut Numbers::new(points, wedges)).expect("a region at least")
    }

    /// Runs on each of the regions, in order.
    fn in_parallel<T: Send>(
        &self,
        regions: &[usize],
        run: impl Fn(Descent<'a>) -> T + Sync,
    ) -> Vec<T> {
        let [points, wedges] = self.ground.sizes();
        regions
            .par_iter()
            .with_min_len(regions.len() / (8 * rayon::current_num_threads()))
            .map_init(
                || Numbers::new(points, wedges),
                |numbers, &region| run(self.descent(region, numbers)),
            )
            .collect()
    }

    fn descent(&self, region: usize, numbers: &mut Numbers) -> Descent<'a> {
        let triangles = &self.regions[region];
        let piece = self.ground.piece(triangles, &self.rim(region), numbers);
        let mut locked = vec![false; piece.point_sources.len()];
        for point in triangles.iter().flat_map(|&t| self.ground.points(t)) {
            if let Some(number) = numbers.point(point) {
                locked[number] = self.locked[point];
            }
        }
        Descent::new(self.source, piece, locked, self.max_error)
    }

    /// The triangles of other regions at the points of one, if they are asked for.
    fn rim(&self, region: usize) -> Vec<TriangleId> {
        let Some(corners) = &self.corners else { return Vec::new() };
        let points = self.regions[region].iter().flat_map(|&t| self.ground.points(t));
        let mut rim: Vec<TriangleId> = points
            .filter(|&point| self.locked[point])
            .flat_map(|point| corners.of(point.index()))
            .map(|&corner| CornerId(corner).triangle())
            .filter(|&triangle| self.owners[triangle] as usize != region)
            .collect();
        rim.sort_unstable();
        rim.dedup();
        rim
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
fn shared_points(ground: &Ground<'_>, owners: &[u32]) -> Vec<bool> {
    let mut first = vec![None; ground.sizes()[0]];
    let mut shared = vec![false; first.len()];
    for (triangle, &owner) in owners.iter().enumerate() {
        for point in ground.points(TriangleId::new(triangle)) {
            shared[point.index()] |= *first[point.index()].get_or_insert(owner) != owner;
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
    use std::sync::Arc;

    use crate::metric::Weights;
    use crate::space::Space;
    use crate::testing::{grid, sphere};

    fn whole(mesh: &Mesh) -> Ground<'_> {
        Ground::Mesh(mesh, Arc::new(Space::new(mesh, Weights::default())))
    }

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
        let stage = whole(&mesh);
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
        let stage = whole(&mesh);
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
            let stage = whole(&mesh);
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
