//! The command line as the user typed it. No work is done here.

mod batch;
mod common;
mod output;
mod outside;
mod repair;
mod steering;
mod textures;
mod view;

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand, ValueEnum};

use batch::BatchArgs;
pub(crate) use common::Common;
use output::OutputArgs;
use outside::OutsideArgs;
use repair::FootprintArgs;
pub(crate) use repair::RepairArgs;
use seamwise::bake::options::{BakeOptions, BudgetPer, ReportOptions, Targets};
use seamwise::bake::steering::Steering;
use seamwise::error::Result;
use seamwise::evaluate;
use seamwise::evaluate::scene::Mode;
use seamwise::import::options::ReadOptions;
use seamwise::screen::Screen;
use seamwise_attr::{Placement, Polish};
use steering::SteeringArgs;
use textures::TextureArgs;
pub(crate) use view::ViewArgs;

/// Levels of detail for textured glTF that still look like the original, and atlases that do not
/// bleed.
#[derive(Debug, Parser)]
#[command(version, arg_required_else_help = true)]
pub(crate) struct Cli {
    /// The subcommand.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Threads to use; all cores if not given.
    #[arg(long, global = true, value_name = "N")]
    pub(crate) threads: Option<usize>,
    #[command(flatten)]
    pub(crate) common: Common,
}

/// The jobs.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Bake levels of detail, with the atlas repaired and the errors measured.
    Bake(Box<BakeArgs>),
    /// Fill the texels around the charts of a texture atlas, so that its seams do not bleed.
    Repair(RepairArgs),
    /// Say how far models are from a reference.
    Evaluate(EvaluateArgs),
    /// Say what an asset is made of, and where its atlases would bleed.
    Inspect(InspectArgs),
    /// Say which level to show at a size on screen.
    Select(SelectArgs),
    /// Write a page that shows a model and its levels, to be turned and compared.
    View(ViewArgs),
}

/// `seamwise bake`.
#[derive(Debug, Args)]
#[command(after_help = "Example: seamwise bake helmet.gltf -o out --ratios 0.5,0.1\n         \
    seamwise bake assets -o out --resume --shard 2/8\n\n\
    Writes out/helmet_lod1.glb and so on, one level each; out/helmet.glb with the source and all\n\
    levels (MSFT_lod); out/helmet.json with what was measured; and with --report out/helmet.html\n\
    with the same in charts and pictures.")]
pub(crate) struct BakeArgs {
    /// .glb, .gltf, .obj, .ply or .off files, and folders, which stand for all of these in them and
    /// below; the sample asset if none is given.
    pub(crate) inputs: Vec<PathBuf>,
    /// The folder to write into. What is found in an input folder keeps its place below.
    #[arg(long, short, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// How many levels, each with half the triangles of the one before.
    #[arg(long, default_value_t = 4, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=16))]
    levels: u8,
    /// The share of the triangles that each level keeps, from fine to coarse.
    #[arg(long, value_delimiter = ',', value_name = "R,R,…", conflicts_with = "levels")]
    ratios: Option<Vec<f64>>,
    /// The triangles that each level has, from fine to coarse.
    #[arg(long, value_delimiter = ',', value_name = "N,N,…", conflicts_with_all = ["levels", "ratios"])]
    triangles: Option<Vec<usize>>,
    /// What these are counted over, where an asset has several meshes: over all, since half of a floor of
    /// two triangles is no floor, or over each. Meshes whose borders meet are one in this, and one that
    /// is shown often counts once.
    #[arg(long, value_enum, default_value_t = BudgetName::Scene, value_name = "WHAT")]
    budget_per: BudgetName,
    /// Leave the levels as the descent left them, which is faster and less like the source.
    #[arg(long)]
    no_polish: bool,
    /// Polish once over fewer samples: half of its time for a few percent of likeness.
    #[arg(long, conflicts_with = "no_polish")]
    fast: bool,
    #[command(flatten)]
    textures: TextureArgs,
    /// Do not measure the levels.
    #[arg(long)]
    no_evaluate: bool,
    /// Vertical field of view that the levels are seen with, for the sizes they may be shown at.
    #[arg(long, default_value_t = Screen::default().field_of_view_degrees, value_name = "DEGREES")]
    field_of_view: f64,
    /// The screen's size in pixels.
    #[arg(long, default_value = "1920x1080", value_name = "WxH", value_parser = parse_size)]
    screen: (u32, u32),
    /// How many pixels a level's surface may be off where it is shown.
    #[arg(long, default_value_t = Screen::default().pixel_tolerance, value_name = "PIXELS")]
    pixel_tolerance: f64,
    /// Write a page with charts and pictures.
    #[arg(long)]
    report: bool,
    /// Give an input up after so many seconds, with nothing written. It is looked at between steps, so
    /// that an input may take longer by one.
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    time_limit: Option<Duration>,
    /// Bake once more on 1, 2, … threads each, and show on the page how the time falls.
    #[arg(long, requires = "report")]
    threads_report: bool,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    pub(crate) batch: BatchArgs,
    #[command(flatten)]
    files: OutputArgs,
    #[command(flatten)]
    steering: SteeringArgs,
}

