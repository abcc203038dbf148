//! Samples of one material, shaded together: attribute by attribute in rows, so that a compiler turns each
//! step into vector instructions.

use glam::{Vec2, Vec3};
use seamwise_texture::{MANY, ManyTaps, Spots};

use super::coat::{BASE_COLOR, Coat, EMISSIVE, NORMAL, OCCLUSION, PACKED, Reading, TEXTURES};
use super::light::{Light, Surface, normalize_or, unit};
use super::patch::Patch;
use super::scene::Alpha;

/// Four numbers of each sample.
type Rows = [[f32; 4]; MANY];

/// The ways from the eye into the scene, on one scale.
#[derive(Clone, Copy)]
pub(super) struct Rays {
    /// To the middle of the image.
    pub(super) forward: Vec3,
    /// From there to the next sample to the right and down.
    pub(super) right: Vec3,
    /// See `right`.
    pub(super) down: Vec3,
}

/// Samples that are shaded together.
pub(super) struct Batch {
    count: usize,
    /// Columns and rows, in samples from the middle of the image.
    x: [f32; MANY],
    y: [f32; MANY],
    /// 1, or −1 where the eye sees a back.
    facing: [f32; MANY],
    /// The normal before the map, and the sign of the bitangent.
    normals: Rows,
    tangents: Rows,
    colors: Rows,
    uvs: Rows,
    /// One row per reading of the material.
    squares: [[f32; MANY]; TEXTURES],
    spots: Spots,
    taps: ManyTaps,
    /// One per texture.
    texels: [Rows; TEXTURES],
    /// Linear light held to 0…1, as a screen would, and alpha (1 where the material is not blended).
    shaded: Rows,
}

impl Batch {
    pub(super) const EMPTY: Self = Self {
        count: 0,
        x: [0.0; MANY],
        y: [0.0; MANY],
        facing: [0.0; MANY],
        normals: [[0.0; 4]; MANY],
        tangents: [[0.0; 4]; MANY],
        colors: [[0.0; 4]; MANY],
        uvs: [[0.0; 4]; MANY],
        squares: [[0.0; MANY]; TEXTURES],
        spots: Spots::ZERO,
        taps: ManyTaps::FIRST,
        texels: [[[0.0; 4]; MANY]; TEXTURES],
        shaded: [[0.0; 4]; MANY],
    };

    /// Leaves no sample.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a sample of a patch at a place in the image, in samples, whose middle is at `middle`; see
    /// [`Spots::squares`] for `squares`, one per reading. There must be fewer than [`MANY`].
    #[inline(always)]
    pub(super) fn add(&mut self, patch: &Patch, at: Vec2, middle: f32, squares: &[f32; TEXTURES]) {
        let (sample, point) = (self.count % MANY, patch.at(at));
        (self.x[sample], self.y[sample]) = (at.x - middle, at.y - middle);
        self.facing[sample] = if patch.front { 1.0 } else { -1.0 };
        self.normals[sample] = point.normal.to_array();
        self.tangents[sample] = point.tangent.to_array();
        self.colors[sample] = point.color.to_array();
        self.uvs[sample] = point.uvs.to_array();
        for (all, square) in self.squares.iter_mut().zip(squares) {
            all[sample] = *square;
        }
        self.count = sample + 1;
    }

    /// Shades the samples.
    #[inline(always)]
    pub(super) fn shade(&mut self, coat: &Coat<'_>, light: Light, rays: Rays) -> &[[f32; 4]] {
        self.read(coat);
        if coat.is_lit {
            self.reflect(coat, light, rays);
        } else {
            self.keep_base_color(coat);
        }
        if coat.material.alpha != Alpha::Blend {
            self.shaded.iter_mut().for_each(|color| color[3] = 1.0);
        }
        &self.shaded[..self.count.min(MANY)]
    }

