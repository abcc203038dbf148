//! A source's image, to be sampled for the texels of a level.
//!
//! Where a texel is about as large as the source's, the image is read by the interpolating cubic of
//! Catmull & Rom ("A class of local interpolating splines", 1974; Keys, "Cubic convolution
//! interpolation for digital image processing", 1981, with a = −½): at a texel's center it is that
//! texel, and between them it keeps more of the contrast than a bilinear tap does, which would blur a
//! texture every time that it is sampled anew. Where a texel is larger, mip maps are read.
//!
//! Colors are weighed by their alpha, where an image has one, so that what nobody sees lends no color
//! to what is seen.

use glam::{Vec2, Vec4};
use image::DynamicImage;

use crate::error::Result;
use crate::many::floor;
use crate::mips::{ColorEncoding, MipLevel, Mips};
use crate::plane::Plane;
use crate::role::Role;
use crate::samples::{Coding, Group, Sample, with_buffer};
use crate::wrap::Wrap;

/// From this level of detail on mip maps are read.
const MINIFIED: f32 = 0.5;

/// An image of a source, ready to be read.
#[derive(Clone, Debug)]
pub struct Picture {
    mips: Mips,
    /// Whether colors are weighed by alpha.
    has_alpha: bool,
}

impl Picture {
    /// Prepares an image: its texels should all be valid, as charts are read up to their rims.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if it is empty or of a kind that
    /// [`repair`](fn@crate::repair) does not know.
    pub fn new(image: &DynamicImage, role: Role) -> Result<Self> {
        Self::of(image, role, Mips::from_rgba8)
    }

    /// Prepares an image to be read from near by alone, as [`errors`](fn@super::errors) does: without mip
    /// maps.
    ///
    /// # Errors
    /// As [`Picture::new`].
    pub fn without_mips(image: &DynamicImage, role: Role) -> Result<Self> {
        Self::of(image, role, Mips::largest_of_rgba8)
    }

    fn of(
        image: &DynamicImage,
        role: Role,
        of_bytes: impl Fn(usize, usize, &[u8], ColorEncoding) -> Result<Mips>,
    ) -> Result<Self> {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let mips = if image.color().bytes_per_pixel() / image.color().channel_count() == 1 {
            let encoding =
                if role == Role::Color { ColorEncoding::Srgb } else { ColorEncoding::Linear };
            of_bytes(width, height, image.to_rgba8().as_raw(), encoding)?
        } else {
            Mips::from_plane(&plane(image, role)?)?
        };
        let seen = || image.to_rgba8().pixels().all(|texel| texel.0[3] == u8::MAX);
        let has_alpha = role == Role::Color && image.color().has_alpha() && !seen();
        Ok(Self { mips, has_alpha })
    }

    /// The error of each halving of the image: the mean of the squared differences between its
    /// texels and their mean in the next mip level, summed over color channels.
    pub fn details(&self) -> Vec<f64> {
        let square = |level: usize| {
            let level = self.mips.level(level);
            let texels = (0..level.height()).flat_map(|y| (0..level.width()).map(move |x| [x, y]));
            let sum: f64 = texels
                .map(|[x, y]| {
                    f64::from(Vec4::from_array(level.texel(x, y)).truncate().length_squared())
                })
                .sum();
            sum / (level.width() * level.height()) as f64
        };
        let squares: Vec<f64> = (0..self.mips.levels()).map(square).collect();
        squares.windows(2).map(|pair| (pair[0] - pair[1]).max(0.0)).collect()
    }

    /// Width and height in texels.
    pub fn size(&self) -> Vec2 {
        let level = self.mips.level(0);
        Vec2::new(level.width() as f32, level.height() as f32)
    }

    /// The color at a UV as a renderer reads it from near by, decoded.
    pub(super) fn near(&self, uv: Vec2, wrap: [Wrap; 2]) -> Vec4 {
        Vec4::from_array(self.mips.sample_bilinear(0, uv, wrap))
    }

