//! What the user typed. No work is done here.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use seamwise::error::Result;
use seamwise::evaluate;
use seamwise::evaluate::scene::Mode;
use seamwise::options::{BakeOptions, Targets, Textures};

/// Levels of detail for textured glTF that still look like the original, and atlases that do not
/// bleed.
#[derive(Debug, Parser)]
#[command(version, arg_required_else_help = true)]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Threads to use; all cores if not given.
    #[arg(long, global = true, value_name = "N")]
    pub(crate) threads: Option<usize>,
    /// Say nothing but errors.
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
}

/// The jobs.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Bake levels of detail, with the atlas repaired and the errors measured.
    Bake(BakeArgs),
    /// Say how far models are from a reference.
    Evaluate(EvaluateArgs),
    /// Say what an asset is made of, and where its atlases would bleed.
    Inspect(InspectArgs),
}

/// `seamwise bake`.
#[derive(Debug, Args)]
#[command(after_help = "Example: seamwise bake helmet.gltf -o out --ratios 0.5,0.1\n\n\
    Writes out/helmet_lod1.glb and so on, one level each; out/helmet.glb with the source and all\n\
    levels (MSFT_lod); and out/helmet.json with what was measured.")]
pub(crate) struct BakeArgs {
    /// .glb or .gltf files; the sample asset if none is given.
    pub(crate) inputs: Vec<PathBuf>,
    /// The folder to write into.
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
    /// Stop before an error above this, in the units of the file.
    #[arg(long, value_name = "E")]
    max_error: Option<f64>,
    /// What becomes of the textures.
    #[arg(long, value_enum, default_value_t = TextureMode::Repair)]
    textures: TextureMode,
    /// Do not measure the levels.
    #[arg(long)]
    no_evaluate: bool,
}

/// `--textures`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum TextureMode {
    /// All levels share the source's, with every texel that no chart covers filled.
    Repair,
    /// All levels share the source's as they are.
    Keep,
}

impl BakeArgs {
    /// What these arguments mean.
    pub(crate) fn resolve(&self) -> Result<BakeOptions> {
        Ok(BakeOptions {
            targets: match (&self.ratios, &self.triangles) {
                (Some(ratios), _) => Targets::ratios(ratios.clone())?,
                (_, Some(counts)) => Targets::triangles(counts.clone())?,
                _ => Targets::halves(self.levels.into()),
            },
            max_error: self.max_error,
            textures: match self.textures {
                TextureMode::Repair => Textures::Repair,
                TextureMode::Keep => Textures::Keep,
            },
            evaluate: (!self.no_evaluate).then(evaluate::Options::default),
        })
    }
}

/// `seamwise evaluate`.
#[derive(Debug, Args)]
#[command(after_help = "Example: seamwise evaluate helmet.gltf out/helmet_lod1.glb other.glb")]
pub(crate) struct EvaluateArgs {
    /// The original.
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
    /// Compare and draw base color alone, without light: what the textures lost, apart from the
    /// shape.
    #[arg(long)]
    unlit: bool,
    /// Write the figures as JSON.
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    /// Draw the reference and all candidates side by side, and where they differ.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) sheet: Option<PathBuf>,
    /// Views on the sheet.
    #[arg(long, default_value_t = 3, requires = "sheet", value_parser = clap::value_parser!(u8).range(1..=24))]
    pub(crate) sheet_views: u8,
}

impl EvaluateArgs {
    /// What these arguments mean.
    pub(crate) fn resolve(&self) -> evaluate::Options {
        evaluate::Options {
            views: self.views.into(),
            resolution: self.resolution.into(),
            samples: self.samples as usize,
        }
    }

    /// How the surfaces are colored in the views and on the sheet.
    pub(crate) fn mode(&self) -> Mode {
        if self.unlit { Mode::Unlit } else { Mode::Lit }
    }
}

/// `seamwise inspect`.
#[derive(Debug, Args)]
#[command(after_help = "Example: seamwise inspect helmet.gltf")]
pub(crate) struct InspectArgs {
    /// A .glb or .gltf file.
    pub(crate) input: PathBuf,
    /// Print JSON instead of text.
    #[arg(long)]
    pub(crate) json: bool,
}
