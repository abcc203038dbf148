//! Seams of a level, drawn to where those of its source run.
//!
//! Between the two lies a strip that shows what no chart has there, or the material of the other side. A fit
//! of faces leaves it: on what is flat, a seam may run anywhere. So points of the level's seams are paired
//! with the nearest points of the source's, and what counts is how far apart they are across the seam, in the
//! surface: along it they slide, as points of faces do over theirs.
//!
//! Lab note: levels of 25 and 6.25 % with the source's textures, 6 lit views at 512², 100,000 samples, over
//! those without; geometric mean and worst of popcorn, frypan, gelatin_box, FlightHelmet, TennisRacquet and
//! dutch_ship, and of five others (mars_tiles, cat_webp, bitmoji, two made cartons):
//!
//! | reach | luminance | color | distance |
//! |---|---|---|---|
//! | a fifth of the edge | 1.001 (1.009) | 0.981 (1.002) | 1.007 (1.044) |
//! | **a quarter of the height** | 1.000 (1.005) | 0.983 (1.004) | 1.003 (1.006) |
//! | the same, the five others | 0.985 (1.002) | 0.968 (1.005) | 1.005 (1.014) |
//!
//! Of eight assets and a fifth of the edge: with pairs from the source's seams to the level's as well, color
//! 0.967, 0.967 and 0.963 and distance 1.005, 1.008 and 1.013 with weights of 0.03, 0.05 and 0.1; without, at
//! 0.05, color 0.970 and distance 1.005.

use glam::DVec3;
use rayon::prelude::*;

use super::edges::{SheetEdge, inner_edges};
use super::sheet::{Sheet, SurfacePoint};
use crate::edges::EdgeKind;
use crate::surface::Surface;

/// What a seam edge counts beside the samples of a triangle.
const WEIGHT: f64 = 0.05;
/// Points of each seam edge.
const SAMPLES: usize = 8;
/// The largest distance of two seams that belong together, in heights over the level's edge.
const REACH: f64 = 0.25;
/// The least cosine between them.
const ALIGNED: f64 = 0.7;
/// Edges that one thread samples at least.
const AT_ONCE: usize = 64;

/// The seams of a source.
pub(super) struct SeamLines {
    /// Each edge as a triangle without area.
    lines: Surface,
    /// One per edge: its direction.
    directions: Vec<DVec3>,
}

/// Where a point of a level's seam is wanted.
pub(super) struct Pull {
    pub(super) at: SurfacePoint,
    /// The direction that counts, of unit length.
    pub(super) across: DVec3,
    /// How far it is along that from where it should be.
    pub(super) off: f64,
    /// How many samples of triangles it counts for.
    pub(super) weight: f64,
}

impl SeamLines {
    pub(super) fn new(source: &Sheet<'_>) -> Self {
        let seams = seams(&inner_edges(source));
        let ends = seams.iter().map(|seam| seam.vertices(source));
        Self {
            lines: Surface::new(&source.mesh.positions, ends.map(|[a, b]| [a, b, b])),
            directions: seams.iter().map(|s| s.vector(source).normalize_or_zero()).collect(),
        }
    }

    /// What `seams` of a level ask for that has so many samples on a triangle.
    pub(super) fn pulls(&self, level: &Sheet<'_>, seams: &[SheetEdge], density: f64) -> Vec<Pull> {
        if self.lines.is_empty() {
            return Vec::new();
        }
        let weight = WEIGHT * density / SAMPLES as f64;
        let shares = (0..SAMPLES).map(|step| (step as f64 + 0.5) / SAMPLES as f64);
        let all = seams.par_iter().with_min_len(AT_ONCE);
        all.flat_map_iter(|seam| {
            let (along, reach) = (seam.vector(level), REACH * height(level, seam));
            let at = shares.clone().map(|share| seam.at(share));
            at.filter_map(move |at| self.pull(level, at, (along, reach), weight))
        })
        .collect()
    }

    /// What a point of a level's seam asks for, if a seam of the source is in reach and runs along.
    fn pull(
        &self,
        level: &Sheet<'_>,
        at: SurfacePoint,
        (along, reach): (DVec3, f64),
        weight: f64,
    ) -> Option<Pull> {
        let (place, length) = (level.place(&at), along.length());
        let foot = self.lines.closest_foot(place, reach, |line| {
            self.directions[line].dot(along).abs() > ALIGNED * length
        })?;
        let across = level.normal(at.triangle).cross(self.directions[foot.triangle]);
        let across = across.try_normalize()?;
        Some(Pull { at, across, off: across.dot(place - foot.point), weight })
    }
}

/// The lesser height of the triangles at an edge over it.
fn height(sheet: &Sheet<'_>, edge: &SheetEdge) -> f64 {
    let length = edge.vector(sheet).length();
    let doubled_area = |t| {
        let [a, b, c] = sheet.corners(t);
        (b - a).cross(c - a).length()
    };
    let [own, other] = [edge.triangle, edge.other].map(doubled_area);
    if length > 0.0 { own.min(other) / length } else { 0.0 }
}

/// Those of the edges that are seams.
pub(super) fn seams(edges: &[SheetEdge]) -> Vec<SheetEdge> {
    edges.iter().filter(|edge| edge.kind == EdgeKind::Seam).copied().collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::mesh::Mesh;
    use crate::polish::fans::Fans;
    use crate::polish::tests::parted;
    use crate::testing::grid;

    fn pulls(source: &Mesh, level: &Mesh) -> Vec<Pull> {
        let [source, level] =
            [source, level].map(|mesh| Sheet::new(mesh, Arc::new(Fans::of(mesh))));
        SeamLines::new(&source).pulls(&level, &seams(&inner_edges(&level)), 10.0)
    }

    #[test]
    fn a_seam_is_pulled_back_across_and_not_along() {
        let (source, mut level) = (parted(&grid(32)), parted(&grid(8)));
        level
            .positions
            .iter_mut()
            .filter(|p| p.x == 0.5)
            .for_each(|p| *p += Vec3::new(0.02, 0.01, 0.0));
        let pulls = pulls(&source, &level);
        assert_eq!(pulls.len(), 8 * SAMPLES);
        for pull in &pulls {
            assert!((pull.across * pull.off - DVec3::X * 0.02).length() < 1e-6, "{}", pull.across);
        }
        let weight: f64 = pulls.iter().map(|pull| pull.weight).sum();
        assert!((weight / (8.0 * 10.0 * WEIGHT) - 1.0).abs() < 1e-9, "{weight}");
    }

    #[test]
    fn far_ones_and_ones_across_are_not_of_one_seam() {
        let mut level = parted(&grid(8));
        level.positions.iter_mut().filter(|p| p.x == 0.5).for_each(|p| p.x += 0.03);
        assert!(pulls(&parted(&grid(32)), &level).is_empty());
        let mut across = parted(&grid(8));
        across.positions.iter_mut().for_each(|p| (p.x, p.y) = (p.y, p.x));
        across.triangles.iter_mut().for_each(|wedges| wedges.swap(1, 2));
        assert!(pulls(&parted(&grid(32)), &across).is_empty());
        assert!(pulls(&grid(32), &parted(&grid(8))).is_empty());
    }
}
