//! Replaces the texels of an image that may not be trusted by a smooth continuation of the others.
//!
//! Averages are taken where averaging is meant: colors in linear light, normals as vectors that
//! are scaled back to length 1, everything else as stored. Alpha is filled on its own, and a texel
//! that nobody sees, of alpha 0 in a color image, does not lend its color to others. Filters read its
//! color all the same: white under alpha 0 is a halo around a leaf. [`Repair::fill_hidden`] fills it too.
//!
//! Guaranteed: samples of valid texels are not written, but for colors that [`Repair::fill_hidden`] is to
//! fill, so they keep their bits in 8-bit, 16-bit and float images; alpha of a valid texel never is.
//! Only a NaN or an infinity is invalid whatever the mask says. A filled value is
//! rounded to the nearest sample. Not guaranteed: texture detail. The fill is smooth on purpose:
//! mip maps and filters read it, nobody looks at it.
//!
//! [`Repair::fill_hidden`]: crate::Repair::fill_hidden

use image::{DynamicImage, ImageBuffer, Pixel};
use rayon::prelude::*;

use crate::error::Result;
use crate::pyramid::{TexelRole, Texels};
use crate::role::Role;
use crate::samples::{Coding, Group, Sample, with_buffer};
use crate::validity::Validity;
use crate::wrap::Wrap;

/// The result of a repair.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// Number of texels that were invalid and have a value now.
    pub filled: usize,
    /// Number of texels that are still invalid, because no valid texel had a value to lend: none or
    /// all.
    pub remaining: usize,
    /// Valid texels of alpha 0 whose color was filled, and whose alpha was not touched.
    pub hidden: usize,
}

/// Fills the invalid texels of `image`; `wrap` is how its sampler reads beyond the edges, along u
/// and v. Gray and RGB images of 8 or 16 bits or f32 (RGB), each with alpha or without.
///
/// An image of fewer than three color channels is no normal map, and is treated as [`Role::Data`].
///
/// # Errors
/// [`Error::Invalid`](crate::Error::Invalid) if `validity` has another size than `image`, or the image is of a kind not
/// named above.
pub fn repair(
    image: &mut DynamicImage,
    role: Role,
    validity: &Validity,
    wrap: [Wrap; 2],
) -> Result<Outcome> {
    fill(image, role, validity, wrap, false)
}

/// As [`repair`], and with `fills_hidden` fills the colors of valid texels of alpha 0 from those that are
/// seen, whatever the role: for images whose alpha says how much of a texel is there, and nothing else.
///
/// # Errors
/// As [`repair`].
pub(crate) fn fill(
    image: &mut DynamicImage,
    role: Role,
    validity: &Validity,
    wrap: [Wrap; 2],
    fills_hidden: bool,
) -> Result<Outcome> {
    validity.expect_size_of(image)?;
    let job = Job { role, validity, wrap, fills_hidden };
    with_buffer!(image, buffer => job.run(buffer))
}

/// The channels of an image of at least this many texels are filled one after another: the pyramid
/// of one takes half the memory of three at once. At 8192² of RGBA with 8 bits a repair peaks at
/// 2.5 bytes per byte of the image.
const LARGE_TEXELS: usize = 1 << 24;

/// A repair, whatever the kind of image.
#[derive(Clone, Copy)]
struct Job<'a> {
    role: Role,
    validity: &'a Validity,
    wrap: [Wrap; 2],
    /// Whether colors under alpha 0 are filled.
    fills_hidden: bool,
}

