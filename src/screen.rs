//! The size law: how large on screen a level may be shown, from how far its surface is off.
//!
//! A level whose RMS surface distance is e, in shares of the bounding box's diagonal, is off by
//! e · S pixels where that diagonal spans S pixels. It may be shown while that is at most the
//! tolerance: up to S = tolerance / e. The same size as a distance, for a field of view φ over H
//! pixels of height and a diagonal D in world units: d = D · H / (2 tan(φ/2) · S).
//!
//! Guaranteed: levels are shown in their order, each below its own size. Not guaranteed: that no
//! single point is off by more than the tolerance, since e is a mean of squares.

use serde::Serialize;

use crate::error::{Error, Result};

/// The screen that sizes are computed for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Screen {
    /// Vertical field of view in degrees.
    pub field_of_view_degrees: f64,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// The largest error of a surface on screen, in pixels.
    pub pixel_tolerance: f64,
}

impl Default for Screen {
    fn default() -> Self {
        Self { field_of_view_degrees: 45.0, width: 1920, height: 1080, pixel_tolerance: 1.0 }
    }
}

impl Screen {
    /// Checks that the figures describe a screen.
    ///
    /// # Errors
    /// [`Error::Options`] if they do not.
    pub fn check(&self) -> Result<()> {
        let angle = self.field_of_view_degrees;
        let tolerance = self.pixel_tolerance;
        let what = if !(angle > 0.0 && angle < 180.0) {
            "the field of view must lie between 0 and 180 degrees"
        } else if !(tolerance > 0.0 && tolerance.is_finite()) {
            "the pixel tolerance must be above 0"
        } else if self.width == 0 || self.height == 0 {
            "a screen has at least one pixel"
        } else {
            return Ok(());
        };
        Err(Error::Options { what: what.into() })
    }

    /// The largest size at which a level of this RMS distance (over the diagonal) may be shown: the
    /// pixels that the diagonal of its bounding box spans. Infinite for a level without error.
    pub fn largest_size(&self, distance_rms: f64) -> f64 {
        largest_size(self.pixel_tolerance, distance_rms)
    }

    /// The distance to the eye at which a diagonal of length `diagonal` spans `pixels`, in its
    /// unit.
    pub fn distance(&self, diagonal: f64, pixels: f64) -> f64 {
        let half = (self.field_of_view_degrees.to_radians() / 2.0).tan();
        diagonal * f64::from(self.height) / (2.0 * half * pixels)
    }

    /// The share of the screen's area that a disk of this diameter in pixels covers, at most 1.
    fn coverage(&self, pixels: f64) -> f64 {
        let area = f64::from(self.width) * f64::from(self.height);
        (std::f64::consts::FRAC_PI_4 * pixels * pixels / area).min(1.0)
    }

    /// The sizes of a chain's levels in pixels, made not to increase from level to level.
    ///
    /// `distances`: one per level, as [`Screen::largest_size`] takes them.
    pub fn largest_sizes(&self, distances: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let mut size = f64::INFINITY;
        let falling = |distance_rms| {
            size = size.min(self.largest_size(distance_rms));
            size
        };
        distances.into_iter().map(falling).collect()
    }

    /// `MSFT_screencoverage` of a node whose own diagonal is `share` of the whole asset's: for the
    /// source and each level the least share of the screen's area at which it is still shown. The
    /// last is 0, so that something always is.
    pub fn coverages(&self, sizes: &[f64], share: f64) -> Vec<f64> {
        sizes.iter().map(|size| self.coverage(size * share)).chain([0.0]).collect()
    }
}

/// The level to show where the asset's diagonal spans `pixels`: 0 is the source, and the coarsest
/// whose largest size is not below it is chosen.
///
/// `sizes` are those of [`Screen::largest_sizes`].
///
/// ```
/// use seamwise::screen::{Screen, select_level};
///
/// // RMS distances of three levels, in diagonals of the source; they may be off by a pixel.
/// let sizes = Screen::default().largest_sizes([0.001, 0.004, 0.02]);
/// assert_eq!(sizes, [1000.0, 250.0, 50.0]);
/// assert_eq!(select_level(&sizes, 300.0), 1);
/// assert_eq!(select_level(&sizes, 40.0), 3);
/// ```
pub fn select_level(sizes: &[f64], pixels: f64) -> usize {
    sizes.iter().take_while(|&&size| pixels <= size).count()
}

/// The largest size at which a surface of this RMS distance (over the diagonal) may be shown, in
/// pixels that the diagonal spans; infinite for one without error.
pub fn largest_size(pixel_tolerance: f64, distance_rms: f64) -> f64 {
    pixel_tolerance / distance_rms
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thousandth_off_may_be_shown_a_thousand_pixels_large() {
        assert_eq!(Screen::default().largest_size(1e-3), 1000.0);
        let strict = Screen { pixel_tolerance: 0.5, ..Screen::default() };
        assert_eq!(strict.largest_size(1e-3), 500.0);
    }

    #[test]
    fn a_diagonal_as_high_as_the_screen_fills_the_field_of_view() {
        let screen = Screen { field_of_view_degrees: 90.0, ..Screen::default() };
        assert!((screen.distance(2.0, 1080.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn levels_are_chosen_in_their_order_whatever_was_measured() {
        let sizes = Screen::default().largest_sizes([1e-3, 5e-4, 1e-2]);
        assert_eq!(sizes, [1000.0, 1000.0, 100.0]);
        let chosen = [5000.0, 1000.0, 999.0, 100.0, 1.0].map(|pixels| select_level(&sizes, pixels));
        assert_eq!(chosen, [0, 2, 2, 3, 3]);
    }

    #[test]
    fn coverages_fall_to_zero_and_stay_within_one() {
        let screen = Screen::default();
        let coverages = screen.coverages(&[f64::INFINITY, 1000.0, 100.0], 0.5);
        assert_eq!((coverages[0], coverages[3]), (1.0, 0.0));
        let disk = std::f64::consts::FRAC_PI_4 * 500.0 * 500.0 / (1920.0 * 1080.0);
        assert!((coverages[1] - disk).abs() < 1e-12);
        assert!(coverages.windows(2).all(|pair| pair[0] >= pair[1]));
    }
}
