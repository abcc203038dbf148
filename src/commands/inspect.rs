//! A look at an asset.

use anyhow::Result;

use seamwise::inspect;

use super::console::{check_files, read_warned, say, write_text};
use crate::cli::{Common, InspectArgs};

/// Inspects an asset.
pub(crate) fn inspect(args: &InspectArgs, common: Common) -> Result<usize> {
    let (input, json) = (args.input()?, args.json());
    check_files(json.map(Into::into).iter())?;
    let found = read_warned(input, &args.reading, common)
        .and_then(|asset| inspect::inspect(&asset, common.memory_limit, args.footprint.resolve()))
        .map_err(|error| error.in_file(input))?;
    match json {
        Some(path) => write_text(path, found.to_json()?)?,
        None => say(common.quiet, &found.to_text())?,
    }
    Ok(0)
}
