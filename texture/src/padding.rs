//! Padding around the charts that may be trusted, because it goes on as the chart does.
//!
//! Tools that bake textures paint past the outline of each chart, and what they paint is often
//! better than any fill: it is the true content of the surface beyond the seam, or the nearest
//! texel of the chart. In other places there is something else. So padding is kept ring by ring
//! where it agrees with what the chart leads one to expect.
//!
//! Expected of a texel in the first ring is the mean of the valid ones among its eight neighbors;
//! in any further ring, the mean of what was *expected* of the neighbors that were kept in the ring
//! before. So a chart's colors are carried outward as they are: padding that fades to black step
//! by step leaves them behind, although each step is small. Means are taken as a repair takes them:
//! in linear light, of vectors, or as stored.
//!
//! Guaranteed: a kept texel is connected to the valid ones through kept texels, and lies no more
//! rings away than were asked for; each is tested once. Not guaranteed: that padding which agrees
//! is right. Black beside a black chart agrees.

use std::collections::HashMap;

use image::{DynamicImage, ImageBuffer, Pixel};

use crate::color::linear_to_srgb;
use crate::error::Result;
use crate::role::Role;
use crate::samples::{Coding, Group, Sample, with_buffer};
use crate::validity::Validity;
use crate::wrap::Wrap;

/// The largest difference of a channel from what is expected: a share of its range; beyond the
/// range, as in float images, a share of what is expected.
///
/// Four atlases of a racquet, which its tool has padded: of the texels that bilinear taps read around
/// their charts, one ring keeps 99.7, 100, 97 and, around thin strings, 73 % by color, and 99.7, 100,
/// 99 and 99.9 % by normal.
const TOLERANCE: f32 = 0.1;

/// The least cosine between a normal and the one that is expected: cos 15°.
const LEAST_COSINE: f32 = 0.965_925_8;

/// The invalid texels in up to `rings` rings around the valid ones that agree with them; `wrap` is
/// how the image is read beyond its edges, along u and v.
///
/// A texel agrees if all its samples are numbers and
///
/// - in [`Role::Color`], no channel is farther than 0.1 from the one expected, both encoded as sRGB
///   (25 steps of 8 bits); above 1, as in float images, no farther than a tenth of it;
/// - in [`Role::Normal`], it is turned by no more than 15°;
/// - in [`Role::Data`], and in alpha, no channel is farther than 0.1 from the one expected, as
///   stored; above 1, no farther than a tenth of it.
///
/// The color of a texel that nobody sees, of alpha 0 in a color image, is neither tested nor
/// expected of others.
///
/// # Errors
/// [`Error::Invalid`](crate::Error::Invalid) if `validity` has another size than `image`, or the image is of a kind that
/// [`repair`](fn@crate::repair) does not know.
pub fn agreeing_padding(
    image: &DynamicImage,
    role: Role,
    validity: &Validity,
    wrap: [Wrap; 2],
    rings: usize,
) -> Result<Validity> {
    validity.expect_size_of(image)?;
    let size = [image.width() as usize, image.height() as usize];
    let kept = with_buffer!(image, buffer => Padding::new(buffer, role, size).grow(validity, wrap, rings))?;
    Ok(Validity::from_flags(size[0], size[1], kept))
}

/// Adds to what is valid the padding that [`agreeing_padding`] finds; returns how many texels that
/// is.
///
/// # Errors
/// As [`agreeing_padding`].
pub fn keep_padding(
    image: &DynamicImage,
    role: Role,
    validity: &mut Validity,
    wrap: [Wrap; 2],
    rings: usize,
) -> Result<usize> {
    if rings == 0 {
        return Ok(0);
    }
    let padding = agreeing_padding(image, role, validity, wrap, rings)?;
    validity.union(&padding);
    Ok(padding.valid())
}

/// The look of a texel, found or expected: color as it is averaged, and alpha.
#[derive(Clone, Copy, Debug)]
struct Look {
    color: [f32; 3],
    /// Whether anybody sees the color.
    seen: bool,
    alpha: f32,
}

/// An image in which padding is looked for.
struct Padding<'a, S> {
    samples: &'a [S],
    color: Group,
    alpha: Option<Group>,
    /// Whether alpha 0 hides the color.
    hides: bool,
    size: [usize; 2],
}

impl<'a, S: Sample> Padding<'a, S> {
    fn new<P: Pixel<Subpixel = S>>(
        image: &'a ImageBuffer<P, Vec<S>>,
        role: Role,
        size: [usize; 2],
    ) -> Self {
        let (color, alpha) = Group::of(role, P::CHANNEL_COUNT as usize);
        Self { samples: image, color, alpha, hides: role == Role::Color, size }
    }

