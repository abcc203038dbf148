//! Figures as CSV: a row for each record, its fields and its metrics flat, under the names that they
//! have in the JSON.

use serde::Serialize;
use serde_json::Value;

use crate::error::{Error, Result};
use crate::evaluate::Metrics;

/// A row for each pair of a record and its metrics, flat.
pub(super) fn to_csv<'a, R: Serialize + 'a>(
    records: impl Iterator<Item = (&'a R, &'a Option<Metrics>)>,
) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for (index, (record, metrics)) in records.enumerate() {
        // Columns are those of a record with metrics, whether this one has them or not.
        let mut fields = Vec::new();
        flatten("", &serde_json::to_value(record).map_err(Error::internal)?, &mut fields);
        fields.retain(|(name, _)| {
            !["metrics", "views"].contains(&name.as_str()) && !name.starts_with("metrics.")
        });
        let figures = serde_json::to_value(metrics.unwrap_or_default());
        let mut measured = Vec::new();
        flatten("", &figures.map_err(Error::internal)?, &mut measured);
        if metrics.is_none() {
            measured.iter_mut().for_each(|(_, figure)| figure.clear());
        }
        fields.extend(measured);
        if index == 0 {
            let names = fields.iter().map(|(name, _)| name);
            writer.write_record(names).map_err(Error::internal)?;
        }
        let row = fields.iter().map(|(_, figure)| figure);
        writer.write_record(row).map_err(Error::internal)?;
    }
    let bytes = writer.into_inner().map_err(Error::internal)?;
    String::from_utf8(bytes).map_err(Error::internal)
}

/// The leaves of a JSON value with their paths, joined by dots.
fn flatten(path: &str, value: &Value, out: &mut Vec<(String, String)>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                flatten(&path, value, out);
            }
        }
        Value::Null => out.push((path.to_owned(), String::new())),
        Value::String(text) => out.push((path.to_owned(), text.clone())),
        other => out.push((path.to_owned(), other.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::ViewMetrics;
    use crate::report::CandidateReport;

    #[test]
    fn a_failure_keeps_its_columns_empty_in_csv() {
        let candidate = |file: &str, metrics| CandidateReport {
            file: file.into(),
            triangles: 2,
            metrics,
            views: vec![ViewMetrics::default()],
            ..CandidateReport::default()
        };
        let candidates = [
            candidate("a, b.glb", None),
            candidate("c.glb", Some(Metrics { color_rms: 0.5, ..Metrics::default() })),
        ];
        let rows = candidates.iter().map(|candidate| (candidate, &candidate.metrics));
        let text = to_csv(rows).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0].starts_with("file,triangles,failure,warning,rms_luminance"));
        assert!(lines[0].contains("forward.distance_rms") && !lines[0].contains("views"));
        assert!(lines[1].starts_with("\"a, b.glb\",2,,,,"));
        let column = lines[0].split(',').position(|name| name == "color_rms").unwrap();
        assert_eq!(lines[2].split(',').nth(column), Some("0.5"));
    }
}
