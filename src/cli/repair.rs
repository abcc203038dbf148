//! Arguments of `seamwise repair`, and those for what counts as a read.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use seamwise::image_file::codec::EncodeOptions;
use seamwise::import::options::ReadOptions;
use seamwise::repair::options::{Background, MeshOptions, RepairOptions};
use seamwise_texture::{Footprint, Role, equalize};

use super::common::Common;
use super::reading::OutsideArgs;

/// Shown by `-h` and `--help`.
const EXAMPLES: &str = "\
Examples:
  seamwise repair scan.glb -o repaired.glb
  seamwise repair atlas.png -o repaired.png --background '#ff00ff'
  seamwise repair scan.glb -o repaired.glb --png --memory-limit 8GB
  seamwise repair scan.glb -o repaired.glb --equalize-seams
  seamwise repair light.exr -o new.exr --mesh room.glb --uv-set 1
  seamwise repair leaf.png -o repaired.png --scale 1/4 --keep-coverage
  seamwise repair a_color.png a_normal.png a_orm.png -o repaired/
  seamwise repair textures -o repaired";

/// Shown by `--help`, below the examples.
const DETAILS: &str = "\
An asset knows which of its texels are used. For a picture, --mesh, --mask and --background tell; a \
texel must pass all that are given. Valid texels stay as they are, except in JPEGs, which are compressed \
anew (--quality), unless the output is a .png or, for an asset, --png is given. A .webp is written \
losslessly, a .tif in the compression it came in where that is lossless, and a palette as RGB. ICC \
profile, EXIF, density and texts stay within a format; what does not is said. In an EXR, NaN and \
infinities are never valid, and where only the background tells neither are fireflies between the charts \
of an .exr or .hdr: specks of up to 4 texels, and pieces of under 64 with one over 20 times brighter than \
99.9 % of the larger pieces.

Where alpha tells what is background, and in an asset where the base color of a MASK or BLEND has alpha \
0, colors spread under it and alpha stays to the bit. A picture whose texels are vectors of length 1 is \
filled as a normal map. Both are said.

Several inputs are each written under their own names. Pictures whose names differ in their last word \
alone, if it says which map they are, are one set: what all of them that show a background have for \
background is invalid in all. A file that fails is named, the rest go on, and the exit code is 1.";

/// `seamwise repair`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{DETAILS}"))]
pub(crate) struct RepairArgs {
    /// Pictures (.png, .jpg, .webp, .tif, .hdr, .exr), a .glb or .gltf, folders, or - for stdin.
    ///
    /// Of a .glb or .gltf all images are repaired. A folder stands for all of these in it and below, but
    /// pictures of a .gltf in it.
    #[arg(required = true)]
    pub(crate) inputs: Vec<PathBuf>,
    /// The file to write, or the folder for several inputs.
    ///
    /// A .glb for an asset, an .exr for an .exr, else any format for pictures; - is standard output.
    #[arg(long, short, value_name = "FILE|DIR")]
    pub(crate) output: PathBuf,
    /// All pictures given are maps of one set, whatever they are called.
    #[arg(long)]
    pub(crate) one_set: bool,
    /// The model that uses the picture: texels in its UV triangles are valid.
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// The mesh's UV set for the picture.
    #[arg(long, default_value_t = 0, value_name = "N", requires = "mesh")]
    uv_set: usize,
    /// Only the meshes of this name, or that nodes of this name show; all if not given.
    #[arg(long, value_name = "NAME", requires = "mesh")]
    mesh_name: Option<String>,
    /// A picture of the same size, bright where texels are valid.
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
    /// What lies around the charts and is invalid: these colors, or alpha 0.
    ///
    /// Colors spread under alpha 0. auto finds both, and none looks for none; auto if neither mesh nor
    /// mask is given.
    #[arg(long, value_name = "auto|alpha|#rrggbb,…|none")]
    background: Option<Background>,
    /// What the texels mean; if not given, normal where they are vectors of length 1, else color, and
    /// numbers as they are in an EXR.
    #[arg(long, value_enum)]
    role: Option<RoleName>,
    /// Keep up to N texels of padding around the charts where it agrees with them.
    ///
    /// Ring by ring, each texel within a tenth of the range (15° in a normal map) of what the chart leads to
    /// expect there. All else around them is filled.
    #[arg(long, default_value_t = 0, value_name = "N")]
    keep_padding: u16,
    /// Draw what was filled.
    ///
    /// Of one input: the result in dim gray, filled texels in color with a tint of orange. Where several images of an asset or layers of an EXR are repaired, each has a picture of its
    /// own, with the number that the table gives it, or its place: FILE_0.png, FILE_3.png.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) diff: Option<PathBuf>,
    /// Draw the levels of the fill: each after the pull and after the push, with its weights.
    ///
    /// Into one picture, or into a folder with a file for each: DIR/0_pull.png is of the image itself,
    /// DIR/0_pull_weights.png has how far its texels count. Of one input; several images have numbers as with
    /// --diff.
    #[arg(long, value_name = "FILE.png|DIR")]
    pub(crate) pyramid: Option<PathBuf>,
    /// Scale the result down, to 1/2, 1/4 and so on along each axis.
    ///
    /// A texel becomes the mean of the
    /// valid ones in it, in linear light or of vectors by role, and what has none is filled: nothing
    /// around the charts bleeds into their rims. Images of an asset that are left alone keep their
    /// size, except those that charts cover.
    #[arg(long, default_value = "1", value_name = "1/N", value_parser = parse_scale)]
    scale: u32,
    /// Scale alpha with the image, so that as large a share of its texels has CUTOFF or more as before:
    /// leaves do not thin out. 0.5 if not given; in an asset, the cutoff of each MASK.
    #[arg(long, value_name = "CUTOFF", num_args = 0..=1, require_equals = true, default_missing_value = "0.5", requires = "scale", value_parser = parse_cutoff)]
    keep_coverage: Option<f32>,
    /// Move texels next to seams so that both sides of each read the same.
    ///
    /// After the fill. Seams are edges of a mesh: a picture needs --mesh.
    #[arg(long)]
    equalize_seams: bool,
    /// Write what was done as JSON; - for standard output.
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    #[command(flatten)]
    footprint: FootprintArgs,
    /// Quality of JPEGs that are written.
    #[arg(long, default_value_t = EncodeOptions::default().quality, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=100))]
    quality: u8,
    /// Write repaired JPEGs of an asset as PNGs, which lose nothing. A picture is written in the
    /// format of the output's extension.
    #[arg(long)]
    png: bool,
    #[command(flatten)]
    outside: OutsideArgs,
}