    /// One flag per texel: whether it is padding to keep.
    fn grow(&self, validity: &Validity, wrap: [Wrap; 2], rings: usize) -> Vec<bool> {
        let valid = validity.flags();
        let mut kept = vec![false; valid.len()];
        let mut reached = valid.to_vec();
        let mut sources: Vec<usize> = if rings == 0 {
            Vec::new()
        } else {
            (0..valid.len()).filter(|&texel| valid[texel]).collect()
        };
        let mut expected: HashMap<usize, Look> = HashMap::new();
        for _ in 0..rings {
            let mut ring = Vec::new();
            for &source in &sources {
                let near = neighbors(source, self.size, wrap);
                ring.extend(
                    near.into_iter().filter(|&n| !std::mem::replace(&mut reached[n], true)),
                );
            }
            let looks = ring.iter().filter_map(|&texel| {
                let near = neighbors(texel, self.size, wrap).into_iter();
                let known = near.filter_map(|neighbor| {
                    let expected = || expected.get(&neighbor).copied();
                    if valid[neighbor] { self.look(neighbor) } else { expected() }
                });
                let should = mean(known)?;
                self.look(texel).filter(|is| self.agree(is, &should)).map(|_| (texel, should))
            });
            expected = looks.collect();
            sources = ring.into_iter().filter(|texel| expected.contains_key(texel)).collect();
            if sources.is_empty() {
                break;
            }
            sources.iter().for_each(|&texel| kept[texel] = true);
        }
        kept
    }

    /// The look of a texel; `None` if a sample is no number.
    fn look(&self, texel: usize) -> Option<Look> {
        let start = texel * self.color.stride;
        let samples = &self.samples[start..start + self.color.stride];
        if !samples.iter().all(|sample| sample.is_number()) {
            return None;
        }
        let mut color = [0.0; 3];
        for (value, sample) in color.iter_mut().zip(self.color.of_texel(samples)) {
            *value = sample.decode(self.color.coding);
        }
        let alpha = self.alpha.map(|alpha| samples[alpha.first]);
        Some(Look {
            color,
            seen: !(self.hides && alpha.is_some_and(Sample::is_zero)),
            alpha: alpha.map_or(1.0, |alpha| alpha.decode(Coding::Linear)),
        })
    }

    fn agree(&self, is: &Look, should: &Look) -> bool {
        let colors = || match self.color.coding {
            Coding::Vector => cosine(is.color, should.color) >= LEAST_COSINE,
            Coding::Light => is
                .color
                .iter()
                .zip(should.color)
                .all(|(&is, should)| near(linear_to_srgb(is), linear_to_srgb(should))),
            Coding::Linear => {
                is.color.iter().zip(should.color).all(|(&is, should)| near(is, should))
            }
        };
        near(is.alpha, should.alpha) && (!is.seen || should.seen && colors())
    }
}

fn near(is: f32, should: f32) -> bool {
    (is - should).abs() <= TOLERANCE * should.abs().max(1.0)
}

/// The cosine of the angle between two vectors; 0 if one of them has no direction.
fn cosine(a: [f32; 3], b: [f32; 3]) -> f32 {
    let dot = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
    let lengths = (dot(a, a) * dot(b, b)).sqrt();
    if lengths > 1e-6 { dot(a, b) / lengths } else { 0.0 }
}

/// The mean look; `None` of nothing.
fn mean(looks: impl Iterator<Item = Look>) -> Option<Look> {
    let (mut color, mut alpha, mut seen, mut all) = ([0.0; 3], 0.0, 0.0, 0.0);
    for look in looks {
        all += 1.0;
        alpha += look.alpha;
        if look.seen {
            seen += 1.0;
            color = std::array::from_fn(|k| color[k] + look.color[k]);
        }
    }
    let color = color.map(|sum: f32| sum / f32::max(seen, 1.0));
    (all > 0.0).then(|| Look { color, seen: seen > 0.0, alpha: alpha / all })
}

