//! The quadrics of a mesh, in the space that costs are measured in.

use std::sync::Arc;

use glam::DVec3;

use crate::constraints::Constraints;
use crate::edges::{Side, visit_sides};
use crate::id::{PointId, WedgeId};
use crate::mesh::Mesh;
use crate::quadric::{self, PointQuadric, Slopes};
use crate::settings::Cost;
use crate::space::Space;

/// Two wedges that are farther apart in UV and color than this share of an edge are on two sides of a
/// seam.
const SEAM_JUMP: f64 = 0.05;

/// From so many times fewer triangles on, where points move to counts more, by the square, up to the growth of
/// the motion. At first what is lost at rest is all that is seen; a level of a few triangles is for
/// moving things far away, where nothing is seen at rest any more.
const MOTION_ONSET: f64 = 2.0;

/// Triangles to be measured, in arrays of one entry each.
pub(crate) struct Faces<'a> {
    pub(crate) wedges: &'a [[WedgeId; 3]],
    pub(crate) points: &'a [[PointId; 3]],
    pub(crate) groups: &'a [u32],
}

impl Faces<'_> {
    /// The wedge of a triangle at one of its points.
    fn wedge(&self, triangle: usize, point: PointId) -> WedgeId {
        let slot = self.points[triangle].iter().position(|&own| own == point);
        self.wedges[triangle][slot.expect("a point of the triangle")]
    }
}

/// Positions, attribute rows and quadrics in one space.
pub(crate) struct Metric {
    pub(crate) space: Arc<Space>,
    /// One per point.
    pub(crate) positions: Vec<DVec3>,
    /// Floats in a wedge's row: those of the layout, then where its point moves to.
    pub(crate) attributes: usize,
    /// The factor of what tells where points move to, beside that of the space.
    motion_factor: f64,
    /// A row per wedge.
    pub(crate) rows: Vec<f64>,
    /// A packed quadric per wedge.
    pub(crate) quadrics: Vec<f64>,
    /// Border and seam planes, one sum per point.
    pub(crate) constraints: Constraints,
    /// One per point: its shell, by the directions that it faces. Empty if none faces any.
    pub(crate) shells: Vec<u32>,
}

impl Metric {
    /// Measures a mesh, or a piece of the one that `space` was made for, whose points are `sources`
    /// there. Its layout must not hold more than [`MAX_ATTRIBUTES`](quadric::MAX_ATTRIBUTES) floats.
    pub(crate) fn new(mesh: &Mesh, space: &Arc<Space>, sources: &[PointId]) -> Self {
        let attributes = mesh.layout.len() + space.motion_width;
        let mut metric = Self {
            space: Arc::clone(space),
            positions: mesh.positions.iter().map(|&p| space.place(p)).collect(),
            attributes,
            motion_factor: 1.0,
            rows: rows(mesh, space, sources),
            quadrics: vec![0.0; mesh.wedge_points.len() * quadric::stride(attributes)],
            constraints: Constraints::new(mesh.positions.len()),
            shells: match space.facing.is_empty() {
                true => Vec::new(),
                false => sources.iter().map(|&source| space.facing.shell(source)).collect(),
            },
        };
        metric.scale_rows(mesh);
        let points: Vec<[PointId; 3]> =
            (0..mesh.triangles.len()).map(|triangle| mesh.triangle_points(triangle)).collect();
        let faces = Faces { wedges: &mesh.triangles, points: &points, groups: &mesh.groups };
        metric.sum(&faces, sources);
        metric
    }

    /// Sums the quadrics of triangles as they lie now, over points that stand for `sources`.
    pub(crate) fn sum(&mut self, faces: &Faces<'_>, sources: &[PointId]) {
        self.quadrics.fill(0.0);
        self.constraints.clear();
        let importance: Vec<f64> =
            sources.iter().map(|&point| self.space.importance(point)).collect();
        self.add_triangles(faces, sources, &importance);
        if self.space.cost != Cost::Classic {
            self.add_outlines(faces, &importance);
        }
    }

    /// Counts where points move to for more, once the surface has so many times fewer triangles than its
    /// source. To be followed by a sum.
    pub(crate) fn weigh_motion(&mut self, fewer: f64) {
        let width = self.space.motion_width;
        let factor = (fewer / MOTION_ONSET).powi(2).clamp(1.0, self.space.motion_growth);
        let by = factor / std::mem::replace(&mut self.motion_factor, factor);
        if width > 0 {
            let rows = self.rows.chunks_exact_mut(self.attributes);
            rows.flat_map(|row| &mut row[self.attributes - width..]).for_each(|x| *x *= by);
        }
    }

