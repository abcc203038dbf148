//! The stages of a bake: what each makes of what those before it made.

use std::sync::atomic::Ordering;
use std::time::Instant;

use rayon::prelude::*;
use seamwise_attr::ProgressiveScene;
use serde_json::Value;

use super::options::{BakeOptions, Textures};
use crate::atlas::{ImageRepair, encode_repaired, repair_all};
use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::evaluate::load::{TextureCache, load};
use crate::evaluate::reference::ReferenceScene;
use crate::evaluate::scene::{Mode, Scene};
use crate::evaluate::{self, Reference};
use crate::export::bundle::Measured;
use crate::export::document::level_asset;
use crate::export::files::Geomorph;
use crate::image_file::codec::EncodeOptions;
use crate::image_file::encoded::EncodedImage;
use crate::level::AssetLevel;
use crate::level::geomorph::{Kinds, Morphs, takes_target};
use crate::level::lods::Lods;
use crate::level::textures::LevelTextures;
use crate::limit::MemoryLimit;
use crate::progress::Progress;
use crate::report::Seconds;
use crate::report::pictures::Gallery;
use crate::report::preview::preview_table;
use crate::surface::geometry::Geometry;
use crate::surface::group::weld_all;
use crate::transfer::{
    BakeNormals, MaterialTextures, Origin, Plan, Transfer, TransferOptions, transfer_all,
};
use crate::warning::Warnings;

/// Adds up the wall time of each stage, and ends a bake between two if its time is over.
pub(super) struct Clock<'a> {
    pub(super) seconds: Seconds,
    pub(super) progress: &'a Progress,
}

impl Clock<'_> {
    pub(super) fn time<T>(
        &mut self,
        name: &str,
        stage: fn(&mut Seconds) -> &mut f64,
        run: impl FnOnce() -> Result<T>,
    ) -> Result<T> {
        self.progress.check(name)?;
        let start = Instant::now();
        let result = self.progress.stage(name, 0, |_| run())?;
        *stage(&mut self.seconds) += start.elapsed().as_secs_f64();
        self.progress.check(name)?;
        Ok(result)
    }
}

/// The plan of levels' own textures, if they are to have any.
pub(super) fn plan_textures(
    asset: &Asset,
    surfaces: &[Geometry],
    options: &BakeOptions,
) -> Result<Option<Plan>> {
    let Textures::Transfer(own) = &options.textures else { return Ok(None) };
    if own.unwraps && options.output.progressive {
        let what = "levels that are unwrapped lead to no source with its UVs: --atlas free goes without --progressive";
        return Err(Error::Options { what: what.into() });
    }
    Plan::new(asset, surfaces, options.reading.memory_limit, own).map(Some)
}

/// The surfaces that levels are simplified from, where those are not the source's: without the UVs that they
/// gain anew, and without the colors that become a texture.
pub(super) fn free_shapes(
    asset: &mut Asset,
    surfaces: &[Geometry],
    plan: Option<&Plan>,
    limit: MemoryLimit,
) -> Result<Option<Vec<Geometry>>> {
    let Some(plan) = plan.filter(|plan| plan.is_free.contains(&true)) else { return Ok(None) };
    let mut json = asset.json.clone();
    for (at, surface) in surfaces.iter().enumerate().filter(|(at, _)| plan.is_free[*at]) {
        let drops_colors = plan.takes_colors(at);
        for part in &surface.parts {
            let attributes = json.pointer_mut(&format!("{}/attributes", part.primitive.at));
            if let Some(own) = attributes.and_then(Value::as_object_mut) {
                own.retain(|name, _| {
                    !(name.starts_with("TEXCOORD_") || drops_colors && name == "COLOR_0")
                });
            }
        }
    }
    let buffers = std::mem::take(&mut asset.buffers);
    let bare = Asset { json, buffers, ..Asset::default() };
    let welded = weld_all(&bare, limit);
    asset.buffers = bare.buffers;
    welded.map(Some)
}

/// Warns of surfaces that were to be free of the source's charts and can't be.
pub(super) fn warn_of_charts(
    plan: Option<&Plan>,
    surfaces: &[Geometry],
    options: &BakeOptions,
    warnings: &mut Warnings,
) {
    let (Some(plan), Textures::Transfer(own)) = (plan, &options.textures) else { return };
    if !own.unwraps {
        let bare = surfaces.iter().filter(|own| own.welded.mesh.layout.uv_sets == 0);
        for surface in bare.filter(|_| own.bake_normals == BakeNormals::On) {
            let what = "it has no UVs, so that its levels have none for a normal map: `--textures transfer --atlas \
                        free` gives them some";
            warnings.add(format!("/meshes/{}", surface.meshes[0]), what);
        }
        return;
    }
    for (surface, _) in surfaces.iter().zip(&plan.is_free).filter(|(_, is_free)| !**is_free) {
        let what = "some of its primitives have UVs of which no image is made anew, or none has an image: with \
                    --atlas free its levels are simplified within the source's charts all the same";
        warnings.add(format!("/meshes/{}", surface.meshes[0]), what);
    }
}

