//! What a view shows, tile by tile: of each tile the triangles that reach it, and which of them its samples
//! see.
//!
//! A tile's samples stay in the nearest cache while it is drawn and painted, and no samples of the whole
//! image are kept.
//!
//! Guaranteed: each sample sees the triangle that it would see if the image were drawn as one, to the bit, and
//! a triangle is in the list of each tile that it may reach. Not guaranteed: that it is seen in all of those.

use super::layer::{Layer, bounds};
use super::patch::TILE;
use super::raster::{Facet, View};
use super::scene::Alpha;
use super::shade::{Shader, material_of};
use super::vectors::{Work, dispatch};

/// A blended sample below this alpha is not there: one step of 8 bits.
const INVISIBLE: f32 = 1.0 / 255.0;

/// A tile of a view.
pub(super) struct Tile<'a> {
    pub(super) view: &'a View<'a>,
    /// Its left and top, in samples.
    pub(super) corner: [usize; 2],
    /// Its width and height, in samples: [`TILE`], or less at the right and the bottom of the image.
    pub(super) size: [usize; 2],
    /// The triangles that may be seen in it, in the order of the scene.
    pub(super) facets: Vec<Facet>,
    /// The nearest opaque or masked one at each sample.
    pub(super) solid: Layer,
    /// The nearest blended one before that.
    pub(super) blended: Layer,
    /// The places among `facets` of those that are blended.
    blends: Vec<u32>,
}

/// Hands on each tile of a view, row by row.
pub(super) fn for_each_tile<'a>(
    view: &'a View<'a>,
    shader: &Shader<'_>,
    mut with: impl FnMut(&Tile<'a>),
) {
    let reach = Reach::new(view);
    let mut tile = Tile::new(view);
    for (at, corner) in reach.corners().enumerate() {
        tile.begin(corner);
        dispatch(Finding { tile: &mut tile, shader, triangles: reach.of(at) });
        with(&tile);
    }
}

impl<'a> Tile<'a> {
    fn new(view: &'a View<'a>) -> Self {
        Self {
            view,
            corner: [0; 2],
            size: [0; 2],
            facets: Vec::new(),
            solid: Layer::default(),
            blended: Layer::default(),
            blends: Vec::new(),
        }
    }

    /// The tile at a corner, in which nothing is seen yet.
    fn begin(&mut self, corner: [usize; 2]) {
        let side = |axis: usize| TILE.min(self.view.size() - corner[axis]);
        (self.corner, self.size) = (corner, [side(0), side(1)]);
        self.facets.clear();
        self.blends.clear();
        self.solid.begin(corner, self.size);
        self.blended.begin(corner, self.size);
    }

    /// What it shows, from back to front.
    pub(super) fn layers(&self) -> impl Iterator<Item = &Layer> {
        [&self.solid].into_iter().chain((!self.blends.is_empty()).then_some(&self.blended))
    }

    /// Draws triangles: the nearest of those that are opaque or masked, then of the blended ones.
    #[inline(always)]
    fn find(&mut self, shader: &Shader<'_>, triangles: &[u32]) {
        let Self { view, facets, solid, blended, blends, .. } = self;
        for facet in triangles.iter().filter_map(|triangle| view.facet(*triangle as usize)) {
            let Some(material) = material_of(view.scene, facet.triangle) else { continue };
            let place = facets.len() as u32;
            match material.alpha {
                Alpha::Opaque => solid.cover(view, &facet, place),
                Alpha::Mask(cutoff) => {
                    let is_there = |at| shader.alpha(&facet, at) >= cutoff;
                    solid.draw(view, &facet, place, None, is_there);
                }
                Alpha::Blend => blends.push(place),
            }
            facets.push(facet);
        }
        for &place in &*blends {
            let facet = &facets[place as usize];
            let is_there = |at| shader.alpha(facet, at) >= INVISIBLE;
            blended.draw(view, facet, place, Some(solid), is_there);
        }
    }
}

/// The drawing of a tile.
struct Finding<'t, 'a, 's> {
    tile: &'t mut Tile<'a>,
    shader: &'s Shader<'s>,
    triangles: &'t [u32],
}

impl Work for Finding<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        self.tile.find(self.shader, self.triangles);
    }
}

/// The triangles that reach each tile of a view.
struct Reach {
    /// Tiles per axis.
    side: usize,
    /// Where those of each tile begin, and where the last end.
    starts: Vec<u32>,
    /// In the order of the scene within each tile.
    triangles: Vec<u32>,
}

impl Reach {
    fn new(view: &View<'_>) -> Self {
        let side = view.size().div_ceil(TILE);
        let seen: Vec<(u32, [u16; 4])> = (0..view.scene.triangles.len())
            .filter_map(|triangle| Some((triangle as u32, reached(view, triangle)?)))
            .collect();
        let mut starts = vec![0; side * side + 1];
        for (_, tiles) in &seen {
            tiles_in(*tiles, side).for_each(|tile| starts[tile + 1] += 1);
        }
        for tile in 0..side * side {
            starts[tile + 1] += starts[tile];
        }
        let mut ends = starts.clone();
        let mut triangles = vec![0; starts[side * side] as usize];
        for (triangle, tiles) in seen {
            for tile in tiles_in(tiles, side) {
                triangles[ends[tile] as usize] = triangle;
                ends[tile] += 1;
            }
        }
        Self { side, starts, triangles }
    }

