//! The color of points of the scene: attributes interpolated, textures read, material lit.
//!
//! Textures are trilinear and isotropic, their level of detail from the change of the UV over one
//! *pixel* of the image, not over one sample: what supersampling would hide, a mip map that bleeds
//! over a seam, shows as on a screen that does not supersample.
//!
//! Each sample has its attributes and texels found on its own; the four of a pixel are lit together,
//! whatever they see.

use glam::{Affine2, BVec4A, Vec2, Vec3, Vec4};
use seamwise_texture::{Mips, Taps, Wrap};

use super::lanes::{Lanes, unit};
use super::light::{Light, Surface};
use super::patch::{Patch, Point};
use super::raster::{Facet, SAMPLES, View};
use super::scene::{Alpha, Material, Mode, Scene, TextureRef};

/// Samples of a pixel.
pub(super) const COUNT: usize = SAMPLES * SAMPLES;

/// Textures of a material.
const TEXTURES: usize = 5;

/// Colors the points that one view sees.
pub(super) struct Shader<'a> {
    view: &'a View<'a>,
    light: Light,
    /// From the eye to a sample at the middle of the image, and the way to the next sample to the right
    /// and down; on one scale.
    forward: Lanes,
    right: Lanes,
    down: Lanes,
    /// One per material of the scene.
    coats: Vec<Coat<'a>>,
}

/// A material, ready to be read.
struct Coat<'a> {
    material: &'a Material,
    is_lit: bool,
    /// The ways in which its textures are read, each once.
    readings: Vec<Reading<'a>>,
    base_color: Option<Texture<'a>>,
    packed: Option<Texture<'a>>,
    occlusion: Option<Texture<'a>>,
    normal: Option<Texture<'a>>,
    emissive: Option<Texture<'a>>,
}

/// The sampling parameters of a texture, which decide the texels that are read at a point; textures
/// with equal ones share a reading.
#[derive(Clone, Copy)]
struct Reading<'a> {
    uv_set: usize,
    wrap: [Wrap; 2],
    transform: Affine2,
    /// An image of the size.
    mips: &'a Mips,
}

struct Texture<'a> {
    mips: &'a Mips,
    /// Its place among the readings of the material.
    reading: usize,
}

/// The samples of a pixel, ready to be lit: their rows are written one by one.
pub(super) struct Points {
    /// Base color and alpha.
    base: [Vec4; COUNT],
    /// Occlusion, roughness, metalness; and 1, or −1 where the eye sees a back.
    packed: [Vec4; COUNT],
    /// The normal before the map, and the sign of the bitangent.
    normal: [Vec4; COUNT],
    tangent: [Vec4; COUNT],
    /// The parts of tangent, bitangent and normal that make the mapped normal; and 1 where the point
    /// is lit.
    map: [Vec4; COUNT],
    emissive: [Vec4; COUNT],
    /// Taps of the texture read last: scratch space.
    taps: Taps,
}

/// The levels of detail at which a patch is read in a pixel, one per reading.
#[derive(Default)]
pub(super) struct Detail([f32; TEXTURES]);

impl<'a> Shader<'a> {
    pub(super) fn new(view: &'a View<'a>, mode: Mode) -> Self {
        let coats = view.scene.materials.iter().map(|material| Coat::new(material, mode)).collect();
        let camera = view.camera;
        let sample = 2.0 * camera.half_width / view.size() as f64;
        Self {
            view,
            light: Light::of(camera),
            forward: Lanes::splat(camera.forward.as_vec3()),
            right: Lanes::splat((camera.right * sample).as_vec3()),
            down: Lanes::splat((camera.up * -sample).as_vec3()),
            coats,
        }
    }

