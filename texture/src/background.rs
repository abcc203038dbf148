//! Validity without a mesh: what has the atlas's background color is invalid.
//!
//! Thresholding the color is not enough at two places. A texel of that color amid a chart is
//! content: only background that reaches the image's border, or has the area of a gap between
//! charts, counts. And the rim of a chart is blended with the background, or stained by a lossy
//! codec: the outermost ring of texels is trimmed.
//!
//! Between the charts of a lightmap lie fireflies: texels that a path tracer hit once, of a light
//! far above all others, and of infinite light or none that is a number. One of them, taken for a
//! chart, would light up the whole gap. So in images of floats, what is no number is background
//! where background is around it; and after trimming, valid texels in a component (connected along
//! rows, columns and diagonals) of at most 4, or of fewer than 64 with one in it that is brighter
//! than 20 times the 99.9th percentile of the components of 64 and more, are invalid.

use std::collections::BTreeMap;

use image::{DynamicImage, Rgba32FImage};

use crate::color::luminance;
use crate::validity::Validity;

/// Background that does not reach the image's border has at least this many texels.
const LEAST_GAP: usize = 64;

/// A component of at most this many valid texels in an image of floats is a firefly…
const SPECK: usize = 4;

/// …and so is one of fewer than this many…
const LEAST_CHART: usize = 64;

/// …with a texel so many times brighter than all but a thousandth of the others.
const FIREFLY: f32 = 20.0;

/// Along rows and columns.
const BESIDE: [[isize; 2]; 4] = [[-1, 0], [1, 0], [0, -1], [0, 1]];

/// Along rows, columns and diagonals.
const AROUND: [[isize; 2]; 8] =
    [[-1, 0], [1, 0], [0, -1], [0, 1], [-1, -1], [1, -1], [-1, 1], [1, 1]];

/// Background holds at least this share of the texels along the image's border…
const BORDER_SHARE: f32 = 0.25;

/// …and of all texels.
const IMAGE_SHARE: f32 = 0.02;

/// How far a texel may be from the background color to be counted for those shares: three steps of
/// 8 bits, what a JPEG of good quality does to a flat color.
const CODEC_NOISE: f32 = 3.0 / 255.0;

/// The color of the atlas's background, if it has one: the most frequent color along the image's
/// border, provided that it holds a quarter of the border and a fiftieth of the image, and that
/// something else is there as well.
///
/// RGBA as stored (encoded, not linear), 0…1 for integer images. Not guaranteed: a picture with a
/// flat border of its own, white paper say, is taken for charts on a background.
pub fn detect_background(image: &DynamicImage) -> Option<[f32; 4]> {
    let rgba = image.to_rgba32f();
    let (width, height) = rgba.dimensions();
    if width == 0 || height == 0 {
        return None;
    }
    let across = (0..width).flat_map(|x| [(x, 0), (x, height - 1)]);
    let down = (0..height).flat_map(|y| [(0, y), (width - 1, y)]);
    let border: Vec<[f32; 4]> = across.chain(down).map(|(x, y)| rgba.get_pixel(x, y).0).collect();
    let mut counts = BTreeMap::new();
    for color in border.iter().filter(|color| color.iter().all(|v| v.is_finite())) {
        *counts.entry(color.map(f32::to_bits)).or_insert(0usize) += 1;
    }
    // Of equally frequent colors the first in the order of their bits, the same one every time.
    let (bits, _) = counts.iter().rev().max_by_key(|(_, count)| **count)?;
    let color = bits.map(f32::from_bits);
    let share = |texels: usize, all: usize| texels as f32 / all as f32;
    let on_border = border.iter().filter(|texel| is_near(texel, &color, CODEC_NOISE)).count();
    let in_image = rgba.pixels().filter(|texel| is_near(&texel.0, &color, CODEC_NOISE)).count();
    let all = rgba.pixels().len();
    let clear = share(on_border, border.len()) >= BORDER_SHARE
        && share(in_image, all) >= IMAGE_SHARE
        && in_image < all;
    clear.then_some(color)
}

/// Whether no channel is farther than `tolerance` from the color's.
fn is_near(texel: &[f32; 4], color: &[f32; 4], tolerance: f32) -> bool {
    texel.iter().zip(color).all(|(texel, color)| (texel - color).abs() <= tolerance)
}

