//! The repair of several files: maps of one set with the same validity, and what a folder holds.

use std::path::Path;

pub use super::find::{RepairJob, RepairJobs, find_repairs};
use super::options::{Background, RepairOptions};
use super::repair_map;
use super::set::Shared;
use crate::error::Result;
use crate::report::repair::RepairReport;

/// Repairs files that belong together; what became of each, in their order. One that fails does not
/// stop the others.
///
/// Maps of a set have one background: what every map that shows one has for background. A mesh or a
/// mask that is given tells of each, at its own size.
pub fn repair_group(jobs: &[RepairJob], options: &RepairOptions) -> Vec<Result<RepairReport>> {
    let is_set = jobs.len() > 1 && options.background != Background::None;
    let maps: Vec<&Path> = jobs.iter().map(|job| job.input.as_path()).collect();
    let shared = is_set.then(|| Shared::of(&maps, options)).flatten();
    let repair = |job: &RepairJob| repair_map(&job.input, &job.output, options, shared.as_ref());
    jobs.iter().map(repair).collect()
}
