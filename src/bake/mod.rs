//! A bake: levels as files, with a report, a page and what was asked of goals. The order of the stages is in
//! `levels`.

pub(crate) mod baked;
pub(crate) mod digest;
mod fragments;
pub mod goals;
pub(crate) mod input;
mod levels;
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

use std::path::Path;

use crate::error::Result;
use crate::export::disk::check_writable;
use crate::export::files::Format;
use crate::progress::Progress;
use crate::report::BakeReport;
use crate::report::html::bake_page;
use crate::report::threads::time_threads;
use crate::report::verdict::FileSize;
pub use baked::{Baked, BakedFile};
use digest::digest;
pub use input::Input;
use levels::{Levels, bake_levels};
use options::BakeOptions;
use trials::Tried;
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
