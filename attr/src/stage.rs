//! A surface between two descents: its triangles, and what the metric knows of its points and
//! wedges.

use crate::id::{PointId, TriangleId, WedgeId};
use crate::marks::Marks;
use crate::mesh::Mesh;
use crate::metric::{Metric, Weights};

/// A surface, or a piece of one, in the space of the metric.
pub(crate) struct Stage {
    pub(crate) metric: Metric,
    pub(crate) triangles: Vec<[WedgeId; 3]>,
    pub(crate) groups: Vec<u32>,
    pub(crate) wedge_points: Vec<PointId>,
    /// Per point and per wedge: the one of the source that it stands for. No two stand for the same.
    pub(crate) point_sources: Vec<PointId>,
    pub(crate) wedge_sources: Vec<WedgeId>,
    /// The largest error of a collapse so far, in the units of the metric.
    pub(crate) error: f64,
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

    /// The new number of a point that was told apart by its own id.
    pub(crate) fn point(&self, point: PointId) -> Option<usize> {
        self.points.get(point.index()).map(|number| number as usize)
    }

    /// Forgets all of them.
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.wedges.clear();
    }
}

/// What points and wedges are told apart by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Key {
    /// Their own ids.
    Own,
    /// What they stand for.
    Source,
}

impl Stage {
    /// A whole mesh.
    pub(crate) fn new(source: &Mesh, weights: &Weights) -> Self {
        Self {
            metric: Metric::new(source, weights),
            triangles: source.triangles.clone(),
            groups: source.groups.clone(),
            wedge_points: source.wedge_points.clone(),
            point_sources: (0..source.positions.len()).map(PointId::new).collect(),
            wedge_sources: (0..source.wedge_points.len()).map(WedgeId::new).collect(),
            error: 0.0,
        }
    }

    /// Nothing, to be measured by the same metric, with room for `triangles` and as many points and
    /// wedges as go with them here.
    pub(crate) fn empty_like(&self, triangles: usize) -> Self {
        let share = triangles as f64 / self.triangles.len().max(1) as f64;
        // A piece has a few more than its share along its rim.
        let room = |count: usize| (1.1 * share.min(1.0) * count as f64) as usize;
        let (points, wedges) = (room(self.point_sources.len()), room(self.wedge_points.len()));
        Self {
            metric: self.metric.empty_like(points, wedges),
            triangles: Vec::with_capacity(triangles),
            groups: Vec::with_capacity(triangles),
            wedge_points: Vec::with_capacity(wedges),
            point_sources: Vec::with_capacity(points),
            wedge_sources: Vec::with_capacity(wedges),
            error: self.error,
        }
    }

    /// The points of a triangle.
    pub(crate) fn points(&self, triangle: TriangleId) -> [PointId; 3] {
        self.triangles[triangle].map(|wedge| self.wedge_points[wedge])
    }

    /// Adds a triangle of another stage, and of its points and wedges those that have no number yet.
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
        if let Some(number) = numbers.wedges.get(at.index()) {
            return WedgeId(number);
        }
        let point = self.add_point(from, from.wedge_points[wedge], key, numbers);
        let number = WedgeId::new(self.wedge_points.len());
        numbers.wedges.set(at.index(), number.0);
        self.wedge_points.push(point);
        self.wedge_sources.push(from.wedge_sources[wedge]);
        self.metric.push_wedge(&from.metric, wedge);
        number
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
        if let Some(number) = numbers.points.get(at.index()) {
            return PointId(number);
        }
        let number = PointId::new(self.point_sources.len());
        numbers.points.set(at.index(), number.0);
        self.point_sources.push(from.point_sources[point]);
        self.metric.push_point(&from.metric, point);
        number
    }
}
