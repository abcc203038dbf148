//! Compressed geometry made plain, right after reading, and compressed again last of all: no stage
//! between knows of it.

use crate::document::asset::Asset;
use crate::error::Result;
use crate::limit::MemoryLimit;

mod append;
#[cfg(feature = "draco")]
mod primitives;
mod squeeze;
mod stream;
mod stride;
mod views;

pub(crate) use squeeze::squeeze;
pub(crate) use views::is_fallback;

/// Decodes all geometry of an asset that is compressed; views, and then primitives, whose streams
/// lie in views, each take no more memory than the limit.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) with the place of what is damaged or too large.
pub(crate) fn expand(asset: &mut Asset, limit: MemoryLimit) -> Result<()> {
    views::expand(asset, limit)?;
    #[cfg(feature = "draco")]
    primitives::expand(asset, limit)?;
    Ok(())
}
