//! A surface between two descents: its triangles, and the quadrics and attributes of its points and
//! wedges.

use std::sync::Arc;

use crate::id::{PointId, TriangleId, WedgeId};
use crate::marks::Marks;
use crate::mesh::{Layout, Mesh};
use crate::metric::Metric;
use crate::progressive::log::Log;
use crate::space::Space;

/// A surface, or a piece of one, in the space of the metric.
pub(crate) struct WorkingMesh {
    pub(crate) metric: Metric,
    pub(crate) triangles: Vec<[WedgeId; 3]>,
    pub(crate) groups: Vec<u32>,
    /// One per triangle: a lower bound of the cost of collapsing the edge opposite each of its
    /// corners, 0 where none is known.
    pub(crate) bounds: Vec<[f32; 3]>,
    pub(crate) wedge_points: Vec<PointId>,
    /// Per point and per wedge: the one of the source that it stands for. No two stand for the same.
    pub(crate) point_sources: Vec<PointId>,
    pub(crate) wedge_sources: Vec<WedgeId>,
    /// The largest error of a collapse so far, in the units of the metric.
    pub(crate) error: f64,
    /// The collapses so far, if they are kept on record.
    pub(crate) log: Option<Log>,
}

/// The new numbers of points and wedges.
pub(crate) struct Numbers {
    points: Marks,
    wedges: Marks,
}

impl Numbers {
    /// None yet, for so many points and wedges.
    pub(crate) fn new(points: usize, wedges: usize) -> Self {
        Self { points: Marks::new(points), wedges: Marks::new(wedges) }
    }

    /// The new number of a wedge, or one that `make` gives it.
    pub(crate) fn wedge_or(
        &mut self,
        wedge: WedgeId,
        make: impl FnOnce(&mut Self) -> WedgeId,
    ) -> WedgeId {
        self.wedges.get(wedge.index()).map_or_else(
            || {
                let number = make(self);
                self.wedges.set(wedge.index(), number.0);
                number
            },
            WedgeId,
        )
    }

    /// The new number of a point, or one that `make` gives it.
    pub(crate) fn point_or(&mut self, point: PointId, make: impl FnOnce() -> PointId) -> PointId {
        PointId(self.points.get(point.index()).unwrap_or_else(|| {
            let number = make();
            self.points.set(point.index(), number.0);
            number.0
        }))
    }

    /// The new number of a point, by its own id.
    pub(crate) fn point(&self, point: PointId) -> Option<usize> {
        self.points.get(point.index()).map(|number| number as usize)
    }

    /// Forgets all of them.
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.wedges.clear();
    }
}

/// Compact pieces that become one surface. Points and wedges that stand for the same are the same.
pub(crate) struct Join {
    joined: Option<WorkingMesh>,
    numbers: Numbers,
    logs: Vec<Log>,
    room: usize,
}

impl Join {
    /// No piece yet of a source of so many points and wedges, with room for so many triangles in all.
    pub(crate) fn new([points, wedges]: [usize; 2], room: usize) -> Self {
        Self { joined: None, numbers: Numbers::new(points, wedges), logs: Vec::new(), room }
    }

    /// Adds further pieces.
    pub(crate) fn add(&mut self, pieces: Vec<WorkingMesh>) {
        // A surface has about half as many points as triangles, and hardly more wedges.
        let sizes = [self.room, self.room * 5 / 8, self.room * 5 / 8];
        for mut piece in pieces {
            let Metric { space, attributes, .. } = &piece.metric;
            let empty = || WorkingMesh::empty(space, *attributes, sizes);
            let joined = self.joined.get_or_insert_with(empty);
            joined.error = joined.error.max(piece.error);
            self.logs.extend(piece.log.take());
            // In the order in which the triangles of the piece first name them.
            let wedges = (0..piece.wedge_points.len()).map(WedgeId::new);
            let add = |wedge| joined.add_wedge(&piece, wedge, Key::Source, &mut self.numbers);
            let own: Vec<WedgeId> = wedges.map(add).collect();
            joined.triangles.extend(piece.triangles.iter().map(|t| t.map(|wedge| own[wedge])));
            joined.groups.extend_from_slice(&piece.groups);
            joined.bounds.extend_from_slice(&piece.bounds);
        }
    }

