//! Figures as a table for people.

use super::ticks::grouped;
use crate::evaluate::{AtSwitch, Metrics};

/// Columns of a table of figures.
pub(super) const COLUMNS: usize = 12;

/// The column heads, beginning with `first`.
pub(super) fn header(first: &str) -> [String; COLUMNS] {
    [
        first,
        "triangles",
        "RMS Y",
        "RMS Y sRGB",
        "SSIM",
        "distance RMS",
        "max",
        "color",
        "normal °",
        "volume",
        "silhouette",
        "at switch",
    ]
    .map(str::to_owned)
}

/// A candidate or level; its figures are empty where there are none.
pub(super) fn row(name: &str, triangles: usize, metrics: Option<&Metrics>) -> [String; COLUMNS] {
    // NaN is a figure of what no view shows.
    let figure = |of: fn(&Metrics) -> String| metrics.map_or(String::new(), of).replace("NaN", "–");
    [
        name.to_owned(),
        triangles.to_string(),
        figure(|m| format!("{:.5}", m.rms_luminance)),
        figure(|m| format!("{:.5}", m.rms_luminance_srgb)),
        figure(|m| format!("{:.4}", m.ssim)),
        figure(|m| format!("{:.2e}", m.distance_rms)),
        figure(|m| format!("{:.2e}", m.distance_max)),
        figure(|m| format!("{:.4}", m.color_rms)),
        figure(|m| format!("{:.2}", m.normal_degrees_rms)),
        figure(|m| m.volume_ratio.map_or("–".to_owned(), volume_text)),
        figure(|m| format!("{:.4}", m.silhouette_iou)),
        figure(|m| switch_text(&m.at_switch)),
    ]
}

/// The size at which a candidate takes over, with its luminance there.
fn switch_text(at: &AtSwitch) -> String {
    if at.pixels.is_finite() {
        format!("{:.5} @ {}", at.rms_luminance_srgb, grouped(at.pixels.floor() as usize))
    } else {
        "at any size".into()
    }
}

/// A ratio of volumes; that of another unit as a power of ten.
fn volume_text(ratio: f64) -> String {
    if ratio.abs() < 1000.0 { format!("{ratio:.4}") } else { format!("{ratio:.2e}") }
}

/// Columns of equal width: the first to the left, figures to the right.
pub(crate) fn align(rows: &[impl AsRef<[String]>]) -> String {
    let rows = || rows.iter().map(AsRef::as_ref);
    let width = |column: usize| rows().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows().next().map_or(0, <[String]>::len)).map(width).collect();
    let mut text = String::new();
    for row in rows() {
        let mut line = format!("{:<1$}", row[0], widths[0]);
        for (cell, width) in row.iter().zip(&widths).skip(1) {
            line += &format!("  {cell:>width$}");
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let rows = [header("file"), row("a", 12, Some(&Metrics::default())), row("bcdef", 3, None)];
        let text = align(&rows);
        let lines: Vec<&str> = text.lines().collect();
        let end = |line: &str, word: &str| line.find(word).map(|at| at + word.len());
        assert_eq!(end(lines[0], "triangles"), end(lines[1], "12"));
        assert_eq!(end(lines[0], "triangles"), end(lines[2], "3"));
    }
}
