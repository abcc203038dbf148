//! Levels of detail from one descent: a level each time a target is passed.

use std::cell::LazyCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::error::{Error, Result};
use crate::facing::Facing;
use crate::id::{PointId, WedgeId};
use crate::item::MAX_TRIANGLES;
use crate::mesh::{Layout, Mesh};
use crate::options::Options;
use crate::polish::{Guards, Polish, Source};
use crate::progressive::log::Log;
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
    run_chain(mesh, targets, options, false, removed).map(|(levels, _)| levels)
}

/// The same, with the collapses on record if they are asked for.
pub(crate) fn run_chain(
    mesh: &Mesh,
    targets: &[usize],
    options: &Options<'_>,
    records: bool,
    removed: &AtomicUsize,
) -> Result<(Vec<Level>, Option<Log>)> {
    check(mesh, targets, options)?;
    let space = Arc::new(Space::of(mesh, options).recording(records));
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
    let stops = if records { with_halves(mesh.triangles.len(), targets) } else { targets.to_vec() };
    let Some(&first) = stops.first() else { return Ok((Vec::new(), None)) };
    let finish = Finish::new(mesh, options);
    let mut descent = begin(RegionSource::Mesh(mesh, Arc::clone(&space)), first);
    let mut levels = Vec::with_capacity(targets.len());
    // An error limit is about the source.
    let rebuilds_quadrics =
        options.settings.max_error.is_none() && options.settings.cost.is_summed_anew();
    for target in stops {
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
        let is_level = targets[levels.len()..].first() == Some(&target);
        if is_level {
            levels.push(finish.level(&descent, target, stopped));
        }
        if let Some(log) = descent.log() {
            if is_level {
                log.mark_level();
            }
            log.mark_phase();
        }
    }
    Ok((levels, descent.log().map(std::mem::take)))
}

/// Targets, and before each the halves that lead to it while a surface is large: regions go down one by one,
/// and on a record of them a mesh between two targets would be fine in one place and coarse in another.
fn with_halves(triangles: usize, targets: &[usize]) -> Vec<usize> {
    let (mut stops, mut now) = (Vec::new(), triangles);
    for &target in targets {
        while now / 2 > target && !regions::is_small(now) {
            now /= 2;
            stops.push(now);
        }
        now = target.min(now);
        stops.push(target);
    }
    stops
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

    /// Makes a fitted row what it stands for.
    pub(crate) fn row(&self, row: &mut [f32]) {
        finish_row(row, self.mesh.layout, &self.color_range);
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
    check_layout(mesh.layout)?;
    if mesh.triangles.len() > MAX_TRIANGLES {
        let what = format!("{} triangles, {MAX_TRIANGLES} at most", mesh.triangles.len());
        return Err(Error::Invalid { what });
    }
    if targets.windows(2).any(|pair| pair[0] < pair[1]) {
        return Err(Error::Options { what: "targets must not grow from level to level".into() });
    }
    options.check(mesh)
}

fn check_layout(layout: Layout) -> Result<()> {
    if layout.len() > MAX_ATTRIBUTES {
        let what = format!("{} attributes a wedge, {MAX_ATTRIBUTES} at most", layout.len());
        return Err(Error::Invalid { what });
    }
    Ok(())
}

/// Fits each level to `mesh`, which it was made from with `options`: see [`Polish`]. One that has lost
/// no triangle stays as it is, and so do locked points. `done` counts levels as they go, for a progress bar.
///
/// # Errors
/// [`Error::Invalid`] if the mesh carries too many attributes; [`Error::Options`] if an option makes no
/// sense.
pub fn polish_chain(
    mesh: &Mesh,
    levels: &mut [Level],
    options: &Options<'_>,
    polish: &Polish,
    done: &AtomicUsize,
) -> Result<()> {
    check_layout(mesh.layout)?;
    options.check(mesh)?;
    polish.check()?;
    let range = color_range(mesh);
    // Sampling the source takes longest of all that a polish starts with.
    let source = LazyCell::new(|| Source::new(mesh, options.importance));
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
    let rows = mesh.attributes.chunks_exact_mut(layout.len());
    rows.for_each(|row| finish_row(row, layout, color_range));
}

fn finish_row(row: &mut [f32], layout: Layout, color_range: &[(f32, f32)]) {
    if layout.normal {
        let normal = &mut row[layout.normal()..][..3];
        let unit = glam::Vec3::from_slice(normal).normalize_or(glam::Vec3::Z);
        normal.copy_from_slice(&unit.to_array());
    }
    for (channel, &(low, high)) in row[layout.color()..].iter_mut().zip(color_range) {
        *channel = channel.clamp(low, high);
    }
}

#[cfg(test)]
mod tests;
