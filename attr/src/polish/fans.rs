//! The triangles around the points of a surface, as walks and sums over it need them.

use std::collections::VecDeque;

use crate::buckets::Buckets;
use crate::id::{CornerId, PointId, TriangleId};
use crate::mesh::Mesh;

/// No point stands near.
pub(super) const NONE: u32 = u32::MAX;

/// Triangles, and the corners at each of their vertices.
pub(super) struct Fans {
    /// Three vertices per triangle.
    pub(super) triangles: Vec<[u32; 3]>,
    corners: Buckets,
    vertices: usize,
}

impl Fans {
    pub(super) fn new(triangles: Vec<[u32; 3]>, vertices: usize) -> Self {
        let corners = Buckets::new(triangles.as_flattened().iter().copied(), vertices);
        Self { triangles, corners, vertices }
    }

    /// Those of the points of a mesh.
    pub(super) fn of(mesh: &Mesh) -> Self {
        let triangles = (0..mesh.triangles.len()).map(|t| mesh.triangle_points(t).map(|p| p.0));
        Self::new(triangles.collect(), mesh.positions.len())
    }

    pub(super) fn vertices(&self) -> usize {
        self.vertices
    }

    /// The corners at a vertex.
    pub(super) fn corners(
        &self,
        vertex: u32,
    ) -> impl ExactSizeIterator<Item = CornerId> + Clone + '_ {
        self.corners.of(vertex as usize).iter().map(|&corner| CornerId(corner))
    }

    /// The triangles that hold both of two vertices.
    pub(super) fn at_edge(&self, a: u32, b: u32) -> impl Iterator<Item = TriangleId> + '_ {
        let is_less = self.corners(a).len() <= self.corners(b).len();
        let (few, other) = if is_less { (a, b) } else { (b, a) };
        let triangles = self.corners(few).map(CornerId::triangle);
        triangles.filter(move |t| self.triangles[t.index()].contains(&other))
    }

    /// For each vertex which of `seeds` it can be reached from in the fewest edges, by its place among
    /// them; `NONE` where there is no way.
    pub(super) fn nearest_seeds(&self, seeds: &[PointId]) -> Vec<u32> {
        let mut nearest = vec![NONE; self.vertices];
        let mut queue = VecDeque::with_capacity(seeds.len());
        for (seed, vertex) in (0..).zip(seeds) {
            if nearest[vertex.index()] == NONE {
                nearest[vertex.index()] = seed;
                queue.push_back(vertex.0);
            }
        }
        while let Some(vertex) = queue.pop_front() {
            for corner in self.corners(vertex) {
                for next in self.triangles[corner.triangle().index()] {
                    if nearest[next as usize] == NONE {
                        nearest[next as usize] = nearest[vertex as usize];
                        queue.push_back(next);
                    }
                }
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::grid;

    #[test]
    fn seeds_reach_as_far_as_edges_go() {
        // The points of a grid of 4 × 4 squares, and one alone.
        let mesh = grid(4);
        let mut fans = Fans::of(&mesh);
        fans = Fans::new(fans.triangles, 26);
        let nearest = fans.nearest_seeds(&[PointId(0), PointId(24)]);
        assert_eq!((nearest[1], nearest[6], nearest[18], nearest[23]), (0, 0, 1, 1));
        assert_eq!(nearest[25], NONE);
        assert!(nearest[..25].iter().all(|&seed| seed < 2));
    }

    #[test]
    fn two_triangles_lie_at_an_inner_edge_and_one_at_a_border() {
        let fans = Fans::of(&grid(4));
        assert_eq!((fans.at_edge(6, 12).count(), fans.at_edge(1, 0).count()), (2, 1));
        assert_eq!(fans.at_edge(0, 24).count(), 0);
    }
}
