//! An image with its mip maps, and how a GPU reads it.
//!
//! Each level is half the one before, rounded down, made in linear light by the box filter; an odd
//! axis of 2m + 1 texels goes to m by the polyphase box: texel i is the mean over its exact extent
//! of 2 + 1/m source texels, so it reads 2i, 2i + 1 and 2i + 2 with weights (m − i, m, i + 1) over
//! 2m + 1. The mean of an image is therefore the value of its last level.
//!
//! An 8-bit image keeps 8 bits in every level, encoded as it came, as on a GPU; the chain itself is
//! computed in f32 from the unrounded level above, so rounding does not add up. Texels are decoded
//! before they are interpolated (sRGB textures of OpenGL and Vulkan).
//!
//! Not guaranteed: bits equal to a given GPU, whose filters round at 8 bits of fraction.

use glam::{Vec2, Vec4};
use rayon::prelude::*;

use crate::color::{BYTE_SHARES, linear_to_srgb8, srgb8_table};
use crate::error::{Error, Result};
use crate::plane::Plane;
use crate::taps::{Quad, Taps, mix, quad};
use crate::wrap::Wrap;

/// The encoding of the color channels of 8-bit texels; alpha is always linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ColorEncoding {
    /// sRGB-encoded light: base color and emissive textures.
    Srgb,
    /// The value itself, 0…1: normals, roughness, occlusion.
    Linear,
}

/// An image and its mip maps, each half the size of the one before, down to one texel.
#[derive(Clone, Debug)]
pub struct Mips {
    levels: Vec<MipLevel>,
}

/// One level of [`Mips`]: an image of four channels.
#[derive(Clone, Debug)]
pub struct MipLevel {
    width: usize,
    height: usize,
    texels: Texels,
}

/// Row-major from the top.
#[derive(Clone, Debug)]
enum Texels {
    Bytes(Vec<[u8; 4]>, ColorEncoding),
    Floats(Vec<[f32; 4]>),
}

/// Most texels of a level of light that is kept decoded: reading eight of its texels takes half the time,
/// and an image of 2048² texels takes 5⅓ MB more.
const DECODED: usize = 1 << 18;

impl Texels {
    fn of_bytes(texels: Vec<[u8; 4]>, encoding: ColorEncoding) -> Self {
        if encoding == ColorEncoding::Srgb && texels.len() <= DECODED {
            let decode = |texel: &[u8; 4]| decode(*texel, encoding).to_array();
            return Self::Floats(texels.iter().map(decode).collect());
        }
        Self::Bytes(texels, encoding)
    }
}

impl Mips {
    /// The mip maps of an 8-bit image, `width · height · 4` bytes, row-major from the top. Takes
    /// 5⅓ bytes per texel of the image, four times as much for levels of sRGB up to 512² texels.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the size is zero or the data has another length.
    pub fn from_rgba8(
        width: usize,
        height: usize,
        data: &[u8],
        encoding: ColorEncoding,
    ) -> Result<Self> {
        let mut mips = Self::largest_of_rgba8(width, height, data, encoding)?;
        let base = mips.levels.remove(0);
        Ok(Self::below(base, |floats| {
            let bytes = floats.par_iter().map(|texel| encode(*texel, encoding)).collect();
            Texels::of_bytes(bytes, encoding)
        }))
    }

    /// An 8-bit image as [`Mips::from_rgba8`] takes it, without anything smaller.
    pub(crate) fn largest_of_rgba8(
        width: usize,
        height: usize,
        data: &[u8],
        encoding: ColorEncoding,
    ) -> Result<Self> {
        check_size(width, height, 4, data.len())?;
        let texels = data.as_chunks::<4>().0.to_vec();
        let levels = vec![MipLevel { width, height, texels: Texels::of_bytes(texels, encoding) }];
        Ok(Self { levels })
    }

    /// The mip maps of a linear image of 1 (gray), 3 or 4 channels, kept in f32: 21⅓ bytes per
    /// texel of the image.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it is empty or has another number of channels.
    pub fn from_plane(plane: &Plane) -> Result<Self> {
        let (width, height, channels) = (plane.width(), plane.height(), plane.channels());
        check_size(width, height, channels, plane.data().len())?;
        let widen: fn(&[f32]) -> [f32; 4] = match channels {
            1 => |t| [t[0], t[0], t[0], 1.0],
            3 => |t| [t[0], t[1], t[2], 1.0],
            4 => |t| [t[0], t[1], t[2], t[3]],
            _ => {
                let what = format!("{channels} channels; a texture has 1, 3 or 4");
                return Err(Error::Invalid { what });
            }
        };
        let texels = plane.data().chunks_exact(channels).map(widen).collect();
        let base = MipLevel { width, height, texels: Texels::Floats(texels) };
        Ok(Self::below(base, |floats| Texels::Floats(floats.to_vec())))
    }

