//! Options of a simplification.

use crate::error::{Error, Result};
use crate::id::PointId;
use crate::mesh::Mesh;

/// The cost that orders collapses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cost {
    /// The generalized quadric, and what a collapse exposes.
    #[default]
    Quadric,
    /// The squared length of the edge, as a baseline to compare with.
    EdgeLength,
}

/// The placement of a merged point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Placement {
    /// At the minimum of the cost.
    #[default]
    Best,
    /// At the cheaper end of the edge, with its attributes: all points and, but where a seam ends,
    /// all wedges of a level are the source's to the bit, and a polish leaves them alone.
    Ends,
    /// At the middle of the edge, as a baseline to compare with.
    Middle,
}

/// Weights of a unit of error in each attribute beside a unit of distance.
///
/// Lab note (`cargo bench --bench quality -- --alone --views 6 --resolution 256 --samples 30000`):
/// the normal's weight decides. RMS sRGB luminance and RMS distance over the diagonal at 6.25 %:
///
/// | UV, normal | scanned box | gelatin box | racquet |
/// |---|---|---|---|
/// | 0.5, 0.05 | 0.0078, 4.5e-4 | 0.0075, 4.8e-4 | 0.0262, 6.0e-3 |
/// | 1, 0.02 | 0.0055, 2.9e-4 | 0.0061, 3.6e-4 | 0.0247, 5.7e-3 |
/// | 0.5, 0.01 | 0.0044, 2.2e-4 | 0.0056, 3.0e-4 | 0.0231, 5.8e-3 |
/// | **0.5, 0.005** | 0.0042, 1.9e-4 | 0.0056, 2.6e-4 | 0.0212, 4.8e-3 |
/// | 0.2, 0.005 | 0.0042, 2.0e-4 | 0.0056, 2.6e-4 | 0.0204, 4.7e-3 |
/// | 0.5, 0.002 | 0.0043, 1.8e-4 | 0.0058, 2.4e-4 | 0.0204, 4.8e-3 |
///
/// Less than 0.005 buys distance with shading. Seams at 0.1 instead of 1 gain 4 to 11 % in distance
/// on the boxes and let their outlines slide (color 0.0024 → 0.0036 on the first); borders at 1
/// instead of 4 cost the racquet a quarter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// Weight of UVs, measured in lengths on the surface.
    pub uv: f64,
    /// Weight of unit normals, in shares of the mesh's extent.
    pub normal: f64,
    /// Weight of colors in 0…1, in shares of the mesh's extent.
    pub color: f64,
    /// Weight of the planes that hold borders.
    pub border: f64,
    /// Weight of the planes that hold seams and material boundaries.
    pub seam: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self { uv: 0.5, normal: 0.005, color: 0.02, border: 4.0, seam: 1.0 }
    }
}

/// Options of a simplification.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options<'a> {
    /// Weights of the metric.
    pub weights: Weights,
    /// The cost that orders collapses.
    pub cost: Cost,
    /// The placement of merged points.
    pub placement: Placement,
    /// No collapse may have an error above this, in the units of the mesh.
    pub max_error: Option<f64>,
    /// No part of the surface may end farther than this from the source, nor of the source from it, in
    /// the units of the mesh: a collapse that would is not done. Measured at samples, and on a mesh that
    /// is simplified in regions from below 65,536 triangles on; a polish comes after.
    pub max_deviation: Option<f64>,
    /// The share of the area that may go as borders recede and shells are removed, 0 to 1; only with
    /// `max_deviation`.
    pub max_lost_area: f64,
    /// No collapse may rotate a triangle by more than this, in degrees above 0 and up to 90, nor may a
    /// polish, seen from the level that it is given.
    pub max_rotation: f64,
    /// Points of two shells nearer than this, in the units of the mesh, may merge at their cost by the
    /// quadrics, as if there were an edge between them.
    pub join_distance: Option<f64>,
    /// Place merged points where the enclosed volume stays what it is, in the descent and in the polish;
    /// only with the best placement.
    pub keep_volume: bool,
    /// One per point, or empty if all count alike: what the costs around it are multiplied by, 0 or more.
    /// See [`view_importance`](crate::view_importance) and
    /// [`curvature_importance`](crate::curvature_importance).
    pub importance: &'a [f32],
    /// One per point, or empty: its color as it is seen, sRGB in 0…1. A small shell that is removed costs its
    /// contrast to what lies behind, so that eyes and lamps stay longer; only with `max_deviation`.
    pub colors: &'a [[f32; 3]],
    /// One per point, or empty if all are free: a locked point keeps its position and the
    /// attributes of its wedges to the bit, and no edge at it collapses.
    pub locked: &'a [bool],
}

/// What a descent may lose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// How far the surface may be off, in the units of the metric.
    pub(crate) deviation: f64,
    /// The share of its area that may go.
    pub(crate) area: f64,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self {
            weights: Weights::default(),
            cost: Cost::default(),
            placement: Placement::default(),
            max_error: None,
            max_deviation: None,
            max_lost_area: 1.0,
            max_rotation: 75.0,
            join_distance: None,
            keep_volume: false,
            importance: &[],
            colors: &[],
            locked: &[],
        }
    }
}

