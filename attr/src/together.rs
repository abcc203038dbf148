//! Levels of several surfaces with one budget: triangles stay where losing them costs most.
//!
//! A cost is an area times a squared distance. In the space of a surface it is free of the surface's
//! size; here it gets that back, once for each time that the surface is shown, and the cheapest
//! collapse of all surfaces comes first. So all end where the next collapse costs the same in each: no
//! other sharing of the same triangles would have a lesser sum, were costs to rise as they do along one
//! descent (Everett, "Generalized Lagrange multiplier method for solving problems of optimum allocation
//! of resources", Operations Research 1963). That is a guide and no guarantee: costs are weighed with
//! texture and shading, and fall where quadrics are summed anew. So they are hedged by `HEDGE`.
//!
//! None minds what the others do, so each is simplified on its own, while it is in the cache, as far as it may
//! have to, and keeps its steps and what limit each of them takes. Once the limits are known that meet the
//! targets, the steps are taken again up to there: to find them takes most of the time, and to keep them little of
//! the memory. All surfaces at once, as one limit rises, would be in no cache.
//!
//! Each is simplified in one queue, however large: regions, which large surfaces are simplified in when they are
//! alone, are not cut here.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::chain::{Finish, Level, check, run_chain};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::options::Options;
use crate::progressive::log::Log;
use crate::regions;
use crate::settings::Cost;
use crate::sharing::{Curve, share_out};
use crate::simplify::{Descent, REBUILD_SHARE, Step, Stop};
use crate::space::Space;
use crate::working_mesh::WorkingMesh;

/// A cost below this, in the space of a surface, is what positions are rounded by: to one in 2²⁴, over a
/// thirtieth of the surface. Unless it counts for nothing, a plain of a kilometre keeps triangles
/// that a statue on it needs.
const ROUNDING: f64 = 1e-16;

/// A cost counts this power of how many times fewer triangles its surface has by now.
///
/// By cost alone the shares of surfaces are as far apart as their costs are wrong: quadrics that are summed
/// anew say too little of one that is simplified far, and grommets end as a twentieth of their triangles.
/// Lab note (`seamwise bake FILE --textures keep`, over `--budget-per mesh`, the worst of four levels and
/// the geometric mean): RMS sRGB luminance, RMS distance
///
/// | | helmet | racquet |
/// |---|---|---|
/// | 0 | 1.03 (0.97), 1.03 (0.98) | 1.11 (1.05), 1.47 (1.04) |
/// | 2 | | 1.00 (0.99), 1.14 (0.90) |
/// | 3 | | 1.00 (0.98), 1.24 (0.94) |
/// | 4 | 1.01 (0.98), 1.01 (0.98) | |
/// | **6** | 1.01 (0.99), 1.01 (0.99) | 1.01 (0.98), 0.96 (0.90) |
///
/// The others were measured when the quadrics of all were summed anew at once; this one was at 1.01 (0.98),
/// 1.00 (0.98) and 1.00 (0.98), 1.00 (0.91) then.
///
/// With the weight of normals against the scene's extent instead of each mesh's own, the helmet is at 0.96
/// of the luminance and 1.10 of the distance at 50 and 25 %.
const HEDGE: i32 = 6;

/// A surface is first simplified to so many times fewer triangles than were all to lose the same share, and once
/// more to its end if it is to lose more.
///
/// Lab note (processor time of `seamwise bake FILE --no-polish --no-evaluate --textures keep`, a ship and a helmet):
/// to its end at once 3.7 s and 2.9 s, **2** 3.0 s and 2.6 s. Costs grow tenfold with each quarter that goes, so
/// few go farther, but for what costs nothing, which goes on at once.
const MARGIN: usize = 2;

/// One of the surfaces that share a budget.
#[derive(Clone, Debug)]
pub struct Shared<'a> {
    /// The surface.
    pub mesh: &'a Mesh,
    /// The options of its simplification.
    pub options: Options<'a>,
    /// The scales of its instances: one factor on its lengths for each time that it is shown.
    pub stretches: &'a [f64],
}

impl Shared<'_> {
    /// The factor from a cost in its own space, where `unit` is a length of 1, to the shared space:
    /// summed over all instances. For edge lengths, a baseline, that of the largest instance.
    fn scale(&self, unit: f64) -> f64 {
        let lengths = self.stretches.iter().map(|stretch| stretch * unit);
        match self.options.settings.cost {
            Cost::Quadric => lengths.map(|length| length.powi(4)).sum(),
            Cost::Classic => lengths.map(|length| length.powi(2)).sum(),
            Cost::EdgeLength => lengths.fold(0.0, f64::max).powi(2),
        }
    }
}