    /// The chain below `base`, each level stored as `store` says.
    fn below(base: MipLevel, store: impl Fn(&[[f32; 4]]) -> Texels) -> Self {
        let mut levels = vec![base];
        let mut above: Option<Vec<[f32; 4]>> = None;
        while let Some(last) = levels.last().filter(|last| last.width.max(last.height) > 1) {
            let size = [last.width, last.height];
            let floats = match &above {
                Some(floats) => halve(size, |x, y| Vec4::from_array(floats[y * size[0] + x])),
                None => halve(size, |x, y| last.read(x, y)),
            };
            let (width, height) = (half(size[0]), half(size[1]));
            levels.push(MipLevel { width, height, texels: store(&floats) });
            above = Some(floats);
        }
        Self { levels }
    }

    /// Number of levels, the image itself included.
    pub fn levels(&self) -> usize {
        self.levels.len()
    }

    /// Mip level `level`; 0 is the image itself.
    ///
    /// # Panics
    /// If there are not as many levels.
    pub fn level(&self, level: usize) -> &MipLevel {
        &self.levels[level]
    }

    /// Bytes of texels held.
    pub fn bytes(&self) -> usize {
        let of = |level: &MipLevel| match &level.texels {
            Texels::Bytes(texels, _) => texels.len() * 4,
            Texels::Floats(texels) => texels.len() * 16,
        };
        self.levels.iter().map(of).sum()
    }

    /// The level of detail that a GPU picks where a step of one pixel to the right and one down
    /// moves the UV by `dx` and `dy`: log₂ of the longer step in texels (Vulkan 1.3 §16.5.7,
    /// isotropic). Below 0 the texture is magnified.
    pub fn lod(&self, dx: Vec2, dy: Vec2) -> f32 {
        0.5 * self.square(dx, dy).log2()
    }

    /// The square of the longer of these two steps, in texels.
    #[inline(always)]
    pub fn square(&self, dx: Vec2, dy: Vec2) -> f32 {
        let size = Vec2::new(self.levels[0].width as f32, self.levels[0].height as f32);
        (dx * size).length_squared().max((dy * size).length_squared())
    }

    /// Bilinear sample of one level, decoded. A UV that is not finite reads as 0.
    ///
    /// # Panics
    /// If there are not as many levels.
    pub fn sample_bilinear(&self, level: usize, uv: Vec2, wrap: [Wrap; 2]) -> [f32; 4] {
        let level = &self.levels[level];
        level.bilinear(&quad(uv, [level.width, level.height], wrap)).to_array()
    }

    /// Trilinear sample, decoded: linear between the two levels around `lod`, which is held to the
    /// levels there are. A `lod` or UV that is not a number reads as 0.
    pub fn sample(&self, uv: Vec2, wrap: [Wrap; 2], lod: f32) -> [f32; 4] {
        self.read(&self.taps(uv, wrap, lod)).to_array()
    }

    /// Texels and weights of [`Mips::sample`], for this image or any of its [size](Mips::size).
    #[inline]
    pub fn taps(&self, uv: Vec2, wrap: [Wrap; 2], lod: f32) -> Taps {
        let last = self.levels.len() - 1;
        let lod = if lod > 0.0 { lod.min(last as f32) } else { 0.0 };
        let level = lod as usize;
        let t = lod - level as f32;
        let (near, far) = (&self.levels[level], &self.levels[(level + 1).min(last)]);
        Taps {
            level: level as u32,
            t,
            fine: quad(uv, [near.width, near.height], wrap),
            coarse: quad(uv, [far.width, far.height], wrap),
        }
    }

    /// A trilinear sample from what it reads, decoded.
    ///
    /// # Panics
    /// If the taps are those of a larger image.
    #[inline(always)]
    pub fn read(&self, taps: &Taps) -> Vec4 {
        let level = taps.level as usize;
        let value = self.levels[level].bilinear(&taps.fine);
        if taps.t == 0.0 {
            return value;
        }
        mix(value, self.levels[level + 1].bilinear(&taps.coarse), taps.t)
    }

    /// Width and height in texels.
    pub fn size(&self) -> [usize; 2] {
        [self.levels[0].width, self.levels[0].height]
    }
}

impl MipLevel {
    /// Width in texels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height in texels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// One texel, decoded to linear.
    ///
    /// # Panics
    /// If it lies outside the image.
    pub fn texel(&self, x: usize, y: usize) -> [f32; 4] {
        assert!(x < self.width, "column {x} of an image {} wide", self.width);
        self.read(x, y).to_array()
    }

