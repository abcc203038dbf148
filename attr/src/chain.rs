//! Levels of detail from one descent: a level each time a target is passed.

use std::cell::LazyCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::error::{Error, Result};
use crate::facing::Facing;
use crate::id::{PointId, WedgeId};
use crate::item::MAX_TRIANGLES;
use crate::mesh::Mesh;
use crate::options::Options;
use crate::polish::{Guards, Polish, Source};
use crate::quadric::MAX_ATTRIBUTES;
use crate::region_source::RegionSource;
use crate::regions;
use crate::simplify::{Descent, Stop};
use crate::space::Space;

/// With a limit on deviation, a polish moves no point farther than this share of it.
///
/// Lab note: a fox of 576 triangles at 25 and 12.5 %, RMS and greatest distance over the diagonal, in
/// thousandths: unheld 3.05, 5.4 and 19, 46; 1: 3.06, 5.9 and 19, 31; **0.75**: 3.07, 6.6 and 19, 33; 0.5:
/// 3.25, 6.9 and 21, 29. At 6.25 % 1 is at 44 and 0.75 at 36.
const MAX_MOVE: f64 = 0.75;

/// One level of detail.
#[derive(Clone, Debug)]
pub struct Level {
    /// The simplified mesh. Normals are unit vectors; colors stay within the range of the source.
    pub mesh: Mesh,
    /// One per point: the point of the source that it stands for, the nearest of those merged
    /// into it as far as the collapses saw it.
    pub point_sources: Vec<PointId>,
    /// One per wedge: the wedge of the source that it stands for.
    pub wedge_sources: Vec<WedgeId>,
    /// The target, in triangles.
    pub target: usize,
    /// Root of the largest area-weighted cost of any collapse up to here, in the units of the
    /// mesh: how far position, texture and shading slid, weighed together. Of a small surface each is
    /// against what it was at most a step before, unless there is an error limit. An estimate that
    /// steers the descent, not a bound on distance.
    pub error: f64,
    /// The reason why the target was not reached, if it was not.
    pub stopped: Option<Stop>,
}

/// Simplifies `mesh` to each of `targets`, in one descent.
///
/// `targets` are triangle counts, the largest first. Each level has at most its target of
/// triangles, and fewer only by what the last step took beyond it: one triangle of a collapse, or
/// up to fifteen of a small shell that was removed; unless `stopped` says why the target was missed.
/// The result is the same at any number of threads. `removed` counts triangles as they go, for a
/// progress bar.
///
/// # Errors
/// [`Error::Invalid`] if the mesh does not validate or carries too many attributes;
/// [`Error::Options`] if the targets grow or an option makes no sense.
pub fn simplify_chain(
    mesh: &Mesh,
    targets: &[usize],
    options: &Options<'_>,
    removed: &AtomicUsize,
) -> Result<Vec<Level>> {
    check(mesh, targets, options)?;
    let space = Arc::new(Space::of(mesh, options));
    let max_error = options.settings.max_error.map_or(f64::INFINITY, |limit| limit / space.unit);
    let begin = |region_source: RegionSource<'_>, target: usize| {
        // Regions know no guard: it starts where one queue does.
        let end = options
            .settings
            .max_deviation
            .map_or(target, |_| target.max(regions::MIN_LARGE_TRIANGLES));
        let working = regions::descend(region_source, mesh, end, max_error, removed);
        let mut descent = Descent::new(mesh, working, Vec::new(), max_error);
        descent.find_pairs();
        descent
    };
    let Some(&first) = targets.first() else { return Ok(Vec::new()) };
    let finish = Finish::new(mesh, options);
    let mut descent = begin(RegionSource::Mesh(mesh, Arc::clone(&space)), first);
    let mut levels = Vec::with_capacity(targets.len());
    // An error limit is about the source.
    let rebuilds_quadrics = options.settings.max_error.is_none();
    for &target in targets {
        if regions::is_large(descent.triangles(), target) {
            descent = begin(RegionSource::Working(Box::new(descent.into_working_mesh())), target);
        }
        if !descent.is_guarded() {
            descent.guard(options.settings.limits(space.unit));
        }
        let mut stopped = None;
        if !(rebuilds_quadrics && regions::is_small(descent.triangles())) {
            let end = if rebuilds_quadrics {
                target.max(regions::MIN_LARGE_TRIANGLES - 1)
            } else {
                target
            };
            stopped = descent.descend(end, regions::queue_slack(descent.triangles()), removed);
        }
        if rebuilds_quadrics && stopped.is_none() && descent.triangles() > target {
            stopped = descent.descend_in_steps(target, removed);
        }
        levels.push(finish.level(&descent, target, stopped));
    }
    Ok(levels)
}

