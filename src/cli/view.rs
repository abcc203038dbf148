//! The arguments of the interactive view.

use std::path::PathBuf;

use clap::Args;

use super::reading::ReadingArgs;

/// `seamwise view`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  seamwise view helmet.gltf out/helmet_lod*.glb -o helmet.html
  seamwise view out/helmet.glb -o helmet.html
  seamwise view out/helmet_progressive.glb -o helmet.html

The page needs nothing but itself: no network and no server. It is opened in the browser where there is \
one and the command is typed in a terminal.")]
pub(crate) struct ViewArgs {
    /// The source, or one file with all levels (MSFT_lod or progressive): .glb, .gltf, .obj, .ply or .off, as
    /// the levels.
    pub(crate) input: PathBuf,
    /// Its levels, from fine to coarse, from any tool. Of a progressive file a slider shows every number of
    /// triangles.
    pub(crate) levels: Vec<PathBuf>,
    /// The page to write.
    #[arg(long, short, value_name = "FILE.html")]
    pub(crate) output: PathBuf,
    /// Write the page and leave the browser alone.
    #[arg(long)]
    pub(crate) no_open: bool,
    #[command(flatten)]
    pub(crate) reading: ReadingArgs,
}
