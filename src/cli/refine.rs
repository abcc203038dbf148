//! The arguments of `seamwise refine`.

use std::path::PathBuf;

use clap::{ArgGroup, Args};
use glam::DVec3;

use super::place::parse_place;

/// `seamwise refine`.
#[derive(Debug, Args)]
#[command(override_usage = "seamwise refine [OPTIONS] <--triangles <N>|--pixels <E>> <INPUT>")]
#[command(group(ArgGroup::new("from").args(["eye", "path"]).required(true)))]
#[command(group(ArgGroup::new("goal").args(["triangles", "pixels"]).required(true).multiple(true)))]
#[command(after_help = "\
Examples:
  seamwise refine out/hills_progressive.glb --eye 0,2,0 --target 50,0,50 --triangles 10000 -o seen.glb
  seamwise refine out/hills_progressive.glb --path walk.json --pixels 1

An error counts as it is seen: by what of it lies across the view, and a tenth where a surface faces away or lies \
outside of the picture.")]
pub(crate) struct RefineArgs {
    /// A progressive file: <stem>_progressive.glb of `bake --progressive`, or - for standard input.
    pub(crate) input: PathBuf,
    /// The .glb to write, refined for the eye, or for the last of a path.
    #[arg(long, short, value_name = "FILE.glb")]
    pub(crate) output: Option<PathBuf>,
    /// The place of the eye in the world.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true, requires = "target")]
    pub(crate) eye: Option<DVec3>,
    /// The place that it looks at; +y is up.
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_place, allow_hyphen_values = true)]
    pub(crate) target: Option<DVec3>,
    /// The field of view from top to bottom, in degrees.
    #[arg(long, value_name = "D", default_value_t = 45.0)]
    pub(crate) fov: f32,
    /// Cameras to go along: a JSON list of {"eye": [X, Y, Z], "target": [X, Y, Z], "fov": D}. What each
    /// frame has is written as JSON, to --json or to standard output.
    #[arg(long, value_name = "FILE.json", conflicts_with_all = ["eye", "target"])]
    pub(crate) path: Option<PathBuf>,
    /// The most triangles, in meshes each once.
    #[arg(long, value_name = "N")]
    pub(crate) triangles: Option<usize>,
    /// The error in pixels that is small enough.
    #[arg(long, value_name = "E")]
    pub(crate) pixels: Option<f32>,
    /// The most splits and collapses for a frame of --path; what is left is done for the next ones, so that
    /// each takes a time that is bounded.
    #[arg(long, value_name = "N", requires = "path")]
    pub(crate) steps: Option<usize>,
    /// Pixels of the picture across.
    #[arg(long, value_name = "N", default_value_t = 1920)]
    pub(crate) width: u32,
    /// Pixels of the picture from top to bottom.
    #[arg(long, value_name = "N", default_value_t = 1080)]
    pub(crate) height: u32,
    /// Write what each frame has as JSON; - for standard output.
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
}
