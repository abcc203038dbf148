//! Alpha that says how much of a texel is there: what it tells of an image, and how much of a cutout
//! is left as it is scaled.
//!
//! A leaf is drawn where alpha is at least a cutoff. Means of alpha are not, as blades thinner than a
//! texel have means below it: a tree goes bald with distance. So alpha is scaled until as many texels
//! pass as before (Castaño, "Computing alpha mipmaps", 2010), here not by bisection, but by the one
//! factor that puts the texel of that rank at the cutoff.

use image::{DynamicImage, ImageBuffer, Pixel};

use crate::error::{Error, Result};
use crate::role::Role;
use crate::samples::{Coding, Group, Sample, with_buffer};
use crate::validity::Validity;

/// Alpha of data, which may be a channel like any other, says what is there only if it is 0 along
/// this share of the border…
const BORDER_SHARE: f64 = 0.25;

/// …and in this share of the image.
const IMAGE_SHARE: f64 = 0.02;

/// Whether alpha tells what is background: some texels have alpha 0, and others have not. In
/// [`Role::Data`] a quarter of the border and a fiftieth of the image must have it.
pub fn alpha_tells(image: &DynamicImage, role: Role) -> bool {
    let hidden = hidden_texels(image);
    let [width, height] = [image.width() as usize, image.height() as usize];
    let count = hidden.iter().filter(|&&hidden| hidden).count();
    if count == 0 || count == hidden.len() {
        return false;
    }
    let is_border = |texel: usize| {
        let (x, y) = (texel % width, texel / width);
        x == 0 || y == 0 || x + 1 == width || y + 1 == height
    };
    let border: Vec<bool> =
        (0..hidden.len()).filter(|&texel| is_border(texel)).map(|texel| hidden[texel]).collect();
    let on_border = border.iter().filter(|&&hidden| hidden).count();
    role != Role::Data
        || on_border as f64 >= BORDER_SHARE * border.len() as f64
            && count as f64 >= IMAGE_SHARE * hidden.len() as f64
}

/// The texels whose alpha is not 0; all if there is none.
pub fn seen_texels(image: &DynamicImage) -> Validity {
    let seen = hidden_texels(image).into_iter().map(|hidden| !hidden).collect();
    Validity::from_flags(image.width() as usize, image.height() as usize, seen)
}

/// One flag per texel: whether it has an alpha, and that is 0. None of an image of a kind that is not
/// known.
pub(crate) fn hidden_texels(image: &DynamicImage) -> Vec<bool> {
    let hidden = with_buffer!(image, buffer => are_hidden(buffer));
    hidden.unwrap_or_else(|_| vec![false; image.width() as usize * image.height() as usize])
}

fn are_hidden<P>(image: &ImageBuffer<P, Vec<P::Subpixel>>) -> Vec<bool>
where
    P: Pixel,
    P::Subpixel: Sample,
{
    let stride = P::CHANNEL_COUNT as usize;
    let alpha = Group::of(Role::Data, stride).1;
    let texels = image.as_raw().chunks_exact(stride);
    texels.map(|texel| alpha.is_some_and(|alpha| texel[alpha.first].is_zero())).collect()
}

/// The alpha of each valid texel; `None` if the image has none, or no texel is valid.
fn valid_alpha<P>(image: &ImageBuffer<P, Vec<P::Subpixel>>, validity: &Validity) -> Option<Vec<f32>>
where
    P: Pixel,
    P::Subpixel: Sample,
{
    let stride = P::CHANNEL_COUNT as usize;
    let alpha = Group::of(Role::Data, stride).1?;
    let texels = image.as_raw().chunks_exact(stride).zip(validity.flags());
    let alphas = texels.filter(|(_, valid)| **valid);
    let alphas: Vec<f32> =
        alphas.map(|(texel, _)| texel[alpha.first].decode(Coding::Linear)).collect();
    (!alphas.is_empty()).then_some(alphas)
}

/// The share of valid texels whose alpha is `cutoff` (0…1) or more; `None` if the image has no alpha,
/// or no texel is valid.
///
/// # Errors
/// [`Error::Invalid`] if `validity` has another size than `image`, or the image is of a kind that
/// [`repair`](fn@crate::repair) does not know.
pub fn alpha_coverage(
    image: &DynamicImage,
    validity: &Validity,
    cutoff: f32,
) -> Result<Option<f64>> {
    validity.expect_size_of(image)?;
    let alphas = with_buffer!(image, buffer => valid_alpha(buffer, validity))?;
    Ok(alphas.map(|alphas| {
        alphas.iter().filter(|&&alpha| alpha >= cutoff).count() as f64 / alphas.len() as f64
    }))
}