    /// Adds four texels of a row to a sum, one after the other, decoded to linear and weighed; the first
    /// lies at a column.
    ///
    /// # Panics
    /// If one lies outside the image.
    #[inline(always)]
    pub(crate) fn add_four(&self, x: usize, y: usize, weights: [f32; 4], sum: Vec4) -> Vec4 {
        assert!(x + 4 <= self.width, "columns from {x} on of an image {} wide", self.width);
        let texels = y * self.width + x..y * self.width + x + 4;
        match &self.texels {
            Texels::Bytes(bytes, encoding) => {
                let bytes = &bytes[texels];
                let light = match encoding {
                    ColorEncoding::Srgb => srgb8_table(),
                    ColorEncoding::Linear => &BYTE_SHARES,
                };
                let sum = sum + by_table(bytes[0], light) * weights[0];
                let sum = sum + by_table(bytes[1], light) * weights[1];
                let sum = sum + by_table(bytes[2], light) * weights[2];
                sum + by_table(bytes[3], light) * weights[3]
            }
            Texels::Floats(floats) => {
                let floats = &floats[texels];
                let sum = sum + Vec4::from_array(floats[0]) * weights[0];
                let sum = sum + Vec4::from_array(floats[1]) * weights[1];
                let sum = sum + Vec4::from_array(floats[2]) * weights[2];
                sum + Vec4::from_array(floats[3]) * weights[3]
            }
        }
    }

    #[inline]
    fn read(&self, x: usize, y: usize) -> Vec4 {
        let index = y * self.width + x;
        match &self.texels {
            Texels::Bytes(texels, encoding) => decode(texels[index], *encoding),
            Texels::Floats(texels) => Vec4::from_array(texels[index]),
        }
    }

    #[inline(always)]
    fn bilinear(&self, quad: &Quad) -> Vec4 {
        match &self.texels {
            Texels::Bytes(texels, ColorEncoding::Srgb) => {
                let light = srgb8_table();
                quad.mix(|at| by_table(texels[at], light))
            }
            // Divided once: a division is exact where all four are equal, whenever it is made.
            Texels::Bytes(texels, ColorEncoding::Linear) => {
                let texel = |[r, g, b, a]: [u8; 4]| {
                    Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a))
                };
                quad.mix(|at| texel(texels[at])) / 255.0
            }
            Texels::Floats(texels) => quad.mix(|at| Vec4::from_array(texels[at])),
        }
    }
}

/// A texel whose color channels stand for the numbers of a table.
#[inline(always)]
fn by_table([r, g, b, a]: [u8; 4], table: &[f32; 256]) -> Vec4 {
    let (r, g, b) = (table[r as usize], table[g as usize], table[b as usize]);
    Vec4::new(r, g, b, BYTE_SHARES[a as usize])
}

#[inline]
fn decode(texel: [u8; 4], encoding: ColorEncoding) -> Vec4 {
    by_table(
        texel,
        match encoding {
            ColorEncoding::Srgb => srgb8_table(),
            ColorEncoding::Linear => &BYTE_SHARES,
        },
    )
}

fn encode(texel: [f32; 4], encoding: ColorEncoding) -> [u8; 4] {
    let linear = |value: f32| (value * 255.0).round() as u8;
    match encoding {
        ColorEncoding::Srgb => [
            linear_to_srgb8(texel[0]),
            linear_to_srgb8(texel[1]),
            linear_to_srgb8(texel[2]),
            linear(texel[3]),
        ],
        ColorEncoding::Linear => texel.map(linear),
    }
}

pub(crate) fn half(size: usize) -> usize {
    (size / 2).max(1)
}

/// The three source texels of texel `i` when an axis of `size` texels is halved, and their weights.
pub(crate) fn box_taps(i: usize, size: usize) -> [(usize, f32); 3] {
    let m = size / 2;
    match size {
        1 => [(0, 1.0), (0, 0.0), (0, 0.0)],
        _ if size.is_multiple_of(2) => [(2 * i, 0.5), (2 * i + 1, 0.5), (2 * i + 1, 0.0)],
        _ => {
            let weight = |count: usize| count as f32 / size as f32;
            [(2 * i, weight(m - i)), (2 * i + 1, weight(m)), (2 * i + 2, weight(i + 1))]
        }
    }
}

/// The next level of an image of `size`, read by `read`.
fn halve(size: [usize; 2], read: impl Fn(usize, usize) -> Vec4 + Sync) -> Vec<[f32; 4]> {
    let (width, height) = (half(size[0]), half(size[1]));
    let columns: Vec<_> = (0..width).map(|x| box_taps(x, size[0])).collect();
    let mut out = vec![[0.0; 4]; width * height];
    out.par_chunks_exact_mut(width).enumerate().for_each(|(y, row)| {
        let rows = box_taps(y, size[1]);
        for (texel, columns) in row.iter_mut().zip(&columns) {
            let mut sum = Vec4::ZERO;
            for &(y, wy) in rows.iter().filter(|row| row.1 > 0.0) {
                for &(x, wx) in columns.iter().filter(|column| column.1 > 0.0) {
                    sum += read(x, y) * (wx * wy);
                }
            }
            *texel = sum.to_array();
        }
    });
    out
}

fn check_size(width: usize, height: usize, channels: usize, len: usize) -> Result<()> {
    let expected = width.checked_mul(height).and_then(|texels| texels.checked_mul(channels));
    if expected.is_none_or(|expected| expected == 0 || expected != len) {
        let what = format!("{len} values for {width} × {height} texels of {channels} channels");
        return Err(Error::Invalid { what });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
