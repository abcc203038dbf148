//! Input and messages that several subcommands share.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use anyhow::Result;

use seamwise::document::asset::Asset;
use seamwise::error::Error;
use seamwise::export::disk::{check_writable, write_files};
use seamwise::import::{read_bytes_of, read_with};
use seamwise::warning::Warnings;

use crate::cli::{Common, ReadingArgs, is_dash};

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

/// Reads an asset, from standard input if it is called `-`, and warns of what was left out, guessed or
/// mended.
pub(crate) fn read_warned(
    path: &Path,
    reading: &ReadingArgs,
    common: Common,
) -> seamwise::error::Result<Asset> {
    let options = reading.resolve(common);
    let asset = if is_dash(path) {
        read_bytes_of(&read_stdin(common)?, Path::new(""), options)?
    } else {
        read_with(path, options)?
    };
    warn(common.quiet, path, &asset.warnings);
    Ok(asset)
}

/// All of standard input.
pub(crate) fn read_stdin(common: Common) -> seamwise::error::Result<Vec<u8>> {
    let failed = |source| Error::Io { path: "standard input".into(), source };
    let most = common.memory_limit.bytes();
    let mut bytes = Vec::new();
    std::io::stdin().take(most.saturating_add(1)).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > most {
        let what = "standard input has more bytes than --memory-limit allows";
        return Err(Error::Options { what: what.into() });
    }
    Ok(bytes)
}

/// Writes what a program reads to a file, or to standard output if that is called `-`.
pub(crate) fn write_text(path: &Path, text: String) -> Result<()> {
    if is_dash(path) {
        return say(false, &text);
    }
    Ok(write_files(&[(path.to_owned(), text.into_bytes())])?)
}

/// Makes sure that files can be written, before the work; `-` can.
pub(crate) fn check_files<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> Result<()> {
    let paths = paths.into_iter().filter(|path| !is_dash(path)).cloned();
    Ok(check_writable(&paths.collect::<Vec<_>>())?)
}

/// The signs of a line on the terminal; elsewhere what `COLUMNS` says, or 80.
pub(crate) fn width() -> usize {
    let terminal = terminal_size::terminal_size().map(|(width, _)| usize::from(width.0));
    let told = || std::env::var("COLUMNS").ok()?.parse().ok();
    terminal.or_else(told).filter(|width| *width > 0).unwrap_or(80)
}

/// Writes a file to standard output.
pub(crate) fn write_stdout(bytes: &[u8]) -> seamwise::error::Result<()> {
    let mut out = std::io::stdout().lock();
    let written = out.write_all(bytes).and_then(|()| out.flush());
    written.map_err(|source| Error::Io { path: "standard output".into(), source })
}