    fn coat(&self, patch: &Patch) -> Option<&Coat<'a>> {
        self.coats.get(patch.material)
    }

    /// Finds the levels of detail at a place in the image, in samples.
    #[inline]
    pub(super) fn find_detail(&self, patch: &Patch, at: Vec2, detail: &mut Detail) {
        let Some(coat) = self.coat(patch).filter(|coat| !coat.readings.is_empty()) else { return };
        let steps = patch.uv_steps(at);
        for (level, reading) in detail.0.iter_mut().zip(&coat.readings) {
            *level = reading.lod(steps);
        }
    }

    /// The alpha of a triangle at a sample, by its column and row.
    pub(super) fn alpha(&self, facet: &Facet, sample: [usize; 2]) -> f32 {
        let patch = Patch::new(self.view, facet, sample);
        let Some(coat) = self.coat(&patch) else { return 0.0 };
        let at = Vec2::new(sample[0] as f32 + 0.5, sample[1] as f32 + 0.5);
        let (point, mut detail) = (patch.at(at), Detail::default());
        self.find_detail(&patch, at, &mut detail);
        let mut taps = Taps::FIRST;
        let mut reader =
            Reader { coat, detail: &detail, uvs: point.uvs, taps: &mut taps, last: None };
        coat.base_color(&point, &mut reader).w
    }

    /// Writes the sample in `slot` of a pixel: a patch at a place in the image, in samples.
    #[inline]
    pub(super) fn prepare(
        &self,
        points: &mut Points,
        slot: usize,
        patch: &Patch,
        detail: &Detail,
        at: Vec2,
    ) {
        let Some(coat) = self.coat(patch) else {
            points.base[slot] = Vec4::ZERO;
            return;
        };
        let point = patch.at(at);
        let taps = &mut points.taps;
        let mut reader = Reader { coat, detail, uvs: point.uvs, taps, last: None };
        let base_color = coat.base_color(&point, &mut reader);
        let is_blended = coat.material.alpha == Alpha::Blend;
        points.base[slot] = if is_blended { base_color } else { base_color.with_w(1.0) };
        let facing = if patch.front { 1.0 } else { -1.0 };
        points.packed[slot] = coat.packed(&mut reader).extend(facing);
        points.normal[slot] = point.normal;
        points.tangent[slot] = point.tangent;
        points.map[slot] = coat.map(&mut reader).extend(f32::from(coat.is_lit));
        points.emissive[slot] = coat.emissive(&mut reader).extend(0.0);
    }

    /// The colors of the samples of a pixel, by its column and row: linear light held to 0…1, as a
    /// screen would, and alpha (1 where the material is not blended).
    #[inline]
    pub(super) fn light(&self, points: &Points, [x, y]: [usize; 2]) -> (Lanes, Vec4) {
        let (base_color, alpha) = Lanes::of(points.base);
        let (packed, facing) = Lanes::of(points.packed);
        let (smooth, sign) = Lanes::of(points.normal);
        let (tangent, _) = Lanes::of(points.tangent);
        let (map, lit) = Lanes::of(points.map);
        let (emissive, _) = Lanes::of(points.emissive);
        let to_eye = self.to_eye([x, y]);
        let bitangent = smooth.cross(tangent) * sign;
        let mapped = tangent * map.x + bitangent * map.y + smooth * map.z;
        let surface = Surface {
            base_color,
            metallic: unit(packed.z),
            roughness: unit(packed.y),
            occlusion: unit(packed.x),
            // Turned for a back face (glTF 2.0 §3.9.6).
            normal: (mapped * facing).normalize_or(to_eye),
            to_eye,
        };
        let is_lit: BVec4A = lit.cmpgt(Vec4::ZERO);
        let rgb = Lanes::select(is_lit, self.light.reflect(&surface) + emissive, base_color);
        (rgb.map(unit), unit(alpha))
    }

    /// Unit vectors to the eye from what the samples of a pixel see.
    #[inline]
    fn to_eye(&self, [x, y]: [usize; 2]) -> Lanes {
        let middle = self.view.size() as f32 * 0.5;
        let across = Vec4::new(0.5, 1.5, 0.5, 1.5) + ((x * SAMPLES) as f32 - middle);
        let down = Vec4::new(0.5, 0.5, 1.5, 1.5) + ((y * SAMPLES) as f32 - middle);
        let back = -(self.forward + self.right * across + self.down * down);
        back * back.dot(back).sqrt().recip()
    }
}

impl Points {
    /// Samples that see nothing.
    pub(super) const NOTHING: Self = Self {
        base: [Vec4::ZERO; COUNT],
        packed: [Vec4::ZERO; COUNT],
        normal: [Vec4::ZERO; COUNT],
        tangent: [Vec4::ZERO; COUNT],
        map: [Vec4::ZERO; COUNT],
        emissive: [Vec4::ZERO; COUNT],
        taps: Taps::FIRST,
    };
}

/// The material a triangle uses; nothing if the scene names none.
pub(super) fn material_of(scene: &Scene, triangle: usize) -> Option<&Material> {
    scene.materials.get(*scene.triangle_materials.get(triangle)? as usize)
}

