//! A level of detail as primitives: what a simplified surface becomes before any document holds it.

mod elements;
pub(crate) mod geomorph;
mod join;
pub(crate) mod lods;
pub(crate) mod part;
pub(crate) mod primitives;
pub(crate) mod quantize;
mod resample;
mod skin;
pub mod textures;
mod vertex_cache;

use rayon::prelude::*;
use seamwise_attr::Level;

use crate::document::asset::Asset;
use crate::error::Result;
use crate::surface::geometry::Geometry;
use geomorph::{Morph, Morphs};
use lods::Lods;
use part::LevelPart;
use primitives::level_parts;
use quantize::{Grid, may_scale, quantize};
use textures::{LevelTextures, PartTextures};

/// One level of a surface, ready to be written.
#[derive(Clone, Debug)]
pub struct LevelMesh<'a> {
    /// The source.
    pub geometry: &'a Geometry,
    /// Number of its triangles.
    pub triangles: usize,
    /// One per part of the source. None if the level is the source itself, whose primitives then stay
    /// as they are.
    pub(crate) parts: Option<Vec<Option<LevelPart>>>,
    /// The grid of its positions, if they are integers.
    pub(crate) grid: Option<Grid>,
    /// Whether it has a morph target that leads to the next level.
    pub(crate) has_target: bool,
}

impl<'a> LevelMesh<'a> {
    /// The level of a surface in textures of which there is one entry per part. One that lost nothing
    /// and has no new texture is the source itself.
    ///
    /// # Errors
    /// [`Error::Internal`](crate::error::Error::Internal) if the level does not belong to the geometry.
    pub fn new(geometry: &'a Geometry, level: &Level, textures: &[PartTextures]) -> Result<Self> {
        Self::with_positions(geometry, level, textures, false, None)
    }

    /// The same; `rounds` tells that positions are about to be rounded, `morph` where wedges come to lie next.
    fn with_positions(
        geometry: &'a Geometry,
        level: &Level,
        textures: &[PartTextures],
        rounds: bool,
        morph: Option<&Morph<'_>>,
    ) -> Result<Self> {
        let (own, source) = (&level.mesh, &geometry.welded.mesh);
        let is_whole = own.triangles.len() == source.triangles.len()
            && own.positions.len() == source.positions.len();
        let is_source = is_whole
            && morph.is_none()
            && textures.iter().all(|own| *own == PartTextures::default());
        let parts = (!is_source)
            .then(|| level_parts(geometry, level, textures, rounds, morph))
            .transpose()?;
        let has_target = morph.is_some_and(Morph::has_target);
        Ok(Self { geometry, triangles: own.triangles.len(), parts, grid: None, has_target })
    }

    /// Number of its primitives.
    pub(crate) fn draw_calls(&self) -> usize {
        match &self.parts {
            Some(parts) => parts.iter().flatten().count(),
            None => self.geometry.parts.len(),
        }
    }

    /// Number of vertices of its primitives.
    pub(crate) fn vertices(&self) -> usize {
        let of_part = |part: &LevelPart| part.attributes.first().map_or(0, |(_, own)| own.count());
        match &self.parts {
            Some(parts) => parts.iter().flatten().map(of_part).sum(),
            None => self.geometry.parts.iter().map(|part| part.vertices).sum(),
        }
    }

    /// Makes the vertices small, as [`quantize`](crate::level::quantize) tells.
    pub(crate) fn quantize(&mut self, error: f64, may_scale: bool) {
        if let Some(parts) = &mut self.parts {
            self.grid = quantize(parts, error, may_scale);
        }
    }
}

/// A level of a whole asset.
#[derive(Clone, Debug)]
pub struct AssetLevel<'a> {
    /// One per surface.
    pub meshes: Vec<LevelMesh<'a>>,
    /// Their textures.
    pub textures: LevelTextures,
}

/// Simplified surfaces and the asset they are of, to be assembled to levels.
pub(crate) struct LevelAssembly<'a> {
    pub(crate) asset: &'a Asset,
    pub(crate) geometries: &'a [Geometry],
    pub(crate) lods: &'a Lods,
    /// Whether positions stay floats: those of borders that must be the same in other files.
    pub(crate) keeps_positions: bool,
    /// The ways from each level to the next, if parts are to have them.
    pub(crate) morphs: &'a Morphs<'a>,
}

impl<'a> LevelAssembly<'a> {
    /// All meshes of each level as primitives, with their textures; as small integers with `compress`.
    pub(crate) fn assemble(
        &self,
        textures: Vec<LevelTextures>,
        compress: bool,
    ) -> Result<Vec<AssetLevel<'a>>> {
        let assemble = |(index, (level, textures)): (usize, (&[Level], LevelTextures))| {
            let surfaces = self.geometries.par_iter().zip(level).zip(&textures.parts).enumerate();
            let meshes = surfaces.map(|(surface, ((geometry, level), textures))| {
                if !compress {
                    let morph = self.morphs.get(index + 1, surface);
                    return LevelMesh::with_positions(geometry, level, textures, false, morph);
                }
                let rounds = !self.keeps_positions && may_scale(self.asset, geometry)?;
                let mut mesh = LevelMesh::with_positions(geometry, level, textures, rounds, None)?;
                mesh.quantize(level.error, rounds);
                Ok(mesh)
            });
            Ok(AssetLevel { meshes: meshes.collect::<Result<_>>()?, textures })
        };
        let levels: Vec<_> = self.lods.levels().zip(textures).enumerate().collect();
        levels.into_par_iter().map(assemble).collect()
    }
}
