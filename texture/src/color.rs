//! Color spaces: sRGB and linear light, luminance.

use std::sync::LazyLock;

/// Decodes an sRGB-encoded value in 0…1 to linear light (IEC 61966-2-1).
#[inline]
pub fn srgb_to_linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The share of 255 that each byte is.
pub(crate) static BYTE_SHARES: [f32; 256] = {
    let (mut shares, mut byte) = ([0.0; 256], 0);
    while byte < 256 {
        shares[byte] = byte as f32 / 255.0;
        byte += 1;
    }
    shares
};

/// Encodes linear light in 0…1 as sRGB (IEC 61966-2-1).
#[inline]
pub fn linear_to_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Decodes an 8-bit sRGB value to linear light, by table.
#[inline]
pub fn srgb8_to_linear(encoded: u8) -> f32 {
    srgb8_table()[encoded as usize]
}

/// The linear light of each 8-bit sRGB value.
#[inline]
pub(crate) fn srgb8_table() -> &'static [f32; 256] {
    static TABLE: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|byte| srgb_to_linear(byte as f32 / 255.0)));
    &TABLE
}

/// [`linear_to_srgb`] by table, for what asks for millions: off by less than 3e-6, and exact at 0.
///
/// Over the root of light the curve is nearly a line, so that 2048 chords follow it.
#[derive(Debug)]
pub struct SrgbCurve([f32; Self::CHORDS + 2]);

impl SrgbCurve {
    const CHORDS: usize = 2048;

    /// The one table there is.
    pub fn get() -> &'static Self {
        static CURVE: LazyLock<SrgbCurve> = LazyLock::new(|| {
            let light = |at: usize| (at as f32 / SrgbCurve::CHORDS as f32).powi(2);
            SrgbCurve(std::array::from_fn(|at| linear_to_srgb(light(at))))
        });
        &CURVE
    }

    /// Encodes linear light in 0…1; what lies above reads as 1.
    #[inline]
    pub fn encode(&self, linear: f32) -> f32 {
        if linear <= 0.003_130_8 {
            return linear * 12.92;
        }
        let root = linear.min(1.0).sqrt() * Self::CHORDS as f32;
        let chord = root as usize;
        let (start, end) = (self.0[chord], self.0[chord + 1]);
        start + (end - start) * (root - chord as f32)
    }
}

/// Encodes linear light in 0…1 as the nearest 8-bit sRGB value; beyond that range as 0 or 255.
#[inline]
pub fn linear_to_srgb8(linear: f32) -> u8 {
    static BYTES: LazyLock<SrgbBytes> = LazyLock::new(SrgbBytes::new);
    BYTES.encode(linear)
}

/// The bytes of the sRGB curve by table, as a power per texel would be most of the time of a mip chain.
struct SrgbBytes {
    /// The byte at the beginning of each of 4096 steps of linear light, and at their end.
    starts: [u8; Self::STEPS + 1],
    /// Per byte the least light of the next; none beyond the last. A step holds at most two of them.
    limits: [f32; 257],
}

impl SrgbBytes {
    const STEPS: usize = 4096;

    fn new() -> Self {
        let limits = std::array::from_fn(|byte| if byte < 255 { limit(byte) } else { f32::NAN });
        let below = |x: f32| limits.iter().filter(|limit| **limit <= x).count() as u8;
        let starts = std::array::from_fn(|step| below(step as f32 / Self::STEPS as f32));
        Self { starts, limits }
    }

    #[inline]
    fn encode(&self, linear: f32) -> u8 {
        let start = self.starts[((linear * Self::STEPS as f32) as usize).min(Self::STEPS)];
        let is_beyond = |limit: usize| u8::from(self.limits[limit] <= linear);
        start + is_beyond(usize::from(start)) + is_beyond(usize::from(start) + 1)
    }
}

/// The least light whose byte by power is more than a byte.
fn limit(byte: usize) -> f32 {
    let is_more = |bits: u32| (linear_to_srgb(f32::from_bits(bits)) * 255.0).round() > byte as f32;
    // Floats above 0 lie in the order of their bits.
    let (mut low, mut high) = (0, 1f32.to_bits());
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        *(if is_more(middle) { &mut high } else { &mut low }) = middle;
    }
    f32::from_bits(high)
}

/// Relative luminance of linear Rec. 709 primaries (ITU-R BT.709).
#[inline]
pub fn luminance(linear_rgb: [f32; 3]) -> f32 {
    0.2126 * linear_rgb[0] + 0.7152 * linear_rgb[1] + 0.0722 * linear_rgb[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_way_to_linear_light_and_back() {
        for byte in 0..=255u8 {
            let back = linear_to_srgb(srgb8_to_linear(byte)) * 255.0;
            assert_eq!(back.round() as u8, byte);
        }
    }

    #[test]
    fn the_byte_by_table_is_the_byte_by_power() {
        for step in 0..=1_000_000 {
            let linear = step as f32 / 1_000_000.0;
            assert_eq!(linear_to_srgb8(linear), (linear_to_srgb(linear) * 255.0).round() as u8);
        }
        assert_eq!([-1.0, f32::NAN, 7.0, f32::INFINITY].map(linear_to_srgb8), [0, 0, 255, 255]);
    }

    #[test]
    fn the_curve_by_table_is_the_curve() {
        let curve = SrgbCurve::get();
        for step in 0..=1_000_000 {
            let linear = step as f32 / 1_000_000.0;
            let (found, exact) = (curve.encode(linear), linear_to_srgb(linear));
            assert!((found - exact).abs() < 3e-6, "{linear}: {found} {exact}");
        }
        assert_eq!([curve.encode(0.0), curve.encode(7.0)], [0.0, linear_to_srgb(1.0)]);
    }

    #[test]
    fn white_has_luminance_one() {
        assert!((luminance([1.0; 3]) - 1.0).abs() < 1e-6);
    }
}
