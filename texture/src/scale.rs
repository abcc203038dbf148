//! Smaller images whose texels hold nothing but what was valid.
//!
//! A texel of the smaller image is the mean over its exact extent, as in a mip map made by a box
//! filter, but of valid texels only: Σ w v x / Σ w v, with w the share of the extent that a texel
//! takes, v 1 or 0 and x its value in the space where means are meant. So what lies around a chart
//! does not bleed into its rim, as it does where a picture program scales an atlas. A texel into
//! which no valid one went is invalid, and left to a repair.
//!
//! Guaranteed: where all texels are valid and seen it is the plain mean, in linear light for colors
//! and of length 1 for normals, rounded to the nearest sample. Colors of texels that nobody sees, of
//! alpha 0, count only where there are no others.

mod halves;

use image::{DynamicImage, ImageBuffer, Pixel};
use rayon::prelude::*;

use crate::error::Result;
use crate::repair::renormalize;
use crate::role::Role;
use crate::samples::{Coding, Group, Sample, with_buffer};
use crate::validity::Validity;
use halves::halve_often;

/// The image scaled down by 2 to the power of `halvings`, rounded down to no less than one texel
/// along an axis, and which of its texels are valid.
///
/// # Errors
/// [`Error::Invalid`](crate::Error::Invalid) if `validity` has another size than `image`, or the image is of a kind that
/// [`repair`](fn@crate::repair) does not know.
pub fn scale_down(
    image: &DynamicImage,
    role: Role,
    validity: &Validity,
    halvings: u32,
) -> Result<(DynamicImage, Validity)> {
    validity.expect_size_of(image)?;
    let size = [image.width() as usize, image.height() as usize];
    let smaller = size.map(|side| side.checked_shr(halvings).unwrap_or(0).max(side.min(1)));
    let job = Job { role, validity, size, smaller };
    let (image, valid) = with_buffer!(image, buffer => {
        let (buffer, valid) = job.run(buffer);
        (DynamicImage::from(buffer), valid)
    })?;
    Ok((image, Validity::from_flags(smaller[0], smaller[1], valid)))
}

/// The image scaled down again and again, to halves of it up to so many times: each as [`scale_down`] makes it.
///
/// # Errors
/// As [`scale_down`].
pub fn scale_down_often(
    image: &DynamicImage,
    role: Role,
    validity: &Validity,
    times: u32,
) -> Result<Vec<(DynamicImage, Validity)>> {
    validity.expect_size_of(image)?;
    let sizes = [image.width(), image.height()];
    let is_whole = sizes.iter().all(|side| times < 32 && side.is_multiple_of(1 << times));
    if !is_whole || image.color().has_alpha() || times < 2 {
        return (1..=times).map(|halvings| scale_down(image, role, validity, halvings)).collect();
    }
    with_buffer!(image, buffer => {
        let halves = halve_often(buffer, role, validity, times);
        halves.into_iter().map(|(image, valid)| (DynamicImage::from(image), valid)).collect()
    })
}

/// A change of an image's size.
#[derive(Clone, Copy)]
struct Job<'a> {
    role: Role,
    validity: &'a Validity,
    size: [usize; 2],
    smaller: [usize; 2],
}

/// A mean in the making: color of what is seen, color of all, and alpha, each with its weight.
#[derive(Clone, Copy, Default)]
struct Sums {
    seen: [f64; 3],
    seen_weight: f64,
    all: [f64; 3],
    alpha: f64,
    weight: f64,
}