    /// An empty metric with room for so many points and wedges of `attributes` floats.
    pub(crate) fn empty(
        space: &Arc<Space>,
        attributes: usize,
        [points, wedges]: [usize; 2],
    ) -> Self {
        Self {
            space: Arc::clone(space),
            positions: Vec::with_capacity(points),
            attributes,
            motion_factor: 1.0,
            rows: Vec::with_capacity(wedges * attributes),
            quadrics: Vec::with_capacity(wedges * quadric::stride(attributes)),
            constraints: Constraints::with_capacity(points),
            shells: Vec::new(),
        }
    }

    /// Forgets all but the first points and wedges.
    pub(crate) fn truncate(&mut self, points: usize, wedges: usize) {
        self.positions.truncate(points);
        self.constraints.truncate(points);
        self.shells.truncate(points);
        self.rows.truncate(wedges * self.attributes);
        self.quadrics.truncate(wedges * quadric::stride(self.attributes));
    }

    /// Adds a point of another metric of the same space.
    pub(crate) fn push_point(&mut self, from: &Self, point: PointId) {
        self.positions.push(from.positions[point]);
        self.constraints.push(from.constraints.get(point));
        self.shells.extend(from.shells.get(point.index()));
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
                let scales = &space.scales(*group)[..mesh.layout.len()];
                for (x, scale) in self.row_mut(*wedge).iter_mut().zip(scales) {
                    *x *= scale;
                }
            }
        }
    }

    fn add_triangles(&mut self, faces: &Faces<'_>, sources: &[PointId], importance: &[f64]) {
        let space = Arc::clone(&self.space);
        let seen = self.attributes - space.motion_width;
        let stride = quadric::stride(self.attributes);
        let mut own = vec![0.0; stride];
        for (&wedges, points) in faces.wedges.iter().zip(faces.points) {
            let p = points.map(|point| self.positions[point]);
            let cross = (p[1] - p[0]).cross(p[2] - p[0]);
            let normal = cross.normalize_or_zero();
            let (slopes, rows) = (Slopes::new(p), wedges.map(|wedge| self.row(wedge)));
            let gradients = (0..self.attributes).map(|at| {
                let own = slopes.gradient(rows.map(|row| row[at]));
                let Some(entry) = at.checked_sub(seen) else { return own };
                let turns = points.map(|point| space.turn(sources[point.index()], entry));
                let turn = self.motion_factor * turns.iter().sum::<f64>() / 3.0;
                own.rising(normal * turn, p[0])
            });
            let weight = match space.cost {
                Cost::Classic => 1.0,
                Cost::Quadric | Cost::EdgeLength => cross.length() / 6.0,
            };
            quadric::set_triangle(&mut own, (p[0], normal), gradients, weight);
            for (wedge, point) in wedges.into_iter().zip(points) {
                let factor = importance[point.index()];
                quadric::add_scaled(self.quadric_mut(wedge), &own, factor);
            }
        }
    }

    /// Adds a plane through each border and seam edge, perpendicular to its triangle, so that
    /// outlines and seams stay where they are (Garland & Heckbert 1997, §6). Weighted by the
    /// edge's squared length. Where normals alone differ, none is needed: the surface bends there.
    fn add_outlines(&mut self, faces: &Faces<'_>, importance: &[f64]) {
        let weights = self.space.weights;
        visit_sides(faces.points, self.positions.len(), |sides| {
            let weight = match sides {
                [a, b] if self.is_seam(faces, [a, b]) => weights.seam,
                [_, _] => return,
                _ => weights.border,
            };
            for &(points, triangle) in sides {
                let [from, to] = points.map(|point| self.positions[point]);
                let p = faces.points[triangle].map(|point| self.positions[point]);
                let face = (p[1] - p[0]).cross(p[2] - p[0]);
                let normal = (to - from).cross(face).normalize_or_zero();
                let weight = weight * (to - from).length_squared() / 2.0;
                for point in points {
                    let weight = weight * importance[point.index()];
                    let plane = PointQuadric::from_plane(from, normal, weight);
                    self.constraints.add(point, &plane);
                }
            }
        });
    }

    /// Whether the two sides of an edge differ in group, UV, color, or in what the metric does not see,
    /// as ids. Where normals alone differ, either side keeps its own UVs as it is simplified, and those
    /// stay together as near as what is left allows.
    fn is_seam(&self, faces: &Faces<'_>, [a, b]: [&Side; 2]) -> bool {
        let is_one_group = faces.groups[a.1] == faces.groups[b.1];
        let wedges = &faces.wedges[b.1];
        let is_common = |wedge: &&WedgeId| wedges.contains(wedge);
        if is_one_group && faces.wedges[a.1].iter().filter(is_common).count() == 2 {
            return false;
        }
        let layout = self.space.layout;
        let [from, to] = a.0.map(|point| self.positions[point]);
        let most = SEAM_JUMP * SEAM_JUMP * from.distance_squared(to);
        let jumps = |point: PointId| {
            let (own, other) = (faces.wedge(a.1, point), faces.wedge(b.1, point));
            let squares = self.row(own).iter().zip(self.row(other)).map(|(x, y)| (x - y).powi(2));
            let normal = layout.normal()..layout.color();
            let squares = squares.take(layout.len()).enumerate();
            let others = squares.filter(|(at, _)| !normal.contains(at));
            // Wedges of one group whose rows are equal are two for their ids alone.
            let is_unseen = || self.row(own) == self.row(other);
            own != other && (others.map(|(_, square)| square).sum::<f64>() > most || is_unseen())
        };
        !is_one_group || a.0.into_iter().any(jumps)
    }

    /// Whether a triangle at a point turns its back on a direction that its shell faces.
    pub(crate) fn turns_back(&self, point: PointId, before: [DVec3; 3], after: [DVec3; 3]) -> bool {
        let shell = self.shells.get(point.index());
        shell.is_some_and(|&shell| self.space.facing.turns_back(shell, before, after))
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
        let scales = &self.space.scales(group)[..self.space.layout.len()];
        out.extend(self.row(wedge).iter().zip(scales).map(|(x, scale)| (x / scale) as f32));
    }
}

