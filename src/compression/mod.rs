//! Compressed geometry made plain, right after reading, and compressed again last of all: no stage
//! between knows of it.

use serde_json::json;

use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::limit::MemoryLimit;

#[cfg(feature = "draco")]
mod primitives;
mod squeeze;
mod stream;
mod views;

pub(crate) use squeeze::squeeze;
pub(crate) use views::is_fallback;

/// Calls a function of arrays whose length is a stride that the vertex codec knows: 4, 8, … 256 bytes.
/// None for any other.
macro_rules! by_stride {
    (@ $stride:expr, $function:ident, $arguments:tt, $($size:literal)*) => {
        match $stride {
            $($size => Some(by_stride!(@call $function, $size, $arguments)),)*
            _ => None,
        }
    };
    (@call $function:ident, $size:literal, ($($argument:expr),*)) => {
        $function::<$size>($($argument),*)
    };
    ($stride:expr, $function:ident, $($argument:expr),*) => {
        by_stride!(@ $stride, $function, ($($argument),*),
            4 8 12 16 20 24 28 32 36 40 44 48 52 56 60 64 68 72 76 80 84 88 92 96 100 104 108 112
            116 120 124 128 132 136 140 144 148 152 156 160 164 168 172 176 180 184 188 192 196 200
            204 208 212 216 220 224 228 232 236 240 244 248 252 256)
    };
}
use by_stride;

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
