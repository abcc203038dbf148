//! What each image of a level takes, as a file and on a graphics processor.
//!
//! An image in KTX2 stays in blocks of 16 bytes for 4 × 4 texels there, as BC7 or ASTC; any other has four bytes a texel.
//! Mip maps add a third to both.

use serde::Serialize;

use crate::document::asset::Asset;
use crate::error::Result;
use crate::image_file::codec::dimensions;
use crate::image_file::encoded::{EncodedImage, ImageFormat};
use crate::image_file::ktx2::{container::level_count, encode};
use crate::limit::MemoryLimit;

/// Bytes of a texel that is not compressed.
const TEXEL_BYTES: u64 = 4;

/// An image of a level.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TextureReport {
    /// Its name, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Its media type, as `image/png`.
    pub format: &'static str,
    /// Its width and height in texels.
    pub size: [usize; 2],
    /// Bytes of its file.
    pub bytes: usize,
    /// Bytes on a graphics processor, with mip maps.
    pub gpu_bytes: u64,
}

impl TextureReport {
    /// The images of a document, but for those whose files are not there.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if one is damaged or takes more memory than the limit.
    pub(crate) fn of(asset: &Asset, limit: MemoryLimit) -> Result<Vec<Self>> {
        let images = asset.images.iter().enumerate().filter(|(_, image)| !image.is_missing());
        let of = |(index, image): (usize, &EncodedImage)| {
            let at = format!("/images/{index}");
            let size = dimensions(image, &at, limit)?;
            let name = asset.json.pointer(&format!("{at}/name")).and_then(|name| name.as_str());
            Ok(Self {
                name: name.map(str::to_owned),
                format: image.format.mime(),
                size,
                bytes: image.bytes.len(),
                gpu_bytes: gpu_bytes(image, size),
            })
        };
        images.map(of).collect()
    }

    /// Whether it stays compressed on a graphics processor.
    pub(super) fn is_compressed(&self) -> bool {
        self.format == ImageFormat::Ktx2.mime()
    }
}

/// Bytes of images on a graphics processor.
pub(crate) fn gpu_bytes_of(textures: &[TextureReport]) -> u64 {
    textures.iter().map(|own| own.gpu_bytes).sum()
}

/// Bytes of an image of so many texels on a graphics processor.
pub(super) fn gpu_bytes(image: &EncodedImage, size: [usize; 2]) -> u64 {
    match image.format {
        ImageFormat::Ktx2 => {
            let levels = level_count(&image.bytes).unwrap_or(1).max(1);
            encode::bytes_in_blocks(size, levels as usize)
        }
        ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP => encode::mip_sizes(size)
            .map(|[width, height]| (width * height) as u64 * TEXEL_BYTES)
            .sum(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_take_a_quarter_of_what_texels_take() {
        let png = EncodedImage { bytes: Vec::new().into(), format: ImageFormat::Png };
        // 64 + 16 + 4 + 1 texels of four bytes; 4 + 1 + 1 + 1 blocks of sixteen.
        assert_eq!(gpu_bytes(&png, [8, 8]), 340);
        assert_eq!(encode::bytes_in_blocks([8, 8], 4), 112);
        assert_eq!(encode::bytes_in_blocks([8, 8], 1), 64);
        let large = [2048, 1024];
        let share = encode::bytes_with_mips(large) as f64 / gpu_bytes(&png, large) as f64;
        assert!((0.25..0.2501).contains(&share), "{share}");
    }
}
