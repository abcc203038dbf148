//! Textures for each level, sampled from the surface of the source at the level's own size.
//!
//! Which images can be made anew is told by `plan`: those whose charts lie apart in the image. The
//! others are shared by all levels, filled like in a repair. Lit materials without a normal map may
//! gain one, with the shape that a level has lost. How large the images are is told by `sizes`.

mod make;
mod plan;
mod sizes;

use std::sync::atomic::AtomicUsize;

use glam::Vec4;
use rayon::prelude::*;
use seamwise_attr::{Level, Mesh};
use seamwise_texture::transfer::{Pair, Side, Source};

use crate::asset::{Asset, EncodedImage};
use crate::atlas::ImageRepair;
use crate::certificate::Screen;
use crate::dress::LevelTextures;
use crate::error::{Error, Result};
use crate::geometry::Geometry;
use crate::limit::MemoryLimit;
use crate::progress::Progress;
use crate::tangents::{mesh_tangents, source_tangents};
use make::{Made, Sheet, Worn, sheets};
use plan::NewNormals;
pub(crate) use plan::Plan;
pub use plan::Shared;
pub use sizes::Sizes;
use sizes::{Share, Yardstick, fit, halved};

/// A ray looks for the source this many times the RMS distance of the level away.
const CAGE: f32 = 6.0;
/// How often images are made smaller until they fit a budget: a file's bytes are not known before it
/// is made.
const ATTEMPTS: usize = 8;

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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TransferOptions {
    /// How large the images are.
    pub sizes: Sizes,
    /// Whether levels gain normal maps.
    pub bake_normals: BakeNormals,
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
    pub(crate) screen: Screen,
    pub(crate) limit: MemoryLimit,
}

