//! The arguments of `seamwise extract`.

use std::path::PathBuf;

use clap::{ArgGroup, Args};
use seamwise::export::progressive::extract::Fineness;

/// `seamwise extract`.
#[derive(Debug, Args)]
#[command(override_usage = "seamwise extract [OPTIONS] --output <FILE.glb> <INPUT>")]
#[command(group(ArgGroup::new("fineness").args(["triangles", "ratio", "error", "source"]).required(true)))]
#[command(after_help = "\
Examples:
  seamwise extract out/helmet_progressive.glb --triangles 5000 -o level.glb
  seamwise extract out/helmet_progressive.glb --source -o helmet.glb

A file that ends early, as one that is still being loaded, gives what is there.")]
pub(crate) struct ExtractArgs {
    /// A progressive file: <stem>_progressive.glb of `bake --progressive`, or - for standard input.
    pub(crate) input: PathBuf,
    /// The .glb to write, or - for standard output.
    #[arg(long, short, value_name = "FILE.glb")]
    pub(crate) output: PathBuf,
    /// At most so many triangles.
    #[arg(long, value_name = "N")]
    triangles: Option<u64>,
    /// At most such a share of the source's triangles.
    #[arg(long, value_name = "R", value_parser = super::bake::parse_ratio)]
    ratio: Option<f64>,
    /// At most such an error, as a report's `error` of a level: in the units of the meshes.
    #[arg(long, value_name = "E", value_parser = parse_error)]
    error: Option<f32>,
    /// The source.
    #[arg(long)]
    source: bool,
}

impl ExtractArgs {
    /// How fine the level is to be, of a source of so many triangles.
    pub(crate) fn fineness(&self, source: u64) -> Fineness {
        match (self.triangles, self.ratio, self.error) {
            (Some(triangles), ..) => Fineness::Triangles(triangles),
            (_, Some(ratio), _) => Fineness::Triangles((source as f64 * ratio).round() as u64),
            (_, _, Some(error)) => Fineness::Error(error),
            _ => Fineness::Source,
        }
    }
}

/// Reads an error from 0 on.
fn parse_error(text: &str) -> std::result::Result<f32, String> {
    let error = text.parse().ok().filter(|error: &f32| *error >= 0.0);
    error.ok_or_else(|| format!("{text} is no error: it is 0 or more"))
}
