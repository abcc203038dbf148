//! What a bake or an evaluation found, as JSON, as a table and as a page.

mod chart;
mod figures;
pub mod html;
pub mod pictures;
pub mod threads;
mod ticks;

use serde::Serialize;
use serde_json::Value;

use crate::certificate::Screen;
use crate::error::{Error, Result};
use crate::evaluate::Metrics;
use crate::evaluate::camera::{Camera, Rig};
use crate::evaluate::scene::Mode;

/// What a bake did, in schema 1.
#[derive(Clone, Debug, Serialize)]
pub struct BakeReport {
    /// Version of this layout.
    pub schema: u32,
    /// What went in.
    pub input: InputReport,
    /// The screen that the sizes of the levels are reckoned for.
    pub screen: Screen,
    /// What came out, the finest first.
    pub levels: Vec<LevelReport>,
    /// Wall time of each stage.
    pub seconds: Seconds,
    /// Most memory that the process held at once; `None` where the system does not tell.
    pub peak_memory_bytes: Option<u64>,
}

/// The source of a bake.
#[derive(Clone, Debug, Serialize)]
pub struct InputReport {
    /// Its file.
    pub file: String,
    /// Meshes with triangles.
    pub meshes: usize,
    /// Triangles, without degenerate ones.
    pub triangles: usize,
    /// Points after welding.
    pub points: usize,
    /// Wedges after welding.
    pub wedges: usize,
    /// Triangles left out because two of their corners are one point.
    pub degenerate_triangles: usize,
}

/// One level.
#[derive(Clone, Debug, Serialize)]
pub struct LevelReport {
    /// Its share of the source's triangles.
    pub ratio: f64,
    /// The triangles asked for.
    pub target: usize,
    /// The triangles it has.
    pub triangles: usize,
    /// Its points.
    pub points: usize,
    /// Its wedges.
    pub wedges: usize,
    /// Root of the largest area-weighted cost of a collapse, in the units of the file.
    pub error: f64,
    /// Whether the target was reached.
    pub reached: bool,
    /// Why not, if it was not.
    pub why: Option<String>,
    /// The largest size at which it may be shown, in pixels that the diagonal of the source's
    /// bounding box spans, if it was evaluated; see [`crate::certificate`]. `None` also where the
    /// level has no error at all.
    pub largest_size_pixels: Option<f64>,
    /// How far it is from the source, if it was evaluated.
    pub metrics: Option<Metrics>,
}

/// Wall time of each stage in seconds; 0 for one that did not run.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Files to assets.
    pub read: f64,
    /// Vertices to points and wedges.
    pub weld: f64,
    /// The descent.
    pub simplify: f64,
    /// The fit of the levels to the source.
    pub polish: f64,
    /// Filling the atlases.
    pub repair: f64,
    /// Sampling textures anew.
    pub transfer: f64,
    /// Levels to files.
    pub write: f64,
    /// Measuring the levels.
    pub evaluate: f64,
    /// Drawing the pictures of the page.
    pub report: f64,
}

impl BakeReport {
    /// The report as JSON.
    ///
    /// # Errors
    /// [`Error::Internal`] if it can't be written so.
    pub fn to_json(&self) -> Result<String> {
        to_json(self)
    }

    /// The report as a table for people.
    pub fn to_table(&self) -> String {
        let mut rows = vec![header("level")];
        rows.extend(self.rows());
        let mut text = align(&rows);
        for miss in self.misses() {
            text += &format!("{miss}\n");
        }
        let s = &self.seconds;
        text += &format!(
            "read {:.2} s, weld {:.2} s, simplify {:.2} s, repair {:.2} s, write {:.2} s, evaluate {:.2} s",
            s.read, s.weld, s.simplify, s.repair, s.write, s.evaluate
        );
        if let Some(bytes) = self.peak_memory_bytes {
            text += &format!("; peak memory {:.0} MB", bytes as f64 / 1e6);
        }
        text.push('\n');
        text
    }

    /// The source and the levels as rows of a table.
    fn rows(&self) -> Vec<[String; COLUMNS]> {
        let mut rows = vec![row("source", self.input.triangles, None)];
        for (index, level) in self.levels.iter().enumerate() {
            let percent = (level.ratio * 1e6).round() / 1e4;
            let name = format!("{} ({percent} %)", index + 1);
            rows.push(row(&name, level.triangles, level.metrics.as_ref()));
        }
        rows
    }