/// Scales alpha so that a share of `coverage` of the valid texels has an alpha of `cutoff` or more;
/// returns the factor, 1 if nothing is to be done.
///
/// Guaranteed: alpha 0 stays 0, and no order of two alphas is turned round; colors are not touched.
/// The share is met to half of those texels that have the same alpha as the last one to pass. Not
/// guaranteed: which texels pass. A share that asks for texels of alpha 0 is met without those.
///
/// # Errors
/// As [`alpha_coverage`]; also if `cutoff` is not above 0 and below or at 1.
pub fn keep_coverage(
    image: &mut DynamicImage,
    validity: &Validity,
    cutoff: f32,
    coverage: f64,
) -> Result<f32> {
    validity.expect_size_of(image)?;
    if !(cutoff > 0.0 && cutoff <= 1.0) {
        let what = format!("an alpha cutoff of {cutoff}: it is above 0 and up to 1");
        return Err(Error::Invalid { what });
    }
    let alphas = with_buffer!(&*image, buffer => valid_alpha(buffer, validity))?;
    let Some(last) = alphas.and_then(|alphas| last_to_pass(alphas, cutoff, coverage)) else {
        return Ok(1.0);
    };
    with_buffer!(image, buffer => scale(buffer, last, cutoff))
}

/// The alpha to put at the cutoff; `None` if all may stay.
fn last_to_pass(mut alphas: Vec<f32>, cutoff: f32, coverage: f64) -> Option<f32> {
    let passing = |alphas: &[f32], cutoff: f32| alphas.iter().filter(|a| **a >= cutoff).count();
    let wanted = (coverage * alphas.len() as f64).round() as usize;
    let as_it_is = passing(&alphas, cutoff);
    if wanted == as_it_is {
        return None;
    }
    alphas.sort_unstable_by(|a, b| b.total_cmp(a));
    // The last that is to pass, and the first that is not to: all of one alpha pass, or none.
    let last = *alphas[..wanted].last()?;
    let above = alphas[..wanted].iter().rev().copied().find(|alpha| *alpha > last);
    let with = passing(&alphas, last);
    let without = above.map_or(0, |above| passing(&alphas, above));
    let better = if wanted - without < with - wanted { above } else { Some(last) };
    let at = better.filter(|alpha| *alpha > 0.0).or(above)?;
    let reached = passing(&alphas, at);
    (reached.abs_diff(wanted) < as_it_is.abs_diff(wanted)).then_some(at)
}

