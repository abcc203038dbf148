//! What a bake or an evaluation found, as JSON, as a table and as a page.

mod chart;
mod figures;
pub mod html;
pub mod pictures;
pub mod threads;
mod ticks;

use serde::Serialize;

use crate::error::{Error, Result};
use crate::evaluate::Metrics;

/// What a bake did, in schema 1.
#[derive(Clone, Debug, Serialize)]
pub struct BakeReport {
    /// Version of this layout.
    pub schema: u32,
    /// What went in.
    pub input: InputReport,
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

fn to_json(report: &impl Serialize) -> Result<String> {
    let text = serde_json::to_string_pretty(report);
    Ok(text.map_err(|error| Error::Internal { what: error.to_string() })? + "\n")
}

const COLUMNS: usize = 10;

fn header(first: &str) -> [String; COLUMNS] {
    [
        first,
        "triangles",
        "RMS Y",
        "RMS Y sRGB",
        "distance RMS",
        "max",
        "color",
        "normal °",
        "volume",
        "silhouette",
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
        figure(|m| format!("{:.2e}", m.distance_rms)),
        figure(|m| format!("{:.2e}", m.distance_max)),
        figure(|m| format!("{:.4}", m.color_rms)),
        figure(|m| format!("{:.2}", m.normal_degrees_rms)),
        figure(|m| m.volume_ratio.map_or("–".to_owned(), |ratio| format!("{ratio:.4}"))),
        figure(|m| format!("{:.4}", m.silhouette_iou)),
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
