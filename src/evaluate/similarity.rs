//! Structural similarity of two renders (SSIM): how far they agree in local brightness, contrast and
//! pattern, where an RMS only knows differences pixel by pixel.
//!
//! Wang, Bovik, Sheikh & Simoncelli, "Image quality assessment: from error visibility to structural
//! similarity", IEEE Transactions on Image Processing 2004, eq. 13: Gaussian windows of 11 × 11 pixels
//! with σ = 1.5, K₁ = 0.01 and K₂ = 0.03. Here
//!
//! - the signal is the sRGB-encoded Rec. 709 luminance;
//! - an image of 384 pixels or more is first averaged over squares of max(1, round(side / 256))
//!   pixels, as the authors' program does, since the windows suit what an eye tells apart;
//! - the mean is over the windows that hold a pixel which either image covers, of all views as if
//!   they were one image. Beyond its frame an image goes on as background.
//!
//! A Gaussian is the product of one over the columns and one over the rows, so each window is
//! weighed by 22 numbers instead of 121. Numbers are f32, taken from the background's, so that squares
//! of what is nearly constant keep their digits.
//!
//! A thing against itself gives exactly 1.
//!
//! Lab note: within 1e-6 of the crate `iqa` 1.2, which weighs all 121 numbers in f64 and was used
//! before, at a twentieth of the time. Of the other crates `image-compare` 0.5 adds up the variance of
//! a window where the paper takes the mean; `dssim` is under the AGPL; `av-metrics` 0.9 wants frames of
//! video. FLIP (Andersson et al., 2020) is left out: its one crate, `nv-flip` 0.1.2, is of 2023, binds
//! the C++ of back then and needs its compiler.

use std::ops::{AddAssign, Range};

use seamwise_texture::color::{SrgbCurve, luminance};

use super::frame::rectangle;
use super::render::{BACKGROUND, Image};
use super::vectors::{Work, dispatch};

/// Pixels along each side of a window.
const WINDOW: usize = 11;
/// Standard deviation of its weights, in pixels.
const SIGMA: f32 = 1.5;
/// (K₁ · L)² and (K₂ · L)² for a signal of 0…1.
const C1: f32 = 1e-4;
const C2: f32 = 9e-4;
/// Shorter side of a reduced image in pixels, roughly: the sides are divided by a whole number.
const SCALE: usize = 256;

/// The sRGB-encoded luminance of a render, reduced for the windows.
#[derive(Clone, Debug, PartialEq)]
pub struct Tones {
    width: usize,
    height: usize,
    /// One per pixel, row-major: 0…1.
    levels: Vec<f32>,
    /// One per pixel: whether the scene covers any of it.
    covered: Vec<bool>,
}

impl Tones {
    /// Those of an image.
    pub fn of(image: &Image) -> Self {
        let factor = ((image.width.min(image.height) + SCALE / 2) / SCALE).max(1);
        let (width, height) = (image.width.div_ceil(factor), image.height.div_ceil(factor));
        let background = background();
        let mut tones = Self { width, height, levels: Vec::new(), covered: Vec::new() };
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let rows = y * factor..((y + 1) * factor).min(image.height);
            let columns = x * factor..((x + 1) * factor).min(image.width);
            let count = rows.len() * columns.len();
            let (mut sum, mut covered) = (0.0, false);
            for row in rows {
                for at in row * image.width + columns.start..row * image.width + columns.end {
                    let is_covered = image.coverage[at] != 0;
                    sum += if is_covered { tone(image.rgb[at]) } else { background };
                    covered |= is_covered;
                }
            }
            tones.levels.push(if covered { sum / count as f32 } else { background });
            tones.covered.push(covered);
        }
        tones
    }
}

/// The sum over windows: see [`Similarity::of_windows`].
struct Windows<'a> {
    reference: &'a Tones,
    candidate: &'a Tones,
    covered: &'a [bool],
    rect: &'a Rect,
}

impl Work for Windows<'_> {
    type Output = Similarity;

    #[inline(always)]
    fn run(self) -> Similarity {
        Similarity::of_windows(self.reference, self.candidate, self.covered, self.rect)
    }
}

