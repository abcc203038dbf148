//! Sizes of the images of a level.
//!
//! A level is shown up to the size S at which its surface is off by the pixels that the screen
//! tolerates, but for a thousandth of it (see [`screen`](crate::screen)), and no larger than the screen.
//! What its picture tells may make S less, but is known only once there are textures. There one pixel
//! covers D / S texels, where D is how many texels of the image span the diagonal of the asset; so
//! log₂(D / S) halvings of the image, rounded down, are not seen. That is the size which is needed.
//!
//! Where a budget of bytes asks for less, the halving that loses least per byte comes first: lost is
//! the square of what the texels differ from the mean in the next mip level, by the share of the
//! asset's surface that uses the image.

use glam::DVec3;
use seamwise_attr::{Mesh, area_vector};
use seamwise_texture::transfer::Face;

use super::layout::{ChartGroup, SourceReading, UvLayout, faces};
use crate::document::asset::Asset;
use crate::document::nodes::{largest_stretch, mesh_worlds};
use crate::error::Result;
use crate::screen::{Screen, largest_size};
use crate::surface::geometry::Geometry;

/// The share of a new atlas that charts cover, about.
const PACKED: f64 = 0.6;

/// The side of images in a new layout, at most: what a source of any density shows is cut to what is seen.
pub(super) const MOST_SIDE: usize = 4096;

/// Sizes of the images of each level.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Sizes {
    /// As large as needed at the size at which the level is shown.
    #[default]
    Needed,
    /// The side over that of the level before, above 0 and up to 1.
    Scale(f64),
    /// As large as needed, and all images of all levels together at most so many bytes.
    Budget(u64),
}

/// Width and height of the images of each sheet, level by level.
pub(super) type SheetSizes = Vec<Vec<[usize; 2]>>;

/// Areas, scales and screen sizes, from which the sizes of images are computed.
pub(super) struct TexelDensity {
    /// Diagonal of the asset's bounding box in the units of the scene.
    diagonal: f64,
    /// One per surface: area in the scene.
    areas: Vec<f64>,
    /// One per surface: lengths in the scene over those of its mesh.
    stretches: Vec<f64>,
    /// One per level: the most pixels that the diagonal spans where it is shown.
    pixels: Vec<f64>,
}

impl TexelDensity {
    /// `distances` has a high distance of each level of each surface, in the units of its mesh.
    pub(super) fn new(
        asset: &Asset,
        surfaces: &[Geometry],
        distances: &[Vec<f32>],
        screen: &Screen,
    ) -> Result<Self> {
        let worlds = mesh_worlds(asset)?;
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut areas, mut stretches) = (Vec::new(), Vec::new());
        for surface in surfaces {
            let own = worlds.get(&surface.meshes[0]).map_or(&[][..], Vec::as_slice);
            let mesh = &surface.welded.mesh;
            for world in own {
                for position in &mesh.positions {
                    let p = world.transform_point3(position.as_dvec3());
                    (low, high) = (low.min(p), high.max(p));
                }
            }
            let stretch = largest_stretch(own);
            areas.push(area(mesh, |_| true) * stretch * stretch);
            stretches.push(stretch);
        }
        let mut texel_density =
            Self { diagonal: (high - low).length(), areas, stretches, pixels: Vec::new() };
        let most = f64::from(screen.width.max(screen.height));
        let shown = |distances: &Vec<f32>| {
            largest_size(screen.pixel_tolerance, texel_density.distance(distances)).min(most)
        };
        texel_density.pixels = distances.iter().map(shown).collect();
        Ok(texel_density)
    }

    /// The distance of the surface of a level that is off the most, over the diagonal.
    fn distance(&self, distances: &[f32]) -> f64 {
        let surfaces = distances.iter().zip(&self.stretches);
        surfaces.map(|(&d, stretch)| f64::from(d) * stretch).fold(0.0, f64::max) / self.diagonal
    }

    /// Number of levels.
    pub(super) fn levels(&self) -> usize {
        self.pixels.len()
    }

    /// One per surface: lengths in the scene over those of its mesh.
    pub(super) fn stretches(&self) -> &[f64] {
        &self.stretches
    }

    /// Number of halvings of an image of `size` in a layout that are not seen on a level.
    pub(super) fn unseen(
        &self,
        surfaces: &[Geometry],
        layout: &UvLayout,
        size: [usize; 2],
        level: usize,
    ) -> u32 {
        let covered = if layout.is_new { PACKED } else { covered(surfaces, &layout.charts) };
        let texels = covered * size[0] as f64 * size[1] as f64;
        let density = (texels / self.used_area(surfaces, &layout.charts)).sqrt();
        let halvings = (density * self.diagonal / self.pixels[level]).log2().floor();
        if halvings > 0.0 { halvings.min(32.0) as u32 } else { 0 }
    }

    /// The share of the asset's surface that charts lie on.
    pub(super) fn share(&self, surfaces: &[Geometry], charts: &[ChartGroup]) -> f64 {
        self.used_area(surfaces, charts) / self.areas.iter().sum::<f64>()
    }

    /// The area in the scene that charts lie on.
    pub(super) fn used_area(&self, surfaces: &[Geometry], charts: &[ChartGroup]) -> f64 {
        let of = |charts: &ChartGroup| {
            let own = area(&surfaces[charts.surface].welded.mesh, |group| group == charts.group);
            own * self.stretches[charts.surface].powi(2)
        };
        charts.iter().map(of).sum()
    }
}

