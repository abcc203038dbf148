//! The repair of an asset's images: of each, all texels that no chart covers.

use image::DynamicImage;
use rayon::prelude::*;
use seamwise_texture::equalize::{self, Equalized, Seam};
use seamwise_texture::{
    Footprint, KeptCoverage, Outcome, Repair, RepairSummary, Role, Validity, alpha_tells,
};

use super::alpha::Alpha;
use super::charts::Reads;
use super::image::{Atlas, atlas_of_each};
use super::seams::seams_of_images;
use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::image_file::codec::{EncodeOptions, decode, encode_anew};
use crate::image_file::encoded::{EncodedImage, ImageFormat};
use crate::image_file::palette::{has_palette, reduce_beside, reduce_fill};
use crate::limit::MemoryLimit;
use crate::surface::geometry::check_size;

/// A PNG that grows more by its repair, being drawn in flat colors, is filled in fewer colors: a fox of
/// 27 kB took 327 kB with what lies around its charts as smooth as a photograph's.
const MOST_GROWTH: usize = 2;

/// The outcome of the repair of one image of an asset.
#[derive(Clone, Debug)]
pub struct ImageRepair {
    /// The image.
    pub image: usize,
    /// The meaning of its texels, if a primitive uses it.
    pub role: Option<Role>,
    /// The use of its alpha.
    pub alpha: Alpha,
    /// The repair, or the reason why there was none.
    pub result: std::result::Result<Repaired, LeftAlone>,
}

/// An image after its repair.
#[derive(Clone, Debug)]
pub struct Repaired {
    /// Its texels.
    pub texels: DynamicImage,
    /// The texels that came from the file.
    pub validity: Validity,
    /// Number of those that lie around the charts, in padding that was kept.
    pub padding: usize,
    /// The counts of the others, filled or not.
    pub outcome: Outcome,
    /// The equalization of seams, if it was asked for.
    pub equalized: Option<Equalized>,
    /// The coverage of a cutout, if it was to be kept.
    pub coverage: Option<KeptCoverage>,
    atlas: Atlas,
}

impl Repaired {
    /// The counts of texels that filtering inside the charts read before the repair.
    pub fn reads(&self, footprint: Footprint) -> Reads {
        self.atlas.charts.reads(&self.validity, self.atlas.wrap, footprint)
    }

    /// Whether some materials hide what has alpha 0 and others show it, so that its color stayed.
    pub fn is_hidden_in_part(&self) -> bool {
        self.atlas.alpha.hides && self.atlas.alpha.shows && alpha_tells(&self.texels, Role::Color)
    }
}

/// The reason why an image was not repaired.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LeftAlone {
    /// No primitive uses it, not even points or lines.
    #[error("no primitive uses it")]
    Unused,
    /// Points or lines use it, whose reads no chart bounds.
    #[error("points or lines use it")]
    BeyondCharts,
    /// Charts cover none of its texels: triangles that use it have no UVs, or no area there.
    #[error("no chart covers any of it")]
    NoChart,
    /// Its charts have no area: they are colors, between which there is nothing to fill.
    #[error("its charts are single texels and lines: colors, not pictures")]
    Colors,
    /// The asset was read without it.
    #[error("its file is not there")]
    Missing,
    /// Charts cover all of its texels.
    #[error("charts cover all of it")]
    Covered,
}

/// Options of the repair of an asset's images.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AtlasOptions {
    /// Most memory that decoding one image may take.
    pub memory_limit: MemoryLimit,
    /// Number of rings of texels around the charts that stay if they agree with them; see
    /// [`keep_padding`](seamwise_texture::keep_padding).
    pub keep_padding: usize,
    /// Number of times that images are halved, each texel the mean of valid ones; see
    /// [`scale_down`](seamwise_texture::scale_down). Images that charts cover are scaled too, those
    /// left alone for another reason are not.
    pub halvings: u32,
    /// Whether and how both sides of seams are made to read the same, after the fill; in images that
    /// charts cover in whole too.
    pub equalize: Option<equalize::Options>,
    /// Whether the alpha of images that a `MASK` cuts out is scaled as they are halved, so that as
    /// large a share of their texels passes the cutoff.
    pub keep_coverage: bool,
}

/// Repairs every image of an asset whose charts leave texels uncovered; one result per image.
///
/// # Errors
/// [`Error::Invalid`] if an image is damaged or takes more memory than `limit`.
pub fn repair_all(asset: &Asset, limit: MemoryLimit) -> Result<Vec<ImageRepair>> {
    repair_all_with(asset, AtlasOptions { memory_limit: limit, ..AtlasOptions::default() })
}

