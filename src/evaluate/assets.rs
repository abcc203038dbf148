//! The evaluation of assets in memory, in one call.

use super::load::{TextureCache, load};
use super::{Metrics, Options, Reference};
use crate::document::asset::Asset;
use crate::error::Result;

/// Compares each candidate, a level of detail from any tool, with the asset that it stands for.
///
/// ```
/// use seamwise::evaluate::{Options, compare_assets};
/// use seamwise::import::read_bytes;
///
/// # let sample = include_bytes!("../../data/sample.glb");
/// let source = read_bytes(sample, std::path::Path::new(""))?;
/// let options = Options { views: 1, resolution: 64, samples: 1000, ..Options::default() };
/// let metrics = compare_assets(&source, &[source.clone()], options)?.remove(0);
/// assert_eq!(metrics.distance_max, 0.0, "it is as far from itself as it should be");
/// # Ok::<(), seamwise::Error>(())
/// ```
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if the reference has no surface to compare with, or an
/// image of an asset is damaged.
pub fn compare_assets(
    reference: &Asset,
    candidates: &[Asset],
    options: Options,
) -> Result<Vec<Metrics>> {
    let mut textures = TextureCache::default();
    let reference = load(reference, &mut textures)?;
    let reference = Reference::new(&reference, options)?;
    candidates.iter().map(|asset| reference.compare(&load(asset, &mut textures)?)).collect()
}
