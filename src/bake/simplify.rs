//! The levels of every surface of an asset: simplified and polished, the surfaces in parallel, each in the
//! frame that it is shown in.

use std::borrow::Cow;
use std::sync::atomic::AtomicUsize;

use glam::DMat4;
use rayon::prelude::*;
use seamwise_attr::{
    Layered, Level, Mesh, Placement, Polish, ProgressiveMesh, ProgressiveScene, Shared,
    decimate_chain, grow_cards, keep_fronts, polish_chain, record_chain, record_together,
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
) -> Result<Simplified> {
    let least = options.targets.counts(triangle_count(geometries)).last().copied();
    let to_remove = least.map_or(0, |least| triangle_count(geometries).saturating_sub(least));
    let meshes: Vec<Cow<'_, Mesh>> =
        geometries.par_iter().zip(steering).map(|(own, steering)| shown(own, steering)).collect();
    let removes_points = options.steering.order.removes_points();
    if removes_points && options.output.records() {
        let what = "--cost decimation removes vertices: a file of all levels records collapses";
        return Err(Error::Options { what: what.into() });
    }
    let simplify = |removed: &AtomicUsize| match options.budget_per {
        BudgetPer::Scene if geometries.len() > 1 && !removes_points => {
            together(&meshes, steering, options, removed)
        }
        BudgetPer::Scene | BudgetPer::Mesh => {
            simplify_separately(&meshes, steering, options, (progress, removed))
        }
    };
    let mut own = progress.stage("simplify", to_remove, simplify)?;
    let levels = own.chains.par_iter_mut().zip(&meshes).zip(geometries).zip(steering);
    levels.for_each(|(((chain, mesh), geometry), steering)| {
        if let Some(frame) = steering.frame() {
            let source = &geometry.welded.mesh;
            chain.iter_mut().for_each(|level| frame.bring_back(level, source, mesh));
        }
    });
    if let Some(scene) = &mut own.scene {
        let bring_back = |(at, record): (usize, &mut ProgressiveMesh)| match steering[at].frame() {
            Some(frame) => {
                frame.bring_record_back(record, &geometries[at].welded.mesh, &meshes[at])
            }
            None => Ok(()),
        };
        scene.map_meshes(bring_back).map_err(|error| internal(&error))?;
    }
    if options.output.progressive {
        own.find_between();
    }
    Ok(own)
}

/// Levels of all surfaces.
pub(crate) struct Simplified {
    /// One entry per surface.
    pub(crate) chains: Vec<Vec<Level>>,
    /// All that lies between the levels, if it is on record.
    pub(crate) scene: Option<ProgressiveScene>,
    /// Further levels of each surface between those, to be polished as they are.
    between: Vec<Vec<Level>>,
    /// One per surface: collapses until each of them.
    places: Vec<Vec<usize>>,
}

/// A record is polished at its levels, and between two of them about each time that the surface has shrunk to this
/// share.
const POLISH_SHARE: f64 = 0.8;

impl Simplified {
    fn new(chains: Vec<Vec<Level>>, scene: Option<ProgressiveScene>) -> Self {
        Self {
            between: vec![Vec::new(); chains.len()],
            places: vec![Vec::new(); chains.len()],
            chains,
            scene,
        }
    }

    /// The levels of each surface; then those between them, if there is a record.
    pub(crate) fn all(&mut self) -> impl Iterator<Item = &mut [Vec<Level>]> {
        let between = self.scene.is_some().then_some(&mut self.between);
        [&mut self.chains].into_iter().chain(between).map(Vec::as_mut_slice)
    }

