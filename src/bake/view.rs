//! The interactive view of a bake.

use std::path::Path;

use super::input::Input;
use super::options::BakeOptions;
use crate::document::asset::Asset;
use crate::error::Result;
use crate::export::bundle::Measured;
use crate::export::progressive::timeline::Timeline;
use crate::import::options::ReadOptions;
use crate::import::read_bytes_with;
use crate::report::viewer::{Exhibit, Viewer};

/// The models that a bake shows.
pub(super) struct Models<'a> {
    pub(super) source: &'a Asset,
    pub(super) levels: &'a [Asset],
    /// The name and the bytes of the file of all levels between, if there is one.
    pub(super) progressive: Option<&'a (String, Vec<u8>)>,
}

/// Puts the source and the levels into an interactive view.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if an image is damaged or takes more memory than the
/// limit.
pub(super) fn view_all(
    models: &Models<'_>,
    input: Input<'_>,
    options: &BakeOptions,
    measured: Option<&Measured>,
) -> Result<Viewer> {
    let names = options.output.names(&input.stem(), models.levels.len());
    let sizes = measured.map(Measured::sizes).unwrap_or_default();
    let path = input.path().and_then(Path::file_name);
    let file = path.map_or_else(|| input.stem(), |name| name.to_string_lossy().into_owned());
    let mut exhibits = vec![Exhibit::new(&file, models.source)];
    for (index, (asset, name)) in models.levels.iter().zip(&names).enumerate() {
        let largest_size = sizes.get(index).copied();
        exhibits.push(Exhibit { largest_size, ..Exhibit::new(name, asset) });
    }
    let limit = options.reading.memory_limit;
    let Some((name, bytes)) = models.progressive else { return Viewer::new(&exhibits, limit) };
    let reading = ReadOptions { memory_limit: limit, ..ReadOptions::default() };
    let coarsest = read_bytes_with(bytes, Path::new(""), reading)?;
    let timeline = Timeline::read(bytes, Viewer::MOST_CONTINUOUS, reading)?;
    exhibits.push(Exhibit { timeline: Some(&timeline), ..Exhibit::new(name, &coarsest) });
    Viewer::new(&exhibits, limit)
}
