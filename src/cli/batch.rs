//! Arguments of `seamwise bake` for many inputs.

use std::io::read_to_string;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;

use seamwise::batch::{BatchOptions, Shard, parse_manifest};
use seamwise::error::{Error, Result};

/// Options of `seamwise bake` for many inputs.
#[derive(Debug, Args)]
#[command(next_help_heading = "Many inputs")]
pub(crate) struct BatchArgs {
    /// Read inputs from a list, one in each line; - for standard input.
    ///
    /// They are as if they were typed. Empty lines and those that begin with # are skipped.
    #[arg(long, value_name = "FILE", conflicts_with = "sample")]
    manifest: Option<PathBuf>,
    /// Skip inputs whose outputs are there, whole and up to date.
    ///
    /// That is, made by this version with these options from an input with these bytes, the files that
    /// it names included.
    #[arg(long)]
    resume: bool,
    /// Inputs to bake at a time [default: 1 for a single input, else as many as threads, up to 4].
    ///
    /// Each is held in memory with all its levels; the threads are shared, and the files are the same
    /// at any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Bake the I-th of N parts of the inputs: each is in exactly one. For a cluster's array jobs.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Give an input up after so many seconds, with nothing written.
    ///
    /// It is looked at between steps, so that an input may take longer by one.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    pub(crate) time_limit: Option<Duration>,
}

/// Most inputs that are baked at a time unless the user says so: they fill each other's gaps, and
/// more only take memory.
const MOST_JOBS: usize = 4;

impl BatchArgs {
    /// The inputs of the list, none if there is no list.
    ///
    /// # Errors
    /// [`Error::Io`] if it can't be read, [`Error::Options`] if it names none.
    pub(super) fn listed(&self) -> Result<Vec<PathBuf>> {
        let Some(path) = &self.manifest else { return Ok(Vec::new()) };
        let text = if path == Path::new("-") {
            read_to_string(std::io::stdin())
        } else {
            std::fs::read_to_string(path)
        };
        let text = text.map_err(|source| Error::Io { path: path.clone(), source })?;
        let inputs = parse_manifest(&text);
        if inputs.is_empty() {
            return Err(Error::Options { what: format!("{}: it names no input", path.display()) });
        }
        Ok(inputs)
    }

    /// The part of the inputs that is baked.
    pub(crate) fn shard(&self) -> Shard {
        self.shard.unwrap_or_default()
    }

    /// Whether several outputs are thought of, in a folder.
    pub(crate) fn is_given(&self) -> bool {
        self.resume || self.shard.is_some() || self.manifest.is_some()
    }

    /// The options that these arguments give on a machine of so many threads.
    pub(crate) fn resolve(&self, threads: usize) -> BatchOptions {
        let jobs = self.jobs.map_or(threads.min(MOST_JOBS), usize::from);
        BatchOptions { jobs, resume: self.resume }
    }
}

/// Reads a number of seconds above 0.
fn parse_seconds(text: &str) -> std::result::Result<Duration, String> {
    let seconds = text.parse().ok().filter(|seconds: &f64| *seconds > 0.0);
    let limit = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    limit.ok_or_else(|| format!("{text} is no number of seconds above 0"))
}
