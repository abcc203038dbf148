//! The surface before a descent, and the distance of a place to it.

use std::sync::OnceLock;

use glam::{DVec3, Vec3};

use crate::id::{PointId, TriangleId};
use crate::metric::Metric;
use crate::sets::DisjointSets;
use crate::surface::{Foot, Surface};
use crate::topology::Topology;

/// A surface as it was, in the space of the metric.
pub(super) struct Reference {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Built at the first search: most descents need none.
    surface: OnceLock<Surface>,
    /// Per point: the shell that it belonged to, named by its least point.
    shells: Vec<u32>,
    /// One per point, sRGB in 0…1, or empty.
    colors: Vec<[f32; 3]>,
    /// Per point: whether the shell of this name is removed.
    removed: Vec<bool>,
    /// Per point: whether the shell of this name was found to be needed.
    needed: Vec<bool>,
}

impl Reference {
    /// The surface as it stands, with the colors of its points if there are any.
    pub(super) fn new(topology: &Topology, metric: &Metric, colors: Vec<[f32; 3]>) -> Self {
        let points = metric.positions.len();
        let all = (0..topology.triangle_edges().len()).map(TriangleId::new);
        let live = all.filter(|&t| topology.is_live(t));
        let triangles: Vec<[u32; 3]> = live.map(|t| topology.points(t).map(|p| p.0)).collect();
        let mut sets = DisjointSets::new(points);
        for [a, b, c] in &triangles {
            sets.join(*a, *b);
            sets.join(*b, *c);
        }
        Self {
            positions: metric.positions.iter().map(|p| p.as_vec3()).collect(),
            triangles,
            surface: OnceLock::new(),
            shells: (0..points as u32).map(|point| sets.root(point)).collect(),
            colors,
            removed: vec![false; points],
            needed: vec![false; points],
        }
    }

    /// Its triangles, as points.
    pub(super) fn triangles(&self) -> impl Iterator<Item = [PointId; 3]> + '_ {
        self.triangles.iter().map(|t| t.map(PointId))
    }

    /// The squared distance of `p` to it, if that is at most `limit` squared.
    pub(super) fn square_to(&self, p: DVec3, limit: f64) -> Option<f64> {
        self.surface().closest_foot(p, limit, |_| true).map(|foot| foot.distance_squared)
    }

    /// The points of the triangle nearest to `p` within `limit` that belongs to shells other than those of
    /// `points` that are still there.
    pub(super) fn nearest_of_others(
        &self,
        p: DVec3,
        limit: f64,
        points: &[PointId],
    ) -> Option<[PointId; 3]> {
        let foot = self.foot_on_others(p, limit, points)?;
        Some(self.triangles[foot.triangle.index()].map(PointId))
    }

    /// The name of the shell that a point belonged to, if it has colors.
    pub(super) fn colored_shell(&self, point: PointId) -> Option<u32> {
        self.colors.get(point.index()).map(|_| self.shells[point.index()])
    }

    /// The difference in color between a point and the nearest place on shells other than those of
    /// `points`: RMS over the channels. `None` if there are none, or no colors.
    pub(super) fn contrast(&self, point: PointId, points: &[PointId]) -> Option<f64> {
        let own = self.colors.get(point.index())?;
        let place = self.positions[point].as_dvec3();
        let foot = self.foot_on_others(place, f64::INFINITY, points)?;
        let corners = self.triangles[foot.triangle.index()].map(|at| self.colors[at as usize]);
        let squares = (0..3).map(|channel| {
            let behind: f64 = (0..3)
                .map(|slot| foot.barycentrics[slot] * f64::from(corners[slot][channel]))
                .sum();
            (behind - f64::from(own[channel])).powi(2)
        });
        Some((squares.sum::<f64>() / 3.0).sqrt())
    }

    fn foot_on_others(&self, p: DVec3, limit: f64, points: &[PointId]) -> Option<Foot> {
        let accept = |triangle: TriangleId| {
            let shell = self.shells[self.triangles[triangle.index()][0] as usize];
            !self.removed[shell as usize] && !points.iter().any(|p| self.shells[p.index()] == shell)
        };
        self.surface().closest_foot(p, limit, accept)
    }

    /// Notes that the shells of `points` are removed.
    pub(super) fn record_removal(&mut self, points: &[PointId]) {
        for point in points {
            self.removed[self.shells[point.index()] as usize] = true;
        }
    }

    /// Notes that the shells of `points` can't be removed: others only get fewer.
    pub(super) fn need(&mut self, points: &[PointId]) {
        for point in points {
            self.needed[self.shells[point.index()] as usize] = true;
        }
    }

    /// Whether the shell of a point can't be removed.
    pub(super) fn needs(&self, point: PointId) -> bool {
        self.needed[self.shells[point.index()] as usize]
    }

    fn surface(&self) -> &Surface {
        self.surface.get_or_init(|| Surface::new(&self.positions, self.triangles.iter().copied()))
    }
}