/// The share of an image that charts of the source cover.
fn covered(surfaces: &[Geometry], charts: &[ChartGroup]) -> f64 {
    let meshes: Vec<&Mesh> = surfaces.iter().map(|surface| &surface.welded.mesh).collect();
    let area = |face: &Face| {
        let [a, b, c] = face.uvs.map(glam::Vec2::as_dvec2);
        0.5 * (b - a).perp_dot(c - a).abs()
    };
    faces(charts, &meshes).iter().map(area).sum()
}

/// `size` of the source's images, doubled so often that a new layout shows about as many texels as charts
/// show of them: more where those overlap or tile.
pub(super) fn as_dense(surfaces: &[Geometry], layout: &UvLayout, size: [usize; 2]) -> [usize; 2] {
    let read = layout.charts.iter().enumerate().filter_map(|(at, charts)| {
        let SourceReading { uv_set, transform, .. } = layout.reading(at)?;
        Some(ChartGroup { uv_set, transform, ..*charts })
    });
    let shown = covered(surfaces, &read.collect::<Vec<_>>());
    let doublings = ((shown / PACKED).log2() / 2.0).round();
    let room = (MOST_SIDE as f64 / size[0].max(size[1]) as f64).log2().floor();
    let times = 2f64.powf(doublings.min(room).max(0.0)) as usize;
    size.map(|side| side * times)
}

/// The area of the triangles of some groups.
fn area(mesh: &Mesh, is_in: impl Fn(u32) -> bool) -> f64 {
    let own = (0..mesh.triangles.len()).filter(|&triangle| is_in(mesh.groups[triangle]));
    own.map(|triangle| 0.5 * area_vector(mesh.triangle_positions(triangle)).length()).sum()
}

/// `size` halved so many times, no side below one texel.
pub(super) fn halved(size: [usize; 2], times: u32) -> [usize; 2] {
    size.map(|side| side.checked_shr(times).unwrap_or(0).max(1))
}

/// Images of one sheet and level, as a budget sees them.
#[derive(Clone, Debug)]
pub(super) struct Share {
    /// Size of all texels and channels, in bytes.
    pub(super) bytes: f64,
    pub(super) halvings: u32,
    /// Halvings up to here lose nothing that is seen.
    pub(super) unseen: u32,
    /// The error of each further halving of the source's image, by the area that shows it.
    pub(super) details: Vec<f64>,
}

impl Share {
    /// The error of the next halving per byte that it saves; `None` if there is nothing left to
    /// halve.
    fn loss_per_byte(&self) -> Option<f64> {
        let lost = self.details.get(self.halvings as usize)?;
        let lost = if self.halvings < self.unseen { 0.0 } else { *lost };
        Some(lost / (0.75 * self.bytes).max(1.0))
    }
}

/// Halves images, the cheapest first, until their bytes are thought to fit; false if they can't.
pub(super) fn fit(shares: &mut [Share], budget: f64) -> bool {
    let mut bytes: f64 = shares.iter().map(|share| share.bytes).sum();
    while bytes > budget {
        let priced = shares.iter_mut().filter_map(|share| Some((share.loss_per_byte()?, share)));
        let Some((_, share)) = priced.min_by(|a, b| a.0.total_cmp(&b.0)) else { return false };
        bytes -= 0.75 * share.bytes;
        share.bytes *= 0.25;
        share.halvings += 1;
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn share(bytes: f64, unseen: u32, details: &[f64]) -> Share {
        Share { bytes, halvings: 0, unseen, details: details.to_vec() }
    }

    #[test]
    fn what_loses_least_per_byte_is_halved_first() {
        let mut shares = [
            share(1000.0, 0, &[9.0, 9.0]),
            share(1000.0, 0, &[1.0, 20.0]),
            share(100.0, 1, &[5.0]),
        ];
        assert!(fit(&mut shares, 1300.0));
        let halvings = |shares: &[Share]| shares.iter().map(|s| s.halvings).collect::<Vec<_>>();
        // The third loses nothing that is seen; then the second is the cheapest.
        assert_eq!(halvings(&shares), [0, 1, 1]);
        assert!(fit(&mut shares, 600.0));
        assert_eq!(halvings(&shares), [1, 1, 1]);
        assert!(!fit(&mut shares, 1.0));
    }

    #[test]
    fn no_side_falls_below_a_texel() {
        assert_eq!(halved([8, 2], 2), [2, 1]);
        assert_eq!(halved([8, 2], 99), [1, 1]);
    }
}
