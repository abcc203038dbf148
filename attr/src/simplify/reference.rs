//! The surface that a descent set out from, to ask how far a place is from what is left of it.

use std::sync::OnceLock;

use glam::{DVec3, Vec3};

use crate::id::{PointId, TriangleId};
use crate::metric::Metric;
use crate::sets::DisjointSets;
use crate::surface::Surface;
use crate::topology::Topology;

/// A surface as it was, in the space of the metric.
pub(super) struct Reference {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Built when it is first asked: most descents never do.
    surface: OnceLock<Surface>,
    /// Per point: the shell that it belonged to, named by its least point.
    shells: Vec<u32>,
    /// Per point: whether the shell of this name has vanished.
    vanished: Vec<bool>,
}

impl Reference {
    /// The surface as it stands.
    pub(super) fn new(topology: &Topology, metric: &Metric) -> Self {
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
            vanished: vec![false; points],
        }
    }

    /// Its triangles, as points.
    pub(super) fn triangles(&self) -> impl Iterator<Item = [PointId; 3]> + '_ {
        self.triangles.iter().map(|t| t.map(PointId))
    }

    /// Whether it has a place within `limit` of `p`.
    pub(super) fn is_near(&self, p: DVec3, limit: f64) -> bool {
        self.surface().closest_foot(p, limit, |_| true).is_some()
    }

    /// Whether shells other than those of `points` that are still there have a place within `limit` of
    /// `p`.
    pub(super) fn is_near_others(&self, p: DVec3, limit: f64, points: &[PointId]) -> bool {
        let accept = |triangle: TriangleId| {
            let shell = self.shells[self.triangles[triangle.index()][0] as usize];
            !self.vanished[shell as usize]
                && !points.iter().any(|p| self.shells[p.index()] == shell)
        };
        self.surface().closest_foot(p, limit, accept).is_some()
    }

    /// Notes that the shells of `points` have vanished.
    pub(super) fn vanish(&mut self, points: &[PointId]) {
        for point in points {
            self.vanished[self.shells[point.index()] as usize] = true;
        }
    }

    fn surface(&self) -> &Surface {
        self.surface.get_or_init(|| Surface::new(&self.positions, self.triangles.iter().copied()))
    }
}
