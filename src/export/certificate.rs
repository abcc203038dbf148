//! The certificate of a level: its measured error, and the largest size on screen at which it can't be
//! told from the source.
//!
//! How that size S is found is told in [`screen`](crate::screen) and [`evaluate`](crate::evaluate): the
//! surface is off by at most the tolerance but for a thousandth of it, and no view shows a difference
//! above [`VISIBLE`](crate::evaluate::visible::VISIBLE). The certificate has the figures at that size too.

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
/// `largest_size` is of its chain, for the screen beside it.
pub fn certificate(
    level: usize,
    metrics: &Metrics,
    triangles: usize,
    largest_size: f64,
    screen: &Screen,
) -> Value {
    json!({
        "version": env!("CARGO_PKG_VERSION"),
        "level": level,
        "triangles": triangles,
        "distance_rms": metrics.distance_rms,
        "distance_p999": metrics.distance_p999,
        "distance_max": metrics.distance_max,
        "rms_luminance": metrics.rms_luminance,
        "rms_luminance_srgb": metrics.rms_luminance_srgb,
        "ssim": metrics.ssim,
        "at_switch": metrics.at_switch,
        "color_rms": metrics.color_rms,
        "normal_degrees_rms": metrics.normal_degrees_rms,
        "largest_size_pixels": largest_size,
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
        certify(&mut asset, certificate(2, &metrics(1e-3), 500, 1000.0, &Screen::default()));
        let extras = &asset.json["asset"]["extras"];
        assert_eq!(extras["author"], "somebody");
        assert_eq!(extras["seamwise"]["level"], 2);
        assert_eq!(extras["seamwise"]["largest_size_pixels"], 1000.0);
        assert_eq!(extras["seamwise"]["at_switch"]["rms_luminance_srgb"], 0.0);
    }
}
