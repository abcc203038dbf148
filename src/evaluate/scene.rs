//! The scene that is evaluated: a file's default scene, flattened to world space.

use std::borrow::Cow;
use std::sync::Arc;

use glam::{Affine2, DVec3, Vec2, Vec3, Vec4};
use seamwise_texture::{Mips, Wrap};
use serde::Serialize;

/// Triangles of a whole scene in world space, with the materials they use.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Where `positions` are counted from, in metres of the world: 0, but near the scene if that is so far
    /// away that floats would lose it.
    pub origin: DVec3,
    /// One per vertex, in metres.
    pub positions: Vec<Vec3>,
    /// One per vertex: unit shading normal.
    pub normals: Vec<Vec3>,
    /// UV sets 0 and 1; one UV per vertex, zero where the file has none.
    pub uvs: [Vec<Vec2>; 2],
    /// One per vertex: `COLOR_0` in linear light, white where the file has none.
    pub colors: Vec<Vec4>,
    /// Vertex indices, counter-clockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// One per triangle: the tangent at each corner, with the bitangent's sign in `w`
    /// (glTF 2.0 §3.7.2.1). Zero where the material has no normal map.
    pub tangents: Vec<[Vec4; 3]>,
    /// One per triangle: index into `materials`.
    pub triangle_materials: Vec<u32>,
    /// One per triangle: index of its mesh in the document.
    pub triangle_meshes: Vec<u32>,
    /// The materials; the last is the default material of glTF.
    pub materials: Vec<Material>,
}

impl Scene {
    /// The scene with positions that are counted from another place.
    pub(crate) fn counted_from(&self, origin: DVec3) -> Cow<'_, Self> {
        if origin == self.origin {
            return Cow::Borrowed(self);
        }
        let shift = self.origin - origin;
        let mut moved = Self { origin, ..self.clone() };
        for position in &mut moved.positions {
            *position = (position.as_dvec3() + shift).as_vec3();
        }
        Cow::Owned(moved)
    }
}

/// A glTF metallic-roughness material (glTF 2.0 §3.9).
#[derive(Clone, Debug)]
pub struct Material {
    /// Linear factor on the base color texture.
    pub base_color: Vec4,
    /// sRGB in the file, linear RGBA here.
    pub base_color_texture: Option<TextureRef>,
    /// Factor on the blue channel of `metallic_roughness_texture`.
    pub metallic: f32,
    /// Factor on its green channel.
    pub roughness: f32,
    /// Linear.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Tangent-space normals, 0…1 as stored.
    pub normal_texture: Option<TextureRef>,
    /// Factor on x and y of the mapped normal.
    pub normal_scale: f32,
    /// Red channel; linear.
    pub occlusion_texture: Option<TextureRef>,
    /// How much of the occlusion applies, 0…1.
    pub occlusion_strength: f32,
    /// Linear factor on `emissive_texture`.
    pub emissive: Vec3,
    /// sRGB in the file, linear here.
    pub emissive_texture: Option<TextureRef>,
    /// Alpha mode: how the base color's alpha is used.
    pub alpha: Alpha,
    /// Whether back faces are seen.
    pub double_sided: bool,
    /// `KHR_materials_unlit`.
    pub unlit: bool,
}

impl Default for Material {
    /// The material of primitives that have none (glTF 2.0 §3.9.6).
    fn default() -> Self {
        Self {
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha: Alpha::Opaque,
            double_sided: false,
            unlit: false,
        }
    }
}

/// The alpha mode of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// Ignored.
    Opaque,
    /// Seen where alpha is at least the cutoff.
    Mask(f32),
    /// Blended over what lies behind.
    Blend,
}

/// A texture as a material uses it.
#[derive(Clone, Debug)]
pub struct TextureRef {
    /// The image and its mip maps, four channels.
    pub mips: Arc<Mips>,
    /// How UVs outside 0…1 are read, for u and v.
    pub wrap: [Wrap; 2],
    /// Which of [`Scene::uvs`] is read.
    pub uv_set: usize,
    /// `KHR_texture_transform`, the identity where absent.
    pub transform: Affine2,
}

/// How surfaces are colored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// By their material under the fixed light.
    #[default]
    Lit,
    /// Base color alone: factor, texture and `COLOR_0`.
    Unlit,
}