    /// The left top corners of the tiles, in samples.
    fn corners(&self) -> impl Iterator<Item = [usize; 2]> {
        (0..self.side * self.side).map(|at| [at % self.side * TILE, at / self.side * TILE])
    }

    fn of(&self, tile: usize) -> &[u32] {
        &self.triangles[self.starts[tile] as usize..self.starts[tile + 1] as usize]
    }
}

/// The tiles that a triangle reaches, as columns and rows: left, top, right and bottom, all included; nothing
/// if it is not seen.
fn reached(view: &View<'_>, triangle: usize) -> Option<[u16; 4]> {
    let material = material_of(view.scene, triangle)?;
    let facet = view.facet(triangle)?;
    if !facet.front && !material.double_sided {
        return None;
    }
    let [left, top, right, bottom] = bounds(view, &facet)?;
    let tile = |at: usize| (at / TILE) as u16;
    Some([tile(left), tile(top), tile(right), tile(bottom)])
}

/// The places of the tiles of a rectangle of columns and rows.
fn tiles_in([left, top, right, bottom]: [u16; 4], side: usize) -> impl Iterator<Item = usize> {
    (top..=bottom).flat_map(move |row| {
        (left..=right).map(move |column| usize::from(row) * side + usize::from(column))
    })
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3, Vec4};
    use proptest::prelude::*;

    use super::super::camera::Camera;
    use super::super::layer::NONE;
    use super::super::scene::{Material, Mode, Scene};
    use super::*;

    /// Triangles of an opaque, a masked, a blended and a double-sided material by turns, of which the masked
    /// and the blended are there.
    fn scene(numbers: &[f32]) -> Scene {
        let color = Vec4::new(1.0, 1.0, 1.0, 0.5);
        let material = |alpha| Material { base_color: color, alpha, ..Material::default() };
        let materials = vec![
            material(Alpha::Opaque),
            material(Alpha::Mask(0.25)),
            material(Alpha::Blend),
            Material { double_sided: true, ..Material::default() },
        ];
        let positions: Vec<Vec3> = numbers.chunks_exact(3).map(Vec3::from_slice).collect();
        let count = positions.len() as u32 / 3;
        Scene {
            positions,
            triangles: (0..count).map(|at| [3 * at, 3 * at + 1, 3 * at + 2]).collect(),
            triangle_materials: (0..count).map(|at| at % 4).collect(),
            materials,
            ..Scene::default()
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn each_sample_sees_in_its_tile_what_it_sees_in_the_whole_image(
            numbers in prop::collection::vec(prop_oneof![9 => -2.0f32..2.0, 1 => any::<f32>()], 36),
            resolution in 1usize..80,
        ) {
            let scene = scene(&numbers);
            let camera = Camera::look_at(DVec3::Z * 3.0, DVec3::ZERO, 1.2, 0.1);
            let view = View::new(&scene, &camera, resolution);
            let shader = Shader::new(&view, Mode::Unlit);
            let (mut solid, mut blended) = (Layer::default(), Layer::default());
            solid.begin([0; 2], [view.size(); 2]);
            blended.begin([0; 2], [view.size(); 2]);
            let is_blended = |facet: &Facet| scene.triangle_materials[facet.triangle] == 2;
            let facets = || (0..scene.triangles.len()).filter_map(|triangle| view.facet(triangle));
            let is_seen = |facet: &Facet| facet.front || facet.triangle % 4 == 3;
            for facet in facets().filter(|facet| is_seen(facet) && !is_blended(facet)) {
                solid.draw(&view, &facet, facet.triangle as u32, None, |_| true);
            }
            for facet in facets().filter(|facet| is_seen(facet) && is_blended(facet)) {
                blended.draw(&view, &facet, facet.triangle as u32, Some(&solid), |_| true);
            }
            let mut samples = 0;
            for_each_tile(&view, &shader, |tile| {
                for (layer, whole) in [(&tile.solid, &solid), (&tile.blended, &blended)] {
                    for (at, place) in layer.triangles.iter().enumerate() {
                        let [x, y] = [at % tile.size[0], at / tile.size[0]];
                        let own = tile.facets.get(*place as usize).map_or(NONE, |f| f.triangle as u32);
                        let sample = (tile.corner[1] + y) * view.size() + tile.corner[0] + x;
                        assert_eq!(own, whole.triangles[sample], "{sample}");
                        assert_eq!(layer.nearness(at), whole.nearness(sample));
                        samples += 1;
                    }
                }
            });
            prop_assert_eq!(samples, 2 * view.size() * view.size());
        }
    }
}
