//! Attributes fitted to what the source has at the nearest points.

use std::sync::Arc;

use glam::{DVec2, DVec3, DVec4, Vec4};
use rayon::prelude::*;

use super::fans::Fans;
use super::pairs::{Pair, Source};
use super::system::{Element, Graph, System};
use crate::buckets::Buckets;
use crate::id::PointId;
use crate::mesh::Mesh;
use crate::quadric::MAX_ATTRIBUTES;
use crate::shape::folds;

const ITERATIONS: usize = 30;
const TOLERANCE: f64 = 1e-3;
/// Triangles that one thread sums up at least.
const AT_ONCE: usize = 256;

/// Fits every wedge's row, but for those of `locked` points, to what the source has at its
/// counterparts. Pairs of two groups or two charts do not count.
pub(super) fn fit(
    from: &Source<'_>,
    level: &mut Mesh,
    pairs: &[Pair],
    locked: &[bool],
    damping: f64,
) {
    let attributes = level.layout.len();
    if attributes == 0 {
        return;
    }
    let wedges = level.triangles.iter().map(|wedges| wedges.map(|w| w.0));
    let graph = Graph::new(Arc::new(Fans::new(wedges.collect(), level.wedge_points.len())));
    let equations = Equations::of(from, level, pairs);
    let weight: f64 = equations.elements.iter().map(Element::weight).sum();
    let damping = damping * weight / level.wedge_points.len() as f64;
    let system = System::new(&graph, &equations.elements, damping);
    let is_free = |point: &PointId| locked.get(point.index()) != Some(&true);
    let free: Vec<bool> = level.wedge_points.iter().map(is_free).collect();
    let before = level.attributes.clone();
    for four in 0..equations.fours {
        let mut right = graph.sum_corners(|corner| equations.right(corner, four).as_dvec4());
        // Each of the four is solved as exactly as the others, whatever its unit is.
        let squares: DVec4 = right.iter().map(|r| *r * *r).sum();
        let scales =
            squares.to_array().map(|square| if square > 0.0 { square.sqrt() } else { 1.0 });
        let scales = DVec4::from_array(scales);
        right.iter_mut().for_each(|r| *r /= scales);
        let steps = system.solve(&right, &free, ITERATIONS, TOLERANCE);
        for (row, step) in level.attributes.chunks_exact_mut(attributes).zip(steps) {
            let step = (step * scales).to_array();
            for (x, step) in row.iter_mut().skip(4 * four).zip(step) {
                *x = (f64::from(*x) + step) as f32;
            }
        }
    }
    (0..level.layout.uv_sets).for_each(|set| unfold(level, &before, set));
}

/// The normal equations of all attributes, which share a matrix.
struct Equations {
    /// One per triangle.
    elements: Vec<Element<f64>>,
    /// Per triangle: for each four attributes what its corners ask for.
    right: Vec<[Vec4; 3]>,
    /// Attributes by four, rounded up.
    fours: usize,
}

impl Equations {
    fn of(from: &Source<'_>, level: &Mesh, pairs: &[Pair]) -> Self {
        let fours = level.layout.len().div_ceil(4);
        let by_triangle =
            Buckets::new(pairs.iter().map(|pair| pair.level.triangle.0), level.triangles.len());
        let mut right = vec![[Vec4::ZERO; 3]; level.triangles.len() * fours];
        let elements = right
            .par_chunks_mut(fours)
            .with_min_len(AT_ONCE)
            .enumerate()
            .map(|(triangle, right)| {
                let own = by_triangle.of(triangle).iter().map(|&at| &pairs[at as usize]);
                equations(from, level, triangle, own, right)
            })
            .collect();
        Self { elements, right, fours }
    }

    /// What a corner asks for, of one four of attributes.
    fn right(&self, corner: usize, four: usize) -> Vec4 {
        self.right[corner / 3 * self.fours + four][corner % 3]
    }
}

