//! The triangles around a merged point, and the distance of a place to them.

use glam::DVec3;

use crate::collapse::Plan;
use crate::id::PointId;
use crate::metric::Metric;
use crate::topology::Topology;
use crate::triangle::FromCorner;

/// The triangles around a merged point.
pub(super) struct Star<'a> {
    pub(super) points: &'a [PointId],
    /// The points that come off.
    pub(super) tips: Vec<PointId>,
    pub(super) position: DVec3,
    /// The two other points of each, and where they are.
    pub(super) rim: Vec<([PointId; 2], [DVec3; 2])>,
    topology: &'a Topology,
    metric: &'a Metric,
}

impl<'a> Star<'a> {
    pub(super) fn new(
        plan: &'a Plan,
        tips: Vec<PointId>,
        topology: &'a Topology,
        metric: &'a Metric,
        position: DVec3,
    ) -> Self {
        let others = plan.surviving().iter().map(|&corner| topology.others(corner));
        let rim = others.map(|ends| (ends, ends.map(|end| metric.positions[end]))).collect();
        Self { points: plan.points(), tips, position, rim, topology, metric }
    }

    /// The squared distance of a place to the triangles around the merged point, or if that is above
    /// `limit` to those around their other points too; and which of the points it is nearest to is to
    /// carry it.
    pub(super) fn nearest(&self, place: DVec3, limit: f64) -> (f64, PointId) {
        let mut best = (f64::INFINITY, self.points[0]);
        for &(ends, [a, b]) in &self.rim {
            let triangle = FromCorner::new(a - self.position, b - self.position);
            let square = triangle.square_to(place - self.position);
            if square < best.0 {
                let corners = [(self.points[0], self.position), (ends[0], a), (ends[1], b)];
                best = (square, nearest_corner(place, corners));
            }
        }
        if best.0 > limit {
            let ends = self.rim.iter().flat_map(|(ends, _)| ends);
            for &end in ends.chain(&self.tips) {
                search_around(self.topology, self.metric, end, self.points, place, &mut best);
            }
        }
        best
    }
}

/// Looks among the triangles at a point that those of `but` have no part in.
pub(super) fn search_around(
    topology: &Topology,
    metric: &Metric,
    point: PointId,
    but: &[PointId],
    place: DVec3,
    best: &mut (f64, PointId),
) {
    for corner in topology.corners(point) {
        let points = topology.points(corner.triangle());
        if points.iter().any(|p| but.contains(p)) {
            continue;
        }
        let p = points.map(|point| metric.positions[point]);
        let square = FromCorner::new(p[1] - p[0], p[2] - p[0]).square_to(place - p[0]);
        if square < best.0 {
            *best = (square, nearest_corner(place, [0, 1, 2].map(|k| (points[k], p[k]))));
        }
    }
}

/// The corner of a triangle that is nearest to a place.
pub(super) fn nearest_corner(place: DVec3, corners: [(PointId, DVec3); 3]) -> PointId {
    let mut best = (f64::INFINITY, corners[0].0);
    for (point, position) in corners {
        let square = position.distance_squared(place);
        if square < best.0 {
            best = (square, point);
        }
    }
    best.1
}
