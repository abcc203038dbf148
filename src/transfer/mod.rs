//! Textures for each level, sampled from the surface of the source at the level's own size.
//!
//! Which images can be made anew is told by `plan`: those whose charts lie apart in the image. The
//! others are shared by all levels, filled like in a repair. Lit materials without a normal map may
//! gain one, with the shape that a level has lost. How large the images are is told by `sizes`.
//!
//! Levels of surfaces that are laid out anew in whole may be simplified without UVs: `unwrap` then gives them
//! charts, which `repack_charts` packs as it packs those of the source. Surfaces without UVs gain textures so
//! too: `bare` tells which.
//!
//! Materials that agree in what an atlas does not hold can become one: `merge_materials` tells which,
//! `merged_material` how, `merged_images` makes their images, and `join_primitives` tells which
//! primitives can be one then.

mod bare;
mod candidates;
mod choice;
mod encode;
mod image_uses;
mod join_primitives;
mod layout;
mod make;
mod merge_materials;
mod merged_images;
mod merged_material;
mod options;
mod original;
mod outcomes;
mod plan;
mod repack_charts;
mod sampling;
mod select;
mod sheet;
mod sizes;
mod unwrap;

use std::sync::atomic::AtomicUsize;

use rayon::prelude::*;
use seamwise_attr::Mesh;
use seamwise_texture::transfer::{Pair, Source};

use crate::document::material::materials_of;
use crate::document::prune::Leftovers;
use crate::error::{Error, Result};
use crate::image_file::ktx2::encode::{bytes_with_mips, stored_size};
use crate::level::lods::Lods;
use crate::level::textures::LevelTextures;
use crate::progress::Progress;
use crate::surface::geometry::Geometry;
use choice::Measured;
pub use choice::{Candidate, ChoiceReason, TextureChoice};
pub use encode::TextureFormat;
pub use layout::SharedReason;
use layout::UvLayout;
pub use merge_materials::NotMerged;
pub use options::{Atlas, BakeNormals, TransferOptions};
pub(crate) use original::Origin;
pub use outcomes::{MaterialTextures, Outcome, TextureOutcome};
pub(crate) use plan::Plan;
use repack_charts::repack_all;
use sampling::{Tags, level_tags, source_tags, sources};
use select::select;
use sheet::{LevelSurfaces, Made, Sheet, sheets};
pub use sizes::Sizes;
use sizes::{Share, SheetSizes, TexelDensity, fit, halved};

/// Levels that are made at a time: a file is compressed on one thread, and each takes memory of its
/// own.
const LEVELS: usize = 2;
/// Bytes that images of levels' own may have though the source's have less: of small files, their
/// geometry is more.
const LEAST_BUDGET: u64 = 64 << 10;
/// The most rounds of making images smaller until they fit a budget: a file's bytes are not known
/// before it is made.
const ATTEMPTS: usize = 8;

/// Halvings that are not seen where a level is shown, and that a choice leaves out all the same.
/// With one, a pan's color at 6.25 % is off by 0.019, with two by 0.010; lit luminance 0.0108 and 0.0107.
const SPARE: u32 = 2;

