//! How an image's samples stand for numbers that may be averaged.

use std::sync::LazyLock;

use image::{DynamicImage, ImageBuffer, Pixel};

use crate::color::{linear_to_srgb, srgb_to_linear, srgb8_to_linear};
use crate::{Error, Result};

/// What a sample encodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coding {
    /// A color: sRGB in integers; in floats linear light as it is.
    Light,
    /// A number in 0…1 in integers; any number in floats.
    Linear,
    /// A component of a vector, −1…1, stored as (v + 1) / 2.
    Vector,
}

/// A channel of a texel as a file stores it.
pub(crate) trait Sample: Copy + Send + Sync {
    /// The number it stands for.
    fn decode(self, coding: Coding) -> f32;
    /// The sample nearest to a number, clamped to what it can hold.
    fn encode(value: f32, coding: Coding) -> Self;
    /// Whether it is a number at all.
    fn is_number(self) -> bool;
    /// Whether it is zero, which for alpha means unseen.
    fn is_zero(self) -> bool;
}

/// What is done to an image whatever its kind of texels.
pub(crate) trait Visitor {
    /// What comes of it.
    type Output;

    /// Does it.
    fn visit<P>(self, image: &mut ImageBuffer<P, Vec<P::Subpixel>>) -> Self::Output
    where
        P: Pixel,
        P::Subpixel: Sample;
}

/// Lets a visitor see the texels of an image as they are.
///
/// # Errors
/// [`Error::Invalid`] if the image is of a kind that is not known.
pub(crate) fn visit<V: Visitor>(image: &mut DynamicImage, visitor: V) -> Result<V::Output> {
    Ok(match image {
        DynamicImage::ImageLuma8(image) => visitor.visit(image),
        DynamicImage::ImageLumaA8(image) => visitor.visit(image),
        DynamicImage::ImageRgb8(image) => visitor.visit(image),
        DynamicImage::ImageRgba8(image) => visitor.visit(image),
        DynamicImage::ImageLuma16(image) => visitor.visit(image),
        DynamicImage::ImageLumaA16(image) => visitor.visit(image),
        DynamicImage::ImageRgb16(image) => visitor.visit(image),
        DynamicImage::ImageRgba16(image) => visitor.visit(image),
        DynamicImage::ImageRgb32F(image) => visitor.visit(image),
        DynamicImage::ImageRgba32F(image) => visitor.visit(image),
        other => {
            let what = format!("images of kind {:?} are not known", other.color());
            return Err(Error::Invalid { what });
        }
    })
}

/// A number in 0…1 that an integer sample stores.
fn stored(value: f32, coding: Coding) -> f32 {
    let stored = match coding {
        Coding::Light => linear_to_srgb(value),
        Coding::Linear => value,
        Coding::Vector => 0.5 * value + 0.5,
    };
    stored.clamp(0.0, 1.0)
}

impl Sample for u8 {
    #[inline]
    fn decode(self, coding: Coding) -> f32 {
        match coding {
            Coding::Light => srgb8_to_linear(self),
            Coding::Linear => f32::from(self) / 255.0,
            Coding::Vector => f32::from(self) / 127.5 - 1.0,
        }
    }

    #[inline]
    fn encode(value: f32, coding: Coding) -> Self {
        (stored(value, coding) * 255.0).round() as Self
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

    #[inline]
    fn encode(value: f32, coding: Coding) -> Self {
        (stored(value, coding) * 65535.0).round() as Self
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
    fn numbers_beyond_a_sample_are_clamped() {
        assert_eq!(u8::encode(1.7, Coding::Light), 255);
        assert_eq!(u8::encode(-0.1, Coding::Light), 0);
        assert_eq!(u16::encode(-1.5, Coding::Vector), 0);
        assert_eq!(f32::encode(65024.0, Coding::Light), 65024.0);
    }
}