impl Job<'_> {
    fn run<P>(
        &self,
        image: &ImageBuffer<P, Vec<P::Subpixel>>,
    ) -> (ImageBuffer<P, Vec<P::Subpixel>>, Vec<bool>)
    where
        P: Pixel,
        P::Subpixel: Sample,
    {
        let [width, height] = self.smaller;
        let stride = P::CHANNEL_COUNT as usize;
        let samples: &[P::Subpixel] = image;
        let mut smaller = ImageBuffer::new(width as u32, height as u32);
        let mut valid = vec![false; width * height];
        if width * height > 0 {
            let rows = smaller.par_chunks_exact_mut(width * stride);
            rows.zip(valid.par_chunks_exact_mut(width)).enumerate().for_each(
                |(y, (row, valid))| {
                    let texels = row.chunks_exact_mut(stride).zip(valid);
                    for (x, (texel, valid)) in texels.enumerate() {
                        *valid = self.mean(samples, [x, y], texel);
                    }
                },
            );
        }
        (smaller, valid)
    }

    /// Writes the mean over a texel's extent; false, and nothing written, if none of it is valid.
    fn mean<S: Sample>(&self, samples: &[S], [x, y]: [usize; 2], out: &mut [S]) -> bool {
        let (color, alpha) = Group::of(self.role, out.len());
        let mut sums = Sums::default();
        for (v, high) in extent(y, self.size[1], self.smaller[1]) {
            for (u, wide) in extent(x, self.size[0], self.smaller[0]) {
                let texel = v * self.size[0] + u;
                let own = &samples[texel * out.len()..][..out.len()];
                if self.validity.flags()[texel] && own.iter().all(|sample| sample.is_number()) {
                    let alpha = alpha.map(|alpha| own[alpha.first]);
                    let hidden = self.role == Role::Color && alpha.is_some_and(S::is_zero);
                    let alpha = alpha.map_or(1.0, |alpha| alpha.decode(Coding::Linear));
                    let texel =
                        color.of_texel(own).iter().map(|sample| sample.decode(color.coding));
                    sums.add(texel, alpha, hidden, wide * high);
                }
            }
        }
        if sums.weight == 0.0 {
            return false;
        }
        let mut mean = sums.color();
        if color.coding == Coding::Vector {
            renormalize(&mut mean);
        }
        for (sample, value) in out[..color.count].iter_mut().zip(mean) {
            *sample = S::encode(value, color.coding);
        }
        if let Some(alpha) = alpha {
            out[alpha.first] = S::encode((sums.alpha / sums.weight) as f32, Coding::Linear);
        }
        true
    }
}

impl Sums {
    fn add(&mut self, color: impl Iterator<Item = f32>, alpha: f32, hidden: bool, weight: f64) {
        for (channel, value) in color.enumerate() {
            let value = weight * f64::from(value);
            self.all[channel] += value;
            self.seen[channel] += if hidden { 0.0 } else { value };
        }
        self.alpha += weight * f64::from(alpha);
        self.weight += weight;
        self.seen_weight += if hidden { 0.0 } else { weight };
    }

    fn color(&self) -> [f32; 3] {
        let any_seen = self.seen_weight > 0.0;
        let (sum, weight) =
            if any_seen { (self.seen, self.seen_weight) } else { (self.all, self.weight) };
        sum.map(|sum| (sum / weight) as f32)
    }
}