/// `--budget-per`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum BudgetName {
    /// Each mesh keeps the same share of its triangles, and as many as a box at least.
    Mesh,
    /// Each mesh keeps what it costs most to lose, as large and as often as the scene shows it.
    Scene,
}

/// Arguments for reading assets.
#[derive(Debug, Args)]
pub(crate) struct ReadingArgs {
    /// Go on, with a warning, without image files that are not there: their textures are measured as
    /// white, or flat for normals. What is written still names them, to be put beside it. Without an
    /// .mtl an .obj is read anyway, as plain.
    #[arg(long)]
    allow_missing: bool,
    #[command(flatten)]
    outside: OutsideArgs,
}

impl ReadingArgs {
    /// The options that these arguments give.
    pub(crate) fn resolve(&self, common: Common) -> ReadOptions {
        let Common { memory_limit, strict, .. } = common;
        let (allow_missing, OutsideArgs { allow_outside, allow_unknown }) =
            (self.allow_missing, self.outside);
        ReadOptions { memory_limit, allow_missing, allow_outside, allow_unknown, strict }
    }
}

/// Reads `1920x1080`.
fn parse_size(text: &str) -> std::result::Result<(u32, u32), String> {
    let size = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    size.ok_or_else(|| format!("{text} is no size like 1920x1080"))
}

/// Reads a number of seconds above 0.
fn parse_seconds(text: &str) -> std::result::Result<Duration, String> {
    let seconds = text.parse().ok().filter(|seconds: &f64| *seconds > 0.0);
    let limit = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    limit.ok_or_else(|| format!("{text} is no number of seconds above 0"))
}

/// Reads a number of pixels above 0.
fn parse_tolerance(text: &str) -> std::result::Result<f64, String> {
    let tolerance = text.parse().ok().filter(|tolerance: &f64| *tolerance > 0.0);
    tolerance.filter(|t| t.is_finite()).ok_or_else(|| format!("{text} is no number above 0"))
}

impl BakeArgs {
    fn polish(&self) -> Option<Polish> {
        let polish = if self.fast { Polish::FAST } else { Polish::default() };
        (!self.no_polish && !self.files.share_vertices).then_some(polish)
    }

    fn steering(&self) -> Result<Steering> {
        let steering = self.steering.resolve()?;
        let is_shared = self.files.share_vertices;
        let placement = if is_shared { Placement::Ends } else { steering.placement };
        Ok(Steering { placement, ..steering })
    }

