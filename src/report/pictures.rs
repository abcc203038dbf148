//! The pictures of a report, each encoded as soon as it is drawn: renders, where they differ,
//! wireframes, and atlases before and after their repair.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{self, CompressionType, PngEncoder};
use image::imageops::{FilterType, resize};
use image::{DynamicImage, RgbImage};
use rayon::prelude::*;
use seamwise_texture::{Footprint, MipReads, Role, seen_texels};

use crate::atlas::fill_picture::draw_fill;
use crate::atlas::{ImageRepair, LeftAlone, Repaired};
use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::evaluate::camera::Rig;
use crate::evaluate::heat::difference_map;
use crate::evaluate::render::{Image, render_views};
use crate::evaluate::scene::{Mode, Scene};
use crate::evaluate::wireframe::draw_wireframe;
use crate::image_file::codec::decode;
use crate::limit::MemoryLimit;

/// Views of a scene.
pub const VIEWS: usize = 6;
/// Pixels along each side of a render and of a wireframe; the page shows them smaller until they
/// are asked for.
const RENDER_SIDE: usize = 1024;
const WIRE_SIDE: usize = 512;
const DIFFERENCE_SIDE: u32 = 512;
/// Most pixels along a side of an atlas.
const ATLAS_SIDE: u32 = 384;
/// Most atlases that are shown.
pub(super) const MOST_ATLASES: usize = 8;
/// Quality of JPEGs: the pictures are for looking at, not for measuring.
const JPEG_QUALITY: u8 = 88;

/// An encoded picture.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// A `data:` URI of a PNG or JPEG.
    pub uri: String,
}

impl Picture {
    /// Encodes a picture as PNG or, where that is smaller, as JPEG.
    ///
    /// # Errors
    /// [`Error::Internal`] if an encoder refuses it.
    pub fn new(pixels: &RgbImage) -> Result<Self> {
        let (mut png, mut jpeg) = (Vec::new(), Vec::new());
        let encoder = PngEncoder::new_with_quality(
            &mut png,
            CompressionType::Default,
            png::FilterType::Adaptive,
        );
        pixels.write_with_encoder(encoder).map_err(Error::internal)?;
        let encoder = JpegEncoder::new_with_quality(&mut jpeg, JPEG_QUALITY);
        pixels.write_with_encoder(encoder).map_err(Error::internal)?;
        let (kind, bytes) = if png.len() <= jpeg.len() { ("png", png) } else { ("jpeg", jpeg) };
        let uri = format!("data:image/{kind};base64,{}", STANDARD.encode(bytes));
        Ok(Self { width: pixels.width(), height: pixels.height(), uri })
    }
}

/// A reference and what is compared with it, seen by the same cameras.
pub struct Gallery {
    rig: Rig,
    origin: DVec3,
    mode: Mode,
    reference: Vec<Image>,
    /// One per scene, the reference first.
    pub scenes: Vec<SceneViews>,
}

/// The pictures of one scene.
pub struct SceneViews {
    /// One per view.
    pub renders: Vec<Picture>,
    /// One per view: the difference to the reference. None for the reference itself.
    pub differences: Vec<Picture>,
    /// One per view.
    pub wireframes: Vec<Picture>,
}

impl Gallery {
    /// Draws the reference, lit.
    ///
    /// # Errors
    /// [`Error::Internal`] if an encoder fails.
    pub fn new(reference: &Scene) -> Result<Self> {
        Self::with_mode(reference, Mode::Lit)
    }

    /// Draws the reference. `mode` is that of all renders.
    ///
    /// # Errors
    /// [`Error::Internal`] if an encoder fails.
    pub fn with_mode(reference: &Scene, mode: Mode) -> Result<Self> {
        let rig = Rig::around(reference, VIEWS, RENDER_SIDE);
        let images = render_views(reference, &rig, mode);
        let scenes = vec![SceneViews {
            renders: encode_all(&images, Image::to_srgb8)?,
            differences: Vec::new(),
            wireframes: wireframes(reference, &rig)?,
        }];
        Ok(Self { rig, origin: reference.origin, mode, reference: images, scenes })
    }

