//! The merging of two points of one wedge each, as most within a surface are: there is nothing to tell apart.

use super::Plan;
use crate::id::{PointId, WedgeId};
use crate::metric::Metric;
use crate::quadric;
use crate::topology::Topology;

impl Plan {
    /// What is worked out for any points, for two of one wedge each.
    pub(super) fn set_plain(&mut self, topology: &Topology, metric: &Metric, wedges: [WedgeId; 2]) {
        self.wedges.clear();
        self.wedges.extend(wedges);
        self.wedge_ends.clear();
        self.wedge_ends.extend([1, 2]);
        self.slots.clear();
        (0..).zip(wedges).for_each(|(slot, wedge)| self.slots.set(wedge.index(), slot));
        let kept = self.collect_plain(topology, metric);
        self.unify_plain(kept);
        let [first, second] = wedges.map(|wedge| metric.quadric(wedge));
        self.areas.clear();
        self.areas.extend([first, second].map(quadric::weight));
        self.quadrics.clear();
        if self.is_void() {
            self.quadrics.extend_from_slice(first);
            self.quadrics.extend_from_slice(second);
        } else {
            self.quadrics.extend(first.iter().zip(second).map(|(a, b)| a + b));
        }
        self.add_up(metric);
    }

    /// Finds the triangles at the two points; returns how many of those at the first one stay.
    fn collect_plain(&mut self, topology: &Topology, metric: &Metric) -> usize {
        self.collapsing.clear();
        self.surviving.clear();
        self.star.clear();
        let [first, second] = [self.points[0], self.points[1]];
        let mut kept = 0;
        for (own, other) in [(first, second), (second, first)] {
            for corner in topology.corners(own) {
                let [a, b]: [PointId; 2] = topology.others(corner);
                if a != other && b != other {
                    self.surviving.push(corner);
                    self.star.push([metric.positions[a], metric.positions[b]]);
                } else if own == first {
                    self.collapsing.push(corner.triangle());
                }
            }
            if own == first {
                kept = self.surviving.len();
            }
        }
        kept
    }

    /// Makes the wedges one if a triangle collapses. `kept` of the triangles that stay are at the first point.
    fn unify_plain(&mut self, kept: usize) {
        self.merged_of.clear();
        self.members.clear();
        self.used.clear();
        let stay = self.surviving.len();
        if self.is_void() {
            self.merged_of.extend([0, 1]);
            self.members.extend_from_slice(&self.wedges);
            self.used.extend([kept > 0, stay > kept]);
        } else {
            self.merged_of.extend([0, 0]);
            self.members.push(self.wedges[0]);
            self.used.push(stay > 0);
        }
    }
}