/// As [`repair_all`], with options.
///
/// # Errors
/// As [`repair_all`].
pub fn repair_all_with(asset: &Asset, options: AtlasOptions) -> Result<Vec<ImageRepair>> {
    check_size(asset, options.memory_limit)?;
    let seams = options.equalize.map(|_| seams_of_images(asset)).transpose()?;
    let repair = |(image, atlas): (usize, Option<Atlas>)| {
        let role = atlas.as_ref().map(|atlas| atlas.role);
        let seams = seams.as_ref().map_or(&[][..], |seams| &seams[image]);
        let alpha = atlas.as_ref().map(|atlas| atlas.alpha).unwrap_or_default();
        let result = match atlas {
            Some(atlas) => repair_one(asset, atlas, options, seams)?,
            None => Err(LeftAlone::Unused),
        };
        Ok(ImageRepair { image, role, alpha, result })
    };
    atlas_of_each(asset)?.into_par_iter().enumerate().map(repair).collect()
}

fn repair_one(
    asset: &Asset,
    atlas: Atlas,
    options: AtlasOptions,
    seams: &[Seam],
) -> Result<std::result::Result<Repaired, LeftAlone>> {
    if atlas.beyond_charts {
        return Ok(Err(LeftAlone::BeyondCharts));
    }
    if asset.images[atlas.image].is_missing() {
        return Ok(Err(LeftAlone::Missing));
    }
    let at = format!("/images/{}", atlas.image);
    let mut texels = decode(&asset.images[atlas.image], &at, options.memory_limit)?;
    let mut validity = atlas.validity(texels.width() as usize, texels.height() as usize);
    if validity.valid() == 0 {
        return Ok(Err(LeftAlone::NoChart));
    }
    if atlas.charts.are_colors([texels.width() as usize, texels.height() as usize]) {
        return Ok(Err(LeftAlone::Colors));
    }
    let Alpha { hides, shows, cutoff } = atlas.alpha;
    let fills_hidden = hides && !shows && alpha_tells(&texels, Role::Color);
    let covered = validity.invalid() == 0;
    if covered && options.halvings == 0 && seams.is_empty() && !fills_hidden {
        return Ok(Err(LeftAlone::Covered));
    }
    let fault = |error: seamwise_texture::Error| Error::invalid(&at, error.to_string());
    let Atlas { role, wrap, .. } = atlas;
    let cutoff = cutoff.filter(|_| options.keep_coverage && !shows);
    let repair = Repair::new(role)
        .wrap(wrap)
        .keep_padding(options.keep_padding)
        .halve(options.halvings)
        .keep_coverage(cutoff)
        .fill_hidden(fills_hidden)
        .equalize(seams, options.equalize);
    let RepairSummary { padding, coverage, outcome, equalized } =
        repair.run(&mut texels, &mut validity).map_err(fault)?;
    let is_untouched = outcome.hidden == 0 && equalized.is_none_or(|done| done.texels == 0);
    if covered && options.halvings == 0 && is_untouched {
        return Ok(Err(LeftAlone::Covered));
    }
    Ok(Ok(Repaired { texels, validity, padding, outcome, equalized, coverage, atlas }))
}

/// The asset's images with the repaired ones in their places, each in the format it came in unless
/// all are to be PNGs. One with a palette keeps it: what was filled takes colors of it, and more while there
/// is room, since in full color the file would be twice as large.
///
/// # Errors
/// [`Error::Internal`] if an encoder refuses its texels.
pub fn encode_repaired(
    asset: &Asset,
    repairs: &[ImageRepair],
    encoding: EncodeOptions,
) -> Result<Vec<EncodedImage>> {
    let finish = |(image, repair): (&EncodedImage, &ImageRepair)| match &repair.result {
        Ok(repaired) => {
            let reduced = in_palette(repaired, image)?;
            let file = encode_anew(reduced.as_ref().unwrap_or(&repaired.texels), image, encoding)?;
            if file.format != ImageFormat::Png
                || file.bytes.len() <= MOST_GROWTH * image.bytes.len()
            {
                return Ok(file);
            }
            let fewer = reduce_fill(&repaired.texels, repaired.validity.flags());
            let fewer = fewer.map(|fewer| encode_anew(&fewer, image, encoding)).transpose()?;
            Ok(fewer.filter(|fewer| fewer.bytes.len() < file.bytes.len()).unwrap_or(file))
        }
        Err(_) => Ok(image.clone()),
    };
    asset.images.par_iter().zip(repairs).map(finish).collect()
}

