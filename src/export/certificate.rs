//! The certificate of a level: its measured error, and the largest size on screen that follows from
//! it.
//!
//! The formula is in [`screen`](crate::screen).
//!
//! The certificate also has the figures at that size S: RMS luminance and SSIM by the rig of the
//! evaluation, with frames in which the diagonal spans S pixels.
//!
//! Not guaranteed: anything about texture and shading by the size alone; the other figures judge those.

use serde_json::{Value, json};

use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::evaluate::Metrics;
use crate::screen::Screen;

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
            ..Asset::default()
        };
        certify(&mut asset, certificate(2, &metrics(1e-3), 500, &Screen::default()));
        let extras = &asset.json["asset"]["extras"];
        assert_eq!(extras["author"], "somebody");
        assert_eq!(extras["seamwise"]["level"], 2);
        assert_eq!(extras["seamwise"]["largest_size_pixels"], 1000.0);
        assert_eq!(extras["seamwise"]["at_switch"]["rms_luminance_srgb"], 0.0);
    }
}
