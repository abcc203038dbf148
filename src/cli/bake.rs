//! Arguments of `seamwise bake`.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::{Args, ValueEnum};

use seamwise::bake::options::{BakeOptions, BudgetPer, ReportOptions, Targets, Textures};
use seamwise::bake::steering::Steering;
use seamwise::error::{Error, Result};
use seamwise::evaluate;
use seamwise::screen::Screen;
use seamwise_attr::{Placement, Polish};

use super::batch::BatchArgs;
use super::common::Common;
use super::config::ConfigArgs;
use super::evaluate::ThoroughnessArgs;
use super::goals::GoalArgs;
use super::output::OutputArgs;
use super::reading::ReadingArgs;
use super::steering::SteeringArgs;
use super::textures::TextureArgs;

/// `seamwise bake`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  seamwise bake helmet.gltf -o out
  seamwise bake helmet.gltf -o out --ratios 0.5,0.1 --preset web
  seamwise bake helmet.gltf -o low.glb --ratios 0.1
  seamwise bake helmet.gltf -o out --texture-format ktx2
  seamwise bake assets -o out --resume --shard 2/8
  seamwise bake --manifest list.txt -o out --resume

Writes out/helmet_lod1.glb and so on, each a level of its own, and out/helmet.json with what was \
measured. A level looks the same as its source up to the length on screen that the table tells, in pixels \
along the diagonal of its bounding box. README.md has a table of which program takes which file.")]
pub(crate) struct BakeArgs {
    /// Models (.glb, .gltf, .obj, .ply, .off) and folders of them, or - for stdin.
    ///
    /// A folder stands for all models in it and below.
    #[arg(value_parser = path())]
    pub(crate) inputs: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) places: PlaceArgs,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    targets: TargetArgs,
    #[command(flatten)]
    goals: GoalArgs,
    #[command(flatten)]
    textures: TextureArgs,
    #[command(flatten)]
    files: OutputArgs,
    #[command(flatten)]
    measuring: MeasureArgs,
    #[command(flatten)]
    pub(crate) batch: BatchArgs,
    #[command(flatten)]
    steering: SteeringArgs,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// Arguments for what is read and written.
#[derive(Debug, Args)]
#[command(next_help_heading = "Input and output")]
pub(crate) struct PlaceArgs {
    /// The folder to write into.
    ///
    /// Or a .glb, or - for standard output, for one level (--levels 1 or one of --ratios).
    /// What is found in an input folder keeps its place below. Files of an earlier bake of the same
    /// name that this one does not make are removed.
    #[arg(long, short, value_name = "DIR|FILE")]
    pub(crate) output: PathBuf,
    /// Bake the sample asset, a glazed ewer.
    #[arg(long, conflicts_with = "inputs")]
    pub(crate) sample: bool,
    /// Say what would be read and written, and do nothing.
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// Write a page with charts and pictures.
    ///
    /// It is <stem>.html in the output folder, unless it is given a place of its own.
    #[arg(long, value_name = "FILE.html", num_args = 0..=1, default_missing_value = "", value_parser = path())]
    report: Option<PathBuf>,
    /// Write what became of each input as JSON; - for standard output.
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
}

/// Arguments for how many triangles levels have.
#[derive(Debug, Args)]
#[command(next_help_heading = "Levels")]
struct TargetArgs {
    /// How many levels, each with half of the triangles.
    #[arg(long, default_value_t = 4, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=16))]
    levels: u8,
    /// Shares of the triangles that levels keep, as 0.5,0.1.
    #[arg(long, value_delimiter = ',', value_name = "R,R,…", value_parser = parse_ratio, conflicts_with = "levels")]
    ratios: Option<Vec<f64>>,
    /// The triangles that each level has, as 5000,1000.
    #[arg(long, value_delimiter = ',', value_name = "N,N,…", value_parser = parse_count, conflicts_with_all = ["levels", "ratios"])]
    triangles: Option<Vec<usize>>,
    /// What these are counted over, where an asset has several meshes.
    ///
    /// Over all, since half of a floor of two triangles is no floor, or over each. Meshes whose borders
    /// meet are one in this, and one that is shown often counts once.
    #[arg(long, value_enum, default_value_t = BudgetName::Scene, value_name = "WHAT")]
    budget_per: BudgetName,
    /// Polish once over fewer samples: half of its time for a few percent of likeness.
    #[arg(long, conflicts_with = "no_polish")]
    fast: bool,
    /// Leave the levels as the descent left them, which is faster and less like the source.
    #[arg(long)]
    no_polish: bool,
}

