//! The format in which an image of a level is stored.

use std::borrow::Cow;

use image::DynamicImage;
use seamwise_texture::Role;
use seamwise_texture::transfer::Picture;

use crate::error::{Error, Result};
use crate::image_file::codec::{EncodeOptions, decode, encode_anew, encode_with};
use crate::image_file::encoded::{EncodedImage, ImageFormat};
use crate::image_file::lossy_webp;
use crate::image_file::metadata::Metadata;
use crate::image_file::palette::{has_palette, reduce};
use crate::limit::MemoryLimit;

/// File formats of textures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureFormat {
    /// The format of the source's image, colors of a PNG with a palette in one again; PNG for a
    /// normal map that a level gains.
    #[default]
    Keep,
    /// Lossless.
    Png,
    /// JPEG for opaque colors of eight bits. What else an image holds does not take its losses well,
    /// and is stored as PNG.
    Jpeg,
    /// Lossless and smaller than PNG, in `EXT_texture_webp`, which readers must know; PNG for more
    /// than eight bits.
    WebP,
    /// Colors with losses, transparent ones too, and all else losslessly, in `EXT_texture_webp`; PNG for more than
    /// eight bits.
    LossyWebP,
}

/// [`store`], and what a reader of the file gets to see.
pub(super) fn store_to_read(
    image: &DynamicImage,
    role: Role,
    before: Option<&EncodedImage>,
    format: (TextureFormat, u8),
    limit: MemoryLimit,
) -> Result<(EncodedImage, Picture)> {
    let file = store(image, role, before, format)?;
    let decoded = match is_exact(&file, role, before, format.0) {
        true => None,
        false => Some(decode(&file, "a level's image", limit)?),
    };
    let picture = Picture::without_mips(decoded.as_ref().unwrap_or(image), role);
    Ok((file, picture.map_err(Error::internal)?))
}

/// Whether a file of [`store`] holds the image's own texels.
fn is_exact(
    file: &EncodedImage,
    role: Role,
    before: Option<&EncodedImage>,
    format: TextureFormat,
) -> bool {
    let is_reduced = || {
        let palette = before.is_some_and(|before| has_palette(&before.bytes));
        palette && role == Role::Color && format == TextureFormat::Keep
    };
    match file.format {
        ImageFormat::Png => !is_reduced(),
        ImageFormat::WebP => role != Role::Color || format != TextureFormat::LossyWebP,
        _ => false,
    }
}

/// Stores an image that replaces `before`, if it replaces one.
pub(super) fn store(
    image: &DynamicImage,
    role: Role,
    before: Option<&EncodedImage>,
    (format, quality): (TextureFormat, u8),
) -> Result<EncodedImage> {
    let plain = |image: &DynamicImage, format| {
        encode_with(image, &Metadata::default(), format, EncodeOptions { quality, png: false })
    };
    let is_small = image.color().bytes_per_pixel() == image.color().channel_count();
    match (format, before) {
        (TextureFormat::Keep, Some(before)) => {
            let few = (role == Role::Color && has_palette(&before.bytes)).then(|| reduce(image));
            let image = few.flatten().map_or(Cow::Borrowed(image), Cow::Owned);
            encode_anew(&image, before, EncodeOptions { quality, png: false })
        }
        (TextureFormat::Jpeg, _) if role == Role::Color && is_small && is_opaque(image) => {
            plain(&image.to_rgb8().into(), ImageFormat::Jpeg)
        }
        (TextureFormat::LossyWebP, _) if role == Role::Color && is_small => {
            let bytes = lossy_webp::encode(image, quality)?.into();
            Ok(EncodedImage { bytes, format: ImageFormat::WebP })
        }
        (TextureFormat::WebP | TextureFormat::LossyWebP, _) if is_small => {
            plain(image, ImageFormat::WebP)
        }
        (_, Some(before)) => encode_anew(image, before, EncodeOptions { quality, png: true }),
        (_, None) => plain(image, ImageFormat::Png),
    }
}

