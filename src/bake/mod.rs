//! The straight line: read → weld → simplify → polish → repair → evaluate → write. The only file that knows
//! the order of the stages.

pub(crate) mod baked;
pub(crate) mod digest;
mod fragments;
pub mod goals;
pub(crate) mod input;
pub mod options;
mod report;
mod simplify;
mod stages;
pub mod steering;
mod texture_files;
mod trials;
mod unsimplified;
mod view;
mod words;

use std::path::{Path, PathBuf};

use crate::document::asset::Asset;
use crate::document::material::name_default_material;
use crate::error::Result;
use crate::evaluate::load::TextureCache;
use crate::export::bundle::Chain;
use crate::export::disk::check_writable;
use crate::export::files::{Format, Layout};
use crate::export::progressive::write::progressive_glb;
use crate::level::LevelAssembly;
use crate::level::lods::Lods;
use crate::level::textures::LevelTextures;
use crate::progress::Progress;
use crate::report::html::{Extras, bake_page};
use crate::report::level_textures::draw_level_textures;
use crate::report::pictures::draw_atlases;
use crate::report::threads::time_threads;
use crate::report::verdict::FileSize;
use crate::report::{BakeReport, Seconds, TextureReport, mesh_reports, peak_memory};
use crate::surface::colors::keep_colors;
use crate::surface::geometry::Geometry;
use crate::surface::group::weld_all;
use crate::transfer::{Origin, TransferOptions};
pub use baked::{Baked, BakedFile};
use digest::digest;
use fragments::warn_of_fragments;
pub use input::Input;
use options::{BakeOptions, Textures};
use report::{input_report, level_reports};
use simplify::{Simplified, grow_all, polish_all, settle_all, simplify_all};
use stages::{
    Clock, draw_all, evaluate_all, find_morphs, finish_images, free_shapes, level_assets,
    load_reference, own_textures, plan_textures, preview_all, repair_images, warn_of_charts,
};
use steering::MeshSteering;
use texture_files::{Images, check_encoders};
use trials::Tried;
use unsimplified::{Surfaces, warn_of_whole_levels};
use view::{Models, view_all};
use words::option_words;

/// Bakes the levels of one asset into `folder`: `<stem>_lod1.glb` and so on, and what else
/// `options.output` asks for; `<stem>.json` with what was measured, and `<stem>.html` with the same in
/// charts and pictures if the options ask for it. Either all of them are written or none; files of an
/// earlier bake that have no successor go.
///
/// # Errors
/// [`Error::Io`], [`Error::Invalid`] or [`Error::Unsupported`] if the asset can't be read;
/// [`Error::Options`] if an output would overwrite the input or can't be written, or the steering names
/// what is not there; [`Error::Time`] if it takes longer than `options.time_limit`.
///
/// [`Error::Io`]: crate::error::Error::Io
/// [`Error::Invalid`]: crate::error::Error::Invalid
/// [`Error::Unsupported`]: crate::error::Error::Unsupported
/// [`Error::Options`]: crate::error::Error::Options
/// [`Error::Time`]: crate::error::Error::Time
pub fn bake(
    input: Input<'_>,
    folder: &Path,
    options: &BakeOptions,
    progress: &Progress,
) -> Result<BakeReport> {
    let outputs = input.outputs(folder, options);
    input.refuse_overwriting(&outputs)?;
    check_writable(&outputs)?;
    let mut baked = bake_in_memory(input, options, progress)?;
    baked.report.removed = baked.write(folder)?;
    Ok(baked.report)
}

/// Bakes the levels of a self-contained .gltf or .glb in memory. `name` is the stem of the files' names.
///
/// ```
/// use seamwise::{BakeOptions, bake_bytes};
///
/// # let options = BakeOptions { report: None, evaluate: None, ..BakeOptions::default() };
/// # let sample = include_bytes!("../../data/sample.glb");
/// let baked = bake_bytes(sample, "sample", &options)?;
/// assert_eq!(baked.files[0].name, "sample_lod1.glb");
/// assert!(baked.report.levels[3].triangles < baked.report.input.triangles / 10);
///
/// # let folder = tempfile::tempdir().unwrap();
/// # let folder = folder.path();
/// baked.write(folder)?;
/// assert!(folder.join("sample.json").exists());
/// # Ok::<(), seamwise::Error>(())
/// ```
///
/// # Errors
/// As [`bake`](fn@bake), but nothing is written.
pub fn bake_bytes(bytes: &[u8], name: &str, options: &BakeOptions) -> Result<Baked> {
    bake_in_memory(Input::Bytes(bytes, name), options, &Progress::hidden())
}