    /// A line for each level that missed its target, with the reason.
    fn misses(&self) -> Vec<String> {
        let miss = |(index, level): (usize, &LevelReport)| {
            let why = level.why.as_ref()?;
            Some(format!("level {} missed its {} triangles: {why}", index + 1, level.target))
        };
        self.levels.iter().enumerate().filter_map(miss).collect()
    }
}

/// What an evaluation found, in schema 1.
#[derive(Clone, Debug, Serialize)]
pub struct EvaluateReport {
    /// Version of this layout.
    pub schema: u32,
    /// What the candidates were compared with.
    pub reference: ReferenceReport,
    /// How surfaces were colored in the views.
    pub mode: Mode,
    /// The cameras, in the order of a sheet's rows, so that another renderer can see what was seen.
    pub views: Vec<ViewReport>,
    /// The candidates, in the order they were given.
    pub candidates: Vec<CandidateReport>,
}

/// The reference of an evaluation.
#[derive(Clone, Debug, Serialize)]
pub struct ReferenceReport {
    /// Its file.
    pub file: String,
    /// Its triangles.
    pub triangles: usize,
    /// Diagonal of its bounding box, which distances are divided by, in world units.
    pub diagonal: f64,
}

/// A camera of an evaluation: a pinhole of square frame.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ViewReport {
    /// Where it stands, in world units.
    pub eye: [f64; 3],
    /// What it looks at, in world units: the middle of the picture.
    pub target: [f64; 3],
    /// Unit vector that is upward in the picture.
    pub up: [f64; 3],
    /// Of the whole frame, both ways.
    pub field_of_view_degrees: f64,
}

impl ViewReport {
    /// The cameras of a rig, in its order.
    pub fn of(rig: &Rig) -> Vec<Self> {
        let view = |camera: &Camera| Self {
            eye: camera.eye.to_array(),
            target: rig.center.to_array(),
            up: camera.up.to_array(),
            field_of_view_degrees: 2.0 * camera.half_width.atan().to_degrees(),
        };
        rig.cameras.iter().map(view).collect()
    }
}

/// A candidate of an evaluation.
#[derive(Clone, Debug, Serialize)]
pub struct CandidateReport {
    /// Its file.
    pub file: String,
    /// Its triangles.
    pub triangles: usize,
    /// How far it is from the reference; `None` if it could not be compared.
    pub metrics: Option<Metrics>,
    /// Why it could not be compared.
    pub failure: Option<String>,
}

impl EvaluateReport {
    /// The report as JSON.
    ///
    /// # Errors
    /// [`Error::Internal`] if it can't be written so.
    pub fn to_json(&self) -> Result<String> {
        to_json(self)
    }

    /// The candidates as CSV: a row each, columns named as in the JSON, empty where there is no
    /// figure.
    ///
    /// # Errors
    /// [`Error::Internal`] if they can't be written so.
    pub fn to_csv(&self) -> Result<String> {
        to_csv(self.candidates.iter().map(|candidate| (candidate, &candidate.metrics)))
    }

    /// The report as a table for people.
    pub fn to_table(&self) -> String {
        let mut rows = vec![header("file")];
        rows.extend(self.rows());
        align(&rows)
    }

    /// The reference and the candidates as rows of a table.
    fn rows(&self) -> Vec<[String; COLUMNS]> {
        let mut rows = vec![row(&self.reference.file, self.reference.triangles, None)];
        for candidate in &self.candidates {
            rows.push(row(&candidate.file, candidate.triangles, candidate.metrics.as_ref()));
        }
        rows
    }
}

