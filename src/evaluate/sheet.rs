//! A contact sheet: a reference and its candidates side by side, and where they differ.

use image::{Rgb, RgbImage, imageops};

use super::camera::Rig;
use super::heat::difference_map;
use super::render::{Image, render_views};
use super::scene::{Mode, Scene};

/// Pixels between pictures.
const GAP: u32 = 4;
/// Color between pictures: a little darker than the background of a render.
const GAP_COLOR: Rgb<u8> = Rgb([96; 3]);
/// Views of fewer pixels are shown larger, pixel by pixel: what mip maps do to a seam shows there.
const LEAST_SIDE: u32 = 256;

/// Draws each scene in a column of its own, the reference first, seen from each camera of `rig`;
/// below each picture of a candidate the difference in sRGB luminance to the reference's, eightfold.
pub fn contact_sheet(reference: &Scene, candidates: &[Scene], rig: &Rig, mode: Mode) -> RgbImage {
    let own = render_views(reference, rig, mode);
    let mut columns = vec![column(&own, None)];
    for candidate in candidates {
        let candidate = candidate.counted_from(reference.origin);
        columns.push(column(&render_views(&candidate, rig, mode), Some(&own)));
    }
    let scale = LEAST_SIDE.div_ceil(rig.resolution as u32);
    let side = rig.resolution as u32 * scale;
    let rows = 2 * rig.cameras.len() as u32;
    let length = |count: u32| count * (side + GAP) + GAP;
    let size = (length(columns.len() as u32), length(rows));
    let mut sheet = RgbImage::from_pixel(size.0, size.1, GAP_COLOR);
    for (x, column) in columns.iter().enumerate() {
        for (y, picture) in column.iter().enumerate() {
            let at = |index: usize| i64::from(length(index as u32));
            let picture = imageops::resize(picture, side, side, imageops::FilterType::Nearest);
            imageops::replace(&mut sheet, &picture, at(x), at(y));
        }
    }
    sheet
}

/// The pictures of one scene, each followed by its difference.
fn column(views: &[Image], reference: Option<&[Image]>) -> Vec<RgbImage> {
    let blank =
        |view: &Image| RgbImage::from_pixel(view.width as u32, view.height as u32, GAP_COLOR);
    let heat = |index: usize, view: &Image| match reference {
        Some(reference) => difference_map(&reference[index], view),
        None => blank(view),
    };
    let pairs = views.iter().enumerate();
    pairs.flat_map(|(index, view)| [view.to_srgb8(), heat(index, view)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn a_scene_beside_itself_differs_nowhere() {
        let scene = Scene {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            triangles: vec![[0, 1, 2], [0, 2, 1]],
            ..Scene::default()
        };
        let rig = Rig::around(&scene, 1, 128);
        let sheet = contact_sheet(&scene, std::slice::from_ref(&scene), &rig, Mode::Lit);
        assert_eq!(sheet.dimensions(), (2 * 260 + 4, 2 * 260 + 4), "twice as large");
        let crop = |x, y| imageops::crop_imm(&sheet, x, y, 256, 256).to_image();
        assert_eq!(crop(4, 4), crop(264, 4));
        assert!(crop(264, 264).pixels().all(|pixel| *pixel == Rgb([0; 3])));
    }
}