/// The sRGB-encoded luminance of linear light, 0…1.
fn tone(rgb: [f32; 3]) -> f32 {
    SrgbCurve::get().encode(luminance(rgb).clamp(0.0, 1.0))
}

/// That of the background.
fn background() -> f32 {
    tone([BACKGROUND; 3])
}

/// Sum over windows, of one view or of many.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Similarity {
    /// Σ SSIM.
    sum: f64,
    windows: u64,
}

impl Similarity {
    /// The similarity of two images of one camera.
    ///
    /// # Panics
    /// If their sizes differ.
    pub fn between(reference: &Tones, candidate: &Tones) -> Self {
        let size = |tones: &Tones| (tones.width, tones.height);
        assert_eq!(size(reference), size(candidate), "images of two rigs");
        let covered: Vec<bool> =
            reference.covered.iter().zip(&candidate.covered).map(|(a, b)| *a || *b).collect();
        let Some(rect) = Rect::around(&covered, reference.width) else {
            return Self::default();
        };
        dispatch(Windows { reference, candidate, covered: &covered, rect: &rect })
    }

    /// The sum over the windows of a rectangle that hold what is covered.
    #[inline(always)]
    fn of_windows(reference: &Tones, candidate: &Tones, covered: &[bool], rect: &Rect) -> Self {
        let background = background();
        let [mut a, mut b, mut squares, mut products] =
            std::array::from_fn(|_| vec![0.0; rect.width * rect.height]);
        let mut held = vec![false; rect.width * rect.height];
        for (at, pixels) in rect.rows([reference.width, reference.height]) {
            let own = &reference.levels[pixels.clone()];
            let other = &candidate.levels[pixels.clone()];
            for (k, (own, other)) in own.iter().zip(other).enumerate() {
                (a[at + k], b[at + k]) = (own - background, other - background);
            }
            held[at..at + pixels.len()].copy_from_slice(&covered[pixels]);
        }
        for (((a, b), squares), products) in a.iter().zip(&b).zip(&mut squares).zip(&mut products) {
            (*squares, *products) = (a * a + b * b, a * b);
        }
        let held = spread(&held, rect.width);
        let [a, b, squares, products] =
            [a, b, squares, products].map(|plane| blur(&plane, rect.width));
        let all = a.iter().zip(&b).zip(squares.iter().zip(&products));
        let similarities: Vec<f32> = all
            .map(|((a, b), (squares, products))| window(*a, *b, *squares, *products, background))
            .collect();
        let mut similarity = Self::default();
        for (own, _) in similarities.iter().zip(held).filter(|(_, held)| *held) {
            similarity.sum += f64::from(*own);
            similarity.windows += 1;
        }
        similarity
    }

    /// The mean over all windows, up to 1; 1 where there is none.
    pub fn mean(&self) -> f64 {
        if self.windows == 0 { 1.0 } else { self.sum / self.windows as f64 }
    }
}

/// The SSIM of a window with these means: of both signals, of the sum of their squares and of their
/// product, all less the background's level.
fn window(a: f32, b: f32, squares: f32, products: f32, background: f32) -> f32 {
    let variances = squares - (a * a + b * b);
    let covariance = products - a * b;
    let (a, b) = (a + background, b + background);
    let means = (2.0 * (a * b) + C1) / (a * a + b * b + C1);
    means * ((2.0 * covariance + C2) / (variances + C2))
}

/// The weights of a window along one axis; their sum is 1.
fn weights() -> [f32; WINDOW] {
    let weight = |at: usize| {
        let off = at as f32 - (WINDOW / 2) as f32;
        (-off * off / (2.0 * SIGMA * SIGMA)).exp()
    };
    let sum: f32 = (0..WINDOW).map(weight).sum();
    std::array::from_fn(|at| weight(at) / sum)
}

