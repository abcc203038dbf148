//! The color of points of the scene: attributes interpolated, textures read, material lit.
//!
//! Textures are trilinear and isotropic, their level of detail from the change of the UV over one
//! *pixel* of the image, not over one sample: what supersampling would hide, a mip map that bleeds
//! over a seam, shows as on a screen that does not supersample.

use glam::Vec2;
use seamwise_texture::MANY;

use super::batch::{Batch, Rays};
use super::coat::{BASE_COLOR, Coat, TEXTURES};
use super::light::Light;
use super::patch::Patch;
use super::raster::{Facet, SAMPLES, View};
use super::scene::{Material, Mode, Scene};

/// Samples of a pixel.
pub(super) const COUNT: usize = SAMPLES * SAMPLES;

/// Colors the points that one view sees.
pub(super) struct Shader<'a> {
    view: &'a View<'a>,
    light: Light,
    rays: Rays,
    /// One per material of the scene.
    coats: Vec<Coat<'a>>,
}

/// A sample that is shaded: of a patch, in a slot of a pixel by its column and row.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    pub(super) patch: u32,
    pub(super) material: u32,
    pub(super) pixel: [u32; 2],
    pub(super) slot: u32,
}

impl<'a> Shader<'a> {
    pub(super) fn new(view: &'a View<'a>, mode: Mode) -> Self {
        let coats = view.scene.materials.iter().map(|material| Coat::new(material, mode)).collect();
        let camera = view.camera;
        let sample = 2.0 * camera.half_width / view.size() as f64;
        let rays = Rays {
            forward: camera.forward.as_vec3(),
            right: (camera.right * sample).as_vec3(),
            down: (camera.up * -sample).as_vec3(),
        };
        Self { view, light: Light::of(camera), rays, coats }
    }

    /// How far a step of a pixel goes in each image that a patch is read from, squared, around a place in
    /// the image, in samples.
    #[inline(always)]
    fn squares(coat: &Coat<'_>, patch: &Patch, at: Vec2) -> [f32; TEXTURES] {
        let mut squares = [0.0; TEXTURES];
        if !coat.readings.is_empty() {
            let [right, down] = patch.uv_steps(at);
            for (square, reading) in squares.iter_mut().zip(&coat.readings) {
                *square = reading.mips.square(reading.step(right), reading.step(down));
            }
        }
        squares
    }

    /// The alpha of a triangle at a sample, by its column and row.
    pub(super) fn alpha(&self, facet: &Facet, sample: [usize; 2]) -> f32 {
        let patch = Patch::new(self.view, facet, sample);
        let Some(coat) = self.coats.get(patch.material as usize) else { return 0.0 };
        let at = Vec2::new(sample[0] as f32 + 0.5, sample[1] as f32 + 0.5);
        let point = patch.at(at);
        let alpha = coat.material.base_color.w * point.color.w;
        let Some(texture) = coat.textures[BASE_COLOR] else { return alpha };
        let reading = &coat.readings[texture.reading];
        let lod = 0.5 * Self::squares(coat, &patch, at)[texture.reading].log2();
        alpha * texture.mips.sample(reading.uv(point.uvs), reading.wrap, lod)[3]
    }

    /// Shades samples of one material, and hands each color on: linear light held to 0…1 and alpha.
    #[inline(always)]
    pub(super) fn shade(
        &self,
        patches: &[Patch],
        spots: &[Spot],
        batch: &mut Batch,
        mut color: impl FnMut(&Spot, [f32; 4]),
    ) {
        let middle = self.view.size() as f32 * 0.5;
        let Some(coat) = spots.first().and_then(|spot| self.coats.get(spot.material as usize))
        else {
            return;
        };
        for spots in spots.chunks(MANY) {
            batch.clear();
            for same in spots.chunk_by(|a, b| (a.patch, a.pixel) == (b.patch, b.pixel)) {
                let (patch, pixel) = (&patches[same[0].patch as usize], same[0].pixel);
                let [x, y] = pixel;
                let center =
                    Vec2::new((x * SAMPLES as u32 + 1) as f32, (y * SAMPLES as u32 + 1) as f32);
                let squares = Self::squares(coat, patch, center);
                for spot in same {
                    let off = Vec2::new((spot.slot % 2) as f32, (spot.slot / 2) as f32) - 0.5;
                    batch.add(patch, center + off, middle, &squares);
                }
            }
            let colors = batch.shade(coat, self.light, self.rays);
            spots.iter().zip(colors).for_each(|(spot, own)| color(spot, *own));
        }
    }
}

/// The material a triangle uses; nothing if the scene names none.
pub(super) fn material_of(scene: &Scene, triangle: usize) -> Option<&Material> {
    scene.materials.get(*scene.triangle_materials.get(triangle)? as usize)
}
