//! The subcommands. Each returns how many of its inputs failed.

use std::io::Write;
use std::path::Path;

use anyhow::{Result, anyhow, bail};

use seamwise::bake::{self, Input};
use seamwise::evaluate::Reference;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::progress::Progress;
use seamwise::read::read;
use seamwise::repair::repair_file;
use seamwise::report::{CandidateReport, EvaluateReport, ReferenceReport};
use seamwise::write::write_files;

use crate::cli::{BakeArgs, EvaluateArgs, RepairArgs};

/// Bakes each input; one that fails does not stop the others.
pub(crate) fn bake(args: &BakeArgs, quiet: bool, progress: &Progress) -> Result<usize> {
    let options = args.resolve()?;
    let sample = [Input::Bytes(include_bytes!("../data/sample.glb"), "sample")];
    let files: Vec<Input<'_>> = args.inputs.iter().map(|path| Input::File(path)).collect();
    let inputs = if files.is_empty() { sample.as_slice() } else { files.as_slice() };
    let stems: Vec<String> = inputs.iter().map(Input::stem).collect();
    if let Some(twice) = stems.iter().enumerate().find(|(i, stem)| stems[..*i].contains(stem)) {
        bail!("two inputs are called {}: their outputs would overwrite each other", twice.1);
    }
    let mut failed = 0;
    for (input, stem) in inputs.iter().zip(&stems) {
        match bake::bake(*input, &args.output, &options, progress) {
            Ok(report) => say(quiet, &format!("{stem}\n{}", report.to_table()))?,
            Err(error) => {
                failed += 1;
                eprintln!("seamwise: {}: {error}", name(*input));
            }
        }
    }
    if failed == inputs.len() {
        bail!("nothing was baked");
    }
    Ok(failed)
}

fn name(input: Input<'_>) -> String {
    match input {
        Input::File(path) => path.display().to_string(),
        Input::Bytes(_, name) => name.to_owned(),
    }
}

/// Repairs one file.
pub(crate) fn repair(args: &RepairArgs, quiet: bool) -> Result<usize> {
    let report = repair_file(&args.input, &args.output, &args.resolve())?;
    say(quiet, &report.to_table())?;
    Ok(0)
}

/// Compares each candidate with the reference; one that can't be compared does not stop the
/// others.
pub(crate) fn evaluate(args: &EvaluateArgs, quiet: bool) -> Result<usize> {
    let mut cache = TextureCache::default();
    let named = |path: &Path, error| anyhow!("{}: {error}", path.display());
    let reference = read(&args.reference)
        .and_then(|asset| load(&asset, &mut cache))
        .map_err(|error| named(&args.reference, error))?;
    let against = Reference::new(&reference, args.resolve())
        .map_err(|error| named(&args.reference, error))?;
    let candidates: Vec<CandidateReport> =
        args.candidates.iter().map(|path| compare(path, &against, &mut cache)).collect();
    for candidate in &candidates {
        if let Some(failure) = &candidate.failure {
            eprintln!("seamwise: {}: {failure}", candidate.file);
        }
    }
    let failed = candidates.iter().filter(|candidate| candidate.failure.is_some()).count();
    let report = EvaluateReport {
        schema: 1,
        reference: ReferenceReport {
            file: args.reference.display().to_string(),
            triangles: reference.triangles.len(),
            diagonal: against.diagonal(),
        },
        candidates,
    };
    say(quiet, &report.to_table())?;
    if let Some(path) = &args.json {
        write_files(&[(path.clone(), report.to_json()?.into_bytes())])?;
    }
    if failed == args.candidates.len() {
        bail!("nothing was compared");
    }
    Ok(failed)
}

fn compare(path: &Path, reference: &Reference<'_>, cache: &mut TextureCache) -> CandidateReport {
    let mut triangles = 0;
    let metrics = read(path).and_then(|asset| {
        let scene = load(&asset, cache)?;
        triangles = scene.triangles.len();
        reference.compare(&scene)
    });
    CandidateReport {
        file: path.display().to_string(),
        triangles,
        failure: metrics.as_ref().err().map(ToString::to_string),
        metrics: metrics.ok(),
    }
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
