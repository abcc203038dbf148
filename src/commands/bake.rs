//! `seamwise bake`: one input, or many with a summary and a table of failures.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Result, bail};
use serde::Serialize;

use seamwise::bake::{self, Input};
use seamwise::batch::{self, Done, Job, Outcome, find_jobs, name_apart};
use seamwise::export::disk::write_files;
use seamwise::progress::Progress;
use seamwise::report::BakeReport;
use seamwise::warning::Warnings;

use super::bars::Bars;
use super::console::{say, warn};
use crate::cli::{BakeArgs, Common};

/// The report of a batch, in schema 1.
#[derive(Debug, Serialize)]
struct BatchReport {
    schema: u32,
    baked: usize,
    skipped: usize,
    failed: usize,
    inputs: Vec<InputReport>,
}

#[derive(Debug, Serialize)]
struct InputReport {
    input: String,
    folder: String,
    outcome: &'static str,
    /// The reason why it failed, if it did.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    /// Warnings: things left out, guessed or mended.
    warnings: Warnings,
    seconds: f64,
}

/// Bakes each input; one that fails does not stop the others. Tells how many failed.
pub(crate) fn bake(args: &BakeArgs, common: Common) -> Result<usize> {
    let Common { quiet, .. } = common;
    let bars = Bars::terminal();
    let progress = if quiet { Progress::hidden() } else { Progress::new(Arc::new(bars.clone())) };
    let mut options = args.resolve(common)?;
    if args.inputs.is_empty() {
        let sample = Input::Bytes(include_bytes!("../../data/sample.glb"), "sample");
        let report = bake::bake(sample, &args.output, &options, &progress)?;
        say(quiet, &table(Path::new("sample"), &report))?;
        return Ok(0);
    }
    let mut jobs = find_jobs(&args.inputs, &args.output)?;
    name_apart(&mut jobs, &options)?;
    // Among others there is something to write, and a batch is whole.
    options.allow_empty = jobs.len() > 1;
    let (single, jobs) = (jobs.len() == 1, args.batch.shard().take(jobs));
    let how = args.batch.resolve(rayon::current_num_threads());
    let done = batch::run(&jobs, &options, how, &progress, |job, done| {
        bars.suspend(|| tell(job, done, single, quiet));
    });
    let report = BatchReport::new(&jobs, &done);
    if let Some(path) = &args.batch.json {
        let json = serde_json::to_string_pretty(&report)?;
        write_files(&[(path.clone(), (json + "\n").into_bytes())])?;
    }
    if !single {
        say(quiet, &report.summary())?;
    }
    eprint!("{}", report.failures(single));
    if report.failed > 0 && report.failed == jobs.len() {
        bail!("nothing was baked");
    }
    Ok(report.failed)
}

/// Prints the outcome of an input that did not fail. Failures are printed together, at the end.
fn tell(job: &Job, done: &Done, single: bool, quiet: bool) {
    let text = match &done.outcome {
        Outcome::Baked(report) => {
            warn(quiet, &job.input, &report.warnings);
            if single { table(&job.input, report) } else { line(job, report, done.seconds) }
        }
        Outcome::Skipped => format!("{}: there already\n", job.input.display()),
        Outcome::Failed(_) => return,
    };
    // A full disk behind standard output must not stop a batch whose files are written.
    if let Err(error) = say(quiet, &text) {
        eprintln!("seamwise: standard output: {error}");
    }
}

fn table(input: &Path, report: &BakeReport) -> String {
    let stem = input.file_stem().unwrap_or(input.as_os_str()).to_string_lossy();
    format!("{stem}\n{}", report.to_table())
}

fn line(job: &Job, report: &BakeReport, seconds: f64) -> String {
    let levels: Vec<String> =
        report.levels.iter().map(|level| level.triangles.to_string()).collect();
    let (input, source, levels) = (job.input.display(), report.input.triangles, levels.join(", "));
    format!("{input}: {source} triangles to {levels}; {seconds:.1} s\n")
}

impl BatchReport {
    fn new(jobs: &[Job], done: &[Done]) -> Self {
        let input = |(job, done): (&Job, &Done)| {
            let (outcome, reason) = match &done.outcome {
                Outcome::Baked(_) => ("baked", None),
                Outcome::Skipped => ("skipped", None),
                Outcome::Failed(error) => ("failed", Some(error.to_string())),
            };
            let warnings = match &done.outcome {
                Outcome::Baked(report) => report.warnings.clone(),
                Outcome::Skipped | Outcome::Failed(_) => Warnings::default(),
            };
            InputReport {
                input: job.input.display().to_string(),
                folder: job.folder.display().to_string(),
                outcome,
                reason,
                warnings,
                seconds: done.seconds,
            }
        };
        let inputs: Vec<InputReport> = jobs.iter().zip(done).map(input).collect();
        let count = |what| inputs.iter().filter(|input| input.outcome == what).count();
        let (baked, skipped, failed) = (count("baked"), count("skipped"), count("failed"));
        Self { schema: 1, baked, skipped, failed, inputs }
    }

    fn summary(&self) -> String {
        format!("{} baked, {} skipped, {} failed\n", self.baked, self.skipped, self.failed)
    }

    /// A line for each input that failed, with the reason.
    fn failures(&self, single: bool) -> String {
        let failed =
            || self.inputs.iter().filter_map(|input| Some((input, input.reason.as_ref()?)));
        let width = failed().map(|(input, _)| input.input.chars().count()).max().unwrap_or(0);
        let lines = failed().map(|(InputReport { input, .. }, reason)| {
            // The name is a part of what the system says.
            let reason = reason.strip_prefix(&format!("{input}: ")).unwrap_or(reason);
            if single {
                format!("seamwise: {input}: {reason}\n")
            } else {
                format!("seamwise:   {input:width$}  {}\n", reason.replace('\n', " "))
            }
        });
        let lines: String = lines.collect();
        if single || lines.is_empty() {
            return lines;
        }
        format!("seamwise: {} of {} inputs failed:\n{lines}", self.failed, self.inputs.len())
    }
}
