//! A picture of the pyramid that a fill goes through: each level after the pull and after the push, with the
//! weights of its texels.

use image::{DynamicImage, Rgb, RgbImage, imageops};
use seamwise_texture::color::{linear_to_srgb8, srgb_to_linear};
use seamwise_texture::{Plane, PyramidLevel, Role, TexelRole, Validity, Wrap, pyramid_levels};

use crate::error::Result;
use crate::evaluate::label::write;
use crate::image_file::codec::encode;
use crate::image_file::encoded::ImageFormat;

/// Pixels along the longer side of each level, however few texels it has.
const SIDE: u32 = 256;
/// Pixels between pictures, and above each for its name.
const GAP: u32 = 4;
const HEAD: u32 = 14;
/// Color between pictures, and of texels without a weight.
const GAP_COLOR: Rgb<u8> = Rgb([96; 3]);

/// The picture as a PNG: a row for each level. `texels` is the image after its repair, `kept` what was not
/// filled, which is as it was before.
///
/// Levels are computed anew and without repeats at the edges, as for an image alone. Colors are means of linear
/// light; other data is shown as it is.
pub(super) fn pyramid_png(
    texels: &DynamicImage,
    kept: &Validity,
    role: Option<Role>,
) -> Result<Vec<u8>> {
    let is_color = !matches!(role, Some(Role::Normal | Role::Data));
    let read = |x: f32| if is_color { srgb_to_linear(x) } else { x };
    let (width, height) = (texels.width() as usize, texels.height() as usize);
    let data = texels.to_rgb32f().into_raw().into_iter().map(read).collect();
    let part = |kept: &bool| if *kept { TexelRole::Source } else { TexelRole::Hole };
    let parts: Vec<TexelRole> = kept.flags().iter().map(part).collect();
    let plane = Plane::from_vec(width, height, 3, data);
    let levels = pyramid_levels(&plane, &parts, [Wrap::Clamp; 2]);
    let shown = |x: f32| {
        if is_color { linear_to_srgb8(x) } else { (x.clamp(0.0, 1.0) * 255.0).round() as u8 }
    };
    let size = [4 * (SIDE + GAP) + GAP, levels.len() as u32 * (SIDE + GAP + HEAD) + GAP];
    let mut sheet = RgbImage::from_pixel(size[0], size[1].max(1), GAP_COLOR);
    for (row, level) in (0..).zip(&levels) {
        let color = |own: &[f32; 4]| match own[3] > 0.0 {
            true => Rgb([shown(own[0]), shown(own[1]), shown(own[2])]),
            false => GAP_COLOR,
        };
        let weight = |own: &[f32; 4]| Rgb([(own[3].clamp(0.0, 1.0) * 255.0).round() as u8; 3]);
        let name = |what: &str| format!("{what}, {} x {}", level.width, level.height);
        let pictures = [
            (name("pull"), picture(level, &level.pulled, &color)),
            (name("its weights"), picture(level, &level.pulled, &weight)),
            (name("push"), picture(level, &level.pushed, &color)),
            (name("its weights"), picture(level, &level.pushed, &weight)),
        ];
        let top = GAP + row * (SIDE + GAP + HEAD);
        for (column, (name, picture)) in (0..).zip(pictures) {
            let left = GAP + column * (SIDE + GAP);
            write(&mut sheet, &name, [left, top + 2], SIDE, Rgb([255; 3]));
            imageops::replace(&mut sheet, &picture, i64::from(left), i64::from(top + HEAD));
        }
    }
    Ok(encode(&sheet.into(), ImageFormat::Png)?.bytes.to_vec())
}

/// A level as large as all others.
fn picture(
    level: &PyramidLevel,
    texels: &[[f32; 4]],
    color: &dyn Fn(&[f32; 4]) -> Rgb<u8>,
) -> RgbImage {
    let own = RgbImage::from_fn(level.width as u32, level.height as u32, |x, y| {
        color(&texels[y as usize * level.width + x as usize])
    });
    let longer = level.width.max(level.height) as u32;
    let side = |own: usize| (own as u32 * SIDE / longer).max(1);
    let filter = match longer > SIDE {
        true => imageops::FilterType::Triangle,
        false => imageops::FilterType::Nearest,
    };
    imageops::resize(&own, side(level.width), side(level.height), filter)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_for_each_level_shows_holes_before_the_push_and_none_after() {
        let image = RgbImage::from_pixel(4, 4, Rgb([200, 40, 40])).into();
        let kept = Validity::from_flags(4, 4, (0..16).map(|at| at == 0).collect());
        let png = pyramid_png(&image, &kept, Some(Role::Color)).unwrap();
        let sheet = image::load_from_memory(&png).unwrap().to_rgb8();
        assert_eq!(sheet.dimensions(), (4 * 260 + 4, 3 * 274 + 4));
        let at = |column: u32, row: u32| *sheet.get_pixel(column * 260 + 250, row * 274 + 260);
        assert_eq!([at(0, 0), at(1, 0)], [GAP_COLOR, Rgb([0; 3])], "a hole");
        assert_eq!([at(2, 0), at(2, 2)], [Rgb([200, 40, 40]); 2]);
        assert!(at(3, 0).0[0] > 250);
    }
}