impl Validity {
    /// Everything but the background of `color`, and but the ring of texels next to it.
    ///
    /// `color` is RGBA as stored (encoded, not linear), 0…1 for integer images; gray counts as
    /// three equal channels, an image without alpha has alpha 1. `tolerance` is the most that any
    /// channel may differ, in the same unit.
    ///
    /// Background are the texels of that color that are connected, along rows and columns, to the
    /// image's border or to an area of at least 64 texels. Not guaranteed: a chart's own content
    /// of that color and such an area is lost; a chart of two texels' width is trimmed away.
    ///
    /// In an image of floats fireflies between the charts are invalid too, as the module says; so is
    /// a small chart that is far brighter than the rest.
    pub fn from_background(image: &DynamicImage, color: [f32; 4], tolerance: f32) -> Self {
        let rgba = image.to_rgba32f();
        let (width, height) = (rgba.width() as usize, rgba.height() as usize);
        let lost = |texel: &[f32; 4]| !texel.iter().all(|v| v.is_finite());
        let unused = |texel: &[f32; 4]| is_near(texel, &color, tolerance) || lost(texel);
        let mut candidates: Vec<bool> = rgba.pixels().map(|texel| unused(&texel.0)).collect();
        let floats = matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
        let rgba = floats.then_some(rgba);
        let mut valid = vec![true; width * height];
        let mut region = Vec::new();
        for seed in 0..candidates.len() {
            if std::mem::take(&mut candidates[seed]) {
                let at_border = collect_region(&mut candidates, width, seed, &BESIDE, &mut region);
                if at_border || region.len() >= LEAST_GAP {
                    region.iter().for_each(|&texel| valid[texel] = false);
                }
            }
        }
        let trimmed = (0..valid.len()).map(|texel| {
            let (x, y) = (texel % width, texel / width);
            let near = |at: usize, size: usize| at.saturating_sub(1)..(at + 2).min(size);
            near(y, height).all(|y| near(x, width).all(|x| valid[y * width + x]))
        });
        let mut mask: Vec<bool> = trimmed.collect();
        if let Some(rgba) = rgba {
            drop_fireflies(&rgba, &mut mask);
        }
        Self::from_flags(width, height, mask)
    }
}

/// Moves the candidates connected to `seed` into `region`; tells whether it reaches the border.
fn collect_region(
    candidates: &mut [bool],
    width: usize,
    seed: usize,
    steps: &[[isize; 2]],
    region: &mut Vec<usize>,
) -> bool {
    region.clear();
    region.push(seed);
    let mut at_border = false;
    let mut next = 0;
    while let Some(&texel) = region.get(next) {
        next += 1;
        let (x, y) = (texel % width, texel / width);
        for &[dx, dy] in steps {
            let row = y.checked_add_signed(dy).filter(|y| y * width < candidates.len());
            let column = x.checked_add_signed(dx).filter(|x| *x < width);
            let neighbor = row.zip(column).map(|(y, x)| y * width + x);
            at_border |= neighbor.is_none();
            if let Some(neighbor) = neighbor.filter(|&n| std::mem::take(&mut candidates[n])) {
                region.push(neighbor);
            }
        }
    }
    at_border
}

