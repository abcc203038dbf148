//! Many trilinear samples of an image at a time: what `taps` finds for one, found in rows that a compiler
//! turns into vector instructions.
//!
//! All is inlined whatever its size, so that it is made for the processor that its caller is made for.

use crate::mips::Mips;
use crate::taps::{Quad, Taps, quad, whole};
use crate::wrap::Wrap;

/// Samples that are read at a time.
pub const MANY: usize = 64;

/// Where samples are read: one place and one level of detail each.
#[derive(Clone, Debug)]
pub struct Spots {
    /// The horizontal coordinate.
    pub u: [f32; MANY],
    /// The vertical coordinate.
    pub v: [f32; MANY],
    /// The square of the longest way, in texels of the image, that a step of a pixel goes: see
    /// [`Mips::square`].
    pub squares: [f32; MANY],
}

/// Texels and weights of as many samples.
#[derive(Clone, Debug)]
pub struct ManyTaps {
    levels: [u32; MANY],
    /// The weights of the coarser levels.
    t: [f32; MANY],
    fine: Quads,
    coarse: Quads,
}

/// Texels and weights of bilinear samples.
#[derive(Clone, Debug)]
struct Quads {
    texels: [[u32; MANY]; 4],
    x: [f32; MANY],
    y: [f32; MANY],
}

impl Spots {
    /// At the corner of the finest level.
    pub const ZERO: Self = Self { u: [0.0; MANY], v: [0.0; MANY], squares: [0.0; MANY] };
}

impl ManyTaps {
    /// The first texel of an image, which every image has.
    pub const FIRST: Self =
        Self { levels: [0; MANY], t: [0.0; MANY], fine: Quads::FIRST, coarse: Quads::FIRST };

    /// Those of one sample.
    #[inline(always)]
    fn of(&self, sample: usize) -> Taps {
        Taps {
            level: self.levels[sample],
            t: self.t[sample],
            fine: self.fine.of(sample),
            coarse: self.coarse.of(sample),
        }
    }
}

impl Quads {
    const FIRST: Self = Self { texels: [[0; MANY]; 4], x: [0.0; MANY], y: [0.0; MANY] };

    #[inline(always)]
    fn of(&self, sample: usize) -> Quad {
        let [a, b, c, d] = &self.texels;
        Quad {
            texels: [a[sample], b[sample], c[sample], d[sample]],
            x: self.x[sample],
            y: self.y[sample],
        }
    }

    /// The quads of an image of that size, which repeats or whose edge goes on, `further` levels below
    /// these.
    #[inline(always)]
    fn find(
        &mut self,
        spots: &Spots,
        levels: &[u32; MANY],
        further: u32,
        [width, height]: [u32; 2],
        [across, down]: [bool; 2],
    ) {
        let Self { texels: [upper_left, upper_right, lower_left, lower_right], x, y } = self;
        for sample in 0..MANY {
            // As often as halving takes; the last level has no next.
            let level = (levels[sample] + further).min(31);
            let (width, height) = ((width >> level).max(1), (height >> level).max(1));
            let (left, right, right_weight) = pair(spots.u[sample], width, across);
            let (top, bottom, lower_weight) = pair(spots.v[sample], height, down);
            let (top, bottom) = (top.wrapping_mul(width), bottom.wrapping_mul(width));
            upper_left[sample] = top.wrapping_add(left);
            upper_right[sample] = top.wrapping_add(right);
            lower_left[sample] = bottom.wrapping_add(left);
            lower_right[sample] = bottom.wrapping_add(right);
            x[sample] = right_weight;
            y[sample] = lower_weight;
        }
    }

    #[inline(always)]
    fn set(&mut self, sample: usize, quad: Quad) {
        for (all, own) in self.texels.iter_mut().zip(quad.texels) {
            all[sample] = own;
        }
        (self.x[sample], self.y[sample]) = (quad.x, quad.y);
    }
}

impl Mips {
    /// Texels and weights of [`Mips::sample`] at many spots, for this image or any of its
    /// [size](Mips::size).
    #[inline(always)]
    pub fn taps_of_many(&self, spots: &Spots, wrap: [Wrap; 2], taps: &mut ManyTaps) {
        let last = self.levels() - 1;
        for sample in 0..MANY {
            let square = spots.squares[sample];
            let lod = 0.5 * log2(square);
            // Also where it is no number.
            let lod = if square > 1.0 { least(lod, last as f32) } else { 0.0 };
            taps.levels[sample] = whole(lod);
            taps.t[sample] = lod - whole(lod) as i32 as f32;
        }
        let ManyTaps { levels, fine, coarse, .. } = taps;
        if wrap.contains(&Wrap::Mirror) {
            for (sample, level) in levels.iter().map(|level| *level as usize).enumerate() {
                let quad = |level: usize| {
                    let uv = [spots.u[sample], spots.v[sample]].into();
                    quad(uv, [self.level(level).width(), self.level(level).height()], wrap)
                };
                fine.set(sample, quad(level));
                coarse.set(sample, quad((level + 1).min(last)));
            }
        } else {
            let [width, height] = self.size().map(|side| side as u32);
            let repeats = wrap.map(|wrap| wrap == Wrap::Repeat);
            fine.find(spots, levels, 0, [width, height], repeats);
            coarse.find(spots, levels, 1, [width, height], repeats);
        }
    }

    /// The first `count` trilinear samples from what they read, decoded.
    ///
    /// # Panics
    /// If the taps are those of a larger image.
    #[inline(always)]
    pub fn read_many(&self, taps: &ManyTaps, count: usize, texels: &mut [[f32; 4]; MANY]) {
        for (sample, texel) in texels.iter_mut().enumerate().take(count) {
            *texel = self.read(&taps.of(sample)).to_array();
        }
    }
}