impl Job<'_> {
    fn run<P>(self, image: &mut ImageBuffer<P, Vec<P::Subpixel>>) -> Outcome
    where
        P: Pixel,
        P::Subpixel: Sample,
    {
        let (color, alpha) = Group::of(self.role, P::CHANNEL_COUNT as usize);
        let hides = self.fills_hidden || self.role == Role::Color;
        let unseen = alpha.filter(|_| hides).map(|alpha| alpha.first);
        let mut hidden = 0;
        // One bit for texels that are invalid, one for those that remain so.
        let mut state = vec![0u8; self.validity.flags().len()];
        for group in [Some(color), alpha].into_iter().flatten() {
            let unseen = unseen.filter(|_| group.first == 0);
            let parts = self.texel_roles(image, group, unseen);
            let filled = self.fill(image, group, &parts);
            for (texel, _) in parts.iter().enumerate().filter(|(_, part)| **part == TexelRole::Hole)
            {
                let own = &image.as_raw()[texel * group.stride..][..group.stride];
                if self.is_hidden(texel, own, unseen) {
                    hidden += usize::from(filled);
                } else {
                    state[texel] |= if filled { 1 } else { 2 };
                }
            }
        }
        let filled = state.iter().filter(|&&state| state == 1).count();
        let remaining = state.iter().filter(|&&state| state > 1).count();
        Outcome { filled, remaining, hidden }
    }

    /// Whether a texel is valid, and its color is filled because its alpha, in channel `unseen`, is 0.
    fn is_hidden<S: Sample>(self, texel: usize, samples: &[S], unseen: Option<usize>) -> bool {
        self.fills_hidden
            && self.validity.flags()[texel]
            && unseen.is_some_and(|alpha| samples[alpha].is_zero())
    }

    /// The role of each texel in the fill. A valid texel whose alpha, in channel `unseen`, is 0
    /// lends nothing.
    fn texel_roles<S: Sample>(
        self,
        samples: &[S],
        group: Group,
        unseen: Option<usize>,
    ) -> Vec<TexelRole> {
        let texels = samples.par_chunks_exact(group.stride);
        let part = |(texel, &valid): (&[S], &bool)| {
            let mut color = group.of_texel(texel).iter();
            if !valid || !color.all(|sample| sample.is_number()) {
                TexelRole::Hole
            } else if unseen.is_some_and(|alpha| texel[alpha].is_zero()) {
                if self.fills_hidden { TexelRole::Hole } else { TexelRole::Bystander }
            } else {
                TexelRole::Source
            }
        };
        texels.zip(self.validity.flags()).map(part).collect()
    }

    /// Fills one group's holes; false if it has no sources.
    fn fill<S: Sample>(self, samples: &mut [S], group: Group, parts: &[TexelRole]) -> bool {
        let Group { first, count, stride, coding } = group;
        // A vector is written as a whole.
        let decode = S::decoder(coding);
        let apart = coding != Coding::Vector && parts.len() >= LARGE_TEXELS;
        let at_once = if apart { 1 } else { count };
        let fill = |first: usize| {
            let own = first..first + at_once;
            let mut texels = Texels {
                samples: &mut *samples,
                stride,
                size: [self.validity.width(), self.validity.height()],
                wrap: self.wrap,
                read: |texel: &[S], values: &mut [f32]| {
                    for channel in 0..values.len() {
                        values[channel] = decode(texel[first + channel]);
                    }
                },
                write: |texel: &mut [S], values: &mut [f32]| {
                    if coding == Coding::Vector {
                        renormalize(values);
                    }
                    for (value, sample) in values.iter().zip(&mut texel[own.clone()]) {
                        *sample = S::encode(*value, coding);
                    }
                },
            };
            texels.fill(at_once, parts)
        };
        let holes = parts.contains(&TexelRole::Hole);
        !holes || (first..first + count).step_by(at_once).all(fill)
    }
}

