//! The figures that charts show, and the candidates that are one series.

use super::chart::{COLORS, Chart, Point, Series};
use crate::evaluate::Metrics;

/// A candidate with its name, triangles, figures and series.
pub(super) type Measured<'a> = (String, usize, &'a Metrics, usize);

/// The name, unit and ideal of a chart's figure, and its value in metrics.
type Figure = (&'static str, &'static str, f64, fn(&Metrics) -> Option<f64>);

/// The unit of distances.
const DIAGONAL: &str = "of the diagonal";
/// The charts, in the order of the page.
const FIGURES: [Figure; 12] = [
    ("RMS luminance", "sRGB, 0…1", 0.0, |m| Some(m.rms_luminance_srgb)),
    ("Luminance at seams", "sRGB", 0.0, |m| Some(m.rms_luminance_srgb_seams)),
    ("Luminance at switch", "sRGB", 0.0, |m| Some(m.at_switch.rms_luminance_srgb)),
    ("Similarity", "SSIM", 1.0, |m| Some(m.ssim)),
    ("RMS distance", DIAGONAL, 0.0, |m| Some(m.distance_rms)),
    ("Mean distance", DIAGONAL, 0.0, |m| Some(m.distance_mean)),
    ("Max distance", DIAGONAL, 0.0, |m| Some(m.distance_max)),
    ("Silhouette overlap", "IoU", 1.0, |m| Some(m.silhouette_iou)),
    ("Color error", "RMS, sRGB", 0.0, |m| Some(m.color_rms)),
    ("Normal error", "RMS, degrees", 0.0, |m| Some(m.normal_degrees_rms)),
    ("Volume", "over the source’s", 1.0, |m| m.volume_ratio),
    ("Area", "over the source’s", 1.0, |m| Some(m.area_ratio)),
];

