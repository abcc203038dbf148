//! Images to KTX2 files in UASTC, with all mip maps.
//!
//! Mip maps are made here and not by the encoder: each texel is the mean over its exact extent, of colors in
//! linear light and of those that are seen, of normals as vectors that are scaled back to length 1, of all else
//! as stored; see [`scale_down`]. So they hold of an atlas what it holds: of a repaired one nothing but what lies
//! on charts and what continues it.
//!
//! A side that is no multiple of four, which `KHR_texture_basisu` asks for, becomes the next one.

use image::imageops::FilterType;
use image::{DynamicImage, RgbaImage};
use rayon::prelude::*;
use seamwise_texture::{Role, Validity, scale_down};

use super::container::{Level, Texture};
use crate::error::{Error, Result};

/// Texels along each side of a block.
pub(crate) const BLOCK_SIDE: usize = 4;
/// Bytes of a block.
const BLOCK_BYTES: usize = 16;
/// Mip maps are made from the last one whose number this divides: rounding to 8 bits adds up once in so many.
const STEP: usize = 3;

/// Bytes of an image of so many texels and of all its mip maps on a graphics processor, in blocks of 4 × 4 texels and
/// 16 bytes, as BC7 and ASTC have them.
pub(crate) fn bytes_in_blocks(size: [usize; 2], levels: usize) -> u64 {
    mip_sizes(size)
        .take(levels)
        .map(|size| {
            let [wide, high] = size.map(|side| side.div_ceil(BLOCK_SIDE));
            (wide * high * BLOCK_BYTES) as u64
        })
        .sum()
}

/// The same of all of its mip maps, in memory.
pub(crate) fn bytes_with_mips(size: [usize; 2]) -> usize {
    bytes_in_blocks(size, usize::MAX) as usize
}

/// Sizes of an image and of its mip maps, down to one texel.
pub(crate) fn mip_sizes(size: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    let levels = size[0].max(size[1]).max(1).ilog2() as usize;
    (0..=levels).map(move |level| size.map(|side| (side >> level).max(1)))
}

/// The size that an image takes in a file.
pub(crate) fn stored_size(size: [usize; 2]) -> [usize; 2] {
    size.map(|side| side.next_multiple_of(BLOCK_SIDE))
}

/// Encodes an image whose texels have a meaning.
///
/// # Errors
/// [`Error::Internal`] if the encoder refuses it; [`Error::Options`] in a build without it.
pub(crate) fn encode(image: &DynamicImage, role: Role) -> Result<Vec<u8>> {
    let size = [image.width(), image.height()];
    let own = stored_size(size.map(|side| side as usize)).map(|side| side as u32);
    let resized = (own != size).then(|| image.resize_exact(own[0], own[1], FilterType::Triangle));
    let levels = mip_maps(resized.unwrap_or_else(|| image.clone()), role)?;
    let levels: Vec<_> = levels.iter().map(DynamicImage::to_rgba8).collect();
    let has_alpha = levels[0].pixels().any(|texel| texel.0[3] < u8::MAX);
    let levels = levels.par_iter().map(compress).collect::<Result<_>>()?;
    Ok(Texture { size: own, is_color: role == Role::Color, has_alpha, levels }.to_file())
}

/// An image and its mip maps.
fn mip_maps(image: DynamicImage, role: Role) -> Result<Vec<DynamicImage>> {
    let count = mip_sizes([image.width() as usize, image.height() as usize]).count();
    let mut levels = vec![image];
    for level in 1..count {
        let from = (level - 1) / STEP * STEP;
        let [width, height] =
            [levels[from].width(), levels[from].height()].map(|side| side as usize);
        let all = Validity::from_flags(width, height, vec![true; width * height]);
        let halvings = (level - from) as u32;
        let (smaller, _) =
            scale_down(&levels[from], role, &all, halvings).map_err(Error::internal)?;
        levels.push(smaller);
    }
    Ok(levels)
}

/// Effort of Zstandard, 1…22. On a scan's color and a helmet's blocks come to 0.270 and 0.766 of their bytes with 9, to
/// 0.269 and 0.754 with 15, and to 0.253 and 0.753 with 18, for 0.1 to 0.3 s per million texels, a quarter of what
/// encoding them takes.
#[cfg(feature = "ktx2")]
const EFFORT: i32 = 18;

