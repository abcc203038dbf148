//! The subcommands. Each returns how many of its inputs failed.

mod bake;

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Result, anyhow, bail};

use seamwise::atlas::{encode_repaired, repair_all};
use seamwise::document::asset::Asset;
use seamwise::evaluate::Reference;
use seamwise::evaluate::camera::Rig;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::scene::Scene;
use seamwise::evaluate::sheet::contact_sheet;
use seamwise::export::certificate::largest_sizes;
use seamwise::export::disk::write_files;
use seamwise::image_file::codec::{Encoding, encode};
use seamwise::image_file::encoded::ImageFormat;
use seamwise::import::read_with;
use seamwise::inspect;
use seamwise::repair::options::RepairOptions;
use seamwise::repair::repair_file;
use seamwise::report::html::evaluate_page;
use seamwise::report::pictures::Gallery;
use seamwise::report::{CandidateReport, EvaluateReport, ReferenceReport, ViewReport};
use seamwise::screen::select_level;

use crate::cli::{Common, EvaluateArgs, InspectArgs, ReadingArgs, RepairArgs, SelectArgs};

pub(crate) use bake::bake;

/// Repairs one file.
pub(crate) fn repair(args: &RepairArgs, common: Common) -> Result<usize> {
    let options = RepairOptions { memory_limit: common.memory_limit, ..args.resolve() };
    let report = repair_file(&args.input, &args.output, &options)?;
    say(common.quiet, &report.to_table())?;
    if let Some(path) = &args.json {
        write_files(&[(path.clone(), report.to_json().into_bytes())])?;
    }
    Ok(0)
}

/// Compares each candidate with the reference; one that can't be compared does not stop the
/// others. One that is compared but doubtful counts as failed.
pub(crate) fn evaluate(args: &EvaluateArgs, common: Common) -> Result<usize> {
    let mut cache = TextureCache::with_limit(common.memory_limit);
    let named = |error| anyhow!("{}: {error}", args.reference.display());
    let reference = load_reference(args, common, &mut cache).map_err(named)?;
    let options = args.resolve();
    let against = Reference::with_mode(&reference, options, args.mode()).map_err(named)?;
    let mut gallery = match &args.report {
        Some(_) => Some(Gallery::with_mode(&reference, args.mode())?),
        None => None,
    };
    let (mut candidates, mut scenes) = (Vec::new(), Vec::new());
    for path in &args.candidates {
        let compared = load_file(path, args, common, &mut cache).and_then(|scene| {
            let (metrics, views) = against.compare_by_view(&scene)?;
            if let Some(gallery) = &mut gallery {
                gallery.add(&scene)?;
            }
            let triangles = scene.triangles.len();
            if args.sheet.is_some() {
                scenes.push(scene);
            }
            Ok((triangles, metrics, views))
        });
        let candidate = CandidateReport::new(path.display().to_string(), compared);
        if let Some(complaint) = candidate.complaint() {
            eprintln!("seamwise: {}: {complaint}", path.display());
        }
        candidates.push(candidate);
    }
    let report = EvaluateReport {
        schema: 1,
        reference: ReferenceReport {
            file: args.reference.display().to_string(),
            triangles: reference.triangles.len(),
            diagonal: against.diagonal(),
        },
        mode: args.mode(),
        views: ViewReport::of(against.rig()),
        candidates,
    };
    say(common.quiet, &report.to_table())?;
    let mut files = evaluation_files(args, &report, gallery.as_ref())?;
    if let Some(path) = &args.sheet {
        let rig = Rig::around(&reference, args.sheet_views.into(), options.resolution);
        let sheet = contact_sheet(&reference, &scenes, &rig, args.mode()).into();
        files.push((path.clone(), encode(&sheet, ImageFormat::Png)?.bytes.to_vec()));
    }
    write_files(&files)?;
    if report.candidates.iter().all(|candidate| candidate.failure.is_some()) {
        bail!("nothing was compared");
    }
    Ok(report.candidates.iter().filter_map(CandidateReport::complaint).count())
}

/// The report in each of the forms that are asked for.
fn evaluation_files(
    args: &EvaluateArgs,
    report: &EvaluateReport,
    gallery: Option<&Gallery>,
) -> Result<Vec<(PathBuf, Vec<u8>)>> {
    let mut files = Vec::new();
    if let Some(path) = &args.json {
        files.push((path.clone(), report.to_json()?.into_bytes()));
    }
    if let Some(path) = &args.csv {
        files.push((path.clone(), report.to_csv()?.into_bytes()));
    }
    if let (Some(path), Some(gallery)) = (&args.report, gallery) {
        files.push((path.clone(), evaluate_page(report, gallery)?.into_bytes()));
    }
    Ok(files)
}

fn load_reference(
    args: &EvaluateArgs,
    common: Common,
    cache: &mut TextureCache,
) -> seamwise::error::Result<Scene> {
    let mut asset = read_warned(&args.reference, &args.reading, common)?;
    if args.clean_reference {
        asset.images = encode_repaired(
            &asset,
            &repair_all(&asset, common.memory_limit)?,
            Encoding::default(),
        )?;
    }
    load(&asset, cache)
}

fn load_file(
    path: &Path,
    args: &EvaluateArgs,
    common: Common,
    cache: &mut TextureCache,
) -> seamwise::error::Result<Scene> {
    load(&read_warned(path, &args.reading, common)?, cache)
}

/// Reads an asset, and warns of what is missing.
fn read_warned(
    path: &Path,
    reading: &ReadingArgs,
    common: Common,
) -> seamwise::error::Result<Asset> {
    let asset = read_with(path, reading.resolve(common))?;
    warn(common.quiet, &path.display().to_string(), &asset.missing_images());
    Ok(asset)
}

/// Says what a user may want to mend, unless they want to hear of errors alone.
fn warn(quiet: bool, input: &str, warnings: &[String]) {
    for warning in warnings.iter().filter(|_| !quiet) {
        eprintln!("seamwise: warning: {input}: {warning}");
    }
}

/// Looks an asset over.
pub(crate) fn inspect(args: &InspectArgs, common: Common) -> Result<usize> {
    let found = read_warned(&args.input, &args.reading, common)
        .and_then(|asset| inspect::inspect(&asset, common.memory_limit, args.footprint.resolve()))
        .map_err(|error| anyhow!("{}: {error}", args.input.display()))?;
    say(common.quiet, &if args.json { found.to_json()? } else { found.to_text() })?;
    Ok(0)
}

/// Answers which level to show at a size on screen: 0 is the source.
pub(crate) fn select(args: &SelectArgs) -> Result<usize> {
    let named = |what: String| anyhow!("{}: {what}", args.report.display());
    let text = std::fs::read_to_string(&args.report).map_err(|error| named(error.to_string()))?;
    let sizes = largest_sizes(&text).map_err(|error| named(error.to_string()))?;
    say(false, &format!("{}\n", select_level(&sizes, args.pixels)))?;
    Ok(0)
}

/// Prints a result, unless the user wants none. A reader that has gone away is no failure.
fn say(quiet: bool, text: &str) -> Result<()> {
    if quiet {
        return Ok(());
    }
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}
