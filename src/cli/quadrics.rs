//! Arguments of `seamwise quadrics`.

use std::path::PathBuf;

use clap::Args;

use super::camera::{CameraArg, parse_camera};
use super::reading::ReadingArgs;

/// `seamwise quadrics`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  seamwise quadrics dragon.obj --level 3 -o dragon.png
  seamwise quadrics dragon.obj -o dragon_quadrics.glb
  seamwise view dragon_quadrics.glb -o dragon.html

An ellipsoid is where the squared distances to the planes that a point stands for add up to epsilon: flat \
discs (dark) where the surface is nearly flat, needles along edges, small balls (yellow) at tips. Points \
whose quadric is not positive definite have none, and are counted.")]
pub(crate) struct QuadricsArgs {
    /// A .glb, .gltf, .obj, .ply or .off file.
    pub(crate) input: PathBuf,
    /// The picture, or the model to turn (.glb, with EXT_mesh_gpu_instancing).
    #[arg(long, short, value_name = "FILE.png|FILE.glb")]
    pub(crate) output: PathBuf,
    /// Halve the triangles so many times first, by `--cost classic`: points then stand for all planes that they
    /// have gathered.
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=30))]
    pub(crate) level: u32,
    /// The value on the ellipsoids, in squared units of the scene; if not given, that at which half of them are half as wide as their edges are long.
    #[arg(long, value_name = "E")]
    pub(crate) epsilon: Option<f64>,
    /// Pixels along each side of the picture.
    #[arg(long, default_value_t = 1024, value_parser = clap::value_parser!(u16).range(16..=4096))]
    pub(crate) resolution: u16,
    /// The place of the camera, the point it looks at and the degrees of its field of view, in the units of
    /// the scene; if not given, the first view of `evaluate`.
    #[arg(long, value_name = "X,Y,Z,X,Y,Z,DEGREES", value_parser = parse_camera, allow_hyphen_values = true)]
    pub(crate) camera: Option<CameraArg>,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
}
