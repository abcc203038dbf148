//! Arguments for the files that a bake writes.

use clap::{Args, ValueEnum};
use seamwise::error::{Error, Result};
use seamwise::export::files::{Format, Layout, OutputOptions};

/// Arguments for the output of levels.
#[derive(Debug, Args)]
pub(crate) struct OutputArgs {
    /// Store vertices as small integers (KHR_mesh_quantization) and compress geometry
    /// (EXT_meshopt_compression). Positions are off by half of 1/65535 of the surface's longest side, or
    /// stay floats where that is more than the level is off by; the figures of the levels have it in
    /// them. Readers without these extensions refuse the files.
    #[arg(long)]
    compress: bool,
    /// The form of the files.
    #[arg(long, value_enum, default_value_t = FormatArg::Glb)]
    format: FormatArg,
    /// What the file of all levels is like.
    #[arg(long, value_enum, default_value_t = LayoutArg::MsftLod)]
    layout: LayoutArg,
    /// Let all levels keep vertices of the source (as --placement ends, without a polish), and store
    /// them once in the file of all levels, ordered so that each level reads a prefix of them. The levels
    /// are farther from the source than without. With --compress, vertices stay in the source's types.
    #[arg(long, conflicts_with_all = ["placement", "fast", "keep_volume", "keep_area", "atlas", "merge_materials"])]
    pub(super) share_vertices: bool,
}

/// `--format`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatArg {
    /// Each level as one .glb.
    Glb,
    /// Each level as a .gltf and a .bin, with the images of all in the folder <stem>_textures.
    Gltf,
}

/// `--layout`.
#[derive(Clone, Copy, Debug, ValueEnum)]
#[value(rename_all = "snake_case")]
enum LayoutArg {
    /// Nodes name those of their levels, for readers of MSFT_lod.
    MsftLod,
    /// Nodes hold the source and its levels as <name>_LOD0, <name>_LOD1 and so on, as importers of
    /// Unity, Godot and Unreal know them; other readers show all of them at once.
    Names,
    /// There is none, only a file for each level.
    None,
}

impl OutputArgs {
    /// The options that these arguments give.
    ///
    /// # Errors
    /// [`Error::Options`] if vertices are to be shared in a file that is not there.
    pub(crate) fn resolve(&self) -> Result<OutputOptions> {
        if self.share_vertices && matches!(self.layout, LayoutArg::None) {
            let what = "--share-vertices needs a file of all levels: --layout msft_lod or names";
            return Err(Error::Options { what: what.into() });
        }
        Ok(OutputOptions {
            compress: self.compress,
            format: match self.format {
                FormatArg::Glb => Format::Glb,
                FormatArg::Gltf => Format::Gltf,
            },
            layout: match self.layout {
                LayoutArg::MsftLod => Layout::MsftLod,
                LayoutArg::Names => Layout::Names,
                LayoutArg::None => Layout::None,
            },
            share_vertices: self.share_vertices,
        })
    }
}
