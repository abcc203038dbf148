//! A picture of alpha beside one of color, as glTF has both: in one.

use image::imageops::{FilterType, resize};
use image::{DynamicImage, GrayImage, RgbaImage};
use serde::Serialize;

use crate::limit::MemoryLimit;

/// Alpha further from none and all than this is neither.
const HARD: u8 = 32;

/// Most texels in between, and near those beside and below, that a cutout has, as a share of all. The
/// smoothed edges of one are steep: of close discs none is such, with edges of up to four texels, of
/// noise a tenth, of a picture of shades two thirds.
const MAX_SOFT: f64 = 0.25;

/// The alpha mode that suits an alpha, by glTF's names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Cutout {
    /// All or nothing: leaves, fences.
    Mask,
    /// In between: glass, smoke.
    Blend,
}

/// The color, white if there is none, with the alpha of another picture, in the larger size of both;
/// none if all of it is opaque. Says what is wrong with one that takes too much memory.
pub(super) fn cut_out(
    color: Option<DynamicImage>,
    alpha: &DynamicImage,
    limit: MemoryLimit,
) -> Result<Option<(RgbaImage, Cutout)>, String> {
    let alpha = opacities(alpha);
    if alpha.pixels().all(|texel| texel[0] == u8::MAX) {
        return Ok(None);
    }
    let kind = kind_of(&alpha);
    let color = color.map_or(RgbaImage::from_pixel(1, 1, [255; 4].into()), |own| own.to_rgba8());
    let [width, height] = [color.width().max(alpha.width()), color.height().max(alpha.height())];
    let [w, h] = [width, height].map(u64::from);
    if let Some(what) = limit.check([w, h], w.saturating_mul(h).saturating_mul(8)) {
        return Err(what);
    }
    let sized = |is: (u32, u32)| is == (width, height);
    let alpha = match sized(alpha.dimensions()) {
        true => alpha,
        false => resize(&alpha, width, height, FilterType::Triangle),
    };
    let mut texels = match sized(color.dimensions()) {
        true => color,
        false => resize(&color, width, height, FilterType::Triangle),
    };
    for (texel, alpha) in texels.pixels_mut().zip(alpha.pixels()) {
        texel[3] = alpha[0];
    }
    Ok(Some((texels, kind)))
}

/// A picture's alpha if it has one that says anything, else how bright it is.
fn opacities(picture: &DynamicImage) -> GrayImage {
    let rgba = picture.to_rgba8();
    if rgba.pixels().all(|texel| texel[3] == u8::MAX) {
        return picture.to_luma8();
    }
    let alpha = rgba.pixels().map(|texel| texel[3]).collect();
    GrayImage::from_raw(rgba.width(), rgba.height(), alpha).unwrap_or_default()
}

fn kind_of(alpha: &GrayImage) -> Cutout {
    let (width, height) = alpha.dimensions();
    let is_soft = |(x, y, texel): &(u32, u32, &image::Luma<u8>)| {
        let others = [((x + 1) % width, *y), (*x, (y + 1) % height)];
        let is_near = |(x, y): (u32, u32)| alpha[(x, y)][0].abs_diff(texel[0]) < HARD;
        (HARD..=u8::MAX - HARD).contains(&texel[0]) && others.into_iter().all(is_near)
    };
    let soft = alpha.enumerate_pixels().filter(is_soft).count();
    let is_blended = soft as f64 > MAX_SOFT * alpha.pixels().len() as f64;
    if is_blended { Cutout::Blend } else { Cutout::Mask }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    /// Discs of alpha with edges of so many texels, a smooth step in each.
    fn discs(edge: f32) -> GrayImage {
        GrayImage::from_fn(64, 64, |x, y| {
            let [x, y] = [x, y].map(|at| (at % 16) as f32 - 7.5);
            let inside = (6.0 - x.hypot(y)) / edge + 0.5;
            Luma([(255.0 * inside.clamp(0.0, 1.0)) as u8])
        })
    }

    fn cut(
        color: Option<DynamicImage>,
        alpha: impl Into<DynamicImage>,
    ) -> Option<(RgbaImage, Cutout)> {
        cut_out(color, &alpha.into(), MemoryLimit::default()).unwrap()
    }

    #[test]
    fn smoothed_edges_are_a_mask_and_what_is_in_between_is_blended() {
        let kind = |alpha: GrayImage| cut(None, alpha).map(|(_, kind)| kind);
        assert_eq!([1.0, 2.0, 4.0].map(|edge| kind(discs(edge))), [Some(Cutout::Mask); 3]);
        let shades = GrayImage::from_fn(32, 32, |x, _| Luma([8 * x as u8]));
        assert_eq!(kind(shades), Some(Cutout::Blend));
        let noise = |x: u32, y: u32| Luma([(x * 97 + y * 57 + x * y * 31) as u8]);
        assert_eq!(kind(GrayImage::from_fn(16, 16, noise)), Some(Cutout::Mask));
        assert_eq!(kind(GrayImage::from_pixel(4, 4, Luma([128]))), Some(Cutout::Blend));
        assert_eq!(kind(GrayImage::from_pixel(4, 4, Luma([255]))), None);
    }

    #[test]
    fn the_larger_of_both_is_the_size_and_alpha_goes_before_brightness() {
        let color = RgbaImage::from_pixel(2, 2, [10, 20, 30, 255].into());
        let (texels, _) = cut(Some(color.into()), discs(1.0)).unwrap();
        assert_eq!(texels.dimensions(), (64, 64));
        for (texel, alpha) in texels.pixels().zip(discs(1.0).pixels()) {
            assert_eq!(texel.0, [10, 20, 30, alpha[0]]);
        }
        let own = RgbaImage::from_fn(2, 1, |x, _| [255, 255, 255, [0, 255][x as usize]].into());
        let (texels, _) = cut(Some(own.clone().into()), own.clone()).unwrap();
        assert_eq!(texels, own);
    }

    #[test]
    fn a_row_and_a_column_are_not_let_make_a_square() {
        let [row, column] = [(20_000, 1), (1, 20_000)].map(|(w, h)| GrayImage::new(w, h));
        let limit = MemoryLimit::of_bytes(1 << 20);
        let error = cut_out(Some(row.into()), &column.into(), limit).unwrap_err();
        assert!(error.contains("--memory-limit"), "{error}");
    }
}