/// Scales alphas so that `last` comes to the first sample that is `cutoff` or more; the factor.
fn scale<P>(image: &mut ImageBuffer<P, Vec<P::Subpixel>>, last: f32, cutoff: f32) -> f32
where
    P: Pixel,
    P::Subpixel: Sample,
{
    let stored = |value: f32| P::Subpixel::encode(value, Coding::Linear).decode(Coding::Linear);
    let nearest = stored(cutoff);
    let target = if nearest >= cutoff { nearest } else { stored(cutoff + 0.5 / 255.0) };
    // A hair more, as the product of a quotient may come out a hair below it.
    let factor = target / last * (1.0 + 1e-6);
    let stride = P::CHANNEL_COUNT as usize;
    if let Some(alpha) = Group::of(Role::Data, stride).1 {
        for texel in image.chunks_exact_mut(stride) {
            let scaled = factor * texel[alpha.first].decode(Coding::Linear);
            texel[alpha.first] = P::Subpixel::encode(scaled.min(1.0), Coding::Linear);
        }
    }
    factor
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repair::{Outcome, fill};
    use crate::scale::scale_down;
    use crate::wrap::Wrap;
    use image::{Rgba, RgbaImage};

    fn all(image: &DynamicImage) -> Validity {
        let [width, height] = [image.width() as usize, image.height() as usize];
        Validity::from_flags(width, height, vec![true; width * height])
    }

    #[test]
    fn thin_blades_keep_their_coverage_as_they_are_scaled() {
        // Blades two texels wide, denser here and there: the means of most lie below the cutoff.
        let blade = |x: u32, y: u32| (3 * x + 2 * y) % (5 + y / 12 + x / 40) < 2;
        let image: DynamicImage = RgbaImage::from_fn(256, 256, |x, y| {
            Rgba([60, 120, 30, if blade(x, y) { 255 } else { 0 }])
        })
        .into();
        let before = alpha_coverage(&image, &all(&image), 0.5).unwrap().unwrap();
        for halvings in 1..5 {
            let (mut small, valid) =
                scale_down(&image, Role::Color, &all(&image), halvings).unwrap();
            let balder = alpha_coverage(&small, &valid, 0.5).unwrap().unwrap();
            let colors = small.to_rgb8();
            let factor = keep_coverage(&mut small, &valid, 0.5, before).unwrap();
            let after = alpha_coverage(&small, &valid, 0.5).unwrap().unwrap();
            // The fewer texels went into one, the fewer alphas there are.
            let most = if halvings < 3 { (balder - before).abs() } else { 0.05 };
            assert!((after - before).abs() <= most, "{halvings}: {before} {balder} {after}");
            assert!(halvings < 3 || balder < 0.7 * before && factor > 1.2, "{halvings}: {balder}");
            assert_eq!(small.to_rgb8(), colors);
        }
    }

    #[test]
    fn the_last_that_passes_comes_to_the_cutoff() {
        let last = |alphas: &[f32], coverage| last_to_pass(alphas.to_vec(), 0.5, coverage);
        let steps = [0.0, 0.1, 0.2, 0.4, 0.8];
        assert_eq!(last(&steps, 0.2), None, "as it is");
        assert_eq!(last(&steps, 0.4), Some(0.4));
        assert_eq!(last(&steps, 0.8), Some(0.1));
        // What is not there can't be brought back.
        assert_eq!(last(&steps, 1.0), Some(0.1));
        assert_eq!(last(&[0.0; 4], 0.5), None);
        // Too many pass: alpha is made less.
        assert_eq!(last(&[0.6, 0.8, 0.9], 1.0 / 3.0), Some(0.9));
        // Of equals all pass or none, whichever is nearer.
        assert_eq!(last(&[0.9, 0.2, 0.2, 0.2], 0.5), None);
        assert_eq!(last(&[0.9, 0.2, 0.2, 0.2], 0.75), Some(0.2));
    }

    #[test]
    fn any_cutoff_is_passed_in_bytes_by_as_many_as_were_asked_for() {
        for cutoff in (1..=100).map(|percent| percent as f32 / 100.0) {
            let mut image: DynamicImage =
                RgbaImage::from_fn(10, 1, |x, _| Rgba([0, 0, 0, 10 + 20 * x as u8])).into();
            let valid = all(&image);
            keep_coverage(&mut image, &valid, cutoff, 0.5).unwrap();
            assert_eq!(alpha_coverage(&image, &valid, cutoff).unwrap(), Some(0.5), "{cutoff}");
        }
    }

    #[test]
    fn alpha_tells_if_some_is_zero_and_of_data_only_if_the_border_is() {
        let with = |alpha: fn(u32, u32) -> u8| -> DynamicImage {
            RgbaImage::from_fn(16, 16, |x, y| Rgba([9, 9, 9, alpha(x, y)])).into()
        };
        let speck = with(|x, y| if (x, y) == (7, 7) { 0 } else { 200 });
        let frame = with(|x, _| if x < 6 { 0 } else { 200 });
        assert!(alpha_tells(&speck, Role::Color) && !alpha_tells(&speck, Role::Data));
        assert!(alpha_tells(&frame, Role::Data));
        assert!(!alpha_tells(&with(|_, _| 0), Role::Color));
        assert!(!alpha_tells(&with(|_, _| 1), Role::Color));
        assert!(!alpha_tells(&DynamicImage::new_rgb8(4, 4), Role::Color));
    }

    #[test]
    fn colors_under_alpha_0_are_filled_on_request_and_alpha_keeps_its_bits() {
        // A green leaf of 4 × 4 whose rim is half there, on white that nobody sees; the two columns
        // at the right are invalid.
        let leaf = |v: u32| (6..10).contains(&v);
        let texel = |x, y| match (leaf(x) && leaf(y), x >= 14) {
            (_, true) => Rgba([255, 0, 255, 77]),
            (true, _) if x == 6 => Rgba([30, 140, 20, 120]),
            (true, _) => Rgba([30, 140, 20, 255]),
            _ => Rgba([255, 255, 255, 0u8]),
        };
        let before = RgbaImage::from_fn(16, 16, texel);
        let valid = (0..256).map(|texel| texel % 16 < 14).collect();
        let validity = Validity::from_flags(16, 16, valid);
        for role in [Role::Color, Role::Normal, Role::Data] {
            let mut after = DynamicImage::ImageRgba8(before.clone());
            let outcome = fill(&mut after, role, &validity, [Wrap::Clamp; 2], true).unwrap();
            assert_eq!(outcome, Outcome { filled: 32, remaining: 0, hidden: 14 * 16 - 16 });
            for (x, y, &Rgba([r, g, b, a])) in after.to_rgba8().enumerate_pixels() {
                let expected = before.get_pixel(x, y).0;
                // Alpha around the charts goes on as alpha does there, colors as what is seen.
                assert!(if x < 14 { a == expected[3] } else { a < 60 }, "{x} {y}: {a}");
                let near = |a: u8, b: u8| a.abs_diff(b) <= 1;
                let is_leaf = near(r, 30) && near(g, 140) && near(b, 20);
                assert!(role == Role::Normal || is_leaf, "{x} {y}: {r} {g} {b}");
            }
        }
        // Nothing is seen: nothing to fill from.
        let mut unseen: DynamicImage = RgbaImage::new(2, 2).into();
        let all = Validity::from_flags(2, 2, vec![true; 4]);
        let outcome = fill(&mut unseen, Role::Color, &all, [Wrap::Clamp; 2], true).unwrap();
        assert_eq!(outcome, Outcome::default());
    }

    #[test]
    fn what_has_no_alpha_or_no_sense_is_told() {
        let mut opaque = DynamicImage::new_rgb8(4, 4);
        let valid = all(&opaque);
        assert_eq!(alpha_coverage(&opaque, &valid, 0.5).unwrap(), None);
        assert_eq!(keep_coverage(&mut opaque, &valid, 0.5, 0.5).unwrap(), 1.0);
        for cutoff in [0.0, -1.0, 1.1, f32::NAN] {
            assert!(keep_coverage(&mut opaque, &valid, cutoff, 0.5).is_err());
        }
    }
}
