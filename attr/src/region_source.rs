//! The surface that regions are cut from: a mesh without quadrics yet, or the working mesh of a
//! descent.

use std::sync::Arc;

use glam::DVec3;

use crate::id::{PointId, TriangleId, WedgeId};
use crate::mesh::Mesh;
use crate::metric::Metric;
use crate::progressive::log::Log;
use crate::space::Space;
use crate::working_mesh::{Key, Numbers, WorkingMesh};

/// A surface to be cut.
pub(crate) enum RegionSource<'a> {
    /// The source. Its quadrics are summed piece by piece: all at once they are most of a descent's
    /// memory.
    Mesh(&'a Mesh, Arc<Space>),
    /// The working mesh, once the source has been simplified.
    Working(Box<WorkingMesh>),
}

impl RegionSource<'_> {
    /// Its triangles.
    pub(crate) fn triangles(&self) -> usize {
        match self {
            Self::Mesh(mesh, _) => mesh.triangles.len(),
            Self::Working(working) => working.triangles.len(),
        }
    }

    /// Its points and wedges.
    pub(crate) fn sizes(&self) -> [usize; 2] {
        match self {
            Self::Mesh(mesh, _) => [mesh.positions.len(), mesh.wedge_points.len()],
            Self::Working(working) => [working.point_sources.len(), working.wedge_sources.len()],
        }
    }

    /// The points of a triangle.
    pub(crate) fn points(&self, triangle: TriangleId) -> [PointId; 3] {
        match self {
            Self::Mesh(mesh, _) => mesh.triangle_points(triangle.index()),
            Self::Working(working) => working.points(triangle),
        }
    }

    /// The position of a point in the space of the metric.
    pub(crate) fn position(&self, point: PointId) -> DVec3 {
        match self {
            Self::Mesh(mesh, space) => space.place(mesh.positions[point]),
            Self::Working(working) => working.metric.positions[point],
        }
    }

    /// A region as a surface of its own, and the numbers of its points and wedges there. `rim` are
    /// the triangles of other regions at its points.
    pub(crate) fn piece(
        &self,
        region: &[TriangleId],
        rim: &[TriangleId],
        numbers: &mut Numbers,
    ) -> WorkingMesh {
        numbers.clear();
        match self {
            Self::Mesh(mesh, space) => measure(mesh, space, [region, rim], numbers),
            Self::Working(working) => {
                // A region has about half as many points as triangles, and a few more at its rim.
                let sizes = [region.len(), region.len() * 5 / 8, region.len() * 5 / 8];
                let mut piece =
                    WorkingMesh::empty(&working.metric.space, working.metric.attributes, sizes);
                for &triangle in region {
                    piece.add(working, triangle, Key::Own, numbers);
                }
                piece.error = working.error;
                piece
            }
        }
    }

    /// The collapses that have led to it, taken from it.
    pub(crate) fn take_log(&mut self) -> Option<Log> {
        match self {
            Self::Mesh(..) => None,
            Self::Working(working) => working.log.take(),
        }
    }

    /// The whole surface as a working mesh.
    pub(crate) fn into_working_mesh(self) -> WorkingMesh {
        match self {
            Self::Mesh(mesh, space) => WorkingMesh::new(mesh, &space),
            Self::Working(working) => *working,
        }
    }
}

/// A region of a mesh, measured together with its rim and then cut from it, so that the quadrics of
/// its points have all their triangles.
fn measure(
    mesh: &Mesh,
    space: &Arc<Space>,
    [region, rim]: [&[TriangleId]; 2],
    numbers: &mut Numbers,
) -> WorkingMesh {
    let mut part = Mesh { layout: mesh.layout, ..Mesh::default() };
    let (mut point_sources, mut wedge_sources) = (Vec::new(), Vec::new());
    let mut own = [0; 2];
    for (at, &triangle) in region.iter().chain(rim).enumerate() {
        if at == region.len() {
            own = [point_sources.len(), wedge_sources.len()];
        }
        let wedges = mesh.triangles[triangle].map(|wedge| {
            let point = mesh.wedge_points[wedge];
            numbers.wedge_or(wedge, |numbers| {
                let number = numbers.point_or(point, || {
                    part.positions.push(mesh.positions[point]);
                    point_sources.push(point);
                    PointId::new(point_sources.len() - 1)
                });
                part.wedge_points.push(number);
                part.attributes.extend_from_slice(mesh.row(wedge));
                wedge_sources.push(wedge);
                WedgeId::new(wedge_sources.len() - 1)
            })
        });
        part.triangles.push(wedges);
        part.groups.push(mesh.groups[triangle]);
    }
    if rim.is_empty() {
        own = [point_sources.len(), wedge_sources.len()];
    }
    let mut metric = Metric::new(&part, space, &point_sources);
    metric.truncate(own[0], own[1]);
    part.triangles.truncate(region.len());
    part.groups.truncate(region.len());
    part.wedge_points.truncate(own[1]);
    point_sources.truncate(own[0]);
    wedge_sources.truncate(own[1]);
    let Mesh { triangles, groups, wedge_points, .. } = part;
    WorkingMesh {
        metric,
        bounds: vec![[0.0; 3]; triangles.len()],
        triangles,
        groups,
        wedge_points,
        point_sources,
        wedge_sources,
        error: 0.0,
        log: Log::of(space),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Weights;
    use crate::testing::sphere;

    #[test]
    fn a_region_has_the_quadrics_of_the_whole() {
        let mesh = sphere(12);
        let space = Arc::new(Space::new(&mesh, Weights::default()));
        let whole = WorkingMesh::new(&mesh, &space);
        let all = (0..mesh.triangles.len()).map(TriangleId::new);
        let (region, rim): (Vec<_>, Vec<_>) = all.partition(|t| t.0 % 5 < 3);
        let (points, wedges) = (mesh.positions.len(), mesh.wedge_points.len());
        let mut numbers = Numbers::new(points, wedges);
        let piece = RegionSource::Mesh(&mesh, space).piece(&region, &rim, &mut numbers);
        assert_eq!(piece.triangles.len(), region.len());
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15);
        for (wedge, &source) in piece.wedge_sources.iter().enumerate() {
            let own = WedgeId::new(wedge);
            assert!(near(piece.metric.quadric(own), whole.metric.quadric(source)));
            assert_eq!(piece.metric.row(own), whole.metric.row(source));
        }
        for (point, &source) in piece.point_sources.iter().enumerate() {
            assert_eq!(piece.metric.positions[point], whole.metric.positions[source]);
            let [own, of_whole] =
                [(&piece, PointId::new(point)), (&whole, source)].map(|(working, point)| {
                    working.metric.constraints.get(point).copied().unwrap_or_default()
                });
            assert!(near(&own.a, &of_whole.a) && (own.c - of_whole.c).abs() < 1e-15);
        }
    }
}