/// Makes the textures of all levels. Where charts are laid out anew, the levels in their new layout
/// as well.
///
/// # Errors
/// [`Error::Invalid`] if an image is damaged or takes more memory than the limit; [`Error::Options`]
/// if no size of images fits a budget; [`Error::Unsupported`] if a new atlas does not hold all charts.
pub(crate) fn transfer_all(
    origin: &Origin<'_>,
    plan: &Plan,
    lods: &Lods,
    options: &TransferOptions,
    progress: &Progress,
) -> Result<Transfer> {
    let Origin { asset, surfaces, .. } = *origin;
    if plan.layouts.is_empty() {
        // Nothing is looked for on the source.
        let textures = assign(origin, plan, Vec::new(), lods.count())?;
        return Ok(Transfer { textures, repacked: None, choices: Vec::new() });
    }
    let tags = source_tags(asset, surfaces, &plan.source_sets(surfaces), &plan.is_free)?;
    let sources = sources(surfaces, &tags);
    let meshes = lods.meshes();
    let distances: Vec<Vec<f32>> = meshes.iter().map(|level| distances(&sources, level)).collect();
    let texel_density = TexelDensity::new(asset, surfaces, &distances, &origin.screen)?;
    let sheets = sheets(origin, plan, options)?;
    let mut sizes = first_sizes(&sheets, &texel_density, surfaces, *options);
    let repacked =
        repack_all(&sheets, &mut sizes, (lods, &plan.is_free), (&texel_density, surfaces))?;
    let level_meshes = repacked.as_ref().unwrap_or(lods).meshes();
    let gains = options.bake_normals != BakeNormals::Off;
    let sets = plan.level_sets(surfaces, |_| gains, |_| true);
    let tags: Vec<Vec<Tags>> = lods
        .levels()
        .zip(&level_meshes)
        .map(|(level, meshes)| level_tags(surfaces, level, meshes, (&sets, &plan.is_free)))
        .collect::<Result<_>>()?;
    let pairs = meshes.iter().zip(&tags).map(|(meshes, tags)| pairs(&sources, meshes, tags));
    let levels =
        level_meshes.into_iter().zip(pairs).map(|(meshes, pairs)| LevelSurfaces { meshes, pairs });
    let levels = levels.collect();
    let maker = TextureMaker { origin, texel_density, sheets, levels, options, progress };
    let made = maker.run(&sizes)?;
    let choices = choices(&made);
    let textures = assign(origin, plan, made, lods.count())?;
    Ok(Transfer { textures, repacked, choices })
}

/// The textures of all levels.
pub(crate) struct Transfer {
    pub(crate) textures: Vec<LevelTextures>,
    /// The levels in their new layout, where charts are laid out anew.
    pub(crate) repacked: Option<Lods>,
    /// The choices between images of levels' own and the source's, each with the source's index.
    pub(crate) choices: Vec<(usize, TextureChoice)>,
}

fn choices(made: &[Vec<Made>]) -> Vec<(usize, TextureChoice)> {
    made.iter().flatten().flat_map(|made| made.choices.iter().cloned()).collect()
}

/// The surfaces of a level with their sources.
fn pairs<'a>(sources: &'a [Source<'a>], meshes: &[&'a Mesh], tags: &'a [Tags]) -> Vec<Pair<'a>> {
    let surfaces = sources.iter().zip(meshes).zip(tags);
    surfaces.map(|((source, &mesh), tags)| Pair { source, level: tags.side(mesh) }).collect()
}

/// The distance of each surface of a level that a thousandth of it exceeds.
fn distances(sources: &[Source<'_>], meshes: &[&Mesh]) -> Vec<f32> {
    sources.par_iter().zip(meshes).map(|(source, mesh)| source.high_distance(mesh)).collect()
}

/// Sizes before they are cut to a budget.
fn first_sizes(
    sheets: &[Sheet<'_>],
    texel_density: &TexelDensity,
    surfaces: &[Geometry],
    TransferOptions { sizes, chooses, in_blocks, .. }: TransferOptions,
) -> SheetSizes {
    let size = |sheet: &Sheet<'_>, level: usize| match sizes {
        Sizes::Needed | Sizes::Budget(_) => {
            let unseen = texel_density.unseen(surfaces, sheet.layout, sheet.size, level);
            // A choice begins with more than is needed, as what is shown larger than it should be is seen
            // larger too, and ends with less where that is not worth it.
            halved(sheet.size, unseen.saturating_sub(if chooses { SPARE } else { 0 }))
        }
        Sizes::Scale(scale) => {
            let factor = scale.powi(level as i32 + 1);
            sheet.size.map(|side| ((side as f64 * factor).round() as usize).clamp(1, side))
        }
    };
    let stored = |size| if in_blocks { stored_size(size) } else { size };
    let of = |sheet| (0..texel_density.levels()).map(|level| stored(size(sheet, level))).collect();
    sheets.iter().map(of).collect()
}

/// The input of all images of all levels.
struct TextureMaker<'a> {
    origin: &'a Origin<'a>,
    texel_density: TexelDensity,
    sheets: Vec<Sheet<'a>>,
    levels: Vec<LevelSurfaces<'a>>,
    options: &'a TransferOptions,
    progress: &'a Progress,
}

