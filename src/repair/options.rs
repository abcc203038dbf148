//! Options of a repair.

use std::path::PathBuf;
use std::str::FromStr;

use seamwise_texture::equalize;
use seamwise_texture::{Footprint, Role};

use crate::atlas::AtlasOptions;
use crate::error::{Error, Result};
use crate::image_file::codec::EncodeOptions;
use crate::import::options::ReadOptions;

/// Options of a repair. The mesh, the mask and the background tell the valid texels of a picture, and
/// `role` their meaning; an asset knows both by itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RepairOptions {
    /// A mesh that uses the picture.
    pub mesh: Option<MeshOptions>,
    /// A picture of the same size that is bright (luma above one half) where texels are valid.
    pub mask: Option<PathBuf>,
    /// The background, around the charts.
    pub background: Background,
    /// Meaning of the texels; if not given, [`Role::Normal`] where
    /// [`is_normal_map`](seamwise_texture::is_normal_map) says so, else [`Role::Color`]. An EXR's
    /// channels are filled as they are stored, whatever they mean.
    pub role: Option<Role>,
    /// How many rings of texels around the valid ones stay if they agree with them; see
    /// [`seamwise_texture::agreeing_padding`].
    pub keep_padding: usize,
    /// How often the result is halved, each texel the mean of valid ones; see
    /// [`seamwise_texture::scale_down`].
    pub halvings: u32,
    /// The least alpha of a picture that is shown, 0…1, if the share of texels that have it is to stay
    /// as the picture is halved; in an asset that of each `MASK` counts. See
    /// [`seamwise_texture::keep_coverage`].
    pub keep_coverage: Option<f32>,
    /// The filtering and storage by which the report counts texels as read.
    pub footprint: Footprint,
    /// A .png to draw what was filled in; see [`repair_file`](super::repair_file).
    pub diff: Option<PathBuf>,
    /// A .png to draw the levels of the fill in.
    pub pyramid: Option<PathBuf>,
    /// Whether and how both sides of seams are made to read the same, after the fill.
    pub equalize: Option<equalize::Options>,
    /// How an asset is read, and the mesh. Its memory limit is also the most that decoding one image
    /// may take.
    pub reading: ReadOptions,
    /// How images are encoded.
    pub encoding: EncodeOptions,
}

impl RepairOptions {
    /// The options for the images of an asset.
    pub(super) fn for_atlases(&self) -> AtlasOptions {
        let Self { reading, keep_padding, halvings, equalize, keep_coverage, .. } = *self;
        let keep_coverage = keep_coverage.is_some();
        let memory_limit = reading.memory_limit;
        AtlasOptions { memory_limit, keep_padding, halvings, equalize, keep_coverage }
    }
}

/// The mesh that uses a picture: all triangle primitives of a glTF file, wherever its nodes put
/// them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MeshOptions {
    /// The .glb or .gltf file.
    pub file: PathBuf,
    /// The UV set that lays the charts out, read without `KHR_texture_transform`.
    pub uv_set: usize,
    /// Only meshes of this name, or that a node of this name shows. Where each mesh of a file has a
    /// picture of its own, as with lightmaps, their charts overlap, and one must be chosen.
    pub name: Option<String>,
}

/// The background of a picture, which is invalid.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Background {
    /// As the picture shows it: alpha 0 ([`seamwise_texture::alpha_tells`]), colors along its
    /// border ([`seamwise_texture::Background::detect`]), or both.
    #[default]
    Auto,
    /// Alpha 0: colors spread under it, and alpha stays.
    Alpha,
    /// Texels of these colors: RGBA as stored, 0…1. One of alpha 0 stands for any of alpha 0.
    Colors(Vec<[f32; 4]>),
    /// Neither color nor alpha says anything.
    None,
}

impl FromStr for Background {
    type Err = Error;

    /// Reads `auto`, `alpha`, `none`, or colors with commas between: `#rrggbb` (opaque) or
    /// `#rrggbbaa`.
    fn from_str(text: &str) -> Result<Self> {
        let color = |text: &str| {
            let digits = text
                .strip_prefix('#')
                .filter(|digits| digits.bytes().all(|b| b.is_ascii_hexdigit()))?;
            let byte = |at: usize| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok();
            let alpha = match digits.len() {
                6 => 255,
                8 => byte(6)?,
                _ => return None,
            };
            Some([byte(0)?, byte(2)?, byte(4)?, alpha].map(|byte| f32::from(byte) / 255.0))
        };
        match text {
            "auto" => Ok(Self::Auto),
            "alpha" => Ok(Self::Alpha),
            "none" => Ok(Self::None),
            _ => {
                let colors = text.split(',').map(|text| color(text.trim()));
                colors.collect::<Option<_>>().map(Self::Colors).ok_or_else(|| Error::Options {
                    what: format!(
                        "{text} is neither auto, alpha, none nor a color like #ff00ff or several \
                         with commas between"
                    ),
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_background_is_read_as_it_is_typed() {
        let read = |text: &str| text.parse::<Background>();
        assert_eq!(read("auto").unwrap(), Background::Auto);
        assert_eq!(read("none").unwrap(), Background::None);
        assert_eq!(read("alpha").unwrap(), Background::Alpha);
        let colors = |colors: &[[f32; 4]]| Background::Colors(colors.to_vec());
        assert_eq!(read("#FF0033").unwrap(), colors(&[[1.0, 0.0, 0.2, 1.0]]));
        assert_eq!(read("#ff003300").unwrap(), colors(&[[1.0, 0.0, 0.2, 0.0]]));
        let both = colors(&[[0.0, 1.0, 0.0, 1.0], [1.0, 0.0, 1.0, 1.0]]);
        assert_eq!(read("#00ff00, #ff00ff").unwrap(), both);
        for text in [
            "",
            "#",
            "ff00ff",
            "#ff00f",
            "#ff00ff0",
            "#gg00ff",
            "#äöü",
            "#+1+1+1",
            "#ff00ff,",
            "auto,none",
        ] {
            assert!(read(text).is_err(), "{text}");
        }
    }
}
