//! The straight line: read → weld → simplify → polish → repair → evaluate → write. The only file that knows
//! the order of the stages.

use std::path::PathBuf;

use super::fragments::warn_of_fragments;
use super::input::Input;
use super::options::{BakeOptions, Textures};
use super::report::{input_report, level_reports};
use super::simplify::{Simplified, grow_all, polish_all, settle_all, simplify_all};
use super::stages::{
    Clock, draw_all, evaluate_all, find_morphs, finish_images, free_shapes, level_assets,
    load_reference, own_textures, plan_textures, preview_all, repair_images, warn_of_charts,
};
use super::steering::MeshSteering;
use super::texture_files::{Images, check_encoders};
use super::unsimplified::{Surfaces, warn_of_whole_levels};
use super::view::{Models, view_all};
use crate::atlas::ImageRepair;
use crate::document::asset::Asset;
use crate::document::material::name_default_material;
use crate::error::Result;
use crate::evaluate::load::TextureCache;
use crate::evaluate::reference::ReferenceScene;
use crate::export::bundle::{Chain, Measured};
use crate::export::files::Layout;
use crate::export::progressive::write::progressive_glb;
use crate::image_file::encoded::EncodedImage;
use crate::level::geomorph::Morphs;
use crate::level::lods::Lods;
use crate::level::textures::LevelTextures;
use crate::level::{AssetLevel, LevelAssembly};
use crate::progress::Progress;
use crate::report::html::Extras;
use crate::report::level_textures::draw_level_textures;
use crate::report::pictures::{AtlasPictures, draw_atlases};
use crate::report::{BakeReport, Seconds, TextureReport, mesh_reports, peak_memory};
use crate::surface::colors::keep_colors;
use crate::surface::geometry::Geometry;
use crate::surface::group::weld_all;
use crate::transfer::{MaterialTextures, Origin, Plan, TransferOptions};
use crate::warning::Warnings;

/// Levels as files, before the report on them is complete.
pub(super) struct Levels {
    /// Bytes of files by name: the levels, the finest first, then all of them in one, then images
    /// beside them.
    pub(super) files: Vec<(String, Vec<u8>)>,
    /// The input's own file and those that it names.
    pub(super) sources: Vec<PathBuf>,
    pub(super) report: BakeReport,
    /// Additions to the page of the report.
    pub(super) extras: Extras,
}

/// Bakes levels, and what else is to be written beside them.
///
/// # Errors
/// As [`bake`](fn@super::bake).
pub(super) fn bake_levels(
    input: Input<'_>,
    options: &BakeOptions,
    progress: &Progress,
) -> Result<Levels> {
    options.check()?;
    check_encoders(options)?;
    let mut clock = Clock { seconds: Seconds::default(), progress };
    let mut source = Source::read(input, options, &mut clock)?;
    let Simplified { chains, mut scene, .. } = source.shape(options, &mut clock)?;
    let mut lods = Lods::from_chains(chains, options.targets.count())?;
    let Dressed { repairs, atlases, images, textures, materials } =
        source.dress(&mut lods, options, &mut clock)?;
    let Source { asset, sources, shapes, surfaces, steering, mut warnings, .. } = source;
    let geometries = shapes.as_deref().unwrap_or(&sources);
    grow_all(geometries, &mut lods, &steering);
    let morphs = find_morphs(&asset, geometries, &lods, scene.as_mut(), (options, &mut warnings));
    let assembly = LevelAssembly {
        asset: &asset,
        geometries,
        lods: &lods,
        keeps_positions: options.steering.lock_border.is_some(),
        morphs: &morphs,
    };
    let assemble = || assembly.assemble(textures, options.output.quantizes());
    let assembled = clock.time("write", |s| &mut s.write, assemble)?;
    let levels = clock.time("write", |s| &mut s.write, || level_assets(&asset, &assembled))?;
    let name = options.output.progressive_file(&input.stem());
    let progressive = scene.as_ref().zip(name).map(|(scene, name)| {
        let write = || progressive_glb(&asset, &images, geometries, scene);
        Ok((name, clock.time("write", |s| &mut s.write, write)?))
    });
    let progressive: Option<(String, Vec<u8>)> = progressive.transpose()?;
    let mut judge = Judge {
        models: Models { source: &asset, levels: &levels, progressive: progressive.as_ref() },
        cache: TextureCache::with_limit(options.reading.memory_limit),
        options,
    };
    let reference = match surfaces {
        Surfaces::Shown => judge.reference(repairs.as_deref(), &mut clock)?,
        Surfaces::Unseen => None,
    };
    drop(repairs);
    let measured = judge.measure(reference.as_ref(), &mut clock)?;
    let mut extras = Extras { atlases, ..Extras::default() };
    if let (Some(reference), Some(_)) = (&reference, options.report) {
        let own = (&mut extras, reference, measured.as_ref());
        judge.illustrate(own, (input, &images), &mut clock)?;
    }
    let limit = options.reading.memory_limit;
    let pictures: Vec<Vec<TextureReport>> =
        levels.iter().map(|level| TextureReport::of(level, limit)).collect::<Result<_>>()?;
    let written = Written { asset: &asset, geometries, morphs: &morphs, assembled: &assembled };
    let encode = || written.encode(levels, &images, (input, options), measured.as_ref());
    let mut files = clock.time("write", |s| &mut s.write, encode)?;
    files.extend(progressive);
    let own = (&assembled[..], &pictures[..]);
    let levels = level_reports(&asset, own, &lods, &steering, options, measured.as_ref());
    let files_read = input.files(&asset, options.reading);
    let input_report = input_report(input, &files_read, &asset, &sources, limit)?;
    input.warn_of_name(&mut warnings);
    warn_of_whole_levels(&levels, input_report.triangles, &options.targets, &mut warnings);
    warnings.extend(measured.as_ref().map(|own| own.warnings.clone()).unwrap_or_default());
    warnings.refuse_if(options.reading.strict)?;
    let report = BakeReport {
        schema: 1,
        digest: String::new(),
        files: Vec::new(),
        file_bytes: Vec::new(),
        removed: Vec::new(),
        input: input_report,
        warnings,
        screen: options.screen,
        reference_textures: reference.filter(|_| measured.is_some()).map(|own| own.textures),
        levels,
        meshes: mesh_reports(&asset, geometries, &lods),
        materials,
        seconds: clock.seconds,
        threads: Vec::new(),
        peak_memory_bytes: peak_memory(),
    };
    Ok(Levels { files, sources: files_read, report, extras })
}

