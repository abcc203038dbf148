//! Which collapses wait for which.

use crate::id::{CornerId, PointId, TriangleId};
use crate::progressive::mesh::ProgressiveMesh;

/// The name of no collapse: of a triangle of the source.
pub(crate) const NONE: u32 = u32::MAX;

/// Lists of numbers, one after the other.
#[derive(Clone, Debug)]
pub(crate) struct Lists<T> {
    ends: Vec<u32>,
    items: Vec<T>,
}

impl<T> Default for Lists<T> {
    fn default() -> Self {
        Self { ends: Vec::new(), items: Vec::new() }
    }
}

impl<T> Lists<T> {
    pub(crate) fn get(&self, at: u32) -> &[T] {
        let start = at.checked_sub(1).map_or(0, |before| self.ends[before as usize]);
        &self.items[start as usize..self.ends[at as usize] as usize]
    }

    fn push(&mut self, items: impl IntoIterator<Item = T>) {
        self.items.extend(items);
        self.ends.push(self.items.len() as u32);
    }
}

/// A triangle that a collapse changes or takes away.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    pub(crate) triangle: TriangleId,
    /// The last collapse before that did.
    pub(crate) before: u32,
    /// Whether it is there after.
    pub(crate) stays: bool,
}

/// All collapses, and what holds each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Forest {
    /// Collapses that must be done before.
    pub(crate) before: Lists<u32>,
    /// Collapses that must be undone before this is.
    pub(crate) after: Lists<u32>,
    pub(crate) touches: Lists<Touch>,
}

impl Forest {
    /// Walks down all collapses of a mesh at its finest; `see` gets the mesh before and after each, with the
    /// triangles that it touches.
    pub(crate) fn walk(
        mesh: &mut ProgressiveMesh,
        mut see: impl FnMut(&ProgressiveMesh, u32, &[Touch], bool),
    ) -> Self {
        let mut walk = Walk::new(mesh);
        let mut forest = Self::default();
        for at in 0..mesh.collapses() {
            let touches = walk.touches(mesh, at);
            see(mesh, at as u32, &touches, true);
            let mut before: Vec<u32> = touches.iter().map(|touch| touch.before).collect();
            let collapse = mesh.collapse(at);
            before.extend(collapse.points.iter().map(|&point| walk.points[point.index()]));
            before.sort_unstable();
            before.dedup();
            before.retain(|&own| own != NONE);
            walk.note(mesh, at, &touches);
            mesh.apply(at);
            see(mesh, at as u32, &touches, false);
            forest.before.push(before);
            forest.touches.push(touches);
        }
        forest.after = forest.reversed(mesh.collapses());
        forest
    }

    fn reversed(&self, count: usize) -> Lists<u32> {
        let mut ends = vec![0u32; count];
        for &before in &self.before.items {
            ends[before as usize] += 1;
        }
        let mut sum = 0;
        for end in &mut ends {
            sum += *end;
            *end = sum;
        }
        // Filled from behind, so that each list is in order.
        let (mut items, mut next) = (vec![0; sum as usize], ends.clone());
        for at in (0..count as u32).rev() {
            for &before in self.before.get(at) {
                next[before as usize] -= 1;
                items[next[before as usize] as usize] = at;
            }
        }
        Lists { ends, items }
    }
}

/// What is known on the way down.
struct Walk {
    /// Per point: its corners, those of triangles that are gone among them.
    corners: Vec<Vec<CornerId>>,
    /// Per triangle and per point: the last collapse that changed it.
    triangles: Vec<u32>,
    points: Vec<u32>,
}

impl Walk {
    fn new(mesh: &ProgressiveMesh) -> Self {
        let state = mesh.state();
        let mut corners = vec![Vec::new(); state.positions.len()];
        for triangle in 0..state.triangles.len() {
            for (slot, point) in state.triangle_points(triangle).into_iter().enumerate() {
                corners[point.index()].push(TriangleId::new(triangle).corner(slot));
            }
        }
        let (triangles, points) =
            (vec![NONE; state.triangles.len()], vec![NONE; state.positions.len()]);
        Self { corners, triangles, points }
    }

    /// The triangles around the points that merge, or of the shell that goes.
    fn touches(&self, mesh: &ProgressiveMesh, at: usize) -> Vec<Touch> {
        let collapse = mesh.collapse(at);
        let around = collapse.points.iter().flat_map(|point| &self.corners[point.index()]);
        let around = around.map(|corner| corner.triangle()).filter(|&own| mesh.is_live(own));
        let mut all: Vec<TriangleId> = around.chain(collapse.triangles.iter().copied()).collect();
        all.sort_unstable();
        all.dedup();
        let touch = |triangle: TriangleId| Touch {
            triangle,
            before: self.triangles[triangle.index()],
            stays: !collapse.triangles.contains(&triangle),
        };
        all.into_iter().map(touch).collect()
    }

    fn note(&mut self, mesh: &ProgressiveMesh, at: usize, touches: &[Touch]) {
        let collapse = mesh.collapse(at);
        for touch in touches {
            self.triangles[touch.triangle.index()] = at as u32;
        }
        let mut joined: Vec<CornerId> = Vec::new();
        for point in collapse.points {
            self.points[point.index()] = at as u32;
            joined.append(&mut self.corners[point.index()]);
        }
        if let Some(kept) = collapse.points.first() {
            let stays = |triangle: TriangleId| {
                let at = touches.binary_search_by_key(&triangle, |touch| touch.triangle);
                at.is_ok_and(|at| touches[at].stays)
            };
            joined.retain(|corner| stays(corner.triangle()));
            self.corners[kept.index()] = joined;
        }
    }
}

/// The points of triangles, each once.
pub(crate) fn points_of(mesh: &ProgressiveMesh, touches: &[Touch]) -> Vec<PointId> {
    let mut points: Vec<PointId> = touches
        .iter()
        .flat_map(|touch| mesh.state().triangle_points(touch.triangle.index()))
        .collect();
    points.sort_unstable();
    points.dedup();
    points
}
