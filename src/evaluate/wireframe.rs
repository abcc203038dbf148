//! The edges of the triangles that one camera sees, drawn over a shape of clay.
//!
//! A sample of barycentrics bᵢ lies bᵢ / |∇bᵢ| pixels from the edge opposite corner i, so the lines
//! are as wide on every triangle, and what hides a triangle hides its edges. Where triangles are
//! smaller than a few pixels their lines would run into one black patch: there they fade, and the
//! density shows as a tone.

use glam::{DVec2, DVec3, Vec3};
use image::{Rgb, RgbImage};
use seamwise_texture::color::linear_to_srgb8;

use super::camera::Camera;
use super::layer::Layer;
use super::raster::{Facet, SAMPLES, View};
use super::render::BACKGROUND;
use super::scene::{Mode, Scene};
use super::shade::Shader;
use super::tiles::{Tile, for_each_tile};

/// Half the width of a line in pixels, its soft rim left out.
const HALF_WIDTH: f32 = 0.35;
/// Distance in pixels over which a line's rim fades out.
const RIM: f32 = 0.7;
/// Lines of a triangle fade where its smallest height is less than this, in pixels.
const CLEAR_HEIGHT: f32 = 6.0;
/// Least opacity of lines, that of a triangle without height.
const MIN_OPACITY: f32 = 0.4;
/// Linear light of a line.
const LINE: f32 = 0.008;

/// Draws one view of `resolution` pixels each way, on the background of a render.
///
/// Materials count only for what is seen: masked texels are holes, back faces of single-sided
/// materials are not there, and of blended triangles the nearest is drawn as if it were opaque.
pub fn draw_wireframe(scene: &Scene, camera: &Camera, resolution: usize) -> RgbImage {
    let view = View::new(scene, camera, resolution);
    draw_under(&view, &Overlay::default())
}

/// What is drawn over a wireframe where it lies before it.
#[derive(Default)]
pub(super) struct Overlay {
    size: usize,
    /// One per sample: 1 / depth, 0 where nothing is, and the linear light. Empty if nothing is anywhere.
    samples: Vec<(f32, Vec3)>,
}

impl Overlay {
    pub(super) fn new(view: &View<'_>) -> Self {
        Self { size: view.size(), samples: vec![(0.0, Vec3::ZERO); view.size() * view.size()] }
    }

    /// Puts linear light at a sample, unless something nearer is there.
    pub(super) fn put(&mut self, [x, y]: [usize; 2], depth: f64, light: Vec3) {
        let (sample, nearness) = (&mut self.samples[y * self.size + x], (1.0 / depth) as f32);
        if nearness > sample.0 {
            *sample = (nearness, light);
        }
    }
}

/// Draws a view's wireframe, and the overlay.
pub(super) fn draw_under(view: &View<'_>, overlay: &Overlay) -> RgbImage {
    let shader = Shader::new(view, Mode::Unlit);
    let size = view.resolution as u32;
    let mut picture = RgbImage::new(size, size);
    for_each_tile(view, &shader, |tile| draw_tile(tile, overlay, &mut picture));
    picture
}

/// Draws the pixels of a tile.
fn draw_tile(tile: &Tile<'_>, overlay: &Overlay, picture: &mut RgbImage) {
    let [columns, rows] = tile.size.map(|side| side / SAMPLES);
    for (x, y) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
        let mut sum = Vec3::ZERO;
        for at in 0..SAMPLES * SAMPLES {
            sum += draw_sample(tile, overlay, [x * SAMPLES + at % 2, y * SAMPLES + at / 2]);
        }
        let mean = sum / (SAMPLES * SAMPLES) as f32;
        let [x, y] = [tile.corner[0] / SAMPLES + x, tile.corner[1] / SAMPLES + y];
        let color = Rgb(mean.min(Vec3::ONE).to_array().map(linear_to_srgb8));
        picture.put_pixel(x as u32, y as u32, color);
    }
}

