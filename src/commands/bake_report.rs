//! The outcome of a bake and of a batch: lines for people, JSON for programs.

use std::path::{Path, PathBuf};

use anyhow::Result;
use serde::Serialize;

use seamwise::batch::{Done, Job, Outcome};
use seamwise::report::BakeReport;
use seamwise::warning::Warnings;

use super::console::write_text;

/// The report of a batch, in schema 1.
#[derive(Debug, Serialize)]
pub(super) struct BatchReport {
    schema: u32,
    baked: usize,
    skipped: usize,
    pub(super) failed: usize,
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
    /// Files that were written, the report of the bake last; none if it was skipped or failed.
    files: Vec<String>,
    /// Warnings: things left out, guessed or mended.
    warnings: Warnings,
    seconds: f64,
}

impl BatchReport {
    pub(super) fn of_jobs(jobs: &[Job], done: &[Done]) -> Self {
        let input = |(job, done): (&Job, &Done)| {
            let (outcome, reason) = match &done.outcome {
                Outcome::Baked(_) => ("baked", None),
                Outcome::Skipped => ("skipped", None),
                Outcome::Failed(error) => ("failed", Some(error.to_string())),
            };
            let (files, warnings) = match &done.outcome {
                Outcome::Baked(report) => (files(job, report), report.warnings.clone()),
                Outcome::Skipped | Outcome::Failed(_) => (Vec::new(), Warnings::default()),
            };
            InputReport {
                input: job.input.display().to_string(),
                folder: job.folder.display().to_string(),
                outcome,
                reason,
                files,
                warnings,
                seconds: done.seconds,
            }
        };
        Self::new(jobs.iter().zip(done).map(input).collect())
    }

    /// The report of a bake of one input with these outputs.
    pub(super) fn of_one(
        input: &Path,
        outputs: &[PathBuf],
        done: &seamwise::error::Result<BakeReport>,
        seconds: f64,
    ) -> Self {
        let folder = outputs.first().and_then(|path| path.parent()).unwrap_or(Path::new(""));
        let report = done.as_ref().ok();
        let written = outputs.iter().filter(|_| report.is_some());
        Self::new(vec![InputReport {
            input: input.display().to_string(),
            folder: folder.display().to_string(),
            outcome: if done.is_ok() { "baked" } else { "failed" },
            reason: done.as_ref().err().map(ToString::to_string),
            files: written.map(|path| path.display().to_string()).collect(),
            warnings: report.map(|own| own.warnings.clone()).unwrap_or_default(),
            seconds,
        }])
    }

    fn new(inputs: Vec<InputReport>) -> Self {
        let count = |what| inputs.iter().filter(|input| input.outcome == what).count();
        let (baked, skipped, failed) = (count("baked"), count("skipped"), count("failed"));
        Self { schema: 1, baked, skipped, failed, inputs }
    }

    /// Writes it as JSON, if that is asked for.
    pub(super) fn write(&self, path: Option<&Path>) -> Result<()> {
        let Some(path) = path else { return Ok(()) };
        write_text(path, serde_json::to_string_pretty(self)? + "\n")
    }

    pub(super) fn summary(&self) -> String {
        format!("{} baked, {} skipped, {} failed\n", self.baked, self.skipped, self.failed)
    }

    /// The first input that failed, with the reason.
    pub(super) fn failure(&self) -> Option<String> {
        self.inputs
            .iter()
            .find_map(|input| Some(format!("{}: {}", input.input, input.bare_reason()?)))
    }

    /// A line for each input that failed, with the reason.
    pub(super) fn failures(&self) -> String {
        let failed = || self.inputs.iter().filter_map(|input| Some((input, input.bare_reason()?)));
        let width = failed().map(|(input, _)| input.input.chars().count()).max().unwrap_or(0);
        let lines = failed().map(|(InputReport { input, .. }, reason)| {
            format!("seamwise:   {input:width$}  {}\n", reason.replace('\n', " "))
        });
        let lines: String = lines.collect();
        if lines.is_empty() {
            return lines;
        }
        format!("seamwise: {} of {} inputs failed:\n{lines}", self.failed, self.inputs.len())
    }
}

impl InputReport {
    /// The reason why it failed, without its name, which is a part of what some errors say.
    fn bare_reason(&self) -> Option<&str> {
        let reason = self.reason.as_deref()?;
        Some(reason.strip_prefix(&format!("{}: ", self.input)).unwrap_or(reason))
    }
}

fn files(job: &Job, report: &BakeReport) -> Vec<String> {
    let names = report.files.iter().cloned().chain([format!("{}.json", job.name)]);
    names.map(|name| job.folder.join(name).display().to_string()).collect()
}

/// An input with its levels, for people.
pub(super) fn table(input: &Path, to: &Path, report: &BakeReport, width: usize) -> String {
    format!("{} → {}\n\n{}", input.display(), to.display(), report.to_text(width))
}

/// An input among others, for people.
pub(super) fn line(job: &Job, report: &BakeReport, seconds: f64) -> String {
    let levels: Vec<String> =
        report.levels.iter().map(|level| level.triangles.to_string()).collect();
    let (input, source, levels) = (job.input.display(), report.input.triangles, levels.join(", "));
    format!("{input}: {source} triangles to {levels}; {seconds:.1} s\n")
}
