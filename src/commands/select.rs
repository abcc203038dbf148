//! Selection of the level to show at a size on screen.

use anyhow::{Result, anyhow};

use seamwise::export::certificate::largest_sizes;
use seamwise::screen::select_level;

use super::console::say;
use crate::cli::SelectArgs;

/// Answers which level to show at a size on screen: 0 is the source.
pub(crate) fn select(args: &SelectArgs) -> Result<usize> {
    let named = |what: String| anyhow!("{}: {what}", args.report.display());
    let text = std::fs::read_to_string(&args.report).map_err(|error| named(error.to_string()))?;
    let sizes = largest_sizes(&text).map_err(|error| named(error.to_string()))?;
    say(false, &format!("{}\n", select_level(&sizes, args.pixels)))?;
    Ok(0)
}
