//! RMS luminance difference between two renders, and how far their silhouettes agree.
//!
//! Lindstrom & Turk, "Image-driven simplification", TOG 2000, eq. 1: the root of the mean squared
//! difference of luminance over all pixels of all views. Luminance is Y of Rec. 709, once of linear
//! light and once sRGB-encoded, which weighs dark and light as the eye does. The mean is over all
//! pixels (a small model on a large background comes out well) and over those that either image
//! covers.
//!
//! A thing against itself gives exactly 0 and an overlap of exactly 1.

use std::ops::{AddAssign, Range};

use seamwise_texture::color::{SrgbCurve, luminance};

use super::render::Image;

/// Pixels that are passed over at once where nothing is seen.
const CHUNK: usize = 64;

/// Sums over pixels, of one view or of many: adding views up pools them as if they were one image.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// Σ (ΔY)² of linear light.
    pub squared: f64,
    /// Σ (ΔY')² with Y' the sRGB-encoded luminance.
    pub squared_srgb: f64,
    /// Pixels.
    pub pixels: u64,
    /// Σ (ΔY)² over the pixels that either image covers.
    pub covered_squared: f64,
    /// Σ (ΔY')² over the pixels that either image covers.
    pub covered_squared_srgb: f64,
    /// Pixels that either image covers, if only at one sample.
    pub covered_pixels: u64,
    /// Σ (ΔY)² over the pixels in the band around seams.
    pub seam_squared: f64,
    /// Σ (ΔY')² over the pixels in the band around seams.
    pub seam_squared_srgb: f64,
    /// Pixels in the band around seams.
    pub seam_pixels: u64,
    /// Samples that both images cover.
    pub samples_both: u64,
    /// Samples that either image covers.
    pub samples_either: u64,
}

impl Difference {
    /// The difference of two images of one camera; `seams` tells the pixels in the band around seams
    /// and may be empty.
    ///
    /// # Panics
    /// If their sizes differ.
    pub fn between(reference: &Image, candidate: &Image, seams: &[bool]) -> Self {
        assert_eq!(
            (reference.width, reference.height),
            (candidate.width, candidate.height),
            "images of two rigs"
        );
        let mut sum = Self { pixels: reference.rgb.len() as u64, ..Self::default() };
        for first in (0..reference.rgb.len()).step_by(CHUNK) {
            let pixels = first..(first + CHUNK).min(reference.rgb.len());
            let shows =
                |image: &Image| image.coverage[pixels.clone()].iter().any(|mask| *mask != 0);
            let is_empty = !shows(reference)
                && !shows(candidate)
                && reference.rgb[pixels.clone()] == candidate.rgb[pixels.clone()]
                && !seams.get(pixels.clone()).is_some_and(|seams| seams.contains(&true));
            if !is_empty {
                sum.add(reference, candidate, seams, pixels);
            }
        }
        sum
    }

    /// Adds the difference of some pixels.
    fn add(&mut self, reference: &Image, candidate: &Image, seams: &[bool], pixels: Range<usize>) {
        let (curve, sum) = (SrgbCurve::get(), self);
        for at in pixels {
            let (a, b) = (reference.rgb[at], candidate.rgb[at]);
            let (mask_a, mask_b) = (reference.coverage[at], candidate.coverage[at]);
            sum.samples_both += u64::from((mask_a & mask_b).count_ones());
            sum.samples_either += u64::from((mask_a | mask_b).count_ones());
            let covered = mask_a | mask_b != 0;
            sum.covered_pixels += u64::from(covered);
            let at_seam = seams.get(at) == Some(&true);
            sum.seam_pixels += u64::from(at_seam);
            if a == b {
                continue;
            }
            let (a, b) = (luminance(a), luminance(b));
            let linear = f64::from(a - b).powi(2);
            let srgb = f64::from(curve.encode(a) - curve.encode(b)).powi(2);
            sum.squared += linear;
            sum.squared_srgb += srgb;
            if covered {
                sum.covered_squared += linear;
                sum.covered_squared_srgb += srgb;
            }
            if at_seam {
                sum.seam_squared += linear;
                sum.seam_squared_srgb += srgb;
            }
        }
    }

    /// RMS difference of linear luminance over all pixels.
    pub fn rms(&self) -> f64 {
        root_mean(self.squared, self.pixels)
    }

    /// RMS difference of sRGB-encoded luminance over all pixels.
    pub fn rms_srgb(&self) -> f64 {
        root_mean(self.squared_srgb, self.pixels)
    }

    /// RMS difference of linear luminance over the pixels that either image covers.
    pub fn rms_covered(&self) -> f64 {
        root_mean(self.covered_squared, self.covered_pixels)
    }

