//! Normal maps told from colors by what their texels are: vectors of length 1 about +z.

use image::DynamicImage;

use crate::validity::Validity;

/// The most that the length of a texel's vector differs from 1. Half a step of 8 bits in each component
/// makes 0.007; filtering, and a lossy codec, make up to this of smooth maps.
const TOLERANCE: f32 = 0.05;

/// So large a share of the texels is of that length.
const SHARE: f64 = 0.9;

/// The most that the mean of all of them leans from +z: its component along the surface.
const LEAN: f64 = 0.2;

/// Whether an image of three or four channels of integers is a normal map in tangent space: nine
/// tenths of its valid texels, those of alpha 0 aside, stand for vectors of length 1 with z above 0,
/// and their mean leans by less than 12°. Bluish colors are shorter or longer, gray of that length
/// (201) leans by 55°, and one flat color that passes is a flat normal map.
///
/// Not guaranteed: maps of two components, in object space, or in floats are not recognised.
pub fn is_normal_map(image: &DynamicImage, validity: &Validity) -> bool {
    use DynamicImage::{ImageRgb8, ImageRgb16, ImageRgba8, ImageRgba16};
    let is_known = matches!(image, ImageRgb8(_) | ImageRgb16(_) | ImageRgba8(_) | ImageRgba16(_));
    if !is_known || validity.expect_size_of(image).is_err() {
        return false;
    }
    let (mut all, mut unit, mut sum) = (0usize, 0usize, [0.0f64; 3]);
    // 8 bits tell the length well enough.
    let texels = image.to_rgba8();
    for (texel, _) in texels.pixels().zip(validity.flags()).filter(|(_, valid)| **valid) {
        let [r, g, b, a] = texel.0;
        if a == 0 {
            continue;
        }
        let vector = [r, g, b].map(|sample| f32::from(sample) / 127.5 - 1.0);
        let length = vector.iter().map(|v| v * v).sum::<f32>().sqrt();
        all += 1;
        if (length - 1.0).abs() <= TOLERANCE && vector[2] > 0.0 {
            unit += 1;
            sum.iter_mut().zip(vector).for_each(|(sum, v)| *sum += f64::from(v));
        }
    }
    let [x, y, _] = sum.map(|sum| sum / unit.max(1) as f64);
    unit > 0 && unit as f64 >= SHARE * all as f64 && x.hypot(y) < LEAN
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, RgbImage};

    fn is_normal(texel: impl Fn(f32, f32) -> [u8; 3]) -> bool {
        let at = |v: u32| v as f32 / 63.0;
        let image = RgbImage::from_fn(64, 64, |x, y| Rgb(texel(at(x), at(y))));
        is_normal_map(&image.into(), &Validity::from_flags(64, 64, vec![true; 64 * 64]))
    }

    fn encoded(vector: [f32; 3]) -> [u8; 3] {
        let length = vector.iter().map(|v| v * v).sum::<f32>().sqrt();
        vector.map(|v| (v / length * 127.5 + 127.5).round() as u8)
    }

    #[test]
    fn bumps_and_flat_maps_are_normals_and_colors_are_not() {
        let wave = |v: f32| 0.6 * (20.0 * v).sin();
        assert!(is_normal(|x, y| encoded([wave(x), wave(y), 1.0])));
        assert!(is_normal(|_, _| [128, 128, 255]));
        // What a codec or a filter leaves of them.
        assert!(is_normal(|x, y| encoded([wave(x), wave(y), 1.0]).map(|v| v.saturating_sub(3))));
        let sky = |_: f32, y: f32| [135.0, 170.0 + 40.0 * y, 235.0].map(|v| v as u8);
        assert!(!is_normal(sky));
        assert!(!is_normal(|_, _| [201; 3]), "gray of length 1");
        assert!(!is_normal(|x, y| [255.0 * x, 255.0 * y, 128.0].map(|v| v as u8)));
        assert!(!is_normal(|x, y| encoded([x - 0.5, y - 0.5, -1.0])), "from behind");
        let noise = |x: f32, y: f32, k: f32| ((x * 91.7 + y * 47.3 + k).sin() * 4e4).fract().abs();
        assert!(!is_normal(|x, y| [0.0, 1.0, 2.0].map(|k| (255.0 * noise(x, y, k)) as u8)));
    }

    #[test]
    fn only_valid_texels_that_are_seen_count() {
        let image =
            RgbImage::from_fn(4, 1, |x, _| Rgb(if x < 2 { [128, 128, 255] } else { [0; 3] }));
        let with = |valid: [bool; 4]| {
            is_normal_map(&image.clone().into(), &Validity::from_flags(4, 1, valid.to_vec()))
        };
        assert!(with([true, true, false, false]) && !with([true; 4]) && !with([false; 4]));
        assert!(!is_normal_map(
            &DynamicImage::new_luma8(1, 1),
            &Validity::from_flags(1, 1, vec![true])
        ));
    }
}