    /// The color at a UV, decoded: linear light, or the numbers as they are stored.
    #[inline]
    pub(super) fn read(&self, uv: Vec2, wrap: [Wrap; 2], lod: f32) -> Vec4 {
        if lod >= MINIFIED {
            return Vec4::from_array(self.mips.sample(uv, wrap, lod));
        }
        let level = self.mips.level(0);
        let axes =
            [Axis::new(uv.x, level.width(), wrap[0]), Axis::new(uv.y, level.height(), wrap[1])];
        let read = match (axes[0].inside(), axes[1].inside()) {
            (Some(left), Some(top)) if !self.has_alpha => {
                let ([a, b, c, d], rows) = (axes[0].weights, axes[1].weights);
                let mut sum = Vec4::ZERO;
                for (row, v) in rows.into_iter().enumerate() {
                    sum = level.add_four(left, top + row, [a * v, b * v, c * v, d * v], sum);
                }
                sum
            }
            _ => self.cubic(level, axes[0].taps(), axes[1].taps()),
        };
        read.clamp(Vec4::ZERO, Vec4::ONE)
    }

    fn cubic(&self, level: &MipLevel, columns: [(usize, f32); 4], rows: [(usize, f32); 4]) -> Vec4 {
        let (mut sum, mut seen) = (Vec4::ZERO, Vec4::ZERO);
        for (y, v) in rows {
            for (x, u) in columns {
                if u * v != 0.0 {
                    let texel = Vec4::from_array(level.texel(x, y)) * (u * v);
                    sum += texel;
                    if self.has_alpha {
                        seen += (texel * level.texel(x, y)[3]).truncate().extend(texel.w);
                    }
                }
            }
        }
        if self.has_alpha && seen.w > 1e-3 {
            return (seen.truncate() / seen.w).extend(sum.w);
        }
        sum
    }
}

/// The four texels of an axis that a cubic at a coordinate reads, and their weights.
#[derive(Clone, Copy)]
struct Axis {
    /// The second of the texels, before it is wrapped.
    second: f32,
    size: usize,
    wrap: Wrap,
    weights: [f32; 4],
}

impl Axis {
    #[inline(always)]
    fn new(u: f32, size: usize, wrap: Wrap) -> Self {
        // One period first, as it keeps fractions of a texel far from the origin.
        let u = if wrap == Wrap::Repeat { u - floor(u) } else { u };
        let at = u * size as f32 - 0.5;
        let at = if at.is_finite() { at } else { -0.5 };
        let second = floor(at);
        Self { second, size, wrap, weights: weights(at - second) }
    }

    /// The first texel, if none lies beyond the edges and each has a weight.
    #[inline(always)]
    fn inside(&self) -> Option<usize> {
        let is_inside = self.second >= 1.0 && self.second < self.size as f32 - 2.0;
        (is_inside && self.weights[0] != 0.0 && self.weights[3] != 0.0)
            .then(|| self.second as usize - 1)
    }

    /// All of them.
    fn taps(&self) -> [(usize, f32); 4] {
        let first = self.second as i64 - 1;
        let texel = |tap: usize| match self.weights[tap] == 0.0 {
            true => 0,
            false => self.wrap.texel(first + tap as i64, self.size),
        };
        let [a, b, c, d] = self.weights;
        [(texel(0), a), (texel(1), b), (texel(2), c), (texel(3), d)]
    }
}

/// Weights of the texels at −1, 0, 1 and 2 for a place at `t` in 0…1.
#[inline(always)]
fn weights(t: f32) -> [f32; 4] {
    // What is a texel's center but for rounding is that texel.
    let t = if t < 1e-3 {
        0.0
    } else if t > 1.0 - 1e-3 {
        1.0
    } else {
        t
    };
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}

/// An image of more than eight bits as four channels of floats.
fn plane(image: &DynamicImage, role: Role) -> Result<Plane> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let stride = image.color().channel_count() as usize;
    let data = with_buffer!(image, buffer => widen(buffer.as_raw(), stride, role))?;
    Ok(Plane::from_vec(width, height, 4, data))
}