    /// Reads the textures.
    #[inline(always)]
    fn read(&mut self, coat: &Coat<'_>) {
        for (at, reading) in coat.readings.iter().enumerate().take(TEXTURES) {
            self.spots.squares = self.squares[at];
            self.place(reading);
            reading.mips.taps_of_many(&self.spots, reading.wrap, &mut self.taps);
            for (texture, texels) in coat.textures.iter().zip(&mut self.texels) {
                if let Some(texture) = texture.filter(|texture| texture.reading == at) {
                    texture.mips.read_many(&self.taps, self.count, texels);
                }
            }
        }
        for (slot, texels) in self.texels.iter_mut().enumerate() {
            if coat.textures[slot].is_none() {
                // What changes nothing.
                texels.fill(if slot == NORMAL { [0.5, 0.5, 1.0, 1.0] } else { [1.0; 4] });
            }
        }
        if coat.occlusion_is_packed {
            self.texels[OCCLUSION] = self.texels[PACKED];
        }
    }

    /// Finds where the samples lie in an image.
    #[inline(always)]
    fn place(&mut self, reading: &Reading<'_>) {
        let [x, y] = [reading.transform.matrix2.x_axis, reading.transform.matrix2.y_axis];
        let offset = reading.transform.translation;
        let set = 2 * reading.uv_set.min(1);
        for sample in 0..MANY {
            let uvs = self.uvs[sample];
            let (u, v) = if set == 0 { (uvs[0], uvs[1]) } else { (uvs[2], uvs[3]) };
            self.spots.u[sample] = x.x * u + y.x * v + offset.x;
            self.spots.v[sample] = x.y * u + y.y * v + offset.y;
        }
    }

    /// Lights the samples.
    #[inline(always)]
    fn reflect(&mut self, coat: &Coat<'_>, light: Light, rays: Rays) {
        let material = coat.material;
        let (base, emissive) = (material.base_color.to_array(), material.emissive);
        let (roughness, metallic) = (material.roughness, material.metallic);
        let strength = material.occlusion_strength;
        let lean = if coat.textures[NORMAL].is_some() { material.normal_scale } else { 1.0 };
        let Self { x, y, facing, normals, tangents, colors, texels, shaded, .. } = self;
        for sample in 0..MANY {
            let texels = |slot: usize| texels[slot][sample];
            let (color, texel) = (colors[sample], texels(BASE_COLOR));
            let tinted = |channel: usize| base[channel] * color[channel] * texel[channel];
            let (normal, tangent) = (normals[sample], tangents[sample]);
            let smooth = Vec3::new(normal[0], normal[1], normal[2]);
            let tangent = Vec3::new(tangent[0], tangent[1], tangent[2]);
            let bitangent = smooth.cross(tangent) * normal[3];
            // Neither the normal nor the tangent is made unit before the map is applied, as MikkTSpace
            // asks.
            let [map_x, map_y, map_z, _] = texels(NORMAL);
            let mapped = tangent * (signed(map_x) * lean)
                + bitangent * (signed(map_y) * lean)
                + smooth * signed(map_z);
            let back = -(rays.forward + rays.right * x[sample] + rays.down * y[sample]);
            let to_eye = back * (1.0 / back.dot(back).sqrt());
            let (packed, glow) = (texels(PACKED), texels(EMISSIVE));
            let surface = Surface {
                base_color: Vec3::new(tinted(0), tinted(1), tinted(2)),
                metallic: unit(metallic * packed[2]),
                roughness: unit(roughness * packed[1]),
                occlusion: unit(1.0 + strength * (texels(OCCLUSION)[0] - 1.0)),
                // Turned for a back face (glTF 2.0 §3.9.6).
                normal: normalize_or(mapped * facing[sample], to_eye),
                to_eye,
            };
            let rgb = light.reflect(&surface) + emissive * Vec3::new(glow[0], glow[1], glow[2]);
            shaded[sample] = [unit(rgb.x), unit(rgb.y), unit(rgb.z), unit(tinted(3))];
        }
    }

    /// The base color alone.
    #[inline(always)]
    fn keep_base_color(&mut self, coat: &Coat<'_>) {
        let base = coat.material.base_color.to_array();
        for sample in 0..MANY {
            let (color, texel) = (self.colors[sample], self.texels[BASE_COLOR][sample]);
            let tinted = |channel: usize| unit(base[channel] * color[channel] * texel[channel]);
            self.shaded[sample] = [tinted(0), tinted(1), tinted(2), tinted(3)];
        }
    }
}

/// The component of a normal that a texel of 0…1 stands for.
#[inline(always)]
fn signed(texel: f32) -> f32 {
    texel * 2.0 - 1.0
}