/// A row for each pair of a record and its metrics, flat.
fn to_csv<'a, R: Serialize + 'a>(
    records: impl Iterator<Item = (&'a R, &'a Option<Metrics>)>,
) -> Result<String> {
    let internal = |error: String| Error::Internal { what: error };
    let mut writer = csv::Writer::from_writer(Vec::new());
    for (index, (record, metrics)) in records.enumerate() {
        // Columns are those of a record with metrics, whether this one has them or not.
        let mut fields = Vec::new();
        flatten(
            "",
            &serde_json::to_value(record).map_err(|e| internal(e.to_string()))?,
            &mut fields,
        );
        fields.retain(|(name, _)| name != "metrics" && !name.starts_with("metrics."));
        let figures = serde_json::to_value(metrics.unwrap_or_default());
        let mut measured = Vec::new();
        flatten("", &figures.map_err(|e| internal(e.to_string()))?, &mut measured);
        if metrics.is_none() {
            measured.iter_mut().for_each(|(_, figure)| figure.clear());
        }
        fields.extend(measured);
        if index == 0 {
            let names = fields.iter().map(|(name, _)| name);
            writer.write_record(names).map_err(|e| internal(e.to_string()))?;
        }
        let row = fields.iter().map(|(_, figure)| figure);
        writer.write_record(row).map_err(|e| internal(e.to_string()))?;
    }
    let bytes = writer.into_inner().map_err(|e| internal(e.to_string()))?;
    String::from_utf8(bytes).map_err(|e| internal(e.to_string()))
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

fn to_json(report: &impl Serialize) -> Result<String> {
    let text = serde_json::to_string_pretty(report);
    Ok(text.map_err(|error| Error::Internal { what: error.to_string() })? + "\n")
}

const COLUMNS: usize = 12;

fn header(first: &str) -> [String; COLUMNS] {
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
        "sRGB at switch",
    ]
    .map(str::to_owned)
}

fn row(name: &str, triangles: usize, metrics: Option<&Metrics>) -> [String; COLUMNS] {
    let figure = |of: fn(&Metrics) -> String| metrics.map_or(String::new(), of);
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
        figure(|m| m.volume_ratio.map_or("–".to_owned(), |ratio| format!("{ratio:.4}"))),
        figure(|m| format!("{:.4}", m.silhouette_iou)),
        figure(|m| format!("{:.5} @ {:.0}", m.at_switch.rms_luminance_srgb, m.at_switch.pixels)),
    ]
}

/// Columns of equal width: the first to the left, figures to the right.
pub(crate) fn align<const COLUMNS: usize>(rows: &[[String; COLUMNS]]) -> String {
    let width =
        |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..COLUMNS).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let mut line = format!("{:<1$}", row[0], widths[0]);
        for (cell, width) in row.iter().zip(&widths).skip(1) {
            line += &format!("  {cell:>width$}");
        }
        text += line.trim_end();
        text.push('\n');
    }
    text
}

/// Most memory that this process has held at once, in bytes.
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, Vec3};

    #[test]
    fn a_failure_keeps_its_columns_empty_in_csv() {
        let candidate = |file: &str, metrics| CandidateReport {
            file: file.into(),
            triangles: 2,
            metrics,
            failure: None,
        };
        let candidates = [
            candidate("a, b.glb", None),
            candidate("c.glb", Some(Metrics { color_rms: 0.5, ..Metrics::default() })),
        ];
        let rows = candidates.iter().map(|candidate| (candidate, &candidate.metrics));
        let text = to_csv(rows).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0].starts_with("file,triangles,failure,rms_luminance"));
        assert!(lines[0].contains("forward.distance_rms"));
        assert!(lines[1].starts_with("\"a, b.glb\",2,,,"));
        let column = lines[0].split(',').position(|name| name == "color_rms").unwrap();
        assert_eq!(lines[2].split(',').nth(column), Some("0.5"));
    }

    #[test]
    fn columns_line_up() {
        let rows = [header("file"), row("a", 12, Some(&Metrics::default())), row("bcdef", 3, None)];
        let text = align(&rows);
        let lines: Vec<&str> = text.lines().collect();
        let end = |line: &str, word: &str| line.find(word).map(|at| at + word.len());
        assert_eq!(end(lines[0], "triangles"), end(lines[1], "12"));
        assert_eq!(end(lines[0], "triangles"), end(lines[2], "3"));
    }

    #[test]
    fn a_view_tells_its_camera() {
        let rig = Rig::new(Vec3::new(1.0, 2.0, 3.0), 5.0, 24, 64);
        for (camera, view) in rig.cameras.iter().zip(ViewReport::of(&rig)) {
            assert_eq!((view.eye, view.target), (camera.eye.to_array(), [1.0, 2.0, 3.0]));
            assert!((view.field_of_view_degrees - 40.0).abs() < 1e-12);
            // What another tool builds of it is the camera again.
            let [eye, target, up] = [view.eye, view.target, view.up].map(DVec3::from_array);
            let forward = (target - eye).normalize();
            assert!((forward - camera.forward).length() < 1e-12);
            assert!((forward.cross(up).normalize() - camera.right).length() < 1e-12);
        }
    }
}