/// The two texels of an axis of `side` texels around a coordinate, and the weight of the second, if the
/// image repeats or its edge goes on.
#[inline(always)]
fn pair(coordinate: f32, side: u32, repeats: bool) -> (u32, u32, f32) {
    let length = side as i32 as f32;
    // One period first: exact in floats, and keeps fractions of a texel far from the origin.
    let is_beyond = repeats & !(0.0..1.0).contains(&coordinate);
    let coordinate = if is_beyond { coordinate - floor(coordinate) } else { coordinate };
    let at = coordinate * length - 0.5;
    let at = if at.abs() < f32::INFINITY { at } else { -0.5 };
    let (before, after) = if repeats { (side - 1, 0) } else { (0, side - 1) };
    let inside = least(if at > 0.0 { at } else { 0.0 }, length - 0.5);
    let first = whole(inside);
    let second = if first.wrapping_add(1) == side { after } else { first.wrapping_add(1) };
    let outside = (if at > -1.0 { at } else { -1.0 }) + 1.0;
    if at < 0.0 { (before, 0, outside) } else { (first, second, inside - first as i32 as f32) }
}

/// The lesser number, as the processor's own instruction says it.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greatest whole number up to a value, without the instruction that the oldest processors lack.
#[inline(always)]
pub(crate) fn floor(value: f32) -> f32 {
    const SHIFT: f32 = 12_582_912.0;
    let rounded = (value + SHIFT) - SHIFT;
    let floor = if rounded > value { rounded - 1.0 } else { rounded };
    if value.abs() < 4_194_304.0 { floor } else { value }
}

/// The logarithm of a number above 0, off by less than 1e-6 and exact at the powers of two: the series of
/// the inverse hyperbolic tangent, around the nearest power.
#[inline(always)]
fn log2(value: f32) -> f32 {
    const ROOT_OF_HALF: u32 = 0x3f35_04f3;
    let power = value.to_bits().wrapping_sub(ROOT_OF_HALF) as i32 >> 23;
    let rest = f32::from_bits(value.to_bits().wrapping_sub((power << 23) as u32));
    let x = (rest - 1.0) / (rest + 1.0);
    let square = x * x;
    let series = 1.0 + square * (1.0 / 3.0 + square * (0.2 + square * (1.0 / 7.0 + square / 9.0)));
    power as f32 + 2.0 * std::f32::consts::LOG2_E * x * series
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec4};
    use proptest::prelude::*;

    use super::*;
    use crate::mips::ColorEncoding;

    fn noise(width: usize, height: usize, encoding: ColorEncoding) -> Mips {
        let byte = |i: usize| (i as u32).wrapping_mul(2_654_435_761).rotate_left(9) as u8;
        let data: Vec<u8> = (0..width * height * 4).map(byte).collect();
        Mips::from_rgba8(width, height, &data, encoding).unwrap()
    }

    #[test]
    fn the_logarithm_is_that_of_the_library() {
        for step in 0..100_000 {
            let value = f32::from_bits(0x3000_0000 + step * 9973);
            let (found, exact) = (log2(value), f64::from(value).log2());
            assert!((f64::from(found) - exact).abs() < 1e-6 * exact.abs().max(1.0), "{value}");
        }
        assert_eq!([1.0, 2.0, 4096.0, 0.25].map(log2), [0.0, 1.0, 12.0, -2.0]);
    }

    #[test]
    fn the_whole_number_below_is_that_of_the_library() {
        for value in [0.0f32, -0.5, 0.5, -1.0, -1.5, 2.5, 3.5, -4095.25, 4_194_303.5, 1e9, -1e9] {
            assert_eq!(floor(value), value.floor(), "{value}");
        }
        assert!(floor(f32::NAN).is_nan());
    }

    proptest! {
        #[test]
        fn many_samples_are_each_what_one_is(
            uvs in prop::collection::vec((-3.0f32..3.0, -3.0f32..3.0, 0.0f32..300.0), MANY),
            bad in prop_oneof![any::<f32>(), Just(f32::NAN), Just(f32::INFINITY)],
            width in 1usize..40, height in 1usize..40,
            wraps in prop::array::uniform2(prop_oneof![
                Just(Wrap::Repeat), Just(Wrap::Clamp), Just(Wrap::Mirror),
            ]),
        ) {
            for encoding in [ColorEncoding::Srgb, ColorEncoding::Linear] {
                let mips = noise(width, height, encoding);
                let mut spots = Spots::ZERO;
                for (at, (u, v, step)) in uvs.iter().enumerate() {
                    (spots.u[at], spots.v[at], spots.squares[at]) = (*u, *v, step * step);
                }
                (spots.u[3], spots.v[9], spots.squares[20]) = (bad, bad, bad.abs());
                let (mut taps, mut texels) = (ManyTaps::FIRST, [[0.0; 4]; MANY]);
                mips.taps_of_many(&spots, wraps, &mut taps);
                mips.read_many(&taps, MANY, &mut texels);
                for (at, found) in texels.iter().enumerate() {
                    let uv = Vec2::new(spots.u[at], spots.v[at]);
                    let one = mips.sample(uv, wraps, 0.5 * spots.squares[at].log2());
                    let off = (Vec4::from_array(one) - Vec4::from_array(*found)).abs();
                    prop_assert!(off.max_element() < 1e-4, "{at} {uv}: {one:?} {found:?}");
                }
            }
        }
    }
}
