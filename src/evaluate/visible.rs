//! How much of the difference of two renders an eye can see: the change of color that is left when the
//! detail which nobody resolves is blurred away.
//!
//! As S-CIELAB (Zhang & Wandell, "A spatial extension of CIELAB for digital color image reproduction",
//! 1997) and FLIP (Andersson et al., "FLIP: a difference evaluator for alternating images", 2020) do it,
//! with less: linear light is blurred by a Gaussian of σ = 1 pixel, what an eye at arm's length blurs,
//! and compared in Oklab (Ottosson, 2020), where black and white are 1 apart. The figure of a picture is
//! the 99th percentile over the pixels that either render covers, so that a small part that changes
//! counts and single pixels of an outline do not.
//!
//! Lab note for [`VISIBLE`]: levels of a helmet (1 to 4: 50, 25, 12.5 and 6.25 % of the triangles), a fox,
//! a racquet, a box of popcorn and a ewer beside their sources, worst of four views, and what one sees.
//!
//! | level, frame | figure | seen |
//! |---|---|---|
//! | popcorn 4, 1024² | 0.023 | nothing |
//! | helmet 2, 256² and 512² | 0.027, 0.033 | nothing |
//! | helmet 3, 128² | 0.052 | nothing; magnified, a brighter corner of the base |
//! | fox 1, 128² | 0.055 | nothing; magnified, another fold in a leg |
//! | ewer 3, 256² | 0.059 | nothing |
//! | **bound** | **0.06** | |
//! | helmet 3, 256² | 0.068 | the edges of the base catch more light |
//! | racquet 2, 256² | 0.078 | strings are missing from the pattern |
//! | helmet 3, 512² | 0.080 | a bright corner, the dome's outline has corners |
//! | racquet 3, 256² | 0.095 | the pattern of the strings fades |
//! | ewer 4, 256² | 0.097 | letters are bent |
//! | helmet 4, 128² | 0.105 | bright edges |
//! | fox 2, 128² | 0.124 | another head |
//!
//! RMS luminance and mean SSIM do not tell these apart: by RMS the ewer 3 (0.0246, nothing seen) is beyond
//! the helmet 3 at 256² (0.0238, seen), by SSIM the fox 1 (0.898, nothing seen) beyond the same (0.950).

use glam::{Vec3, Vec3A};

use super::render::{BACKGROUND, Image};

/// The largest difference of a picture that is not seen.
pub const VISIBLE: f64 = 0.06;

/// Pixels that it reaches.
const REACH: usize = 3;
/// The share of covered pixels that differ by less than the figure.
const SHARE: f64 = 0.99;

/// A render as an eye takes it in.
#[derive(Clone, Debug)]
pub struct Colors {
    /// In pixels.
    size: [usize; 2],
    /// One per pixel, row-major: Oklab of blurred light.
    colors: Vec<Vec3>,
    /// One per pixel: whether the scene covers any of it.
    covered: Vec<bool>,
}

impl Colors {
    /// Those of a render.
    pub fn of(image: &Image) -> Self {
        let covered: Vec<bool> = image.coverage.iter().map(|samples| *samples != 0).collect();
        let background = Vec3A::splat(BACKGROUND);
        let size = [image.width, image.height];
        let mut colors = vec![oklab(background); covered.len()];
        if let Some([left, top, right, bottom]) = around(&covered, size) {
            let columns = right - left;
            let mut line = vec![background; columns + 2 * REACH];
            let mut blur_row = |y: isize, out: &mut [Vec3A]| {
                let Some(y) = usize::try_from(y).ok().filter(|y| *y < image.height) else {
                    return out.fill(background);
                };
                let row = &image.rgb[y * image.width..][..image.width];
                for (x, pixel) in (left as isize - REACH as isize..).zip(&mut line) {
                    let inside = usize::try_from(x).ok().and_then(|x| row.get(x));
                    *pixel = inside.map_or(background, |rgb| Vec3A::from(*rgb));
                }
                let windows = line.array_windows();
                out.iter_mut().zip(windows).for_each(|(out, window)| *out = blur(window));
            };
            // The rows that the blur along the columns reads, blurred along the rows, in a ring.
            let mut ring = vec![vec![background; columns]; WEIGHTS.len()];
            let mut next = top as isize - REACH as isize;
            for y in top..bottom {
                while next <= (y + REACH) as isize {
                    blur_row(next, &mut ring[next.rem_euclid(WEIGHTS.len() as isize) as usize]);
                    next += 1;
                }
                let first = (y + WEIGHTS.len() - REACH) % WEIGHTS.len();
                let rows: [&[Vec3A]; WEIGHTS.len()] =
                    std::array::from_fn(|at| &ring[(first + at) % WEIGHTS.len()][..columns]);
                let colors = &mut colors[y * image.width + left..][..columns];
                for (x, color) in colors.iter_mut().enumerate() {
                    *color = oklab(blur(&rows.map(|row| row[x])));
                }
            }
        }
        Self { size, colors, covered }
    }

