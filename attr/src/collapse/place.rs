//! Where a merged point may go, and what its wedges have there.

use glam::DVec3;

use super::Plan;
use crate::id::WedgeId;
use crate::metric::Metric;
use crate::options::Placement;
use crate::quadric;
use crate::solve::minimize;

/// Pull towards the edge's midpoint, as a share of the merged weight: it keeps a flat patch
/// solvable.
const PULL: f64 = 1e-4;
/// A placement farther from the midpoint than this many edge lengths is no placement.
const REACH: f64 = 2.0;

impl Plan {
    /// The places worth trying: the minimizer if it lies near the edge, then both ends and the
    /// midpoint; all of them moved to where the volume is kept, if it is to be.
    pub(super) fn places(&self, metric: &Metric) -> [Option<DVec3>; 4] {
        let [a, b] = self.points.map(|point| metric.positions[point]);
        let middle = (a + b) / 2.0;
        match metric.space.placement {
            Placement::Best => {}
            Placement::Ends => return [None, Some(a), Some(b), None],
            Placement::Middle => return [None, None, None, Some(middle)],
        }
        let reach = REACH * REACH * a.distance_squared(b);
        let best = minimize(&self.total, middle, PULL * self.weight, self.volume)
            .filter(|best| best.distance_squared(middle) <= reach);
        let keep = |place| Some(self.volume.map_or(place, |plane| plane.foot(place)));
        [best, keep(a), keep(b), keep(middle)]
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
        let is_first = metric.positions[self.points[0]] == position;
        let own =
            if is_first { 0..self.first_wedges } else { self.first_wedges..self.wedges.len() };
        for at in own {
            let row = self.merged_of[at] as usize * metric.attributes;
            self.row[row..][..metric.attributes].copy_from_slice(metric.row(self.wedges[at]));
        }
    }

    pub(super) fn placed_row(&self, metric: &Metric, wedge: WedgeId) -> &[f64] {
        &self.row[self.merged(wedge) * metric.attributes..][..metric.attributes]
    }
}
