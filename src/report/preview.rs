//! A first look at levels, in a few lines.

use super::columns::{Column, fit};
use super::summary::seen;
use super::ticks::grouped;
use crate::evaluate::Metrics;

/// Signs of a line.
const WIDTH: usize = 80;

/// Rough figures of levels, each with its triangles.
pub(crate) fn preview_table(source: usize, levels: &[(usize, Metrics)]) -> String {
    let column = |head: &str, source: String, of: &dyn Fn(&(usize, Metrics)) -> String| {
        Column::new(head, 0, std::iter::once(source).chain(levels.iter().map(of)).collect())
    };
    let names = (1..=levels.len()).map(|level| level.to_string());
    let columns = vec![
        Column::new(
            "at first sight",
            0,
            std::iter::once("source".to_owned()).chain(names).collect(),
        ),
        column("triangles", grouped(source), &|own| grouped(own.0)),
        column("SSIM", String::new(), &|own| seen(own.1.ssim, 4)),
        column("luminance", String::new(), &|own| seen(own.1.rms_luminance_srgb, 5)),
        column("distance", String::new(), &|own| format!("{:.1e}", own.1.distance_rms)),
        column("color", String::new(), &|own| format!("{:.4}", own.1.color_rms)),
    ];
    fit(columns, WIDTH)
}
