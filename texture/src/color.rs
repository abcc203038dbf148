//! Color spaces: sRGB and linear light, luminance.

use std::sync::LazyLock;

/// Decodes an sRGB-encoded value in 0…1 to linear light (IEC 61966-2-1).
#[inline]
pub fn srgb_to_linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Encodes linear light in 0…1 as sRGB (IEC 61966-2-1).
#[inline]
pub fn linear_to_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Decodes an 8-bit sRGB value to linear light, by table.
#[inline]
pub fn srgb8_to_linear(encoded: u8) -> f32 {
    static TABLE: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|byte| srgb_to_linear(byte as f32 / 255.0)));
    TABLE[encoded as usize]
}

/// Encodes linear light in 0…1 as the nearest 8-bit sRGB value; beyond that range as 0 or 255.
///
/// By table, as a power per texel would be most of the time of a mip chain: `STARTS` has the byte at
/// the beginning of each of 4096 steps of linear light, and a step holds at most two of the `LIMITS`
/// between bytes.
pub fn linear_to_srgb8(linear: f32) -> u8 {
    static LIMITS: LazyLock<[f32; 255]> =
        LazyLock::new(|| std::array::from_fn(|byte| srgb_to_linear((byte as f32 + 0.5) / 255.0)));
    static STARTS: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let below = |x: f32| LIMITS.iter().filter(|limit| **limit <= x).count() as u8;
        (0..=4096u16).map(|step| below(f32::from(step) / 4096.0)).collect()
    });
    let mut byte = STARTS[((linear * 4096.0) as usize).min(4096)];
    while byte < 255 && LIMITS[byte as usize] <= linear {
        byte += 1;
    }
    byte
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
        for step in 0..=100_000 {
            let linear = step as f32 / 100_000.0;
            let exact = linear_to_srgb(linear) * 255.0;
            assert!((f32::from(linear_to_srgb8(linear)) - exact).abs() < 0.5001);
        }
        assert_eq!([-1.0, f32::NAN, 7.0, f32::INFINITY].map(linear_to_srgb8), [0, 0, 255, 255]);
    }

    #[test]
    fn white_has_luminance_one() {
        assert!((luminance([1.0; 3]) - 1.0).abs() < 1e-6);
    }
}