    /// The surface, if there was a piece.
    pub(crate) fn finish(self, layout: Layout) -> Option<WorkingMesh> {
        let mut joined = self.joined?;
        if let Some(log) = &mut joined.log {
            log.append_side_by_side(&self.logs, layout.len());
        }
        Some(joined)
    }
}

/// The ids by which points and wedges are told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Key {
    /// Their own ids.
    Own,
    /// The ids of the source point and wedge that they stand for.
    Source,
}

impl WorkingMesh {
    /// A whole mesh.
    pub(crate) fn new(source: &Mesh, space: &Arc<Space>) -> Self {
        let point_sources: Vec<PointId> = (0..source.positions.len()).map(PointId::new).collect();
        Self {
            metric: Metric::new(source, space, &point_sources),
            triangles: source.triangles.clone(),
            groups: source.groups.clone(),
            bounds: vec![[0.0; 3]; source.triangles.len()],
            wedge_points: source.wedge_points.clone(),
            point_sources,
            wedge_sources: (0..source.wedge_points.len()).map(WedgeId::new).collect(),
            error: 0.0,
            log: Log::of(space),
        }
    }

    /// An empty surface with room for so many triangles, points and wedges.
    pub(crate) fn empty(
        space: &Arc<Space>,
        attributes: usize,
        [triangles, points, wedges]: [usize; 3],
    ) -> Self {
        Self {
            metric: Metric::empty(space, attributes, [points, wedges]),
            triangles: Vec::with_capacity(triangles),
            groups: Vec::with_capacity(triangles),
            bounds: Vec::with_capacity(triangles),
            wedge_points: Vec::with_capacity(wedges),
            point_sources: Vec::with_capacity(points),
            wedge_sources: Vec::with_capacity(wedges),
            error: 0.0,
            log: Log::of(space),
        }
    }

    /// The same surface without the points and wedges that no triangle uses.
    pub(crate) fn compact(mut self) -> Self {
        let left = self.triangles.len();
        // A surface has about half as many points as triangles, and hardly more wedges.
        let sizes = [left, left * 5 / 8, left * 5 / 8];
        let mut working = Self::empty(&self.metric.space, self.metric.attributes, sizes);
        working.error = self.error;
        working.log = self.log.take();
        let mut numbers = Numbers::new(self.point_sources.len(), self.wedge_sources.len());
        for triangle in (0..left).map(TriangleId::new) {
            working.add(&self, triangle, Key::Own, &mut numbers);
        }
        working
    }

    /// The points of a triangle.
    pub(crate) fn points(&self, triangle: TriangleId) -> [PointId; 3] {
        self.triangles[triangle].map(|wedge| self.wedge_points[wedge])
    }

    /// Adds a triangle of another working mesh, and of its points and wedges those that have no number yet.
    pub(crate) fn add(
        &mut self,
        from: &Self,
        triangle: TriangleId,
        key: Key,
        numbers: &mut Numbers,
    ) {
        let corners =
            from.triangles[triangle].map(|wedge| self.add_wedge(from, wedge, key, numbers));
        self.triangles.push(corners);
        self.groups.push(from.groups[triangle]);
        self.bounds.push(from.bounds[triangle]);
    }

    fn add_wedge(
        &mut self,
        from: &Self,
        wedge: WedgeId,
        key: Key,
        numbers: &mut Numbers,
    ) -> WedgeId {
        let at = match key {
            Key::Own => wedge,
            Key::Source => from.wedge_sources[wedge],
        };
        numbers.wedge_or(at, |numbers| {
            let point = self.add_point(from, from.wedge_points[wedge], key, numbers);
            self.wedge_points.push(point);
            self.wedge_sources.push(from.wedge_sources[wedge]);
            self.metric.push_wedge(&from.metric, wedge);
            WedgeId::new(self.wedge_points.len() - 1)
        })
    }

    fn add_point(
        &mut self,
        from: &Self,
        point: PointId,
        key: Key,
        numbers: &mut Numbers,
    ) -> PointId {
        let at = match key {
            Key::Own => point,
            Key::Source => from.point_sources[point],
        };
        numbers.point_or(at, || {
            self.point_sources.push(from.point_sources[point]);
            self.metric.push_point(&from.metric, point);
            PointId::new(self.point_sources.len() - 1)
        })
    }
}
