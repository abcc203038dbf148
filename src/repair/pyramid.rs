//! Pictures of the pyramid that a fill goes through: each level after the pull and after the push, with the
//! weights of its texels.

use image::{DynamicImage, Rgb, RgbImage, imageops};
use seamwise_texture::color::{linear_to_srgb8, srgb_to_linear};
use seamwise_texture::{Plane, PyramidLevel, Role, TexelRole, Validity, Wrap, pyramid_levels};

use crate::evaluate::label::{head, write_head};

/// Pixels along the longer side of each level on a sheet, however few texels it has.
const SIDE: u32 = 256;
/// Pixels between pictures.
const GAP: u32 = 4;
/// Color between pictures, and of texels without a weight.
const GAP_COLOR: Rgb<u8> = Rgb([96; 3]);

/// The levels of a fill.
///
/// They are computed anew and without repeats at the edges, as for an image alone. Colors are means of linear
/// light; other data is shown as it is.
pub(super) struct Pyramid {
    levels: Vec<PyramidLevel>,
    is_color: bool,
}

/// What is shown of a level.
#[derive(Clone, Copy)]
enum Part {
    Values,
    Weights,
}

impl Pyramid {
    /// The pyramid of an image: `texels` is the image after its repair, `kept` what was not filled, which is as it
    /// was before.
    pub(super) fn of(texels: &DynamicImage, kept: &Validity, role: Option<Role>) -> Self {
        let is_color = !matches!(role, Some(Role::Normal | Role::Data));
        let read = |x: f32| if is_color { srgb_to_linear(x) } else { x };
        let (width, height) = (texels.width() as usize, texels.height() as usize);
        let data = texels.to_rgb32f().into_raw().into_iter().map(read).collect();
        let part = |kept: &bool| if *kept { TexelRole::Source } else { TexelRole::Hole };
        let parts: Vec<TexelRole> = kept.flags().iter().map(part).collect();
        let plane = Plane::from_vec(width, height, 3, data);
        Self { levels: pyramid_levels(&plane, &parts, [Wrap::Clamp; 2]), is_color }
    }

    /// One picture: a row for each level, all as large.
    pub(super) fn sheet(&self) -> RgbImage {
        let row_height = SIDE + GAP + head(SIDE);
        let size = [4 * (SIDE + GAP) + GAP, self.levels.len() as u32 * row_height + GAP];
        let mut sheet = RgbImage::from_pixel(size[0], size[1].max(1), GAP_COLOR);
        for (row, level) in (0..).zip(&self.levels) {
            for (column, (name, picture)) in (0..).zip(self.parts(level)) {
                let (left, top) = (GAP + column * (SIDE + GAP), GAP + row * row_height);
                let name = format!("{name}, {} x {}", level.width, level.height);
                write_head(&mut sheet, &name, [left, top], SIDE);
                let picture = scaled(&picture);
                imageops::replace(&mut sheet, &picture, left.into(), (top + head(SIDE)).into());
            }
        }
        sheet
    }

    /// Four pictures of each level with their names, a pixel for each texel: `0_pull` is of the image itself.
    pub(super) fn pictures(&self) -> Vec<(String, RgbImage)> {
        let level = |(at, level): (usize, &PyramidLevel)| {
            let named =
                move |(name, own): (&str, _)| (format!("{at}_{}", name.replace(' ', "_")), own);
            self.parts(level).map(named)
        };
        self.levels.iter().enumerate().flat_map(level).collect()
    }

    fn parts(&self, level: &PyramidLevel) -> [(&'static str, RgbImage); 4] {
        let picture = |texels: &[[f32; 4]], part| {
            RgbImage::from_fn(level.width as u32, level.height as u32, |x, y| {
                self.pixel(&texels[y as usize * level.width + x as usize], part)
            })
        };
        [
            ("pull", picture(&level.pulled, Part::Values)),
            ("pull weights", picture(&level.pulled, Part::Weights)),
            ("push", picture(&level.pushed, Part::Values)),
            ("push weights", picture(&level.pushed, Part::Weights)),
        ]
    }

    fn pixel(&self, texel: &[f32; 4], part: Part) -> Rgb<u8> {
        let &[red, green, blue, weight] = texel;
        let plain = |x: f32| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
        match part {
            Part::Weights => Rgb([plain(weight); 3]),
            Part::Values if weight <= 0.0 => GAP_COLOR,
            Part::Values if self.is_color => Rgb([red, green, blue].map(linear_to_srgb8)),
            Part::Values => Rgb([red, green, blue].map(plain)),
        }
    }
}

/// A level as large as all others.
fn scaled(picture: &RgbImage) -> RgbImage {
    let longer = picture.width().max(picture.height());
    let side = |own: u32| (own * SIDE / longer).max(1);
    let filter = match longer > SIDE {
        true => imageops::FilterType::Triangle,
        false => imageops::FilterType::Nearest,
    };
    imageops::resize(picture, side(picture.width()), side(picture.height()), filter)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: Rgb<u8> = Rgb([200, 40, 40]);

    /// Four by four texels, one of which is kept.
    fn pyramid() -> Pyramid {
        let kept = Validity::from_flags(4, 4, (0..16).map(|at| at == 0).collect());
        Pyramid::of(&RgbImage::from_pixel(4, 4, RED).into(), &kept, Some(Role::Color))
    }

    #[test]
    fn a_row_for_each_level_shows_holes_before_the_push_and_none_after() {
        let sheet = pyramid().sheet();
        assert_eq!(sheet.dimensions(), (4 * 260 + 4, 3 * 274 + 4));
        let at = |column: u32, row: u32| *sheet.get_pixel(column * 260 + 250, row * 274 + 260);
        assert_eq!([at(0, 0), at(1, 0)], [GAP_COLOR, Rgb([0; 3])], "a hole");
        assert_eq!([at(2, 0), at(2, 2)], [RED; 2]);
        assert!(at(3, 0).0[0] > 250);
    }

    #[test]
    fn pictures_have_a_pixel_for_each_texel() {
        let pictures = pyramid().pictures();
        let told: Vec<(&str, u32)> =
            pictures.iter().map(|(name, own)| (name.as_str(), own.width())).collect();
        assert_eq!(told[..2], [("0_pull", 4), ("0_pull_weights", 4)]);
        assert_eq!(told[10..], [("2_push", 1), ("2_push_weights", 1)]);
        let [pulled, pushed] = [&pictures[0].1, &pictures[2].1];
        assert_eq!([pulled.get_pixel(0, 0), pulled.get_pixel(3, 3)], [&RED, &GAP_COLOR]);
        assert!(pushed.pixels().all(|own| *own == RED));
    }
}
