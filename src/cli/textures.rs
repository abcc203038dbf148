//! Arguments for the textures of levels.

use clap::{Args, ValueEnum};

use seamwise::bake::options::{TextureFiles, Textures};
use seamwise::error::{Error, Result};
use seamwise::limit::MemoryLimit;
use seamwise::transfer::{Atlas, BakeNormals, Sizes, TextureFormat, TransferOptions};

/// Arguments for textures. All but the first are of levels' own, chosen or forced.
#[derive(Debug, Args)]
#[command(next_help_heading = "Textures")]
pub(super) struct TextureArgs {
    /// Textures of each level's own, or the source's; auto if not given.
    ///
    /// With --quality, --max-bytes and the like, whose levels share what they are bounded by, and with
    /// --geomorph, which leads UVs from one level to the next, repair if not given.
    #[arg(long, value_enum, value_name = "HOW")]
    textures: Option<TextureMode>,
    /// With auto or transfer, where the levels' textures are laid out; keep if not given.
    #[arg(long, value_enum, value_name = "WHERE")]
    atlas: Option<AtlasMode>,
    /// Bake materials into one atlas and one draw call, where they can be.
    ///
    /// They can where they agree in alpha mode, sides and extensions; the others get a packed atlas of their own. The report tells which and why.
    #[arg(long, conflicts_with = "atlas")]
    merge_materials: bool,
    /// The side of each level's textures over those of the level before.
    ///
    /// Above 0 and up to 1. Without it they are as large as it takes where the level is shown.
    #[arg(long, value_name = "S", value_parser = parse_scale)]
    texture_scale: Option<f64>,
    /// Most bytes that the textures of all levels take together, as 8MB or 500KiB.
    #[arg(long, value_name = "SIZE", conflicts_with = "texture_scale")]
    budget: Option<MemoryLimit>,
    /// The file format of the levels' textures; keep if not given.
    #[arg(long, value_enum, value_name = "FORMAT")]
    texture_format: Option<FormatMode>,
    /// Quality of JPEGs and of WebPs with losses; 95 if not given.
    #[arg(long, alias = "jpeg-quality", value_name = "N", value_parser = clap::value_parser!(u8).range(1..=100))]
    texture_quality: Option<u8>,
    /// How PNGs are packed; fast if not given.
    ///
    /// The smallest take a few times as long and are a few percent smaller.
    #[arg(long, value_enum, value_name = "HOW")]
    png: Option<PngMode>,
    /// Whether lit materials without a normal map gain one, with the shape that the
    /// level has lost; auto if not given.
    #[arg(long, value_enum, value_name = "WHEN")]
    bake_normals: Option<NormalMode>,
    /// Scale the alpha of textures that a MASK cuts out: leaves do not thin out.
    ///
    /// As large a share of a level's texels passes its cutoff as of the source's.
    #[arg(long)]
    keep_coverage: bool,
}

/// Reads a share above 0 and up to 1.
fn parse_scale(text: &str) -> std::result::Result<f64, String> {
    let scale = text.parse().ok().filter(|scale: &f64| *scale > 0.0 && *scale <= 1.0);
    scale.ok_or_else(|| format!("{text} is no number above 0 and up to 1"))
}

/// `--textures`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum TextureMode {
    /// Each level has its own where they show less error than the source's, for no more bytes than the
    /// source's in all.
    Auto,
    /// Each level has its own, sampled from the surface of the source.
    Transfer,
    /// All levels share the source's, with every texel that no chart covers filled.
    Repair,
    /// All levels share the source's as they are.
    Keep,
}

/// `--atlas`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum AtlasMode {
    /// Where the source's are; those whose layout tiles or overlaps stay shared.
    Keep,
    /// In a packed atlas of their own for each level.
    New,
    /// As new, of levels that are simplified without UVs, so that charts take no triangles from the shape,
    /// and unwrapped.
    Free,
}

/// `--texture-format`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum FormatMode {
    /// As the source's.
    Keep,
    /// Lossless.
    Png,
    /// Opaque colors as JPEG, all else as PNG.
    Jpeg,
    /// Lossless and smaller; readers must know EXT_texture_webp.
    Webp,
    /// Colors with losses, with alpha too, all else lossless; readers must know EXT_texture_webp.
    WebpLossy,
    /// Blocks for graphics processors with all mip maps, a quarter of the memory there; readers must know
    /// KHR_texture_basisu. All textures become so, whatever --textures says.
    Ktx2,
}

