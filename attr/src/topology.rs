//! The triangles at each point and edge, updated through collapses.
//!
//! Corners at a point form a singly linked list over one flat array, so merging two points is
//! joining two lists, and nothing is allocated per point. Edges have ids that stay theirs while
//! their ends move. Nothing here assumes a manifold: an edge may have any number of triangles, a
//! point any number of fans.

use crate::id::{CornerId, EdgeId, PointId, TriangleId, WedgeId};
use crate::marks::Marks;

/// End of a corner list.
const NONE: u32 = u32::MAX;

/// The connectivity of a mesh that is being simplified.
pub(crate) struct Topology {
    /// One per triangle: its corners' wedges today.
    triangles: Vec<[WedgeId; 3]>,
    /// One per triangle: its corners' points today, which its wedges would tell a jump later.
    points: Vec<[PointId; 3]>,
    /// One per triangle: the edges opposite its corners.
    edges: Vec<[EdgeId; 3]>,
    /// One per edge: its points, the lesser first, or one of them twice once it is gone.
    ends: Vec<[PointId; 2]>,
    /// One per wedge: its current point.
    wedge_points: Vec<PointId>,
    /// One per point: its wedge, if it surely has but one.
    sole_wedges: Vec<Option<WedgeId>>,
    live: Vec<bool>,
    live_count: usize,
    first: Vec<u32>,
    last: Vec<u32>,
    next: Vec<u32>,
}

impl Topology {
    /// The connectivity of `triangles` over so many points.
    pub(crate) fn new(
        triangles: Vec<[WedgeId; 3]>,
        wedge_points: Vec<PointId>,
        points: usize,
    ) -> Self {
        let count = triangles.len();
        let mut topology = Self {
            points: triangles.iter().map(|t| t.map(|wedge| wedge_points[wedge])).collect(),
            triangles,
            edges: vec![[EdgeId::default(); 3]; count],
            ends: Vec::with_capacity(count * 3 / 2),
            wedge_points,
            sole_wedges: vec![None; points],
            live: vec![true; count],
            live_count: count,
            first: vec![NONE; points],
            last: vec![NONE; points],
            next: vec![NONE; count * 3],
        };
        for corner in 0..topology.next.len() {
            let corner = CornerId::new(corner);
            let point = topology.point(corner);
            topology.append(point, corner);
        }
        topology.number_edges();
        topology.find_sole_wedges();
        topology
    }

    /// Gives every edge an id, in the order of their lesser points.
    fn number_edges(&mut self) {
        let mut found = Marks::new(self.first.len());
        for point in (0..self.first.len()).map(PointId::new) {
            found.clear();
            let mut at = self.first[point];
            while at != NONE {
                let corner = CornerId(at);
                at = self.next[corner.index()];
                for (other, slot) in self.edges_at(corner) {
                    if other < point {
                        continue;
                    }
                    let edge = found.get(other.index()).unwrap_or_else(|| {
                        self.ends.push([point, other]);
                        let edge = self.ends.len() as u32 - 1;
                        found.set(other.index(), edge);
                        edge
                    });
                    self.edges[corner.triangle()][slot] = EdgeId(edge);
                }
            }
        }
    }

    fn find_sole_wedges(&mut self) {
        let mut counts = vec![0u32; self.first.len()];
        for (wedge, &point) in self.wedge_points.iter().enumerate() {
            counts[point] += 1;
            self.sole_wedges[point] = (counts[point] == 1).then(|| WedgeId::new(wedge));
        }
    }

    /// The points that follow a corner's own around its triangle, each with the slot under which
    /// the triangle keeps the edge to it.
    fn edges_at(&self, corner: CornerId) -> [(PointId, usize); 2] {
        let slot = corner.slot();
        let [first, second] = self.others(corner);
        [(first, (slot + 2) % 3), (second, (slot + 1) % 3)]
    }

    fn append(&mut self, point: PointId, corner: CornerId) {
        match self.last[point] {
            NONE => self.first[point] = corner.0,
            last => self.next[last as usize] = corner.0,
        }
        self.last[point] = corner.0;
    }

    /// The wedges of its triangles, whether each is live, and the points of its wedges.
    pub(crate) fn into_parts(self) -> (Vec<[WedgeId; 3]>, Vec<bool>, Vec<PointId>) {
        (self.triangles, self.live, self.wedge_points)
    }

    /// Per triangle: the edges opposite its corners.
    pub(crate) fn triangle_edges(&self) -> &[[EdgeId; 3]] {
        &self.edges
    }

    /// Number of edges before any collapse.
    pub(crate) fn edge_count(&self) -> usize {
        self.ends.len()
    }

    /// The points of an edge, the lesser first; `None` once it has become a point or another edge.
    #[inline]
    pub(crate) fn ends(&self, edge: EdgeId) -> Option<[PointId; 2]> {
        let ends = self.ends[edge];
        (ends[0] != ends[1]).then_some(ends)
    }

