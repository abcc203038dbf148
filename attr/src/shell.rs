//! Shells that are small enough to vanish as a whole.

use glam::DVec3;

use crate::id::{PointId, TriangleId};
use crate::marks::Marks;
use crate::metric::Metric;
use crate::topology::Topology;

/// Shells of up to this many triangles may vanish as a whole once none of their edges can
/// collapse. A closed shell can't go below four triangles, and a sharp one sticks somewhat above.
const SMALL: usize = 16;

/// The triangles of the shell that `point` belongs to, or `None` if they are too many to vanish.
pub(crate) fn small_shell(
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
pub(crate) fn measure(shell: &[TriangleId], topology: &Topology, metric: &Metric) -> (f64, f64) {
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
