//! The colors of a view's pixels, from the triangle that each sample sees.
//!
//! Every sample is shaded on its own. Shading a triangle once per pixel, as GPUs do, takes about half
//! the time but makes the image depend on how a surface is cut into triangles: by 0.001 to 0.0025 RMS
//! on three models, where a good level differs from its source by 0.005. What is shared instead: a
//! triangle is prepared once in a tile, and the samples of a material in a tile are shaded together.

use super::batch::Batch;
use super::frame::{BACKGROUND, Image};
use super::layer::{Layer, NONE};
use super::patch::{Patch, TILE};
use super::raster::{SAMPLES, View};
use super::shade::{COUNT, Shader, Spot};
use super::vectors::{Work, dispatch};

/// Pixels along each side of a tile.
const SIDE: usize = TILE / SAMPLES;
/// Entries of the table of a tile's patches. Of a helmet of 94,722 triangles a tile of 512² pixels shows
/// up to 300.
const KNOWN: usize = 1024;

/// Shades what the layers of a view hold.
pub(super) struct Painter<'a> {
    view: &'a View<'a>,
    shader: &'a Shader<'a>,
    /// From back to front.
    layers: Vec<&'a Layer>,
    /// Those of the tile.
    patches: Vec<Patch>,
    /// Triangles and their places among the patches, each at its triangle's number modulo [`KNOWN`].
    known: Vec<[u32; 2]>,
    /// The samples of a layer in a tile.
    spots: Vec<Spot>,
    /// One per sample of the tile, pixel by pixel, where its pixel is covered.
    samples: Vec<[f32; 4]>,
    /// One per pixel of the tile: the bits of [`Image::coverage`].
    covered: Vec<u8>,
    batch: Box<Batch>,
}

impl<'a> Painter<'a> {
    /// `layers`: from back to front.
    pub(super) fn new(view: &'a View<'a>, shader: &'a Shader<'a>, layers: Vec<&'a Layer>) -> Self {
        Self {
            view,
            shader,
            layers,
            patches: Vec::new(),
            known: vec![[NONE, 0]; KNOWN],
            spots: Vec::with_capacity(TILE * TILE),
            samples: vec![[0.0; 4]; TILE * TILE],
            covered: vec![0; SIDE * SIDE],
            batch: Box::new(Batch::EMPTY),
        }
    }

    /// Paints all that the layers hold over the background.
    pub(super) fn paint(mut self, image: &mut Image) {
        for top in (0..self.view.resolution).step_by(SIDE) {
            for left in (0..self.view.resolution).step_by(SIDE) {
                self.paint_tile([left, top], image);
            }
        }
    }

    /// Paints the tile at a pixel.
    fn paint_tile(&mut self, corner: [usize; 2], image: &mut Image) {
        self.patches.clear();
        self.known.fill([NONE, 0]);
        self.covered.fill(0);
        for layer in 0..self.layers.len() {
            self.spots.clear();
            self.collect(layer, corner);
            if self.spots.windows(2).any(|pair| pair[0].material != pair[1].material) {
                self.spots.sort_by_key(|spot| spot.material);
            }
            dispatch(Shading { painter: self, corner });
        }
        let last = corner.map(|at| (at + SIDE).min(self.view.resolution));
        for y in corner[1]..last[1] {
            for x in corner[0]..last[0] {
                let pixel = place([x, y], corner);
                if self.covered[pixel] != 0 {
                    let [a, b, c, d] = [0, 1, 2, 3].map(|slot| self.samples[pixel * COUNT + slot]);
                    // In pairs, so that four equal samples give exactly theirs.
                    let mean = |of: usize| ((a[of] + b[of]) + (c[of] + d[of])) / 4.0;
                    let at = y * self.view.resolution + x;
                    image.rgb[at] = [mean(0), mean(1), mean(2)];
                    image.coverage[at] = self.covered[pixel];
                }
            }
        }
    }

    /// Collects the samples of a layer in the tile at a pixel, pixel by pixel.
    fn collect(&mut self, layer: usize, corner: [usize; 2]) {
        let (layer, size) = (self.layers[layer], self.view.size());
        let last = corner.map(|at| (at + SIDE).min(self.view.resolution));
        for y in corner[1]..last[1] {
            let rows = &layer.triangles[y * SAMPLES * size..][..SAMPLES * size];
            let (upper, lower) = rows.split_at(size);
            let (upper, lower) = (upper.as_chunks::<SAMPLES>().0, lower.as_chunks::<SAMPLES>().0);
            for x in corner[0]..last[0] {
                let ([a, b], [c, d]) = (upper[x], lower[x]);
                if [a, b, c, d] != [NONE; COUNT] {
                    self.collect_pixel([x, y], [a, b, c, d], corner);
                }
            }
        }
    }

    /// Collects the samples of a pixel, of which at least one is covered.
    #[inline]
    fn collect_pixel(&mut self, at: [usize; 2], seen: [u32; COUNT], corner: [usize; 2]) {
        let pixel = place(at, corner);
        if self.covered[pixel] == 0 {
            self.samples[pixel * COUNT..][..COUNT].fill([BACKGROUND; 4]);
        }
        let (mut last, mut entry) = (NONE, None);
        for (slot, &triangle) in seen.iter().enumerate() {
            if triangle == NONE {
                continue;
            }
            if triangle != last {
                (last, entry) = (triangle, self.find_patch(triangle, at));
            }
            let Some(patch) = entry else { continue };
            let material = self.patches[patch as usize].material as u32;
            let pixel = at.map(|at| at as u32);
            self.spots.push(Spot { patch, material, pixel, slot: slot as u32 });
            self.covered[place(at, corner)] |= 1 << slot;
        }
    }

    /// The place of a triangle's patch for the tile of a pixel; nothing if it can't be seen.
    #[inline]
    fn find_patch(&mut self, triangle: u32, pixel: [usize; 2]) -> Option<u32> {
        let known = &mut self.known[triangle as usize % KNOWN];
        if known[0] != triangle {
            let facet = self.view.facet(triangle as usize)?;
            *known = [triangle, self.patches.len() as u32];
            let sample = pixel.map(|at| at * SAMPLES);
            self.patches.push(Patch::new(self.view, &facet, sample));
        }
        Some(known[1])
    }

    /// Shades the samples that were collected over what the tile holds.
    #[inline(always)]
    fn shade(&mut self, corner: [usize; 2]) {
        let Self { shader, patches, samples, batch, .. } = self;
        for spots in self.spots.chunk_by(|a, b| a.material == b.material) {
            shader.shade(patches, spots, batch, |spot, color| {
                let pixel = place(spot.pixel.map(|at| at as usize), corner);
                let sample = &mut samples[pixel * COUNT + spot.slot as usize];
                let alpha = color[3];
                let mix = |channel: usize| sample[channel] * (1.0 - alpha) + color[channel] * alpha;
                *sample = [mix(0), mix(1), mix(2), 1.0];
            });
        }
    }
}

/// The shading of a tile.
struct Shading<'p, 'a> {
    painter: &'p mut Painter<'a>,
    corner: [usize; 2],
}

impl Work for Shading<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.painter.shade(self.corner);
    }
}

/// The place of a pixel in the tile at another.
#[inline]
fn place([x, y]: [usize; 2], [left, top]: [usize; 2]) -> usize {
    (y - top) * SIDE + (x - left)
}
