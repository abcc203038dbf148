//! Decoded bytes at the end of a buffer.

use std::sync::Arc;

use serde_json::json;

use crate::document::asset::Asset;
use crate::error::{Error, Result};

/// Appends decoded bytes to the buffer that the view at `at` names; tells the buffer and where in it
/// they are.
pub(super) fn append(asset: &mut Asset, at: &str, decoded: &[u8]) -> Result<(usize, usize)> {
    let buffer = asset
        .reference(at, "buffer", "buffers")?
        .ok_or_else(|| Error::invalid(at, "it names no buffer"))?;
    let bytes = Arc::make_mut(&mut asset.buffers[buffer]);
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let start = bytes.len();
    bytes.extend_from_slice(decoded);
    asset.json["buffers"][buffer]["byteLength"] = json!(bytes.len());
    Ok((buffer, start))
}
