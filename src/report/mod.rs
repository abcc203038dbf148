//! Reports of a bake and of an evaluation, as JSON, as a table and as a page.

mod chart;
mod choices;
mod columns;
mod cost;
mod csv;
mod farthest;
pub mod figures;
mod frame;
pub mod goal;
pub mod html;
pub(crate) mod level_textures;
mod meshes;
pub mod pictures;
pub(crate) mod preview;
pub mod repair;
mod scale;
mod seconds;
pub mod several;
mod summary;
mod table;
pub(crate) mod texture;
pub(crate) mod threads;
mod ticks;
pub(crate) mod verdict;
pub mod viewer;

use glam::DVec3;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::evaluate::camera::{Camera, Rig};
use crate::evaluate::reference::ReferenceTextures;
use crate::evaluate::scene::Mode;
use crate::evaluate::{Metrics, ViewMetrics};
use crate::screen::Screen;
use crate::transfer::MaterialTextures;
use crate::warning::Warnings;
use goal::Reached;
use table::{COLUMNS, row};

pub use farthest::FarthestPart;
pub use meshes::MeshReport;
pub(crate) use meshes::mesh_reports;
pub use seconds::Seconds;
pub use texture::TextureReport;
pub use threads::{Spread, StageTime, ThreadTimes};

/// The report of a bake, in schema 1.
#[derive(Clone, Debug, Serialize)]
pub struct BakeReport {
    /// Version of this layout.
    pub schema: u32,
    /// Hash of all that the outputs follow from: the input, the files that it names, the options and
    /// the version of this tool. A batch that is resumed skips inputs whose outputs have theirs.
    pub digest: String,
    /// The files that were written beside this report, as paths in its folder.
    pub files: Vec<String>,
    /// The size of each of these files in bytes.
    pub file_bytes: Vec<u64>,
    /// Files of an earlier bake that were removed, as this one has none of these names.
    #[serde(skip)]
    pub removed: Vec<String>,
    /// The source.
    pub input: InputReport,
    /// Warnings: things left out, guessed or mended.
    pub warnings: Warnings,
    /// The screen that the sizes of the levels are computed for.
    pub screen: Screen,
    /// The source's textures as levels are compared with them, if they were evaluated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference_textures: Option<ReferenceTextures>,
    /// The levels, the finest first.
    pub levels: Vec<LevelReport>,
    /// Triangles of each mesh, if there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub meshes: Vec<MeshReport>,
    /// The outcome of the textures of each material that has some, if levels have their own.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<MaterialTextures>,
    /// Wall time of each stage.
    pub seconds: Seconds,
    /// Wall times of the same bake on 1, 2, … threads, if they were measured.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub threads: Vec<ThreadTimes>,
    /// Most memory that the process held at once; `None` where the system does not tell.
    pub peak_memory_bytes: Option<u64>,
}

/// The source of a bake.
#[derive(Clone, Debug, Serialize)]
pub struct InputReport {
    /// Its file.
    pub file: String,
    /// Bytes of its file and of those that it names.
    pub bytes: u64,
    /// Bytes of its images, as files.
    pub texture_bytes: usize,
    /// Bytes of its images on a graphics processor, with mip maps.
    pub texture_gpu_bytes: u64,
    /// Its triangle primitives.
    pub draw_calls: usize,
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
    /// The target, in triangles.
    pub target: usize,
    /// The triangles it has.
    pub triangles: usize,
    /// Its points.
    pub points: usize,
    /// Its wedges.
    pub wedges: usize,
    /// Vertices of its primitives, as they are stored.
    pub vertices: usize,
    /// The bound that it was to reach and what it has, if its triangles were found by one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub goal: Option<Reached>,
    /// Root of the largest area-weighted cost of a collapse, in the units of the file.
    pub error: f64,
    /// Triangle primitives of its meshes.
    pub draw_calls: usize,
    /// Bytes of the images that it uses, as files.
    pub texture_bytes: usize,
    /// Bytes of its images on a graphics processor, with mip maps.
    pub texture_gpu_bytes: u64,
    /// Its images.
    pub textures: Vec<TextureReport>,
    /// Bytes of its files, with all images that it uses.
    pub bytes: u64,
    /// Whether the target was reached.
    pub reached: bool,
    /// The reason why the target was not reached, if it was not.
    pub why: Option<String>,
    /// The largest size at which it may be shown, in pixels that the diagonal of the source's
    /// bounding box spans, if it was evaluated; see [`crate::export::certificate`]. `None` also where the
    /// level has no error at all.
    pub largest_size_pixels: Option<f64>,
    /// The number of a coarser level, if there is one, that can't be told from the source at any size at
    /// which this one can't.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub made_needless_by: Option<usize>,
    /// The part of the source where it is off the most, if it was evaluated and is off at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub farthest: Option<FarthestPart>,
    /// Its metrics against the source, if it was evaluated.
    pub metrics: Option<Metrics>,
}