/// Bakes the levels of one asset, and leaves it to the caller what is written.
///
/// # Errors
/// As [`bake`](fn@bake), but nothing is written.
pub fn bake_in_memory(
    input: Input<'_>,
    options: &BakeOptions,
    progress: &Progress,
) -> Result<Baked> {
    let progress = &progress.limited(options.time_limit);
    // Before the input is read: if it changes in between, the hash is of what it no longer is.
    let digest = digest(input, options)?;
    let bake = |own: &BakeOptions| {
        let Levels { files, report, .. } = bake_levels(input, own, &progress.unseen())?;
        let bytes = files.iter().map(|(_, file)| file.len());
        Ok(report
            .levels
            .into_iter()
            .zip(bytes)
            .map(|(level, bytes)| Tried { level, bytes })
            .collect())
    };
    let (found, values) = trials::resolve(options, progress, bake)?;
    let (goals, options) = (&options.goals, &found);
    let Levels { files, sources, mut report, mut extras } = bake_levels(input, options, progress)?;
    report.digest = digest;
    if let Some(goals) = goals {
        let is_glb = options.output.format == Format::Glb;
        for (index, level) in report.levels.iter_mut().enumerate() {
            let bytes = files.get(index).filter(|_| is_glb).map(|(_, bytes)| bytes.len());
            level.goal = Some(goals.reached(index, level, bytes, values[index]));
        }
    }
    let files = files.into_iter().map(|(name, bytes)| BakedFile { name, bytes }).collect();
    let mut baked = Baked { files, page: None, report, stem: input.stem(), sources };
    if let Some(page) = options.report {
        if page.threads {
            let again = BakeOptions { report: None, ..options.clone() };
            let most = rayon::current_num_threads();
            baked.report.threads = time_threads(most, page.thread_runs, || {
                bake_levels(input, &again, &progress.unseen()).map(|own| own.report.seconds)
            })?;
        }
        let size = |file: &BakedFile| FileSize { name: file.name.clone(), bytes: file.bytes.len() };
        extras.files = baked.files.iter().map(size).collect();
        extras.options = option_words(options);
        let bytes = bake_page(&baked.report, &extras)?.into_bytes();
        let page = BakedFile { name: format!("{}.html", baked.stem), bytes };
        baked.page = Some(page);
    }
    baked.list_files(options);
    Ok(baked)
}

/// Levels as files, before the report on them is complete.
struct Levels {
    /// Bytes of files by name: the levels, the finest first, then all of them in one, then images
    /// beside them.
    files: Vec<(String, Vec<u8>)>,
    /// The input's own file and those that it names.
    sources: Vec<PathBuf>,
    report: BakeReport,
    /// Additions to the page of the report.
    extras: Extras,
}