/// The weighted mean of every window inside a plane of that width, row by row.
#[inline(always)]
fn blur(plane: &[f32], width: usize) -> Vec<f32> {
    let weights = weights();
    let (rows, columns) = (plane.len() / width + 1 - WINDOW, width + 1 - WINDOW);
    let mut out = vec![0.0; rows * columns];
    let mut row = vec![0.0; width];
    for (y, out) in out.chunks_exact_mut(columns).enumerate() {
        let above: [&[f32]; WINDOW] = std::array::from_fn(|k| &plane[(y + k) * width..][..width]);
        for (x, mean) in row.iter_mut().enumerate() {
            let mut sum = 0.0;
            for k in 0..WINDOW {
                sum += above[k][x] * weights[k];
            }
            *mean = sum;
        }
        for (mean, window) in out.iter_mut().zip(row.array_windows::<WINDOW>()) {
            let mut sum = 0.0;
            for k in 0..WINDOW {
                sum += window[k] * weights[k];
            }
            *mean = sum;
        }
    }
    out
}

/// Whether every window inside a plane of that width holds anything, row by row.
#[inline(always)]
fn spread(plane: &[bool], width: usize) -> Vec<bool> {
    let (rows, columns) = (plane.len() / width + 1 - WINDOW, width + 1 - WINDOW);
    let mut out = vec![false; rows * columns];
    let mut row = vec![false; width];
    for (y, out) in out.chunks_exact_mut(columns).enumerate() {
        row.fill(false);
        for k in 0..WINDOW {
            let above = &plane[(y + k) * width..][..width];
            row.iter_mut().zip(above).for_each(|(all, own)| *all |= own);
        }
        for k in 0..WINDOW {
            out.iter_mut().zip(&row[k..]).for_each(|(all, own)| *all |= own);
        }
    }
    out
}

impl AddAssign for Similarity {
    fn add_assign(&mut self, other: Self) {
        self.sum += other.sum;
        self.windows += other.windows;
    }
}

/// A part of an image and of what lies around it.
struct Rect {
    left: isize,
    top: isize,
    width: usize,
    height: usize,
}

impl Rect {
    /// All windows that hold a covered pixel; `None` if there is none.
    fn around(covered: &[bool], width: usize) -> Option<Self> {
        let [left, top, right, bottom] = rectangle(covered, width)?;
        let margin = WINDOW - 1;
        Some(Self {
            left: left as isize - margin as isize,
            top: top as isize - margin as isize,
            width: right - left + 2 * margin,
            height: bottom - top + 2 * margin,
        })
    }