/// Makes the textures of all levels; `chains` has those of each surface.
///
/// # Errors
/// [`Error::Invalid`] if an image is damaged or takes more memory than the limit; [`Error::Options`]
/// if no size of images fits a budget.
pub(crate) fn transfer_all(
    origin: &Origin<'_>,
    plan: &Plan,
    chains: &[Vec<Level>],
    options: &TransferOptions,
    progress: &Progress,
) -> Result<Vec<LevelTextures>> {
    let Origin { asset, surfaces, .. } = *origin;
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
    let distances: Vec<Vec<f32>> = meshes.iter().map(|level| distances(&sources, level)).collect();
    let levels: Vec<Worn<'_>> = meshes
        .into_iter()
        .zip(&tangents)
        .zip(&distances)
        .map(|((meshes, tangents), distances)| {
            let surfaces = sources.iter().zip(&meshes).zip(tangents).zip(distances);
            let pairs = surfaces.map(|(((source, &mesh), tangents), distance)| Pair {
                source,
                level: Side { mesh, tangents },
                cage: CAGE * distance,
            });
            Worn { pairs: pairs.collect(), meshes }
        })
        .collect();
    let yardstick = Yardstick::new(asset, surfaces, &distances, &origin.screen)?;
    let sheets = sheets(origin, plan, options)?;
    let stage = Stage { origin, yardstick, sheets, levels, options, progress };
    Ok(stage.dress(plan, stage.run()?))
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

/// RMS distance of each surface of a level.
fn distances(sources: &[Source<'_>], meshes: &[&Mesh]) -> Vec<f32> {
    sources.par_iter().zip(meshes).map(|(source, mesh)| source.rms_distance(mesh)).collect()
}

/// Everything that the images of all levels are made from.
struct Stage<'a> {
    origin: &'a Origin<'a>,
    yardstick: Yardstick,
    sheets: Vec<Sheet<'a>>,
    levels: Vec<Worn<'a>>,
    options: &'a TransferOptions,
    progress: &'a Progress,
}

impl Stage<'_> {
    /// The images of each sheet, level by level.
    fn run(&self) -> Result<Vec<Vec<Made>>> {
        let sizes = self.sizes();
        let Sizes::Budget(budget) = self.options.sizes else {
            return self.make(&sizes, Vec::new());
        };
        let mut made = self.make(&sizes, Vec::new())?;
        let mut shares = self.shares(&made)?;
        for _ in 0..ATTEMPTS {
            let bytes: usize = made.iter().flatten().map(Made::bytes).sum();
            if bytes as u64 <= budget {
                return Ok(made);
            }
            for (share, made) in shares.iter_mut().zip(made.iter().flatten()) {
                share.bytes = made.bytes() as f64;
            }
            if !fit(&mut shares, budget as f64) {
                break;
            }
            let mut shares = shares.iter();
            let next = |sheet: &Sheet<'_>| -> Vec<[usize; 2]> {
                let own = shares.by_ref().take(self.levels.len());
                own.map(|share| halved(sheet.size, share.halvings)).collect()
            };
            let sizes: Vec<Vec<[usize; 2]>> = self.sheets.iter().map(next).collect();
            made = self.make(&sizes, made)?;
        }
        let what = format!("no size of the levels' textures fits a budget of {budget} bytes");
        Err(Error::Options { what })
    }

    /// Sizes before a budget is looked at: of each sheet, level by level.
    fn sizes(&self) -> Vec<Vec<[usize; 2]>> {
        let size = |sheet: &Sheet<'_>, level: usize| match self.options.sizes {
            Sizes::Needed | Sizes::Budget(_) => halved(sheet.size, self.unseen(sheet, level)),
            Sizes::Scale(scale) => {
                let factor = scale.powi(level as i32 + 1);
                sheet.size.map(|side| ((side as f64 * factor).round() as usize).clamp(1, side))
            }
        };
        let levels = 0..self.levels.len();
        let of = |sheet| levels.clone().map(|level| size(sheet, level)).collect();
        self.sheets.iter().map(of).collect()
    }

    fn unseen(&self, sheet: &Sheet<'_>, level: usize) -> u32 {
        let charts = &sheet.layout.charts;
        self.yardstick.unseen(self.origin.surfaces, charts, sheet.size, level)
    }

    /// Makes all images that `before` does not have at their size.
    fn make(
        &self,
        sizes: &[Vec<[usize; 2]>],
        mut before: Vec<Vec<Made>>,
    ) -> Result<Vec<Vec<Made>>> {
        before.resize(self.sheets.len(), Vec::new());
        let is_old = |made: &[Made], level: usize, size: [usize; 2]| {
            made.get(level).is_some_and(|made| made.size == size)
        };
        let wanted = sizes.iter().zip(&before).flat_map(|(sizes, made)| {
            sizes.iter().enumerate().filter(|&(level, &size)| !is_old(made, level, size))
        });
        let rows = wanted.map(|(_, size)| size[1]).sum();
        self.progress.stage("transfer", rows, |rows: &AtomicUsize| {
            let sheets = self.sheets.iter().zip(sizes).zip(before);
            let make = |((sheet, sizes), before): ((&Sheet<'_>, &Vec<_>), Vec<Made>)| {
                let is_done = sizes.iter().enumerate().all(|(at, &size)| is_old(&before, at, size));
                if is_done {
                    return Ok(before);
                }
                let originals = sheet.originals(self.origin)?;
                let levels = self.levels.iter().zip(sizes).enumerate();
                let one = |(level, (worn, &size)): (usize, (&Worn<'_>, &[usize; 2]))| {
                    if is_old(&before, level, size) {
                        return Ok(before[level].clone());
                    }
                    sheet.make(self.origin, &originals, (worn, size), self.options, rows)
                };
                levels.map(one).collect::<Result<Vec<Made>>>()
            };
            sheets.map(make).collect()
        })
    }

    /// What a budget needs to know of each sheet and level.
    fn shares(&self, made: &[Vec<Made>]) -> Result<Vec<Share>> {
        let mut shares = Vec::new();
        for (sheet, made) in self.sheets.iter().zip(made) {
            let area = self.yardstick.share(self.origin.surfaces, &sheet.layout.charts);
            let mut details: Vec<f64> = Vec::new();
            for original in sheet.originals(self.origin)? {
                let own = original.picture.details();
                details.resize(own.len(), 0.0);
                details.iter_mut().zip(own).for_each(|(sum, lost)| *sum += area * lost);
            }
            for (level, made) in made.iter().enumerate() {
                let unseen = self.unseen(sheet, level);
                let (bytes, details) = (made.bytes() as f64, details.clone());
                shares.push(Share { bytes, halvings: unseen, unseen, details });
            }
        }
        Ok(shares)
    }

    /// What each level wears.
    fn dress(&self, plan: &Plan, made: Vec<Vec<Made>>) -> Vec<LevelTextures> {
        let surfaces = self.origin.surfaces;
        let shared = LevelTextures::shared(self.origin.images, surfaces);
        let mut levels = vec![shared; self.levels.len()];
        for sheet in made {
            for (level, made) in levels.iter_mut().zip(sheet) {
                for (index, image) in made.images {
                    level.images[index] = image;
                }
                level.normals.extend(made.normals);
            }
        }
        for level in &mut levels {
            let like: Vec<&String> = level.normals.iter().map(|own| &own.like).collect();
            let has = |own: &NewNormals| like.contains(&&own.like);
            level.sets = plan.normal_sets(surfaces, has);
        }
        levels
    }
}
