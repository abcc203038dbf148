//! Placements of a merged point, and the attributes of its wedges there.

use glam::DVec3;

use super::Plan;
use crate::id::{PointId, WedgeId};
use crate::metric::Metric;
use crate::quadric;
use crate::settings::{Cost, Placement};
use crate::solve::minimize;

/// Pull towards the edge's midpoint, as a share of the merged weight: it keeps a flat patch
/// solvable.
const PULL: f64 = 1e-4;
/// The same for a plain sum of planes, which is to be placed by nothing else: as little as rounding allows.
const CLASSIC_PULL: f64 = 1e-8;
/// A placement farther from the midpoint than this many edge lengths is no placement.
const REACH: f64 = 2.0;

impl Plan {
    /// The places worth trying: the minimizer if it lies near the edge, then its ends and the
    /// midpoint; all of them moved to where the area or the volume is kept, if it is to be.
    pub(super) fn places(&self, metric: &Metric) -> [Option<DVec3>; 5] {
        let at = |end: usize| self.points.get(end).map(|&point| metric.positions[point]);
        let (a, b, c) = (metric.positions[self.points[0]], metric.positions[self.points[1]], at(2));
        let middle = c.map_or((a + b) / 2.0, |c| (a + b + c) / 3.0);
        match metric.space.placement {
            Placement::Best => {}
            Placement::Ends => return [None, Some(a), Some(b), None, c],
            Placement::Middle => return [None, None, None, Some(middle), None],
        }
        let longest = c.map_or(0.0, |c| a.distance_squared(c).max(b.distance_squared(c)));
        let reach = REACH * REACH * a.distance_squared(b).max(longest);
        let pull = if metric.space.cost == Cost::Classic { CLASSIC_PULL } else { PULL };
        let best = minimize(&self.total, middle, pull * self.weight, self.kept)
            .filter(|best| best.distance_squared(middle) <= reach);
        let keep = |place| Some(self.kept.map_or(place, |plane| plane.foot(place)));
        [best, keep(a), keep(b), keep(middle), c.and_then(keep)]
    }

    /// Fills the rows of the merged wedges with their best attributes at `position`.
    pub(super) fn place_attributes(&mut self, metric: &Metric, position: DVec3) {
        let (stride, attributes) = (quadric::stride(metric.attributes), metric.attributes);
        self.row.clear();
        for &member in &self.members {
            self.row.extend_from_slice(metric.row(member));
        }
        if attributes == 0 {
            return;
        }
        let rows = self.row.chunks_exact_mut(attributes);
        for (row, packed) in rows.zip(self.quadrics.chunks_exact(stride)) {
            quadric::best_attributes(packed, position, row);
        }
        if metric.space.placement == Placement::Ends {
            self.keep_rows(metric, position);
        }
    }

    /// Gives merged wedges the row of the last wedge that they had at the end that stays.
    fn keep_rows(&mut self, metric: &Metric, position: DVec3) {
        let stays = |&point: &PointId| metric.positions[point] == position;
        let Some(end) = self.points.iter().position(stays) else { return };
        let start = end.checked_sub(1).map_or(0, |before| self.wedge_ends[before]);
        for at in start..self.wedge_ends[end] {
            let row = self.merged_of[at] as usize * metric.attributes;
            self.row[row..][..metric.attributes].copy_from_slice(metric.row(self.wedges[at]));
        }
    }

    pub(super) fn placed_row(&self, metric: &Metric, wedge: WedgeId) -> &[f64] {
        &self.row[self.merged(wedge) * metric.attributes..][..metric.attributes]
    }
}