    /// Its rows inside an image of that size: the place in the rectangle where each begins, and its pixels
    /// in the image.
    fn rows(&self, [width, height]: [usize; 2]) -> impl Iterator<Item = (usize, Range<usize>)> {
        let own = self.left..self.left + self.width as isize;
        let columns = own.start.max(0) as usize..(own.end.max(0) as usize).min(width);
        let (left, top, stride) = (self.left, self.top, self.width);
        (0..self.height).filter_map(move |row| {
            let y = usize::try_from(top + row as isize).ok().filter(|y| *y < height)?;
            let first = (columns.start as isize - left) as usize;
            Some((row * stride + first, y * width + columns.start..y * width + columns.end))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An image of gray levels in sRGB, covered where `level` gives one.
    fn tones(side: usize, level: impl Fn(usize, usize) -> Option<f32>) -> Tones {
        let linear = |srgb: f32| {
            if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
        };
        let pixels: Vec<Option<f32>> =
            (0..side * side).map(|at| level(at % side, at / side).map(linear)).collect();
        Tones::of(&Image {
            width: side,
            height: side,
            rgb: pixels.iter().map(|pixel| [pixel.unwrap_or(BACKGROUND); 3]).collect(),
            coverage: pixels.iter().map(|pixel| if pixel.is_some() { 15 } else { 0 }).collect(),
        })
    }

    fn noise(x: usize, y: usize) -> f32 {
        ((x * 7919 + y * 104_729 + x * y * 31) % 251) as f32 / 250.0
    }

    #[test]
    fn a_thing_against_itself_is_exactly_one() {
        let disk = |x: usize, y: usize| {
            let off = |at: usize| (at as f32 - 20.0).powi(2);
            (off(x) + off(y) < 200.0).then(|| noise(x, y))
        };
        let same = tones(40, disk);
        assert_eq!(Similarity::between(&same, &same).mean(), 1.0);
        let nothing = tones(40, |_, _| None);
        assert_eq!(Similarity::between(&nothing, &nothing).mean(), 1.0);
        assert!(Similarity::between(&same, &nothing).mean() < 0.5);
    }

    #[test]
    fn windows_are_those_that_hold_something() {
        let dot = tones(30, |x, y| (x == 3 && y == 29).then_some(1.0));
        let nothing = tones(30, |_, _| None);
        let similarity = Similarity::between(&dot, &nothing);
        assert_eq!(similarity.windows, 121);
        assert!(similarity.mean() < 0.9);
        let far = tones(30, |x, y| (y == 29 && (x == 3 || x == 4)).then_some(1.0));
        assert_eq!(Similarity::between(&dot, &far).windows, 132);
    }

    #[test]
    fn two_flat_images_give_the_luminance_term() {
        // Wang et al., eq. 6 with variances of 0: (2ab + C₁) / (a² + b² + C₁), C₁ = 0.01².
        let (a, b) = (0.4f64, 0.5f64);
        let expected = (2.0 * a * b + 1e-4) / (a * a + b * b + 1e-4);
        let [left, right] = [0.4f32, 0.5].map(|level| level - background());
        let (squares, products) = (left * left + right * right, left * right);
        let found = f64::from(window(left, right, squares, products, background()));
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }

    #[test]
    fn the_sum_is_that_of_every_window_weighed_number_by_number() {
        let [a, b] = [0.3f32, 0.9]
            .map(|scale| tones(16, |x, y| (x > 2 && y < 14).then(|| 1.0 - scale * noise(x, y))));
        let weights = weights().map(f64::from);
        let side = 16 + 2 * (WINDOW - 1) as isize;
        let level = |of: &Tones, x: isize, y: isize| {
            let is_inside = (0..16).contains(&x) && (0..16).contains(&y);
            f64::from(if is_inside { of.levels[(y * 16 + x) as usize] } else { background() })
        };
        let (mut sum, mut count) = (0.0, 0);
        for (left, top) in (0..side).flat_map(|y| (0..side).map(move |x| (x - 10, y - 10))) {
            let window = || (0..121isize).map(|at| (left + at % 11, top + at / 11));
            if !window().any(|(x, y)| (3..16).contains(&x) && (0..14).contains(&y)) {
                continue;
            }
            let mean = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
                let each = window().enumerate().map(|(at, (x, y))| {
                    weights[at % 11] * weights[at / 11] * of(level(&a, x, y), level(&b, x, y))
                });
                each.sum()
            };
            let (p, q) = (mean(&|p, _| p), mean(&|_, q| q));
            let (vp, vq) = (mean(&|a, _| (a - p).powi(2)), mean(&|_, b| (b - q).powi(2)));
            let both = mean(&|a, b| (a - p) * (b - q));
            sum += (2.0 * p * q + 1e-4) * (2.0 * both + 9e-4)
                / ((p * p + q * q + 1e-4) * (vp + vq + 9e-4));
            count += 1;
        }
        let found = Similarity::between(&a, &b);
        assert_eq!(found.windows, count);
        assert!((found.mean() - sum / count as f64).abs() < 1e-6, "{} {sum}", found.mean());
    }

    #[test]
    fn large_images_are_halved() {
        let large = tones(512, |x, _| Some((x % 4 / 2) as f32));
        assert_eq!((large.width, large.height), (256, 256));
        let is_close = |at: usize| (large.levels[at] - (at % 2) as f32).abs() < 1e-6;
        assert!((0..4).all(is_close));
        assert_eq!(tones(383, |_, _| None).width, 383);
    }

    #[test]
    fn views_pool_by_their_windows() {
        let [a, b] = [0.0, 0.3].map(|lift| tones(24, |x, y| Some(0.7 * noise(x, y) + lift)));
        let near = Similarity::between(&a, &b);
        let small = tones(12, |x, y| Some(noise(x, y)));
        let mut pooled = near;
        pooled += Similarity::between(&small, &small);
        let (n, m) = (34.0 * 34.0, 22.0 * 22.0);
        assert!((pooled.mean() - (near.mean() * n + m) / (n + m)).abs() < 1e-12);
    }
}