impl TextureMaker<'_> {
    /// The images of each sheet, level by level.
    fn run(&self, sizes: &SheetSizes) -> Result<Vec<Vec<Made>>> {
        let mut made = self.make(sizes, Vec::new())?;
        if self.options.chooses {
            return Ok(self.choose(made));
        }
        let Sizes::Budget(budget) = self.options.sizes else { return Ok(made) };
        let mut shares = self.shares(&made)?;
        for _ in 0..ATTEMPTS {
            let bytes: usize = made.iter().flatten().map(|made| self.bytes(made)).sum();
            if bytes as u64 <= budget {
                return Ok(made);
            }
            for (share, made) in shares.iter_mut().zip(made.iter().flatten()) {
                share.bytes = self.bytes(made) as f64;
            }
            if !fit(&mut shares, budget as f64) {
                break;
            }
            let mut shares = shares.iter();
            let next = |sheet: &Sheet<'_>| -> Vec<[usize; 2]> {
                let own = shares.by_ref().take(self.levels.len());
                own.map(|share| self.stored(halved(sheet.size, share.halvings))).collect()
            };
            let sizes: SheetSizes = self.sheets.iter().map(next).collect();
            made = self.make(&sizes, made)?;
        }
        let what = format!("no size of the levels' textures fits a budget of {budget} bytes");
        Err(Error::Options { what })
    }

    /// The size that is made for a size that is needed.
    fn stored(&self, size: [usize; 2]) -> [usize; 2] {
        if self.options.in_blocks { stored_size(size) } else { size }
    }

    /// Bytes of the images of a sheet for a level.
    fn bytes(&self, made: &Made) -> usize {
        if self.options.in_blocks {
            made.count() * bytes_with_mips(made.size)
        } else {
            made.bytes()
        }
    }

    /// Chooses among the images of all sheets and levels.
    fn choose(&self, mut made: Vec<Vec<Made>>) -> Vec<Vec<Made>> {
        if matches!(self.options.sizes, Sizes::Budget(_)) {
            // It is of bytes of levels' own, whatever they replace.
            let all = made.iter_mut().flatten().flat_map(|made| &mut made.measured);
            all.for_each(|own| own.shared_bytes = 0);
        }
        let all = made.iter().flatten().flat_map(|made| &made.measured);
        let all: Vec<&Measured> = all.collect();
        let mut picks = select(&all, self.budget()).into_iter();
        for (sheet, levels) in self.sheets.iter().zip(&mut made) {
            for (level, made) in levels.iter_mut().enumerate() {
                let own: Vec<_> = picks.by_ref().take(made.measured.len()).collect();
                sheet.take(made, level + 1, &own);
            }
        }
        made
    }

    /// Most bytes of all images together, where they are chosen.
    fn budget(&self) -> Option<u64> {
        let images = &self.origin.asset.images;
        match self.options.sizes {
            Sizes::Budget(budget) => Some(budget),
            Sizes::Needed if self.options.in_blocks => {
                Some((self.texels() * 4).div_ceil(3).max(LEAST_BUDGET))
            }
            Sizes::Needed => {
                let files: usize = images.iter().map(|image| image.bytes.len()).sum();
                Some((files as u64).max(self.texels()).max(LEAST_BUDGET))
            }
            Sizes::Scale(_) => None,
        }
    }

    /// Texels of the source's images that levels may have of their own.
    fn texels(&self) -> u64 {
        let of =
            |sheet: &Sheet<'_>| (sheet.pictures().len() * sheet.size[0] * sheet.size[1]) as u64;
        self.sheets.iter().map(of).sum()
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
                let originals = sheet.originals(self.origin, self.options)?;
                let one = |level: usize| {
                    let (surfaces, size) = (&self.levels[level], sizes[level]);
                    self.progress.check("transfer")?;
                    if is_old(&before, level, size) {
                        return Ok(before[level].clone());
                    }
                    sheet.make(self.origin, &originals, (surfaces, size), self.options, rows)
                };
                let levels: Vec<usize> = (0..self.levels.len()).collect();
                let some = |levels: &[usize]| levels.par_iter().map(|&level| one(level)).collect();
                let made: Vec<Vec<Made>> =
                    levels.chunks(LEVELS).map(some).collect::<Result<_>>()?;
                Ok(made.concat())
            };
            sheets.map(make).collect()
        })
    }

    /// The bytes and errors of each sheet and level, for a budget.
    fn shares(&self, made: &[Vec<Made>]) -> Result<Vec<Share>> {
        let mut shares = Vec::new();
        for (sheet, made) in self.sheets.iter().zip(made) {
            let surfaces = self.origin.surfaces;
            let mut details: Vec<f64> = Vec::new();
            for (original, charts) in
                sheet.originals(self.origin, self.options)?.iter().zip(sheet.shown())
            {
                let area = self.texel_density.share(surfaces, &charts);
                let own = original.picture.details();
                details.resize(own.len(), 0.0);
                details.iter_mut().zip(own).for_each(|(sum, lost)| *sum += area * lost);
            }
            for (level, made) in made.iter().enumerate() {
                let unseen = self.texel_density.unseen(surfaces, sheet.layout, sheet.size, level);
                let (bytes, details) = (self.bytes(made) as f64, details.clone());
                shares.push(Share { bytes, halvings: unseen, unseen, details });
            }
        }
        Ok(shares)
    }
}