/// Arguments for what counts as a read.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct FootprintArgs {
    /// Count whole blocks of 4 × 4 texels as read, at each mip level, as in compressed textures.
    #[arg(long)]
    blocks: bool,
    /// Count what anisotropic reads of up to N taps reach: texels less than N texels from a chart
    /// along both axes, at each mip level, a bound for any direction.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=16))]
    anisotropy: u8,
}

impl FootprintArgs {
    /// The footprint that these arguments give.
    pub(crate) fn resolve(self) -> Footprint {
        Footprint { anisotropy: self.anisotropy, blocks: self.blocks }
    }
}

/// `--role`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum RoleName {
    /// Colors: averaged in linear light.
    Color,
    /// A normal map: averaged as vectors.
    Normal,
    /// Anything else: averaged as stored.
    Data,
}

impl RepairArgs {
    /// Whether pictures of what was done are asked for.
    pub(crate) fn draws(&self) -> bool {
        self.diff.is_some() || self.pyramid.is_some()
    }

    /// The options that these arguments give, with those that all jobs share.
    pub(crate) fn resolve(&self, common: Common) -> RepairOptions {
        let Common { memory_limit, strict, .. } = common;
        let OutsideArgs { allow_outside, allow_unknown } = self.outside;
        let alone = self.mesh.is_none() && self.mask.is_none();
        let default = if alone { Background::Auto } else { Background::None };
        RepairOptions {
            mesh: self.mesh.clone().map(|file| MeshOptions {
                file,
                uv_set: self.uv_set,
                name: self.mesh_name.clone(),
            }),
            mask: self.mask.clone(),
            background: self.background.clone().unwrap_or(default),
            role: self.role.map(|role| match role {
                RoleName::Color => Role::Color,
                RoleName::Normal => Role::Normal,
                RoleName::Data => Role::Data,
            }),
            halvings: self.scale,
            keep_coverage: self.keep_coverage,
            footprint: self.footprint.resolve(),
            diff: self.diff.clone(),
            pyramid: self.pyramid.clone(),
            keep_padding: self.keep_padding.into(),
            equalize: self.equalize_seams.then(equalize::Options::default),
            encoding: EncodeOptions { quality: self.quality, png: self.png },
            reading: ReadOptions {
                memory_limit,
                allow_outside,
                allow_unknown,
                strict,
                ..ReadOptions::default()
            },
        }
    }
}

/// Reads `1/4`: how many halvings that is.
fn parse_scale(text: &str) -> std::result::Result<u32, String> {
    let parts = if text == "1" { Some("1") } else { text.strip_prefix("1/") };
    let parts = parts.and_then(|parts| parts.parse().ok()).filter(|n: &u32| n.is_power_of_two());
    let what = || format!("{text} is no scale like 1/2, 1/4 or 1/8: one over a power of two");
    parts.map(u32::ilog2).ok_or_else(what)
}

/// Reads an alpha above 0 and up to 1.
fn parse_cutoff(text: &str) -> std::result::Result<f32, String> {
    let cutoff = text.parse().ok().filter(|cutoff: &f32| *cutoff > 0.0 && *cutoff <= 1.0);
    cutoff.ok_or_else(|| format!("{text} is no alpha above 0 and up to 1"))
}