    /// The options that these arguments give.
    pub(crate) fn resolve(&self, common: Common) -> Result<BakeOptions> {
        let screen = Screen {
            field_of_view_degrees: self.field_of_view,
            width: self.screen.0,
            height: self.screen.1,
            pixel_tolerance: self.pixel_tolerance,
        };
        screen.check()?;
        Ok(BakeOptions {
            targets: match (&self.ratios, &self.triangles) {
                (Some(ratios), _) => Targets::ratios(ratios.clone())?,
                (_, Some(counts)) => Targets::triangles(counts.clone())?,
                _ => Targets::halves(self.levels.into()),
            },
            budget_per: match self.budget_per {
                BudgetName::Mesh => BudgetPer::Mesh,
                BudgetName::Scene => BudgetPer::Scene,
            },
            steering: self.steering()?,
            polish: self.polish(),
            textures: self.textures.resolve()?,
            evaluate: (!self.no_evaluate).then(evaluate::Options::default),
            screen,
            report: self.report.then_some(ReportOptions { threads: self.threads_report }),
            reading: self.reading.resolve(common),
            time_limit: self.time_limit,
            output: self.files.resolve()?,
            allow_empty: false,
        })
    }
}

/// `seamwise evaluate`.
#[derive(Debug, Args)]
#[command(after_help = "Example: seamwise evaluate helmet.gltf out/helmet_lod1.glb other.glb")]
pub(crate) struct EvaluateArgs {
    /// The original: .glb, .gltf, .obj, .ply or .off, as the candidates.
    pub(crate) reference: PathBuf,
    /// What to compare with it, from any tool.
    #[arg(required = true)]
    pub(crate) candidates: Vec<PathBuf>,
    /// Cameras around the reference.
    #[arg(long, default_value_t = 24, value_parser = clap::value_parser!(u8).range(1..=24))]
    views: u8,
    /// Pixels along each side of a view.
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u16).range(16..=4096))]
    resolution: u16,
    /// Samples on each surface.
    #[arg(long, default_value_t = 200_000, value_parser = clap::value_parser!(u32).range(1000..=100_000_000))]
    samples: u32,
    /// How many pixels a surface may be off where a candidate takes over: there it is looked at once
    /// more.
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
    /// Fill the reference's atlases in memory first, so that what bleeds in it does not count as
    /// right.
    #[arg(long)]
    pub(crate) clean_reference: bool,
    /// Write a page with the figures, charts and pictures.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) report: Option<PathBuf>,
    /// Draw the reference and all candidates side by side, and where they differ.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) sheet: Option<PathBuf>,
    /// Views on the sheet.
    #[arg(long, default_value_t = 3, requires = "sheet", value_parser = clap::value_parser!(u8).range(1..=24))]
    pub(crate) sheet_views: u8,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
}

impl EvaluateArgs {
    /// The options that these arguments give.
    pub(crate) fn resolve(&self) -> evaluate::Options {
        evaluate::Options {
            views: self.views.into(),
            resolution: self.resolution.into(),
            samples: self.samples as usize,
            pixel_tolerance: self.pixel_tolerance,
        }
    }

    /// The coloring of surfaces in the views and on the sheet.
    pub(crate) fn mode(&self) -> Mode {
        if self.unlit { Mode::Unlit } else { Mode::Lit }
    }
}

/// `seamwise inspect`.
#[derive(Debug, Args)]
#[command(after_help = "Example: seamwise inspect helmet.gltf")]
pub(crate) struct InspectArgs {
    /// A .glb, .gltf, .obj, .ply or .off file.
    pub(crate) input: PathBuf,
    #[command(flatten)]
    pub(crate) footprint: FootprintArgs,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}

/// `seamwise select`.
#[derive(Debug, Args)]
#[command(after_help = "Example: seamwise select out/helmet.json --pixels 300\n\n\
    Prints the level's number; 0 is the source.")]
pub(crate) struct SelectArgs {
    /// The report of a bake: <stem>.json.
    pub(crate) report: PathBuf,
    /// How many pixels the diagonal of the model's bounding box spans.
    #[arg(long, value_name = "N")]
    pub(crate) pixels: f64,
}