    /// The direction from the middle to the camera of a view, as three numbers.
    pub(super) fn direction(&self, view: usize) -> String {
        let [x, y, z] = (-self.rig.cameras[view].forward).to_array();
        format!("{x:.5} {y:.5} {z:.5}")
    }

    /// Draws a candidate beside it.
    ///
    /// # Errors
    /// [`Error::Internal`] if an encoder fails.
    pub fn add(&mut self, candidate: &Scene) -> Result<()> {
        let candidate = &*candidate.counted_from(self.origin);
        let images = render_views(candidate, &self.rig, self.mode);
        let pairs: Vec<(&Image, &Image)> = self.reference.iter().zip(&images).collect();
        self.scenes.push(SceneViews {
            renders: encode_all(&images, Image::to_srgb8)?,
            differences: encode_all(&pairs, |(own, other)| {
                let side = DIFFERENCE_SIDE;
                resize(&difference_map(own, other), side, side, FilterType::Triangle)
            })?,
            wireframes: wireframes(candidate, &self.rig)?,
        });
        Ok(())
    }
}

fn encode_all<T: Sync>(of: &[T], draw: impl Fn(&T) -> RgbImage + Sync) -> Result<Vec<Picture>> {
    of.par_iter().map(|each| Picture::new(&draw(each))).collect()
}

fn wireframes(scene: &Scene, rig: &Rig) -> Result<Vec<Picture>> {
    encode_all(&rig.cameras, |camera| draw_wireframe(scene, camera, WIRE_SIDE))
}

/// The outcome of the repair of an asset's images, in pictures.
#[derive(Clone, Debug, Default)]
pub struct AtlasPictures {
    /// The first of the repaired ones.
    pub shown: Vec<AtlasPicture>,
    /// Number of repaired ones that are not shown.
    pub more: usize,
    /// Images that were left alone, and why.
    pub left_alone: Vec<(usize, LeftAlone)>,
}

/// An atlas before and after its repair.
#[derive(Clone, Debug)]
pub struct AtlasPicture {
    /// Its index among the document's images.
    pub image: usize,
    /// Its name, if it has one.
    pub name: Option<String>,
    /// The meaning of its texels.
    pub role: Option<Role>,
    /// Width and height in texels.
    pub size: [usize; 2],
    /// Texels that charts cover.
    pub covered: usize,
    /// Texels that were filled.
    pub filled: usize,
    /// Texels that could not be.
    pub remaining: usize,
    /// The counts of texels that filtering inside the charts read before, at each mip level.
    pub reads: Vec<MipReads>,
    /// The image as it came.
    pub before: Picture,
    /// What was filled in color, all else in dim gray.
    pub fill: Picture,
    /// The image as it is now.
    pub after: Picture,
}

impl AtlasPicture {
    /// Reads of invalid texels after the repair at a mip level that had so many before: a fill
    /// leaves none of them or all.
    pub fn reads_after(&self, before: usize) -> usize {
        if self.remaining == 0 { 0 } else { before }
    }
}

/// Draws the repaired images of an asset: as they were, what was filled, and as they are.
///
/// # Errors
/// [`Error::Invalid`] if an image is damaged or takes more memory than `limit`.
pub fn draw_atlases(
    asset: &Asset,
    repairs: &[ImageRepair],
    limit: MemoryLimit,
) -> Result<AtlasPictures> {
    let repaired: Vec<(&ImageRepair, &Repaired)> =
        repairs.iter().filter_map(|each| Some((each, each.result.as_ref().ok()?))).collect();
    let left_alone =
        repairs.iter().filter_map(|each| Some((each.image, *each.result.as_ref().err()?)));
    let shown = &repaired[..repaired.len().min(MOST_ATLASES)];
    Ok(AtlasPictures {
        shown: shown
            .par_iter()
            .map(|(repair, repaired)| draw_atlas(asset, repair, repaired, limit))
            .collect::<Result<_>>()?,
        more: repaired.len() - shown.len(),
        left_alone: left_alone.collect(),
    })
}

