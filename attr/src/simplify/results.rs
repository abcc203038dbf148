//! Results of a descent: the working mesh of the next, or a mesh.

use std::collections::BTreeSet;

use super::Descent;
use crate::id::{PointId, TriangleId, WedgeId};
use crate::mesh::Mesh;
use crate::quadric::{self, PointQuadric};
use crate::rank::triangle_bounds;
use crate::working_mesh::WorkingMesh;

impl Descent<'_> {
    /// The surface as it stands, with points and wedges among its own that are gone.
    pub(crate) fn into_working_mesh(self) -> WorkingMesh {
        let rejected =
            self.rejected.into_iter().map(|(lower_bound, item)| (lower_bound, item.pack()));
        let waiting = self.queue.into_items().chain(rejected);
        let bounds = triangle_bounds(&self.topology, self.bounds, waiting);
        let (triangles, live, wedge_points) = self.topology.into_parts();
        WorkingMesh {
            metric: self.metric,
            triangles: kept(triangles, &live),
            groups: kept(self.groups, &live),
            bounds: kept(bounds, &live),
            wedge_points,
            point_sources: self.point_sources,
            wedge_sources: self.wedge_sources,
            error: self.error,
            log: self.log,
        }
    }

    /// The quadric of each point, over position alone and in the units of the metric, by the source point that
    /// it stands for.
    pub(crate) fn point_quadrics(&self) -> Vec<PointQuadric> {
        let mut quadrics = vec![PointQuadric::default(); self.source.positions.len()];
        for point in (0..self.point_sources.len()).map(PointId::new) {
            let mut corners = self.topology.corners(point).peekable();
            if corners.peek().is_none() {
                continue;
            }
            let wedges: BTreeSet<usize> =
                corners.map(|corner| self.topology.wedge(corner).index()).collect();
            let own = &mut quadrics[self.point_sources[point]];
            self.metric.constraints.add_to(own, point);
            for wedge in wedges.into_iter().map(WedgeId::new) {
                own.add(&quadric::reduce(self.metric.quadric(wedge)));
            }
        }
        quadrics
    }

    /// The mesh as it stands, and for each of its points and wedges the one of the source that it
    /// stands for.
    pub(crate) fn snapshot(&self) -> (Mesh, Vec<PointId>, Vec<WedgeId>) {
        let mut mesh = Mesh { layout: self.layout, ..Mesh::default() };
        let (mut point_sources, mut wedge_sources) = (Vec::new(), Vec::new());
        let mut new_points = vec![None; self.point_sources.len()];
        let mut new_wedges = vec![None; self.wedge_sources.len()];
        for triangle in (0..self.groups.len()).map(TriangleId::new) {
            if !self.topology.is_live(triangle) {
                continue;
            }
            let group = self.groups[triangle];
            let points = self.topology.points(triangle);
            let wedges = self.topology.wedges(triangle);
            let corners = std::array::from_fn(|slot| {
                *new_wedges[wedges[slot].index()].get_or_insert_with(|| {
                    let point = *new_points[points[slot].index()].get_or_insert_with(|| {
                        mesh.positions.push(self.metric.position(points[slot]));
                        point_sources.push(self.point_sources[points[slot]]);
                        PointId::new(mesh.positions.len() - 1)
                    });
                    mesh.wedge_points.push(point);
                    self.metric.unscaled_row(wedges[slot], group, &mut mesh.attributes);
                    wedge_sources.push(self.wedge_sources[wedges[slot]]);
                    WedgeId::new(mesh.wedge_points.len() - 1)
                })
            });
            mesh.triangles.push(corners);
            mesh.groups.push(group);
        }
        (mesh, point_sources, wedge_sources)
    }
}

/// The entries that are marked as live.
fn kept<T>(mut all: Vec<T>, live: &[bool]) -> Vec<T> {
    let mut live = live.iter();
    all.retain(|_| live.next() == Some(&true));
    all
}
