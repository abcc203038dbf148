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
    fn white_has_luminance_one() {
        assert!((luminance([1.0; 3]) - 1.0).abs() < 1e-6);
    }
}
