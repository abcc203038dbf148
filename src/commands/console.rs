//! Input and messages that several subcommands share.

use std::io::Write;
use std::path::Path;

use anyhow::Result;

use seamwise::document::asset::Asset;
use seamwise::import::read_with;
use seamwise::warning::Warnings;

use crate::cli::{Common, ReadingArgs};

/// Prints a result, unless the user wants none. A reader that has gone away is no failure.
pub(crate) fn say(quiet: bool, text: &str) -> Result<()> {
    if quiet {
        return Ok(());
    }
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// Prints warnings, unless the user wants errors alone.
pub(crate) fn warn(quiet: bool, input: &Path, warnings: &Warnings) {
    for warning in warnings.iter().filter(|_| !quiet) {
        eprintln!("seamwise: warning: {}: {warning}", input.display());
    }
}

/// Reads an asset, and warns of what was left out, guessed or mended.
pub(crate) fn read_warned(
    path: &Path,
    reading: &ReadingArgs,
    common: Common,
) -> seamwise::error::Result<Asset> {
    let asset = read_with(path, reading.resolve(common))?;
    warn(common.quiet, path, &asset.warnings);
    Ok(asset)
}