fn widen<S: Sample>(samples: &[S], stride: usize, role: Role) -> Vec<f32> {
    // A vector is read as it is stored, 0…1.
    let coding = if role == Role::Color { Coding::Light } else { Coding::Linear };
    let (color, alpha) = Group::of(role, stride);
    let texel = |texel: &[S]| {
        let of = |channel: usize| {
            let channel = if color.count == 1 { 0 } else { channel };
            color.of_texel(texel)[channel].decode(coding)
        };
        let alpha = alpha.map_or(1.0, |alpha| texel[alpha.first].decode(Coding::Linear));
        [of(0), of(1), of(2), alpha]
    };
    samples.chunks_exact(stride).flat_map(texel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cubic_interpolates_and_its_weights_sum_to_one() {
        assert_eq!(weights(0.0), [0.0, 1.0, 0.0, 0.0]);
        assert_eq!(weights(1.0), [0.0, 0.0, 1.0, 0.0]);
        for step in 0..=20u8 {
            let sum: f32 = weights(f32::from(step) / 20.0).iter().sum();
            assert!((sum - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn a_line_stays_a_line() {
        let ramp = image::GrayImage::from_fn(8, 1, |x, _| image::Luma([(x * 20) as u8]));
        let picture = Picture::new(&ramp.into(), Role::Data).unwrap();
        for texel in [1.5, 2.0, 3.3, 5.75] {
            let read = picture.read(Vec2::new((texel + 0.5) / 8.0, 0.5), [Wrap::Clamp; 2], 0.0);
            assert!((read.x * 255.0 - texel * 20.0).abs() < 1e-3, "{read}");
        }
    }

    #[test]
    fn texels_inside_are_read_as_those_at_an_edge_that_repeats() {
        let noise = |x: u32, y: u32| (x * 37 + y * 91 + x * y * 13) as u8;
        let small =
            image::RgbImage::from_fn(6, 6, |x, y| image::Rgb([noise(x, y), 9, noise(y, x)]));
        let tiled = image::RgbImage::from_fn(18, 18, |x, y| *small.get_pixel(x % 6, y % 6));
        let deep = |image: &image::RgbImage| DynamicImage::from(image.clone()).into_rgb16().into();
        let kinds: [fn(&image::RgbImage) -> DynamicImage; 2] = [|image| image.clone().into(), deep];
        for kind in kinds {
            for role in [Role::Color, Role::Data] {
                let [small, tiled] =
                    [&small, &tiled].map(|image| Picture::new(&kind(image), role).unwrap());
                for step in 0..200u8 {
                    let uv = Vec2::new(f32::from(step) * 0.0171, f32::from(step) * 0.0059).fract();
                    let one = small.read(uv, [Wrap::Repeat; 2], 0.0);
                    let other = tiled.read((uv + 1.0) / 3.0, [Wrap::Repeat; 2], 0.0);
                    assert!((one - other).abs().max_element() < 2e-5, "{step}: {one} {other}");
                }
            }
        }
    }

    #[test]
    fn unseen_texels_lend_no_color() {
        let texels = image::RgbaImage::from_fn(4, 1, |x, _| {
            image::Rgba(if x < 2 { [200, 0, 0, 255] } else { [0, 255, 0, 0] })
        });
        let picture = Picture::new(&texels.into(), Role::Color).unwrap();
        let read = picture.read(Vec2::new(0.5, 0.5), [Wrap::Clamp; 2], 0.0);
        assert!(read.y < 1e-6 && read.x > 0.5 && (read.w - 0.5).abs() < 1e-6, "{read}");
    }

    #[test]
    fn a_halving_loses_what_is_finer_than_its_texels() {
        let checkers =
            image::GrayImage::from_fn(8, 8, |x, y| image::Luma([255 * ((x + y) % 2) as u8]));
        let details = Picture::new(&checkers.into(), Role::Data).unwrap().details();
        assert!((details[0] - 0.75).abs() < 0.01 && details[1..].iter().all(|&lost| lost < 1e-9));
    }

    #[test]
    fn sixteen_bits_are_read_as_such() {
        let texels = image::ImageBuffer::from_fn(2, 2, |_, _| image::Luma([257u16 * 3 + 100]));
        let picture = Picture::new(&DynamicImage::ImageLuma16(texels), Role::Data).unwrap();
        let read = picture.read(Vec2::splat(0.5), [Wrap::Clamp; 2], 0.0);
        assert!((read.y - 871.0 / 65535.0).abs() < 1e-7);
    }
}
