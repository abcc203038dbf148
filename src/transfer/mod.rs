//! Textures for each level, sampled from the surface of the source at the level's own size.
//!
//! Which images can be made anew is told by `plan`: those whose charts lie apart in the image. The
//! others are shared by all levels, filled like in a repair. Lit materials without a normal map may
//! gain one, with the shape that a level has lost.

mod make;
mod plan;

use glam::Vec4;
use rayon::prelude::*;
use seamwise_attr::{Level, Mesh};
use seamwise_texture::transfer::{Pair, Side, Source};

use crate::asset::{Asset, EncodedImage};
use crate::atlas::ImageRepair;
use crate::dress::LevelTextures;
use crate::error::Result;
use crate::geometry::Geometry;
use crate::limit::MemoryLimit;
use crate::progress::Progress;
use crate::tangents::{mesh_tangents, source_tangents};
use make::{Maker, Worn};
pub(crate) use plan::Plan;
pub use plan::Shared;

/// A ray looks for the source this many times the RMS distance of the level away.
const CAGE: f32 = 6.0;

/// Whether levels gain normal maps where their source has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BakeNormals {
    /// Where the shading normals of a level are off by more than a degree.
    #[default]
    Auto,
    /// On every lit material.
    On,
    /// Nowhere.
    Off,
}

/// How textures are made anew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferOptions {
    /// The side of each level's images over those of the level before, above 0 and up to 1.
    pub scale: f64,
    /// Whether levels gain normal maps.
    pub bake_normals: BakeNormals,
}

impl Default for TransferOptions {
    /// Images of half the side for each level.
    fn default() -> Self {
        Self { scale: 0.5, bake_normals: BakeNormals::Auto }
    }
}

/// What textures are made from.
#[derive(Clone, Copy)]
pub(crate) struct Origin<'a> {
    pub(crate) asset: &'a Asset,
    pub(crate) surfaces: &'a [Geometry],
    /// What became of each image in a repair, by which charts are read up to their rims.
    pub(crate) repairs: &'a [ImageRepair],
    /// The same as files: what a level wears of images that are not made anew.
    pub(crate) images: &'a [EncodedImage],
    pub(crate) limit: MemoryLimit,
}

/// Makes the textures of all levels; `chains` has those of each surface.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if an image is damaged or takes more memory than
/// the limit.
pub(crate) fn transfer_all(
    origin: Origin<'_>,
    plan: &Plan,
    chains: &[Vec<Level>],
    options: TransferOptions,
    progress: &Progress,
) -> Result<Vec<LevelTextures>> {
    let Origin { asset, surfaces, .. } = origin;
    let sets = plan.normal_sets(surfaces, |_| options.bake_normals != BakeNormals::Off);
    let tangents = source_tangents_of(asset, surfaces, &sets)?;
    let sources: Vec<Source<'_>> = surfaces
        .par_iter()
        .zip(&tangents)
        .map(|(surface, tangents)| Source::new(Side { mesh: &surface.welded.mesh, tangents }))
        .collect();
    let count = chains.first().map_or(0, Vec::len);
    let meshes: Vec<Vec<&Mesh>> =
        (0..count).map(|level| chains.iter().map(|chain| &chain[level].mesh).collect()).collect();
    let tangents: Vec<Vec<Tangents>> =
        meshes.iter().map(|meshes| level_tangents(meshes, &sets)).collect::<Result<_>>()?;
    let levels: Vec<Worn<'_>> = meshes
        .into_iter()
        .zip(&tangents)
        .map(|(meshes, tangents)| Worn { pairs: pairs(&sources, &meshes, tangents), meshes })
        .collect();
    let maker = Maker { origin, plan, options };
    progress.stage("transfer", maker.rows(count)?, |rows| maker.run(&levels, rows))
}

/// One triple per triangle.
type Tangents = Vec<[Vec4; 3]>;
/// One per part: the UV set of its normal map.
type Sets = Vec<Option<usize>>;

fn source_tangents_of(
    asset: &Asset,
    surfaces: &[Geometry],
    sets: &[Sets],
) -> Result<Vec<Tangents>> {
    let of = |(surface, sets): (&Geometry, &Sets)| source_tangents(asset, surface, sets);
    surfaces.par_iter().zip(sets).map(of).collect()
}

fn level_tangents(meshes: &[&Mesh], sets: &[Sets]) -> Result<Vec<Tangents>> {
    meshes.par_iter().zip(sets).map(|(mesh, sets)| mesh_tangents(mesh, sets)).collect()
}

fn pairs<'a>(
    sources: &'a [Source<'a>],
    meshes: &[&'a Mesh],
    tangents: &'a [Tangents],
) -> Vec<Pair<'a>> {
    let levels = sources.par_iter().zip(meshes).zip(tangents);
    let pair = |((source, &mesh), tangents): ((&'a Source<'a>, &&'a Mesh), &'a Tangents)| {
        let cage = CAGE * source.rms_distance(mesh);
        Pair { source, level: Side { mesh, tangents }, cage }
    };
    levels.map(pair).collect()
}