/// Sums the pairs on one triangle: `right` becomes Σ b (a(source) − a(level)), where the level's part is
/// its attributes times the products of barycentrics.
fn equations<'a>(
    from: &Source<'_>,
    level: &Mesh,
    triangle: usize,
    pairs: impl Iterator<Item = &'a Pair>,
    right: &mut [[Vec4; 3]],
) -> Element<f64> {
    let (source, own) = (from.sheet.mesh, Rows::of(level, triangle));
    let mut element = Element::default();
    let mut sums = [DVec3::ZERO; MAX_ATTRIBUTES];
    let sums = &mut sums[..level.layout.len()];
    let pairs = pairs.filter(|pair| source.groups[pair.source.triangle] == level.groups[triangle]);
    for pair in pairs {
        let rows = Rows::of(source, pair.source.triangle.index());
        let (there, here) = (pair.source.barycentrics(), pair.level.barycentrics());
        if !(0..level.layout.uv_sets).all(|set| own.holds(here, rows.uv(there, set), set)) {
            continue;
        }
        let weight = from.weight(pair);
        element.add(here, weight);
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += here * (weight * rows.value(there, k));
        }
    }
    let ([aa, bb, cc], [ab, bc, ca]) = (element.corners, element.edges);
    for (k, sum) in sums.iter().enumerate() {
        let [a, b, c] = own.0.map(|row| f64::from(row[k]));
        let here = DVec3::new(
            aa * a + ab * b + ca * c,
            ab * a + bb * b + bc * c,
            ca * a + bc * b + cc * c,
        );
        for (slot, off) in (*sum - here).to_array().into_iter().enumerate() {
            right[k / 4][slot][k % 4] = off as f32;
        }
    }
    element
}

/// The attributes at the corners of a triangle.
struct Rows<'a>([&'a [f32]; 3]);

impl<'a> Rows<'a> {
    #[inline]
    fn of(mesh: &'a Mesh, triangle: usize) -> Self {
        Self(mesh.triangles[triangle].map(|wedge| mesh.row(wedge)))
    }

    /// An attribute at a place of the triangle.
    #[inline]
    fn value(&self, b: DVec3, attribute: usize) -> f64 {
        let [x, y, z] = self.0.map(|row| f64::from(row[attribute]));
        x * b.x + y * b.y + z * b.z
    }

    #[inline]
    fn uv(&self, b: DVec3, set: usize) -> DVec2 {
        DVec2::new(self.value(b, 2 * set), self.value(b, 2 * set + 1))
    }

    /// Whether `uv` is nearer to that of a place than half a triangle: farther apart, they lie in two
    /// charts.
    #[inline]
    fn holds(&self, b: DVec3, uv: DVec2, set: usize) -> bool {
        let at = |row: &[f32]| DVec2::new(f64::from(row[2 * set]), f64::from(row[2 * set + 1]));
        let [x, y, z] = self.0.map(at);
        let sides = [x.distance_squared(y), y.distance_squared(z), z.distance_squared(x)];
        let longest = sides.into_iter().fold(0.0, f64::max);
        uv.distance_squared(self.uv(b, set)) <= 0.25 * longest
    }
}

/// Puts the UVs back of every triangle that would turn over.
fn unfold(level: &mut Mesh, before: &[f32], set: usize) {
    let (len, at) = (level.layout.len(), level.layout.uv(set));
    let old = |wedge: u32| {
        DVec2::new(
            f64::from(before[wedge as usize * len + at]),
            f64::from(before[wedge as usize * len + at + 1]),
        )
    };
    loop {
        let is_bad = |&t: &usize| {
            let wedges = level.triangles[t];
            let (was, is) = (wedges.map(|w| old(w.0)), wedges.map(|w| level.uv(w, set).as_dvec2()));
            was != is && folds(was, is)
        };
        let bad: Vec<usize> = (0..level.triangles.len()).into_par_iter().filter(is_bad).collect();
        if bad.is_empty() {
            return;
        }
        for triangle in bad {
            for wedge in level.triangles[triangle] {
                let row = wedge.index() * len + at;
                level.attributes[row..row + 2].copy_from_slice(&before[row..row + 2]);
            }
        }
    }
}
