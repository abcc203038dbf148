//! The interactive view of a bake.

use std::path::Path;

use super::input::Input;
use super::options::BakeOptions;
use crate::document::asset::Asset;
use crate::error::Result;
use crate::export::bundle::Measured;
use crate::report::viewer::{Exhibit, Viewer};

/// Puts the source and the levels into an interactive view.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if an image is damaged or takes more memory than the
/// limit.
pub(super) fn view_all(
    asset: &Asset,
    levels: &[Asset],
    input: Input<'_>,
    options: &BakeOptions,
    measured: Option<&Measured>,
) -> Result<Viewer> {
    let names = options.output.names(&input.stem(), levels.len());
    let sizes = measured.map(Measured::sizes).unwrap_or_default();
    let path = input.path().and_then(Path::file_name);
    let file = path.map_or_else(|| input.stem(), |name| name.to_string_lossy().into_owned());
    let mut exhibits = vec![Exhibit { file: &file, asset, largest_size: None }];
    for (index, (asset, name)) in levels.iter().zip(&names).enumerate() {
        exhibits.push(Exhibit { file: name, asset, largest_size: sizes.get(index).copied() });
    }
    Viewer::new(&exhibits, options.reading.memory_limit)
}
