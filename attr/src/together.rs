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
//! Each surface is simplified in a queue of its own, however large: regions, which large surfaces are simplified in
//! when they are alone, are not cut here.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use rayon::prelude::*;

use crate::chain::{Finish, Level, check};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::options::Options;
use crate::progressive::log::Log;
use crate::regions;
use crate::settings::Cost;
use crate::sharing::{Simplifiable, share_out};
use crate::simplify::{Descent, REBUILD_SHARE, Stop};
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
/// | **6** | 1.01 (0.98), 1.00 (0.98) | 1.00 (0.98), 1.00 (0.91) |
///
/// With the weight of normals against the scene's extent instead of each mesh's own, the helmet is at 0.96
/// of the luminance and 1.10 of the distance at 50 and 25 %.
const HEDGE: i32 = 6;

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
/// No surface is removed whole. The result is the same at any number of threads. `removed` counts triangles as
/// they go, for a progress bar.
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
    let mut members: Vec<Member<'_>> =
        surfaces.par_iter().map(|own| Member::new(own, records, removed)).collect();
    let largest = members.iter().map(|member| member.scale).fold(0.0, f64::max);
    if largest > 0.0 {
        members.iter_mut().for_each(|member| member.scale /= largest);
    }
    let mut chains = vec![Vec::with_capacity(targets.len()); surfaces.len()];
    for &target in targets {
        descend_in_steps(&mut members, target);
        let missed = count(&members) > target;
        let emit = |member: &Member<'_>| {
            let stopped = member.stopped.filter(|_| missed);
            member.finish.level(&member.descent, member.descent.triangles(), stopped)
        };
        let levels: Vec<Level> = members.par_iter().map(emit).collect();
        chains.iter_mut().zip(levels).for_each(|(chain, level)| chain.push(level));
        members.iter_mut().filter_map(|member| member.descent.log()).for_each(Log::mark_level);
    }
    let logs = members.iter_mut().filter_map(|member| member.descent.log());
    let logs = logs.map(std::mem::take).collect();
    Ok((chains, logs))
}

