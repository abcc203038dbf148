//! Shells that are small enough to be removed whole.

use glam::DVec3;

use super::{Descent, DeviationGuard, Step, Stop};
use crate::id::{PointId, TriangleId};
use crate::item::Item;
use crate::marks::Marks;
use crate::metric::Metric;
use crate::settings::Cost;
use crate::topology::Topology;

/// Shells of up to this many triangles may be removed whole once none of their edges can
/// collapse. A closed shell can't go below four triangles, and a sharp one sticks somewhat above.
const MAX_SHELL_TRIANGLES: usize = 16;

/// The weight of a difference in color between a shell and what lies behind it, beside one in
/// vertex colors: more keeps lamps and costs the rest (benches/METRIC.md, where a descent stops).
const CONTRAST_WEIGHT: f64 = 10.0;

/// Triangles of a card that can't be simpler.
const PLAIN_CARD: usize = 2;
/// Cards cost up to so many times more or less than they are worth, by chance: they are to go all over the
/// crowd, not the smallest first where those are all on one side.
const CHANCE: f64 = 4.0;
/// A factor of a card, between 1 and [`CHANCE`], by one of its points (a multiplicative hash: Knuth).
fn chance(point: PointId) -> f64 {
    CHANCE.powf(f64::from(point.0.wrapping_mul(2_654_435_769)) / f64::from(u32::MAX))
}

/// The removal of a shell, in the units of the metric.
struct End {
    area: f64,
    radius: f64,
    cost: f64,
}

impl Descent<'_> {
    /// Removes a small shell, unless it is all there is or holds a locked point; queues it again if
    /// another item may be cheaper.
    pub(super) fn remove_shell(&mut self, point: PointId, queue_slack: f64) -> Result<usize, Stop> {
        let shell = small_shell(&self.topology, point, &mut self.counts);
        let Some(shell) = shell.filter(|s| !s.is_empty() && s.len() < self.triangles()) else {
            return Ok(0);
        };
        if shell.iter().any(|&t| self.topology.points(t).iter().any(|&p| self.is_locked(p))) {
            return Ok(0);
        }
        if !self.is_card(point) && self.guard.as_ref().is_some_and(|guard| guard.needs(point)) {
            self.is_held_back = true;
            return Ok(0);
        }
        let (end, is_card) = (self.end_of(&shell), self.is_card(point));
        if self.queue.has_cheaper(queue_slack * end.cost) {
            self.queue.push(end.cost, Item::Shell(point).pack());
            return Ok(0);
        }
        let points = points_of(&shell, &self.topology);
        let Self { guard, topology, metric, crowd, groups, .. } = self;
        let lets =
            |guard: &mut DeviationGuard| guard.allows_removal(&points, end.area, topology, metric);
        let lets = if is_card {
            crowd.lets(groups[shell[0].index()], end.area)
        } else {
            guard.as_mut().is_none_or(lets)
        };
        if !lets {
            self.is_held_back = true;
            self.rejected.push((end.cost, Item::Shell(point)));
            return Ok(0);
        }
        self.record_error(end.area * end.radius * end.radius, end.area)?;
        if let Some(steps) = &mut self.steps {
            steps.push(Step::RemoveShell { point: points[0], error: self.error });
        }
        self.carry_off(&shell, points[0]);
        Ok(shell.len())
    }

    /// Removes the shell of a point.
    pub(super) fn carry_off(&mut self, shell: &[TriangleId], point: PointId) {
        if let Some(log) = &mut self.log {
            log.remove_shell(self.point_sources[point], self.error * self.metric.space.unit);
        }
        shell.iter().for_each(|&triangle| self.topology.remove(triangle));
    }

    /// Queues the end of a point's shell if that is small.
    pub(super) fn queue_shell(&mut self, point: PointId) {
        if let Some(shell) = small_shell(&self.topology, point, &mut self.counts)
            && let Some(&first) = shell.first()
        {
            if self.guard.as_ref().is_some_and(|guard| guard.needs(point)) {
                self.is_held_back = true;
                return;
            }
            // One item a shell, from whichever of its points it was found.
            let name = self.topology.points(first)[0];
            let cost = self.end_of(&shell).cost;
            self.queue.push(cost, Item::Shell(name).pack());
        }
    }

    /// Whether a point is of a card, which others grow for.
    pub(super) fn is_card(&self, point: PointId) -> bool {
        self.metric.space.is_card(self.point_sources[point])
    }

    /// Whether an edge is of a card that is as simple as one can be: it goes whole or not at all.
    pub(super) fn is_plain_card(&mut self, point: PointId) -> bool {
        self.is_card(point)
            && small_shell(&self.topology, point, &mut self.counts)
                .is_some_and(|shell| shell.len() <= PLAIN_CARD)
    }

    /// The cost of removing a shell: its area off by its radius, and by its contrast to what lies
    /// behind. A lamp is small, and missed.
    fn end_of(&mut self, shell: &[TriangleId]) -> End {
        let (area, radius) = measure(shell, &self.topology, &self.metric);
        let points = points_of(shell, &self.topology);
        let contrast = self.guard.as_mut().map_or(0.0, |guard| guard.contrast(&points));
        let space = &self.metric.space;
        let importance = |&point: &PointId| space.importance(self.point_sources[point]);
        let importance = points.iter().map(importance).fold(0.0, f64::max);
        let contrast = CONTRAST_WEIGHT * space.weights.color * contrast;
        let cost = match space.cost {
            Cost::Quadric => {
                let chance = if self.is_card(points[0]) { chance(points[0]) } else { 1.0 };
                chance * importance * area * (radius * radius + contrast * contrast)
            }
            Cost::EdgeLength => 4.0 * radius * radius,
            Cost::Classic => shell.len() as f64 * radius * radius,
        };
        End { area, radius, cost }
    }
}

