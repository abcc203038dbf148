//! The levels of every surface of an asset: simplified and polished, the surfaces in parallel, each in the
//! frame that it is shown in.

use std::borrow::Cow;
use std::sync::atomic::AtomicUsize;

use glam::DMat4;
use rayon::prelude::*;
use seamwise_attr::{
    Layered, Level, Mesh, Placement, Polish, Shared, grow_cards, keep_fronts, polish_chain,
    simplify_chain, simplify_together,
};

use super::options::{BakeOptions, BudgetPer};
use super::steering::MeshSteering;
use crate::document::asset::Asset;
use crate::document::nodes::mesh_worlds;
use crate::error::{Error, Result};
use crate::level::lods::Lods;
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
    let meshes: Vec<Cow<'_, Mesh>> =
        geometries.par_iter().zip(steering).map(|(own, steering)| shown(own, steering)).collect();
    let simplify = |removed: &AtomicUsize| match options.budget_per {
        BudgetPer::Scene if geometries.len() > 1 => together(&meshes, steering, options, removed),
        BudgetPer::Scene | BudgetPer::Mesh => {
            simplify_separately(&meshes, steering, options, (progress, removed))
        }
    };
    let mut chains = progress.stage("simplify", to_remove, simplify)?;
    let levels = chains.par_iter_mut().zip(&meshes).zip(geometries).zip(steering);
    levels.for_each(|(((chain, mesh), geometry), steering)| {
        if let Some(frame) = steering.frame() {
            let source = &geometry.welded.mesh;
            chain.iter_mut().for_each(|level| frame.bring_back(level, source, mesh));
        }
    });
    Ok(chains)
}

/// A surface in the frame that it is shown in.
fn shown<'a>(geometry: &'a Geometry, steering: &MeshSteering) -> Cow<'a, Mesh> {
    let mesh = &geometry.welded.mesh;
    steering.frame().map_or(Cow::Borrowed(mesh), |frame| Cow::Owned(frame.show(mesh)))
}

fn internal(error: &seamwise_attr::Error) -> Error {
    Error::Internal { what: error.to_string() }
}

/// Simplifies each surface to its own targets, the surfaces in parallel.
fn simplify_separately(
    meshes: &[Cow<'_, Mesh>],
    steering: &[MeshSteering],
    options: &BakeOptions,
    (progress, removed): (&Progress, &AtomicUsize),
) -> Result<Vec<Vec<Level>>> {
    let shares = options.targets.shares(count(meshes));
    let simplify = |(mesh, steering): (&Cow<'_, Mesh>, &MeshSteering)| {
        progress.check("simplify")?;
        let least = if meshes.len() > 1 { MIN_TRIANGLES } else { 1 };
        let targets = targets(mesh, &shares, least);
        simplify_chain(mesh, &targets, &steering.options(), removed)
            .map_err(|error| internal(&error))
    };
    meshes.par_iter().zip(steering).map(simplify).collect()
}

/// Simplifies all surfaces to common targets.
fn together(
    meshes: &[Cow<'_, Mesh>],
    steering: &[MeshSteering],
    options: &BakeOptions,
    removed: &AtomicUsize,
) -> Result<Vec<Vec<Level>>> {
    let surfaces: Vec<Shared<'_>> = meshes
        .iter()
        .zip(steering)
        .map(|(mesh, steering)| Shared {
            mesh,
            options: steering.options(),
            stretches: steering.stretches(),
        })
        .collect();
    let counts = options.targets.counts(count(meshes));
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
                let mesh = shown(geometry, steering);
                if let Some(frame) = steering.frame() {
                    levels.iter_mut().for_each(|level| level.mesh = frame.show(&level.mesh));
                }
                polish_chain(&mesh, levels, &steering.options(), polish, done)
                    .map_err(|error| internal(&error))?;
                if let Some(frame) = steering.frame() {
                    let source = &geometry.welded.mesh;
                    levels.iter_mut().for_each(|level| frame.bring_back(level, source, &mesh));
                }
                Ok(())
            },
        )
    })
}

/// Grows the cards of levels by the area of those that are gone: last of all, since a card that has grown lies no
/// more where its texture was made for.
pub(crate) fn grow_all(geometries: &[Geometry], lods: &mut Lods, steering: &[MeshSteering]) {
    for level in lods.levels_mut() {
        for ((level, own), steering) in level.iter_mut().zip(geometries).zip(steering) {
            let cards = steering.options().cards;
            if !cards.is_empty() {
                grow_cards(&own.welded.mesh, level, cards);
            }
        }
    }
}

/// Finishes levels by what lies around each part: what is close before another layer in the source is so again.
///
/// # Errors
/// [`Error::Invalid`] if a node is malformed.
pub(crate) fn settle_all(
    asset: &Asset,
    geometries: &[Geometry],
    chains: &mut [Vec<Level>],
    steering: &[MeshSteering],
) -> Result<()> {
    let worlds = mesh_worlds(asset)?;
    let (mut together, mut alone) = (Vec::new(), Vec::new());
    for ((geometry, levels), steering) in geometries.iter().zip(chains).zip(steering) {
        let options = steering.options();
        if options.settings.placement == Placement::Ends || !options.cards.is_empty() {
            continue;
        }
        let (source, locked) = (&geometry.welded.mesh, options.locked);
        let worlds = worlds.get(&geometry.meshes[0]).map_or(&[][..], Vec::as_slice);
        match worlds {
            [world] if world.is_finite() && world.determinant() != 0.0 => {
                together.push(Layered { source, levels, world: *world, locked });
            }
            _ => alone.push(Layered { source, levels, world: DMat4::IDENTITY, locked }),
        }
    }
    keep_fronts(&mut together);
    alone.par_iter_mut().for_each(|own| keep_fronts(std::slice::from_mut(own)));
    Ok(())
}

/// Among others, a mesh of its own budget keeps as many triangles as a box: fewer would be shards.
const MIN_TRIANGLES: usize = 12;

/// The triangles each level of a surface is to have, `least` if it has so many.
fn targets(mesh: &Mesh, shares: &[f64], least: usize) -> Vec<usize> {
    let own = mesh.triangles.len();
    let share = |share: &f64| ((own as f64 * share).round() as usize).max(least.min(own));
    shares.iter().map(share).collect()
}

fn count(meshes: &[Cow<'_, Mesh>]) -> usize {
    meshes.iter().map(|mesh| mesh.triangles.len()).sum()
}

pub(crate) fn triangle_count(geometries: &[Geometry]) -> usize {
    geometries.iter().map(|geometry| geometry.welded.mesh.triangles.len()).sum()
}
