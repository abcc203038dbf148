//! The area of the surface that a collapse removes.

use glam::DVec3;

use super::Plan;
use crate::metric::Metric;
use crate::topology::Topology;

/// Area that a collapse removes, in the units of the metric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LostArea {
    /// Area lost of the whole surface.
    pub(crate) all: f64,
    /// Area lost as borders recede.
    pub(crate) borders: f64,
}

impl Plan {
    /// The distance from `position` to the farthest point around it.
    pub(crate) fn reach(&self, position: DVec3) -> f64 {
        let squares = self.star.iter().flatten().map(|p| p.distance_squared(position));
        squares.fold(0.0, f64::max).sqrt()
    }

    /// The area lost if the merged point goes to `position`, below 0 if it grows: of the whole
    /// surface, and as borders recede. The sum of area vectors depends on the rim alone: where that
    /// is closed, no border has receded, however much flatter the surface is.
    pub(crate) fn lost_area(
        &self,
        topology: &Topology,
        metric: &Metric,
        position: DVec3,
    ) -> LostArea {
        let vector = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a) / 2.0;
        let (mut before, mut after, mut all) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for &triangle in &self.collapsing {
            let own = vector(topology.points(triangle).map(|point| metric.positions[point]));
            before += own;
            all += own.length();
        }
        for &corner in &self.surviving {
            let mut p = topology.points(corner.triangle()).map(|point| metric.positions[point]);
            let old = vector(p);
            p[corner.slot()] = position;
            let new = vector(p);
            before += old;
            after += new;
            all += old.length() - new.length();
        }
        LostArea { all, borders: (before - after).dot(before.normalize_or_zero()) }
    }
}
