//! The scene that levels are compared with: the source, with its atlases filled where they bleed.
//!
//! A level whose atlas was repaired is right where the source's own is wrong: held against the source
//! as it is, it pays for that. So where the fill of the source's atlases shows, the filled source is
//! what levels are compared with, from any tool alike.
//!
//! Whether it shows is found by looking: `PROBE_VIEWS` views of `PROBE_SIDE` pixels, small enough
//! for mip maps to reach beyond the charts, with and without the fill.
//!
//! Lab note for `LEAST_SHOWN`, RMS sRGB luminance over covered pixels: a photogrammetry tile 0.0151,
//! a box of popcorn 0.0074, a cat 0.0060, a prop with a small color map 0.0058, a ship 0.0048, a helmet
//! 0.0044, a racquet 0.0043, a face 0.0037, a bottle 0.0033, a fox 0.0027, a knight 0.0025, a pan 0.0016,
//! a carton 0.0015. A level of the popcorn whose atlas was filled around the source's charts: 0.0002, as
//! its own charts are cut a little otherwise. A source that was filled: 0.

use serde::Serialize;

use super::camera::Rig;
use super::load::{TextureCache, load, load_materials};
use super::luminance::Difference;
use super::render::render_views;
use super::scene::{Mode, Scene};
use crate::atlas::{ImageRepair, repair_all};
use crate::document::asset::Asset;
use crate::error::Result;
use crate::limit::MemoryLimit;

/// Views that are looked at with and without the fill.
const PROBE_VIEWS: usize = 6;
/// Pixels along each side of these.
const PROBE_SIDE: usize = 192;
/// Least RMS difference in sRGB luminance over the covered pixels at which a fill shows.
const LEAST_SHOWN: f64 = 5e-4;

/// The textures of a reference: as they are in its file, or filled where they bled.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ReferenceTextures {
    /// Whether the atlases that bleed were filled before candidates were compared.
    pub cleaned: bool,
    /// Images of the document whose atlas was filled.
    pub images: Vec<usize>,
    /// RMS difference in sRGB luminance, over covered pixels of small views, between the reference as
    /// it is and filled; `None` if it was taken as it is without a look.
    pub bleeding_rms_luminance_srgb: Option<f64>,
}

impl ReferenceTextures {
    /// A line that tells what candidates are compared with, if that is not the file as it is.
    pub fn line(&self) -> Option<String> {
        let off = self.bleeding_rms_luminance_srgb.filter(|_| self.cleaned)?;
        Some(format!(
            "the source's atlas bleeds (luminance {off:.4} seen small): figures are against the source \
             with it filled; --reference-as-is for the other way"
        ))
    }
}

/// A reference that is ready to be compared with.
pub struct ReferenceScene {
    /// What is seen.
    pub scene: Scene,
    /// What became of its textures.
    pub textures: ReferenceTextures,
}

impl ReferenceScene {
    /// The asset as it is.
    ///
    /// # Errors
    /// As [`load`].
    pub fn as_is(asset: &Asset, cache: &mut TextureCache) -> Result<Self> {
        Ok(Self { scene: load(asset, cache)?, textures: ReferenceTextures::default() })
    }

