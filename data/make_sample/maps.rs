//! The three images of the atlas: every texel that a chart touches shows its point of the surface;
//! every other one shouts.

use glam::{DVec2, DVec3};
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageResult};
use rayon::prelude::*;

use crate::atlas::{Atlas, SIZE, Texel};
use crate::decor::{Decor, Spot};
use crate::model::Model;
use crate::paint::{finish, height};

/// Texels along an edge of the normal and the occlusion-roughness-metallic map.
const FINE_SIZE: usize = 512;
/// Quality of the occlusion-roughness-metallic JPEG.
const QUALITY: u8 = 90;

/// The encoded images.
pub(crate) struct Maps {
    /// PNG, sRGB.
    pub(crate) base_color: Vec<u8>,
    /// PNG, tangent space, green up.
    pub(crate) normal: Vec<u8>,
    /// JPEG: occlusion, roughness, metallic in red, green, blue.
    pub(crate) surface: Vec<u8>,
}

/// A mesh, its atlas and its decor, as the images are painted from them.
pub(crate) struct Painter<'a> {
    pub(crate) model: &'a Model,
    pub(crate) atlas: &'a Atlas,
    pub(crate) decor: &'a Decor,
    /// One per point of the model.
    pub(crate) hollows: &'a [f64],
}

impl Painter<'_> {
    /// Paints and encodes all images.
    ///
    /// # Errors
    /// What the encoders report.
    pub(crate) fn paint(&self) -> ImageResult<Maps> {
        let base = self.image(SIZE, |texel, at| match texel {
            Some(texel) => encode_srgb(finish(self.decor, &self.spot(&texel)).color),
            None if (at % SIZE / 16 + at / SIZE / 16).is_multiple_of(2) => [255, 0, 255],
            None => [0, 255, 0],
        });
        let normal = self.image(FINE_SIZE, |texel, _| {
            texel.map_or([0; 3], |texel| encode_linear(self.normal(&texel) * 0.5 + 0.5))
        });
        let surface = self.image(FINE_SIZE, |texel, _| {
            let Some(texel) = texel else { return [255, 0, 255] };
            let finish = finish(self.decor, &self.spot(&texel));
            encode_linear(DVec3::new(finish.occlusion, finish.roughness, finish.metallic))
        });
        let mut jpeg = vec![];
        let side = FINE_SIZE as u32;
        JpegEncoder::new_with_quality(&mut jpeg, QUALITY).write_image(
            &surface,
            side,
            side,
            ExtendedColorType::Rgb8,
        )?;
        Ok(Maps { base_color: png(&base, SIZE)?, normal: png(&normal, FINE_SIZE)?, surface: jpeg })
    }

    /// An RGB image: `color` of each texel and its index.
    fn image(
        &self,
        size: usize,
        color: impl Fn(Option<Texel>, usize) -> [u8; 3] + Sync,
    ) -> Vec<u8> {
        let texels = self.atlas.texels(size);
        texels.par_iter().enumerate().flat_map_iter(|(at, texel)| color(*texel, at)).collect()
    }

    /// The point of the surface that a texel shows.
    fn spot(&self, texel: &Texel) -> Spot {
        self.spot_at(texel.triangle, texel.weights)
    }

    fn spot_at(&self, triangle: usize, weights: DVec3) -> Spot {
        let triangle = &self.model.triangles[triangle];
        let [a, b, c] = triangle.corners;
        let number = |of: [f64; 3]| DVec3::from_array(of).dot(weights);
        let points = self.model.positions(triangle);
        Spot {
            position: points[0] * weights.x + points[1] * weights.y + points[2] * weights.z,
            part: triangle.part,
            along: number([a.along, b.along, c.along]),
            around: number([a.around, b.around, c.around]),
            hollow: number([a, b, c].map(|corner| self.hollows[corner.point])),
        }
    }

    /// The tangent-space normal at a texel of the fine maps: x along +u, y along −v (glTF 2.0
    /// §3.9.3), from differences of the height over half a texel to either side.
    fn normal(&self, texel: &Texel) -> DVec3 {
        let uvs = self.atlas.uvs[texel.triangle].map(|uv| uv * FINE_SIZE as f64);
        let whole = (uvs[1] - uvs[0]).perp_dot(uvs[2] - uvs[0]);
        // The change of the weights for a step of half a texel.
        let change = |step: DVec2| {
            let of = |from: usize, to: usize| step.perp_dot(uvs[to] - uvs[from]) / whole;
            DVec3::new(of(1, 2), of(2, 0), of(0, 1))
        };
        let slope = |step: DVec2| {
            let side =
                |sign: f64| self.spot_at(texel.triangle, texel.weights + change(step) * sign);
            let (ahead, behind) = (side(1.0), side(-1.0));
            let rise = height(self.decor, &ahead) - height(self.decor, &behind);
            rise / ahead.position.distance(behind.position)
        };
        let (x, y) = (slope(DVec2::new(0.5, 0.0)), slope(DVec2::new(0.0, -0.5)));
        DVec3::new(-x, -y, 1.0).normalize()
    }
}

/// Encodes linear light as sRGB bytes (IEC 61966-2-1).
fn encode_srgb(color: DVec3) -> [u8; 3] {
    let encode = |linear: f64| {
        let linear = linear.clamp(0.0, 1.0);
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
    };
    encode_linear(DVec3::from_array(color.to_array().map(encode)))
}

/// Bytes of values in 0…1.
fn encode_linear(values: DVec3) -> [u8; 3] {
    values.to_array().map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8)
}

fn png(pixels: &[u8], size: usize) -> ImageResult<Vec<u8>> {
    let mut bytes = vec![];
    let side = size as u32;
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive)
        .write_image(pixels, side, side, ExtendedColorType::Rgb8)?;
    Ok(bytes)
}