/// The source, ready to be simplified.
struct Source {
    asset: Asset,
    sources: Vec<Geometry>,
    plan: Option<Plan>,
    /// The surfaces that levels are simplified from, where they are not the source's.
    shapes: Option<Vec<Geometry>>,
    surfaces: Surfaces,
    steering: Vec<MeshSteering>,
    warnings: Warnings,
}

impl Source {
    fn read(input: Input<'_>, options: &BakeOptions, clock: &mut Clock<'_>) -> Result<Self> {
        let limit = options.reading.memory_limit;
        let mut asset = clock.time("read", |s| &mut s.read, || input.read(options.reading))?;
        if matches!(options.textures, Textures::Transfer(own) if own.unwraps) {
            // A level may gain a normal map, and that is the material's.
            name_default_material(&mut asset);
        }
        let sources = clock.time("weld", |s| &mut s.weld, || weld_all(&asset, limit))?;
        let plan = plan_textures(&asset, &sources, options)?;
        let free = || free_shapes(&mut asset, &sources, plan.as_ref(), limit);
        let shapes = clock.time("weld", |s| &mut s.weld, free)?;
        let geometries = shapes.as_deref().unwrap_or(&sources);
        let mut warnings = asset.warnings.clone();
        let surfaces = Surfaces::check(&asset, geometries, options, &mut warnings)?;
        warn_of_fragments(&asset, &sources, options, &mut warnings)?;
        warn_of_charts(plan.as_ref(), &sources, options, &mut warnings);
        let steering = options.steering.resolve(&asset, geometries, limit)?;
        Ok(Self { asset, sources, plan, shapes, surfaces, steering, warnings })
    }

    fn geometries(&self) -> &[Geometry] {
        self.shapes.as_deref().unwrap_or(&self.sources)
    }

    /// The levels' shapes: simplified, polished and settled.
    fn shape(&self, options: &BakeOptions, clock: &mut Clock<'_>) -> Result<Simplified> {
        let (asset, geometries, steering) = (&self.asset, self.geometries(), &self.steering[..]);
        let progress = clock.progress;
        let simplify = || simplify_all(geometries, steering, options, progress);
        let mut simplified = clock.time("simplify", |s| &mut s.simplify, simplify)?;
        let is_bare = options.steering.order.is_bare();
        if let Some(polish) = options.polish.as_ref().filter(|_| !is_bare) {
            let run = || {
                simplified.all().try_for_each(|chains| {
                    polish_all(geometries, chains, steering, polish, progress)
                })
            };
            clock.time("polish", |s| &mut s.polish, run)?;
        }
        let settle = || {
            simplified.all().try_for_each(|chains| {
                if !is_bare {
                    settle_all(asset, geometries, chains, steering)?;
                }
                keep_colors(asset, geometries, chains, options.reading.memory_limit)
            })
        };
        clock.time("polish", |s| &mut s.polish, settle)?;
        if options.output.progressive {
            simplified.settle();
        }
        Ok(simplified)
    }

