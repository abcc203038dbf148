//! A picture of what a repair filled: everything that was kept in dim gray, what was filled in
//! color.

use image::{DynamicImage, Luma, Rgb, RgbImage};
use seamwise_texture::Validity;
use seamwise_texture::color::{linear_to_srgb8, luminance};

/// How bright kept texels are, of their own gray.
const DIM: f32 = 0.4;

/// Tint of filled texels, 8-bit sRGB, and its share; a tint, as a fill may itself be gray.
const TINT: [f32; 3] = [255.0, 140.0, 0.0];
const TINT_SHARE: f32 = 0.3;

/// The share of an image of floats that is drawn without being cut off at white.
const EXPOSED: f64 = 0.99;

/// Draws it. `texels` is the image after its repair, `kept` what was not filled.
///
/// An image of floats is exposed so that the 99th percentile of what was kept is white. Alpha is
/// left out: it would hide what was filled.
pub(crate) fn draw_fill(texels: &DynamicImage, kept: &Validity) -> RgbImage {
    let mut picture = displayed(texels, kept);
    for (texel, &kept) in picture.pixels_mut().zip(kept.flags()) {
        *texel = if kept { dimmed(*texel) } else { tinted(*texel) };
    }
    picture
}

/// An image as a screen shows it.
fn displayed(texels: &DynamicImage, kept: &Validity) -> RgbImage {
    let (DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_)) = texels else {
        return texels.to_rgb8();
    };
    let floats = texels.to_rgb32f();
    let bright = floats.pixels().zip(kept.flags()).filter(|(_, kept)| **kept);
    let mut bright: Vec<f32> =
        bright.map(|(texel, _)| luminance(texel.0)).filter(|light| light.is_finite()).collect();
    let last = (bright.len() as f64 * EXPOSED) as usize;
    let white = match bright.len() {
        0 => 1.0,
        some => *bright.select_nth_unstable_by(last.min(some - 1), f32::total_cmp).1,
    };
    let unit = if white > 0.0 { 1.0 / white } else { 1.0 };
    let shown = |texel: &Rgb<f32>| Rgb(texel.0.map(|light| linear_to_srgb8(light * unit)));
    RgbImage::from_fn(floats.width(), floats.height(), |x, y| shown(floats.get_pixel(x, y)))
}

fn dimmed(texel: Rgb<u8>) -> Rgb<u8> {
    let Luma([gray]) = image::Pixel::to_luma(&texel);
    Rgb([(f32::from(gray) * DIM) as u8; 3])
}

fn tinted(texel: Rgb<u8>) -> Rgb<u8> {
    let mix = |k: usize| f32::from(texel.0[k]) * (1.0 - TINT_SHARE) + TINT[k] * TINT_SHARE;
    Rgb(std::array::from_fn(|k| mix(k).round() as u8))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(texels: &DynamicImage) -> Vec<[u8; 3]> {
        let kept = Validity::from_flags(2, 1, vec![true, false]);
        draw_fill(texels, &kept).pixels().map(|texel| texel.0).collect()
    }

    #[test]
    fn what_was_kept_is_gray_and_what_was_filled_is_not() {
        let gray = image::RgbImage::from_pixel(2, 1, Rgb([100; 3]));
        assert_eq!(drawn(&gray.into()), [[40; 3], [147, 112, 70]]);
    }

    #[test]
    fn floats_are_exposed_and_what_is_no_number_does_not_matter() {
        for texel in [[8.0, 8.0, 8.0, 0.0], [f32::NAN; 4], [0.0; 4]] {
            let image = image::Rgba32FImage::from_pixel(2, 1, image::Rgba(texel));
            let [kept, filled] = drawn(&image.into())[..] else { panic!("two texels") };
            assert!(kept[0] == kept[1] && filled[0] > filled[2], "{kept:?} {filled:?}");
            assert!(texel[0] != 8.0 || kept == [102; 3] && filled[0] == 255);
        }
    }
}