    /// Takes further levels from the record.
    fn find_between(&mut self) {
        let Some(scene) = &mut self.scene else { return };
        let levels = self.chains.first().map_or(0, Vec::len);
        let count = |level: usize| {
            self.chains.iter().map(|own| own[level].mesh.triangles.len()).sum::<usize>()
        };
        let counts: Vec<usize> =
            [scene.triangles_after(0)].into_iter().chain((0..levels).map(count)).collect();
        for triangles in between(&counts) {
            scene.seek(scene.collapses_to(triangles));
            for (at, record) in scene.meshes().iter().enumerate() {
                self.places[at].push(record.applied());
                self.between[at].push(record.level());
            }
        }
        scene.seek(0);
    }

    /// Takes the levels as they are by now into the record.
    pub(crate) fn settle(&mut self) {
        let Self { chains, scene, between, places } = self;
        if let Some(scene) = scene {
            let settle = |(at, record): (usize, &mut ProgressiveMesh)| {
                let own = record.levels().iter().copied().zip(&chains[at]);
                let further = places[at].iter().copied().zip(&between[at]);
                let mut all: Vec<(usize, &Level)> = own.chain(further).collect();
                // Sorted as they come: of two at one place that of the bake.
                all.sort_by_key(|(place, _)| *place);
                let (places, levels): (Vec<usize>, Vec<&Level>) = all.into_iter().unzip();
                record.settle(&places, &levels);
                Ok::<_, std::convert::Infallible>(())
            };
            let Ok(()) = scene.map_meshes(settle);
        }
    }
}

/// Counts of triangles between those of levels, in even ratios from each to the next.
fn between(counts: &[usize]) -> Vec<usize> {
    let of_pair = |pair: &[usize]| {
        let (fine, ratio) = (pair[0] as f64, pair[1].max(1) as f64 / pair[0].max(1) as f64);
        let steps = (ratio.ln() / POLISH_SHARE.ln()).round() as usize;
        (1..steps).map(move |step| (fine * ratio.powf(step as f64 / steps as f64)).round() as usize)
    };
    counts.windows(2).flat_map(of_pair).collect()
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
) -> Result<Simplified> {
    let records = options.output.records();
    let removes_points = options.steering.order.removes_points();
    let shares = options.targets.shares(count(meshes));
    let simplify = |(mesh, steering): (&Cow<'_, Mesh>, &MeshSteering)| {
        progress.check("simplify")?;
        let least = if meshes.len() > 1 { MIN_TRIANGLES } else { 1 };
        let targets = targets(mesh, &shares, least);
        let options = steering.options();
        let own = if records {
            record_chain(mesh, &targets, &options, removed).map(|own| {
                (own.levels.into_iter().next().unwrap_or_default(), own.scene.into_meshes())
            })
        } else {
            let simplify = if removes_points { decimate_chain } else { simplify_chain };
            simplify(mesh, &targets, &options, removed).map(|levels| (levels, Vec::new()))
        };
        own.map_err(|error| internal(&error))
    };
    let all: Vec<_> = meshes.par_iter().zip(steering).map(simplify).collect::<Result<_>>()?;
    let (chains, records_of): (Vec<_>, Vec<_>) = all.into_iter().unzip();
    let scene = records.then(|| ProgressiveScene::side_by_side(records_of.concat()));
    Ok(Simplified::new(chains, scene))
}

/// Simplifies all surfaces to common targets.
fn together(
    meshes: &[Cow<'_, Mesh>],
    steering: &[MeshSteering],
    options: &BakeOptions,
    removed: &AtomicUsize,
) -> Result<Simplified> {
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
    let own = if options.output.records() {
        record_together(&surfaces, &counts, removed)
            .map(|own| Simplified::new(own.levels, Some(own.scene)))
    } else {
        let chains = simplify_together(&surfaces, &counts, removed);
        chains.map(|chains| Simplified::new(chains, None))
    };
    own.map_err(|error| internal(&error))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_between_levels_are_in_even_ratios_and_not_beside_a_level() {
        assert_eq!(between(&[1000, 500, 450, 450, 0]).len(), 2 + 26);
        assert_eq!(between(&[1000, 512]), [800, 640]);
        assert_eq!(between(&[1000, 900, 900]), [0; 0]);
    }
}