impl Options<'_> {
    /// The limits of a descent in a space of this unit, if there are any.
    pub(crate) fn limits(&self, unit: f64) -> Option<Limits> {
        let deviation = self.max_deviation?;
        Some(Limits { deviation: deviation / unit, area: self.max_lost_area })
    }

    /// The cosine of the largest rotation.
    pub(crate) fn rotation_cosine(&self) -> f64 {
        self.max_rotation.to_radians().cos()
    }

    /// One per point of a level that stands for `sources`: whether it is locked. Empty if none is.
    pub(crate) fn locked_of(&self, sources: &[PointId]) -> Vec<bool> {
        if self.placement == Placement::Ends {
            return vec![true; sources.len()];
        }
        if self.locked.is_empty() {
            return Vec::new();
        }
        sources.iter().map(|&source| self.locked[source]).collect()
    }

    /// Checks that every figure makes sense and every list fits `mesh`.
    pub(crate) fn check(&self, mesh: &Mesh) -> Result<()> {
        let w = self.weights;
        if [w.uv, w.normal, w.color, w.border, w.seam].iter().any(|w| !w.is_finite() || *w < 0.0) {
            return Err(Error::Options { what: "weights must be finite and not negative".into() });
        }
        if !(self.max_rotation > 0.0 && self.max_rotation <= 90.0) {
            let what = "a rotation must be above 0 and at most 90 degrees".into();
            return Err(Error::Options { what });
        }
        if self.max_deviation.is_some_and(|x| x.is_nan() || x < 0.0) {
            let what = "the deviation limit must be 0 or more".into();
            return Err(Error::Options { what });
        }
        if !(0.0..=1.0).contains(&self.max_lost_area) {
            let what = "the share of the area that may go must lie in 0 to 1".into();
            return Err(Error::Options { what });
        }
        if self.join_distance.is_some_and(|x| !x.is_finite() || x < 0.0) {
            let what = "the distance to join across must be finite and not negative".into();
            return Err(Error::Options { what });
        }
        if self.keep_volume && self.placement != Placement::Best {
            let what = "the volume can only be kept with the best placement".into();
            return Err(Error::Options { what });
        }
        if self.importance.iter().any(|x| !x.is_finite() || *x < 0.0) {
            let what = "importances must be finite and not negative".into();
            return Err(Error::Options { what });
        }
        let points = mesh.positions.len();
        let lists = [
            (self.locked.len(), "locks"),
            (self.importance.len(), "importances"),
            (self.colors.len(), "colors"),
        ];
        for (count, what) in lists {
            if count != 0 && count != points {
                let what = format!("{count} {what} for {points} points");
                return Err(Error::Options { what });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;
    use crate::chain::{Level, polish_chain, simplify_chain};
    use crate::polish::Polish;
    use crate::testing::{grid, sphere, surface};
    use glam::Vec3;

    fn chain(mesh: &Mesh, target: usize, options: &Options<'_>) -> Level {
        simplify_chain(mesh, &[target], options, &AtomicUsize::new(0)).unwrap().remove(0)
    }

    fn polished(mesh: &Mesh, level: Level, options: &Options<'_>) -> Level {
        let mut levels = [level];
        let polish = Polish::default();
        polish_chain(mesh, &mut levels, options, &polish, &AtomicUsize::new(0)).unwrap();
        let [level] = levels;
        level
    }

    /// Fails unless every locked point of the source is there as it was, all of its wedges too.
    fn assert_kept(mesh: &Mesh, locked: &[bool], level: &Level) {
        let bits = |row: &[f32]| row.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let mut found = vec![0; mesh.wedge_points.len()];
        for (wedge, &source) in level.wedge_sources.iter().enumerate() {
            let point = level.mesh.wedge_points[wedge];
            let stands_for = level.point_sources[point];
            if locked[stands_for.index()] {
                let (own, old) = (level.mesh.positions[point], mesh.positions[stands_for]);
                assert_eq!(bits(&own.to_array()), bits(&old.to_array()));
                let own = level.mesh.row(crate::WedgeId::new(wedge));
                assert_eq!(bits(own), bits(mesh.row(source)));
                found[source.index()] += 1;
            }
        }
        for (wedge, &point) in mesh.wedge_points.iter().enumerate() {
            assert!(!locked[point.index()] || found[wedge] == 1, "wedge {wedge}");
        }
    }

    #[test]
    fn locked_points_keep_their_bits_through_descent_and_polish() {
        let bumps = surface(30, |x, y| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()));
        for mesh in [bumps, sphere(24)] {
            let locked: Vec<bool> = mesh.positions.iter().map(|p| p.x > 0.6).collect();
            for cost in [Cost::Quadric, Cost::EdgeLength] {
                let options = Options { locked: &locked, cost, ..Options::default() };
                let level = chain(&mesh, mesh.triangles.len() / 2, &options);
                assert_eq!(level.stopped, None);
                assert_kept(&mesh, &locked, &level);
                assert_kept(&mesh, &locked, &polished(&mesh, level, &options));
            }
        }
    }

    #[test]
    fn locks_hold_in_regions_and_stop_what_is_locked_whole() {
        let mesh = sphere(182);
        let locked: Vec<bool> = mesh.positions.iter().map(|p| p.z > 0.5).collect();
        let options = Options { locked: &locked, ..Options::default() };
        assert_kept(&mesh, &locked, &chain(&mesh, mesh.triangles.len() / 2, &options));
        let (mesh, locked) = (grid(4), [true; 25]);
        let options = Options { locked: &locked, ..Options::default() };
        let level = chain(&mesh, 2, &options);
        assert_eq!((level.mesh.triangles.len(), level.stopped.is_some()), (32, true));
    }

    #[test]
    fn no_triangle_turns_farther_than_allowed() {
        let bumps = surface(30, |x, y| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()));
        let normal = |mesh: &Mesh, triangle: usize| {
            let [a, b, c] = mesh.triangle_positions(triangle);
            (b - a).cross(c - a).normalize()
        };
        let steepest = |level: &Level| {
            let count = level.mesh.triangles.len();
            (0..count).map(|t| normal(&level.mesh, t).z).fold(1.0f32, f32::min)
        };
        let tight = Options { max_rotation: 5.0, ..Options::default() };
        let (loose, tight) = (chain(&bumps, 60, &Options::default()), chain(&bumps, 60, &tight));
        assert!(tight.mesh.triangles.len() > loose.mesh.triangles.len());
        assert!(steepest(&tight) >= steepest(&loose));
    }

    #[test]
    fn a_closed_surface_keeps_its_volume_through_descent_and_polish() {
        let mesh = sphere(24);
        let volume = |mesh: &Mesh| {
            let corners = (0..mesh.triangles.len()).map(|t| mesh.triangle_positions(t));
            corners.map(|[a, b, c]| a.as_dvec3().dot(b.cross(c).as_dvec3())).sum::<f64>()
        };
        let off = |level: &Level| (volume(&level.mesh) / volume(&mesh) - 1.0).abs();
        let kept = Options { keep_volume: true, ..Options::default() };
        let (free, level) = (chain(&mesh, 100, &Options::default()), chain(&mesh, 100, &kept));
        assert!(
            off(&level) < 1e-5 && off(&level) < 0.1 * off(&free),
            "{} {}",
            off(&level),
            off(&free)
        );
        let polished = polished(&mesh, level, &kept);
        assert!(off(&polished) < 1e-5, "{}", off(&polished));
    }

    #[test]
    fn the_ends_placement_keeps_vertices_of_the_source_to_the_bit() {
        let mesh = sphere(24);
        let options = Options { placement: Placement::Ends, ..Options::default() };
        let level = chain(&mesh, 200, &options);
        assert!(level.mesh.triangles.len() <= 200);
        let kept = |level: &Level| {
            let own = |wedge: usize| {
                let (id, source) = (crate::WedgeId::new(wedge), level.wedge_sources[wedge]);
                let point = level.point_sources[level.mesh.wedge_points[wedge]];
                level.mesh.row(id) == mesh.row(source) && mesh.wedge_points[source] == point
            };
            let rows = (0..level.wedge_sources.len()).filter(|&wedge| own(wedge)).count();
            rows as f64 / level.wedge_sources.len() as f64
        };
        for level in [&level, &polished(&mesh, level.clone(), &options)] {
            for (p, &source) in level.mesh.positions.iter().zip(&level.point_sources) {
                assert_eq!(*p, mesh.positions[source]);
            }
            assert!(kept(level) > 0.95, "{}", kept(level));
        }
    }

    #[test]
    fn edge_lengths_leave_no_short_edges_and_quadrics_lie_nearer() {
        let mesh = surface(30, |x, y| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()));
        let with =
            |cost, placement| chain(&mesh, 300, &Options { cost, placement, ..Options::default() });
        let shortest = |level: &Level| {
            let triangles =
                (0..level.mesh.triangles.len()).map(|t| level.mesh.triangle_positions(t));
            triangles
                .flat_map(|[a, b, c]| [a.distance(b), b.distance(c), c.distance(a)])
                .fold(f32::MAX, f32::min)
        };
        let quadric = with(Cost::Quadric, Placement::Best);
        let length = with(Cost::EdgeLength, Placement::Middle);
        assert!(length.mesh.triangles.len() <= 300);
        assert!(shortest(&length) > 1.5 * shortest(&quadric));
        assert!(length.error > 2.0 * quadric.error, "{} {}", length.error, quadric.error);
    }

    #[test]
    fn figures_and_lists_that_make_no_sense_are_refused() {
        let refused = |options: &Options<'_>| {
            let refused = simplify_chain(&grid(2), &[2], options, &AtomicUsize::new(0));
            refused.unwrap_err().to_string()
        };
        let options = Options { locked: &[true], ..Options::default() };
        assert!(refused(&options).contains("1 locks for 9 points"));
        for max_rotation in [0.0, 91.0, f64::NAN] {
            let options = Options { max_rotation, ..Options::default() };
            assert!(refused(&options).contains("at most 90 degrees"));
        }
    }
}
