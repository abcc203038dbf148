//! Arguments of `seamwise evaluate`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use seamwise::evaluate;
use seamwise::evaluate::scene::Mode;
use seamwise::evaluate::sheet::{Drawing, Rows};
use seamwise::screen::Screen;

use super::camera::{CameraArg, parse_camera};
use super::reading::ReadingArgs;

/// Arguments for how closely levels are looked at.
#[derive(Debug, Args)]
pub(crate) struct ThoroughnessArgs {
    /// Cameras around the reference.
    #[arg(long, default_value_t = 24, value_parser = clap::value_parser!(u8).range(1..=24))]
    views: u8,
    /// Pixels along each side of a view.
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u16).range(16..=4096))]
    resolution: u16,
    /// Samples on each surface.
    #[arg(long, default_value_t = 200_000, value_parser = clap::value_parser!(u32).range(1000..=100_000_000))]
    samples: u32,
}

impl ThoroughnessArgs {
    /// The options that these arguments give.
    pub(crate) fn resolve(&self) -> evaluate::Options {
        evaluate::Options {
            views: self.views.into(),
            resolution: self.resolution.into(),
            samples: self.samples as usize,
            ..evaluate::Options::default()
        }
    }
}

/// `seamwise evaluate`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  seamwise evaluate helmet.gltf out/helmet_lod1.glb other.glb
  seamwise evaluate cow.off a/cow_lod*.glb b/cow_lod*.glb --sheet rows.png --sheet-rows series --wireframe")]
pub(crate) struct EvaluateArgs {
    /// The original: .glb, .gltf, .obj, .ply or .off, as the candidates.
    pub(crate) reference: PathBuf,
    /// What to compare with it, from any tool.
    #[arg(required = true)]
    pub(crate) candidates: Vec<PathBuf>,
    #[command(flatten)]
    thoroughness: ThoroughnessArgs,
    /// The largest size in pixels at which candidates are looked at, to find the largest at which each
    /// can't be told from the reference: the screen's height.
    #[arg(long, default_value_t = 1080, value_name = "PIXELS", value_parser = clap::value_parser!(u16).range(16..=4320))]
    screen_height: u16,
    /// How many pixels a surface may be off at that size.
    #[arg(long, default_value_t = Screen::default().pixel_tolerance, value_name = "PIXELS", value_parser = parse_tolerance)]
    pixel_tolerance: f64,
    /// Compare and draw base color alone, without light: what the textures lost, apart from the
    /// shape.
    #[arg(long)]
    unlit: bool,
    /// Write the figures as JSON.
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    /// Write the figures as CSV, a row for each candidate.
    #[arg(long, value_name = "FILE")]
    pub(crate) csv: Option<PathBuf>,
    /// Compare with the reference as it is, even if its atlases bleed.
    ///
    /// By default they are filled in memory first, so that what bleeds does not count as right.
    #[arg(long)]
    pub(crate) reference_as_is: bool,
    /// The default; kept for older scripts.
    #[arg(long, hide = true, conflicts_with = "reference_as_is")]
    clean_reference: bool,
    /// Write a page with the figures, charts and pictures.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) report: Option<PathBuf>,
    /// Draw the reference and all candidates side by side, and where they differ.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) sheet: Option<PathBuf>,
    /// Views on the sheet.
    #[arg(long, default_value_t = 3, requires = "sheet", value_parser = clap::value_parser!(u8).range(1..=24))]
    pub(crate) sheet_views: u8,
    /// Draw the sheet from this place instead of the usual views: the place, the point that is looked at, and
    /// the degrees of the field of view, in the units of the scene. May be given more than once.
    #[arg(long, requires = "sheet", value_name = "X,Y,Z,X,Y,Z,DEGREES", value_parser = parse_camera, allow_hyphen_values = true, conflicts_with = "sheet_views")]
    pub(crate) camera: Vec<CameraArg>,
    /// Draw the edges of triangles on the sheet.
    #[arg(long, requires = "sheet")]
    wireframe: bool,
    /// The rows of the sheet.
    #[arg(long, value_enum, default_value_t = RowsName::Views, requires = "sheet", value_name = "WHAT")]
    sheet_rows: RowsName,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
}

impl EvaluateArgs {
    /// The options that these arguments give.
    pub(crate) fn resolve(&self) -> evaluate::Options {
        evaluate::Options {
            pixel_tolerance: self.pixel_tolerance,
            screen_height: self.screen_height.into(),
            ..self.thoroughness.resolve()
        }
    }

    /// The drawing of scenes on the sheet.
    pub(crate) fn drawing(&self) -> Drawing {
        if self.wireframe { Drawing::Wireframe } else { Drawing::Shaded(self.mode()) }
    }

    /// The rows of the sheet.
    pub(crate) fn rows(&self) -> Rows {
        match self.sheet_rows {
            RowsName::Views => Rows::Views,
            RowsName::Series => Rows::Series,
        }
    }

    /// The coloring of surfaces in the views and on the sheet.
    pub(crate) fn mode(&self) -> Mode {
        if self.unlit { Mode::Unlit } else { Mode::Lit }
    }
}

/// `--sheet-rows`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum RowsName {
    /// A view each, with where candidates differ below it.
    Views,
    /// A series each: the levels that one bake wrote, after the reference.
    Series,
}

/// Reads a number of pixels above 0.
fn parse_tolerance(text: &str) -> std::result::Result<f64, String> {
    let tolerance = text.parse().ok().filter(|tolerance: &f64| *tolerance > 0.0);
    tolerance.filter(|t| t.is_finite()).ok_or_else(|| format!("{text} is no number above 0"))
}
