//! The levels of every mesh of an asset: welded, simplified and polished, the meshes in parallel.

use rayon::prelude::*;
use seamwise_attr::{Level, Polish, polish_chain, simplify_chain};

use crate::asset::Asset;
use crate::error::{Error, Result};
use crate::geometry::Geometry;
use crate::options::BakeOptions;
use crate::progress::Progress;
use crate::steering::MeshSteering;

/// Every mesh of an asset that has triangles, welded.
///
/// # Errors
/// [`Error::Invalid`] if there is none, or one can't be read.
pub(crate) fn weld_all(asset: &Asset) -> Result<Vec<Geometry>> {
    let meshes = 0..asset.count("meshes");
    let read: Vec<Option<Geometry>> =
        meshes.into_par_iter().map(|mesh| Geometry::read(asset, mesh)).collect::<Result<_>>()?;
    let geometries: Vec<Geometry> = read.into_iter().flatten().collect();
    if geometries.is_empty() {
        return Err(Error::invalid("/meshes", "there is not a single triangle to simplify"));
    }
    Ok(geometries)
}

/// The levels of each mesh, the meshes in parallel. `steering` holds what is asked of each.
pub(crate) fn simplify_all(
    geometries: &[Geometry],
    steering: &[MeshSteering],
    options: &BakeOptions,
    progress: &Progress,
) -> Result<Vec<Vec<Level>>> {
    let total = triangle_count(geometries);
    let shares = options.targets.shares(total);
    let least = shares.last().copied().unwrap_or(1.0);
    let to_remove = total - (total as f64 * least) as usize;
    progress.stage("simplify", to_remove, |removed| {
        geometries
            .par_iter()
            .zip(steering)
            .map(|(geometry, steering)| {
                let targets = targets(geometry, &shares);
                simplify_chain(&geometry.welded.mesh, &targets, &steering.options(), removed)
                    .map_err(|error| Error::Internal { what: error.to_string() })
            })
            .collect()
    })
}

/// Fits the levels to their meshes, the meshes in parallel. `steering` holds what is asked of each.
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
                polish_chain(&geometry.welded.mesh, levels, &steering.options(), polish, done)
                    .map_err(|error| Error::Internal { what: error.to_string() })
            },
        )
    })
}

/// The triangles each level of a mesh is to have.
fn targets(geometry: &Geometry, shares: &[f64]) -> Vec<usize> {
    let own = geometry.welded.mesh.triangles.len() as f64;
    shares.iter().map(|share| ((own * share).round() as usize).max(1)).collect()
}

pub(crate) fn triangle_count(geometries: &[Geometry]) -> usize {
    geometries.iter().map(|geometry| geometry.welded.mesh.triangles.len()).sum()
}
