//! Many inputs, baked some at a time.
//!
//! The outputs of one input do not depend on the others, nor on how many are baked at a time: they
//! are the same. All of them share the threads that do the work inside a bake, so that more at a
//! time fill the gaps where a single one idles at its own last part, and take more memory.

mod find;
mod job;
mod manifest;
mod shard;

use std::any::Any;
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use crate::bake::bake;
use crate::bake::options::BakeOptions;
use crate::error::{Error, Result};
use crate::export::disk;
use crate::progress::Progress;
use crate::report::BakeReport;

pub use find::find_jobs;
pub use job::Job;
pub use manifest::parse_manifest;
pub use shard::Shard;

/// Removes what runs that were killed left unnamed where the outputs go.
fn remove_leftovers(jobs: &[Job]) {
    let textures = |job: &Job| {
        let name = format!("{}_textures", job.name);
        job.folder.join(name)
    };
    let folders: BTreeSet<PathBuf> =
        jobs.iter().flat_map(|job| [job.folder.clone(), textures(job)]).collect();
    folders.iter().for_each(|folder| disk::remove_leftovers(folder));
}

/// Options of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BatchOptions {
    /// Number of inputs that are baked at a time.
    pub jobs: usize,
    /// Whether inputs are skipped whose outputs are there already.
    pub resume: bool,
}

/// The outcome of an input.
#[derive(Debug)]
pub enum Outcome {
    /// Baked, with its report.
    Baked(Box<BakeReport>),
    /// Skipped, as its outputs were there already.
    Skipped,
    /// Not baked, for this error.
    Failed(Error),
}

/// The outcome of an input, and the time that it took.
#[derive(Debug)]
pub struct Done {
    /// The outcome.
    pub outcome: Outcome,
    /// Wall time in seconds.
    pub seconds: f64,
}

/// Names the outputs of inputs apart that have one stem, as `<stem>.ply_lod1.glb`: the first keeps the
/// stem. Makes sure that no output of a batch overwrites another or an input.
///
/// # Errors
/// [`Error::Options`] with the names of both.
pub fn name_apart(jobs: &mut [Job], options: &BakeOptions) -> Result<()> {
    let mut writers: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for at in 0..jobs.len() {
        let job = &jobs[at];
        let taken = |job: &Job| {
            job.outputs(options).into_iter().find_map(|path| Some((*writers.get(&path)?, path)))
        };
        if let Some((other, path)) = taken(job) {
            let whole = job.input.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let renamed = Job { name: whole, ..job.clone() };
            let is_same =
                there(&job.input).is_some_and(|own| Some(own) == there(&jobs[other].input));
            if is_same || taken(&renamed).is_some() {
                let what = format!(
                    "{} and {} would both write {}: bake them into two folders",
                    jobs[other].input.display(),
                    job.input.display(),
                    path.display()
                );
                return Err(Error::Options { what });
            }
            jobs[at] = renamed;
        }
        writers.extend(jobs[at].outputs(options).into_iter().map(|path| (path, at)));
    }
    let written: BTreeSet<_> = writers.keys().filter_map(|path| there(path)).collect();
    let overwritten = |job: &&Job| there(&job.input).is_some_and(|own| written.contains(&own));
    match jobs.iter().find(overwritten) {
        Some(Job { input, .. }) => {
            let what = format!("{} would be overwritten: choose another output", input.display());
            Err(Error::Options { what })
        }
        None => Ok(()),
    }
}

/// A file under the one name that it has for certain, if it is there.
fn there(path: &Path) -> Option<PathBuf> {
    path.canonicalize().ok()
}

