//! Compressed geometry made plain, right after reading: no later stage knows that there was any.

use crate::asset::Asset;
use crate::error::Result;
use crate::limit::MemoryLimit;

mod views;

/// Decodes all geometry of an asset that is compressed, into no more memory than the limit.
///
/// # Errors
/// [`Error::Invalid`](crate::Error::Invalid) with the place of what is damaged or too large.
pub(crate) fn expand(asset: &mut Asset, limit: MemoryLimit) -> Result<()> {
    views::expand(asset, limit)
}

pub(crate) use views::is_fallback;
