//! A look at an asset.

use anyhow::{Result, anyhow};

use seamwise::inspect;

use super::console::{read_warned, say};
use crate::cli::{Common, InspectArgs};

/// Inspects an asset.
pub(crate) fn inspect(args: &InspectArgs, common: Common) -> Result<usize> {
    let found = read_warned(&args.input, &args.reading, common)
        .and_then(|asset| inspect::inspect(&asset, common.memory_limit, args.footprint.resolve()))
        .map_err(|error| anyhow!("{}: {error}", args.input.display()))?;
    say(common.quiet, &if args.json { found.to_json()? } else { found.to_text() })?;
    Ok(0)
}
