//! Extraction of a level from a progressive file.

use std::path::Path;

use anyhow::Result;

use seamwise::error::Error;
use seamwise::export::disk::{refuse_overwriting, write_files};
use seamwise::export::glb::to_glb;
use seamwise::export::progressive::extract::{Extracted, extract as extract_level, triangles};
use seamwise::import::options::ReadOptions;

use super::console::{check_files, read_stdin, say, write_stdout};
use crate::cli::{Common, ExtractArgs, is_dash};

/// Writes a level, and says which it is.
pub(crate) fn extract(args: &ExtractArgs, common: Common) -> Result<usize> {
    let (input, output) = (&args.input, &args.output);
    check_files([output])?;
    if !is_dash(input) && !is_dash(output) {
        refuse_overwriting(input, std::slice::from_ref(output))?;
    }
    let bytes = if is_dash(input) { read_stdin(common)? } else { read(input)? };
    let options = ReadOptions {
        memory_limit: common.memory_limit,
        strict: common.strict,
        ..ReadOptions::default()
    };
    let level = triangles(&bytes)
        .and_then(|[_, source]| extract_level(&bytes, args.fineness(source), options))
        .map_err(|error| error.in_file(input))?;
    let Extracted { triangles, finest, error, missed, .. } = &level;
    if let Some(missed) = missed.filter(|_| !common.quiet) {
        eprintln!(
            "seamwise: warning: {}: {missed}: a level of {triangles} triangles",
            input.display()
        );
    }
    let file = to_glb(&level.asset)?;
    if is_dash(output) {
        write_stdout(&file)?;
        return Ok(0);
    }
    write_files(&[(output.clone(), file)])?;
    let share = 100.0 * *triangles as f64 / (*finest).max(1) as f64;
    say(
        common.quiet,
        &format!(
            "{triangles} of {finest} triangles, {share:.1} %, error {error:.3e} in units of the meshes\n"
        ),
    )?;
    Ok(0)
}

fn read(path: &Path) -> seamwise::error::Result<Vec<u8>> {
    std::fs::read(path).map_err(|source| Error::Io { path: path.to_owned(), source })
}