/// Takes fireflies out of a mask of valid texels.
fn drop_fireflies(image: &Rgba32FImage, mask: &mut [bool]) {
    let light = |&texel: &usize| {
        let [r, g, b, _] = image.as_raw()[4 * texel..4 * texel + 4] else { return 0.0 };
        luminance([r, g, b])
    };
    let width = image.width() as usize;
    let mut left = mask.to_vec();
    let (mut region, mut small, mut usual) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..left.len() {
        if !std::mem::take(&mut left[seed]) {
            continue;
        }
        collect_region(&mut left, width, seed, &AROUND, &mut region);
        if region.len() <= SPECK {
            region.iter().for_each(|&texel| mask[texel] = false);
        } else if region.len() < LEAST_CHART {
            small.push(region.clone());
        } else {
            usual.extend(region.iter().map(light).filter(|light| light.is_finite()));
        }
    }
    let rank = usual.len() * 999 / 1000;
    if usual.is_empty() {
        return;
    }
    let limit = FIREFLY * *usual.select_nth_unstable_by(rank, f32::total_cmp).1;
    for region in small.iter().filter(|region| region.iter().any(|texel| light(texel) > limit)) {
        region.iter().for_each(|&texel| mask[texel] = false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Luma, Rgb, RgbImage};

    const MAGENTA: [f32; 4] = [1.0, 0.0, 1.0, 1.0];

    /// A red chart of 12 × 12 on magenta 32 × 32, its rim half covered, one magenta texel within.
    fn atlas() -> DynamicImage {
        DynamicImage::ImageRgb8(RgbImage::from_fn(32, 32, |x, y| {
            let at = |low, high| (low..high).contains(&x) && (low..high).contains(&y);
            match (x, y) {
                (15, 15) => Rgb([255, 0, 255]),
                _ if at(11, 21) => Rgb([255, 0, 0]),
                _ if at(10, 22) => Rgb([255, 0, 128]),
                _ => Rgb([255, 0, 255]),
            }
        }))
    }

    #[test]
    fn the_rim_is_trimmed_and_content_stays() {
        let validity = Validity::from_background(&atlas(), MAGENTA, 0.0);
        let inside = |v: usize| (11..21).contains(&v);
        for y in 0..32 {
            for x in 0..32 {
                assert_eq!(validity.is_valid(x, y), inside(x) && inside(y), "{x} {y}");
            }
        }
    }

    #[test]
    fn a_large_gap_between_charts_is_background_although_it_reaches_no_border() {
        let ring = |gap: u32| {
            let image = RgbImage::from_fn(24, 24, |x, y| {
                let hole = (8..8 + gap).contains(&x) && (8..8 + gap).contains(&y);
                if hole { Rgb([255, 0, 255]) } else { Rgb([9, 9, 9]) }
            });
            Validity::from_background(&DynamicImage::ImageRgb8(image), MAGENTA, 0.01).invalid()
        };
        assert_eq!(ring(7), 0);
        assert_eq!(ring(8), 100);
    }

    /// A lightmap of 48²: a chart of 20² texels of light 0.5, black around it but for squares of so
    /// many texels and so much light, one after the other below the chart.
    fn lightmap(squares: &[(u32, f32)]) -> DynamicImage {
        DynamicImage::ImageRgb32F(image::Rgb32FImage::from_fn(48, 48, |x, y| {
            let light = match (x, y) {
                (3..23, 3..23) => 0.5,
                _ => {
                    let square = squares.get(x as usize / 12);
                    let inside =
                        |side| y >= 30 && y < 30 + side && x % 12 >= 1 && x % 12 < 1 + side;
                    square.filter(|(side, _)| inside(*side)).map_or(0.0, |(_, light)| *light)
                }
            };
            Rgb([light; 3])
        }))
    }

    #[test]
    fn fireflies_between_charts_are_never_valid() {
        let valid = |squares: &[(u32, f32)]| {
            let image = lightmap(squares);
            let color = detect_background(&image).unwrap();
            let validity = Validity::from_background(&image, color, 0.0);
            (24..48 * 48).filter(|texel| texel / 48 >= 24 && validity.flags()[*texel]).count()
        };
        // Trimmed by a texel on each side.
        assert_eq!(valid(&[(1, 65024.0), (2, 65024.0), (3, 65024.0), (4, 65024.0)]), 0);
        assert_eq!(valid(&[(3, 0.5), (4, 0.5)]), 0, "specks");
        assert_eq!(valid(&[(6, 0.5), (6, 9.9)]), 2 * 16, "small charts");
        assert_eq!(valid(&[(6, 10.1), (9, 65024.0)]), 0);
        // A chart of its own is as bright as it is.
        assert_eq!(valid(&[(10, 65024.0)]), 64);
    }

    #[test]
    fn what_is_no_number_between_charts_joins_no_firefly_to_them() {
        let mut image = lightmap(&[(4, 0.0)]).into_rgb32f();
        let before = Validity::from_background(&image.clone().into(), [0.0, 0.0, 0.0, 1.0], 0.0);
        // A bridge from the chart to a firefly of 3 × 3.
        (23..40).for_each(|y| (10..13).for_each(|x| image.put_pixel(x, y, Rgb([f32::NAN; 3]))));
        (36..39).for_each(|y| (10..13).for_each(|x| image.put_pixel(x, y, Rgb([6e4; 3]))));
        let after = Validity::from_background(&image.into(), [0.0, 0.0, 0.0, 1.0], 0.0);
        assert_eq!(before, after);
    }

    #[test]
    fn the_background_is_found_only_if_there_is_one() {
        assert_eq!(detect_background(&atlas()), Some(MAGENTA));
        let flat = RgbImage::from_pixel(9, 9, Rgb([1, 2, 3]));
        assert_eq!(detect_background(&DynamicImage::ImageRgb8(flat)), None);
        let gradient = image::GrayImage::from_fn(64, 64, |x, y| Luma([(x * 2 + y) as u8]));
        assert_eq!(detect_background(&DynamicImage::ImageLuma8(gradient)), None);
        assert_eq!(detect_background(&DynamicImage::new_rgb8(0, 0)), None);
    }
}
