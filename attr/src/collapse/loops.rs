//! Loops of three edges that are no triangle: around a handle, through its hole, around a neck.
//!
//! The link condition forbids to collapse one of their edges: the surface would be pinched to an edge of four
//! triangles. Merging all three points pinches it to a point: two fans that touch there, each a surface of
//! its own. So a handle opens or a hole closes, at what that costs by the quadrics, and what is left goes
//! down on (the topology changes of Garland & Heckbert 1997 and of Schroeder, "A topology modifying
//! progressive decimation algorithm", Visualization 1997).

use super::Plan;
use crate::id::PointId;
use crate::topology::{Topology, on_outline};

impl Plan {
    /// The points that make a loop with the edge that is planned.
    pub(crate) fn loop_points(&mut self, topology: &Topology) -> Vec<PointId> {
        for side in 0..2 {
            topology.neighbors(self.points[side], &mut self.counts[side], &mut self.near[side]);
        }
        self.find_rim(topology);
        let closes = |point: &PointId| {
            let sides = self.counts.iter().map(|counts| counts.get(point.index()));
            sides.into_iter().all(|count| count == Some(2)) && !self.rim.contains(point)
        };
        self.near[1].iter().copied().filter(closes).collect()
    }

    /// Whether the planned loop may become a point: its edges have two triangles each, none of its
    /// points lies on an outline, no triangle spans it, and what is left around the point is as
    /// simple as before.
    pub(crate) fn closes_loop(&mut self, topology: &Topology) -> bool {
        for &point in &self.points {
            topology.neighbors(point, &mut self.counts[0], &mut self.near[0]);
            let others = self.points.iter().filter(|&&other| other != point);
            let is_loop = others.clone().all(|other| self.counts[0].get(other.index()) == Some(2));
            if !is_loop || on_outline(&self.counts[0], &self.near[0]) {
                return false;
            }
        }
        // Two triangles an edge, and their other points all different.
        self.find_rim(topology);
        self.rim.sort_unstable();
        if self.collapsing.len() != 6 || self.rim.len() != 6 || !self.rim.is_sorted_by(|a, b| a < b)
        {
            return false;
        }
        // Those are neighbors of two of the three each, all others of one: no two edges become one.
        let mut near: Vec<PointId> = Vec::new();
        for &point in &self.points {
            topology.neighbors(point, &mut self.counts[0], &mut self.near[0]);
            near.extend(self.near[0].iter().filter(|p| !self.points.contains(p)));
        }
        near.sort_unstable();
        let fits = |run: &[PointId]| run.len() == 1 + usize::from(self.rim.contains(&run[0]));
        near.chunk_by(|a, b| a == b).all(fits) && self.has_two_fans(topology)
    }

    /// Whether each edge of the rim has one triangle at the merged point, so that none lies on another.
    fn has_two_fans(&self, topology: &Topology) -> bool {
        let mut edges: Vec<[PointId; 2]> = self
            .surviving
            .iter()
            .map(|&corner| topology.others(corner))
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        edges.sort_unstable();
        edges.len() >= 6 && edges.is_sorted_by(|a, b| a < b)
    }

    /// The points that come off with the collapsing triangles: no triangle joins them to the merged point.
    pub(crate) fn tips(&self, topology: &Topology) -> Vec<PointId> {
        let points = self.collapsing.iter().flat_map(|&triangle| topology.points(triangle));
        let comes_off = |point: &PointId| {
            let stays = |&corner| topology.others(corner).contains(point);
            !self.points.contains(point) && !self.surviving.iter().any(stays)
        };
        let mut tips: Vec<PointId> = points.filter(comes_off).collect();
        tips.sort_unstable();
        tips.dedup();
        tips
    }

