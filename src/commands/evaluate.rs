//! The comparison of candidates with a reference.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};

use seamwise::evaluate::Reference;
use seamwise::evaluate::camera::Rig;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::reference::ReferenceScene;
use seamwise::evaluate::scene::Scene;
use seamwise::evaluate::sheet::{Sheet, Subject};
use seamwise::export::disk::write_files;
use seamwise::image_file::codec::encode;
use seamwise::image_file::encoded::ImageFormat;
use seamwise::report::figures::{series_of, short_names};
use seamwise::report::html::evaluate_page;
use seamwise::report::pictures::Gallery;
use seamwise::report::{CandidateReport, EvaluateReport, ReferenceReport, ViewReport};
use seamwise::warning::Warnings;

use super::console::{check_files, read_warned, say, warn, width};
use crate::cli::{Common, EvaluateArgs, is_dash};

/// Compares each candidate with the reference; one that can't be compared does not stop the
/// others. One that is compared but doubtful counts as failed.
pub(crate) fn evaluate(args: &EvaluateArgs, common: Common) -> Result<usize> {
    let mut cache = TextureCache::with_limit(common.memory_limit);
    let written = [&args.json, &args.csv, &args.report, &args.sheet];
    check_files(written.into_iter().flatten())?;
    let named = |error: seamwise::error::Error| error.in_file(&args.reference);
    let (reference, mut warnings) = load_reference(args, common, &mut cache).map_err(named)?;
    let ReferenceScene { scene: reference, textures } = reference;
    let options = args.resolve();
    let against = Reference::with_mode(&reference, options, args.mode()).map_err(named)?;
    let mut doubts = Warnings::default();
    against.warn_if_unseen(&mut doubts);
    warn(common.quiet, &args.reference, &doubts);
    warnings.extend(doubts.in_file(&args.reference));
    warnings.refuse_if(common.strict)?;
    let mut gallery = match &args.report {
        Some(_) => Some(Gallery::with_mode(&reference, args.mode())?),
        None => None,
    };
    let (mut candidates, mut scenes) = (Vec::new(), Vec::new());
    for path in &args.candidates {
        let compared = load_file(path, args, common, &mut cache).and_then(|(scene, own)| {
            warnings.extend(own);
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
            textures,
        },
        mode: args.mode(),
        views: ViewReport::of(against.rig(), against.origin()),
        candidates,
        warnings,
    };
    let told_as_data = [&args.json, &args.csv].into_iter().flatten().any(|path| is_dash(path));
    let is_any_compared = report.candidates.iter().any(|candidate| candidate.failure.is_none());
    say(common.quiet || told_as_data || !is_any_compared, &report.to_text(width()))?;
    let mut files = evaluation_files(args, &report, gallery.as_ref())?;
    if let Some(path) = &args.sheet {
        files.push((path.clone(), sheet(args, &report, &reference, &scenes)?));
    }
    let (told, files): (Vec<_>, Vec<_>) = files.into_iter().partition(|(path, _)| is_dash(path));
    for (_, bytes) in told {
        say(false, &String::from_utf8_lossy(&bytes))?;
    }
    write_files(&files)?;
    if !is_any_compared {
        bail!("nothing was compared");
    }
    Ok(report.candidates.iter().filter_map(CandidateReport::complaint).count())
}

/// The reference and the candidates that were compared, as a PNG.
fn sheet(
    args: &EvaluateArgs,
    report: &EvaluateReport,
    reference: &Scene,
    scenes: &[Scene],
) -> Result<Vec<u8>> {
    let resolution = args.resolve().resolution;
    let cameras = match &args.camera[..] {
        [] => Rig::around(reference, args.sheet_views.into(), resolution).cameras,
        own => own.iter().map(|camera| camera.camera(reference.origin)).collect(),
    };
    let compared = report.candidates.iter().filter(|own| own.failure.is_none());
    let files: Vec<&str> = compared.map(|own| own.file.as_str()).collect();
    let (series, names) = (series_of(&files), short_names(&files));
    let subjects = names.iter().zip(scenes).zip(series);
    let candidates: Vec<Subject<'_>> =
        subjects.map(|((name, scene), series)| Subject { name, scene, series }).collect();
    let name = args.reference.file_name().unwrap_or_default().to_string_lossy();
    let own = Subject { name: &name, scene: reference, series: 0 };
    let (drawing, rows) = (args.drawing(), args.rows());
    let sheet = Sheet { cameras: &cameras, resolution, drawing, rows }.draw(&own, &candidates);
    Ok(encode(&sheet.into(), ImageFormat::Png)?.bytes.to_vec())
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
) -> seamwise::error::Result<(ReferenceScene, Warnings)> {
    let asset = read_warned(&args.reference, &args.reading, common)?;
    let reference = if args.reference_as_is {
        ReferenceScene::as_is(&asset, cache)?
    } else {
        ReferenceScene::cleaned(&asset, None, args.mode(), common.memory_limit, cache)?
    };
    Ok((reference, asset.warnings.in_file(&args.reference)))
}

fn load_file(
    path: &Path,
    args: &EvaluateArgs,
    common: Common,
    cache: &mut TextureCache,
) -> seamwise::error::Result<(Scene, Warnings)> {
    let asset = read_warned(path, &args.reading, common)?;
    Ok((load(&asset, cache)?, asset.warnings.in_file(path)))
}