/// The textures of each of `count` levels, from those that were made of each sheet.
fn assign(
    origin: &Origin<'_>,
    plan: &Plan,
    made: Vec<Vec<Made>>,
    count: usize,
) -> Result<Vec<LevelTextures>> {
    let surfaces = origin.surfaces;
    let shared = LevelTextures::shared(origin.images, surfaces);
    let merged =
        plan.merge_groups().flat_map(|merge_group| merge_group.materials.iter().copied()).collect();
    let left = Leftovers::of(origin.asset, &merged)?.images.into_iter().collect();
    let mut levels = vec![LevelTextures { left, ..shared }; count];
    for sheet in made {
        for (level, made) in levels.iter_mut().zip(sheet) {
            for (index, image) in made.images {
                level.images[index] = image;
            }
            level.colors.extend(made.colors);
            level.normals.extend(made.normals);
            level.merged.extend(made.merged);
        }
    }
    let repacked: Vec<&UvLayout> = plan.layouts.iter().filter(|layout| layout.is_new).collect();
    for level in &mut levels {
        let gaining = level.normals.iter().flat_map(|own| own.materials.iter().copied());
        let merged = level.merged.iter().filter(|own| own.has_normals).map(|own| own.materials[0]);
        let gaining: Vec<usize> = gaining.chain(merged).collect();
        let is_own = |image: usize| level.images[image] != origin.images[image];
        let sets = plan.level_sets(surfaces, |own| gaining.contains(&own), is_own);
        for (own, (sets, joins)) in level.parts.iter_mut().zip(sets.iter().zip(&plan.joins.numbers))
        {
            for (part, (set, join)) in own.iter_mut().zip(sets.iter().zip(joins)) {
                (part.tangents, part.join) = (*set, *join);
            }
        }
        for (layout, charts) in repacked.iter().flat_map(|l| l.charts.iter().map(move |c| (l, c))) {
            let part = &surfaces[charts.surface].parts[charts.group as usize];
            level.parts[charts.surface][charts.group as usize].is_repacked = true;
            if layout.merge_group.is_none() {
                level.repacked.extend(materials_of(origin.asset, &part.primitive)?);
            }
        }
    }
    Ok(levels)
}
