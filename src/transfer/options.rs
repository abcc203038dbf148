//! How textures are made anew.

use super::encode::TextureFormat;
use super::sizes::Sizes;
use crate::image_file::codec::EncodeOptions;

/// Where the textures of levels are laid out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Atlas {
    /// Where the source's are; images whose layout tiles or overlaps stay shared.
    #[default]
    Keep,
    /// In an atlas of their own, one for each set of images that the same triangles use.
    New,
    /// The same, with materials merged into one where an atlas holds all that they differ in.
    Merged,
}

/// Whether levels gain normal maps where their source has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BakeNormals {
    /// Where the shading normals of a level are off by more than a degree.
    #[default]
    Auto,
    /// On every lit material.
    On,
    /// Nowhere.
    Off,
}

/// How textures are made anew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferOptions {
    /// Where they are laid out.
    pub atlas: Atlas,
    /// How large the images are.
    pub sizes: Sizes,
    /// Whether levels gain normal maps.
    pub bake_normals: BakeNormals,
    /// How they are stored.
    pub format: TextureFormat,
    /// Quality of JPEGs, 1…100.
    pub quality: u8,
}

impl Default for TransferOptions {
    /// As large as needed, where the source's are and in its formats.
    fn default() -> Self {
        Self {
            atlas: Atlas::default(),
            sizes: Sizes::default(),
            bake_normals: BakeNormals::default(),
            format: TextureFormat::default(),
            quality: EncodeOptions::default().quality,
        }
    }
}