/// The triangles of the shell that `point` belongs to, or `None` if they are too many to be removed.
pub(super) fn small_shell(
    topology: &Topology,
    point: PointId,
    seen: &mut Marks,
) -> Option<Vec<TriangleId>> {
    seen.clear();
    seen.set(point.index(), 0);
    let (mut queue, mut at) = (vec![point], 0);
    let mut shell: Vec<TriangleId> = Vec::new();
    while let Some(&point) = queue.get(at) {
        at += 1;
        for corner in topology.corners(point) {
            if !shell.contains(&corner.triangle()) {
                if shell.len() == MAX_SHELL_TRIANGLES {
                    return None;
                }
                shell.push(corner.triangle());
            }
            for other in topology.others(corner) {
                if seen.get(other.index()).is_none() {
                    seen.set(other.index(), 0);
                    queue.push(other);
                }
            }
        }
    }
    Some(shell)
}

/// The points of triangles, each once.
fn points_of(shell: &[TriangleId], topology: &Topology) -> Vec<PointId> {
    let mut points: Vec<PointId> = shell.iter().flat_map(|&t| topology.points(t)).collect();
    points.sort_unstable();
    points.dedup();
    points
}

/// The area and the radius of a shell, in the units of the metric.
fn measure(shell: &[TriangleId], topology: &Topology, metric: &Metric) -> (f64, f64) {
    let mut area = 0.0;
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &triangle in shell {
        let p = topology.points(triangle).map(|point| metric.positions[point]);
        area += (p[1] - p[0]).cross(p[2] - p[0]).length() / 2.0;
        for p in p {
            (low, high) = (low.min(p), high.max(p));
        }
    }
    (area, (high - low).length() / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::grid;

    #[test]
    fn a_small_shell_is_found_whole() {
        let shell = |side: usize| {
            let mesh = grid(side);
            let points = mesh.positions.len();
            let topology = Topology::new(mesh.triangles.clone(), mesh.wedge_points.clone(), points);
            small_shell(&topology, PointId(0), &mut Marks::new(points)).map(|shell| shell.len())
        };
        assert_eq!((shell(1), shell(2)), (Some(2), Some(8)));
        assert_eq!(shell(3), None, "18 triangles");
    }
}
