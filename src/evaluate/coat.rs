//! A material, ready to be read: its textures, and the ways in which they are read.

use glam::{Affine2, Vec2, Vec3, Vec4};
use seamwise_texture::{Mips, Wrap};

use super::scene::{Material, Mode, TextureRef};

/// Textures of a material.
pub(super) const TEXTURES: usize = 5;

/// The places of the textures in [`Coat::textures`].
pub(super) const BASE_COLOR: usize = 0;
pub(super) const PACKED: usize = 1;
pub(super) const OCCLUSION: usize = 2;
pub(super) const NORMAL: usize = 3;
pub(super) const EMISSIVE: usize = 4;

/// A material, ready to be read.
pub(super) struct Coat<'a> {
    pub(super) material: &'a Material,
    pub(super) is_lit: bool,
    /// The ways in which its textures are read, each once.
    pub(super) readings: Vec<Reading<'a>>,
    /// Those that show.
    pub(super) textures: [Option<Texture<'a>>; TEXTURES],
    /// Whether the occlusion is read with roughness and metalness: the three are most often the channels
    /// of one image.
    pub(super) occlusion_is_packed: bool,
}

/// The sampling parameters of a texture, which decide the texels that are read at a point; textures
/// with equal ones share a reading.
#[derive(Clone, Copy)]
pub(super) struct Reading<'a> {
    pub(super) uv_set: usize,
    pub(super) wrap: [Wrap; 2],
    pub(super) transform: Affine2,
    /// An image of the size.
    pub(super) mips: &'a Mips,
}

#[derive(Clone, Copy)]
pub(super) struct Texture<'a> {
    pub(super) mips: &'a Mips,
    /// Its place among the readings of the material.
    pub(super) reading: usize,
}

impl<'a> Reading<'a> {
    fn of(texture: &'a TextureRef) -> Self {
        let TextureRef { uv_set, wrap, transform, ref mips } = *texture;
        Self { uv_set, wrap, transform, mips }
    }

    fn is_same(&self, other: &Self) -> bool {
        (self.uv_set, self.wrap, self.transform) == (other.uv_set, other.wrap, other.transform)
            && self.mips.size() == other.mips.size()
    }

    /// Those of both sets that are read.
    #[inline(always)]
    fn pick(&self, uvs: Vec4) -> Vec2 {
        match self.uv_set {
            0 => Vec2::new(uvs.x, uvs.y),
            1 => Vec2::new(uvs.z, uvs.w),
            _ => Vec2::ZERO,
        }
    }

    /// Where both UV sets lie in the image.
    #[inline(always)]
    pub(super) fn uv(&self, uvs: Vec4) -> Vec2 {
        self.transform.transform_point2(self.pick(uvs))
    }

    /// The change in the image for that of both UV sets.
    #[inline(always)]
    pub(super) fn step(&self, uvs: Vec4) -> Vec2 {
        self.transform.transform_vector2(self.pick(uvs))
    }
}

impl<'a> Coat<'a> {
    pub(super) fn new(material: &'a Material, mode: Mode) -> Self {
        let is_lit = mode == Mode::Lit && !material.unlit;
        let mut readings: Vec<Reading<'a>> = Vec::new();
        let mut texture = |of: &'a Option<TextureRef>, is_seen: bool| {
            let reading = Reading::of(of.as_ref().filter(|_| is_seen)?);
            let known = readings.iter().position(|known| known.is_same(&reading));
            let place = known.unwrap_or(readings.len());
            if known.is_none() {
                readings.push(reading);
            }
            Some(Texture { mips: reading.mips, reading: place })
        };
        let base_color = texture(&material.base_color_texture, true);
        let packed = texture(&material.metallic_roughness_texture, is_lit);
        let occlusion = texture(&material.occlusion_texture, is_lit);
        let normal = texture(&material.normal_texture, is_lit);
        let glows = is_lit && material.emissive != Vec3::ZERO;
        let emissive = texture(&material.emissive_texture, glows);
        let is_same = |a: &Texture<'_>, b: Texture<'_>| {
            std::ptr::eq(a.mips, b.mips) && a.reading == b.reading
        };
        let occlusion_is_packed = occlusion.zip(packed).is_some_and(|(a, b)| is_same(&a, b));
        let occlusion = occlusion.filter(|_| !occlusion_is_packed);
        let textures = [base_color, packed, occlusion, normal, emissive];
        Self { material, is_lit, readings, textures, occlusion_is_packed }
    }
}