impl BakeReport {
    /// The report as JSON.
    ///
    /// # Errors
    /// [`Error::Internal`] if it can't be written so.
    pub fn to_json(&self) -> Result<String> {
        to_json(self)
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
}

/// The report of an evaluation, in schema 1.
#[derive(Clone, Debug, Serialize)]
pub struct EvaluateReport {
    /// Version of this layout.
    pub schema: u32,
    /// The reference that candidates were compared with.
    pub reference: ReferenceReport,
    /// The coloring of surfaces in the views.
    pub mode: Mode,
    /// The cameras, in the order of a sheet's rows, so that another renderer can see what was seen.
    pub views: Vec<ViewReport>,
    /// The candidates, in the order they were given.
    pub candidates: Vec<CandidateReport>,
    /// Warnings: things left out, guessed or mended in any of the files, with the file.
    pub warnings: Warnings,
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
    /// Its textures as candidates are compared with them.
    pub textures: ReferenceTextures,
}

/// A camera of an evaluation: a pinhole of square frame.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ViewReport {
    /// Its position, in world units.
    pub eye: [f64; 3],
    /// The point that it looks at, in world units: the middle of the picture.
    pub target: [f64; 3],
    /// Unit vector that is upward in the picture.
    pub up: [f64; 3],
    /// Field of view of the whole frame, horizontal and vertical.
    pub field_of_view_degrees: f64,
}

impl ViewReport {
    /// The cameras of a rig that is counted from `origin`, in its order.
    pub fn of(rig: &Rig, origin: DVec3) -> Vec<Self> {
        let view = |camera: &Camera| Self {
            eye: (origin + camera.eye).to_array(),
            target: (origin + rig.center).to_array(),
            up: camera.up.to_array(),
            field_of_view_degrees: 2.0 * camera.half_width.atan().to_degrees(),
        };
        rig.cameras.iter().map(view).collect()
    }
}

/// A candidate of an evaluation.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CandidateReport {
    /// Its file.
    pub file: String,
    /// Its triangles.
    pub triangles: usize,
    /// Its metrics against the reference; `None` if it could not be compared.
    pub metrics: Option<Metrics>,
    /// The reason why it could not be compared.
    pub failure: Option<String>,
    /// A warning if its figures are doubtful, if it was compared.
    pub warning: Option<String>,
    /// Its metrics in each of the views, in their order; empty if it could not be compared.
    pub views: Vec<ViewMetrics>,
}

/// The largest ratio of sizes of candidate and reference, either way, at which figures are not
/// doubted: less than that between the units of any two tools (25.4 for inches in millimetres).
const MOST_ENLARGED: f64 = 10.0;

impl CandidateReport {
    /// The report of a comparison: the triangles and the figures, of all views and of each.
    pub fn new(file: String, compared: Result<(usize, Metrics, Vec<ViewMetrics>)>) -> Self {
        match compared {
            Ok((triangles, metrics, views)) => Self {
                file,
                triangles,
                warning: doubt(metrics.diagonal_ratio),
                metrics: Some(metrics),
                failure: None,
                views,
            },
            Err(error) => {
                let failure = error.to_string();
                // The name is a part of what the system says.
                let failure = failure.strip_prefix(&format!("{file}: ")).unwrap_or(&failure);
                let failure = Some(failure.to_owned());
                Self { file, failure, ..Self::default() }
            }
        }
    }

    /// The failure or warning, if there is one.
    pub fn complaint(&self) -> Option<&str> {
        self.failure.as_deref().or(self.warning.as_deref())
    }
}

/// The warning about a candidate whose bounding box is so many times as large as the reference's,
/// if it needs one.
fn doubt(diagonal_ratio: f64) -> Option<String> {
    if (1.0 / MOST_ENLARGED..=MOST_ENLARGED).contains(&diagonal_ratio) {
        return None;
    }
    let (times, than) = if diagonal_ratio > 1.0 {
        (diagonal_ratio, "larger")
    } else {
        (1.0 / diagonal_ratio, "smaller")
    };
    // Three digits, which is what tells a unit.
    let digits = (2 - times.log10().floor() as i32).clamp(0, 2) as usize;
    Some(format!(
        "its bounding box is {times:.digits$} times {than} than the reference's: is it in other units?"
    ))
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
    /// figure; without the figures of single views.
    ///
    /// # Errors
    /// [`Error::Internal`] if they can't be written so.
    pub fn to_csv(&self) -> Result<String> {
        csv::to_csv(self.candidates.iter().map(|candidate| (candidate, &candidate.metrics)))
    }

    /// A line for each candidate that could not be compared or whose figures are doubtful.
    fn complaints(&self) -> Vec<String> {
        let complaint = |candidate: &CandidateReport| {
            let file = &candidate.file;
            match (&candidate.failure, &candidate.warning) {
                (Some(why), _) => Some(format!("{file} could not be compared: {why}")),
                (None, Some(warning)) => Some(format!("{file}: {warning}")),
                (None, None) => None,
            }
        };
        self.candidates.iter().filter_map(complaint).collect()
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
    Ok(text.map_err(Error::internal)? + "\n")
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
    use glam::Vec3;

    #[test]
    fn other_units_are_doubted() {
        assert_eq!([1.0, 0.2, 9.0, 10.0].map(doubt), [const { None }; 4]);
        let said = |ratio| doubt(ratio).unwrap();
        assert!(said(1000.0).contains("is 1000 times larger"), "{}", said(1000.0));
        assert!(said(1.0 / 25.4).contains("is 25.4 times smaller"), "{}", said(1.0 / 25.4));
        assert!(doubt(f64::NAN).is_some() && doubt(0.0).is_some());
    }

    #[test]
    fn a_view_tells_its_camera() {
        let rig = Rig::new(Vec3::new(1.0, 2.0, 3.0), 5.0, 24, 64);
        for (camera, view) in rig.cameras.iter().zip(ViewReport::of(&rig, DVec3::ZERO)) {
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
