//! Options of a transfer of textures.

use super::encode::TextureFormat;
use super::sizes::Sizes;
use crate::image_file::codec::EncodeOptions;

/// The layout of levels' textures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Atlas {
    /// The source's layout; images whose layout tiles or overlaps stay shared.
    #[default]
    Keep,
    /// An atlas of their own, one for each set of images that the same triangles use.
    New,
    /// As `New`, with materials merged into one where an atlas holds all that they differ in.
    Merged,
}

/// Whether levels gain normal maps where their source has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BakeNormals {
    /// On materials where the shading normals of a level are off by more than half a degree.
    #[default]
    Auto,
    /// On every lit material.
    On,
    /// Nowhere.
    Off,
}

/// Options of a transfer of textures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferOptions {
    /// Whether each level has an image of its own only where that shows less error than the source's,
    /// all of them together of at most as many bytes as the source's textures.
    pub chooses: bool,
    /// Their layout.
    pub atlas: Atlas,
    /// Whether levels of surfaces that are laid out anew in whole are simplified without UVs, so that charts
    /// take no triangles from the shape, and unwrapped: in layouts of their own alone.
    pub unwraps: bool,
    /// The sizes of images.
    pub sizes: Sizes,
    /// Whether levels gain normal maps.
    pub bake_normals: BakeNormals,
    /// The format in which they are stored.
    pub format: TextureFormat,
    /// Quality of JPEGs and of WebPs with losses, 1…100.
    pub quality: u8,
    /// Whether the alpha of images that a `MASK` cuts out is scaled, so that as large a share of a
    /// level's texels passes the cutoff as of the source's; not in merged materials.
    pub keep_coverage: bool,
    /// Whether images are to be compressed in blocks of 4 × 4 texels of 16 bytes once they are made: their
    /// sides are multiples of four then, and a budget counts those bytes with mip maps instead of the files'.
    pub in_blocks: bool,
}

impl Default for TransferOptions {
    /// Sizes as needed, in the source's layout and formats.
    fn default() -> Self {
        Self {
            chooses: false,
            atlas: Atlas::default(),
            unwraps: false,
            sizes: Sizes::default(),
            bake_normals: BakeNormals::default(),
            format: TextureFormat::default(),
            quality: EncodeOptions::default().quality,
            keep_coverage: false,
            in_blocks: false,
        }
    }
}