/// Reads the textures of a material at one point.
struct Reader<'a> {
    coat: &'a Coat<'a>,
    detail: &'a Detail,
    uvs: Vec4,
    /// Taps of the last reading, and the index of that reading in `coat.readings`.
    taps: &'a mut Taps,
    last: Option<usize>,
}

impl Reader<'_> {
    #[inline]
    fn read(&mut self, texture: &Texture<'_>) -> Vec4 {
        if self.last != Some(texture.reading) {
            let lod = self.detail.0[texture.reading];
            *self.taps = self.coat.readings[texture.reading].taps(self.uvs, lod);
            self.last = Some(texture.reading);
        }
        texture.mips.read(self.taps)
    }
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
    #[inline]
    fn pick(&self, uvs: Vec4) -> Vec2 {
        match self.uv_set {
            0 => Vec2::new(uvs.x, uvs.y),
            1 => Vec2::new(uvs.z, uvs.w),
            _ => Vec2::ZERO,
        }
    }

    /// The level of detail for the change of both UV sets from pixel to pixel.
    fn lod(&self, steps: [Vec4; 2]) -> f32 {
        let step = |uvs: Vec4| self.transform.transform_vector2(self.pick(uvs));
        self.mips.lod(step(steps[0]), step(steps[1]))
    }

    #[inline]
    fn taps(&self, uvs: Vec4, lod: f32) -> Taps {
        let uv = self.transform.transform_point2(self.pick(uvs));
        self.mips.taps(uv, self.wrap, lod)
    }
}

impl<'a> Coat<'a> {
    fn new(material: &'a Material, mode: Mode) -> Self {
        let mut readings: Vec<Reading<'a>> = Vec::new();
        let mut texture = |of: &'a Option<TextureRef>| {
            let reading = Reading::of(of.as_ref()?);
            let known = readings.iter().position(|known| known.is_same(&reading));
            let place = known.unwrap_or(readings.len());
            if known.is_none() {
                readings.push(reading);
            }
            Some(Texture { mips: reading.mips, reading: place })
        };
        Self {
            material,
            is_lit: mode == Mode::Lit && !material.unlit,
            base_color: texture(&material.base_color_texture),
            packed: texture(&material.metallic_roughness_texture),
            occlusion: texture(&material.occlusion_texture),
            normal: texture(&material.normal_texture),
            emissive: texture(&material.emissive_texture),
            readings,
        }
    }

    #[inline]
    fn base_color(&self, point: &Point, reader: &mut Reader<'_>) -> Vec4 {
        let color = self.material.base_color * point.color;
        self.base_color.as_ref().map_or(color, |texture| color * reader.read(texture))
    }

    /// Occlusion, roughness and metalness.
    #[inline]
    fn packed(&self, reader: &mut Reader<'_>) -> Vec3 {
        let material = self.material;
        let packed = self.packed.as_ref().map_or(Vec4::ONE, |texture| reader.read(texture));
        let occlusion = match (&self.occlusion, &self.packed) {
            (None, _) => 1.0,
            // The three are most often the channels of one image.
            (Some(texture), Some(packed_texture)) if texture.is_same(packed_texture) => packed.x,
            (Some(texture), _) => reader.read(texture).x,
        };
        let occlusion = 1.0 + material.occlusion_strength * (occlusion - 1.0);
        Vec3::new(occlusion, material.roughness * packed.y, material.metallic * packed.z)
    }

    /// The normal that the map says, as parts of the tangent, the bitangent and the smooth normal.
    /// Neither that nor the tangent is made unit before the map is applied, as MikkTSpace asks.
    #[inline]
    fn map(&self, reader: &mut Reader<'_>) -> Vec3 {
        let Some(texture) = &self.normal else { return Vec3::Z };
        let lean = self.material.normal_scale;
        (reader.read(texture).truncate() * 2.0 - 1.0) * Vec3::new(lean, lean, 1.0)
    }

    #[inline]
    fn emissive(&self, reader: &mut Reader<'_>) -> Vec3 {
        let emissive = self.material.emissive;
        match &self.emissive {
            Some(texture) if emissive != Vec3::ZERO => emissive * reader.read(texture).truncate(),
            _ => emissive,
        }
    }
}

impl Texture<'_> {
    fn is_same(&self, other: &Self) -> bool {
        std::ptr::eq(self.mips, other.mips) && self.reading == other.reading
    }
}
