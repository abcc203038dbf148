//! Structural similarity of two renders (SSIM): how far they agree in local brightness, contrast and
//! pattern, where an RMS only knows differences pixel by pixel.
//!
//! Wang, Bovik, Sheikh & Simoncelli, "Image quality assessment: from error visibility to structural
//! similarity", IEEE Transactions on Image Processing 2004, eq. 13, as the crate `iqa` computes it:
//! Gaussian windows of 11 × 11 pixels with σ = 1.5, K₁ = 0.01 and K₂ = 0.03. Here
//!
//! - the signal is the sRGB-encoded Rec. 709 luminance, in 16 bits;
//! - an image of 384 pixels or more is first averaged over squares of max(1, round(side / 256))
//!   pixels, as the authors' program does, since the windows suit what an eye tells apart;
//! - the mean is over the windows that hold a pixel which either image covers, of all views as if
//!   they were one image. Beyond its frame an image goes on as background.
//!
//! A thing against itself gives exactly 1.
//!
//! Lab note: of the crates that had it, `image-compare` 0.5 adds up the variance of a window where
//! the paper takes the mean, so that rounding to 8 bits alone costs 2 % in flat parts; `dssim` is
//! under the AGPL; `av-metrics` 0.9 wants frames of video. FLIP (Andersson et al., 2020) is left out:
//! its one crate, `nv-flip` 0.1.2, is of 2023, binds the C++ of back then and needs its compiler.

use std::ops::AddAssign;

use iqa::{Image as Signal, SsimOptions, ssim};
use seamwise_texture::color::{linear_to_srgb, luminance};

use super::render::{BACKGROUND, Image};
use crate::error::{Error, Result};

/// Pixels along each side of a window.
const WINDOW: usize = 11;
/// What an image is reduced to, at least and roughly, in pixels along its shorter side.
const SCALE: usize = 256;

/// The sRGB-encoded luminance of a render, reduced for the windows.
#[derive(Clone, Debug, PartialEq)]
pub struct Tones {
    width: usize,
    height: usize,
    /// One per pixel, row-major: 0…1 as 0…65535.
    levels: Vec<u16>,
    /// One per pixel: whether the scene covers any of it.
    covered: Vec<bool>,
}

impl Tones {
    /// Those of an image.
    pub fn of(image: &Image) -> Self {
        let factor = ((image.width.min(image.height) + SCALE / 2) / SCALE).max(1);
        let (width, height) = (image.width.div_ceil(factor), image.height.div_ceil(factor));
        let background = tone([BACKGROUND; 3]);
        let mut tones = Self { width, height, levels: Vec::new(), covered: Vec::new() };
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let rows = y * factor..((y + 1) * factor).min(image.height);
            let columns = x * factor..((x + 1) * factor).min(image.width);
            let count = rows.len() * columns.len();
            let pixels = rows.flat_map(|y| columns.clone().map(move |x| y * image.width + x));
            let (mut sum, mut covered) = (0.0, false);
            for at in pixels {
                // Most pixels are background: spare them the power.
                let is_covered = image.coverage[at] != 0;
                sum += if is_covered { tone(image.rgb[at]) } else { background };
                covered |= is_covered;
            }
            tones.levels.push((sum / count as f32 * f32::from(u16::MAX)).round() as u16);
            tones.covered.push(covered);
        }
        tones
    }

    /// The levels of `rect`, which may reach beyond the frame.
    fn crop(&self, rect: &Rect) -> Vec<u16> {
        let background = (tone([BACKGROUND; 3]) * f32::from(u16::MAX)).round() as u16;
        rect.pixels(self.width, self.height)
            .map(|at| at.map_or(background, |at| self.levels[at]))
            .collect()
    }
}