/// The linear light of a sample of a tile.
fn draw_sample(tile: &Tile<'_>, overlay: &Overlay, [x, y]: [usize; 2]) -> Vec3 {
    let at = y * tile.size[0] + x;
    let nearness = tile.layers().map(|layer| layer.nearness(at)).fold(0.0, f32::max);
    let [x, y] = [tile.corner[0] + x, tile.corner[1] + y];
    match overlay.samples.get(y * overlay.size + x) {
        Some(&(own, light)) if own > nearness => light,
        _ => Vec3::splat(draw_edges(tile, at, DVec2::new(x as f64 + 0.5, y as f64 + 0.5))),
    }
}

/// The linear light of the wireframe at a sample of a tile, which lies at a place in the image.
fn draw_edges(tile: &Tile<'_>, sample: usize, place: DVec2) -> f32 {
    // Of the front layer, where that shows one.
    let of_layer = |layer: &Layer| tile.facets.get(layer.triangles[sample] as usize);
    let Some(facet) = tile.layers().filter_map(of_layer).last() else {
        return BACKGROUND;
    };
    let strength = line_strength(tile.view, facet, place);
    let clay = clay(facet.normal());
    clay + (LINE - clay) * strength
}

/// How much of a sample is line, 0…1.
fn line_strength(view: &View<'_>, facet: &Facet, at: DVec2) -> f32 {
    let hit = facet.hit(view, at);
    let gradients = [0, 1, 2].map(|i| Vec3::new(hit.dx[i], hit.dy[i], 0.0).length());
    let distances = [0, 1, 2].map(|i| hit.barycentrics[i].max(0.0) / gradients[i]);
    let nearest = distances.into_iter().fold(f32::INFINITY, f32::min);
    let height = gradients.into_iter().map(f32::recip).fold(f32::INFINITY, f32::min);
    let line = 1.0 - ((nearest - HALF_WIDTH) / RIM).clamp(0.0, 1.0);
    line * (height / CLEAR_HEIGHT).clamp(MIN_OPACITY, 1.0)
}

/// Linear light of clay with a normal in the camera's frame, lit from above the left shoulder.
pub(super) fn clay(normal: DVec3) -> f32 {
    let light = DVec3::new(-0.35, 0.55, -0.76);
    (0.3 + 0.45 * normal.dot(light).max(0.0)) as f32
}

#[cfg(test)]
mod tests {
    use super::super::scene::Material;
    use super::*;

    fn material() -> Material {
        Material { metallic: 0.0, ..Material::default() }
    }

    /// The square −1…1 in two triangles, which the camera sees from edge to edge of its frame.
    fn square() -> (Scene, Camera) {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let scene = Scene {
            positions: corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            triangle_materials: vec![0; 2],
            materials: vec![material()],
            ..Scene::default()
        };
        let half_angle = 0.5f64.atan();
        (scene, Camera::look_at(DVec3::Z * 2.0, DVec3::ZERO, 2.0 * half_angle, 0.1))
    }

    #[test]
    fn edges_are_dark_and_the_inside_is_clay() {
        let (scene, camera) = square();
        let picture = draw_wireframe(&scene, &camera, 64);
        let at = |x, y| picture.get_pixel(x, y).0[0];
        let inside = linear_to_srgb8(clay(DVec3::NEG_Z));
        assert_eq!([at(40, 50), at(20, 10)], [inside; 2]);
        // The frame, and the diagonal from the lower left to the upper right.
        for edge in [at(0, 30), at(63, 30), at(30, 0), at(30, 63), at(20, 43), at(50, 13)] {
            assert!(edge < inside - 60, "{edge} {inside}");
        }
        assert_eq!(at(20, 46), inside, "a line is narrow");
    }

    #[test]
    fn what_is_hidden_has_no_edges_and_nothing_is_background() {
        let (mut scene, camera) = square();
        let before = draw_wireframe(&scene, &camera, 32);
        scene
            .positions
            .extend([[-0.5, 0.0], [0.5, 0.0], [0.0, 0.7]].map(|[x, y]| Vec3::new(x, y, -0.5)));
        scene.triangles.push([4, 5, 6]);
        scene.triangle_materials.push(0);
        assert_eq!(draw_wireframe(&scene, &camera, 32), before);
        let nothing = draw_wireframe(&Scene::default(), &camera, 8);
        assert!(nothing.pixels().all(|pixel| pixel.0 == [128; 3]));
    }
}
