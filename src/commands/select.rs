//! Selection of the level to show at a size on screen.

use anyhow::Result;

use seamwise::error::Error;
use seamwise::export::certificate::largest_sizes;
use seamwise::screen::select_level;

use super::console::say;
use crate::cli::SelectArgs;

/// Answers which level to show at a size on screen: 0 is the source.
pub(crate) fn select(args: &SelectArgs) -> Result<usize> {
    let path = &args.report;
    let sizes = read_report(args).and_then(|text| largest_sizes(&text));
    let sizes = sizes.map_err(|error| error.in_file(path))?;
    say(false, &format!("{}\n", select_level(&sizes, args.pixels)))?;
    Ok(0)
}

const MODEL: &str = "a model, not the report of a bake: name the <stem>.json beside its levels";

/// The text of a report; anything else is refused with advice.
fn read_report(args: &SelectArgs) -> seamwise::error::Result<String> {
    let path = &args.report;
    let refused = |what: &str| Err(Error::Kind { what: what.into() });
    if path.is_dir() {
        return refused("a folder: name the report of a bake in it, <stem>.json");
    }
    let bytes = std::fs::read(path).map_err(|source| Error::Io { path: path.clone(), source })?;
    let is_glb = bytes.starts_with(b"glTF");
    let text = String::from_utf8(bytes).unwrap_or_default();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    if json["levels"].is_array() {
        return Ok(text);
    }
    if is_glb || json.get("asset").is_some() {
        return refused(MODEL);
    }
    refused("not the report of a bake: that is the <stem>.json beside its levels")
}
