//! A mesh that is as fine as it is asked to be: the source, and the collapses that lead down from it.
//!
//! A collapse keeps what it overwrites and no more: a point and the wedges that go on by their names swap
//! their values with those on record, and what goes keeps its place in the lists until it is back. So the
//! source comes back to the bit.

use glam::Vec3;

use crate::error::{Error, Result};
use crate::id::{CornerId, PointId, TriangleId, WedgeId};
use crate::mesh::{Layout, Mesh};

/// A mesh with the collapses of its simplification, to be done and undone.
///
/// Points, wedges and triangles are numbered as in the source throughout. A merged point goes on by
/// the number of the one nearest to it, and so do wedges.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgressiveMesh {
    /// The lists of the source, with the values of now.
    pub(super) mesh: Mesh,
    /// One per triangle: whether it is there now.
    pub(super) live: Vec<bool>,
    pub(super) applied: usize,
    pub(super) collapses: Vec<Ends>,
    pub(super) points: Vec<PointId>,
    pub(super) moved: Vec<Moved>,
    /// A row of the layout for each of those.
    pub(super) rows: Vec<f32>,
    pub(super) corners: Vec<Change>,
    pub(super) triangles: Vec<TriangleId>,
    /// Triangles left after so many collapses.
    pub(super) counts: Vec<usize>,
    /// The numbers of collapses at which levels were made.
    pub(super) levels: Vec<usize>,
    /// In the order of their places.
    pub(super) settles: Vec<Settle>,
}

/// The values that a mesh takes where a level was made.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Settle {
    /// The number of collapses done there.
    pub(super) at: usize,
    /// The points and wedges that are there, with their values on the other side, and what they move by.
    pub(super) points: Vec<PointId>,
    pub(super) positions: Vec<Vec3>,
    pub(super) moves: Vec<Vec3>,
    pub(super) wedges: Vec<WedgeId>,
    pub(super) rows: Vec<f32>,
    pub(super) row_moves: Vec<f32>,
}

/// Ends of a collapse in the flat lists.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Ends {
    /// The value of the point that stays, on the other side of the collapse; none if a shell goes.
    pub(super) position: Option<Vec3>,
    pub(super) error: f32,
    pub(super) points: usize,
    pub(super) moved: usize,
    pub(super) corners: usize,
    pub(super) triangles: usize,
}

/// A wedge whose value a collapse changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Moved {
    /// The wedge.
    pub wedge: WedgeId,
    /// The point that it sits at before; after, it is the one that stays.
    pub before: PointId,
}

/// A corner that changes its wedge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// The corner.
    pub corner: CornerId,
    /// Its wedge in the finer mesh.
    pub before: WedgeId,
    /// Its wedge in the coarser mesh.
    pub after: WedgeId,
}

/// A collapse: undone, a vertex split.
#[derive(Clone, Copy, Debug)]
pub struct Collapse<'a> {
    /// The points that merge, first the one that stays; none if a shell goes.
    pub points: &'a [PointId],
    /// The largest area-weighted error of any collapse up to this one, in the units of the mesh.
    pub error: f32,
    /// The wedges of the merged point.
    pub moved: &'a [Moved],
    /// The corners whose wedges unify with others.
    pub corners: &'a [Change],
    /// The triangles that vanish. While they are away they keep the corners that they had.
    pub triangles: &'a [TriangleId],
}

/// A mesh of some level, and what its elements are in the source.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extracted {
    /// The mesh. Points and wedges are numbered in the order in which the triangles first name them.
    pub mesh: Mesh,
    /// One per point: its number in the source.
    pub points: Vec<PointId>,
    /// One per wedge: its number in the source.
    pub wedges: Vec<WedgeId>,
}

impl ProgressiveMesh {
    /// Number of collapses on record.
    pub fn collapses(&self) -> usize {
        self.collapses.len()
    }

    /// Number of collapses that are done now: 0 is the source.
    pub fn applied(&self) -> usize {
        self.applied
    }

    /// Triangles now.
    pub fn triangles(&self) -> usize {
        self.counts[self.applied]
    }

