//! Shells that are small enough to vanish as a whole.

use glam::DVec3;

use super::{Descent, Item, Stop};
use crate::id::{PointId, TriangleId};
use crate::marks::Marks;
use crate::metric::Metric;
use crate::options::Cost;
use crate::topology::Topology;

/// Shells of up to this many triangles may vanish as a whole once none of their edges can
/// collapse. A closed shell can't go below four triangles, and a sharp one sticks somewhat above.
const SMALL: usize = 16;

impl Descent<'_> {
    /// Takes a small shell out, unless it is all there is, holds a locked point or costs more than
    /// what waits.
    pub(super) fn vanish(&mut self, point: PointId, turn: f64) -> Result<usize, Stop> {
        let shell = small_shell(&self.topology, point, &mut self.counts);
        let Some(shell) = shell.filter(|s| !s.is_empty() && s.len() < self.triangles()) else {
            return Ok(0);
        };
        if shell.iter().any(|&t| self.topology.points(t).iter().any(|&p| self.is_locked(p))) {
            return Ok(0);
        }
        let (area, radius) = measure(&shell, &self.topology, &self.metric);
        let area = self.importance(point) * area;
        let cost = self.shell_cost(area, radius);
        if self.queue.has_cheaper(turn * cost) {
            self.queue.push(cost, Item::Shell(point).pack());
            return Ok(0);
        }
        if !self.lets_vanish(&shell) {
            self.is_held_back = true;
            self.rejected.push((cost, Item::Shell(point)));
            return Ok(0);
        }
        self.charge(area * radius * radius, area)?;
        for &triangle in &shell {
            self.topology.remove(triangle);
        }
        Ok(shell.len())
    }

    /// Whether a shell may vanish without leaving the source bare.
    fn lets_vanish(&mut self, shell: &[TriangleId]) -> bool {
        let Some(guard) = &mut self.guard else { return true };
        let mut points: Vec<PointId> =
            shell.iter().flat_map(|&triangle| self.topology.points(triangle)).collect();
        points.sort_unstable();
        points.dedup();
        guard.lets_vanish(&points, measure(shell, &self.topology, &self.metric).0)
    }

    /// Queues the end of a point's shell if that is small: its area off by its radius.
    pub(super) fn queue_shell(&mut self, point: PointId) {
        if let Some(shell) = small_shell(&self.topology, point, &mut self.counts) {
            let (area, radius) = measure(&shell, &self.topology, &self.metric);
            let cost = self.shell_cost(self.importance(point) * area, radius);
            self.queue.push(cost, Item::Shell(point).pack());
        }
    }

    /// What costs at a point are multiplied by.
    fn importance(&self, point: PointId) -> f64 {
        self.metric.space.importance(self.point_sources[point])
    }

    /// What orders the end of a shell among the edges.
    fn shell_cost(&self, area: f64, radius: f64) -> f64 {
        match self.metric.space.cost {
            Cost::Quadric => area * radius * radius,
            Cost::EdgeLength => 4.0 * radius * radius,
        }
    }
}

/// The triangles of the shell that `point` belongs to, or `None` if they are too many to vanish.
fn small_shell(topology: &Topology, point: PointId, seen: &mut Marks) -> Option<Vec<TriangleId>> {
    seen.clear();
    seen.set(point.index(), 0);
    let (mut queue, mut at) = (vec![point], 0);
    let mut shell: Vec<TriangleId> = Vec::new();
    while let Some(&point) = queue.get(at) {
        at += 1;
        for corner in topology.corners(point) {
            if !shell.contains(&corner.triangle()) {
                if shell.len() == SMALL {
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
