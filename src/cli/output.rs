//! Arguments for the files that a bake writes.

use clap::{Args, ValueEnum};
use seamwise::error::{Error, Result};
use seamwise::export::files::{Format, Geomorph, Layout, OutputOptions};

/// Arguments for the output of levels.
#[derive(Debug, Args)]
#[command(next_help_heading = "Files")]
pub(crate) struct OutputArgs {
    /// Make geometry small, for readers of meshopt.
    ///
    /// Vertices are stored as small integers (KHR_mesh_quantization), and geometry is compressed
    /// (EXT_meshopt_compression). Positions are off by half of 1/65535 of the surface's longest side, or
    /// stay floats where that is more than the level is off by; the figures of the levels have it in
    /// them. Readers without these extensions refuse the files.
    #[arg(long)]
    compress: bool,
    /// One .glb a level, or .gltf files with their textures beside them.
    #[arg(long, value_enum, default_value_t = FormatArg::Glb)]
    format: FormatArg,
    /// A further file of all levels, and its form.
    ///
    /// None if not given, but msft_lod with --share-vertices. README.md has a table of which program
    /// takes which file.
    #[arg(long, value_enum)]
    layout: Option<LayoutArg>,
    /// Write <stem>_progressive.glb too: all levels between the coarsest and the source.
    ///
    /// Any reader of glTF shows its coarsest level; `seamwise extract` makes any other of it, with all splits
    /// the source to the bit. Textures are the source's, filled unless they are kept.
    #[arg(long)]
    progressive: bool,
    /// Let vertices say where they come to lie in the next coarser level, for a change without a jump.
    ///
    /// As attributes that a shader blends with the level's own: _GEOMORPH_POSITION, _GEOMORPH_NORMAL,
    /// _GEOMORPH_TEXCOORD_0 and so on; web/ has one for three.js. With `target` as a morph target of positions
    /// and normals too, which any viewer plays. Levels that have textures of their own have no UVs among them. The
    /// coarsest level has none, and neither has the source but in the file of all levels.
    #[arg(long, value_enum, value_name = "HOW", num_args = 0..=1, require_equals = true, default_missing_value = "attributes", conflicts_with_all = ["compress", "share_vertices"])]
    geomorph: Option<GeomorphArg>,
    /// Let all levels keep vertices of the source, stored once in the file of all levels.
    ///
    /// As --placement ends, without a polish; the vertices are ordered so that each level reads a prefix
    /// of them. The levels are farther from the source than without. With --compress, vertices stay in the
    /// source's types.
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

/// `--geomorph`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum GeomorphArg {
    /// As attributes.
    Attributes,
    /// As attributes, and as a morph target.
    Target,
}

/// `--layout`.
#[derive(Clone, Copy, Debug, ValueEnum)]
#[value(rename_all = "snake_case")]
enum LayoutArg {
    /// Nodes name those of their levels, for Babylon.js and other readers of MSFT_lod.
    MsftLod,
    /// Nodes hold the source and its levels as <name>_LOD0, <name>_LOD1 and so on, for scripts that
    /// look for such names: importers of glTF show all of them at once.
    Names,
    /// The coarsest level, which names finer ones and larger textures as files in the folder <stem>_needle:
    /// a loader of NEEDLE_progressive (npm's @needle-tools/gltf-progressive for three.js) fetches them where they
    /// are seen. Textures are shared; with --compress, vertices stay in the source's types.
    Needle,
    /// There is none, only a file for each level.
    None,
}

impl OutputArgs {
    /// Whether a level is more than one file, or there is one of all levels.
    pub(super) fn is_several(&self) -> bool {
        self.progressive || self.layout() != Layout::None || matches!(self.format, FormatArg::Gltf)
    }

    fn layout(&self) -> Layout {
        match self.layout {
            Some(LayoutArg::MsftLod) => Layout::MsftLod,
            Some(LayoutArg::Names) => Layout::Names,
            Some(LayoutArg::Needle) => Layout::Needle,
            None if self.share_vertices => Layout::MsftLod,
            Some(LayoutArg::None) | None => Layout::None,
        }
    }

    /// The options that these arguments give.
    ///
    /// # Errors
    /// [`Error::Options`] if vertices are to be shared in a file that is not there.
    pub(crate) fn resolve(&self) -> Result<OutputOptions> {
        if self.share_vertices && self.layout() == Layout::None {
            let what = "--share-vertices needs a file of all levels: --layout msft_lod or names";
            return Err(Error::Options { what: what.into() });
        }
        Ok(OutputOptions {
            compress: self.compress,
            format: match self.format {
                FormatArg::Glb => Format::Glb,
                FormatArg::Gltf => Format::Gltf,
            },
            layout: self.layout(),
            share_vertices: self.share_vertices,
            progressive: self.progressive,
            geomorph: match self.geomorph {
                None => Geomorph::None,
                Some(GeomorphArg::Attributes) => Geomorph::Attributes,
                Some(GeomorphArg::Target) => Geomorph::Target,
            },
        })
    }
}