fn bake_levels(input: Input<'_>, options: &BakeOptions, progress: &Progress) -> Result<Levels> {
    options.check()?;
    check_encoders(options)?;
    let mut clock = Clock { seconds: Seconds::default(), progress };
    let mut asset = clock.time("read", |s| &mut s.read, || input.read(options.reading))?;
    if matches!(options.textures, Textures::Transfer(own) if own.unwraps) {
        // A level may gain a normal map, and that is the material's.
        name_default_material(&mut asset);
    }
    let sources =
        clock.time("weld", |s| &mut s.weld, || weld_all(&asset, options.reading.memory_limit))?;
    let plan = plan_textures(&asset, &sources, options)?;
    let shapes =
        clock.time("weld", |s| &mut s.weld, || free_shapes(&asset, &sources, plan.as_ref()))?;
    let geometries = shapes.as_deref().unwrap_or(&sources);
    let mut warnings = asset.warnings.clone();
    let surfaces = Surfaces::check(&asset, geometries, options, &mut warnings)?;
    warn_of_fragments(&asset, &sources, options, &mut warnings)?;
    warn_of_charts(plan.as_ref(), &sources, options, &mut warnings);
    let steering = options.steering.resolve(&asset, geometries, options.reading.memory_limit)?;
    let simplified = shape(&asset, geometries, &steering, options, &mut clock)?;
    let Simplified { chains, mut scene, .. } = simplified;
    let mut lods = Lods::from_chains(chains, options.targets.count())?;
    let repairs = clock.time("repair", |s| &mut s.repair, || repair_images(&asset, options))?;
    let mut images =
        clock.time("repair", |s| &mut s.repair, || finish_images(&asset, repairs.as_deref()))?;
    let (mut textures, materials) = match (options.textures, &repairs, &plan) {
        (Textures::Transfer(transfer), Some(repairs), Some(plan)) => {
            let (surfaces, screen) = (&sources[..], options.screen);
            let (images, limit) = (&images[..], options.reading.memory_limit);
            let has_level_files_alone = options.output.layout == Layout::None;
            let asset = &asset;
            let origin =
                Origin { asset, surfaces, repairs, images, has_level_files_alone, screen, limit };
            let transfer = TransferOptions { in_blocks: options.texture_files.ktx2, ..transfer };
            let run = || own_textures(&origin, plan, &mut lods, &transfer, progress);
            clock.time("transfer", |s| &mut s.transfer, run)?
        }
        _ => {
            let shared = LevelTextures::shared(&images, geometries);
            (vec![shared; lods.count()], Vec::new())
        }
    };
    let finish = || {
        let (of_source, of_levels) = (&mut images[..], &mut textures[..]);
        Images { asset: &asset, of_source, of_levels }.finish(options, progress)
    };
    warnings.extend(clock.time("texture files", |s| &mut s.transfer, finish)?);
    grow_all(geometries, &mut lods, &steering);
    let mut extras = Extras::default();
    if let (Some(repairs), Some(_)) = (&repairs, options.report) {
        let draw = || draw_atlases(&asset, repairs, options.reading.memory_limit);
        extras.atlases = clock.time("report", |s| &mut s.report, draw)?;
    }
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
    let mut cache = TextureCache::with_limit(options.reading.memory_limit);
    let is_compared = options.evaluate.is_some() || options.report.is_some();
    let reference = (is_compared && surfaces == Surfaces::Shown).then(|| {
        let load = || load_reference(&asset, repairs.as_deref(), options, &mut cache);
        clock.time("evaluate", |s| &mut s.evaluate, load)
    });
    let reference = reference.transpose()?;
    drop(repairs);
    if let (Some(reference), true) = (&reference, options.preview && options.evaluate.is_some()) {
        let look = || preview_all(&reference.scene, &levels, &mut cache);
        progress.note(&clock.time("preview", |s| &mut s.evaluate, look)?);
    }
    let mut measured = None;
    if let (Some(reference), Some(own)) = (&reference, options.evaluation()) {
        let measure = || evaluate_all(&reference.scene, &levels, own, &mut cache, progress);
        measured = Some(clock.time("evaluate", |s| &mut s.evaluate, measure)?);
    }
    let name = options.output.progressive_file(&input.stem());
    let progressive = scene.as_ref().zip(name).map(|(scene, name)| {
        let write = || progressive_glb(&asset, &images, geometries, scene);
        Ok((name, clock.time("write", |s| &mut s.write, write)?))
    });
    let progressive: Option<(String, Vec<u8>)> = progressive.transpose()?;
    if let (Some(reference), Some(_)) = (&reference, options.report) {
        let draw = || draw_all(&reference.scene, &levels, &mut cache, progress);
        extras.gallery = Some(clock.time("report", |s| &mut s.report, draw)?);
        let draw = || draw_level_textures(&levels, &images, options.reading.memory_limit);
        extras.level_textures = clock.time("report", |s| &mut s.report, draw)?;
        let view = || {
            let models =
                Models { source: &asset, levels: &levels, progressive: progressive.as_ref() };
            view_all(&models, input, options, measured.as_ref())
        };
        extras.viewer = Some(clock.time("report", |s| &mut s.report, view)?);
    }
    let limit = options.reading.memory_limit;
    let pictures: Vec<Vec<TextureReport>> =
        levels.iter().map(|level| TextureReport::of(level, limit)).collect::<Result<_>>()?;
    let encode = || {
        let BakeOptions { output, screen, .. } = *options;
        let source_morphs = match output.layout {
            Layout::None => Vec::new(),
            _ => morphs.of_source(&asset, geometries)?,
        };
        let (levels_of, images) = (&assembled[..], &images[..]);
        let asset = &asset;
        let chain =
            Chain { asset, levels: levels_of, images, output, screen, source_morphs, limit };
        let documents = chain.documents(levels, measured.as_ref(), &input.stem())?;
        options.output.encode(&input.stem(), &documents)
    };
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

/// The levels' shapes: simplified, polished and settled.
fn shape(
    asset: &Asset,
    geometries: &[Geometry],
    steering: &[MeshSteering],
    options: &BakeOptions,
    clock: &mut Clock<'_>,
) -> Result<Simplified> {
    let progress = clock.progress;
    let simplify = || simplify_all(geometries, steering, options, progress);
    let mut simplified = clock.time("simplify", |s| &mut s.simplify, simplify)?;
    let is_bare = options.steering.order.is_bare();
    if let Some(polish) = options.polish.as_ref().filter(|_| !is_bare) {
        let run = || {
            simplified
                .all()
                .try_for_each(|chains| polish_all(geometries, chains, steering, polish, progress))
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