    /// The difference to another render of the same camera: 0 for the same, about 1 for black against
    /// white; see [`VISIBLE`].
    ///
    /// # Panics
    /// If their sizes differ.
    pub fn difference(&self, other: &Self) -> f64 {
        assert_eq!(self.size, other.size, "images of two rigs");
        let is_covered = |&at: &usize| self.covered[at] || other.covered[at];
        let off = |at: usize| self.colors[at].distance_squared(other.colors[at]);
        let mut off: Vec<f32> = (0..self.covered.len()).filter(is_covered).map(off).collect();
        if off.is_empty() {
            return 0.0;
        }
        let place = ((off.len() as f64 * SHARE).ceil() as usize).clamp(1, off.len()) - 1;
        let (_, figure, _) = off.select_nth_unstable_by(place, f32::total_cmp);
        f64::from(figure.sqrt())
    }
}

/// The weighted mean of seven pixels.
#[inline]
fn blur(pixels: &[Vec3A; WEIGHTS.len()]) -> Vec3A {
    pixels.iter().zip(WEIGHTS).fold(Vec3A::ZERO, |sum, (pixel, weight)| sum + *pixel * weight)
}

/// exp(−k² / 2) for k = −3…3, over their sum.
const WEIGHTS: [f32; 2 * REACH + 1] = [
    0.004_433_05,
    0.054_005_58,
    0.242_036_23,
    0.399_050_28,
    0.242_036_23,
    0.054_005_58,
    0.004_433_05,
];

/// The rectangle `[left, top, right, bottom]` of what is covered and of what the blur makes of it; the
/// last two are not included.
fn around(covered: &[bool], [width, height]: [usize; 2]) -> Option<[usize; 4]> {
    let places = || covered.iter().enumerate().filter(|(_, covered)| **covered);
    let columns = || places().map(|(at, _)| at % width);
    let (left, right) = (columns().min()?, columns().max()?);
    let (top, bottom) = (places().next()?.0 / width, places().next_back()?.0 / width);
    let from = |first: usize| first.saturating_sub(REACH);
    Some([from(left), from(top), (right + 1 + REACH).min(width), (bottom + 1 + REACH).min(height)])
}

/// Oklab of linear Rec. 709.
#[inline]
fn oklab(rgb: Vec3A) -> Vec3 {
    let cone = |weights: [f32; 3]| cube_root(Vec3A::from(weights).dot(rgb));
    let cones = Vec3::new(
        cone([0.412_221_47, 0.536_332_54, 0.051_445_99]),
        cone([0.211_903_5, 0.680_699_5, 0.107_396_96]),
        cone([0.088_302_46, 0.281_718_84, 0.629_978_7]),
    );
    Vec3::new(
        Vec3::new(0.210_454_26, 0.793_617_8, -0.004_072_047).dot(cones),
        Vec3::new(1.977_998_5, -2.428_592_2, 0.450_593_7).dot(cones),
        Vec3::new(0.025_904_037, 0.782_771_77, -0.808_675_77).dot(cones),
    )
}

