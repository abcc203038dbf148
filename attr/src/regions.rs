//! Large surfaces are simplified in regions that fit a cache, in parallel.
//!
//! A descent jumps all over its surface, and once that is larger than the cache, waiting for memory
//! is most of its time. So triangles are put in the order of a space-filling curve (Morton, "A
//! computer oriented geodetic data base", 1966) and cut into regions of equal size. Points that two
//! regions share are locked. Every region is simplified to one common cost, so that what is taken is what
//! a single queue would have taken, but for the edges at the rims; those come next, in one queue over
//! all that is left. The common cost is guessed from a sample; should it take too much, regions that
//! went deepest keep their share instead.
//!
//! Regions and the common cost depend on the surface alone, so the result is the same at any number
//! of threads.

use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::buckets::Buckets;
use crate::id::{CornerId, TriangleId};
use crate::mesh::Mesh;
use crate::region_source::RegionSource;
use crate::simplify::Descent;
use crate::working_mesh::{Join, Numbers, WorkingMesh};

/// Triangles of a region. Its points and wedges take about a megabyte with five attributes.
const REGION_TRIANGLES: usize = 8192;
/// A surface of fewer triangles is simplified in one queue.
pub(crate) const MIN_LARGE_TRIANGLES: usize = 1 << 16;
/// A target above this share of what is there is left to the one queue.
const MAX_TARGET_SHARE: f64 = 0.85;
/// One triangle in so many is part of a sample, which is tried first, to find the common cost.
const SAMPLED: usize = 16;
/// Triangles of a sample. Few and large ones miss the cost by a tenth where detail is uneven.
const SAMPLE: usize = 1024;
/// Regions whose pieces wait to be joined: all at once would be as much memory again as what they become.
const AT_ONCE: usize = 32;
/// The queue slack of a large surface: a collapse is done if no key is below this share of its
/// cost. Most re-evaluations are of collapses that are all but next.
///
/// Lab note: a displaced sphere of 998,000 triangles to four levels, processor time and RMS distance at
/// 50 and 6.25 % over those at 1: with 0.8 0.87, 1.002 and 1.011; with 0.6 0.86, 1.011 and 1.028.
const QUEUE_SLACK: f64 = 0.8;

/// Whether a surface of so many triangles is to be simplified in regions.
pub(crate) fn is_large(triangles: usize, target: usize) -> bool {
    !is_small(triangles) && target as f64 <= MAX_TARGET_SHARE * triangles as f64
}

/// Whether a surface of so many triangles is simplified as one, in steps.
pub(crate) fn is_small(triangles: usize) -> bool {
    triangles < MIN_LARGE_TRIANGLES
}

/// The queue slack of a surface of so many triangles: a collapse is done if no key is below this
/// share of its cost.
pub(crate) fn queue_slack(triangles: usize) -> f64 {
    if is_small(triangles) { 1.0 } else { QUEUE_SLACK }
}

/// Simplifies a large surface to near `target` triangles, and never below; leaves a small one as it
/// is.
pub(crate) fn descend(
    mut region_source: RegionSource<'_>,
    source: &Mesh,
    target: usize,
    max_error: f64,
    removed: &AtomicUsize,
) -> WorkingMesh {
    for pass in 0.. {
        let now = region_source.triangles();
        if !is_large(now, target) {
            break;
        }
        let mut joined = cut_down(&region_source, source, target, max_error, pass);
        let gone = now - joined.triangles.len();
        removed.fetch_add(gone, Ordering::Relaxed);
        if let (Some(mut log), Some(own)) = (region_source.take_log(), &mut joined.log) {
            log.append_side_by_side(std::slice::from_ref(own), source.layout.len());
            *own = log;
        }
        region_source = RegionSource::Working(Box::new(joined));
        if (gone as f64) < 0.05 * now as f64 {
            break;
        }
    }
    region_source.into_working_mesh()
}

/// The regions of a surface, taken down to one cost or, if that is too much, to their share of
/// `target`.
fn cut_down(
    region_source: &RegionSource<'_>,
    source: &Mesh,
    target: usize,
    max_error: f64,
    pass: usize,
) -> WorkingMesh {
    let cut = Cut::new(region_source, source, max_error, pass);
    let share = target as f64 / region_source.triangles() as f64;
    let limit = cut.find_limit(share);
    let joined = cut.descend(limit, 0.0, share);
    if joined.triangles.len() >= target {
        return joined;
    }
    drop(joined);
    cut.descend(limit, share, share)
}

/// A surface cut into regions.
struct Cut<'a> {
    region_source: &'a RegionSource<'a>,
    source: &'a Mesh,
    max_error: f64,
    /// The triangles in the order of the curve, and the place of each on it.
    order: Vec<TriangleId>,
    places: Vec<u32>,
    /// Per point: the corners there.
    corners: Buckets,
    /// Places on the curve.
    regions: Vec<Range<usize>>,
}