    /// The points of the collapsing triangles that do not merge.
    pub(super) fn find_rim(&mut self, topology: &Topology) {
        self.rim.clear();
        let points = self.collapsing.iter().flat_map(|&triangle| topology.points(triangle));
        self.rim.extend(points.filter(|point| !self.points.contains(point)));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::edges::Census;
    use crate::settings::Weights;
    use crate::space::Space;
    use crate::testing::surface;
    use crate::vertices::Vertices;
    use crate::weld::weld;
    use crate::working_mesh::WorkingMesh;
    use crate::{Layout, Mesh};
    use glam::Vec3;

    /// A torus of `around` by three points.
    fn ring(around: u32) -> Mesh {
        let mut vertices = Vertices {
            layout: Layout { uv_sets: 0, normal: false, color: 0 },
            ..Vertices::default()
        };
        for at in 0..around {
            let (sin, cos) = (at as f32 * std::f32::consts::TAU / around as f32).sin_cos();
            for tube in 0..3u32 {
                let (up, out) = (tube as f32 * std::f32::consts::TAU / 3.0).sin_cos();
                let radius = 1.0 + 0.1 * out;
                vertices.positions.push(Vec3::new(radius * cos, radius * sin, 0.1 * up));
                let id = |at: u32, tube: u32| at % around * 3 + tube % 3;
                let [a, b, c, d] =
                    [id(at, tube), id(at + 1, tube), id(at + 1, tube + 1), id(at, tube + 1)];
                vertices.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        vertices.groups = vec![0; vertices.triangles.len()];
        weld(&vertices).unwrap().mesh
    }

    fn plan(mesh: &Mesh, points: &[PointId]) -> (Topology, crate::metric::Metric, Plan) {
        let space = Arc::new(Space::new(mesh, Weights::default()));
        let count = mesh.positions.len();
        let topology = Topology::new(mesh.triangles.clone(), mesh.wedge_points.clone(), count);
        let metric = WorkingMesh::new(mesh, &space).metric;
        let mut plan = Plan::new(count, mesh.wedge_points.len());
        plan.set(&topology, &metric, points);
        (topology, metric, plan)
    }

    #[test]
    fn a_ring_opens_where_its_tube_becomes_a_point() {
        let mesh = ring(8);
        let points = mesh.triangle_points(0);
        // The tube at the first point: two points of the first triangles, and the one between.
        let tube: Vec<PointId> = (0..mesh.positions.len())
            .map(PointId::new)
            .filter(|p| {
                let (a, b) = (mesh.positions[*p], mesh.positions[points[0]]);
                a.truncate().normalize().dot(b.truncate().normalize()) > 0.99
            })
            .collect();
        let (mut topology, mut metric, mut plan) = plan(&mesh, &tube);
        assert!(plan.closes_loop(&topology));
        let best = plan.cheapest(&metric).unwrap();
        assert!(best.cost > 0.0);
        plan.apply(&mut topology, &mut metric, best.position);
        assert_eq!(topology.live_count(), mesh.triangles.len() - 6);
        let live = (0..mesh.triangles.len()).map(crate::TriangleId::new);
        let kept = live.filter(|&t| topology.is_live(t));
        let mut left = Mesh { layout: mesh.layout, ..Mesh::default() };
        left.positions.clone_from(&mesh.positions);
        for triangle in kept {
            left.triangles.push(topology.points(triangle).map(|p| crate::WedgeId(p.0)));
            left.groups.push(0);
        }
        left.wedge_points = (0..mesh.positions.len()).map(PointId::new).collect();
        let census = Census::new(&left);
        assert_eq!((census.borders, census.complex), (0, 0));
    }

    #[test]
    fn a_triangle_and_the_rim_of_a_point_of_three_are_no_loops() {
        let mesh = ring(8);
        let (topology, _, mut plan) = plan(&mesh, &mesh.triangle_points(0));
        assert!(!plan.closes_loop(&topology));
        let sheet = surface(4, |x, y| Vec3::new(x, y, 0.0));
        let [a, b, c] = [6, 7, 12].map(PointId);
        let (topology, _, mut plan) = self::plan(&sheet, &[a, b, c]);
        assert!(!plan.closes_loop(&topology));
    }
}
