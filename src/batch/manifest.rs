//! Inputs from a list.

use std::path::PathBuf;

/// Reads the inputs that a list names, one in each line, as they would be typed. Empty lines and those
/// that begin with `#` name none.
///
/// ```
/// let list = "# ships\nin/sloop.glb\r\n\n  in/brig one.obj\n";
/// let inputs = seamwise::batch::parse_manifest(list);
/// assert_eq!(inputs, ["in/sloop.glb", "in/brig one.obj"].map(std::path::PathBuf::from));
/// ```
pub fn parse_manifest(text: &str) -> Vec<PathBuf> {
    // A byte order mark, as editors on Windows write it.
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    lines.filter(|line| !line.is_empty() && !line.starts_with('#')).map(PathBuf::from).collect()
}
