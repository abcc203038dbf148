//! Textures of a level, and what its primitives need for them.

use serde_json::Value;

use crate::image_file::encoded::EncodedImage;
use crate::surface::geometry::Geometry;

/// The textures of a level.
#[derive(Clone, Debug, Default)]
pub struct LevelTextures {
    /// One per image of the source.
    pub images: Vec<EncodedImage>,
    /// Base colors for materials that have no texture of one, in place of the colors of vertices.
    pub colors: Vec<ColorMap>,
    /// Normal maps for materials that have none.
    pub normals: Vec<NormalMap>,
    /// One entry per surface and part.
    pub parts: Vec<Vec<PartTextures>>,
    /// Materials whose textures are all read in the first UV set as it is.
    pub repacked: Vec<usize>,
    /// Materials that stand for several.
    pub merged: Vec<MergedMaterial>,
    /// Images of the source that only materials use that are merged.
    pub left: Vec<usize>,
}

impl LevelTextures {
    /// The source's textures, which all levels share.
    pub fn shared(images: &[EncodedImage], surfaces: &[Geometry]) -> Self {
        let plain = |surface: &Geometry| vec![PartTextures::default(); surface.parts.len()];
        let parts = surfaces.iter().map(plain).collect();
        Self { images: images.to_vec(), parts, ..Self::default() }
    }

    /// Bytes of all images as files.
    pub fn bytes(&self) -> usize {
        let own = self.images.iter().enumerate().filter(|(index, _)| !self.left.contains(index));
        let new = self.normals.iter().map(|normals| &normals.image);
        let new = new.chain(self.colors.iter().map(|colors| &colors.image));
        let bytes = own.map(|(_, image)| image).chain(new).map(|image| image.bytes.len());
        bytes.sum::<usize>() + self.merged.iter().map(MergedMaterial::bytes).sum::<usize>()
    }

    /// Whether a material is among those that are merged.
    pub(crate) fn is_merged(&self, material: usize) -> bool {
        self.merged.iter().any(|own| own.materials.contains(&material))
    }
}

/// A material that stands for several of the source.
#[derive(Clone, Debug)]
pub struct MergedMaterial {
    /// The materials that it stands for.
    pub materials: Vec<usize>,
    /// The material, without textures.
    pub json: Value,
    /// Its images, each with the places in the material where it is a texture, as
    /// `pbrMetallicRoughness/baseColorTexture`.
    pub images: Vec<(Vec<&'static str>, EncodedImage)>,
    /// Whether one of them is a normal map.
    pub has_normals: bool,
}

impl MergedMaterial {
    /// Bytes of its images as files.
    pub fn bytes(&self) -> usize {
        self.images.iter().map(|(_, image)| image.bytes.len()).sum()
    }
}

/// The needs of a part for the textures of a level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PartTextures {
    /// The UV set by whose tangents its normal map is read, if one was made for the level.
    pub tangents: Option<usize>,
    /// Whether all of its textures are read in the first UV set, so that it needs no other.
    pub is_repacked: bool,
    /// Parts of a mesh with the same number become one primitive.
    pub join: Option<usize>,
}

/// A base color for materials that have no texture of one.
#[derive(Clone, Debug)]
pub struct ColorMap {
    /// The image.
    pub image: EncodedImage,
    /// The materials.
    pub materials: Vec<usize>,
}

/// A normal map for materials that have none.
#[derive(Clone, Debug)]
pub struct NormalMap {
    /// The image.
    pub image: EncodedImage,
    /// The materials.
    pub materials: Vec<usize>,
    /// JSON pointer of the texture info that it is read like; none if the source has no UVs.
    pub like: Option<String>,
}