/// Simplifies `surfaces` to levels of each that have `targets` triangles together. One entry per surface,
/// each with a level per target.
///
/// `targets` are the largest first. Together the levels have at most their target of triangles, and fewer
/// only by what the last step took beyond it, as in [`simplify_chain`](crate::simplify_chain); unless
/// `stopped` of every surface says why they were missed. A level's own `target` is what it was left with.
/// No surface is removed whole. One alone is simplified as by [`simplify_chain`](crate::simplify_chain). The
/// result is the same at any number of threads. `removed` counts triangles as they go, for a progress bar.
///
/// # Errors
/// See [`simplify_chain`](crate::simplify_chain).
pub fn simplify_together(
    surfaces: &[Shared<'_>],
    targets: &[usize],
    removed: &AtomicUsize,
) -> Result<Vec<Vec<Level>>> {
    run_together(surfaces, targets, false, removed).map(|(chains, _)| chains)
}

/// Levels of each surface, and the collapses of each that lead to them.
type Chains = (Vec<Vec<Level>>, Vec<Log>);

/// The same, with the collapses on record if they are asked for.
pub(crate) fn run_together(
    surfaces: &[Shared<'_>],
    targets: &[usize],
    records: bool,
    removed: &AtomicUsize,
) -> Result<Chains> {
    surfaces.iter().try_for_each(|own| check(own.mesh, targets, &own.options))?;
    if let [own] = surfaces {
        let (levels, log) = run_chain(own.mesh, targets, &own.options, records, removed)?;
        return Ok((vec![levels], log.into_iter().collect()));
    }
    let goal = Goal::of(surfaces, targets, removed);
    let way = |own: &Shared<'_>| find_way(own, goal.part(own) / MARGIN, &goal);
    let (mut curves, mut ways): (Vec<Curve>, Vec<Way>) = surfaces.par_iter().map(way).unzip();
    if let Some(last) = find_halts(&curves, targets).last() {
        let is_short =
            |&at: &usize| ways[at].is_open && last.triangles[at] == curves[at].least_triangles();
        let short: Vec<usize> = (0..surfaces.len()).filter(is_short).collect();
        let goal = Goal { removed: &AtomicUsize::new(0), ..goal };
        let way = |&at: &usize| (at, find_way(&surfaces[at], 0, &goal));
        let found: Vec<(usize, (Curve, Way))> = short.par_iter().map(way).collect();
        found.into_iter().for_each(|(at, own)| (curves[at], ways[at]) = own);
    }
    let halts = find_halts(&curves, targets);
    drop(curves);
    let all = surfaces.par_iter().zip(ways).enumerate();
    Ok(all.map(|(at, (own, way))| take_way(own, &way, (&halts, at), records)).unzip())
}

/// What all surfaces are to come to.
struct Goal<'a> {
    /// Triangles of all at first and at the last level.
    all: usize,
    least: usize,
    /// Counts triangles as they go.
    removed: &'a AtomicUsize,
}

impl<'a> Goal<'a> {
    fn of(surfaces: &[Shared<'_>], targets: &[usize], removed: &'a AtomicUsize) -> Self {
        let all = surfaces.iter().map(|own| own.mesh.triangles.len()).sum();
        Self { all, least: targets.last().copied().unwrap_or(all), removed }
    }

    /// The triangles of a surface at the last level, were all to lose the same share.
    fn part(&self, own: &Shared<'_>) -> usize {
        let product = own.mesh.triangles.len() as u128 * self.least as u128;
        product.div_ceil(self.all.max(1) as u128) as usize
    }

    /// Counts a step but for what is below the part of its surface.
    fn count(&self, part: usize, [from, to]: [usize; 2]) {
        self.removed.fetch_add(from.max(part) - to.max(part), Ordering::Relaxed);
    }
}

/// How a surface goes down.
struct Way {
    steps: Vec<Step>,
    /// Whether it may well go on from there.
    is_open: bool,
    /// The reason why it can't go on.
    stopped: Option<Stop>,
}

/// Where all surfaces are compared.
struct Halt {
    /// Triangles of each.
    triangles: Vec<usize>,
    /// Whether levels are made there, and whether their target is missed.
    is_level: bool,
    is_missed: bool,
}

/// The source as it is before a descent, and a length of 1 in its space.
fn begin(own: &Shared<'_>, records: bool) -> (WorkingMesh, f64) {
    let space = Arc::new(Space::of(own.mesh, &own.options).recording(records));
    (WorkingMesh::new(own.mesh, &space), space.unit)
}

/// Simplifies a surface to its end, or to at most `end` triangles once it costs anything. Its quadrics are summed
/// anew each time that it has shrunk to a share, and when it stops, as long as it goes on from there.
fn find_way(own: &Shared<'_>, end: usize, goal: &Goal<'_>) -> (Curve, Way) {
    let Shared { mesh, options, .. } = own;
    let (working, unit) = begin(own, false);
    let settings = &options.settings;
    let max_error = settings.max_error.map_or(f64::INFINITY, |limit| limit / unit);
    let mut descent = Descent::new(mesh, working, Vec::new(), max_error);
    descent.find_pairs();
    descent.guard(settings.limits(unit));
    descent.keep_steps();
    // An error limit is about the source.
    let rebuilds_quadrics = settings.max_error.is_none() && settings.cost.is_summed_anew();
    let (source, scale, part) = (mesh.triangles.len(), own.scale(unit), goal.part(own));
    let mut curve = Curve::new(source);
    let (mut left, mut dearest) = (source, 0.0f64);
    loop {
        let now = descent.triangles();
        let next = if rebuilds_quadrics {
            (REBUILD_SHARE * now as f64) as usize
        } else if now > end {
            end
        } else {
            0
        };
        let goes_on = |cost: f64, triangles: usize| {
            if triangles < left {
                curve.push(triangles, dearest);
                goal.count(part, [left, triangles]);
                left = triangles;
            }
            if triangles > next {
                dearest = dearest.max(shared_cost(cost, scale * hedge(source, triangles)));
            }
            triangles > next
        };
        let slack = regions::queue_slack(now);
        let stopped = descent.descend_while(goes_on, slack, &AtomicUsize::new(0));
        let is_stuck = left == now || (stopped.is_some() && !rebuilds_quadrics);
        if is_stuck || (left <= end && dearest > 0.0) {
            curve.shrink_to_fit();
            return (curve, Way { steps: descent.into_steps(), is_open: !is_stuck, stopped });
        }
        if rebuilds_quadrics {
            descent.rebuild_quadrics();
        }
    }
}

/// Finds where all surfaces are at each target, and each time that all together have shrunk to a share.
fn find_halts(curves: &[Curve], targets: &[usize]) -> Vec<Halt> {
    let mut done = vec![0; curves.len()];
    let mut halts = Vec::new();
    let mut now: usize = curves.iter().map(|curve| curve.triangles(0)).sum();
    for &target in targets {
        loop {
            let next = target.max((REBUILD_SHARE * now as f64) as usize);
            share_out(curves, &mut done, next);
            let triangles: Vec<usize> =
                curves.iter().zip(&done).map(|(curve, &done)| curve.triangles(done)).collect();
            now = triangles.iter().sum();
            let (is_level, is_missed) = (next == target || now > next, now > target);
            halts.push(Halt { triangles, is_level, is_missed });
            if is_level {
                break;
            }
        }
    }
    halts
}

/// Simplifies the surface at a place of the list once more, and makes its levels.
fn take_way(
    own: &Shared<'_>,
    way: &Way,
    (halts, at): (&[Halt], usize),
    records: bool,
) -> (Vec<Level>, Log) {
    let (working, _) = begin(own, records);
    let mut descent = Descent::unranked(own.mesh, working, Vec::new(), f64::INFINITY);
    let finish = Finish::new(own.mesh, &own.options);
    let (mut levels, mut steps) = (Vec::new(), &way.steps[..]);
    for halt in halts {
        steps = descent.redo(steps, halt.triangles[at]);
        if halt.is_level {
            let stopped = way.stopped.filter(|_| halt.is_missed);
            levels.push(finish.level(&descent, descent.triangles(), stopped));
        }
        if let Some(log) = descent.log() {
            if halt.is_level {
                log.mark_level();
            }
            log.mark_phase();
        }
    }
    (levels, descent.log().map(std::mem::take).unwrap_or_default())
}

/// The factor by which costs of a surface count more, the more of its triangles it has lost.
fn hedge(source: usize, triangles: usize) -> f64 {
    (source as f64 / triangles as f64).powi(HEDGE)
}

/// A cost in the shared space. 0 where no item is queued: items that were put aside are to be
/// retried now, not once all others are at their end.
fn shared_cost(cost: f64, scale: f64) -> f64 {
    if cost < ROUNDING || cost == f64::INFINITY { 0.0 } else { (cost * scale).min(f64::MAX) }
}

#[cfg(test)]
mod tests;
