//! The levels of every surface of an asset: simplified and polished, the surfaces in parallel.

use rayon::prelude::*;
use seamwise_attr::{Level, Polish, polish_chain, simplify_chain};

use crate::error::{Error, Result};
use crate::geometry::Geometry;
use crate::options::BakeOptions;
use crate::progress::Progress;
use crate::steering::MeshSteering;

/// The levels of each surface, the surfaces in parallel. `steering` holds what is asked of each.
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
                progress.check("simplify")?;
                let targets = targets(geometry, &shares);
                simplify_chain(&geometry.welded.mesh, &targets, &steering.options(), removed)
                    .map_err(|error| Error::Internal { what: error.to_string() })
            })
            .collect()
    })
}

/// Fits the levels to their surfaces, the surfaces in parallel. `steering` holds what is asked of each.
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
                    .map_err(|error| Error::Internal { what: error.to_string() })
            },
        )
    })
}

/// The triangles each level of a surface is to have.
fn targets(geometry: &Geometry, shares: &[f64]) -> Vec<usize> {
    let own = geometry.welded.mesh.triangles.len() as f64;
    shares.iter().map(|share| ((own * share).round() as usize).max(1)).collect()
}

pub(crate) fn triangle_count(geometries: &[Geometry]) -> usize {
    geometries.iter().map(|geometry| geometry.welded.mesh.triangles.len()).sum()
}
