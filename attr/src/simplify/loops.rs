//! Loops of three edges around handles, holes and necks that become points: see `collapse/loops.rs`.

use super::{Descent, Stop};
use crate::collapse::Candidate;
use crate::id::{EdgeId, PointId};
use crate::item::Item;
use crate::settings::Cost;

impl Descent<'_> {
    /// Queues the cheapest loop at an edge that the link condition bars, if there is one.
    pub(super) fn queue_loop(&mut self, edge: EdgeId) {
        if self.metric.space.cost == Cost::Quadric
            && let Some(Candidate { cost, .. }) = self.plan_loop(edge)
        {
            self.queue.push(cost, Item::Loop(edge).pack());
        }
    }

    /// Makes a loop a point at its cheapest legal place, or queues it again if another item may be
    /// cheaper. Returns the number of triangles removed.
    pub(super) fn close_loop(&mut self, edge: EdgeId, queue_slack: f64) -> Result<usize, Stop> {
        let Some(cheapest) = self.plan_loop(edge) else { return Ok(0) };
        if self.must_wait(Item::Loop(edge), cheapest.cost, queue_slack) {
            return Ok(0);
        }
        let Some(best) = self.best(cheapest) else { return Ok(0) };
        if self.must_wait(Item::Loop(edge), best.cost, queue_slack) {
            return Ok(0);
        }
        self.apply(best)
    }

    /// Plans the cheapest loop at an edge, legal or not by its shape, and where its point goes.
    fn plan_loop(&mut self, edge: EdgeId) -> Option<Candidate> {
        let [a, b] = self.topology.ends(edge)?;
        self.plan.set(&self.topology, &self.metric, &[a, b]);
        let mut best: Option<(Candidate, PointId)> = None;
        let thirds = self.plan.loop_points(&self.topology);
        for &third in &thirds {
            if self.is_locked(third) || !self.plan_of_three([a, b, third]) {
                continue;
            }
            let cheapest = self.plan.cheapest(&self.metric);
            if let Some(own) = cheapest.filter(|c| best.is_none_or(|(best, _)| c.cost < best.cost))
            {
                best = Some((own, third));
            }
        }
        let (cheapest, third) = best?;
        if thirds.last() != Some(&third) {
            self.plan_of_three([a, b, third]);
        }
        Some(cheapest)
    }

    /// Plans a loop, and says whether it may become a point.
    fn plan_of_three(&mut self, points: [PointId; 3]) -> bool {
        self.plan.set(&self.topology, &self.metric, &points);
        self.plan.closes_loop(&self.topology)
    }
}
