//! From a mesh to its quadrics in the space that costs are measured in.

use std::sync::Arc;

use glam::DVec3;

use crate::edges::{EdgeKind, visit_edges};
use crate::id::{PointId, WedgeId};
use crate::mesh::Mesh;
use crate::quadric::{self, PointQuadric, Slopes};
use crate::space::Space;

/// How much a unit of error in each attribute counts beside a unit of distance.
///
/// Lab note (`cargo bench --bench quality -- --alone --views 6 --resolution 256 --samples 30000`):
/// the normal's weight decides. RMS sRGB luminance and RMS distance over the diagonal at 6.25 %:
///
/// | UV, normal | scanned box | gelatin box | racquet |
/// |---|---|---|---|
/// | 0.5, 0.05 | 0.0078, 4.5e-4 | 0.0075, 4.8e-4 | 0.0262, 6.0e-3 |
/// | 1, 0.02 | 0.0055, 2.9e-4 | 0.0061, 3.6e-4 | 0.0247, 5.7e-3 |
/// | 0.5, 0.01 | 0.0044, 2.2e-4 | 0.0056, 3.0e-4 | 0.0231, 5.8e-3 |
/// | **0.5, 0.005** | 0.0042, 1.9e-4 | 0.0056, 2.6e-4 | 0.0212, 4.8e-3 |
/// | 0.2, 0.005 | 0.0042, 2.0e-4 | 0.0056, 2.6e-4 | 0.0204, 4.7e-3 |
/// | 0.5, 0.002 | 0.0043, 1.8e-4 | 0.0058, 2.4e-4 | 0.0204, 4.8e-3 |
///
/// Less than 0.005 buys distance with shading. Seams at 0.1 instead of 1 gain 4 to 11 % in distance
/// on the boxes and let their outlines slide (color 0.0024 → 0.0036 on the first); borders at 1
/// instead of 4 cost the racquet a quarter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// On UVs in lengths on the surface.
    pub uv: f64,
    /// On unit normals, in shares of the mesh's extent.
    pub normal: f64,
    /// On colors in 0…1, in shares of the mesh's extent.
    pub color: f64,
    /// On the planes that hold borders.
    pub border: f64,
    /// On the planes that hold seams and material boundaries.
    pub seam: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self { uv: 0.5, normal: 0.005, color: 0.02, border: 4.0, seam: 1.0 }
    }
}

/// Positions, attribute rows and quadrics in one space.
pub(crate) struct Metric {
    pub(crate) space: Arc<Space>,
    /// One per point.
    pub(crate) positions: Vec<DVec3>,
    /// Floats in a wedge's row.
    pub(crate) attributes: usize,
    /// A row per wedge.
    pub(crate) rows: Vec<f64>,
    /// A packed quadric per wedge.
    pub(crate) quadrics: Vec<f64>,
    /// Border and seam planes, one sum per point.
    pub(crate) constraints: Vec<PointQuadric>,
}

impl Metric {
    /// Measures a mesh, or a piece of the one that `space` was made for, whose points are `sources`
    /// there. Its layout must not hold more than [`MAX_ATTRIBUTES`](quadric::MAX_ATTRIBUTES) floats.
    pub(crate) fn new(mesh: &Mesh, space: &Arc<Space>, sources: &[PointId]) -> Self {
        let attributes = mesh.layout.len();
        let mut metric = Self {
            space: Arc::clone(space),
            positions: mesh.positions.iter().map(|&p| space.place(p)).collect(),
            attributes,
            rows: mesh.attributes.iter().map(|&x| f64::from(x)).collect(),
            quadrics: vec![0.0; mesh.wedge_points.len() * quadric::stride(attributes)],
            constraints: vec![PointQuadric::default(); mesh.positions.len()],
        };
        metric.scale_rows(mesh);
        let importance: Vec<f64> = sources.iter().map(|&point| space.importance(point)).collect();
        metric.add_triangles(mesh, &importance);
        metric.add_outlines(mesh, &importance);
        metric
    }

    /// Nothing yet, with room for so many points and wedges of `attributes` floats.
    pub(crate) fn empty(
        space: &Arc<Space>,
        attributes: usize,
        [points, wedges]: [usize; 2],
    ) -> Self {
        Self {
            space: Arc::clone(space),
            positions: Vec::with_capacity(points),
            attributes,
            rows: Vec::with_capacity(wedges * attributes),
            quadrics: Vec::with_capacity(wedges * quadric::stride(attributes)),
            constraints: Vec::with_capacity(points),
        }
    }

    /// Forgets all but the first points and wedges.
    pub(crate) fn truncate(&mut self, points: usize, wedges: usize) {
        self.positions.truncate(points);
        self.constraints.truncate(points);
        self.rows.truncate(wedges * self.attributes);
        self.quadrics.truncate(wedges * quadric::stride(self.attributes));
    }

    /// Adds a point of another metric of the same space.
    pub(crate) fn push_point(&mut self, from: &Self, point: PointId) {
        self.positions.push(from.positions[point]);
        self.constraints.push(from.constraints[point]);
    }

    /// Adds a wedge of another metric of the same space.
    pub(crate) fn push_wedge(&mut self, from: &Self, wedge: WedgeId) {
        self.rows.extend_from_slice(from.row(wedge));
        self.quadrics.extend_from_slice(from.quadric(wedge));
    }