fn is_opaque(image: &DynamicImage) -> bool {
    !image.color().has_alpha() || image.to_rgba8().pixels().all(|texel| texel.0[3] == u8::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(alpha: u8) -> DynamicImage {
        image::RgbaImage::from_pixel(4, 4, image::Rgba([9, 90, 200, alpha])).into()
    }

    #[test]
    fn only_opaque_colors_become_jpegs() {
        let stored = |alpha, role| {
            store(&picture(alpha), role, None, (TextureFormat::Jpeg, 90)).unwrap().format
        };
        assert_eq!(stored(255, Role::Color), ImageFormat::Jpeg);
        assert_eq!(stored(254, Role::Color), ImageFormat::Png);
        assert_eq!(stored(255, Role::Normal), ImageFormat::Png);
        assert_eq!(stored(255, Role::Data), ImageFormat::Png);
    }

    #[test]
    fn colors_of_a_palette_stay_in_one_and_other_texels_do_not() {
        let few: DynamicImage =
            image::RgbImage::from_fn(8, 8, |x, _| image::Rgb([x as u8; 3])).into();
        let bytes = crate::image_file::palette::write_indexed(&few).expect("eight colors").into();
        let before = EncodedImage { bytes, format: ImageFormat::Png };
        let many: DynamicImage =
            image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([x as u8, y as u8, 0])).into();
        let stored = |image, role, format| {
            let stored = store(image, role, Some(&before), (format, 90)).unwrap();
            has_palette(&stored.bytes)
        };
        assert!(stored(&many, Role::Color, TextureFormat::Keep));
        assert!(!stored(&many, Role::Data, TextureFormat::Keep));
        assert!(!stored(&many, Role::Color, TextureFormat::Png), "lossless");
        assert!(stored(&few, Role::Data, TextureFormat::Png));
    }

    #[cfg(feature = "webp")]
    #[test]
    fn colors_alone_lose_in_a_webp_and_keep_their_alpha_and_what_it_hides() {
        let print = image::RgbaImage::from_fn(64, 64, |x, y| {
            let mixed = (x * 64 + y + 1).wrapping_mul(0x9e37_79b9);
            let noise = ((mixed ^ (mixed >> 15)).wrapping_mul(0x85eb_ca6b) >> 28) as u8;
            let [red, green] = [60 + 2 * x as u8 + noise, 200 - 2 * y as u8 + noise];
            image::Rgba([red, green, 90, if x < 32 { 255 } else { (y * 4) as u8 }])
        });
        let print = DynamicImage::from(print);
        let stored = |role, quality| {
            let stored = store(&print, role, None, (TextureFormat::LossyWebP, quality)).unwrap();
            assert_eq!(ImageFormat::detect(&stored.bytes), Some(ImageFormat::WebP));
            let texels = decode(&stored, "", MemoryLimit::default()).unwrap().to_rgba8();
            (stored.bytes.len(), texels)
        };
        let own = print.to_rgba8();
        let (lossless, data) = stored(Role::Data, 90);
        assert_eq!(data, own);
        let [(good, texels), (poor, _)] = [90, 30].map(|quality| stored(Role::Color, quality));
        assert!(poor < good && good < lossless, "{poor} {good} {lossless}");
        for (a, b) in texels.pixels().zip(own.pixels()) {
            assert_eq!(a.0[3], b.0[3]);
            assert!((0..3).all(|k| a.0[k].abs_diff(b.0[k]) < 40), "{a:?} {b:?}");
        }
        let deep = DynamicImage::new_rgb16(2, 2);
        let stored = store(&deep, Role::Color, None, (TextureFormat::LossyWebP, 90)).unwrap();
        assert_eq!(stored.format, ImageFormat::Png);
    }

    #[test]
    fn what_is_called_exact_is_read_as_it_was() {
        let colors = image::RgbImage::from_fn(40, 40, |x, y| {
            image::Rgb([(x * 6) as u8, (y * 6) as u8, (x * y) as u8])
        });
        let few = image::RgbImage::from_fn(4, 4, |x, _| image::Rgb([x as u8; 3])).into();
        let palette = crate::image_file::palette::write_indexed(&few).expect("four colors").into();
        let palette = EncodedImage { bytes: palette, format: ImageFormat::Png };
        let alike = |format| {
            store(&colors.clone().into(), Role::Data, None, (format, 90))
                .expect("a file of its kind")
        };
        let kinds = [TextureFormat::Png, TextureFormat::WebP, TextureFormat::Jpeg];
        let before =
            kinds.map(|format| Some(alike(format))).into_iter().chain([None, Some(palette)]);
        let deep = DynamicImage::from(colors.clone()).into_rgb16();
        let images: [DynamicImage; 2] = [colors.into(), deep.into()];
        let mut exact = 0;
        for before in before {
            for (image, format) in images.iter().flat_map(|image| {
                let lossy = cfg!(feature = "webp").then_some(TextureFormat::LossyWebP);
                kinds.into_iter().chain([TextureFormat::Keep]).chain(lossy).map(move |f| (image, f))
            }) {
                for role in [Role::Color, Role::Normal, Role::Data] {
                    let Ok(file) = store(image, role, before.as_ref(), (format, 90)) else {
                        continue;
                    };
                    let read = decode(&file, "", MemoryLimit::default()).expect("a file of ours");
                    if is_exact(&file, role, before.as_ref(), format) {
                        assert_eq!(read.to_rgba16(), image.to_rgba16(), "{format:?} {role:?}");
                        exact += 1;
                    }
                }
            }
        }
        assert!(exact > 60, "{exact}");
    }

    #[test]
    fn a_format_is_kept_or_changed_as_asked() {
        let jpeg = store(&picture(255), Role::Color, None, (TextureFormat::Jpeg, 90)).unwrap();
        let opaque = DynamicImage::from(picture(255).to_rgb8());
        let stored =
            |format| store(&opaque, Role::Color, Some(&jpeg), (format, 90)).unwrap().format;
        assert_eq!(stored(TextureFormat::Keep), ImageFormat::Jpeg);
        assert_eq!(stored(TextureFormat::Png), ImageFormat::Png);
        assert_eq!(stored(TextureFormat::WebP), ImageFormat::WebP);
        let deep = DynamicImage::new_rgb16(2, 2);
        let stored = store(&deep, Role::Data, None, (TextureFormat::WebP, 90)).unwrap().format;
        assert_eq!(stored, ImageFormat::Png);
    }
}