/// Bakes each input, several at a time; one that fails does not stop the others. `on_done` is
/// called with each as it ends. The outcomes are in the order of `jobs`.
pub fn run(
    jobs: &[Job],
    options: &BakeOptions,
    batch: BatchOptions,
    progress: &Progress,
    on_done: impl Fn(&Job, &Done) + Sync,
) -> Vec<Done> {
    remove_leftovers(jobs);
    let next = AtomicUsize::new(0);
    let ended = Mutex::new(Vec::with_capacity(jobs.len()));
    // A single input shows its own stages.
    let shown = if jobs.len() > 1 { progress.clone() } else { Progress::hidden() };
    shown.stage("batch", jobs.len(), |count| {
        let work = || {
            while let Some((at, job)) = take(jobs, &next) {
                let done = run_job(job, options, batch.resume, progress);
                on_done(job, &done);
                count.fetch_add(1, Ordering::Relaxed);
                ended.lock().unwrap_or_else(PoisonError::into_inner).push((at, done));
            }
        };
        std::thread::scope(|scope| {
            for _ in 0..batch.jobs.clamp(1, jobs.len().max(1)) {
                scope.spawn(work);
            }
        });
    });
    let mut ended = ended.into_inner().unwrap_or_else(PoisonError::into_inner);
    ended.sort_by_key(|(at, _)| *at);
    ended.into_iter().map(|(_, done)| done).collect()
}

/// The next job, if one is left.
fn take<'a>(jobs: &'a [Job], next: &AtomicUsize) -> Option<(usize, &'a Job)> {
    let at = next.fetch_add(1, Ordering::Relaxed);
    jobs.get(at).map(|job| (at, job))
}

/// The message of a panic.
fn message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    format!("a panic: {}", text.unwrap_or("without a word"))
}

fn run_job(job: &Job, options: &BakeOptions, resume: bool, progress: &Progress) -> Done {
    let start = Instant::now();
    let outcome = if resume && job.is_done(options) {
        Outcome::Skipped
    } else {
        let name = job.input.file_name().unwrap_or_default().to_string_lossy();
        let run = |progress: &Progress| bake(job.source(), &job.folder, options, progress);
        // A mistake of ours that one input brings to light must not cost the others a night.
        let caught = catch_unwind(AssertUnwindSafe(|| progress.file(&name, run)));
        match caught {
            Ok(Ok(report)) => Outcome::Baked(Box::new(report)),
            Ok(Err(error)) => Outcome::Failed(error),
            Err(panic) => Outcome::Failed(Error::Internal { what: message(&*panic) }),
        }
    };
    Done { outcome, seconds: start.elapsed().as_secs_f64() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::files::Layout;

    #[test]
    fn inputs_of_one_stem_are_named_apart_and_one_that_is_named_twice_is_not() {
        let root = tempfile::tempdir().unwrap();
        let jobs = |names: &[&str]| -> Vec<Job> {
            let job = |name: &&str| Job::new("out".into(), root.path().join(name));
            names.iter().map(job).collect()
        };
        let names = |own: &[&str]| -> Result<Vec<String>> {
            let mut jobs = jobs(own);
            let mut options = BakeOptions::default();
            options.output.layout = Layout::MsftLod;
            name_apart(&mut jobs, &options)?;
            Ok(jobs.into_iter().map(|job| job.name).collect())
        };
        assert_eq!(names(&["a.glb", "a.ply", "b.ply"]).unwrap(), ["a", "a.ply", "b"]);
        assert_eq!(names(&["a.glb", "a_lod1.glb"]).unwrap(), ["a", "a_lod1.glb"]);
        assert_eq!(names(&["a.glb", "a.gltf", "a.obj"]).unwrap(), ["a", "a.gltf", "a.obj"]);
        std::fs::write(root.path().join("a.glb"), b"").unwrap();
        assert!(names(&["a.glb", "a.glb"]).unwrap_err().to_string().contains("both write"));
        assert!(names(&["a.glb", "x/a.glb", "y/a.glb"]).is_err(), "a whole name may be taken too");
    }

    #[test]
    fn a_panic_is_quoted() {
        let quoted = |panic: fn()| message(&*catch_unwind(panic).unwrap_err());
        assert_eq!(quoted(|| panic!("plain")), "a panic: plain");
        assert_eq!(quoted(|| panic!("number {}", std::hint::black_box(7))), "a panic: number 7");
        assert_eq!(quoted(|| std::panic::panic_any(7)), "a panic: without a word");
    }
}