/// The eight texels around one, wrapped; some may be the same, or the texel itself.
fn neighbors(texel: usize, [width, height]: [usize; 2], wrap: [Wrap; 2]) -> [usize; 8] {
    const STEPS: [[i64; 2]; 8] =
        [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];
    let at = [(texel % width) as i64, (texel / width) as i64];
    STEPS.map(|[dx, dy]| {
        wrap[1].texel(at[1] + dy, height) * width + wrap[0].texel(at[0] + dx, width)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, Rgb32FImage, RgbImage, RgbaImage};

    const CLAMP: [Wrap; 2] = [Wrap::Clamp; 2];

    /// Valid are columns `0..valid` of one row; which further ones are kept, of `rings`.
    fn row(image: &DynamicImage, role: Role, valid: usize, rings: usize) -> Vec<usize> {
        let width = image.width() as usize;
        let flags = (0..width).map(|x| x < valid).collect();
        let validity = Validity::from_flags(width, 1, flags);
        let kept = agreeing_padding(image, role, &validity, CLAMP, rings).unwrap();
        (0..width).filter(|&x| kept.is_valid(x, 0)).collect()
    }

    fn gray(samples: &[u8]) -> DynamicImage {
        let size = samples.len() as u32;
        DynamicImage::ImageLuma8(image::GrayImage::from_raw(size, 1, samples.to_vec()).unwrap())
    }

    #[test]
    fn padding_is_kept_as_far_as_it_agrees_and_was_asked_for() {
        let image = gray(&[100, 100, 90, 120, 100, 200, 100]);
        assert_eq!(row(&image, Role::Data, 2, 0), []);
        assert_eq!(row(&image, Role::Data, 2, 2), [2, 3]);
        // Nothing is reached past a texel that does not agree.
        assert_eq!(row(&image, Role::Data, 2, 99), [2, 3, 4]);
    }

    #[test]
    fn padding_that_fades_is_left_behind() {
        let fading: Vec<u8> = (0..12).map(|x| 200 - 10 * x as u8).collect();
        assert_eq!(row(&gray(&fading), Role::Color, 1, 11), [1, 2]);
    }

    #[test]
    fn one_chart_has_padding_and_the_other_garbage() {
        // Charts at columns 6…10 and 22…26; around the first its own color, around the other noise.
        let chart = |x: u32, y: u32| (6..10).contains(&y) && (6..10).contains(&(x % 16));
        let image = RgbImage::from_fn(32, 16, |x, y| match (chart(x, y), x < 16) {
            (true, false) => Rgb([20, 120, 60]),
            (_, true) => Rgb([180, 90, 40]),
            _ => Rgb([(x * 97 + y * 57) as u8 | 128, 10, (x * 31 + y * 83) as u8]),
        });
        let texels = (0..16).flat_map(|y| (0..32).map(move |x| (x, y)));
        let validity = Validity::from_flags(32, 16, texels.map(|(x, y)| chart(x, y)).collect());
        let image = DynamicImage::ImageRgb8(image);
        let kept = agreeing_padding(&image, Role::Color, &validity, CLAMP, 3).unwrap();
        for y in 0..16 {
            for x in 0..32 {
                let ring =
                    (3..13).contains(&x) && (3..13).contains(&y) && !chart(x as u32, y as u32);
                assert_eq!(kept.is_valid(x, y), ring, "{x} {y}");
            }
        }
    }

    #[test]
    fn normals_agree_by_their_angle() {
        let tilted = |degrees: f32| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            Rgb([sin, 0.0, cos].map(|v: f32| (v * 127.5 + 127.5).round() as u8))
        };
        let normals = |last| {
            let image = RgbImage::from_fn(3, 1, |x, _| if x < 2 { tilted(0.0) } else { last });
            row(&DynamicImage::ImageRgb8(image), Role::Normal, 2, 1)
        };
        assert_eq!(normals(tilted(14.0)), [2]);
        assert_eq!(normals(tilted(16.5)), []);
        assert_eq!(normals(Rgb([0, 0, 0])), [], "black is no normal");
    }

    #[test]
    fn light_above_one_agrees_by_its_share_and_what_is_no_number_never() {
        let light = |last: f32| {
            let texel = |x| if x < 1 { Rgb([40.0; 3]) } else { Rgb([last; 3]) };
            let image = Rgb32FImage::from_fn(2, 1, |x, _| texel(x));
            row(&DynamicImage::ImageRgb32F(image), Role::Color, 1, 1)
        };
        assert_eq!(light(48.0), [1]);
        for last in [55.0, 65024.0, f32::INFINITY, f32::NAN, 0.0] {
            assert_eq!(light(last), [], "{last}");
        }
    }

    #[test]
    fn what_nobody_sees_has_no_color() {
        let row = |texels: [[u8; 4]; 3]| {
            let image = RgbaImage::from_raw(3, 1, texels.concat()).unwrap();
            row(&DynamicImage::ImageRgba8(image), Role::Color, 1, 2)
        };
        let (red, green) = ([255, 0, 0], [0, 255, 0]);
        let with = |[r, g, b]: [u8; 3], alpha| [r, g, b, alpha];
        assert_eq!(row([with(red, 0), with(green, 0), with(red, 9)]), [1]);
        assert_eq!(row([with(red, 255), with(red, 0), with(red, 255)]), []);
        assert_eq!(row([with(red, 5), with(green, 0), with(red, 3)]), [1, 2]);
    }

    #[test]
    fn sizes_must_match() {
        let validity = Validity::from_flags(1, 1, vec![true]);
        assert!(agreeing_padding(&gray(&[1, 2]), Role::Data, &validity, CLAMP, 1).is_err());
    }
}