/// The texels of an axis of `size` under a texel of the axis scaled to `smaller`, and how much of
/// each lies under it, in units that add up to `size`.
fn extent(texel: usize, size: usize, smaller: usize) -> impl Iterator<Item = (usize, f64)> {
    let [start, end] = [texel * size, (texel + 1) * size];
    (start / smaller..end.div_ceil(smaller)).map(move |under| {
        let share = ((under + 1) * smaller).min(end) - (under * smaller).max(start);
        (under, share as f64)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mips::{ColorEncoding, Mips};
    use image::{GrayImage, Luma, Rgb, Rgb32FImage, RgbImage, RgbaImage};

    fn all(image: &DynamicImage) -> Validity {
        let [width, height] = [image.width() as usize, image.height() as usize];
        Validity::from_flags(width, height, vec![true; width * height])
    }

    #[test]
    fn a_checkerboard_on_magenta_has_no_magenta_at_half_its_size() {
        let chart = |x: u32, y: u32| (5..19).contains(&x) && (3..20).contains(&y);
        let image = RgbImage::from_fn(24, 24, |x, y| match (chart(x, y), (x + y) % 2) {
            (false, _) => Rgb([255, 0, 255]),
            (_, 0) => Rgb([0; 3]),
            _ => Rgb([255; 3]),
        });
        let texels = (0..24).flat_map(|y| (0..24).map(move |x| (x, y)));
        let validity = Validity::from_flags(24, 24, texels.map(|(x, y)| chart(x, y)).collect());
        for halvings in 1..=4 {
            let (mut half, valid) =
                scale_down(&image.clone().into(), Role::Color, &validity, halvings).unwrap();
            assert_eq!(half.width() as usize, 24 >> halvings);
            // Columns 2…9 hold some of columns 5…18, rows 1…9 some of rows 3…19.
            assert!(halvings > 1 || valid.valid() == 8 * 9);
            crate::repair::repair(&mut half, Role::Color, &valid, [crate::wrap::Wrap::Clamp; 2])
                .unwrap();
            assert!(half.to_rgb8().pixels().all(|Rgb([r, g, b])| r == g && g == b));
        }
    }

    #[test]
    fn one_after_the_other_is_each_by_itself() {
        let noise = |x: u32, y: u32| (x * x * 7 + y * 31 + x * y) as u8;
        let colors = RgbImage::from_fn(24, 16, |x, y| Rgb([noise(x, y), noise(y, x), 128]));
        let deep = DynamicImage::from(colors.clone()).into_rgb16().into();
        let gray = GrayImage::from_fn(24, 16, |x, y| Luma([noise(x, y)])).into();
        let texels = (0..16).flat_map(|y| (0..24).map(move |x| noise(x, y) % 3 > 0 && x > 8));
        let validity = Validity::from_flags(24, 16, texels.collect());
        for image in [colors.into(), deep, gray] {
            for role in [Role::Color, Role::Normal, Role::Data] {
                let all = scale_down_often(&image, role, &validity, 3).unwrap();
                assert_eq!(all.len(), 3);
                for (halvings, (found, valid)) in (1..).zip(all) {
                    let (one, own) = scale_down(&image, role, &validity, halvings).unwrap();
                    assert_eq!((found.as_bytes(), &valid), (one.as_bytes(), &own), "{role:?}");
                }
            }
        }
    }

    #[test]
    fn where_all_is_valid_it_is_a_mip_map() {
        let picture = RgbaImage::from_fn(21, 13, |x, y| {
            image::Rgba([(x * 11) as u8, (y * 19) as u8, (x * y) as u8, 255])
        });
        for (role, encoding) in
            [(Role::Color, ColorEncoding::Srgb), (Role::Data, ColorEncoding::Linear)]
        {
            let mips = Mips::from_rgba8(21, 13, &picture, encoding).unwrap();
            let image = picture.clone().into();
            let (half, valid) = scale_down(&image, role, &all(&image), 1).unwrap();
            assert_eq!((half.width(), half.height(), valid.invalid()), (10, 6, 0));
            for (x, y, texel) in half.to_rgba8().enumerate_pixels() {
                let coding = if role == Role::Color { Coding::Light } else { Coding::Linear };
                let mip = mips.level(1).texel(x as usize, y as usize);
                let near = |k: usize| (texel.0[k].decode(coding) - mip[k]).abs() < 1e-6;
                assert!((0..3).all(near), "{x} {y}: {texel:?} {mip:?}");
            }
        }
    }

    #[test]
    fn normals_keep_their_length_and_what_nobody_sees_its_color_to_itself() {
        let image = RgbImage::from_fn(2, 1, |x, _| {
            Rgb(if x == 0 { [255, 128, 128] } else { [128, 255, 128] })
        })
        .into();
        let (half, _) = scale_down(&image, Role::Normal, &all(&image), 1).unwrap();
        let length = half.as_bytes().iter().map(|b| b.decode(Coding::Vector).powi(2)).sum::<f32>();
        assert!((length - 1.0).abs() < 0.02, "{length}");
        let unseen = |alpha: u8| {
            let texels = vec![255, 0, 0, alpha, 0, 255, 0, 0];
            let image = RgbaImage::from_raw(2, 1, texels).unwrap().into();
            scale_down(&image, Role::Color, &all(&image), 1).unwrap().0.into_bytes()
        };
        assert_eq!(unseen(255), [255, 0, 0, 128]);
        assert_eq!(unseen(0), [188, 188, 0, 0]);
    }

    #[test]
    fn no_size_is_too_small_and_what_is_no_number_does_not_count() {
        let image: DynamicImage = GrayImage::from_pixel(3, 1, Luma([9])).into();
        for halvings in [2, 31, 32, 63, 64, u32::MAX] {
            let (small, valid) = scale_down(&image, Role::Data, &all(&image), halvings).unwrap();
            assert_eq!((small.width(), small.height(), small.as_bytes()), (1, 1, &[9][..]));
            assert_eq!(valid.valid(), 1);
        }
        let lights = |last: f32| {
            let texels = vec![2.0, 2.0, 2.0, last, last, last];
            let image = Rgb32FImage::from_raw(2, 1, texels).unwrap().into();
            let (small, _) = scale_down(&image, Role::Color, &all(&image), 1).unwrap();
            small.to_rgb32f().into_raw()
        };
        assert_eq!((lights(4.0), lights(f32::INFINITY)), (vec![3.0; 3], vec![2.0; 3]));
        assert!(
            scale_down(&image, Role::Data, &Validity::from_flags(1, 1, vec![true]), 1).is_err()
        );
    }
}
