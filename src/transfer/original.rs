//! The input of a transfer of textures.

use image::ColorType;
use seamwise_texture::transfer::Picture;

use crate::atlas::ImageRepair;
use crate::document::asset::Asset;
use crate::image_file::encoded::{EncodedImage, ImageFormat};
use crate::limit::MemoryLimit;
use crate::screen::Screen;
use crate::surface::geometry::Geometry;

/// The input of a transfer of textures.
#[derive(Clone, Copy)]
pub(crate) struct Origin<'a> {
    pub(crate) asset: &'a Asset,
    pub(crate) surfaces: &'a [Geometry],
    /// The repair of each image, by which charts are read up to their rims.
    pub(crate) repairs: &'a [ImageRepair],
    /// The images after repair, as files, which levels use where an image is not made anew.
    pub(crate) images: &'a [EncodedImage],
    pub(crate) screen: Screen,
    pub(crate) limit: MemoryLimit,
}

/// An image of the source, ready to be read.
pub(crate) struct Original {
    pub(crate) color: ColorType,
    pub(crate) format: ImageFormat,
    pub(crate) picture: Picture,
}

impl Original {
    /// Whether it has more than eight bits per channel.
    pub(super) fn is_deep(&self) -> bool {
        self.color.bytes_per_pixel() > self.color.channel_count()
    }
}