/// Textures of each level's own, and what became of those of each material. Where charts are laid out
/// anew, `lods` are as well.
pub(super) fn own_textures(
    origin: &Origin<'_>,
    plan: &Plan,
    lods: &mut Lods,
    options: &TransferOptions,
    progress: &Progress,
) -> Result<(Vec<LevelTextures>, Vec<MaterialTextures>)> {
    let Transfer { textures, repacked, choices } =
        transfer_all(origin, plan, lods, options, progress)?;
    if let Some(repacked) = repacked {
        *lods = repacked;
    }
    Ok((textures, plan.outcomes(origin.asset, &choices)?))
}

/// Where vertices of each level come to lie in the next one, if they are to tell; and warnings of what can't be told.
pub(super) fn find_morphs<'a>(
    asset: &Asset,
    geometries: &[Geometry],
    lods: &'a Lods,
    scene: Option<&mut ProgressiveScene>,
    (options, warnings): (&BakeOptions, &mut Warnings),
) -> Morphs<'a> {
    let (Some(scene), true) = (scene, options.output.geomorph != Geomorph::None) else {
        return Morphs::default();
    };
    let has_uvs = !matches!(options.textures, Textures::Transfer(_));
    if !has_uvs {
        let what = "each level has textures of its own, so that UVs of the next one mean nothing in it: positions, \
                    normals and colors are told alone; --textures repair has UVs too";
        warnings.add("--geomorph", what);
    }
    let has_target = options.output.geomorph == Geomorph::Target;
    if has_target && !geometries.iter().all(|own| takes_target(asset, own)) {
        let what = "meshes with morph targets, points or lines of their own get no further target: they have \
                    attributes alone";
        warnings.add("--geomorph", what);
    }
    Morphs::find(asset, geometries, lods, scene, Kinds { has_uvs, has_target })
}

/// The repair of each image, if the options ask for it.
pub(super) fn repair_images(
    asset: &Asset,
    options: &BakeOptions,
) -> Result<Option<Vec<ImageRepair>>> {
    match options.textures {
        Textures::Keep => Ok(None),
        Textures::Repair | Textures::Transfer(_) => {
            repair_all(asset, options.reading.memory_limit).map(Some)
        }
    }
}

pub(super) fn finish_images(
    asset: &Asset,
    repairs: Option<&[ImageRepair]>,
) -> Result<Vec<EncodedImage>> {
    match repairs {
        None => Ok(asset.images.clone()),
        Some(repairs) => encode_repaired(asset, repairs, EncodeOptions::default()),
    }
}

/// The levels as documents.
pub(super) fn level_assets(asset: &Asset, levels: &[AssetLevel<'_>]) -> Result<Vec<Asset>> {
    levels.par_iter().map(|level| level_asset(asset, level)).collect()
}

/// What levels are compared with.
pub(super) fn load_reference(
    asset: &Asset,
    repairs: Option<&[ImageRepair]>,
    options: &BakeOptions,
    cache: &mut TextureCache,
) -> Result<ReferenceScene> {
    if options.reference_as_is {
        return ReferenceScene::as_is(asset, cache);
    }
    ReferenceScene::cleaned(asset, repairs, Mode::Lit, options.reading.memory_limit, cache)
}

/// The source and the levels in pictures.
pub(super) fn draw_all(
    source: &Scene,
    levels: &[Asset],
    textures: &mut TextureCache,
    progress: &Progress,
) -> Result<Gallery> {
    progress.stage("draw", levels.len() + 1, |done| {
        let mut gallery = Gallery::new(source)?;
        for level in levels {
            progress.check("report")?;
            done.fetch_add(1, Ordering::Relaxed);
            gallery.add(&load(level, textures)?)?;
        }
        Ok(gallery)
    })
}

/// Rough figures of levels, as soon as these are there: a few views and samples, and no search for the sizes at
/// which they are shown.
pub(super) fn preview_all(
    source: &Scene,
    levels: &[Asset],
    textures: &mut TextureCache,
) -> Result<String> {
    let options = evaluate::Options {
        views: 6,
        resolution: 256,
        samples: 20_000,
        screen_height: 0,
        ..evaluate::Options::default()
    };
    let reference = Reference::new(source, options)?;
    let look = |level: &Asset| {
        let scene = load(level, textures)?;
        Ok((scene.triangles.len(), reference.compare(&scene)?))
    };
    let figures = levels.iter().map(look).collect::<Result<Vec<_>>>()?;
    Ok(preview_table(source.triangles.len(), &figures))
}

pub(super) fn evaluate_all(
    source: &Scene,
    levels: &[Asset],
    options: evaluate::Options,
    textures: &mut TextureCache,
    progress: &Progress,
) -> Result<Measured> {
    progress.stage("evaluate", levels.len() + 1, |done| {
        let reference = Reference::new(source, options)?;
        let count = || done.fetch_add(1, Ordering::Relaxed);
        count();
        let mut measured = Measured::new(reference.diagonal());
        reference.warn_if_unseen(&mut measured.warnings);
        for level in levels {
            progress.check("evaluate")?;
            let metrics = reference.compare(&load(level, textures)?)?;
            let is_off = metrics.distance_max > 0.0;
            measured.farthest.push(reference.part_at(metrics.distance_max_at).filter(|_| is_off));
            measured.metrics.push(metrics);
            count();
        }
        Ok(measured)
    })
}
