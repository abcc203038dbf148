//! What is seen of a candidate where it takes over: at the largest size at which it may be shown.
//!
//! A surface that is e off in RMS, in shares of the bounding box's diagonal, is off by e · S pixels
//! where that diagonal spans S. It may be shown while that is at most the tolerance t: up to
//! S = t / e. So close nobody looks at a coarse level in frames of 512 pixels; the same cameras with
//! frames in which the diagonal spans S show it, and the reference, as people see them.

use serde::Serialize;

use super::views::Seen;

/// How a candidate looks at its largest size; at the rig's own where that is less, which then gives
/// the figures of the rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct AtSwitch {
    /// What the reference's diagonal spans, in pixels.
    pub pixels: f64,
    /// Pixels along each side of a view.
    pub resolution: usize,
    /// As [`super::Metrics::rms_luminance`].
    pub rms_luminance: f64,
    /// As [`super::Metrics::rms_luminance_srgb`].
    pub rms_luminance_srgb: f64,
    /// As [`super::Metrics::ssim`].
    pub ssim: f64,
}

impl AtSwitch {
    pub(super) fn new(pixels: f64, resolution: usize, seen: &Seen) -> Self {
        Self {
            pixels,
            resolution,
            rms_luminance: seen.difference.rms(),
            rms_luminance_srgb: seen.difference.rms_srgb(),
            ssim: seen.similarity.mean(),
        }
    }
}

/// The largest size at which a surface of this RMS distance (over the diagonal) may be shown, in
/// pixels that the diagonal spans; infinite for one without error.
pub fn largest_size(pixel_tolerance: f64, distance_rms: f64) -> f64 {
    pixel_tolerance / distance_rms
}
