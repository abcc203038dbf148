//! How many cards of a crowd may go.

use rustc_hash::FxHashMap;

use crate::id::{PointId, TriangleId};
use crate::metric::Metric;
use crate::topology::Topology;

/// The largest factor on the lengths of a card: with one of sixteen left, all their area.
pub(crate) const MAX_CARD_SCALE: f64 = 4.0;
/// The share of the area of a crowd that stays: half as much again as could grow to all of it if those that go
/// were spread evenly over those that stay.
const LEAST_CARDS: f64 = 1.5 / (MAX_CARD_SCALE * MAX_CARD_SCALE);

/// The area of cards that can still go, for each group, in the units of the metric: those that stay grow for
/// those that are gone, and can do so only so far.
pub(super) struct Crowd(FxHashMap<u32, f64>);

impl Crowd {
    pub(super) fn of(
        topology: &Topology,
        metric: &Metric,
        groups: &[u32],
        sources: &[PointId],
    ) -> Self {
        let mut areas = FxHashMap::default();
        for triangle in (0..groups.len()).map(TriangleId::new).filter(|&t| topology.is_live(t)) {
            let points = topology.points(triangle);
            if metric.space.is_card(sources[points[0].index()]) {
                let p = points.map(|point| metric.positions[point]);
                let area = (p[1] - p[0]).cross(p[2] - p[0]).length() / 2.0;
                *areas.entry(groups[triangle.index()]).or_insert(0.0) += area;
            }
        }
        areas.values_mut().for_each(|area| *area *= 1.0 - LEAST_CARDS);
        Self(areas)
    }

    /// Lets a card of this area go, if enough are left.
    pub(super) fn lets(&mut self, group: u32, area: f64) -> bool {
        let spare = self.0.entry(group).or_insert(0.0);
        let lets = area <= *spare;
        *spare -= if lets { area } else { 0.0 };
        lets
    }
}
