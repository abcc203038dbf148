//! The size law: how large on screen a level may be shown, and which level that makes the one to show.
//!
//! A level whose surface is off by e, in shares of the bounding box's diagonal, is off by e · S pixels
//! where that diagonal spans S pixels. It may be shown while that is at most the tolerance, up to
//! S = tolerance / e, and while its picture can't be told from the source's, which
//! [`evaluate`](crate::evaluate) finds by looking. The same size as a distance, for a field of view φ
//! over H pixels of height and a diagonal D in world units: d = D · H / (2 tan(φ/2) · S).
//!
//! Of the levels that may be shown at a size the coarsest is. So a level is needless if a coarser one may
//! be shown at least as large.

use serde::Serialize;

use crate::error::{Error, Result};

/// The largest value of `MSFT_screencoverage`, where a level is the source in all but name.
const MOST_COVERAGE: f64 = 1e6;

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

    /// The distance to the eye at which a diagonal of length `diagonal` spans `pixels`, in its
    /// unit.
    pub fn distance(&self, diagonal: f64, pixels: f64) -> f64 {
        let half = (self.field_of_view_degrees.to_radians() / 2.0).tan();
        diagonal * f64::from(self.height) / (2.0 * half * pixels)
    }

    /// A disk of this diameter in pixels over the screen's area: above 1 where the disk is partly outside.
    fn coverage(&self, pixels: f64) -> f64 {
        let area = f64::from(self.width) * f64::from(self.height);
        (std::f64::consts::FRAC_PI_4 * pixels * pixels / area).min(MOST_COVERAGE)
    }

    /// `MSFT_screencoverage` of a node whose own diagonal is `share` of the whole asset's: for the
    /// source and each level the least share of the screen's area at which it is still shown, above 1
    /// where it is not even shown when it fills the screen. They fall where sizes do; the last is 0, so
    /// that something always is shown.
    pub fn coverages(&self, sizes: &[f64], share: f64) -> Vec<f64> {
        sizes.iter().map(|size| self.coverage(size * share)).chain([0.0]).collect()
    }
}

/// The sizes of a chain's levels in pixels, the finest first, from the largest size of each on its own:
/// no level gives way to a finer one while it may be shown.
///
/// ```
/// // The third may be shown larger than the second.
/// assert_eq!(seamwise::screen::switch_sizes([900.0, 300.0, 400.0]), [900.0, 400.0, 400.0]);
/// ```
pub fn switch_sizes(own: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut sizes: Vec<f64> = own.into_iter().collect();
    let mut coarser = 0.0f64;
    for size in sizes.iter_mut().rev() {
        coarser = coarser.max(*size);
        *size = coarser;
    }
    sizes
}

/// For each level the coarsest one, by index, that is as good at every size at which it may be shown
/// itself; `None` if there is none. `sizes` are those of [`switch_sizes`].
pub fn made_needless_by(sizes: &[f64]) -> Vec<Option<usize>> {
    let coarsest = |(index, size): (usize, &f64)| {
        (index + 1..sizes.len()).rev().find(|&other| sizes[other] >= *size)
    };
    sizes.iter().enumerate().map(coarsest).collect()
}

/// The level to show where the asset's diagonal spans `pixels`: 0 is the source, and the coarsest
/// whose largest size is not below it is chosen.
///
/// `sizes` are those of [`switch_sizes`].
///
/// ```
/// use seamwise::screen::{select_level, switch_sizes};
///
/// let sizes = switch_sizes([1000.0, 250.0, 50.0]);
/// assert_eq!(select_level(&sizes, 300.0), 1);
/// assert_eq!(select_level(&sizes, 40.0), 3);
/// ```
pub fn select_level(sizes: &[f64], pixels: f64) -> usize {
    sizes.iter().take_while(|&&size| pixels <= size).count()
}

/// The largest size at which a surface that is off by this share of the diagonal may be shown, in
/// pixels that the diagonal spans; infinite for one without error.
pub fn largest_size(pixel_tolerance: f64, distance: f64) -> f64 {
    pixel_tolerance / distance
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thousandth_off_may_be_shown_a_thousand_pixels_large() {
        assert_eq!((largest_size(1.0, 1e-3), largest_size(0.5, 1e-3)), (1000.0, 500.0));
        assert_eq!(largest_size(1.0, 0.0), f64::INFINITY);
    }

    #[test]
    fn a_diagonal_as_high_as_the_screen_fills_the_field_of_view() {
        let screen = Screen { field_of_view_degrees: 90.0, ..Screen::default() };
        assert!((screen.distance(2.0, 1080.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_coarsest_level_that_may_be_shown_is() {
        let sizes = switch_sizes([1000.0, 500.0, 700.0, 100.0]);
        assert_eq!(sizes, [1000.0, 700.0, 700.0, 100.0]);
        let chosen = [5000.0, 1000.0, 700.0, 600.0, 100.0].map(|size| select_level(&sizes, size));
        assert_eq!(chosen, [0, 1, 3, 3, 4]);
        assert_eq!(made_needless_by(&sizes), [None, Some(2), None, None]);
        assert_eq!(made_needless_by(&switch_sizes([3.0, 5.0, 5.0])), [Some(2), Some(2), None]);
    }

    #[test]
    fn coverages_fall_where_sizes_do_also_beyond_the_screen() {
        let screen = Screen::default();
        let coverages = screen.coverages(&[f64::INFINITY, 9000.0, 4000.0, 1000.0, 1000.0], 0.5);
        let disk = std::f64::consts::FRAC_PI_4 * 500.0 * 500.0 / (1920.0 * 1080.0);
        assert!((coverages[3] - disk).abs() < 1e-12);
        assert_eq!((coverages[4], coverages[5]), (coverages[3], 0.0));
        assert!(coverages[..4].windows(2).all(|pair| pair[0] > pair[1]), "{coverages:?}");
        assert!(coverages.iter().all(|coverage| coverage.is_finite()));
    }
}
