//! Arguments of `seamwise inspect` and `seamwise select`, which only tell.

use std::path::{Path, PathBuf};

use clap::Args;

use seamwise::error::{Error, Result};

use super::bake::is_dash;
use super::reading::ReadingArgs;
use super::repair::FootprintArgs;

/// `seamwise inspect`.
#[derive(Debug, Args)]
#[command(after_help = "Example: seamwise inspect helmet.gltf")]
pub(crate) struct InspectArgs {
    /// A .glb, .gltf, .obj, .ply or .off file, or - for standard input.
    input: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) footprint: FootprintArgs,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
    /// Write what is found as JSON; - for standard output, as if no FILE is given.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    json: Option<PathBuf>,
}

impl InspectArgs {
    /// The file, which `--json` has taken where it stands before it, as it once had no value.
    ///
    /// # Errors
    /// [`Error::Options`] if there is none.
    pub(crate) fn input(&self) -> Result<&Path> {
        let what = "no input: name a .glb, .gltf, .obj, .ply or .off file";
        let none = || Error::Options { what: what.into() };
        let taken = self.json.as_deref().filter(|path| !is_dash(path));
        self.input.as_deref().or(taken).ok_or_else(none)
    }

    /// Where JSON goes, if it is asked for.
    pub(crate) fn json(&self) -> Option<&Path> {
        let is_taken = self.input.is_none();
        self.json.as_deref().map(|path| if is_taken { Path::new("-") } else { path })
    }
}

/// `seamwise select`.
#[derive(Debug, Args)]
#[command(after_help = "Example: seamwise select out/helmet.json --pixels 300\n\n\
    Prints the level's number; 0 is the source.")]
pub(crate) struct SelectArgs {
    /// The report of a bake: <stem>.json.
    pub(crate) report: PathBuf,
    /// How many pixels the diagonal of the model's bounding box spans.
    #[arg(long, value_name = "N", value_parser = parse_pixels)]
    pub(crate) pixels: f64,
}

/// Reads a number of pixels from 0 on.
fn parse_pixels(text: &str) -> std::result::Result<f64, String> {
    let pixels = text.parse().ok().filter(|pixels: &f64| *pixels >= 0.0);
    pixels.ok_or_else(|| format!("{text} is no number of pixels"))
}
