//! The colors of a view's pixels, from the triangle that each sample sees.
//!
//! Every sample is shaded on its own. Shading a triangle once per pixel, as GPUs do, takes about half
//! the time but makes the image depend on how a surface is cut into triangles: by 0.001 to 0.0025 RMS
//! on three models, where a good level differs from its source by 0.005. What is shared instead: a
//! triangle is prepared once in a tile, and the four samples of a pixel are lit together.

use glam::{BVec4A, Vec2, Vec3, Vec4};

use super::frame::{BACKGROUND, Image};
use super::lanes::Lanes;
use super::patch::{Patch, TILE};
use super::raster::{Layer, NONE, SAMPLES, View};
use super::shade::{COUNT, Detail, Points, Shader};

/// Patches that are kept while a tile is painted. Of a helmet of 94,722 triangles a tile of 512² pixels
/// shows up to 300.
const PATCHES: usize = 256;

/// Shades what the layers of a view hold.
pub(super) struct Painter<'a> {
    view: &'a View<'a>,
    shader: &'a Shader<'a>,
    /// From back to front.
    layers: Vec<&'a Layer>,
    /// Those of the tile that were needed last, each at its triangle's number modulo [`PATCHES`].
    patches: Vec<Option<Patch>>,
}

impl<'a> Painter<'a> {
    /// `layers`: from back to front.
    pub(super) fn new(view: &'a View<'a>, shader: &'a Shader<'a>, layers: Vec<&'a Layer>) -> Self {
        Self { view, shader, layers, patches: Vec::new() }
    }

    /// Paints all that the layers hold over the background.
    pub(super) fn paint(mut self, image: &mut Image) {
        let (side, resolution) = (TILE / SAMPLES, self.view.resolution);
        for top in (0..resolution).step_by(side) {
            for left in (0..resolution).step_by(side) {
                self.patches.clear();
                self.patches.resize_with(PATCHES, || None);
                let mut points = Points::NOTHING;
                for y in top..(top + side).min(resolution) {
                    for x in left..(left + side).min(resolution) {
                        self.paint_pixel([x, y], &mut points, image);
                    }
                }
            }
        }
    }

    #[inline]
    fn paint_pixel(&mut self, pixel: [usize; 2], points: &mut Points, image: &mut Image) {
        let mut samples = Lanes::splat(Vec3::splat(BACKGROUND));
        let mut coverage = [false; COUNT];
        for layer in 0..self.layers.len() {
            let covered = self.prepare(layer, pixel, points);
            if covered != [false; COUNT] {
                let (color, alpha) = self.shader.light(points, pixel);
                let mixed = samples * (1.0 - alpha) + color * alpha;
                samples = Lanes::select(BVec4A::from_array(covered), mixed, samples);
                coverage.iter_mut().zip(covered).for_each(|(seen, is)| *seen |= is);
            }
        }
        if coverage != [false; COUNT] {
            // In pairs, so that four equal samples give exactly theirs.
            let mean = |of: Vec4| ((of.x + of.y) + (of.z + of.w)) / 4.0;
            let at = pixel[1] * self.view.resolution + pixel[0];
            image.rgb[at] = [mean(samples.x), mean(samples.y), mean(samples.z)];
            let bits = coverage.iter().enumerate().map(|(slot, &is)| u8::from(is) << slot);
            image.coverage[at] = bits.sum();
        }
    }

    /// Prepares what a layer holds of a pixel; tells which samples it covers.
    #[inline]
    fn prepare(&mut self, layer: usize, pixel: [usize; 2], points: &mut Points) -> [bool; COUNT] {
        let [x, y] = [pixel[0] * SAMPLES, pixel[1] * SAMPLES];
        let (layer, size) = (self.layers[layer], self.view.size());
        let rows =
            [&layer.triangles[y * size + x..][..2], &layer.triangles[(y + 1) * size + x..][..2]];
        let seen = [rows[0][0], rows[0][1], rows[1][0], rows[1][1]];
        let middle = Vec2::new((x + 1) as f32, (y + 1) as f32);
        let mut covered = [false; COUNT];
        let (mut last, mut entry, mut detail) = (NONE, 0, Detail::default());
        for (slot, &triangle) in seen.iter().enumerate() {
            if triangle == NONE {
                continue;
            }
            let is_next = triangle != last;
            if is_next {
                (last, entry) = (triangle, self.find_patch(triangle, [x, y]));
            }
            let Some(patch) = &self.patches[entry] else { continue };
            if is_next {
                self.shader.find_detail(patch, middle, &mut detail);
            }
            let off = Vec2::new((slot % SAMPLES) as f32 - 0.5, (slot / SAMPLES) as f32 - 0.5);
            self.shader.prepare(points, slot, patch, &detail, middle + off);
            covered[slot] = true;
        }
        covered
    }

    /// The place of a triangle's patch for the tile of a sample; nothing is there if it can't be seen.
    #[inline]
    fn find_patch(&mut self, triangle: u32, sample: [usize; 2]) -> usize {
        let triangle = triangle as usize;
        let entry = &mut self.patches[triangle % PATCHES];
        if entry.as_ref().is_none_or(|patch| patch.triangle != triangle) {
            *entry = self.view.facet(triangle).map(|facet| Patch::new(self.view, &facet, sample));
        }
        triangle % PATCHES
    }
}