/// Arguments for what is measured.
#[derive(Debug, Args)]
#[command(next_help_heading = "Measuring")]
struct MeasureArgs {
    /// Do not measure the levels: faster.
    #[arg(long)]
    no_evaluate: bool,
    /// Print a table of rough figures as soon as there are levels; those of all views follow.
    ///
    /// Of 6 views of 256 × 256 pixels and 20,000 samples.
    #[arg(long, conflicts_with = "no_evaluate")]
    preview: bool,
    #[command(flatten)]
    thoroughness: ThoroughnessArgs,
    /// Measure against the source as it is, even if its atlases bleed.
    ///
    /// By default it is measured with them filled, so that what bleeds does not count as right.
    #[arg(long, conflicts_with = "no_evaluate")]
    reference_as_is: bool,
    /// Vertical field of view that the levels are seen with, for the sizes they may be shown at.
    #[arg(long, default_value_t = Screen::default().field_of_view_degrees, value_name = "DEGREES")]
    field_of_view: f64,
    /// The screen's size in pixels.
    #[arg(long, default_value = "1920x1080", value_name = "WxH", value_parser = parse_size)]
    screen: (u32, u32),
    /// How many pixels a level's surface may be off where it is shown.
    #[arg(long, default_value_t = Screen::default().pixel_tolerance, value_name = "PIXELS")]
    pixel_tolerance: f64,
    /// Bake again on 1, 2, … threads each, several times, and show on the page how the time of each stage falls.
    #[arg(long, requires = "report")]
    threads_report: bool,
    /// How many times on each number of threads.
    #[arg(long, default_value_t = 3, value_name = "N", requires = "threads_report", value_parser = clap::value_parser!(u8).range(1..=100))]
    thread_runs: u8,
}

impl MeasureArgs {
    /// The options of the evaluation, if there is one.
    fn evaluate(&self) -> Option<evaluate::Options> {
        (!self.no_evaluate).then(|| self.thoroughness.resolve())
    }
}

/// `--budget-per`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum BudgetName {
    /// Each mesh keeps the same share of its triangles, and as many as a box at least.
    Mesh,
    /// Each mesh keeps what it costs most to lose, as large and as often as the scene shows it.
    Scene,
}

/// Where a bake reads from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    /// The sample asset.
    Sample,
    /// Standard input.
    Stdin,
    /// Files and folders.
    Paths(Vec<PathBuf>),
}

/// Where a bake writes to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Target {
    /// All levels, and the report, into a folder.
    Folder(PathBuf),
    /// One level into a file.
    File(PathBuf),
    /// One level to standard output.
    Stdout,
}

impl BakeArgs {
    fn polish(&self) -> Option<Polish> {
        let polish = if self.targets.fast { Polish::FAST } else { Polish::default() };
        (!self.targets.no_polish && !self.files.share_vertices).then_some(polish)
    }

    fn steering(&self) -> Result<Steering> {
        let steering = self.steering.resolve()?;
        let is_shared = self.files.share_vertices;
        let placement = if is_shared { Placement::Ends } else { steering.placement };
        Ok(Steering { placement, ..steering })
    }

    /// The value of `--report` if it is not a page but an input, as in `--report helmet.gltf -o out`,
    /// where the option once had no value.
    fn swallowed(&self) -> Option<&PathBuf> {
        self.places
            .report
            .as_ref()
            .filter(|path| !path.as_os_str().is_empty() && !has_extension(path, &["html", "htm"]))
    }

    /// The page, if it goes to a place of its own.
    pub(crate) fn page(&self) -> Option<&Path> {
        let named = self.places.report.as_deref().filter(|path| !path.as_os_str().is_empty());
        named.filter(|_| self.swallowed().is_none())
    }

    /// Where the input is.
    ///
    /// # Errors
    /// [`Error::Options`] if there is none, or one is not meant as an input.
    pub(crate) fn source(&self) -> Result<Source> {
        let refused = |what: String| Err(Error::Options { what });
        if self.places.sample {
            return Ok(Source::Sample);
        }
        let listed = self.batch.listed()?;
        let typed = self.inputs.iter().chain(self.swallowed());
        let inputs: Vec<PathBuf> = typed.chain(&listed).cloned().collect();
        if inputs.is_empty() || inputs.iter().any(|path| path.as_os_str().is_empty()) {
            let what = "no input: name models or folders of them; --sample bakes the sample asset";
            return refused(what.into());
        }
        if let Some(stray) = inputs.iter().find(|path| is_number(path) && !path.exists()) {
            let hint = self.with_stray_numbers(&inputs);
            return refused(format!("{}: there is no such file{hint}", stray.display()));
        }
        match &inputs[..] {
            [input] if is_dash(input) => Ok(Source::Stdin),
            _ if inputs.iter().any(|path| is_dash(path)) => {
                refused("- is standard input, which is an input alone".into())
            }
            _ => Ok(Source::Paths(inputs)),
        }
    }

    /// A hint at the list that numbers among the inputs belong to.
    fn with_stray_numbers(&self, inputs: &[PathBuf]) -> String {
        let texts = |own: Vec<String>| own.join(",");
        let numbers = inputs.iter().filter(|path| is_number(path));
        let numbers: Vec<String> = numbers.map(|path| path.display().to_string()).collect();
        let (name, given) = match (&self.targets.ratios, &self.targets.triangles) {
            (Some(own), _) => ("--ratios", texts(own.iter().map(ToString::to_string).collect())),
            (_, Some(own)) => ("--triangles", texts(own.iter().map(ToString::to_string).collect())),
            _ => return String::new(),
        };
        format!(": did you mean {name} {given},{}?", numbers.join(","))
    }

