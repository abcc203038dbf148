//! The numbers that an image's samples stand for, in spaces where they may be averaged.

use std::sync::LazyLock;

use crate::color::{
    BYTE_SHARES, linear_to_srgb, linear_to_srgb8, srgb_to_linear, srgb8_table, srgb8_to_linear,
};
use crate::role::Role;

/// Runs `$body` with `$buffer`, the texels of an image of a kind that is known; an error for any
/// other kind.
macro_rules! with_buffer {
    ($image:expr, $buffer:ident => $body:expr) => {{
        use image::DynamicImage as Kind;
        match $image {
            Kind::ImageLuma8($buffer) => Ok($body),
            Kind::ImageLumaA8($buffer) => Ok($body),
            Kind::ImageRgb8($buffer) => Ok($body),
            Kind::ImageRgba8($buffer) => Ok($body),
            Kind::ImageLuma16($buffer) => Ok($body),
            Kind::ImageLumaA16($buffer) => Ok($body),
            Kind::ImageRgb16($buffer) => Ok($body),
            Kind::ImageRgba16($buffer) => Ok($body),
            Kind::ImageRgb32F($buffer) => Ok($body),
            Kind::ImageRgba32F($buffer) => Ok($body),
            other => Err($crate::error::Error::Invalid {
                what: format!("images of kind {:?} are not known", other.color()),
            }),
        }
    }};
}
pub(crate) use with_buffer;

/// The encoding of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coding {
    /// A color: sRGB in integers; in floats linear light as it is.
    Light,
    /// A number in 0…1 in integers; any number in floats.
    Linear,
    /// A component of a vector, −1…1, stored as (v + 1) / 2.
    Vector,
}

/// Channels that are treated alike, `count` of them from `first` on, of `stride` samples per texel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    pub(crate) first: usize,
    pub(crate) count: usize,
    pub(crate) stride: usize,
    pub(crate) coding: Coding,
}

impl Group {
    /// The color channels of a texel of `stride` samples, and its alpha if it has one.
    ///
    /// Fewer than three color channels are no normal, and are taken for data.
    pub(crate) fn of(role: Role, stride: usize) -> (Self, Option<Self>) {
        let has_alpha = stride.is_multiple_of(2);
        let count = stride - usize::from(has_alpha);
        let coding = match role {
            Role::Color => Coding::Light,
            Role::Normal if count == 3 => Coding::Vector,
            Role::Normal | Role::Data => Coding::Linear,
        };
        let alpha = Self { first: count, count: 1, stride, coding: Coding::Linear };
        (Self { first: 0, count, stride, coding }, has_alpha.then_some(alpha))
    }

    /// The group's samples of a texel.
    pub(crate) fn of_texel<S>(self, texel: &[S]) -> &[S] {
        &texel[self.first..self.first + self.count]
    }
}

/// A channel of a texel as a file stores it.
pub(crate) trait Sample: Copy + Send + Sync {
    /// The number it stands for.
    fn decode(self, coding: Coding) -> f32;
    /// The same as a function, for many samples.
    fn decoder(coding: Coding) -> impl Fn(Self) -> f32 + Copy + Send + Sync;
    /// The sample nearest to a number, clamped to what it can hold.
    fn encode(value: f32, coding: Coding) -> Self;
    /// Whether it is a number at all.
    fn is_number(self) -> bool;
    /// Whether it is zero, which for alpha means unseen.
    fn is_zero(self) -> bool;
}

/// The component of a vector that each byte stores.
static VECTOR_SHARES: [f32; 256] = {
    let (mut shares, mut byte) = ([0.0; 256], 0);
    while byte < 256 {
        shares[byte] = byte as f32 / 127.5 - 1.0;
        byte += 1;
    }
    shares
};

/// A number in 0…1 that an integer sample stores.
fn stored(value: f32, coding: Coding) -> f32 {
    let stored = match coding {
        Coding::Light => linear_to_srgb(value),
        Coding::Linear => value,
        Coding::Vector => 0.5 * value + 0.5,
    };
    stored.clamp(0.0, 1.0)
}

