//! The repair of a file.

use anyhow::Result;

use seamwise::export::disk::write_files;
use seamwise::repair::repair_file;

use super::console::{say, warn};
use crate::cli::{Common, RepairArgs};

/// Repairs one file.
pub(crate) fn repair(args: &RepairArgs, common: Common) -> Result<usize> {
    let options = args.resolve(common);
    let report = repair_file(&args.input, &args.output, &options)?;
    warn(common.quiet, &args.input, &report.warnings);
    say(common.quiet, &report.to_table())?;
    if let Some(path) = &args.json {
        write_files(&[(path.clone(), report.to_json().into_bytes())])?;
    }
    Ok(0)
}