impl<'a> Cut<'a> {
    fn new(
        region_source: &'a RegionSource<'a>,
        source: &'a Mesh,
        max_error: f64,
        pass: usize,
    ) -> Self {
        let count = region_source.triangles();
        let mut keys: Vec<(u64, TriangleId)> = (0..count)
            .into_par_iter()
            .map(TriangleId::new)
            .map(|t| {
                let sum: DVec3 =
                    region_source.points(t).iter().map(|&p| region_source.position(p)).sum();
                (morton(sum / 3.0), t)
            })
            .collect();
        keys.par_sort_unstable();
        let order: Vec<TriangleId> = keys.into_iter().map(|(_, t)| t).collect();
        let mut places = vec![0; count];
        (0..).zip(&order).for_each(|(place, &t)| places[t.index()] = place);
        let points = (0..count).flat_map(|t| region_source.points(TriangleId::new(t)));
        let corners = Buckets::new(points.map(|point| point.0), region_source.sizes()[0]);
        // Every other pass cuts in the middle of the regions of the one before.
        let first = if pass.is_multiple_of(2) { 0 } else { REGION_TRIANGLES / 2 };
        let starts = (first..count).step_by(REGION_TRIANGLES);
        let regions = (first > 0).then_some(0..first.min(count));
        let regions =
            regions.into_iter().chain(starts.map(|at| at..(at + REGION_TRIANGLES).min(count)));
        Self {
            region_source,
            source,
            max_error,
            order,
            places,
            corners,
            regions: regions.collect(),
        }
    }

    /// The cost at which about the share `share` of all triangles is left, as samples have it.
    fn find_limit(&self, share: f64) -> f64 {
        let count = self.order.len();
        let samples = count / (SAMPLED * SAMPLE);
        let middle = |sample: usize| (2 * sample + 1) * count / (2 * samples);
        let sampled: Vec<Range<usize>> = (0..samples)
            .map(|sample| middle(sample) - SAMPLE / 2..middle(sample) + SAMPLE / 2)
            .collect();
        let traces = self.in_parallel(&sampled, |descent| Trace::new(descent, share));
        let wanted: f64 = traces.iter().map(|trace| trace.wanted).sum();
        let gone = |cost: f64| traces.iter().map(|trace| trace.gone_at(cost)).sum::<f64>();
        let ends = traces.iter().filter_map(|trace| trace.steps.last());
        let mut high = ends.map(|&(cost, _)| cost).fold(f64::MIN_POSITIVE, f64::max);
        while gone(high) < wanted && high < 1e30 {
            high *= 8.0;
        }
        let mut low = 0.0;
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            if gone(middle) < wanted { low = middle } else { high = middle }
        }
        high
    }

    /// Every region simplified up to a cost, none below a share of its triangles, joined to a surface again.
    fn descend(&self, limit: f64, least_share: f64, share: f64) -> WorkingMesh {
        let unheard = AtomicUsize::new(0);
        let run = |mut descent: Descent<'a>| {
            let least = (descent.triangles() as f64 * least_share).ceil() as usize;
            // A step takes up to fifteen triangles more than one.
            let goes_on = |cost, triangles| cost <= limit && triangles > least + 15;
            descent.descend_while(goes_on, QUEUE_SLACK, &unheard);
            descent.into_working_mesh().compact()
        };
        let (points, wedges) = (self.source.positions.len(), self.source.wedge_points.len());
        // Regions come near the share that they are to keep; what is not used takes no memory.
        let room = (self.order.len() as f64 * (share + 0.1)) as usize;
        let mut join = Join::new([points, wedges], room);
        for regions in self.regions.chunks(AT_ONCE) {
            join.add(self.in_parallel(regions, run));
        }
        join.finish(self.source.layout).expect("a region at least")
    }

    /// Runs on each of the regions, in order.
    fn in_parallel<T: Send>(
        &self,
        regions: &[Range<usize>],
        run: impl Fn(Descent<'a>) -> T + Sync,
    ) -> Vec<T> {
        let [points, wedges] = self.region_source.sizes();
        // One for each thread, since they are as long as the surface has points and wedges.
        let idle: Mutex<Vec<Numbers>> = Mutex::default();
        let take = || idle.lock().ok().and_then(|mut idle| idle.pop());
        regions
            .par_iter()
            .with_max_len(1)
            .map(|region| {
                let mut numbers = take().unwrap_or_else(|| Numbers::new(points, wedges));
                let descent = self.descent(region, &mut numbers);
                if let Ok(mut idle) = idle.lock() {
                    idle.push(numbers);
                }
                run(descent)
            })
            .collect()
    }

    /// A region on its own, the points that it shares with others locked.
    fn descent(&self, region: &Range<usize>, numbers: &mut Numbers) -> Descent<'a> {
        let rim = self.rim(region);
        let piece = self.region_source.piece(&self.order[region.clone()], &rim, numbers);
        let mut locked = vec![false; piece.point_sources.len()];
        for point in rim.into_iter().flat_map(|t| self.region_source.points(t)) {
            if let Some(locked) = numbers.point(point).and_then(|number| locked.get_mut(number)) {
                *locked = true;
            }
        }
        Descent::new(self.source, piece, locked, self.max_error)
    }

    /// The triangles around a region that share a point with it.
    fn rim(&self, region: &Range<usize>) -> Vec<TriangleId> {
        let at = |corner: u32| CornerId(corner).triangle();
        let is_own = |t: TriangleId| region.contains(&(self.places[t.index()] as usize));
        let mut rim = Vec::new();
        for &triangle in &self.order[region.clone()] {
            for point in self.region_source.points(triangle) {
                let corners = self.corners.of(point.index());
                // Each point once.
                if corners.iter().map(|&c| at(c)).find(|&t| is_own(t)) == Some(triangle) {
                    rim.extend(corners.iter().map(|&c| at(c)).filter(|&t| !is_own(t)));
                }
            }
        }
        rim.sort_unstable();
        rim.dedup();
        rim
    }
}