/// The nearest whole number to one of 0…65535, halves up, without a call of the library; 0 for what is no
/// number.
#[inline]
fn rounded(value: f32) -> u32 {
    let whole = value as u32;
    whole + u32::from(value - whole as f32 >= 0.5)
}

impl Sample for u8 {
    #[inline]
    fn decode(self, coding: Coding) -> f32 {
        match coding {
            Coding::Light => srgb8_to_linear(self),
            Coding::Linear => BYTE_SHARES[self as usize],
            Coding::Vector => VECTOR_SHARES[self as usize],
        }
    }

    #[inline(always)]
    fn decoder(coding: Coding) -> impl Fn(Self) -> f32 + Copy + Send + Sync {
        let table = match coding {
            Coding::Light => srgb8_table(),
            Coding::Linear => &BYTE_SHARES,
            Coding::Vector => &VECTOR_SHARES,
        };
        move |sample| table[sample as usize]
    }

    #[inline]
    fn encode(value: f32, coding: Coding) -> Self {
        match coding {
            Coding::Light => linear_to_srgb8(value),
            Coding::Linear | Coding::Vector => rounded(stored(value, coding) * 255.0) as Self,
        }
    }

    fn is_number(self) -> bool {
        true
    }

    fn is_zero(self) -> bool {
        self == 0
    }
}

impl Sample for u16 {
    #[inline]
    fn decode(self, coding: Coding) -> f32 {
        static LIGHT: LazyLock<Vec<f32>> = LazyLock::new(|| {
            (0..=u16::MAX).map(|sample| srgb_to_linear(f32::from(sample) / 65535.0)).collect()
        });
        match coding {
            Coding::Light => LIGHT[self as usize],
            Coding::Linear => f32::from(self) / 65535.0,
            Coding::Vector => f32::from(self) / 32767.5 - 1.0,
        }
    }

    fn decoder(coding: Coding) -> impl Fn(Self) -> f32 + Copy + Send + Sync {
        move |sample| sample.decode(coding)
    }

    #[inline]
    fn encode(value: f32, coding: Coding) -> Self {
        rounded(stored(value, coding) * 65535.0) as Self
    }

    fn is_number(self) -> bool {
        true
    }

    fn is_zero(self) -> bool {
        self == 0
    }
}

impl Sample for f32 {
    #[inline]
    fn decode(self, coding: Coding) -> f32 {
        if coding == Coding::Vector { 2.0 * self - 1.0 } else { self }
    }

    fn decoder(coding: Coding) -> impl Fn(Self) -> f32 + Copy + Send + Sync {
        move |sample| sample.decode(coding)
    }

    #[inline]
    fn encode(value: f32, coding: Coding) -> Self {
        if coding == Coding::Vector { 0.5 * value + 0.5 } else { value }
    }

    fn is_number(self) -> bool {
        self.is_finite()
    }

    fn is_zero(self) -> bool {
        self == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CODINGS: [Coding; 3] = [Coding::Light, Coding::Linear, Coding::Vector];

    #[test]
    fn every_sample_survives_decoding_and_encoding() {
        for coding in CODINGS {
            assert!(
                (0..=u8::MAX).all(|sample| u8::encode(sample.decode(coding), coding) == sample)
            );
            assert!(
                (0..=u16::MAX).all(|sample| u16::encode(sample.decode(coding), coding) == sample)
            );
        }
    }

    #[test]
    fn rounding_is_that_of_the_library() {
        for value in [0.0f32, 0.49999997, 0.5, 1.4999999, 2.5, 254.5, 254.49998, 65534.5, f32::NAN]
        {
            assert_eq!(rounded(value), value.round() as u32, "{value}");
        }
    }

    #[test]
    fn numbers_beyond_a_sample_are_clamped() {
        assert_eq!(u8::encode(1.7, Coding::Light), 255);
        assert_eq!(u8::encode(-0.1, Coding::Light), 0);
        assert_eq!(u16::encode(-1.5, Coding::Vector), 0);
        assert_eq!(f32::encode(65024.0, Coding::Light), 65024.0);
    }
}