    /// The asset with its atlases filled if that shows in `mode`. `repairs`: one per image; `None` to
    /// make them within `limit`.
    ///
    /// # Errors
    /// As [`load`] and [`repair_all`].
    pub fn cleaned(
        asset: &Asset,
        repairs: Option<&[ImageRepair]>,
        mode: Mode,
        limit: MemoryLimit,
        cache: &mut TextureCache,
    ) -> Result<Self> {
        let own = match repairs {
            Some(_) => Vec::new(),
            None => repair_all(asset, limit)?,
        };
        let repairs = repairs.unwrap_or(&own);
        let mut scene = load(asset, cache)?;
        let mut images = asset.images.clone();
        let mut filled = Vec::new();
        for repair in repairs {
            if let Ok(repaired) = &repair.result {
                images[repair.image] = cache.stand_in(repaired.texels.clone());
                filled.push(repair.image);
            }
        }
        let mut textures =
            ReferenceTextures { bleeding_rms_luminance_srgb: Some(0.0), ..Default::default() };
        if filled.is_empty() {
            return Ok(Self { scene, textures });
        }
        let json = asset.json.clone();
        let clean = load_materials(&Asset { json, images, ..Asset::default() }, cache)?;
        let rig = Rig::around(&scene, PROBE_VIEWS, PROBE_SIDE);
        let before = render_views(&scene, &rig, mode);
        let as_is = std::mem::replace(&mut scene.materials, clean);
        let after = render_views(&scene, &rig, mode);
        let mut difference = Difference::default();
        for (before, after) in before.iter().zip(&after) {
            difference += Difference::between(before, after, &[]);
        }
        let shown = difference.rms_covered_srgb();
        textures.bleeding_rms_luminance_srgb = Some(shown);
        if shown < LEAST_SHOWN {
            scene.materials = as_is;
        } else {
            (textures.cleaned, textures.images) = (true, filled);
        }
        Ok(Self { scene, textures })
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::evaluate::{Options, Reference};
    use crate::image_file::codec::{EncodeOptions, decode, encode};
    use crate::image_file::encoded::ImageFormat;
    use crate::import::read_bytes;

    fn sample() -> Asset {
        let bytes = include_bytes!("../../data/sample.glb");
        read_bytes(bytes, Path::new("")).unwrap()
    }

    fn cleaned(asset: &Asset) -> ReferenceScene {
        let (limit, mut cache) = (MemoryLimit::default(), TextureCache::default());
        ReferenceScene::cleaned(asset, None, Mode::Lit, limit, &mut cache).unwrap()
    }

    #[test]
    fn a_source_that_bleeds_is_filled_and_one_that_is_filled_stays() {
        let mut asset = sample();
        let found = cleaned(&asset);
        assert!(
            found.textures.cleaned && found.textures.images == [0, 1, 2],
            "{:?}",
            found.textures
        );
        let line = found.textures.line().unwrap();
        assert!(line.contains("--reference-as-is"), "{line}");
        let repairs = repair_all(&asset, MemoryLimit::default()).unwrap();
        asset.images =
            crate::atlas::encode_repaired(&asset, &repairs, EncodeOptions::default()).unwrap();
        let again = cleaned(&asset);
        assert!(!again.textures.cleaned, "{:?}", again.textures);
        assert_eq!((again.textures.line(), again.textures.images.len()), (None, 0));
        // The repaired one is what the filled one is, but for what a JPEG loses.
        let options = Options { views: 2, resolution: 128, samples: 1000, ..Options::default() };
        let reference = Reference::new(&found.scene, options).unwrap();
        let bleeding = found.textures.bleeding_rms_luminance_srgb.unwrap();
        let off = reference.compare(&again.scene).unwrap().rms_luminance_srgb;
        assert!(off < 0.1 * bleeding, "{off} of {bleeding}");
    }

    #[test]
    fn texels_that_nothing_reads_do_not_count_as_bleeding() {
        let mut asset = sample();
        let repairs = repair_all(&asset, MemoryLimit::default()).unwrap();
        asset.images =
            crate::atlas::encode_repaired(&asset, &repairs, EncodeOptions::default()).unwrap();
        let repaired = repairs[0].result.as_ref().unwrap();
        let mut texels = repaired.texels.to_rgb8();
        let corner = (0, 0);
        assert!(!repaired.validity.is_valid(corner.0, corner.1), "the corner lies outside");
        texels.put_pixel(0, 0, image::Rgb([255, 0, 255]));
        asset.images[0] = encode(&texels.into(), ImageFormat::Png).unwrap();
        let found = cleaned(&asset).textures;
        assert!(!found.cleaned && found.bleeding_rms_luminance_srgb.is_some(), "{found:?}");
        assert!(decode(&asset.images[0], "", MemoryLimit::default()).is_ok());
    }
}
