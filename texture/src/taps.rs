//! The texels that a GPU reads for a sample, and how it mixes them.
//!
//! They depend on the size of an image, not on its texels: images of one size that are read at one
//! place share them. All is inlined whatever its size: as calls, it spent a seventh of a render moving
//! its results through memory.

use glam::{Vec2, Vec4};

use crate::wrap::Wrap;

/// Texels and weights of a trilinear sample: four texels of a level, and four of the next coarser one.
#[derive(Clone, Copy, Debug)]
pub struct Taps {
    /// The finer level.
    pub(crate) level: u32,
    /// The weight of the coarser level, 0…1.
    pub(crate) t: f32,
    pub(crate) fine: Quad,
    /// Of the next level; of no meaning where that has no weight.
    pub(crate) coarse: Quad,
}

/// Texels and weights of a bilinear sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quad {
    /// Row-major indices: the upper two, then the lower two.
    pub(crate) texels: [u32; 4],
    /// The weight of the right two, 0…1.
    pub(crate) x: f32,
    /// The weight of the lower two, 0…1.
    pub(crate) y: f32,
}

impl Quad {
    /// Mixes the four texels that `texel` gives; exactly theirs where they are equal.
    #[inline(always)]
    pub(crate) fn mix(&self, texel: impl Fn(usize) -> Vec4) -> Vec4 {
        let [a, b, c, d] = self.texels;
        let row = |left: u32, right: u32| mix(texel(left as usize), texel(right as usize), self.x);
        mix(row(a, b), row(c, d), self.y)
    }

    /// The quad at a place in texels, less half a texel.
    #[inline(always)]
    fn new(at: [f32; 2], [width, height]: [usize; 2], wrap: [Wrap; 2]) -> Self {
        let (left, right, x) = pair(at[0], width as u32, wrap[0]);
        let (top, bottom, y) = pair(at[1], height as u32, wrap[1]);
        let (top, bottom) = (top * width as u32, bottom * width as u32);
        Self { texels: [top + left, top + right, bottom + left, bottom + right], x, y }
    }
}

/// Linear interpolation, exact where both ends are equal, as `Vec4::lerp` is not.
#[inline(always)]
pub(crate) fn mix(a: Vec4, b: Vec4, t: f32) -> Vec4 {
    a + (b - a) * t
}

/// Texels and weights of a bilinear sample at `uv`, in an image of this width and height in texels. A UV
/// that is not finite reads as 0.
#[inline(always)]
pub(crate) fn quad(uv: Vec2, size: [usize; 2], wrap: [Wrap; 2]) -> Quad {
    let at = |uv: f32, size: usize, wrap: Wrap| {
        // One period first: exact in floats, and keeps fractions of a texel far from the origin.
        let is_beyond = wrap == Wrap::Repeat && !(0.0..1.0).contains(&uv);
        let uv = if is_beyond { uv - uv.floor() } else { uv };
        let at = uv * size as f32 - 0.5;
        if at.is_finite() { at } else { -0.5 }
    };
    Quad::new([at(uv.x, size[0], wrap[0]), at(uv.y, size[1], wrap[1])], size, wrap)
}

/// The two texels of an axis around a place in texels, less half a texel, and the weight of the second.
#[inline(always)]
fn pair(at: f32, size: u32, wrap: Wrap) -> (u32, u32, f32) {
    if wrap == Wrap::Mirror {
        let floor = at.floor();
        let texel = |i: i64| wrap.texel(i, size as usize) as u32;
        return (texel(floor as i64), texel((floor as i64).saturating_add(1)), at - floor);
    }
    let (before, after) = if wrap == Wrap::Repeat { (size - 1, 0) } else { (0, size - 1) };
    if at < 0.0 {
        return (before, 0, at.max(-1.0) + 1.0);
    }
    let at = at.min(size as f32 - 0.5);
    let first = whole(at);
    (first, if first + 1 == size { after } else { first + 1 }, at - first as f32)
}

/// The whole part of 0…2²³ − 1, without the instruction that the oldest processors lack or the checks of
/// a cast: a float of 2²³ has no digits behind the point.
#[inline(always)]
pub(crate) fn whole(value: f32) -> u32 {
    const SHIFT: f32 = 8_388_608.0;
    let rounded = value + SHIFT;
    let rounded = if rounded - SHIFT > value { rounded - 1.0 } else { rounded };
    rounded.to_bits() & 0x7f_ffff
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taps_are_those_of_the_specification() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for size in [1u32, 2, 3, 64] {
                for step in -300..300 {
                    let uv = step as f32 / 97.0;
                    let found = quad(Vec2::new(uv, 0.5), [size as usize, 1], [wrap; 2]);
                    let at = f64::from(uv) * f64::from(size) - 0.5;
                    let texel = |i: f64| wrap.texel(i as i64, size as usize) as u32;
                    let expected = [texel(at.floor()), texel(at.floor() + 1.0)];
                    let weight = at - at.floor();
                    // Where rounding takes the next texel its weight is 0 instead of 1.
                    let is_same = found.texels[..2] == expected;
                    let off = (f64::from(found.x) - weight).abs();
                    assert!(
                        expected[0] == expected[1] || (is_same && off < 1e-4) || off > 0.999,
                        "{wrap:?} {size} {uv}: {found:?} {expected:?} {weight}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_whole_part_is_that_of_a_cast() {
        for value in [0.0f32, 0.5, 0.999_999_94, 1.0, 1.5, 2.5, 4095.75, 8_388_607.0] {
            assert_eq!(whole(value), value as u32);
        }
    }
}