/// Makes levels of a descent.
pub(crate) struct Finish<'a> {
    mesh: &'a Mesh,
    options: &'a Options<'a>,
    color_range: Vec<(f32, f32)>,
}

impl<'a> Finish<'a> {
    /// A maker of levels of `mesh`, simplified with `options`.
    pub(crate) fn new(mesh: &'a Mesh, options: &'a Options<'a>) -> Self {
        Self { mesh, options, color_range: color_range(mesh) }
    }

    /// The level that a descent has reached.
    pub(crate) fn level(
        &self,
        descent: &Descent<'_>,
        target: usize,
        stopped: Option<Stop>,
    ) -> Level {
        let (mesh, point_sources, wedge_sources) = descent.snapshot();
        let error = descent.error();
        let mut level = Level { mesh, point_sources, wedge_sources, target, error, stopped };
        finish_attributes(&mut level.mesh, &self.color_range);
        let locked = self.options.locked_of(&level.point_sources);
        restore_locked(&mut level, self.mesh, &locked);
        level
    }
}

/// Checks the input of a simplification.
///
/// # Errors
/// See [`simplify_chain`].
pub(crate) fn check(mesh: &Mesh, targets: &[usize], options: &Options<'_>) -> Result<()> {
    mesh.validate()?;
    if mesh.layout.len() > MAX_ATTRIBUTES {
        let what = format!("{} attributes a wedge, {MAX_ATTRIBUTES} at most", mesh.layout.len());
        return Err(Error::Invalid { what });
    }
    if mesh.triangles.len() > MAX_TRIANGLES {
        let what = format!("{} triangles, {MAX_TRIANGLES} at most", mesh.triangles.len());
        return Err(Error::Invalid { what });
    }
    if targets.windows(2).any(|pair| pair[0] < pair[1]) {
        return Err(Error::Options { what: "targets must not grow from level to level".into() });
    }
    options.check(mesh)
}

/// Fits each level to `mesh`, which it was made from with `options`: see [`Polish`]. One that has lost
/// no triangle stays as it is, and so do locked points. `done` counts levels as they go, for a progress bar.
///
/// # Errors
/// [`Error::Options`] if an option makes no sense.
pub fn polish_chain(
    mesh: &Mesh,
    levels: &mut [Level],
    options: &Options<'_>,
    polish: &Polish,
    done: &AtomicUsize,
) -> Result<()> {
    options.check(mesh)?;
    polish.check()?;
    let range = color_range(mesh);
    // Sampling the source takes longest of all that a polish starts with.
    let source = LazyCell::new(|| Source::new(mesh));
    let facing = Facing::of(mesh);
    for level in levels {
        if level.mesh.triangles.len() < mesh.triangles.len() {
            let locked = options.locked_of(&level.point_sources);
            let guards = Guards {
                locked: &locked,
                rotation_cosine: options.settings.rotation_cosine(),
                keep_volume: options.settings.keep_volume,
                facing: &facing,
                point_sources: &level.point_sources,
                max_move: options
                    .settings
                    .max_deviation
                    .map_or(f64::INFINITY, |limit| limit * MAX_MOVE),
            };
            polish.fit(&source, &mut level.mesh, &guards);
            finish_attributes(&mut level.mesh, &range);
            restore_locked(level, mesh, &locked);
        }
        done.fetch_add(1, Ordering::Relaxed);
    }
    Ok(())
}

