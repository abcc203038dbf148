//! Compressed geometry made plain, right after reading: no later stage knows that there was any.

use serde_json::json;

use crate::asset::Asset;
use crate::error::{Error, Result};
use crate::limit::MemoryLimit;

#[cfg(feature = "draco")]
mod primitives;
mod views;

pub(crate) use views::is_fallback;

/// Decodes all geometry of an asset that is compressed; views, and then primitives, whose streams
/// lie in views, each take no more memory than the limit.
///
/// # Errors
/// [`Error::Invalid`] with the place of what is damaged or too large.
pub(crate) fn expand(asset: &mut Asset, limit: MemoryLimit) -> Result<()> {
    views::expand(asset, limit)?;
    #[cfg(feature = "draco")]
    primitives::expand(asset, limit)?;
    Ok(())
}

/// Appends decoded bytes to the buffer that the view at `at` names; tells the buffer and where in it
/// they are.
fn append(asset: &mut Asset, at: &str, decoded: &[u8]) -> Result<(usize, usize)> {
    let buffer = asset
        .reference(at, "buffer", "buffers")?
        .ok_or_else(|| Error::invalid(at, "it names no buffer"))?;
    let bytes = &mut asset.buffers[buffer];
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let start = bytes.len();
    bytes.extend_from_slice(decoded);
    asset.json["buffers"][buffer]["byteLength"] = json!(bytes.len());
    Ok((buffer, start))
}