fn draw_atlas(
    asset: &Asset,
    repair: &ImageRepair,
    repaired: &Repaired,
    limit: MemoryLimit,
) -> Result<AtlasPicture> {
    let at = format!("/images/{}", repair.image);
    let before = decode(&asset.images[repair.image], &at, limit)?;
    let validity = &repaired.validity;
    let mut kept = validity.clone();
    if repaired.outcome.hidden > 0 {
        kept.intersect(&seen_texels(&repaired.texels));
    }
    let fill = draw_fill(&repaired.texels, &kept).into();
    Ok(AtlasPicture {
        image: repair.image,
        name: asset.image_name(repair.image).map(str::to_owned),
        role: repair.role,
        size: [validity.width(), validity.height()],
        covered: validity.valid(),
        filled: repaired.outcome.filled,
        remaining: repaired.outcome.remaining,
        reads: repaired.reads(Footprint::default()).mips,
        before: Picture::new(&thumbnail(&before))?,
        fill: Picture::new(&thumbnail(&fill))?,
        after: Picture::new(&thumbnail(&repaired.texels))?,
    })
}

/// An image as small as it is shown, without its alpha, which would hide what was filled.
pub(super) fn thumbnail(image: &DynamicImage) -> RgbImage {
    let opaque = DynamicImage::ImageRgb8(image.to_rgb8());
    if image.width().max(image.height()) <= ATLAS_SIDE {
        return opaque.into_rgb8();
    }
    opaque.thumbnail(ATLAS_SIDE, ATLAS_SIDE).into_rgb8()
}

#[cfg(test)]
mod tests {
    use image::Rgb;

    use super::*;
    use crate::evaluate::scene::Material;

    /// The pixels of a picture.
    fn decode_uri(picture: &Picture) -> RgbImage {
        let (head, base64) = picture.uri.split_once(',').unwrap();
        assert!(["data:image/png;base64", "data:image/jpeg;base64"].contains(&head), "{head}");
        let bytes = STANDARD.decode(base64).unwrap();
        image::load_from_memory(&bytes).unwrap().into_rgb8()
    }

    #[test]
    fn a_picture_is_the_smaller_of_png_and_jpeg() {
        let flat = RgbImage::from_pixel(64, 64, Rgb([9, 90, 200]));
        let noise = RgbImage::from_fn(64, 64, |x, y| {
            let mixed = (x * 64 + y + 1).wrapping_mul(0x9e37_79b9);
            let hash = (mixed ^ mixed >> 15).wrapping_mul(0x85eb_ca6b) >> 8;
            Rgb([hash as u8, (hash >> 8) as u8, (hash >> 16) as u8])
        });
        let [flat_picture, noisy] = [&flat, &noise].map(|pixels| Picture::new(pixels).unwrap());
        assert_eq!(decode_uri(&flat_picture), flat);
        assert!(noisy.uri.starts_with("data:image/jpeg"));
        assert_eq!(decode_uri(&noisy).dimensions(), (64, 64));
    }

    #[test]
    fn a_gallery_has_a_column_for_each_scene() {
        let scene = Scene {
            positions: vec![glam::Vec3::ZERO, glam::Vec3::X, glam::Vec3::Y],
            normals: vec![glam::Vec3::Z; 3],
            triangles: vec![[0, 1, 2], [0, 2, 1]],
            triangle_materials: vec![0; 2],
            materials: vec![Material::default()],
            ..Scene::default()
        };
        let mut gallery = Gallery::new(&scene).unwrap();
        gallery.add(&scene).unwrap();
        let [own, other] = gallery.scenes.as_slice() else { panic!("two scenes") };
        assert_eq!((own.renders.len(), own.differences.len()), (VIEWS, 0));
        assert_eq!((other.renders.len(), other.differences.len()), (VIEWS, VIEWS));
        assert!(own.renders.iter().zip(&other.renders).all(|(a, b)| a.uri == b.uri));
        let unlit = Gallery::with_mode(&scene, Mode::Unlit).unwrap();
        assert_ne!(unlit.scenes[0].renders[0].uri, own.renders[0].uri);
        let black = decode_uri(&other.differences[0]);
        assert!(black.pixels().all(|pixel| *pixel == Rgb([0; 3])));
    }
}
