//! The textures of all models of a view, each once, and small enough for a page.

use std::collections::BTreeSet;

use image::imageops::FilterType;
use image::{DynamicImage, ImageFormat as Codec};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::document::asset::Asset;
use crate::document::material::material_slots;
use crate::error::{Error, Result};
use crate::image_file::codec::{decode, write};
use crate::image_file::encoded::{EncodedImage, ImageFormat};
use crate::image_file::metadata::Metadata;
use crate::limit::MemoryLimit;

/// Most bytes of all images of a page.
const MOST_BYTES: usize = 6 << 20;
/// The sizes that images are held to, one after the other, until all fit.
const SIDES: [u32; 4] = [2048, 1024, 512, 256];
/// Quality of JPEGs: of a texture of a scan, 0.004 of 1 RMS off, below what the levels are off by.
const QUALITY: u8 = 90;

/// Images by where their bytes lie.
pub(super) struct ImagePool {
    limit: MemoryLimit,
    images: Vec<EncodedImage>,
    known: FxHashMap<usize, usize>,
}

impl ImagePool {
    pub(super) fn new(limit: MemoryLimit) -> Self {
        Self { limit, images: Vec::new(), known: FxHashMap::default() }
    }

    /// Takes the images that the materials of an asset use. One entry per image of the asset: its place
    /// in the pool.
    pub(super) fn add_all(&mut self, asset: &Asset) -> Result<Vec<Option<usize>>> {
        let slots = material_slots(asset)?;
        let used: BTreeSet<usize> = slots.iter().flatten().map(|slot| slot.image).collect();
        let mut places = Vec::new();
        for (index, image) in asset.images.iter().enumerate() {
            let is_seen = used.contains(&index) && !image.is_missing();
            places.push(is_seen.then(|| self.add(image)));
        }
        Ok(places)
    }

    fn add(&mut self, image: &EncodedImage) -> usize {
        let same = || self.images.iter().position(|own| own.bytes == image.bytes);
        let address = std::sync::Arc::as_ptr(&image.bytes).addr();
        let known = self.known.get(&address).copied().or_else(same);
        let place = known.unwrap_or(self.images.len());
        if known.is_none() {
            self.images.push(image.clone());
        }
        self.known.insert(address, place);
        place
    }

    pub(super) fn images(&self) -> impl Iterator<Item = &EncodedImage> {
        self.images.iter()
    }

    /// Makes images smaller until they fit into a page, and readable for a browser; what was done, if
    /// anything was.
    pub(super) fn fit(&mut self) -> Result<Option<String>> {
        let bytes =
            |images: &[EncodedImage]| images.iter().map(|own| own.bytes.len()).sum::<usize>();
        let is_plain = self.images.iter().all(|own| own.format != ImageFormat::Ktx2);
        let before = bytes(&self.images);
        if is_plain && before <= MOST_BYTES {
            return Ok(None);
        }
        let is_large = before > MOST_BYTES;
        let changes = |own: &EncodedImage| is_large || own.format == ImageFormat::Ktx2;
        let decode_own = |(index, own): (usize, &EncodedImage)| {
            let decoded = changes(own).then(|| decode(own, &format!("image {index}"), self.limit));
            decoded.transpose()
        };
        let decoded = self.images.par_iter().enumerate().map(decode_own);
        let decoded: Vec<Option<DynamicImage>> = decoded.collect::<Result<_>>()?;
        for side in SIDES {
            let smaller = self.images.par_iter().zip(&decoded);
            let smaller = smaller.map(|(own, texels)| match texels {
                Some(texels) => reduced(own, texels, side),
                None => Ok(own.clone()),
            });
            let smaller: Vec<EncodedImage> = smaller.collect::<Result<_>>()?;
            let after = bytes(&smaller);
            if after > MOST_BYTES && side > SIDES[SIDES.len() - 1] {
                continue;
            }
            self.images = smaller;
            return Ok(Some(if is_large {
                format!(
                    "Textures are shown smaller than they are: at most {side} texels a side, most as JPEG of \
                     quality {QUALITY}, {} kB instead of {} kB. Counts of bytes are those of the files.",
                    after.div_ceil(1000),
                    before.div_ceil(1000)
                )
            } else {
                format!(
                    "Textures in KTX2, which browsers do not read, are shown as JPEG or PNG, at most {side} \
                     texels a side."
                )
            }));
        }
        Ok(None)
    }
}