/// The sRGB-encoded luminance of linear light, 0…1.
fn tone(rgb: [f32; 3]) -> f32 {
    linear_to_srgb(luminance(rgb).clamp(0.0, 1.0))
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
    /// # Errors
    /// [`Error::Internal`] if the crate that computes it refuses them.
    ///
    /// # Panics
    /// If their sizes differ.
    pub fn between(reference: &Tones, candidate: &Tones) -> Result<Self> {
        let size = |tones: &Tones| (tones.width, tones.height);
        assert_eq!(size(reference), size(candidate), "images of two rigs");
        let covered: Vec<bool> =
            reference.covered.iter().zip(&candidate.covered).map(|(a, b)| *a || *b).collect();
        let Some(rect) = Rect::around(&covered, reference.width) else {
            return Ok(Self::default());
        };
        let signal = |tones: &Tones| {
            Signal::gray16(rect.width as u32, rect.height as u32, tones.crop(&rect))
        };
        let (a, b) = (
            signal(reference).map_err(Error::internal)?,
            signal(candidate).map_err(Error::internal)?,
        );
        let mean = ssim(&a, &b, SsimOptions::default()).map_err(Error::internal)?;
        // A window of background alone has a similarity of exactly 1.
        let all = (rect.width + 1 - WINDOW) * (rect.height + 1 - WINDOW);
        let empty = all - rect.count_windows(&covered, reference.width, reference.height);
        Ok(Self { sum: mean * all as f64 - empty as f64, windows: (all - empty) as u64 })
    }

    /// The mean over all windows, up to 1; 1 where there is none.
    pub fn mean(&self) -> f64 {
        if self.windows == 0 { 1.0 } else { self.sum / self.windows as f64 }
    }
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
        let places = || covered.iter().enumerate().filter(|(_, covered)| **covered);
        let columns = || places().map(|(at, _)| at % width);
        let (left, right) = (columns().min()?, columns().max()?);
        let (top, bottom) = (places().next()?.0 / width, places().next_back()?.0 / width);
        let margin = WINDOW - 1;
        Some(Self {
            left: left as isize - margin as isize,
            top: top as isize - margin as isize,
            width: right - left + 1 + 2 * margin,
            height: bottom - top + 1 + 2 * margin,
        })
    }

    /// Its pixels, row-major, as indices of an image of that size; `None` beyond its frame.
    fn pixels(&self, width: usize, height: usize) -> impl Iterator<Item = Option<usize>> {
        let inside =
            move |at: isize, length: usize| usize::try_from(at).ok().filter(|&at| at < length);
        let rows = (0..self.height as isize).map(move |y| inside(self.top + y, height));
        let (left, columns) = (self.left, self.width as isize);
        rows.flat_map(move |y| {
            (0..columns).map(move |x| Some(y? * width + inside(left + x, width)?))
        })
    }

    /// The windows inside it that hold a covered pixel.
    fn count_windows(&self, covered: &[bool], width: usize, height: usize) -> usize {
        // Sums over rows above and columns to the left, of one more row and column than the rect.
        let stride = self.width + 1;
        let mut sums = vec![0u32; stride * (self.height + 1)];
        for (index, at) in self.pixels(width, height).enumerate() {
            let (x, y) = (index % self.width, index / self.width);
            let own = u32::from(at.is_some_and(|at| covered[at]));
            let at = (y + 1) * stride + x + 1;
            sums[at] = own + sums[at - 1] + sums[at - stride] - sums[at - stride - 1];
        }
        let windows = (0..=self.height - WINDOW)
            .flat_map(|y| (0..=self.width - WINDOW).map(move |x| y * stride + x));
        let held = |at: &usize| {
            let below = at + WINDOW * stride;
            sums[below + WINDOW] + sums[*at] != sums[at + WINDOW] + sums[below]
        };
        windows.filter(held).count()
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
        assert_eq!(Similarity::between(&same, &same).unwrap().mean(), 1.0);
        let nothing = tones(40, |_, _| None);
        assert_eq!(Similarity::between(&nothing, &nothing).unwrap().mean(), 1.0);
        assert!(Similarity::between(&same, &nothing).unwrap().mean() < 0.5);
    }

    #[test]
    fn windows_are_those_that_hold_something() {
        let dot = tones(30, |x, y| (x == 3 && y == 29).then_some(1.0));
        let nothing = tones(30, |_, _| None);
        let similarity = Similarity::between(&dot, &nothing).unwrap();
        assert_eq!(similarity.windows, 121);
        assert!(similarity.mean() < 0.9);
        let far = tones(30, |x, y| (y == 29 && (x == 3 || x == 4)).then_some(1.0));
        assert_eq!(Similarity::between(&dot, &far).unwrap().windows, 132);
    }

    #[test]
    fn two_flat_images_give_the_luminance_term() {
        // Wang et al., eq. 6 with variances of 0: (2ab + C₁) / (a² + b² + C₁), C₁ = 0.01². Only a
        // window that lies within the frame is flat.
        let crop = |level| {
            let Tones { levels, .. } = tones(11, |_, _| Some(level));
            Signal::gray16(11, 11, levels).unwrap()
        };
        let (a, b) = (0.4f64, 0.5f64);
        let expected = (2.0 * a * b + 1e-4) / (a * a + b * b + 1e-4);
        let found = ssim(&crop(0.4), &crop(0.5), SsimOptions::default()).unwrap();
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }

    #[test]
    fn large_images_are_halved() {
        let large = tones(512, |x, _| Some((x % 4 / 2) as f32));
        assert_eq!((large.width, large.height), (256, 256));
        assert_eq!(large.levels[..4], [0, 65535, 0, 65535]);
        assert_eq!(tones(383, |_, _| None).width, 383);
    }

    #[test]
    fn views_pool_by_their_windows() {
        let [a, b] = [0.0, 0.3].map(|lift| tones(24, |x, y| Some(0.7 * noise(x, y) + lift)));
        let near = Similarity::between(&a, &b).unwrap();
        let small = tones(12, |x, y| Some(noise(x, y)));
        let mut pooled = near;
        pooled += Similarity::between(&small, &small).unwrap();
        let (n, m) = (34.0 * 34.0, 22.0 * 22.0);
        assert!((pooled.mean() - (near.mean() * n + m) / (n + m)).abs() < 1e-12);
    }
}
