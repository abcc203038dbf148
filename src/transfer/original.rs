//! The input of a transfer of textures.

use image::{ColorType, DynamicImage};
use seamwise_texture::transfer::Picture;
use seamwise_texture::{Validity, alpha_coverage};

use crate::atlas::ImageRepair;
use crate::atlas::alpha::Alpha;
use crate::document::asset::Asset;
use crate::error::{Error, Result};
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
    /// Whether each level is a file of its own, and there is none of all levels.
    pub(crate) has_level_files_alone: bool,
    pub(crate) screen: Screen,
    pub(crate) limit: MemoryLimit,
}

/// An image of the source, ready to be read.
pub(crate) struct Original {
    pub(crate) color: ColorType,
    pub(crate) format: ImageFormat,
    pub(crate) picture: Picture,
    /// The part of a cutout that is there, if that is to stay.
    pub(crate) coverage: Option<Coverage>,
}

/// The part of a cutout that is there.
#[derive(Clone, Copy)]
pub(crate) struct Coverage {
    /// The least alpha that passes.
    pub(crate) cutoff: f32,
    /// The share of texels in charts that have it.
    pub(crate) share: f64,
}

impl Coverage {
    /// The coverage of an image of the source; `None` if no material cuts it out, or it has no alpha.
    pub(crate) fn of(repair: &ImageRepair, texels: &DynamicImage) -> Result<Option<Self>> {
        let Alpha { shows, cutoff, .. } = repair.alpha;
        let Some(cutoff) = cutoff.filter(|cutoff| !shows && *cutoff > 0.0 && *cutoff <= 1.0) else {
            return Ok(None);
        };
        let [width, height] = [texels.width() as usize, texels.height() as usize];
        let share = match &repair.result {
            Ok(repaired) => alpha_coverage(texels, &repaired.validity, cutoff),
            Err(_) => {
                let all = Validity::from_flags(width, height, vec![true; width * height]);
                alpha_coverage(texels, &all, cutoff)
            }
        };
        Ok(share.map_err(Error::internal)?.map(|share| Self { cutoff, share }))
    }
}

impl Original {
    /// Whether it has more than eight bits per channel.
    pub(super) fn is_deep(&self) -> bool {
        self.color.bytes_per_pixel() > self.color.channel_count()
    }
}