/// An image of at most so many texels a side: as it is, or encoded anew if that is smaller.
fn reduced(image: &EncodedImage, texels: &DynamicImage, side: u32) -> Result<EncodedImage> {
    let is_large = texels.width().max(texels.height()) > side;
    let opaque = !texels.color().has_alpha() || texels.to_rgba8().pixels().all(|p| p.0[3] == 255);
    let texels = if opaque {
        DynamicImage::ImageRgb8(texels.to_rgb8())
    } else {
        DynamicImage::ImageRgba8(texels.to_rgba8())
    };
    let texels = if is_large { texels.resize(side, side, FilterType::Triangle) } else { texels };
    let (format, codec) =
        if opaque { (ImageFormat::Jpeg, Codec::Jpeg) } else { (ImageFormat::Png, Codec::Png) };
    let bytes = write(&texels, &Metadata::default(), codec, QUALITY).map_err(Error::internal)?;
    let must_change = is_large || image.format == ImageFormat::Ktx2;
    if !must_change && image.bytes.len() <= bytes.len() {
        return Ok(image.clone());
    }
    Ok(EncodedImage { bytes: bytes.into(), format })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(side: u32) -> DynamicImage {
        DynamicImage::ImageRgb8(image::RgbImage::from_fn(side, side, |x, y| {
            let mixed = (x * 4096 + y + 1).wrapping_mul(0x9e37_79b9);
            let hash = (mixed ^ mixed >> 15).wrapping_mul(0x85eb_ca6b) >> 8;
            image::Rgb([hash as u8, (hash >> 8) as u8, (hash >> 16) as u8])
        }))
    }

    fn png(texels: &DynamicImage) -> EncodedImage {
        crate::image_file::codec::encode(texels, ImageFormat::Png).unwrap()
    }

    #[test]
    fn images_that_fit_stay_as_they_are_and_each_is_there_once() {
        let mut pool = ImagePool::new(MemoryLimit::default());
        let image = png(&noise(16));
        let twin = EncodedImage { bytes: image.bytes.to_vec().into(), ..image.clone() };
        assert_eq!([pool.add(&image), pool.add(&twin), pool.add(&png(&noise(8)))], [0, 0, 1]);
        assert_eq!(pool.fit().unwrap(), None);
        assert_eq!(pool.images().next(), Some(&image));
    }

    #[test]
    fn images_that_do_not_fit_are_made_smaller_and_that_is_told() {
        let mut pool = ImagePool::new(MemoryLimit::default());
        pool.add(&png(&noise(2500)));
        let told = pool.fit().unwrap().expect("it is told");
        let image = pool.images().next().unwrap();
        assert!(image.bytes.len() <= MOST_BYTES && image.format == ImageFormat::Jpeg);
        let texels = decode(image, "", MemoryLimit::default()).unwrap();
        assert!(told.contains(&format!("at most {} texels", texels.width())), "{told}");
    }

    #[test]
    fn what_is_seen_through_keeps_its_alpha() {
        let clear =
            DynamicImage::ImageRgba8(image::RgbaImage::from_pixel(8, 8, image::Rgba([1, 2, 3, 0])));
        let small = reduced(&png(&clear), &clear, 4).unwrap();
        assert_eq!(small.format, ImageFormat::Png);
        assert_eq!(
            decode(&small, "", MemoryLimit::default()).unwrap().to_rgba8().get_pixel(1, 1).0[3],
            0
        );
    }
}
