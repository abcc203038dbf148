//! A contact sheet: a reference and its candidates side by side, and where they differ.

use image::{Rgb, RgbImage, imageops};

use super::camera::Camera;
use super::heat::difference_map;
use super::label::{head, write_head};
use super::render::{Image, render};
use super::scene::{Mode, Scene};
use super::wireframe::draw_wireframe;

/// Pixels between pictures.
const GAP: u32 = 4;
/// Color between pictures: a little darker than the background of a render.
const GAP_COLOR: Rgb<u8> = Rgb([96; 3]);
/// Views of fewer pixels are shown larger, pixel by pixel: what mip maps do to a seam shows there.
const LEAST_SIDE: u32 = 256;

/// A scene on a sheet.
#[derive(Clone, Debug)]
pub struct Subject<'a> {
    /// Its name.
    pub name: &'a str,
    /// The scene.
    pub scene: &'a Scene,
    /// The row that it is in, where series have rows.
    pub series: usize,
}

/// The drawing of scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawing {
    /// Shaded.
    Shaded(Mode),
    /// The edges of triangles.
    Wireframe,
}

/// The rows of a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rows {
    /// A view each, and below it a row of where candidates differ, eightfold, in sRGB luminance; scenes
    /// have columns.
    Views,
    /// A series of candidates each, after the reference, seen from one place; then the same from the next.
    Series,
}

/// A sheet to be drawn.
#[derive(Clone, Debug)]
pub struct Sheet<'a> {
    /// The places that scenes are seen from, in the reference's coordinates.
    pub cameras: &'a [Camera],
    /// Pixels along each side of a picture.
    pub resolution: usize,
    /// The drawing of scenes.
    pub drawing: Drawing,
    /// The rows.
    pub rows: Rows,
}

/// A picture with its name.
type Cell = (String, RgbImage);

impl Sheet<'_> {
    /// Draws the sheet.
    pub fn draw(&self, reference: &Subject<'_>, candidates: &[Subject<'_>]) -> RgbImage {
        let rows: Vec<Vec<Cell>> = match self.rows {
            Rows::Views => self
                .cameras
                .iter()
                .flat_map(|camera| self.view(camera, reference, candidates))
                .collect(),
            Rows::Series => self
                .cameras
                .iter()
                .flat_map(|camera| self.series(camera, reference, candidates))
                .collect(),
        };
        lay_out(&rows, LEAST_SIDE.div_ceil(self.resolution as u32) * self.resolution as u32)
    }

    /// The pictures of all scenes, and the differences if shaded ones are drawn.
    fn view(
        &self,
        camera: &Camera,
        reference: &Subject<'_>,
        candidates: &[Subject<'_>],
    ) -> Vec<Vec<Cell>> {
        let Drawing::Shaded(mode) = self.drawing else {
            let all = std::iter::once(reference).chain(candidates);
            return vec![all.map(|own| self.cell(camera, reference, own)).collect()];
        };
        let own = render(reference.scene, camera, self.resolution, mode);
        let blank = RgbImage::from_pixel(own.width as u32, own.height as u32, GAP_COLOR);
        let mut rows = [vec![(title(reference), own.to_srgb8())], vec![(String::new(), blank)]];
        for candidate in candidates {
            let scene = candidate.scene.counted_from(reference.scene.origin);
            let other: Image = render(&scene, camera, self.resolution, mode);
            rows[0].push((title(candidate), other.to_srgb8()));
            rows[1].push(("difference, eightfold".to_owned(), difference_map(&own, &other)));
        }
        rows.into()
    }

    /// A row for each series.
    fn series(
        &self,
        camera: &Camera,
        reference: &Subject<'_>,
        candidates: &[Subject<'_>],
    ) -> Vec<Vec<Cell>> {
        let last = candidates.iter().map(|own| own.series).max().unwrap_or(0);
        let row = |series: usize| {
            let of_series = candidates.iter().filter(|own| own.series == series);
            let all = std::iter::once(reference).chain(of_series);
            all.map(|own| self.cell(camera, reference, own)).collect()
        };
        (0..=last).map(row).collect()
    }

    fn cell(&self, camera: &Camera, reference: &Subject<'_>, own: &Subject<'_>) -> Cell {
        let scene = own.scene.counted_from(reference.scene.origin);
        let picture = match self.drawing {
            Drawing::Shaded(mode) => render(&scene, camera, self.resolution, mode).to_srgb8(),
            Drawing::Wireframe => draw_wireframe(&scene, camera, self.resolution),
        };
        (title(own), picture)
    }
}

/// The name of a scene and how many triangles it has.
fn title(own: &Subject<'_>) -> String {
    format!("{}, {}", own.name, own.scene.triangles.len())
}

fn lay_out(rows: &[Vec<Cell>], side: u32) -> RgbImage {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0) as u32;
    let (width, height) = (side + GAP, side + GAP + head(side));
    let size = (columns * width + GAP, rows.len() as u32 * height + GAP);
    let mut sheet = RgbImage::from_pixel(size.0, size.1, GAP_COLOR);
    for (y, row) in (0..).zip(rows) {
        for (x, (name, picture)) in (0..).zip(row) {
            let (left, top) = (x * width + GAP, y * height + GAP);
            write_head(&mut sheet, name, [left, top], side);
            let picture = imageops::resize(picture, side, side, imageops::FilterType::Nearest);
            imageops::replace(&mut sheet, &picture, i64::from(left), i64::from(top + head(side)));
        }
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::super::camera::Rig;
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
        let subject = |series| Subject { name: "x", scene: &scene, series };
        let sheet = |drawing, rows| {
            let sheet = Sheet { cameras: &rig.cameras, resolution: 128, drawing, rows };
            sheet.draw(&subject(0), &[subject(0), subject(1)])
        };
        let shaded = sheet(Drawing::Shaded(Mode::Lit), Rows::Views);
        assert_eq!(shaded.dimensions(), (3 * 260 + 4, 2 * 274 + 4), "twice as large");
        let crop = |x, y| imageops::crop_imm(&shaded, x, y, 256, 256).to_image();
        assert_eq!(crop(4, 18), crop(264, 18));
        assert!(crop(264, 292).pixels().all(|pixel| *pixel == Rgb([0; 3])));
        let wires = sheet(Drawing::Wireframe, Rows::Series);
        assert_eq!(wires.dimensions(), (2 * 260 + 4, 2 * 274 + 4), "a row each, after the source");
    }
}