    /// Where the output goes.
    ///
    /// # Errors
    /// [`Error::Options`] if that can't take what is made.
    pub(crate) fn target(&self, options: &BakeOptions) -> Result<Target> {
        let output = &self.places.output;
        let refused =
            |what: &str| Err(Error::Options { what: format!("-o {}: {what}", output.display()) });
        let is_model = has_extension(output, &["glb"]);
        if !is_dash(output) && (!is_model || output.is_dir()) {
            if has_extension(output, &["gltf"]) && !output.is_dir() {
                return refused("a .gltf is several files: give a folder, and --format gltf");
            }
            if output.is_file() {
                return refused("it is a file: give a folder, or a .glb for one level");
            }
            return Ok(Target::Folder(output.clone()));
        }
        let levels = options.targets.count();
        if levels != 1 {
            let what = format!("one file can't take {levels} levels: give a folder, or --levels 1");
            return refused(&what);
        }
        if self.files.is_several() {
            return refused("--format gltf, --layout and --share-vertices need a folder");
        }
        if options.report.is_some() && self.page().is_none() {
            return refused("say where the page goes, as --report page.html");
        }
        Ok(if is_dash(output) { Target::Stdout } else { Target::File(output.clone()) })
    }

    /// The options that these arguments give.
    pub(crate) fn resolve(&self, common: Common) -> Result<BakeOptions> {
        let MeasureArgs { field_of_view, screen: (width, height), pixel_tolerance, .. } =
            self.measuring;
        let screen =
            Screen { field_of_view_degrees: field_of_view, width, height, pixel_tolerance };
        screen.check()?;
        let page = ReportOptions {
            threads: self.measuring.threads_report,
            thread_runs: self.measuring.thread_runs.into(),
            apart: self.page().is_some(),
        };
        let goals = self.goals.resolve()?;
        let output = self.files.resolve()?;
        let shares = Textures::are_shared_by_default(goals.as_ref(), output);
        Ok(BakeOptions {
            targets: match (&self.targets.ratios, &self.targets.triangles, &goals) {
                (Some(ratios), ..) => Targets::ratios(ratios.clone())?,
                (_, Some(counts), _) => Targets::triangles(counts.clone())?,
                (.., Some(goals)) => Targets::halves(goals.count()),
                _ => Targets::halves(self.targets.levels.into()),
            },
            budget_per: match self.targets.budget_per {
                BudgetName::Mesh => BudgetPer::Mesh,
                BudgetName::Scene => BudgetPer::Scene,
            },
            steering: self.steering()?,
            polish: self.polish(),
            textures: self.textures.resolve(shares)?,
            texture_files: self.textures.files(),
            goals,
            evaluate: self.measuring.evaluate(),
            preview: self.measuring.preview,
            reference_as_is: self.measuring.reference_as_is,
            screen,
            report: self.places.report.as_ref().map(|_| page),
            reading: self.reading.resolve(common),
            time_limit: self.batch.time_limit,
            output,
            allow_empty: false,
        })
    }
}

/// Reads a path, which may be empty: what is said then is said by who needs it.
fn path() -> impl TypedValueParser<Value = PathBuf> {
    OsStringValueParser::new().map(PathBuf::from)
}

/// Whether a path stands for standard input or output.
pub(crate) fn is_dash(path: &Path) -> bool {
    path == Path::new("-")
}

fn has_extension(path: &Path, extensions: &[&str]) -> bool {
    let is = |own: &OsStr| extensions.iter().any(|other| own.eq_ignore_ascii_case(other));
    path.extension().is_some_and(is)
}

fn is_number(path: &Path) -> bool {
    path.to_str().is_some_and(|text| text.parse::<f64>().is_ok())
}

/// Reads a share.
pub(super) fn parse_ratio(text: &str) -> std::result::Result<f64, String> {
    if let Some(percents) = text.strip_suffix('%').and_then(|own| own.trim().parse::<f64>().ok()) {
        return Err(format!("shares are of 1: did you mean {}?", percents / 100.0));
    }
    text.trim().parse().map_err(|_| format!("{text} is no share like 0.5"))
}

/// Reads a number of triangles.
fn parse_count(text: &str) -> std::result::Result<usize, String> {
    text.trim().parse().map_err(|_| match text.trim().parse::<f64>() {
        Ok(share) if share > 0.0 && share < 1.0 => {
            format!("{text} is no number of triangles: did you mean --ratios {text}?")
        }
        _ => format!("{text} is no number of triangles like 5000"),
    })
}

/// Reads `1920x1080`.
fn parse_size(text: &str) -> std::result::Result<(u32, u32), String> {
    let size = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    size.ok_or_else(|| format!("{text} is no size like 1920x1080"))
}