    /// The edges at a point, once for each of their triangles.
    pub(crate) fn edges(&self, point: PointId) -> impl Iterator<Item = EdgeId> + '_ {
        self.corners(point).flat_map(|corner| {
            self.edges_at(corner).map(|(_, slot)| self.edges[corner.triangle()][slot])
        })
    }

    /// A point's wedge, if it surely has but one.
    #[inline]
    pub(crate) fn sole_wedge(&self, point: PointId) -> Option<WedgeId> {
        self.sole_wedges[point]
    }

    /// Sets the wedge that is a point's only one, or `None` if there may be more.
    pub(crate) fn set_sole_wedge(&mut self, point: PointId, wedge: Option<WedgeId>) {
        self.sole_wedges[point] = wedge;
    }

    /// Live triangles.
    pub(crate) fn live_count(&self) -> usize {
        self.live_count
    }

    pub(crate) fn is_live(&self, triangle: TriangleId) -> bool {
        self.live[triangle]
    }

    /// The wedges of a triangle's corners.
    #[inline]
    pub(crate) fn wedges(&self, triangle: TriangleId) -> [WedgeId; 3] {
        self.triangles[triangle]
    }

    /// The points of a triangle's corners.
    #[inline]
    pub(crate) fn points(&self, triangle: TriangleId) -> [PointId; 3] {
        self.points[triangle]
    }

    #[inline]
    pub(crate) fn wedge(&self, corner: CornerId) -> WedgeId {
        self.triangles[corner.triangle()][corner.slot()]
    }

    /// The point of a wedge.
    pub(crate) fn wedge_point(&self, wedge: WedgeId) -> PointId {
        self.wedge_points[wedge]
    }

    #[inline]
    fn point(&self, corner: CornerId) -> PointId {
        self.points[corner.triangle()][corner.slot()]
    }

    /// The live corners at a point, in a fixed order.
    #[inline]
    pub(crate) fn corners(&self, point: PointId) -> impl Iterator<Item = CornerId> + '_ {
        let mut at = self.first[point];
        std::iter::from_fn(move || {
            (at != NONE).then(|| {
                let corner = CornerId(at);
                at = self.next[at as usize];
                corner
            })
        })
    }

    /// The two points that follow a corner's own around its triangle.
    #[inline]
    pub(crate) fn others(&self, corner: CornerId) -> [PointId; 2] {
        let points = self.points(corner.triangle());
        let slot = corner.slot();
        [points[(slot + 1) % 3], points[(slot + 2) % 3]]
    }

    /// The slot of `point` in `triangle`, if it is one of its corners.
    #[inline]
    pub(crate) fn slot_of(&self, triangle: TriangleId, point: PointId) -> Option<usize> {
        self.points(triangle).iter().position(|&p| p == point)
    }

    /// Collects the neighbors of a point, each once, in a fixed order, and leaves on each the
    /// number of triangles at the edge to it.
    pub(crate) fn neighbors(&self, point: PointId, counts: &mut Marks, out: &mut Vec<PointId>) {
        counts.clear();
        out.clear();
        for corner in self.corners(point) {
            for other in self.others(corner) {
                let count = counts.get(other.index()).unwrap_or(0);
                if count == 0 {
                    out.push(other);
                }
                counts.set(other.index(), count + 1);
            }
        }
    }

    /// Takes a triangle out of the surface.
    pub(crate) fn remove(&mut self, triangle: TriangleId) {
        self.live[triangle] = false;
        self.live_count -= 1;
        for slot in 0..3 {
            self.unlink(triangle.corner(slot));
        }
    }

    fn unlink(&mut self, corner: CornerId) {
        let point = self.point(corner);
        let after = self.next[corner.index()];
        let before = self.corners(point).take_while(|&c| c != corner).last();
        match before {
            None => self.first[point] = after,
            Some(before) => self.next[before.index()] = after,
        }
        if self.last[point] == corner.0 {
            self.last[point] = before.map_or(NONE, |before| before.0);
        }
    }

    /// Moves every corner and edge at `gone` to `kept`. The wedges of `gone` go along. Of two edges
    /// to one neighbor, that of `kept` stays.
    pub(crate) fn merge(&mut self, kept: PointId, gone: PointId, found: &mut Marks) {
        found.clear();
        for corner in self.corners(kept) {
            for (other, slot) in self.edges_at(corner) {
                found.set(other.index(), self.edges[corner.triangle()][slot].0);
            }
        }
        let mut at = self.first[gone];
        while at != NONE {
            let corner = CornerId(at);
            at = self.next[corner.index()];
            for (other, slot) in self.edges_at(corner) {
                self.move_edge(corner.triangle(), slot, [kept, other], found);
            }
            let wedge = self.wedge(corner);
            self.wedge_points[wedge] = kept;
            self.points[corner.triangle()][corner.slot()] = kept;
        }
        if self.first[gone] == NONE {
            return;
        }
        match self.last[kept] {
            NONE => self.first[kept] = self.first[gone],
            last => self.next[last as usize] = self.first[gone],
        }
        self.last[kept] = self.last[gone];
        (self.first[gone], self.last[gone]) = (NONE, NONE);
    }

    /// Makes the edge that a triangle keeps in `slot` that of `ends`, which `found` knows by the
    /// second if it is there.
    fn move_edge(
        &mut self,
        triangle: TriangleId,
        slot: usize,
        [kept, other]: [PointId; 2],
        found: &mut Marks,
    ) {
        let own = self.edges[triangle][slot];
        match found.get(other.index()) {
            Some(edge) if edge != own.0 => {
                self.ends[own] = [kept; 2];
                self.edges[triangle][slot] = EdgeId(edge);
            }
            Some(_) => {}
            None => {
                self.ends[own] = [kept.min(other), kept.max(other)];
                found.set(other.index(), own.0);
            }
        }
    }

    /// Gives a corner another wedge of the same point.
    pub(crate) fn set_wedge(&mut self, corner: CornerId, wedge: WedgeId) {
        self.triangles[corner.triangle()][corner.slot()] = wedge;
    }
}

/// Whether a point lies on the outline of the surface: one of its edges has one triangle, or more
/// than two. `counts` and `neighbors` are as [`Topology::neighbors`] leaves them.
pub(crate) fn on_outline(counts: &Marks, neighbors: &[PointId]) -> bool {
    neighbors.iter().any(|n| counts.get(n.index()) != Some(2))
}

#[cfg(test)]
mod tests;