/// A row per wedge: its attributes, and where its point moves to.
fn rows(mesh: &Mesh, space: &Space, sources: &[PointId]) -> Vec<f64> {
    if space.motion_width == 0 {
        return mesh.attributes.iter().map(|&x| f64::from(x)).collect();
    }
    let len = mesh.layout.len() + space.motion_width;
    let mut rows = Vec::with_capacity(mesh.wedge_points.len() * len);
    for (wedge, &point) in mesh.wedge_points.iter().enumerate() {
        rows.extend(mesh.row(WedgeId::new(wedge)).iter().map(|&x| f64::from(x)));
        rows.extend_from_slice(space.motion(sources[point.index()]));
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Weights;
    use crate::testing::{grid, sphere};
    use glam::Vec3;

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
    fn normals_alone_make_no_outline() {
        let smooth = sphere(8);
        let mut flat = Mesh { layout: smooth.layout, ..Mesh::default() };
        flat.positions.clone_from(&smooth.positions);
        flat.groups.clone_from(&smooth.groups);
        for (triangle, wedges) in smooth.triangles.iter().enumerate() {
            let [a, b, c] = smooth.triangle_positions(triangle);
            let normal = (b - a).cross(c - a).normalize();
            // Squares are flat: no two triangles may have one normal, or their wedges would be one.
            let normal = (normal + Vec3::splat(1e-4 * triangle as f32)).normalize();
            flat.triangles.push(wedges.map(|wedge| {
                flat.wedge_points.push(smooth.wedge_points[wedge]);
                flat.attributes.extend_from_slice(&smooth.row(wedge)[..2]);
                flat.attributes.extend(normal.to_array());
                WedgeId::new(flat.wedge_points.len() - 1)
            }));
        }
        let [smooth, flat] = [&smooth, &flat].map(|mesh| metric(mesh, Weights::default()));
        assert_eq!(flat.constraints, smooth.constraints);
        let is_free = |point| smooth.constraints.get(PointId::new(point)).is_none();
        assert!((0..smooth.positions.len()).any(is_free));
    }

    #[test]
    fn quadrics_summed_again_are_the_same_and_of_moved_points_are_not() {
        let mesh = sphere(8);
        let points: Vec<PointId> = (0..mesh.positions.len()).map(PointId::new).collect();
        let corners: Vec<_> = (0..mesh.triangles.len()).map(|t| mesh.triangle_points(t)).collect();
        let faces = Faces { wedges: &mesh.triangles, points: &corners, groups: &mesh.groups };
        let mut metric = metric(&mesh, Weights::default());
        let before = metric.quadrics.clone();
        metric.sum(&faces, &points);
        assert_eq!(metric.quadrics, before);
        metric.positions[3] *= 1.1;
        metric.sum(&faces, &points);
        assert_ne!(metric.quadrics, before);
    }

    #[test]
    fn only_borders_are_constrained_on_a_plain_grid() {
        let metric = metric(&grid(3), Weights::default());
        for point in 0..16 {
            let is_free = metric.constraints.get(PointId::new(point)).is_none();
            assert_eq!(is_free, matches!(point, 5 | 6 | 9 | 10), "point {point}");
        }
    }
}