    /// RMS difference of sRGB-encoded luminance over the pixels that either image covers.
    pub fn rms_covered_srgb(&self) -> f64 {
        root_mean(self.covered_squared_srgb, self.covered_pixels)
    }

    /// RMS difference of linear luminance in the band around seams; 0 where none is seen.
    pub fn rms_seams(&self) -> f64 {
        root_mean(self.seam_squared, self.seam_pixels)
    }

    /// RMS difference of sRGB-encoded luminance in the band around seams; 0 where none is seen.
    pub fn rms_seams_srgb(&self) -> f64 {
        root_mean(self.seam_squared_srgb, self.seam_pixels)
    }

    /// Silhouette overlap: samples covered by both over samples covered by either; 1 where neither
    /// covers any.
    pub fn overlap(&self) -> f64 {
        if self.samples_either == 0 {
            return 1.0;
        }
        self.samples_both as f64 / self.samples_either as f64
    }
}

impl AddAssign for Difference {
    fn add_assign(&mut self, other: Self) {
        self.squared += other.squared;
        self.squared_srgb += other.squared_srgb;
        self.pixels += other.pixels;
        self.covered_squared += other.covered_squared;
        self.covered_squared_srgb += other.covered_squared_srgb;
        self.covered_pixels += other.covered_pixels;
        self.seam_squared += other.seam_squared;
        self.seam_squared_srgb += other.seam_squared_srgb;
        self.seam_pixels += other.seam_pixels;
        self.samples_both += other.samples_both;
        self.samples_either += other.samples_either;
    }
}

fn root_mean(sum: f64, count: u64) -> f64 {
    if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }
}

#[cfg(test)]
mod tests {
    use seamwise_texture::color::linear_to_srgb;

    use super::*;

    /// A row of gray pixels and their coverage.
    fn image(pixels: &[(f32, u8)]) -> Image {
        Image {
            width: pixels.len(),
            height: 1,
            rgb: pixels.iter().map(|pixel| [pixel.0; 3]).collect(),
            coverage: pixels.iter().map(|pixel| pixel.1).collect(),
        }
    }

    #[test]
    fn an_image_against_itself_is_zero() {
        let a = image(&[(0.2, 15), (0.7, 3), (0.5, 0)]);
        let same = Difference::between(&a, &a, &[]);
        assert_eq!(
            [same.rms(), same.rms_srgb(), same.rms_covered(), same.overlap()],
            [0.0, 0.0, 0.0, 1.0]
        );
        assert_eq!(Difference::default().rms(), 0.0);
    }

    #[test]
    fn a_known_shift_gives_that_number() {
        let a = image(&[(0.25, 15), (0.25, 15), (0.0, 0), (0.0, 0)]);
        let b = image(&[(0.75, 15), (0.75, 15), (0.0, 0), (0.0, 0)]);
        let difference = Difference::between(&a, &b, &[]);
        assert!((difference.rms_covered() - 0.5).abs() < 1e-6);
        assert!((difference.rms() - 0.5 / 2f64.sqrt()).abs() < 1e-6);
        let srgb = f64::from(linear_to_srgb(0.75) - linear_to_srgb(0.25));
        assert!((difference.rms_covered_srgb() - srgb).abs() < 1e-6);
        assert!((difference.rms_srgb() - srgb / 2f64.sqrt()).abs() < 1e-6);
    }

    #[test]
    fn views_pool_as_one_image() {
        let (a, b) = (image(&[(0.1, 15), (0.4, 1)]), image(&[(0.3, 7), (0.4, 2)]));
        let (c, d) = (image(&[(0.9, 0)]), image(&[(0.0, 8)]));
        let mut pooled = Difference::between(&a, &b, &[]);
        pooled += Difference::between(&c, &d, &[]);
        let whole = Difference::between(
            &image(&[(0.1, 15), (0.4, 1), (0.9, 0)]),
            &image(&[(0.3, 7), (0.4, 2), (0.0, 8)]),
            &[],
        );
        assert_eq!(pooled, whole);
        assert_eq!((whole.samples_both, whole.samples_either), (3, 7));
    }

    #[test]
    fn the_band_around_seams_has_a_mean_of_its_own() {
        let (a, b) = (image(&[(0.2, 15), (0.2, 15)]), image(&[(0.2, 15), (0.6, 15)]));
        let difference = Difference::between(&a, &b, &[false, true]);
        assert_eq!(difference.seam_pixels, 1);
        assert!((difference.rms_seams() - 0.4).abs() < 1e-6);
        assert_eq!(Difference::between(&a, &b, &[true, false]).rms_seams(), 0.0);
    }
}
