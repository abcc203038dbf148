//! The levels of every surface of an asset: simplified and polished, the surfaces in parallel.

use std::sync::atomic::AtomicUsize;

use rayon::prelude::*;
use seamwise_attr::{Level, Polish, Shared, polish_chain, simplify_chain, simplify_together};

use super::options::{BakeOptions, BudgetPer};
use super::steering::MeshSteering;
use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::surface::geometry::Geometry;

/// The levels of each surface; `steering` has one entry per surface.
pub(crate) fn simplify_all(
    geometries: &[Geometry],
    steering: &[MeshSteering],
    options: &BakeOptions,
    progress: &Progress,
) -> Result<Vec<Vec<Level>>> {
    let least = options.targets.counts(triangle_count(geometries)).last().copied();
    let to_remove = least.map_or(0, |least| triangle_count(geometries).saturating_sub(least));
    let simplify = |removed: &AtomicUsize| match options.budget_per {
        BudgetPer::Scene if geometries.len() > 1 => {
            together(geometries, steering, options, removed)
        }
        BudgetPer::Scene | BudgetPer::Mesh => {
            simplify_separately(geometries, steering, options, (progress, removed))
        }
    };
    progress.stage("simplify", to_remove, simplify)
}

fn internal(error: &seamwise_attr::Error) -> Error {
    Error::Internal { what: error.to_string() }
}

/// Simplifies each surface to its own targets, the surfaces in parallel.
fn simplify_separately(
    geometries: &[Geometry],
    steering: &[MeshSteering],
    options: &BakeOptions,
    (progress, removed): (&Progress, &AtomicUsize),
) -> Result<Vec<Vec<Level>>> {
    let shares = options.targets.shares(triangle_count(geometries));
    let simplify = |(geometry, steering): (&Geometry, &MeshSteering)| {
        progress.check("simplify")?;
        let least = if geometries.len() > 1 { MIN_TRIANGLES } else { 1 };
        let targets = targets(geometry, &shares, least);
        simplify_chain(&geometry.welded.mesh, &targets, &steering.options(), removed)
            .map_err(|error| internal(&error))
    };
    geometries.par_iter().zip(steering).map(simplify).collect()
}

/// Simplifies all surfaces to common targets.
fn together(
    geometries: &[Geometry],
    steering: &[MeshSteering],
    options: &BakeOptions,
    removed: &AtomicUsize,
) -> Result<Vec<Vec<Level>>> {
    let surfaces: Vec<Shared<'_>> = geometries
        .iter()
        .zip(steering)
        .map(|(geometry, steering)| Shared {
            mesh: &geometry.welded.mesh,
            options: steering.options(),
            stretches: steering.stretches(),
        })
        .collect();
    let counts = options.targets.counts(triangle_count(geometries));
    simplify_together(&surfaces, &counts, removed).map_err(|error| internal(&error))
}

/// Fits the levels to their surfaces, the surfaces in parallel; `steering` has one entry per
/// surface.
pub(crate) fn polish_all(
    geometries: &[Geometry],
    chains: &mut [Vec<Level>],
    steering: &[MeshSteering],
    polish: &Polish,
    progress: &Progress,
) -> Result<()> {
    let levels = chains.iter().map(Vec::len).sum();
    progress.stage("polish", levels, |done| {
        geometries.par_iter().zip(chains).zip(steering).try_for_each(
            |((geometry, levels), steering)| {
                progress.check("polish")?;
                polish_chain(&geometry.welded.mesh, levels, &steering.options(), polish, done)
                    .map_err(|error| internal(&error))
            },
        )
    })
}

/// Among others, a mesh of its own budget keeps as many triangles as a box: fewer would be shards.
const MIN_TRIANGLES: usize = 12;

/// The triangles each level of a surface is to have, `least` if it has so many.
fn targets(geometry: &Geometry, shares: &[f64], least: usize) -> Vec<usize> {
    let own = geometry.welded.mesh.triangles.len();
    let share = |share: &f64| ((own as f64 * share).round() as usize).max(least.min(own));
    shares.iter().map(share).collect()
}

pub(crate) fn triangle_count(geometries: &[Geometry]) -> usize {
    geometries.iter().map(|geometry| geometry.welded.mesh.triangles.len()).sum()
}