/// A repaired image in the palette of its file, if that has one and all valid texels are as they were.
fn in_palette(repaired: &Repaired, before: &EncodedImage) -> Result<Option<DynamicImage>> {
    let is_changed = repaired.equalized.is_some() || repaired.coverage.is_some();
    if is_changed || !has_palette(&before.bytes) {
        return Ok(None);
    }
    // It has been decoded before, within a limit.
    let kept = decode(before, "", MemoryLimit::default()).map_err(Error::internal)?;
    let size = |image: &DynamicImage| [image.width(), image.height()];
    let is_as_large = size(&kept) == size(&repaired.texels);
    Ok(is_as_large.then(|| reduce_beside(&repaired.texels, &kept)).flatten())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::image_file::codec::encode;
    use serde_json::{Value, json};

    /// A triangle over the lower left half of the unit square, and an image per material.
    fn asset(primitives: &Value, materials: usize) -> Asset {
        let floats: Vec<f32> = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0]].concat();
        let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].concat();
        let bytes = floats.into_iter().chain(positions).flat_map(f32::to_le_bytes);
        let texels = image::RgbImage::from_fn(8, 8, |x, y| {
            image::Rgb(if x <= y { [9, 90, 200] } else { [0, 0, 0] })
        });
        let png = encode(&texels.into(), ImageFormat::Png).unwrap();
        let material = |index| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": index, "texCoord": 0}}});
        let json = json!({
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC2"},
                {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3"},
            ],
            "bufferViews": [
                {"buffer": 0, "byteLength": 24},
                {"buffer": 0, "byteOffset": 24, "byteLength": 36},
            ],
            "meshes": [{"primitives": primitives}],
            "materials": (0..materials).map(material).collect::<Vec<_>>(),
            "textures": (0..materials).map(|index| json!({"source": index})).collect::<Vec<_>>(),
            "images": vec![json!({}); materials],
        });
        Asset {
            json,
            buffers: vec![Arc::new(bytes.collect())],
            images: vec![png; materials],
            ..Asset::default()
        }
    }

    #[test]
    fn each_image_is_repaired_or_left_alone_for_a_reason() {
        let bare = json!({"POSITION": 1});
        let textured = json!({"POSITION": 1, "TEXCOORD_0": 0});
        let primitives = json!([
            {"attributes": textured, "material": 0},
            {"attributes": bare, "material": 1},
            {"attributes": textured, "material": 2},
            {"attributes": textured, "material": 2, "mode": 0},
        ]);
        let asset = asset(&primitives, 4);
        let repairs = repair_all(&asset, MemoryLimit::default()).unwrap();
        let reasons: Vec<_> =
            repairs.iter().map(|repair| repair.result.as_ref().err().copied()).collect();
        let expected = [LeftAlone::NoChart, LeftAlone::BeyondCharts, LeftAlone::Unused];
        assert_eq!(reasons[0], None);
        assert_eq!(reasons[1..], expected.map(Some));
        assert_eq!((repairs[0].role, repairs[3].role), (Some(Role::Color), None));

        let repaired = repairs[0].result.as_ref().unwrap();
        assert_eq!(repaired.outcome.filled, repaired.validity.invalid());
        let reads = repaired.reads(Footprint::default()).mips;
        assert!(reads.len() == 4 && reads.iter().all(|mip| mip.invalid > 0));
        let images = encode_repaired(&asset, &repairs, EncodeOptions::default()).unwrap();
        assert!(images[0] != asset.images[0] && images[1..] == asset.images[1..]);
        let texels = decode(&images[0], "", MemoryLimit::default()).unwrap().to_rgb8();
        assert!(texels.pixels().all(|texel| texel.0 == [9, 90, 200]));
    }

    #[test]
    fn colors_under_alpha_0_are_filled_where_no_material_shows_them() {
        let textured = json!({"POSITION": 1, "TEXCOORD_0": 0});
        let primitives = json!(
            (0..4)
                .map(|material| json!({"attributes": textured, "material": material}))
                .collect::<Vec<_>>()
        );
        let mut asset = asset(&primitives, 4);
        for (material, mode) in ["MASK", "BLEND", "OPAQUE", "MASK"].into_iter().enumerate() {
            asset.json["materials"][material]["alphaMode"] = json!(mode);
        }
        // Another material shows the last image as it is.
        asset.json["materials"][2]["emissiveTexture"] = json!({"index": 3});
        let leaf = |x: u32| x < 4;
        let texels = image::RgbaImage::from_fn(8, 8, |x, _| {
            image::Rgba(if leaf(x) { [9, 90, 20, 255] } else { [255, 255, 255, 0] })
        });
        let png = encode(&texels.clone().into(), ImageFormat::Png).unwrap();
        asset.images = vec![png; 4];
        let repairs = repair_all(&asset, MemoryLimit::default()).unwrap();
        for (repair, fills) in repairs.iter().zip([true, true, false, false]) {
            let repaired = repair.result.as_ref().unwrap();
            assert_eq!(repaired.outcome.hidden > 0, fills, "{}", repair.image);
            assert_eq!(repaired.is_hidden_in_part(), repair.image == 3);
            let after = repaired.texels.to_rgba8();
            for (x, y, texel) in after.enumerate_pixels() {
                if repaired.validity.is_valid(x as usize, y as usize) {
                    let color = if fills || leaf(x) { [9, 90, 20] } else { [255; 3] };
                    assert_eq!(texel.0[..3], color, "{} {x} {y}", repair.image);
                    assert_eq!(texel.0[3], texels.get_pixel(x, y).0[3]);
                }
            }
        }
    }
}
