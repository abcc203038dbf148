//! What a level may be shown for: its measured error, and the size on screen that follows from it.
//!
//! A level whose RMS surface distance is e, in shares of the bounding box's diagonal, is off by
//! e · S pixels where that diagonal spans S pixels. It may be shown while that is at most the
//! tolerance: up to S = tolerance / e. The same size as a distance, for a field of view φ over H
//! pixels of height and a diagonal D in world units: d = D · H / (2 tan(φ/2) · S).
//!
//! The certificate also tells what is seen there: RMS luminance and SSIM by the rig of the evaluation,
//! with frames in which the diagonal spans S pixels.
//!
//! Guaranteed: levels are shown in their order, each below its own size. Not guaranteed: that no
//! single point is off by more than the tolerance, since e is a mean of squares; and texture and
//! shading are judged by the other figures.

use serde::Serialize;
use serde_json::{Value, json};

use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::evaluate::{Metrics, switch};

/// The screen that sizes are reckoned for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Screen {
    /// Vertical field of view in degrees.
    pub field_of_view_degrees: f64,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// How many pixels a surface may be off.
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
        switch::largest_size(self.pixel_tolerance, distance_rms)
    }

    /// How far away a diagonal of length `diagonal` spans `pixels`, in its unit.
    pub fn distance(&self, diagonal: f64, pixels: f64) -> f64 {
        let half = (self.field_of_view_degrees.to_radians() / 2.0).tan();
        diagonal * f64::from(self.height) / (2.0 * half * pixels)
    }

    /// The share of the screen's area that a disk of this diameter in pixels covers, at most 1.
    fn coverage(&self, pixels: f64) -> f64 {
        let area = f64::from(self.width) * f64::from(self.height);
        (std::f64::consts::FRAC_PI_4 * pixels * pixels / area).min(1.0)
    }

    /// The sizes of a chain's levels in pixels, made to fall from level to level.
    pub fn largest_sizes(&self, metrics: &[Metrics]) -> Vec<f64> {
        let mut size = f64::INFINITY;
        metrics
            .iter()
            .map(|metrics| {
                size = size.min(self.largest_size(metrics.distance_rms));
                size
            })
            .collect()
    }

    /// `MSFT_screencoverage` of a node whose own diagonal is `share` of the whole asset's: for the
    /// source and each level the least share of the screen's area at which it is still shown. The
    /// last is 0, so that something always is.
    pub fn coverages(&self, sizes: &[f64], share: f64) -> Vec<f64> {
        sizes.iter().map(|size| self.coverage(size * share)).chain([0.0]).collect()
    }
}

/// Which level to show where the asset's diagonal spans `pixels`: 0 is the source, and the
/// coarsest whose largest size is not below it is chosen.
///
/// `sizes` are those of [`Screen::largest_sizes`].
pub fn select_level(sizes: &[f64], pixels: f64) -> usize {
    sizes.iter().take_while(|&&size| pixels <= size).count()
}

/// Reads the largest sizes of the levels from the JSON report of a bake.
///
/// # Errors
/// [`Error::Invalid`] if it is none, or of a bake that was not evaluated.
pub fn largest_sizes(report: &str) -> Result<Vec<f64>> {
    let invalid = |at: &str, what: &str| Error::invalid(at, what);
    let report: Value =
        serde_json::from_str(report).map_err(|error| invalid("the report", &error.to_string()))?;
    let levels = report.get("levels").and_then(Value::as_array);
    let levels = levels.ok_or_else(|| invalid("/levels", "there are none: not a bake's report"))?;
    let size = |(index, level): (usize, &Value)| match level.get("metrics") {
        Some(Value::Object(_)) => {
            Ok(level.get("largest_size_pixels").and_then(Value::as_f64).unwrap_or(f64::INFINITY))
        }
        _ => Err(invalid(&format!("/levels/{index}/metrics"), "the level was not evaluated")),
    };
    levels.iter().enumerate().map(size).collect()
}

/// The certificate of one level, as it stands in its file.
pub fn certificate(level: usize, metrics: &Metrics, triangles: usize, screen: &Screen) -> Value {
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "level": level,
        "triangles": triangles,
        "distance_rms": metrics.distance_rms,
        "distance_max": metrics.distance_max,
        "rms_luminance": metrics.rms_luminance,
        "rms_luminance_srgb": metrics.rms_luminance_srgb,
        "ssim": metrics.ssim,
        "at_switch": metrics.at_switch,
        "color_rms": metrics.color_rms,
        "normal_degrees_rms": metrics.normal_degrees_rms,
        "largest_size_pixels": screen.largest_size(metrics.distance_rms),
        "screen": screen,
    })
}

/// Puts a value under `extras.seamwise` of the document's `asset`, beside what is there.
pub fn certify(asset: &mut Asset, certificate: Value) {
    let Some(object) = asset.json.get_mut("asset").and_then(Value::as_object_mut) else {
        return;
    };
    let extras = object.entry("extras").or_insert_with(|| json!({}));
    if let Some(extras) = extras.as_object_mut() {
        extras.insert("seamwise".into(), certificate);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metrics(distance_rms: f64) -> Metrics {
        Metrics { distance_rms, ..Metrics::default() }
    }

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
        let sizes = Screen::default().largest_sizes(&[metrics(1e-3), metrics(5e-4), metrics(1e-2)]);
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

    #[test]
    fn sizes_are_read_back_from_a_report() {
        let report = r#"{"levels": [{"metrics": {}, "largest_size_pixels": null},
            {"metrics": {}, "largest_size_pixels": 50.5}]}"#;
        assert_eq!(largest_sizes(report).unwrap(), [f64::INFINITY, 50.5]);
        let unmeasured = largest_sizes(r#"{"levels": [{"metrics": null}]}"#).unwrap_err();
        assert!(unmeasured.to_string().starts_with("/levels/0/metrics"));
        assert!(largest_sizes("{}").is_err());
    }

    #[test]
    fn a_certificate_stands_beside_what_was_there() {
        let mut asset = Asset {
            json: json!({"asset": {"version": "2.0", "extras": {"author": "somebody"}}}),
            buffers: Vec::new(),
            images: Vec::new(),
        };
        certify(&mut asset, certificate(2, &metrics(1e-3), 500, &Screen::default()));
        let extras = &asset.json["asset"]["extras"];
        assert_eq!(extras["author"], "somebody");
        assert_eq!(extras["seamwise"]["level"], 2);
        assert_eq!(extras["seamwise"]["largest_size_pixels"], 1000.0);
        assert_eq!(extras["seamwise"]["at_switch"]["rms_luminance_srgb"], 0.0);
    }
}
