//! Simplifications that keep a record of their collapses.

use std::sync::atomic::AtomicUsize;

use crate::chain::{Finish, Level, run_chain};
use crate::error::Result;
use crate::mesh::Mesh;
use crate::options::Options;
use crate::progressive::log::Log;
use crate::progressive::mesh::ProgressiveMesh;
use crate::progressive::order::ProgressiveScene;
use crate::progressive::replay::replay;
use crate::settings::Placement;
use crate::together::{Shared, run_together};

/// Simplifies as [`simplify_chain`](crate::simplify_chain), and gives the levels with all that lies between
/// them.
///
/// # Errors
/// As [`simplify_chain`](crate::simplify_chain).
pub fn record_chain(
    mesh: &Mesh,
    targets: &[usize],
    options: &Options<'_>,
    removed: &AtomicUsize,
) -> Result<Recorded> {
    let (levels, log) = run_chain(mesh, targets, options, true, removed)?;
    let log = log.unwrap_or_default();
    Ok(Recorded { levels: vec![levels], scene: scene(vec![recorded(mesh, options, &log)], &[log]) })
}

/// Simplifies as [`simplify_together`](crate::simplify_together), and gives the levels with all that lies
/// between them.
///
/// # Errors
/// As [`simplify_together`](crate::simplify_together).
pub fn record_together(
    surfaces: &[Shared<'_>],
    targets: &[usize],
    removed: &AtomicUsize,
) -> Result<Recorded> {
    let (levels, logs) = run_together(surfaces, targets, true, removed)?;
    let of = |(own, log): (&Shared<'_>, &Log)| recorded(own.mesh, &own.options, log);
    let meshes = surfaces.iter().zip(&logs).map(of).collect();
    Ok(Recorded { levels, scene: scene(meshes, &logs) })
}

/// Levels, and the collapses that lead to them.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// One entry per surface, each with a level per target.
    pub levels: Vec<Vec<Level>>,
    /// The surfaces as fine as they are asked to be.
    pub scene: ProgressiveScene,
}

fn recorded(mesh: &Mesh, options: &Options<'_>, log: &Log) -> ProgressiveMesh {
    let finish = Finish::new(mesh, options);
    let keeps_ends = options.settings.placement == Placement::Ends;
    replay(mesh, log, keeps_ends, |row| finish.row(row))
}

fn scene(meshes: Vec<ProgressiveMesh>, logs: &[Log]) -> ProgressiveScene {
    let phases = logs.iter().map(|log| &log.phases[..]).collect::<Vec<_>>();
    ProgressiveScene::new(meshes, &phases)
}
