//! The layouts of levels' images and the UVs by which triangles read them: the values that a plan
//! is made of.

use glam::{Affine2, Vec4};
use seamwise_attr::Mesh;
use seamwise_texture::transfer::Face;
use seamwise_texture::{Role, Wrap};
use serde_json::Value;

use crate::document::material::TextureSlot;

/// Triangles of a group as they read an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ChartGroup {
    /// Index among the surfaces.
    pub(crate) surface: usize,
    /// Their group in it.
    pub(crate) group: u32,
    pub(crate) uv_set: usize,
    pub(crate) transform: Affine2,
}

impl ChartGroup {
    /// Whether a texture is read as they are.
    pub(crate) fn reads_like(&self, slot: &TextureSlot) -> bool {
        self.uv_set == slot.uv_set && self.transform == slot.transform
    }
}

/// Images that the same triangles of a level read at the same places.
#[derive(Clone, Debug)]
pub(crate) struct UvLayout {
    /// The triangles of the level that read them, and in which UVs.
    pub(crate) charts: Vec<ChartGroup>,
    pub(crate) wrap: [Wrap; 2],
    pub(crate) images: Vec<ImageUse>,
    /// Whether the level's charts are laid out anew.
    pub(crate) is_new: bool,
    /// The merged material, if there is one; it has images of its own.
    pub(crate) merge_group: Option<MergeGroup>,
}

impl UvLayout {
    /// The source's reading of the image that an entry of the charts uses, if it uses one.
    pub(crate) fn reading(&self, chart: usize) -> Option<SourceReading> {
        let images = self.images.iter().filter_map(|own| own.readings[chart]);
        let outputs = self.merge_group.iter().flat_map(|merge_group| &merge_group.outputs);
        let folded = outputs.filter_map(|own| Some(own.readings[chart].source?.1));
        images.chain(folded).next()
    }
}

/// An image of a layout.
#[derive(Clone, Debug)]
pub(crate) struct ImageUse {
    pub(crate) image: usize,
    /// The meaning of its texels.
    pub(crate) role: Role,
    /// One per entry of the layout's charts: how the source reads it, if those triangles use it.
    pub(crate) readings: Vec<Option<SourceReading>>,
}

/// The sampling of an image by triangles of the source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SourceReading {
    pub(crate) uv_set: usize,
    pub(crate) transform: Affine2,
    pub(crate) wrap: [Wrap; 2],
    /// Factor on x and y of a normal.
    pub(crate) normal_scale: f32,
}

/// The reason why an image is shared by all levels instead of made anew.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SharedReason {
    /// No material that a surface uses names it.
    #[error("no surface uses it")]
    Unused,
    /// Its file is not there.
    #[error("it is missing")]
    Missing,
    /// Points or lines use it, whose reads no chart bounds.
    #[error("points or lines use it")]
    BeyondCharts,
    /// The triangles that use it lack the UVs, or have more sets of them than levels are made of.
    #[error("what uses it has no UVs for it")]
    NoCharts,
    /// Charts without area use it: their UVs name colors.
    #[error("{:.1} % of what uses it has its colors in single texels or lines", .0 * 100.0)]
    Colors(f64),
    /// UVs repeat the image.
    #[error("its UVs tile")]
    Tiling,
    /// Texels are used in more than one place.
    #[error("{:.0} % of its texels are used in several places", .0 * 100.0)]
    Overlap(f64),
    /// The same triangles read it, or another image that they use too, in several ways.
    #[error("the same triangles read it, or another image with it, in several ways")]
    ConflictingUvs,
    /// Ids or properties are read in a texture by the UVs of the same triangles.
    #[error("ids in a texture need the UVs as they are")]
    Ids,
}

/// A normal map for materials that have none, in the layout of another of their images if they have one.
#[derive(Clone, Debug)]
pub(crate) struct NewNormals {
    pub(crate) charts: Vec<ChartGroup>,
    pub(crate) materials: Vec<usize>,
    /// The texture that it is read like; none where the source has no UVs.
    pub(crate) like: Option<TextureLike>,
}

/// A base color of materials without a texture, from the colors of vertices, which it replaces.
#[derive(Clone, Debug)]
pub(crate) struct NewColors {
    pub(crate) charts: Vec<ChartGroup>,
    pub(crate) materials: Vec<usize>,
    /// Three, or four with alpha.
    pub(crate) channels: usize,
}

/// A texture of the source whose layout and size another takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct TextureLike {
    /// JSON pointer of its texture info.
    pub(crate) at: String,
    pub(crate) image: usize,
}

/// The triangles of charts, those of each surface in `meshes`; a reading is an index of `charts`.
pub(crate) fn faces(charts: &[ChartGroup], meshes: &[&Mesh]) -> Vec<Face> {
    let of = |(reading, charts): (u32, &ChartGroup)| {
        let mesh = meshes[charts.surface];
        let own = (0..mesh.triangles.len()).filter(|&t| mesh.groups[t] == charts.group);
        let face = |triangle: usize| Face {
            pair: charts.surface as u32,
            triangle: triangle as u32,
            reading,
            uvs: mesh.triangles[triangle]
                .map(|wedge| charts.transform.transform_point2(mesh.uv(wedge, charts.uv_set))),
        };
        own.map(face).collect::<Vec<_>>()
    };
    (0..).zip(charts).flat_map(of).collect()
}

/// Materials that become one.
#[derive(Clone, Debug)]
pub(crate) struct MergeGroup {
    /// Their indices.
    pub(crate) materials: Vec<usize>,
    /// The one that stands for all, without its textures.
    pub(crate) json: Value,
    /// One per entry of the layout's charts: its material.
    pub(crate) chart_materials: Vec<usize>,
    pub(crate) outputs: Vec<BakedTexture>,
}

impl MergeGroup {
    /// The images that it is made from, each with what its texels mean.
    pub(crate) fn pictures(&self) -> Vec<(usize, Role)> {
        let mut pictures = Vec::new();
        for output in &self.outputs {
            for (image, _) in output.readings.iter().filter_map(|own| own.source) {
                if !pictures.contains(&(image, output.role)) {
                    pictures.push((image, output.role));
                }
            }
        }
        pictures
    }

    /// Whether an entry of the charts shows one of them.
    pub(crate) fn shows(&self, chart: usize, (image, role): (usize, Role)) -> bool {
        let is_shown = |own: &BakedTexture| {
            own.role == role && own.readings[chart].source.is_some_and(|own| own.0 == image)
        };
        self.outputs.iter().any(is_shown)
    }

    /// Whether it has a normal map, if it gains one or not.
    pub(crate) fn has_normals(&self, gains: bool) -> bool {
        self.outputs.iter().any(|own| own.role == Role::Normal && (gains || !own.is_gained))
    }
}

/// An image of a merged material.
#[derive(Clone, Debug)]
pub(crate) struct BakedTexture {
    /// The places in the material where it is a texture.
    pub(crate) places: Vec<&'static str>,
    pub(crate) role: Role,
    /// Number of channels that are used.
    pub(crate) channels: usize,
    /// One per entry of the layout's charts.
    pub(crate) readings: Vec<BakedReading>,
    /// Whether it is a normal map where no material had one, for the shape that a level has lost.
    pub(crate) is_gained: bool,
}

/// The source of an image's texels in an entry of the charts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BakedReading {
    /// The source's image and how it is read; white, or a flat normal, without one.
    pub(crate) source: Option<(usize, SourceReading)>,
    pub(crate) factor: Vec4,
    pub(crate) offset: Vec4,
}