impl From<FormatMode> for TextureFormat {
    fn from(mode: FormatMode) -> Self {
        match mode {
            FormatMode::Keep => Self::Keep,
            FormatMode::Png => Self::Png,
            FormatMode::Jpeg => Self::Jpeg,
            FormatMode::Webp => Self::WebP,
            FormatMode::WebpLossy => Self::LossyWebP,
            // Made without loss, and compressed at the end.
            FormatMode::Ktx2 => Self::Png,
        }
    }
}

/// `--png`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum PngMode {
    /// In one go.
    Fast,
    /// By trying many filters and color types.
    Smallest,
}

/// `--bake-normals`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum NormalMode {
    /// Where the shading normals of a level are off by more than half a degree.
    Auto,
    /// On every lit material.
    On,
    /// Nowhere.
    Off,
}

impl From<NormalMode> for BakeNormals {
    fn from(mode: NormalMode) -> Self {
        match mode {
            NormalMode::Auto => Self::Auto,
            NormalMode::On => Self::On,
            NormalMode::Off => Self::Off,
        }
    }
}

impl TextureArgs {
    /// The handling of textures that these arguments give; `shares` tells whether levels share the
    /// source's unless they are told otherwise.
    pub(super) fn resolve(&self, shares: bool) -> Result<Textures> {
        let default = if shares { TextureMode::Repair } else { TextureMode::Auto };
        let textures = match self.textures.unwrap_or(default) {
            TextureMode::Auto => {
                let own = self.transfer();
                // In a new layout nothing can be shared.
                let chooses = own.atlas == Atlas::Keep;
                return Ok(Textures::Transfer(TransferOptions { chooses, ..own }));
            }
            TextureMode::Transfer => return Ok(Textures::Transfer(self.transfer())),
            TextureMode::Repair => Textures::Repair,
            TextureMode::Keep => Textures::Keep,
        };
        let given = [
            ("--atlas", self.atlas.is_some()),
            ("--merge-materials", self.merge_materials),
            ("--texture-scale", self.texture_scale.is_some()),
            ("--budget", self.budget.is_some()),
            ("--texture-format", self.texture_format.is_some() && !self.is_ktx2()),
            ("--texture-quality", self.texture_quality.is_some()),
            ("--bake-normals", self.bake_normals.is_some()),
            ("--keep-coverage", self.keep_coverage),
        ];
        match given.iter().find(|(_, is_given)| *is_given) {
            None => Ok(textures),
            Some((name, _)) => {
                Err(Error::Options { what: format!("{name} needs --textures auto or transfer") })
            }
        }
    }

    /// The files of textures that these arguments give.
    pub(super) fn files(&self) -> TextureFiles {
        let smallest_png = matches!(self.png, Some(PngMode::Smallest));
        TextureFiles { ktx2: self.is_ktx2(), smallest_png }
    }

    fn is_ktx2(&self) -> bool {
        matches!(self.texture_format, Some(FormatMode::Ktx2))
    }

    fn transfer(&self) -> TransferOptions {
        let default = TransferOptions::default();
        TransferOptions {
            chooses: default.chooses,
            atlas: match self.atlas {
                _ if self.merge_materials => Atlas::Merged,
                Some(AtlasMode::New | AtlasMode::Free) => Atlas::New,
                Some(AtlasMode::Keep) | None => Atlas::Keep,
            },
            unwraps: matches!(self.atlas, Some(AtlasMode::Free)),
            sizes: match (self.texture_scale, self.budget) {
                (Some(scale), _) => Sizes::Scale(scale),
                (_, Some(budget)) => Sizes::Budget(budget.bytes()),
                _ => Sizes::Needed,
            },
            bake_normals: self.bake_normals.map_or(default.bake_normals, BakeNormals::from),
            format: self.texture_format.map_or(default.format, TextureFormat::from),
            quality: self.texture_quality.unwrap_or(default.quality),
            keep_coverage: self.keep_coverage,
            in_blocks: self.is_ktx2(),
        }
    }
}
