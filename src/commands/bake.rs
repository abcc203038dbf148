//! `seamwise bake`: one input, or many with a summary and a list of failures.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Result, bail};

use seamwise::bake::options::BakeOptions;
use seamwise::bake::{self, Input};
use seamwise::batch::{self, Done, Job, Outcome, find_jobs, name_apart};
use seamwise::export::disk::{check_folder, write_files};
use seamwise::progress::Progress;

use super::bake_report::{BatchReport, line, table};
use super::bars::Bars;
use super::console::{check_files, read_stdin, say, warn, width, write_stdout};
use super::report::write_page;
use crate::cli::{BakeArgs, Common, Source, Target, is_dash};

/// The sample asset.
const SAMPLE: &[u8] = include_bytes!("../../data/sample.glb");

/// Bakes each input; one that fails does not stop the others. Tells how many failed.
pub(crate) fn bake(args: &BakeArgs, common: Common) -> Result<usize> {
    let source = args.source()?;
    let options = args.resolve(common)?;
    let target = args.target(&options)?;
    check_files(args.places.json.iter())?;
    match (source, target) {
        (Source::Paths(paths), Target::Folder(folder)) if args.page().is_none() => {
            let jobs = Jobs::find(&paths, &folder, options)?;
            if args.places.dry_run { jobs.tell(args, common) } else { jobs.bake(args, common) }
        }
        (source, target) => Single { source: &source, target, options }.bake(args, common),
    }
}

fn progress(bars: &Bars, common: Common) -> Progress {
    if common.quiet { Progress::hidden() } else { Progress::new(Arc::new(bars.clone())) }
}

/// Files, each with its outputs in a folder.
struct Jobs {
    jobs: Vec<Job>,
    options: BakeOptions,
}

impl Jobs {
    fn find(paths: &[PathBuf], folder: &Path, mut options: BakeOptions) -> Result<Self> {
        let mut jobs = find_jobs(paths, folder)?;
        name_apart(&mut jobs, &options)?;
        let folders: BTreeSet<&PathBuf> = jobs.iter().map(|job| &job.folder).collect();
        folders.into_iter().try_for_each(|folder| check_folder(folder))?;
        // Among others there is something to write, and a batch is whole.
        options.allow_empty = jobs.len() > 1;
        Ok(Self { jobs, options })
    }

    fn bake(self, args: &BakeArgs, common: Common) -> Result<usize> {
        let Self { jobs, options } = self;
        let (is_single, jobs) = (jobs.len() == 1, args.batch.shard().take(jobs));
        let mut how = args.batch.resolve(rayon::current_num_threads());
        if options.report.is_some_and(|page| page.threads) {
            // What is timed has the machine to itself.
            how.jobs = 1;
        }
        let bars = Bars::terminal();
        // Standard output is either for people or for a program.
        let quiet = common.quiet || args.tells_json();
        let done = batch::run(&jobs, &options, how, &progress(&bars, common), |job, done| {
            bars.suspend(|| tell(job, done, is_single, Common { quiet, ..common }));
        });
        let report = BatchReport::of_jobs(&jobs, &done);
        report.write(args.places.json.as_deref())?;
        if let (true, Some(failure)) = (is_single, report.failure()) {
            bail!("{failure}");
        }
        if !is_single {
            say(quiet, &report.summary())?;
        }
        if !is_single && options.report.is_some() {
            let text = write_models(&jobs, &done)?;
            say(quiet, &text)?;
        }
        eprint!("{}", report.failures());
        if report.failed > 0 && report.failed == jobs.len() {
            bail!("nothing was baked");
        }
        Ok(report.failed)
    }

    /// Says what a bake would do.
    fn tell(self, args: &BakeArgs, common: Common) -> Result<usize> {
        let Self { jobs, options } = self;
        let jobs = args.batch.shard().take(jobs);
        let resumes = args.batch.resolve(1).resume;
        let (mut missing, mut skipped) = (0, 0);
        for job in &jobs {
            let input = job.input.display();
            let text = if !job.input.is_file() {
                missing += 1;
                format!("{input}: there is no such file\n")
            } else if resumes && job.is_done(&options) {
                skipped += 1;
                format!("{input}: there already\n")
            } else {
                let outputs = job.outputs(&options);
                let outputs = outputs.iter().map(|path| format!("  {}\n", path.display()));
                format!("{input}\n{}", outputs.collect::<String>())
            };
            say(common.quiet, &text)?;
        }
        let (all, levels) = (jobs.len() - missing - skipped, options.targets.count());
        let text = format!(
            "would bake {all} of {} inputs, {levels} levels each ({}); nothing was written\n",
            jobs.len(),
            options.targets
        );
        say(common.quiet, &text)?;
        Ok(missing)
    }
}