/// Scales a vector to length 1; the mean of opposite normals, which has no direction, becomes the
/// flat normal.
pub(crate) fn renormalize(vector: &mut [f32]) {
    let length = vector.iter().map(|v| v * v).sum::<f32>().sqrt();
    if length > 1e-6 {
        vector.iter_mut().for_each(|v| *v /= length);
    } else {
        vector.copy_from_slice(&[0.0, 0.0, 1.0]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::linear_to_srgb;
    use image::ColorType;
    use proptest::prelude::*;

    const KINDS: [ColorType; 10] = [
        ColorType::L8,
        ColorType::La8,
        ColorType::Rgb8,
        ColorType::Rgba8,
        ColorType::L16,
        ColorType::La16,
        ColorType::Rgb16,
        ColorType::Rgba16,
        ColorType::Rgb32F,
        ColorType::Rgba32F,
    ];
    const ROLES: [Role; 3] = [Role::Color, Role::Normal, Role::Data];
    const MODES: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

    /// An image of a kind whose samples are the given bytes; floats are made finite.
    fn image(kind: ColorType, size: [u32; 2], bytes: &[u8]) -> DynamicImage {
        let mut image = DynamicImage::new(size[0], size[1], kind);
        let fill8 = |samples: &mut [u8]| samples.copy_from_slice(&bytes[..samples.len()]);
        let fill16 = |samples: &mut [u16]| {
            for (sample, pair) in samples.iter_mut().zip(bytes.chunks_exact(2)) {
                *sample = u16::from_le_bytes([pair[0], pair[1]]);
            }
        };
        let fill32 = |samples: &mut [f32]| {
            for (sample, &byte) in samples.iter_mut().zip(bytes) {
                *sample = f32::from(byte) / 50.0;
            }
        };
        match &mut image {
            DynamicImage::ImageLuma8(image) => fill8(image),
            DynamicImage::ImageLumaA8(image) => fill8(image),
            DynamicImage::ImageRgb8(image) => fill8(image),
            DynamicImage::ImageRgba8(image) => fill8(image),
            DynamicImage::ImageLuma16(image) => fill16(image),
            DynamicImage::ImageLumaA16(image) => fill16(image),
            DynamicImage::ImageRgb16(image) => fill16(image),
            DynamicImage::ImageRgba16(image) => fill16(image),
            DynamicImage::ImageRgb32F(image) => fill32(image),
            DynamicImage::ImageRgba32F(image) => fill32(image),
            other => unreachable!("{:?}", other.color()),
        }
        image
    }

    prop_compose! {
        fn case()(size in [1..24u32, 1..24u32], kind in 0..10usize, role in 0..3usize, modes in [0..3usize, 0..3usize])(
            bytes in prop::collection::vec(any::<u8>(), (size[0] * size[1] * 8) as usize),
            mask in prop::collection::vec(any::<bool>(), (size[0] * size[1]) as usize),
            size in Just(size), kind in Just(KINDS[kind]), role in Just(ROLES[role]),
            wrap in Just(modes.map(|m| MODES[m])),
        ) -> (DynamicImage, Role, Validity, [Wrap; 2]) {
            let validity = Validity::from_flags(size[0] as usize, size[1] as usize, mask);
            (image(kind, size, &bytes), role, validity, wrap)
        }
    }

    fn gray(samples: &[u8]) -> DynamicImage {
        let image = image::GrayImage::from_raw(samples.len() as u32, 1, samples.to_vec()).unwrap();
        DynamicImage::ImageLuma8(image)
    }

    #[test]
    fn colors_are_averaged_in_linear_light_and_data_as_stored() {
        let validity = Validity::from_flags(3, 1, vec![true, false, true]);
        let middle = |role| {
            let mut image = gray(&[0, 77, 255]);
            let outcome = repair(&mut image, role, &validity, [Wrap::Mirror; 2]).unwrap();
            assert_eq!(outcome, Outcome { filled: 1, ..Outcome::default() });
            image.as_bytes()[1]
        };
        let stored = middle(Role::Data);
        let light = f32::from(stored) / 255.0;
        assert_eq!(middle(Role::Color), (linear_to_srgb(light) * 255.0).round() as u8);
        assert!(stored > 60 && stored < 195);
    }

    #[test]
    fn without_valid_texels_nothing_happens() {
        let mut image = gray(&[1, 2, 3]);
        let none = Validity::from_flags(3, 1, vec![false; 3]);
        let outcome = repair(&mut image, Role::Color, &none, [Wrap::Repeat; 2]).unwrap();
        assert_eq!(outcome, Outcome { remaining: 3, ..Outcome::default() });
        assert_eq!(image.as_bytes(), [1, 2, 3]);
    }

    #[test]
    fn a_mask_of_another_size_is_refused() {
        let other = Validity::from_flags(1, 3, vec![true; 3]);
        let error = repair(&mut gray(&[1, 2, 3]), Role::Color, &other, [Wrap::Repeat; 2]);
        assert!(error.unwrap_err().to_string().contains("3×1"));
    }

    #[test]
    fn an_unseen_texel_lends_its_alpha_but_not_its_color() {
        // Red opaque, hole, green but transparent.
        let raw = vec![255, 0, 0, 255, 9, 9, 9, 9, 0, 255, 0, 0];
        let image = image::RgbaImage::from_raw(3, 1, raw).unwrap();
        let mut image = DynamicImage::ImageRgba8(image);
        let validity = Validity::from_flags(3, 1, vec![true, false, true]);
        repair(&mut image, Role::Color, &validity, [Wrap::Clamp; 2]).unwrap();
        let bytes = image.as_bytes();
        assert_eq!(bytes[..4], [255, 0, 0, 255]);
        assert_eq!(bytes[4..7], [255, 0, 0]);
        assert!(bytes[7] > 50 && bytes[7] < 205);
        assert_eq!(bytes[8..], [0, 255, 0, 0]);
    }

    #[test]
    fn texels_that_are_no_numbers_are_replaced_whatever_the_mask_says() {
        let raw =
            vec![1.0, 2.0, 65024.0, f32::NAN, 0.0, 0.0, 3.0, f32::INFINITY, 0.0, 1.0, 2.0, 65024.0];
        let mut image = DynamicImage::ImageRgb32F(ImageBuffer::from_raw(4, 1, raw).unwrap());
        let all = Validity::from_flags(4, 1, vec![true; 4]);
        let outcome = repair(&mut image, Role::Color, &all, [Wrap::Clamp; 2]).unwrap();
        assert_eq!(outcome, Outcome { filled: 2, ..Outcome::default() });
        for texel in image.as_rgb32f().unwrap().pixels() {
            let expected = [1.0, 2.0, 65024.0];
            assert!(
                texel.0.iter().zip(expected).all(|(v, e): (&f32, f32)| (v / e - 1.0).abs() < 1e-5)
            );
        }
    }

    #[test]
    fn filled_normals_have_length_one() {
        // +x, hole, +y: the mean of the two is shorter than 1 before it is scaled.
        let raw = vec![255, 128, 128, 0, 0, 0, 128, 255, 128];
        let mut image = DynamicImage::ImageRgb8(ImageBuffer::from_raw(3, 1, raw).unwrap());
        let validity = Validity::from_flags(3, 1, vec![true, false, true]);
        repair(&mut image, Role::Normal, &validity, [Wrap::Mirror; 2]).unwrap();
        let normal: Vec<f32> =
            image.as_bytes()[3..6].iter().map(|b| b.decode(Coding::Vector)).collect();
        let length = normal.iter().map(|v| v * v).sum::<f32>().sqrt();
        assert!((length - 1.0).abs() < 0.01, "{normal:?}");
        let mut opposite = [0.0, 1e-9, 0.0];
        renormalize(&mut opposite);
        assert_eq!(opposite, [0.0, 0.0, 1.0]);
    }

    proptest! {
        #[test]
        fn valid_texels_keep_their_bits((before, role, validity, wrap) in case()) {
            let mut after = before.clone();
            let outcome = repair(&mut after, role, &validity, wrap).unwrap();
            let stride = before.color().bytes_per_pixel() as usize;
            let texels = before.as_bytes().chunks(stride).zip(after.as_bytes().chunks(stride));
            for ((before, after), &valid) in texels.zip(validity.flags()) {
                prop_assert!(!valid || before == after);
            }
            prop_assert_eq!(outcome.filled + outcome.remaining, validity.invalid());
            prop_assert!(outcome.remaining == 0 || outcome.filled == 0);
        }

        #[test]
        fn constants_stay_constant((image, role, validity, wrap) in case(), texel in any::<[u8; 8]>()) {
            // A flat normal map of unit length; other roles take any texel.
            let kind = image.color();
            let stride = kind.bytes_per_pixel() as usize;
            let size = [image.width(), image.height()];
            let flat = |_: usize| texel.into_iter().take(stride);
            let bytes = (0..(size[0] * size[1]) as usize).flat_map(flat);
            let bytes: Vec<u8> = bytes.chain([0; 64]).collect();
            let samples = if stride >= 12 { vec![texel[0]; bytes.len()] } else { bytes };
            if role != Role::Normal && validity.valid() > 0 {
                let mut constant = self::image(kind, size, &samples);
                let before = constant.clone();
                let outcome = repair(&mut constant, role, &validity, wrap).unwrap();
                if let (Some(before), Some(after)) = (floats(&before), floats(&constant)) {
                    let near = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-5 * a.abs();
                    prop_assert!(before.iter().zip(after).all(near));
                } else if outcome.remaining == 0 {
                    prop_assert!(before.as_bytes() == constant.as_bytes());
                }
            }
        }

        #[test]
        fn threads_do_not_change_the_bytes((before, role, validity, wrap) in case()) {
            let run = |threads: usize| {
                let mut image = before.clone();
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| repair(&mut image, role, &validity, wrap).unwrap());
                image
            };
            prop_assert!(run(1).as_bytes() == run(2).as_bytes());
        }
    }

    fn floats(image: &DynamicImage) -> Option<&[f32]> {
        match image {
            DynamicImage::ImageRgb32F(image) => Some(image),
            DynamicImage::ImageRgba32F(image) => Some(image),
            _ => None,
        }
    }
}
