//! Pictures of the textures that levels have of their own.

use rayon::prelude::*;

use super::pictures::{MOST_ATLASES, Picture, thumbnail};
use super::texture::gpu_bytes;
use super::ticks::grouped;
use crate::document::asset::Asset;
use crate::error::Result;
use crate::image_file::codec::decode;
use crate::image_file::encoded::EncodedImage;
use crate::limit::MemoryLimit;

/// The textures of a level.
#[derive(Clone, Debug, Default)]
pub(crate) struct TexturePictures {
    /// The first of them.
    pub(crate) shown: Vec<TexturePicture>,
    /// Number of those that are not shown.
    pub(crate) more: usize,
}

/// A texture of a level.
#[derive(Clone, Debug)]
pub(crate) struct TexturePicture {
    /// Its name in the document, or its number.
    pub(crate) name: String,
    /// Width and height in texels.
    pub(crate) size: [u32; 2],
    /// Bytes of its file.
    pub(crate) bytes: usize,
    /// Bytes on a graphics processor, with mip maps.
    pub(crate) gpu_bytes: u64,
    /// The texture itself.
    pub(crate) picture: Picture,
}

impl TexturePicture {
    /// A line of text: its size in texels and in kB, as a file and on a graphics processor.
    pub(crate) fn detail(&self) -> String {
        let [width, height] = self.size;
        let [file, gpu] =
            [self.bytes, self.gpu_bytes as usize].map(|own| grouped(own.div_ceil(1000)));
        format!("{width} × {height}, {file} kB, {gpu} kB on a GPU")
    }
}

/// Draws the textures of each level that none of `shared` is; nothing at all if no level has such an image.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if an image is damaged or takes more memory than
/// `limit`.
pub(crate) fn draw_level_textures(
    levels: &[Asset],
    shared: &[EncodedImage],
    limit: MemoryLimit,
) -> Result<Vec<TexturePictures>> {
    let draw = |level: &Asset| {
        let is_own = |image: &EncodedImage| !shared.iter().any(|other| other.bytes == image.bytes);
        let own: Vec<(usize, &EncodedImage)> =
            level.images.iter().enumerate().filter(|(_, image)| is_own(image)).collect();
        let shown = &own[..own.len().min(MOST_ATLASES)];
        Ok(TexturePictures {
            shown: shown
                .par_iter()
                .map(|&(index, image)| draw_one(level, index, image, limit))
                .collect::<Result<_>>()?,
            more: own.len() - shown.len(),
        })
    };
    let level_textures: Vec<TexturePictures> = levels.iter().map(draw).collect::<Result<_>>()?;
    Ok(if level_textures.iter().all(|level| level.shown.is_empty()) {
        Vec::new()
    } else {
        level_textures
    })
}

fn draw_one(
    level: &Asset,
    index: usize,
    image: &EncodedImage,
    limit: MemoryLimit,
) -> Result<TexturePicture> {
    let texels = decode(image, &format!("/images/{index}"), limit)?;
    Ok(TexturePicture {
        name: level.image_name(index).map_or_else(|| format!("Image {index}"), str::to_owned),
        size: [texels.width(), texels.height()],
        bytes: image.bytes.len(),
        gpu_bytes: gpu_bytes(image, [texels.width(), texels.height()].map(|side| side as usize)),
        picture: Picture::new(&thumbnail(&texels))?,
    })
}