    /// Triangles after so many collapses.
    pub fn triangles_after(&self, collapses: usize) -> usize {
        self.counts[collapses.min(self.collapses())]
    }

    /// The layout of a wedge's row.
    pub fn layout(&self) -> Layout {
        self.mesh.layout
    }

    /// The numbers of collapses at which the levels of the simplification were made, the finest first.
    pub fn levels(&self) -> &[usize] {
        &self.levels
    }

    /// The lists as they are now, numbered as in the source. Triangles that are not there are among
    /// them, with the corners that they had, and the values of what only those use are the last that they had.
    pub fn state(&self) -> &Mesh {
        &self.mesh
    }

    /// Whether a triangle is there now.
    pub fn is_live(&self, triangle: TriangleId) -> bool {
        self.live[triangle]
    }

    /// A collapse, in the order of the simplification.
    pub fn collapse(&self, at: usize) -> Collapse<'_> {
        let (start, end) = self.range(at);
        Collapse {
            points: &self.points[start.points..end.points],
            error: end.error,
            moved: &self.moved[start.moved..end.moved],
            corners: &self.corners[start.corners..end.corners],
            triangles: &self.triangles[start.triangles..end.triangles],
        }
    }

    fn range(&self, at: usize) -> (Ends, Ends) {
        let before = at.checked_sub(1).map_or(Ends::default(), |before| self.collapses[before]);
        (before, self.collapses[at])
    }

    /// The error of the mesh now, as [`Level::error`](crate::Level::error).
    pub fn error(&self) -> f32 {
        self.applied.checked_sub(1).map_or(0.0, |last| self.collapses[last].error)
    }

    /// Undoes up to `n` collapses. Returns how many.
    pub fn refine(&mut self, n: usize) -> usize {
        let n = n.min(self.applied);
        for _ in 0..n {
            self.settle_here();
            self.applied -= 1;
            self.undo(self.applied);
        }
        n
    }

    /// Does up to `n` collapses. Returns how many.
    pub fn coarsen(&mut self, n: usize) -> usize {
        let n = n.min(self.collapses() - self.applied);
        for _ in 0..n {
            self.apply(self.applied);
            self.applied += 1;
            self.settle_here();
        }
        n
    }

    /// Takes the values of the level that was made here, or gives them back.
    fn settle_here(&mut self) {
        if let Ok(at) = self.settles.binary_search_by_key(&self.applied, |settle| settle.at) {
            self.swap_settled(at);
        }
    }

    pub(super) fn swap_settled(&mut self, at: usize) {
        let (settle, width) = (&mut self.settles[at], self.mesh.layout.len());
        for (&point, position) in settle.points.iter().zip(&mut settle.positions) {
            std::mem::swap(&mut self.mesh.positions[point], position);
        }
        for (at, wedge) in settle.wedges.iter().enumerate() {
            let own = &mut self.mesh.attributes[wedge.index() * width..][..width];
            own.swap_with_slice(&mut settle.rows[at * width..][..width]);
        }
    }

    /// Refines or coarsens until so many collapses are done, or all there are.
    pub fn seek(&mut self, collapses: usize) {
        self.refine(self.applied.saturating_sub(collapses));
        self.coarsen(collapses.saturating_sub(self.applied));
    }

    /// The least number of collapses that leave at most `triangles`, or all of them.
    pub fn collapses_to(&self, triangles: usize) -> usize {
        self.counts.partition_point(|&left| left > triangles).min(self.collapses())
    }

    /// The mesh of at most `triangles`, and fewer only by what the last collapse took beyond it; the coarsest
    /// if that has more.
    pub fn mesh_at(&mut self, triangles: usize) -> Mesh {
        self.seek(self.collapses_to(triangles));
        self.extract().mesh
    }

    /// The mesh as its collapses have left it.
    pub(super) fn extract_recorded(&self) -> Extracted {
        let (mut out, state) = (Extracted::default(), &self.mesh);
        out.mesh.layout = state.layout;
        let mut new_points = vec![None; state.positions.len()];
        let mut new_wedges = vec![None; state.wedge_points.len()];
        let live = self.live.iter().enumerate().filter(|(_, live)| **live);
        for triangle in live.map(|(at, _)| TriangleId::new(at)) {
            let corners = state.triangles[triangle].map(|wedge| {
                *new_wedges[wedge.index()].get_or_insert_with(|| {
                    let point = state.wedge_points[wedge];
                    let number = *new_points[point.index()].get_or_insert_with(|| {
                        out.mesh.positions.push(state.positions[point]);
                        out.points.push(point);
                        PointId::new(out.points.len() - 1)
                    });
                    out.mesh.wedge_points.push(number);
                    out.mesh.attributes.extend_from_slice(state.row(wedge));
                    out.wedges.push(wedge);
                    WedgeId::new(out.wedges.len() - 1)
                })
            });
            out.mesh.triangles.push(corners);
            out.mesh.groups.push(state.groups[triangle]);
        }
        out
    }

    pub(super) fn apply(&mut self, at: usize) {
        let (start, end) = self.range(at);
        for &triangle in &self.triangles[start.triangles..end.triangles] {
            self.live[triangle] = false;
        }
        for change in &self.corners[start.corners..end.corners] {
            self.mesh.triangles[change.corner.triangle()][change.corner.slot()] = change.after;
        }
        if let Some(&kept) = self.points[start.points..end.points].first() {
            for moved in &self.moved[start.moved..end.moved] {
                self.mesh.wedge_points[moved.wedge] = kept;
            }
        }
        self.swap(at);
    }

    pub(super) fn undo(&mut self, at: usize) {
        let (start, end) = self.range(at);
        for &triangle in &self.triangles[start.triangles..end.triangles] {
            self.live[triangle] = true;
        }
        for change in &self.corners[start.corners..end.corners] {
            self.mesh.triangles[change.corner.triangle()][change.corner.slot()] = change.before;
        }
        for moved in &self.moved[start.moved..end.moved] {
            self.mesh.wedge_points[moved.wedge] = moved.before;
        }
        self.swap(at);
    }

    /// Swaps the values of what stays with those on record.
    pub(super) fn swap(&mut self, at: usize) {
        let (start, end) = self.range(at);
        if let (Some(&kept), Some(position)) =
            (self.points.get(start.points), &mut self.collapses[at].position)
        {
            std::mem::swap(&mut self.mesh.positions[kept], position);
        }
        let width = self.mesh.layout.len();
        for (moved, at) in self.moved[start.moved..end.moved].iter().zip(start.moved..) {
            let own = &mut self.mesh.attributes[moved.wedge.index() * width..][..width];
            own.swap_with_slice(&mut self.rows[at * width..][..width]);
        }
    }

    /// Changes the values on record of merged points and wedges, as with another frame: `position` and
    /// `row` get each with the point or wedge whose number it goes on by. The lists of `source` take the place of
    /// the mesh's own, and it is settled nowhere any more.
    ///
    /// # Errors
    /// [`Error::Invalid`] if `source` has other triangles.
    pub fn remap(
        &mut self,
        source: &Mesh,
        position: impl Fn(PointId, Vec3) -> Vec3,
        row: impl Fn(WedgeId, &mut [f32]),
    ) -> Result<()> {
        self.seek(0);
        self.settles.clear();
        let is_same = self.mesh.triangles == source.triangles
            && self.mesh.wedge_points == source.wedge_points
            && self.mesh.layout == source.layout;
        if !is_same {
            return Err(Error::Invalid { what: "the source has other triangles".into() });
        }
        self.mesh = source.clone();
        for at in 0..self.collapses.len() {
            let start = self.range(at).0;
            if let Some(own) = &mut self.collapses[at].position {
                *own = position(self.points[start.points], *own);
            }
        }
        let width = source.layout.len();
        if width > 0 {
            let rows = self.rows.chunks_exact_mut(width);
            rows.zip(&self.moved).for_each(|(own, moved)| row(moved.wedge, own));
        }
        Ok(())
    }
}