/// Simplifies to `target` triangles. All quadrics are summed anew at once, so that costs are
/// comparable.
fn descend_in_steps(members: &mut [Member<'_>], target: usize) {
    loop {
        members.par_iter_mut().for_each(Member::rebuild_quadrics);
        let next = target.max((REBUILD_SHARE * count(members) as f64) as usize);
        share_out(members, next);
        members.iter_mut().filter_map(|member| member.descent.log()).for_each(Log::mark_phase);
        if next == target || count(members) > next {
            return;
        }
    }
}

/// Triangles of all.
fn count(members: &[Member<'_>]) -> usize {
    members.iter().map(|member| member.descent.triangles()).sum()
}

/// One of the surfaces that are simplified together.
struct Member<'a> {
    descent: Descent<'a>,
    finish: Finish<'a>,
    /// The factor of its costs in the shared space.
    scale: f64,
    /// Its triangles at first, and when its quadrics were last summed.
    source: usize,
    summed_at: usize,
    /// Whether they ever are anew: an error limit is about the source.
    rebuilds_quadrics: bool,
    /// The reason why it can't go on, if it can't.
    stopped: Option<Stop>,
    removed: &'a AtomicUsize,
}

impl<'a> Member<'a> {
    fn new(own: &'a Shared<'a>, records: bool, removed: &'a AtomicUsize) -> Self {
        let Shared { mesh, options, .. } = own;
        let space = Arc::new(Space::of(mesh, options).recording(records));
        let max_error =
            options.settings.max_error.map_or(f64::INFINITY, |limit| limit / space.unit);
        let mut descent = Descent::new(mesh, WorkingMesh::new(mesh, &space), Vec::new(), max_error);
        descent.find_pairs();
        descent.guard(options.settings.limits(space.unit));
        Self {
            descent,
            finish: Finish::new(mesh, options),
            scale: own.scale(space.unit),
            summed_at: mesh.triangles.len(),
            source: mesh.triangles.len(),
            rebuilds_quadrics: options.settings.max_error.is_none()
                && options.settings.cost.is_summed_anew(),
            stopped: None,
            removed,
        }
    }

    /// Sums its quadrics anew if it has changed.
    fn rebuild_quadrics(&mut self) {
        let now = self.descent.triangles();
        if self.rebuilds_quadrics && now < self.summed_at {
            self.descent.rebuild_quadrics();
            (self.summed_at, self.stopped) = (now, None);
        }
    }
}

impl Simplifiable for Member<'_> {
    fn triangles(&self) -> usize {
        self.descent.triangles()
    }

    fn least(&self) -> f64 {
        if self.stopped.is_some() {
            f64::INFINITY
        } else {
            shared_cost(self.descent.least(), self.scale * hedge(self.source, self.triangles()))
        }
    }

    fn descend_while(&mut self, mut goes_on: impl FnMut(f64, usize) -> bool) {
        let (queue_slack, scale) = (regions::queue_slack(self.descent.triangles()), self.scale);
        let source = self.source;
        let goes_on = |cost: f64, triangles: usize| {
            goes_on(shared_cost(cost, scale * hedge(source, triangles)), triangles)
        };
        self.stopped = self.descent.descend_while(goes_on, queue_slack, self.removed);
    }
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
mod tests {
    use super::*;
    use crate::chain::simplify_chain;
    use crate::settings::Settings;
    use crate::testing::{grid, sphere, surface};
    use glam::Vec3;

    fn shared<'a>(mesh: &'a Mesh, stretches: &'a [f64]) -> Shared<'a> {
        Shared { mesh, options: Options::default(), stretches }
    }

    /// Triangles of each surface at each level.
    fn left(surfaces: &[Shared<'_>], targets: &[usize]) -> Vec<Vec<usize>> {
        let chains = simplify_together(surfaces, targets, &AtomicUsize::new(0)).unwrap();
        let triangles = |level: &Level| {
            level.mesh.validate().unwrap();
            level.mesh.triangles.len()
        };
        chains.iter().map(|chain| chain.iter().map(triangles).collect()).collect()
    }

    #[test]
    fn a_plane_gives_what_a_sphere_keeps_and_the_sum_meets_its_target() {
        let (plane, ball) = (grid(40), sphere(24));
        let targets = [2200, 800, 300];
        let left = left(&[shared(&plane, &[1.0]), shared(&ball, &[1.0])], &targets);
        for (level, target) in targets.into_iter().enumerate() {
            let sum = left[0][level] + left[1][level];
            assert!(sum <= target && sum + 1 >= target, "{sum} of {target}");
        }
        assert!(left[0][1] < 10 && left[1][1] > 780, "{left:?}");
        assert!(left[0][2] >= 1);
    }

    #[test]
    fn like_surfaces_get_alike_and_one_alone_what_it_would() {
        let ball = sphere(24);
        let twins = left(&[shared(&ball, &[1.0]), shared(&ball, &[1.0])], &[1000, 300]);
        assert!(twins[0].iter().zip(&twins[1]).all(|(a, b)| a.abs_diff(*b) <= 10), "{twins:?}");
        let alone = simplify_together(&[shared(&ball, &[3.0])], &[500, 99], &AtomicUsize::new(0));
        let chain = simplify_chain(&ball, &[500, 99], &Options::default(), &AtomicUsize::new(0));
        for (one, other) in alone.unwrap()[0].iter().zip(chain.unwrap()) {
            assert_eq!(one.mesh, other.mesh);
        }
    }

    #[test]
    fn what_is_shown_large_or_often_gets_more() {
        let bumps = surface(30, |x, y| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()));
        let gets = |stretches: &[f64]| {
            let left = left(&[shared(&bumps, &[1.0]), shared(&bumps, stretches)], &[900]);
            left[1][0] as f64 / left[0][0] as f64
        };
        // A cost is about the cube of a triangle's area in its own space, and the hedge is a power.
        let (twice, often) = (gets(&[2.0]), gets(&[1.0; 16]));
        assert!((twice / 16f64.powf(1.0 / f64::from(3 + HEDGE)) - 1.0).abs() < 0.15, "{twice}");
        assert_eq!(twice, often);
        let small = bumps.positions.iter().map(|&p| p * 0.25).collect();
        let small = Mesh { positions: small, ..bumps.clone() };
        let left = left(&[shared(&bumps, &[1.0]), shared(&small, &[8.0])], &[900]);
        assert_eq!(left[1][0] as f64 / left[0][0] as f64, twice, "a mesh in other units");
    }

    #[test]
    fn a_small_thing_stays_beside_a_vast_plain() {
        let (mut plain, ball) = (grid(40), sphere(24));
        plain.positions.iter_mut().for_each(|p| *p = (*p + Vec3::splat(0.3)) * 3000.0);
        let left = left(&[shared(&plain, &[1.0]), shared(&ball, &[1.0])], &[1000]);
        assert!(left[0][0] < 40, "{left:?}");
    }

    #[test]
    fn limits_and_locks_hold_and_what_stops_says_so() {
        let (plane, ball) = (grid(12), sphere(12));
        let locked = vec![true; plane.positions.len()];
        let surfaces = [
            Shared {
                options: Options { locked: &locked, ..Options::default() },
                ..shared(&plane, &[1.0])
            },
            Shared {
                options: Settings { max_error: Some(5e-2), ..Settings::default() }.into(),
                ..shared(&ball, &[1.0])
            },
        ];
        let chains = simplify_together(&surfaces, &[790, 290], &AtomicUsize::new(0)).unwrap();
        assert_eq!(chains[0][1].mesh.triangles.len(), plane.triangles.len());
        assert_eq!([chains[0][0].stopped, chains[1][0].stopped], [None, None]);
        let stops = [chains[0][1].stopped, chains[1][1].stopped];
        assert_eq!(stops, [Some(Stop::NoLegalCollapse), Some(Stop::ErrorLimit)]);
        assert!(chains[1][1].error <= 5e-2);
    }

    #[test]
    fn levels_are_the_same_with_one_thread_and_with_three() {
        let bumps = surface(30, |x, y| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()));
        let (plane, ball) = (grid(30), sphere(24));
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let all = [&bumps, &plane, &ball].map(|mesh| shared(mesh, &[1.0]));
            pool.install(|| simplify_together(&all, &[2000, 500, 100], &AtomicUsize::new(0)))
        };
        for (one, three) in run(1).unwrap().iter().zip(run(3).unwrap()) {
            assert!(one.iter().zip(three).all(|(one, three)| one.mesh == three.mesh));
        }
    }
}
