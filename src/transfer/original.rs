//! What textures are made from.

use image::ColorType;
use seamwise_texture::transfer::Picture;

use crate::atlas::ImageRepair;
use crate::document::asset::Asset;
use crate::image_file::encoded::{EncodedImage, ImageFormat};
use crate::limit::MemoryLimit;
use crate::screen::Screen;
use crate::surface::geometry::Geometry;

/// What textures are made from.
#[derive(Clone, Copy)]
pub(crate) struct Origin<'a> {
    pub(crate) asset: &'a Asset,
    pub(crate) surfaces: &'a [Geometry],
    /// What became of each image in a repair, by which charts are read up to their rims.
    pub(crate) repairs: &'a [ImageRepair],
    /// The same as files: what a level uses of images that are not made anew.
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