#[cfg(feature = "ktx2")]
fn compress(level: &RgbaImage) -> Result<Level> {
    let [width, height] = [level.width(), level.height()].map(|side| side as usize);
    let blocks = seamwise_uastc::encode(level.as_raw(), width, height).map_err(Error::internal)?;
    let bytes = zstd::bulk::compress(&blocks, EFFORT).map_err(Error::internal)?;
    Ok(Level { bytes, block_bytes: blocks.len() })
}

#[cfg(not(feature = "ktx2"))]
fn compress(_: &RgbaImage) -> Result<Level> {
    Err(not_built())
}

/// Makes sure that this build has the encoder.
///
/// # Errors
/// [`Error::Options`] that names the feature, if not.
pub(crate) fn check_built() -> Result<()> {
    if cfg!(feature = "ktx2") { Ok(()) } else { Err(not_built()) }
}

fn not_built() -> Error {
    let what = "textures in KTX2 need the feature ktx2, which this program was built without: build it with \
                --features ktx2, which takes a C++ compiler";
    Error::Options { what: what.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mip_maps_average_light_vectors_and_numbers_each_as_it_means() {
        let check = RgbaImage::from_fn(16, 8, |x, y| {
            image::Rgba(if (x + y) % 2 == 0 { [255, 255, 255, 255] } else { [0, 0, 0, 255] })
        });
        let of = |role| {
            let levels = mip_maps(check.clone().into(), role).unwrap();
            let sizes: Vec<_> = levels.iter().map(|own| [own.width(), own.height()]).collect();
            assert_eq!(sizes, [[16, 8], [8, 4], [4, 2], [2, 1], [1, 1]]);
            let last = |at: usize| levels[at].to_rgba8().pixels().next_back().copied().unwrap().0;
            assert!((1..5).all(|at| last(at) == last(1)), "{levels:?}");
            last(1)
        };
        assert_eq!(of(Role::Color), [188, 188, 188, 255], "half of the light");
        assert_eq!(of(Role::Data), [128, 128, 128, 255]);
        // Normals that lean to +x and to −x.
        let lean = RgbaImage::from_fn(8, 8, |x, _| {
            image::Rgba([if x % 2 == 0 { 218 } else { 37 }, 128, 218, 255])
        });
        let levels = mip_maps(lean.into(), Role::Normal).unwrap();
        let [x, y, z, _] = levels[3].to_rgba8().pixels().next().unwrap().0;
        assert!(x.abs_diff(128) < 2 && y.abs_diff(128) < 2 && z > 252, "{x} {y} {z}");
    }

    #[test]
    fn colors_of_texels_that_nobody_sees_do_not_show_in_mip_maps() {
        let leaf = RgbaImage::from_fn(8, 8, |x, _| {
            image::Rgba(if x % 2 == 0 { [20, 120, 30, 255] } else { [255, 255, 255, 0] })
        });
        let levels = mip_maps(leaf.into(), Role::Color).unwrap();
        assert_eq!(levels[1].to_rgba8().get_pixel(0, 0).0, [20, 120, 30, 128]);
    }

    #[cfg(feature = "ktx2")]
    #[test]
    fn a_file_is_read_back_and_its_sides_are_multiples_of_four() {
        let picture = RgbaImage::from_fn(30, 21, |x, y| {
            image::Rgba([60 + 4 * x as u8, 200 - 6 * y as u8, 90, 255 - 3 * x as u8])
        });
        for (role, picture) in [
            (Role::Color, DynamicImage::from(picture.clone())),
            (Role::Data, DynamicImage::from(picture.clone()).to_rgb8().into()),
            (Role::Data, DynamicImage::from(picture.clone()).to_luma16().into()),
        ] {
            let file = encode(&picture, role).unwrap();
            assert_eq!(super::super::container::level_count(&file), Some(6));
            let own =
                super::super::decode::decode(&file, crate::limit::MemoryLimit::default()).unwrap();
            assert_eq!((own.width(), own.height()), (32, 24));
            assert_eq!(own.color().has_alpha(), picture.color().has_alpha());
            let resized = picture.resize_exact(32, 24, FilterType::Triangle).to_rgba8();
            let own = own.to_rgba8();
            let most = own.iter().zip(resized.iter()).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(most < Some(12), "{most:?}");
        }
    }
}