/// The cube root within 1e-5 of itself, at a fifth of the time of the exact one; 0 below the least
/// light of 16 bits.
#[inline]
fn cube_root(x: f32) -> f32 {
    if x < 1e-5 {
        return 0.0;
    }
    // A third of the exponent, then Newton's method twice.
    let root = f32::from_bits(x.to_bits() / 3 + 709_921_077);
    let root = (2.0 * root + x / (root * root)) / 3.0;
    (2.0 * root + x / (root * root)) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(side: usize, color: impl Fn(usize, usize) -> Option<[f32; 3]>) -> Image {
        let pixels = || (0..side * side).map(|at| color(at % side, at / side));
        Image {
            width: side,
            height: side,
            rgb: pixels().map(|pixel| pixel.unwrap_or([BACKGROUND; 3])).collect(),
            coverage: pixels().map(|pixel| if pixel.is_some() { 15 } else { 0 }).collect(),
        }
    }

    fn difference(a: &Image, b: &Image) -> f64 {
        Colors::of(a).difference(&Colors::of(b))
    }

    #[test]
    fn the_weights_are_those_of_the_gaussian() {
        let weight = |k: i16| (-f32::from(k * k) / 2.0).exp();
        let sum: f32 = (-3..=3).map(weight).sum();
        for (k, own) in (-3..=3).zip(WEIGHTS) {
            assert!((own - weight(k) / sum).abs() < 1e-6, "{k}");
        }
    }

    #[test]
    fn the_cube_root_is_one() {
        for step in 0..1000 {
            let x = 1e-5 + (step as f32 / 999.0).powi(3);
            assert!((cube_root(x) / x.cbrt() - 1.0).abs() < 1e-5, "{x}");
        }
        assert_eq!(cube_root(0.0), 0.0);
    }

    #[test]
    fn black_and_white_are_one_apart_and_a_thing_is_not_off_from_itself() {
        let (black, white) = (image(32, |_, _| Some([0.0; 3])), image(32, |_, _| Some([1.0; 3])));
        assert!((difference(&black, &white) - 1.0).abs() < 0.05, "{}", difference(&black, &white));
        assert_eq!((difference(&white, &white), difference(&black, &black)), (0.0, 0.0));
        let nothing = image(32, |_, _| None);
        assert_eq!(difference(&nothing, &nothing), 0.0);
    }

    #[test]
    fn what_is_too_fine_to_be_resolved_is_not_seen_and_a_patch_is() {
        let gray = image(64, |_, _| Some([0.5; 3]));
        let checker = image(64, |x, y| Some([if (x + y) % 2 == 0 { 0.6 } else { 0.4 }; 3]));
        assert!(difference(&gray, &checker) < 0.01, "{}", difference(&gray, &checker));
        // Two in a hundred pixels.
        let patch = image(64, |x, y| Some([if x < 9 && y < 9 { 0.8 } else { 0.5 }; 3]));
        assert!(difference(&gray, &patch) > VISIBLE, "{}", difference(&gray, &patch));
        // The same luminance in another hue.
        let red = image(64, |_, _| Some([0.9, 0.382, 0.5]));
        assert!(difference(&gray, &red) > VISIBLE);
    }

    #[test]
    fn the_blur_goes_on_beyond_the_frame_and_around_what_is_covered() {
        let dot = image(9, |x, y| ((x, y) == (4, 4)).then_some([1.0; 3]));
        let shifted = image(21, |x, y| ((x, y) == (10, 10)).then_some([1.0; 3]));
        let (small, large) = (Colors::of(&dot), Colors::of(&shifted));
        for (x, y) in (0..9).flat_map(|y| (0..9).map(move |x| (x, y))) {
            assert_eq!(small.colors[y * 9 + x], large.colors[(y + 6) * 21 + x + 6]);
        }
        let full = Colors::of(&image(8, |_, _| Some([1.0; 3])));
        assert!(full.colors[0].x < full.colors[4 * 8 + 4].x, "the corner mixes with background");
    }
}