/// Gives locked points and their wedges what they have in the source, to the bit.
fn restore_locked(level: &mut Level, source: &Mesh, locked: &[bool]) {
    if locked.is_empty() {
        return;
    }
    for (point, &stands_for) in level.point_sources.iter().enumerate() {
        if locked[point] {
            level.mesh.positions[point] = source.positions[stands_for];
        }
    }
    let len = level.mesh.layout.len();
    for (wedge, &stands_for) in level.wedge_sources.iter().enumerate() {
        let point = level.mesh.wedge_points[wedge];
        let is_own = source.wedge_points[stands_for] == level.point_sources[point];
        if locked[point.index()] && is_own {
            level.mesh.attributes[wedge * len..][..len].copy_from_slice(source.row(stands_for));
        }
    }
}

/// Least and greatest value of each color channel.
fn color_range(mesh: &Mesh) -> Vec<(f32, f32)> {
    let (len, start) = (mesh.layout.len(), mesh.layout.color());
    (start..len)
        .map(|channel| {
            let values = mesh.attributes.iter().skip(channel).step_by(len);
            values.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &x| {
                (low.min(x), high.max(x))
            })
        })
        .collect()
}

/// Makes the fitted attributes what they stand for: normals of unit length, colors in range.
fn finish_attributes(mesh: &mut Mesh, color_range: &[(f32, f32)]) {
    let layout = mesh.layout;
    if layout.is_empty() {
        return;
    }
    for row in mesh.attributes.chunks_exact_mut(layout.len()) {
        if layout.normal {
            let normal = &mut row[layout.normal()..][..3];
            let unit = glam::Vec3::from_slice(normal).normalize_or(glam::Vec3::Z);
            normal.copy_from_slice(&unit.to_array());
        }
        for (channel, &(low, high)) in row[layout.color()..].iter_mut().zip(color_range) {
            *channel = channel.clamp(low, high);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;
    use crate::testing::{grid, sphere, surface};
    use glam::Vec3;
    use proptest::prelude::*;

    fn chain(mesh: &Mesh, targets: &[usize]) -> Vec<Level> {
        simplify_chain(mesh, targets, &Options::default(), &AtomicUsize::new(0)).unwrap()
    }

    /// Edges by how many triangles they have: (one, two, more).
    fn edge_counts(mesh: &Mesh) -> (usize, usize, usize) {
        let mut edges: Vec<[PointId; 2]> = (0..mesh.triangles.len())
            .flat_map(|triangle| {
                let [a, b, c] = mesh.triangle_points(triangle);
                [(a, b), (b, c), (c, a)].map(|(p, q)| [p.min(q), p.max(q)])
            })
            .collect();
        edges.sort_unstable();
        edges.chunk_by(|a, b| a == b).fold((0, 0, 0), |(one, two, more), run| match run.len() {
            1 => (one + 1, two, more),
            2 => (one, two + 1, more),
            _ => (one, two, more + 1),
        })
    }

    #[test]
    fn a_flat_grid_goes_to_two_triangles_without_error() {
        let level = chain(&grid(8), &[2]).remove(0);
        assert_eq!((level.mesh.triangles.len(), level.stopped), (2, None));
        assert!(level.error < 1e-6);
        let area: f32 = (0..2)
            .map(|t| {
                let [a, b, c] = level.mesh.triangle_positions(t);
                (b - a).cross(c - a).length() / 2.0
            })
            .sum();
        assert!((area - 1.0).abs() < 1e-4, "area {area}");
    }

    #[test]
    fn a_sphere_stays_closed_and_near_itself_through_its_seam_and_poles() {
        let source = sphere(24);
        let targets = [1000, 500, 250, 60];
        for (level, target) in chain(&source, &targets).iter().zip(targets) {
            level.mesh.validate().unwrap();
            let triangles = level.mesh.triangles.len();
            assert!(triangles <= target && triangles + 2 > target, "{triangles} of {target}");
            let (one, _, more) = edge_counts(&level.mesh);
            assert_eq!((one, more), (0, 0));
            for p in &level.mesh.positions {
                assert!((p.length() - 1.0).abs() < 0.2, "{p}");
            }
        }
    }

    #[test]
    fn an_unreachable_target_says_why() {
        let level = chain(&sphere(6), &[1]).remove(0);
        assert_eq!(level.stopped, Some(Stop::NoLegalCollapse));
        assert!(level.mesh.triangles.len() >= 4);
    }

    #[test]
    fn the_error_limit_ends_the_descent() {
        let options: Options<'_> = Settings { max_error: Some(1e-3), ..Settings::default() }.into();
        let levels = simplify_chain(&sphere(16), &[10], &options, &AtomicUsize::new(0)).unwrap();
        assert_eq!(levels[0].stopped, Some(Stop::ErrorLimit));
        assert!(levels[0].error <= 1e-3 && levels[0].mesh.triangles.len() > 10);
    }

    #[test]
    fn a_mesh_far_away_or_tiny_gives_the_same_triangles() {
        // Powers of two, so that the move itself rounds nothing that the scale of a unit sphere
        // does not: coordinates keep 2⁻³ of 2²⁰, so the sphere is made on that lattice first.
        let snapped = |mut mesh: Mesh, map: &dyn Fn(Vec3) -> Vec3| {
            for p in &mut mesh.positions {
                *p = map((*p * 512.0).round());
            }
            mesh
        };
        let near = chain(&snapped(sphere(12), &|p| p), &[100]).remove(0);
        let far = chain(&snapped(sphere(12), &|p| p + Vec3::splat(1_048_576.0)), &[100]).remove(0);
        let tiny = chain(&snapped(sphere(12), &|p| p / 536_870_912.0), &[100]).remove(0);
        assert_eq!(near.mesh.triangles, far.mesh.triangles);
        assert_eq!(near.mesh.triangles, tiny.mesh.triangles);
    }

    #[test]
    fn small_shells_are_removed_rather_than_stop_the_descent() {
        let mut soup = grid(8);
        let quad = grid(1);
        for copy in 0..20u32 {
            let (points, wedges) = (soup.positions.len() as u32, soup.wedge_points.len() as u32);
            let at = |p: &Vec3| *p * 0.01 + Vec3::new(copy as f32 * 0.05, 0.0, 1.0);
            soup.positions.extend(quad.positions.iter().map(at));
            soup.wedge_points.extend(quad.wedge_points.iter().map(|p| PointId(p.0 + points)));
            soup.attributes.extend(&quad.attributes);
            soup.triangles.extend(quad.triangles.iter().map(|t| t.map(|w| WedgeId(w.0 + wedges))));
            soup.groups.extend(&quad.groups);
        }
        let level = chain(&soup, &[6]).remove(0);
        assert_eq!(level.stopped, None);
        assert!(level.mesh.positions.iter().any(|p| p.z == 0.0), "the large sheet stays");
    }

    #[test]
    fn a_string_keeps_its_length() {
        let string = surface(20, |x, y| {
            let turn = if x == 1.0 { 0.0 } else { x * std::f32::consts::TAU };
            let wave = 0.006 * (60.0 * y).sin();
            Vec3::new(y, 0.003 * turn.cos(), 0.003 * turn.sin() + wave)
        });
        let length = |mesh: &Mesh| {
            let xs = mesh.positions.iter().map(|p| p.x);
            xs.clone().fold(f32::MIN, f32::max) - xs.fold(f32::MAX, f32::min)
        };
        for level in chain(&string, &[200, 100, 50]) {
            let kept = length(&level.mesh);
            assert!(kept > 0.98, "{kept} at {} triangles", level.target);
        }
    }

    #[test]
    fn levels_are_the_same_with_one_thread_and_with_two() {
        let mesh = sphere(24);
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| chain(&mesh, &[300, 100]))
        };
        for (one, two) in run(1).iter().zip(run(2)) {
            assert_eq!(one.mesh, two.mesh);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn a_bumpy_sheet_stays_sound(seed in 0.0..100.0f32, ratio in 0.02..0.9f64) {
            let source = surface(12, |x, y| {
                Vec3::new(x, y, 0.1 * ((x * 9.0 + seed).sin() * (y * 7.0 - seed).cos()))
            });
            let target = (source.triangles.len() as f64 * ratio) as usize;
            let level = chain(&source, &[target]).remove(0);
            level.mesh.validate().unwrap();
            prop_assert!(level.mesh.triangles.len() <= target.max(2));
            prop_assert_eq!(edge_counts(&level.mesh).2, 0);
            for wedges in &level.mesh.triangles {
                let [a, b, c] = wedges.map(|wedge| level.mesh.uv(wedge, 0));
                prop_assert!((b - a).perp_dot(c - a) > 0.0, "a UV triangle folded over");
            }
        }
    }
}