    /// The textures of levels; where charts are laid out anew, `lods` are as well.
    fn dress(
        &mut self,
        lods: &mut Lods,
        options: &BakeOptions,
        clock: &mut Clock<'_>,
    ) -> Result<Dressed> {
        let (asset, limit, progress) = (&self.asset, options.reading.memory_limit, clock.progress);
        let repairs = clock.time("repair", |s| &mut s.repair, || repair_images(asset, options))?;
        let mut images =
            clock.time("repair", |s| &mut s.repair, || finish_images(asset, repairs.as_deref()))?;
        let (mut textures, materials) = match (options.textures, &repairs, &self.plan) {
            (Textures::Transfer(transfer), Some(repairs), Some(plan)) => {
                let (surfaces, images, screen) = (&self.sources[..], &images[..], options.screen);
                let has_level_files_alone = options.output.layout == Layout::None;
                let origin = Origin {
                    asset,
                    surfaces,
                    repairs,
                    images,
                    has_level_files_alone,
                    screen,
                    limit,
                };
                let in_blocks = options.texture_files.ktx2;
                let transfer = TransferOptions { in_blocks, ..transfer };
                let run = || own_textures(&origin, plan, lods, &transfer, progress);
                clock.time("transfer", |s| &mut s.transfer, run)?
            }
            _ => {
                let shared = LevelTextures::shared(&images, self.geometries());
                (vec![shared; lods.count()], Vec::new())
            }
        };
        let finish = || {
            let (of_source, of_levels) = (&mut images[..], &mut textures[..]);
            Images { asset, of_source, of_levels }.finish(options, progress)
        };
        self.warnings.extend(clock.time("texture files", |s| &mut s.transfer, finish)?);
        let draw = |repairs| draw_atlases(asset, repairs, limit);
        let drawn = repairs.as_deref().filter(|_| options.report.is_some());
        let drawn = drawn.map(|own| clock.time("report", |s| &mut s.report, || draw(own)));
        let atlases = drawn.transpose()?.unwrap_or_default();
        Ok(Dressed { repairs, atlases, images, textures, materials })
    }
}

/// The textures of levels, and of their source after repair.
struct Dressed {
    repairs: Option<Vec<ImageRepair>>,
    /// Pictures of these, for a page.
    atlases: AtlasPictures,
    images: Vec<EncodedImage>,
    textures: Vec<LevelTextures>,
    materials: Vec<MaterialTextures>,
}

/// Compares levels with their source, in figures and in pictures.
struct Judge<'a> {
    models: Models<'a>,
    cache: TextureCache,
    options: &'a BakeOptions,
}

impl Judge<'_> {
    /// What levels are compared with, if they are.
    fn reference(
        &mut self,
        repairs: Option<&[ImageRepair]>,
        clock: &mut Clock<'_>,
    ) -> Result<Option<ReferenceScene>> {
        let options = self.options;
        if options.evaluate.is_none() && options.report.is_none() {
            return Ok(None);
        }
        let source = self.models.source;
        let load = || load_reference(source, repairs, options, &mut self.cache);
        clock.time("evaluate", |s| &mut s.evaluate, load).map(Some)
    }

    fn measure(
        &mut self,
        reference: Option<&ReferenceScene>,
        clock: &mut Clock<'_>,
    ) -> Result<Option<Measured>> {
        let (levels, progress) = (self.models.levels, clock.progress);
        let Some(reference) = reference else { return Ok(None) };
        if self.options.preview && self.options.evaluate.is_some() {
            let look = || preview_all(&reference.scene, levels, &mut self.cache);
            progress.note(&clock.time("preview", |s| &mut s.evaluate, look)?);
        }
        let Some(own) = self.options.evaluation() else { return Ok(None) };
        let measure = || evaluate_all(&reference.scene, levels, own, &mut self.cache, progress);
        clock.time("evaluate", |s| &mut s.evaluate, measure).map(Some)
    }

    /// Draws what the page shows.
    fn illustrate(
        &mut self,
        (extras, reference, measured): (&mut Extras, &ReferenceScene, Option<&Measured>),
        (input, images): (Input<'_>, &[EncodedImage]),
        clock: &mut Clock<'_>,
    ) -> Result<()> {
        let (options, limit) = (self.options, self.options.reading.memory_limit);
        let (levels, progress) = (self.models.levels, clock.progress);
        let draw = || draw_all(&reference.scene, levels, &mut self.cache, progress);
        extras.gallery = Some(clock.time("report", |s| &mut s.report, draw)?);
        let draw = || draw_level_textures(levels, images, limit);
        extras.level_textures = clock.time("report", |s| &mut s.report, draw)?;
        let view = || view_all(&self.models, input, options, measured);
        extras.viewer = Some(clock.time("report", |s| &mut s.report, view)?);
        Ok(())
    }
}

/// What is written of levels beside their own documents.
struct Written<'a> {
    asset: &'a Asset,
    geometries: &'a [Geometry],
    morphs: &'a Morphs<'a>,
    assembled: &'a [AssetLevel<'a>],
}

impl Written<'_> {
    /// The levels as files.
    fn encode(
        &self,
        levels: Vec<Asset>,
        images: &[EncodedImage],
        (input, options): (Input<'_>, &BakeOptions),
        measured: Option<&Measured>,
    ) -> Result<Vec<(String, Vec<u8>)>> {
        let BakeOptions { output, screen, .. } = *options;
        let source_morphs = match output.layout {
            Layout::None => Vec::new(),
            _ => self.morphs.of_source(self.asset, self.geometries)?,
        };
        let limit = options.reading.memory_limit;
        let (asset, own) = (self.asset, self.assembled);
        let chain = Chain { asset, levels: own, images, output, screen, source_morphs, limit };
        let documents = chain.documents(levels, measured, &input.stem())?;
        output.encode(&input.stem(), documents)
    }
}