/// The page of all models of a batch, in the folder that holds all of their outputs; tells where it is.
fn write_models(jobs: &[Job], done: &[Done]) -> Result<String> {
    let made =
        jobs.iter().zip(done).filter(|(_, done)| !matches!(done.outcome, Outcome::Failed(_)));
    let reports: Vec<PathBuf> =
        made.map(|(job, _)| job.folder.join(format!("{}.json", job.name))).collect();
    let Some(mut folder) = jobs.first().map(|job| job.folder.as_path()) else {
        return Ok(String::new());
    };
    while let (false, Some(parent)) =
        (jobs.iter().all(|job| job.folder.starts_with(folder)), folder.parent())
    {
        folder = parent;
    }
    if reports.is_empty() || jobs.iter().any(|job| job.name == MODELS) {
        return Ok(String::new());
    }
    let page = folder.join(format!("{MODELS}.html"));
    write_page(&reports, &page)?;
    Ok(format!("all of them in {}\n", page.display()))
}

/// The name of the page of a batch.
const MODELS: &str = "models";

/// Prints the outcome of an input that did not fail. Failures are printed together, at the end.
fn tell(job: &Job, done: &Done, is_single: bool, common: Common) {
    let text = match &done.outcome {
        Outcome::Baked(report) => {
            warn(common.quiet, &job.input, &report.warnings);
            if is_single {
                table(&job.input, &job.folder, report, width())
            } else {
                line(job, report, done.seconds)
            }
        }
        Outcome::Skipped => format!("{}: there already\n", job.input.display()),
        Outcome::Failed(_) => return,
    };
    // A full disk behind standard output must not stop a batch whose files are written.
    if let Err(error) = say(common.quiet, &text) {
        eprintln!("seamwise: standard output: {error}");
    }
}

/// One input that is no file, or one output that is no folder, or a page in a place of its own.
struct Single<'a> {
    source: &'a Source,
    target: Target,
    options: BakeOptions,
}

impl Single<'_> {
    fn bake(self, args: &BakeArgs, common: Common) -> Result<usize> {
        let bytes = match self.source {
            Source::Stdin if !args.places.dry_run => read_stdin(common)?,
            _ => Vec::new(),
        };
        let (input, path) = match self.source {
            Source::Sample => (Input::Bytes(SAMPLE, "sample"), PathBuf::from("the sample")),
            Source::Stdin => (Input::Bytes(&bytes, "stdin"), PathBuf::from("standard input")),
            Source::Paths(paths) => match &paths[..] {
                [path] if !path.is_dir() => (Input::File(path), path.clone()),
                _ => bail!(
                    "several inputs need a folder for their outputs, and a page each: give -o DIR"
                ),
            },
        };
        if args.batch.is_given() {
            bail!("--manifest, --resume and --shard are for files, with their outputs in a folder");
        }
        check_files(self.outputs(input, args).iter())?;
        if args.places.dry_run {
            let outputs = self.outputs(input, args);
            let outputs = outputs.iter().map(|output| format!("  {}\n", output.display()));
            let text = format!("{}\n{}", path.display(), outputs.collect::<String>());
            say(common.quiet, &(text + "nothing was written\n"))?;
            return Ok(0);
        }
        let (bars, start) = (Bars::terminal(), Instant::now());
        let run = |progress: &Progress| self.run(input, args, progress);
        let done = progress(&bars, common).file(&path.display().to_string(), run);
        let seconds = start.elapsed().as_secs_f64();
        let written = self.outputs(input, args);
        BatchReport::of_one(&path, &written, &done, seconds).write(args.places.json.as_deref())?;
        let report = done.map_err(|error| error.in_file(&path))?;
        warn(common.quiet, &path, &report.warnings);
        let to = match &self.target {
            Target::Folder(to) | Target::File(to) => to.clone(),
            Target::Stdout => "standard output".into(),
        };
        let text = table(&path, &to, &report, width());
        match self.target {
            Target::Stdout if !common.quiet => eprint!("{text}"),
            _ => say(common.quiet || args.tells_json(), &text)?,
        }
        Ok(0)
    }

    /// The files that are written, `-` for standard output.
    fn outputs(&self, input: Input<'_>, args: &BakeArgs) -> Vec<PathBuf> {
        let mut outputs = match &self.target {
            Target::Folder(folder) => input.outputs(folder, &self.options),
            Target::File(file) => vec![file.clone()],
            Target::Stdout => vec!["-".into()],
        };
        outputs.extend(args.page().map(Into::into));
        outputs
    }

    fn run(
        &self,
        input: Input<'_>,
        args: &BakeArgs,
        progress: &Progress,
    ) -> seamwise::error::Result<seamwise::report::BakeReport> {
        let outputs = self.outputs(input, args);
        input.refuse_overwriting(&outputs)?;
        let baked = bake::bake_in_memory(input, &self.options, progress)?;
        let mut report = baked.report.clone();
        match &self.target {
            Target::Folder(folder) => report.removed = baked.write(folder)?,
            Target::File(file) => baked.write_level(file)?,
            Target::Stdout => write_stdout(baked.level()?)?,
        }
        if let (Some(path), Some(page)) = (args.page(), &baked.page) {
            write_files(&[(path.to_owned(), &page.bytes[..])])?;
        }
        if !matches!(self.target, Target::Folder(_)) {
            // Their names are those that they would have in a folder.
            report.files.clear();
        }
        Ok(report)
    }
}

impl BakeArgs {
    /// Whether standard output is for JSON.
    fn tells_json(&self) -> bool {
        self.places.json.as_deref().is_some_and(is_dash)
    }
}