    fn scale_rows(&mut self, mesh: &Mesh) {
        let space = Arc::clone(&self.space);
        let mut done = vec![false; mesh.wedge_points.len()];
        for (wedges, group) in mesh.triangles.iter().zip(&mesh.groups) {
            for wedge in wedges.iter().filter(|w| !std::mem::replace(&mut done[**w], true)) {
                let scales = *space.scales(*group);
                for (x, scale) in self.row_mut(*wedge).iter_mut().zip(scales) {
                    *x *= scale;
                }
            }
        }
    }

    fn add_triangles(&mut self, mesh: &Mesh, importance: &[f64]) {
        let stride = quadric::stride(self.attributes);
        let mut own = vec![0.0; stride];
        for triangle in 0..mesh.triangles.len() {
            let wedges = mesh.triangles[triangle];
            let p = mesh.triangle_points(triangle).map(|point| self.positions[point]);
            let cross = (p[1] - p[0]).cross(p[2] - p[0]);
            let normal = cross.normalize_or_zero();
            let (slopes, rows) = (Slopes::new(p), wedges.map(|wedge| self.row(wedge)));
            let gradients = (0..self.attributes).map(|at| slopes.gradient(rows.map(|row| row[at])));
            quadric::set_triangle(&mut own, (p[0], normal), gradients, cross.length() / 6.0);
            for wedge in wedges {
                let factor = importance[mesh.wedge_points[wedge].index()];
                quadric::add_scaled(self.quadric_mut(wedge), &own, factor);
            }
        }
    }

    /// Adds a plane through each border and seam edge, perpendicular to its triangle, so that
    /// outlines and seams stay where they are (Garland & Heckbert 1997, §6). Weighted by the
    /// edge's squared length. A crease needs none: the surface bends there.
    fn add_outlines(&mut self, mesh: &Mesh, importance: &[f64]) {
        let weights = self.space.weights;
        visit_edges(mesh, |kind, sides| {
            let weight = match kind {
                EdgeKind::Inner | EdgeKind::Crease => return,
                EdgeKind::Seam => weights.seam,
                EdgeKind::Border | EdgeKind::Complex => weights.border,
            };
            for &(points, triangle) in sides {
                let [from, to] = points.map(|point| self.positions[point]);
                let p = mesh.triangle_points(triangle).map(|point| self.positions[point]);
                let face = (p[1] - p[0]).cross(p[2] - p[0]);
                let normal = (to - from).cross(face).normalize_or_zero();
                let weight = weight * (to - from).length_squared() / 2.0;
                for point in points {
                    let weight = weight * importance[point.index()];
                    self.constraints[point].add(&PointQuadric::from_plane(from, normal, weight));
                }
            }
        });
    }

    /// A wedge's row.
    #[inline]
    pub(crate) fn row(&self, wedge: WedgeId) -> &[f64] {
        &self.rows[wedge.index() * self.attributes..][..self.attributes]
    }

    /// A wedge's row, to write.
    #[inline]
    pub(crate) fn row_mut(&mut self, wedge: WedgeId) -> &mut [f64] {
        &mut self.rows[wedge.index() * self.attributes..][..self.attributes]
    }

    /// A wedge's packed quadric.
    #[inline]
    pub(crate) fn quadric(&self, wedge: WedgeId) -> &[f64] {
        let stride = quadric::stride(self.attributes);
        &self.quadrics[wedge.index() * stride..][..stride]
    }

    /// A wedge's packed quadric, to write.
    #[inline]
    pub(crate) fn quadric_mut(&mut self, wedge: WedgeId) -> &mut [f64] {
        let stride = quadric::stride(self.attributes);
        &mut self.quadrics[wedge.index() * stride..][..stride]
    }

    /// A position back in the units of the mesh.
    pub(crate) fn position(&self, point: PointId) -> glam::Vec3 {
        self.space.unplace(self.positions[point])
    }

    /// A wedge's row back in the units of the mesh, appended to `out`.
    pub(crate) fn unscaled_row(&self, wedge: WedgeId, group: u32, out: &mut Vec<f32>) {
        let scales = *self.space.scales(group);
        out.extend(self.row(wedge).iter().zip(scales).map(|(x, scale)| (x / scale) as f32));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{grid, sphere};

    fn metric(mesh: &Mesh, weights: Weights) -> Metric {
        let points: Vec<PointId> = (0..mesh.positions.len()).map(PointId::new).collect();
        Metric::new(mesh, &Arc::new(Space::new(mesh, weights)), &points)
    }

    #[test]
    fn a_row_comes_back_from_the_metric_as_it_went_in() {
        let mesh = sphere(8);
        let metric = metric(&mesh, Weights::default());
        for (wedge, expected) in mesh.attributes.chunks_exact(5).enumerate() {
            let mut row = Vec::new();
            metric.unscaled_row(WedgeId::new(wedge), 0, &mut row);
            for (x, y) in row.iter().zip(expected) {
                assert!((x - y).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn a_uv_is_scaled_to_lengths_on_the_surface() {
        let mut mesh = grid(4);
        for p in &mut mesh.positions {
            *p *= 10.0;
        }
        let metric = metric(&mesh, Weights { uv: 1.0, ..Weights::default() });
        let far = metric.row(mesh.triangles.last().expect("a triangle")[1]);
        assert!((far[0] - 1.0).abs() < 1e-6, "one square is one unit wide, so is its texture");
    }

    #[test]
    fn only_borders_are_constrained_on_a_plain_grid() {
        let metric = metric(&grid(3), Weights::default());
        for (point, constraint) in metric.constraints.iter().enumerate() {
            let inner = matches!(point, 5 | 6 | 9 | 10);
            assert_eq!(*constraint == PointQuadric::default(), inner, "point {point}");
        }
    }
}