/// The charts: one for each figure that a candidate has.
pub(super) fn charts(measured: &[Measured<'_>]) -> Vec<Chart> {
    let last = measured.iter().map(|(.., series)| *series).max();
    let series = |of: fn(&Metrics) -> Option<f64>, color: usize| {
        let own = measured.iter().filter(|(.., series)| *series == color);
        let mut points: Vec<Point> = own
            .filter_map(|(name, triangles, metrics, _)| {
                let value = of(metrics).filter(|value| value.abs() < 1e12)?;
                Some(Point { triangles: *triangles, value, deviation: 0.0, name: name.clone() })
            })
            .collect();
        points.sort_by_key(|point| point.triangles);
        Series { color: color % COLORS, points }
    };
    let chart = |&(title, unit, ideal, of): &Figure| Chart {
        title,
        unit,
        ideal,
        across: "triangles",
        series: (0..=last.unwrap_or(0)).map(|color| series(of, color)).collect(),
    };
    FIGURES.iter().map(chart).filter(|chart| !chart.is_empty()).collect()
}

/// The volume and the area of the source and of each candidate, in units of the world and over the source's.
pub(super) fn solids(measured: &[Measured<'_>]) -> Vec<[String; 5]> {
    let Some((_, _, first, _)) = measured.first() else { return Vec::new() };
    let number = |value: f64| match value.abs() {
        usual if (0.01..1e5).contains(&usual) => format!("{value:.4}"),
        0.0 => "0".to_owned(),
        _ => format!("{value:.3e}"),
    };
    let row = |name: &str, volume: Option<f64>, ratio: Option<f64>, area: f64, share: f64| {
        let dash = || "–".to_owned();
        let percent = |ratio: f64| format!("{:.2} %", 100.0 * ratio);
        let volumes = [volume.map_or_else(dash, number), ratio.map_or_else(dash, percent)];
        let [volume, ratio] = volumes;
        [name.to_owned(), volume, ratio, number(area), percent(share)]
    };
    let source = first.volume.zip(first.volume_ratio).map(|(own, ratio)| own / ratio);
    let own = row("source", source, source.map(|_| 1.0), first.area / first.area_ratio, 1.0);
    let others = measured
        .iter()
        .map(|(name, _, own, _)| row(name, own.volume, own.volume_ratio, own.area, own.area_ratio));
    std::iter::once(own).chain(others).collect()
}

/// The series of each file: the levels that one bake wrote, `<stem>_lod<n>.glb` in one folder, are
/// one; any other file is its own.
pub fn series_of(files: &[&str]) -> Vec<usize> {
    let mut keys: Vec<&str> = Vec::new();
    let mut colors = Vec::new();
    for file in files {
        let key = level_stem(file).unwrap_or(file);
        let known = level_stem(file).and_then(|_| keys.iter().position(|known| *known == key));
        colors.push(known.unwrap_or(keys.len()));
        if known.is_none() {
            keys.push(key);
        }
    }
    colors
}

/// The path of a level without `_lod<n>.glb`.
fn level_stem(file: &str) -> Option<&str> {
    let (stem, number) = file.strip_suffix(".glb")?.rsplit_once("_lod")?;
    (!number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())).then_some(stem)
}

/// A path's last part.
pub(super) fn file_name(path: &str) -> String {
    std::path::Path::new(path)
        .file_name()
        .map_or_else(|| path.to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Each file by the shortest end of its path that no other one has: its name, or as many of its folders with it as
/// it takes. Files that are the same are called the same.
pub fn short_names(files: &[&str]) -> Vec<String> {
    let parts: Vec<Vec<&str>> =
        files.iter().map(|file| file.rsplit(std::path::is_separator).collect()).collect();
    // Paths from their ends: those with the longest common start with one stand beside it in order.
    let mut sorted: Vec<&Vec<&str>> = parts.iter().collect();
    sorted.sort_unstable();
    sorted.dedup();
    let common = |a: &[&str], b: &[&str]| a.iter().zip(b).take_while(|(a, b)| a == b).count();
    let name = |own: &Vec<&str>| {
        let at = sorted.partition_point(|other| *other < own);
        let beside = [at.checked_sub(1).map(|at| sorted[at]), sorted.get(at + 1).copied()];
        let most = beside.into_iter().flatten().map(|other| common(own, other)).max().unwrap_or(0);
        let mut end = own[..own.len().min(most + 1)].to_vec();
        end.reverse();
        end.join("/")
    };
    parts.iter().map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_of_one_bake_are_one_series() {
        let files = ["a/x_lod1.glb", "other.glb", "a/x_lod2.glb", "b/x_lod2.glb", "other.glb"];
        assert_eq!(series_of(&files), [0, 1, 0, 2, 3]);
        assert_eq!(level_stem("a/x_lod12.glb"), Some("a/x"));
        assert_eq!(level_stem("a/x_lod.glb"), None);
        assert_eq!(level_stem("a/x_lodge.glb"), None);
    }

    #[test]
    fn files_go_by_their_names_where_those_differ() {
        let names = short_names(&["a/x.glb", "b/x.glb", "b/y.glb"]);
        assert_eq!(names, ["a/x.glb", "b/x.glb", "y.glb"]);
        let names = short_names(&["/in/a/lod/x.glb", "/in/b/lod/x.glb", "lod/x.glb", "x.glb"]);
        assert_eq!(names, ["a/lod/x.glb", "b/lod/x.glb", "lod/x.glb", "x.glb"]);
        assert_eq!(short_names(&["a/x.glb", "a/x.glb"]), ["x.glb", "x.glb"]);
    }

    #[test]
    fn points_are_sorted_and_figures_without_a_value_left_out() {
        let metrics = Metrics { rms_luminance_srgb: 0.5, volume_ratio: None, ..Metrics::default() };
        let bad = Metrics { distance_max: f64::NAN, ..metrics };
        let measured = [("a".into(), 9, &metrics, 0), ("b".into(), 4, &bad, 0)];
        let charts = charts(&measured);
        assert_eq!(charts.len(), FIGURES.len() - 1, "no volume");
        let triangles = |chart: &Chart| -> Vec<usize> {
            chart.series[0].points.iter().map(|point| point.triangles).collect()
        };
        assert_eq!(triangles(&charts[0]), [4, 9]);
        let max = charts.iter().find(|chart| chart.title == "Max distance").unwrap();
        assert_eq!(triangles(max), [9]);
    }
}