/// The simplification of a region.
struct Trace {
    /// Costs that rise, each with how many triangles have gone by then.
    steps: Vec<(f64, f64)>,
    /// Triangles that a descent of the whole surface would take from its free points.
    wanted: f64,
    /// Triangles that its free points stand for.
    free: f64,
}

impl Trace {
    /// Simplifies a region until it has shrunk somewhat beyond `share`.
    fn new(mut descent: Descent<'_>, share: f64) -> Self {
        let whole = descent.triangles();
        // Two triangles a point.
        let free = (2.0 * descent.free_points() as f64).min(whole as f64);
        let wanted = (1.0 - share) * free;
        let end = whole - (1.4 * wanted).min(0.9 * free) as usize;
        let (mut steps, mut highest, mut before) = (Vec::new(), 0.0f64, whole);
        descent.descend_while(
            |cost, triangles| {
                if triangles < before {
                    steps.push((highest, (whole - triangles) as f64));
                    before = triangles;
                }
                highest = highest.max(cost);
                triangles > end
            },
            QUEUE_SLACK,
            &AtomicUsize::new(0),
        );
        Self { steps, wanted, free }
    }

    /// Triangles that are gone at a cost. Beyond its end a trace goes on as one on a smooth surface
    /// does, where the cost is about the cube of a triangle's area: distances are as its area.
    fn gone_at(&self, cost: f64) -> f64 {
        let Some(&(end, gone)) = self.steps.last() else { return 0.0 };
        if cost > end {
            return self.free - (self.free - gone).max(0.0) * (end / cost).cbrt();
        }
        let below = self.steps.partition_point(|step| step.0 <= cost);
        below.checked_sub(1).map_or(0.0, |at| self.steps[at].1)
    }
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

    use crate::settings::Weights;
    use crate::space::Space;
    use crate::testing::{grid, sphere};

    fn whole(mesh: &Mesh) -> RegionSource<'_> {
        RegionSource::Mesh(mesh, Arc::new(Space::new(mesh, Weights::default())))
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
        let working = whole(&mesh);
        let target = mesh.triangles.len() / 2;
        let next = descend(working, &mesh, target, f64::INFINITY, &AtomicUsize::new(0));
        assert!((target..target * 3 / 2).contains(&next.triangles.len()));
    }

    /// 131,768 triangles in 17 regions.
    fn large() -> Mesh {
        sphere(182)
    }

    #[test]
    fn regions_hold_every_triangle_once_and_rims_are_locked() {
        let mesh = large();
        let working = whole(&mesh);
        for pass in 0..2 {
            let cut = Cut::new(&working, &mesh, f64::INFINITY, pass);
            let mut all: Vec<TriangleId> =
                cut.regions.iter().flat_map(|region| cut.order[region.clone()].to_vec()).collect();
            all.sort_unstable();
            assert!(all.iter().enumerate().all(|(at, t)| t.index() == at));
            assert_eq!(all.len(), mesh.triangles.len());
            let [points, wedges] = working.sizes();
            let mut numbers = Numbers::new(points, wedges);
            let free = cut.regions.iter().map(|r| cut.descent(r, &mut numbers).free_points());
            let share = free.sum::<usize>() as f64 / points as f64;
            assert!((0.85..0.99).contains(&share), "{share}");
        }
    }

    #[test]
    fn a_large_sphere_comes_near_its_target_and_stays_whole() {
        let mesh = large();
        let (target, removed) = (mesh.triangles.len() / 2, AtomicUsize::new(0));
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let working = whole(&mesh);
            pool.install(|| descend(working, &mesh, target, f64::INFINITY, &removed))
        };
        let (one, three) = (on(1), on(3));
        assert!((target..target * 9 / 8).contains(&one.triangles.len()));
        assert_eq!(one.triangles, three.triangles);
        assert_eq!(one.metric.positions, three.metric.positions);
        // Euler: a sphere has two triangles fewer than twice its points.
        assert_eq!(one.triangles.len(), 2 * one.point_sources.len() - 4);
    }
}
