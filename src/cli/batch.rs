//! Arguments of `seamwise bake` for many inputs.

use std::path::PathBuf;

use clap::Args;

use seamwise::batch::{BatchOptions, Shard};

/// Options of `seamwise bake` for many inputs.
#[derive(Debug, Args)]
#[command(next_help_heading = "Many inputs")]
pub(crate) struct BatchArgs {
    /// Inputs to bake at a time. Each is held in memory with all its levels; the threads are shared,
    /// and the files are the same at any number [default: 1 for a single input, else as many as
    /// threads, up to 4].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Skip inputs whose outputs are all there, made by this version with these options from an input
    /// with these bytes, the files that it names included.
    #[arg(long)]
    resume: bool,
    /// Bake the I-th of N parts of the inputs: each is in exactly one. For a cluster's array jobs.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Write what became of each input as JSON.
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
}

/// Most inputs that are baked at a time unless the user says so: they fill each other's gaps, and
/// more only take memory.
const MOST_JOBS: usize = 4;

impl BatchArgs {
    /// The part of the inputs that is baked.
    pub(crate) fn shard(&self) -> Shard {
        self.shard.unwrap_or_default()
    }

    /// The options that these arguments give on a machine of so many threads.
    pub(crate) fn resolve(&self, threads: usize) -> BatchOptions {
        let jobs = self.jobs.map_or(threads.min(MOST_JOBS), usize::from);
        BatchOptions { jobs, resume: self.resume }
    }
}
