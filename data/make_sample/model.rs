//! The mesh under construction: points shared by index, so that charts and materials that meet
//! there share the position bitwise.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use crate::profile::Part;

/// A triangle's corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    /// Index into [`Model::points`].
    pub(crate) point: usize,
    /// Where the chart, unrolled flat, has it: millimetres, x right and y up seen from outside.
    pub(crate) flat: DVec2,
    /// Arc length along the outline or the tube, millimetres.
    pub(crate) along: f64,
    /// Around a tube, in turns; on the turned parts 0, since the position tells it.
    pub(crate) around: f64,
}

/// A triangle, its corners counter-clockwise from outside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triangle {
    pub(crate) corners: [Corner; 3],
    /// Index into [`CHARTS`].
    pub(crate) chart: usize,
    pub(crate) part: Part,
    /// Triangles of one number that share a point share its normal.
    pub(crate) smoothing: usize,
}

/// A chart of the atlas and how it lies there.
pub(crate) struct Chart {
    pub(crate) name: &'static str,
    /// Counter-clockwise, in degrees.
    pub(crate) angle: f64,
    /// Laid down with its back up, so that its UVs wind the other way.
    pub(crate) mirrored: bool,
}

const fn chart(name: &'static str, angle: f64, mirrored: bool) -> Chart {
    Chart { name, angle, mirrored }
}

/// All charts of the atlas; in different orientations, one mirrored.
pub(crate) const CHARTS: [Chart; 17] = [
    chart("body, spout side", 90.0, false),
    chart("body, ship side", 90.0, false),
    chart("body, handle side", 180.0, false),
    chart("body, tulip side", 0.0, false),
    chart("neck", 0.0, false),
    chart("lid", 20.0, false),
    chart("base", 0.0, false),
    chart("foot", 0.0, false),
    chart("collar", 180.0, false),
    chart("knob, stem", 90.0, false),
    chart("knob, cap", 0.0, false),
    chart("spout, near half", 270.0, false),
    chart("spout, far half", 270.0, true),
    chart("spout, tip", 270.0, false),
    chart("spout, bore", 0.0, false),
    chart("handle", 90.0, false),
    chart("handle, foot", 0.0, false),
];

/// The index of a chart by its name.
///
/// # Panics
/// If the table has no such chart.
pub(crate) fn chart_named(name: &str) -> usize {
    CHARTS.iter().position(|chart| chart.name == name).expect("the chart is in the table")
}

/// The whole mesh.
#[derive(Default)]
pub(crate) struct Model {
    /// Millimetres, y up.
    pub(crate) points: Vec<DVec3>,
    pub(crate) triangles: Vec<Triangle>,
}

impl Model {
    /// Adds a point.
    pub(crate) fn add_point(&mut self, position: DVec3) -> usize {
        self.points.push(position);
        self.points.len() - 1
    }

    /// Adds a quad (counter-clockwise from outside) as two triangles along its shorter diagonal.
    pub(crate) fn add_quad(&mut self, quad: [Corner; 4], like: Triangle) {
        let [a, b, c, d] = quad;
        let length = |p: Corner, q: Corner| self.points[p.point].distance(self.points[q.point]);
        // The margin keeps the last bit of a sine from turning a diagonal.
        let halves = if length(a, c) <= length(b, d) + 1e-9 {
            [[a, b, c], [a, c, d]]
        } else {
            [[a, b, d], [b, c, d]]
        };
        self.triangles.extend(halves.map(|corners| Triangle { corners, ..like }));
    }

    /// A triangle's corners' positions.
    pub(crate) fn positions(&self, triangle: &Triangle) -> [DVec3; 3] {
        triangle.corners.map(|corner| self.points[corner.point])
    }

    /// Drops points that no triangle names.
    pub(crate) fn prune(&mut self) {
        let mut new = vec![usize::MAX; self.points.len()];
        let mut kept = vec![];
        for corner in self.triangles.iter_mut().flat_map(|t| &mut t.corners) {
            if new[corner.point] == usize::MAX {
                new[corner.point] = kept.len();
                kept.push(self.points[corner.point]);
            }
            corner.point = new[corner.point];
        }
        self.points = kept;
    }

    /// One unit normal per triangle's corner: the sum over the triangles of the same smoothing
    /// number at its point, each weighted by its angle there.
    pub(crate) fn normals(&self) -> Vec<[DVec3; 3]> {
        let mut sums = BTreeMap::<(usize, usize), DVec3>::new();
        for triangle in &self.triangles {
            let p = self.positions(triangle);
            let face = (p[1] - p[0]).cross(p[2] - p[0]).normalize();
            for (slot, corner) in triangle.corners.iter().enumerate() {
                let (next, last) = (p[(slot + 1) % 3] - p[slot], p[(slot + 2) % 3] - p[slot]);
                *sums.entry((corner.point, triangle.smoothing)).or_default() +=
                    face * next.angle_between(last);
            }
        }
        let normal = |t: &Triangle, c: Corner| sums[&(c.point, t.smoothing)].normalize();
        self.triangles.iter().map(|t| t.corners.map(|c| normal(t, c))).collect()
    }

    /// One number per point: how far the surface around lies above it, in edge lengths; positive
    /// in a hollow, negative on a ridge, blurred over the neighbours.
    pub(crate) fn hollows(&self) -> Vec<f64> {
        let mut neighbors = vec![vec![]; self.points.len()];
        let mut normals = vec![DVec3::ZERO; self.points.len()];
        for triangle in &self.triangles {
            let p = self.positions(triangle);
            let face = (p[1] - p[0]).cross(p[2] - p[0]);
            for slot in 0..3 {
                let corner = triangle.corners[slot].point;
                normals[corner] += face;
                neighbors[corner].push(triangle.corners[(slot + 1) % 3].point);
            }
        }
        let mean = |list: &[usize], of: &dyn Fn(usize) -> f64| {
            list.iter().map(|&i| of(i)).sum::<f64>() / list.len() as f64
        };
        let rise = |point: usize| {
            let here = self.points[point];
            let height = |i: usize| (self.points[i] - here).dot(normals[point].normalize());
            let length = |i: usize| self.points[i].distance(here);
            mean(&neighbors[point], &height) / mean(&neighbors[point], &length)
        };
        let sharp: Vec<f64> = (0..self.points.len()).map(rise).collect();
        let blur = |point: usize| {
            0.5 * sharp[point] + 0.5 * mean(&neighbors[point], &|neighbor| sharp[neighbor])
        };
        (0..self.points.len()).map(blur).collect()
    }
}
