//! Attributes fitted to what the source has at the nearest points.

use glam::DVec2;
use rayon::prelude::*;

use super::pairs::{Pair, Source};
use super::sheet::SurfacePoint;
use super::system::{Element, Graph, System};
use crate::buckets::Buckets;
use crate::id::PointId;
use crate::mesh::Mesh;
use crate::shape::folds;

const ITERATIONS: usize = 30;
const TOLERANCE: f64 = 1e-3;

/// Fits every wedge's row, but for those of `locked` points, to what the source has at its
/// counterparts. Pairs of two groups or two charts do not count.
pub(super) fn fit(
    from: &Source<'_>,
    level: &mut Mesh,
    mut pairs: Vec<Pair>,
    locked: &[bool],
    damping: f64,
) {
    let (source, attributes) = (from.sheet.mesh, level.layout.len());
    if attributes == 0 {
        return;
    }
    pairs.retain(|pair| {
        source.groups[pair.source.triangle] == level.groups[pair.level.triangle]
            && in_same_chart(source, level, pair)
    });
    let graph = Graph::new(
        level.triangles.iter().map(|wedges| wedges.map(|w| w.0)).collect(),
        level.wedge_points.len(),
    );
    let by_triangle =
        Buckets::new(pairs.iter().map(|pair| pair.level.triangle.0), level.triangles.len());
    let triangles = 0..level.triangles.len();
    let elements: Vec<Element<f64>> = triangles
        .clone()
        .into_par_iter()
        .map(|t| element(by_triangle.of(t).iter().map(|&at| &pairs[at as usize]), from))
        .collect();
    let damping = damping * from.total_weight(&pairs) / level.wedge_points.len() as f64;
    let system = System::new(&graph, &elements, damping);
    let is_free = |point: &PointId| locked.get(point.index()) != Some(&true);
    let free: Vec<bool> = level.wedge_points.iter().map(is_free).collect();
    let steps: Vec<Vec<f64>> = (0..attributes)
        .map(|attribute| {
            let right: Vec<[f64; 3]> = triangles
                .clone()
                .into_par_iter()
                .map(|t| {
                    let mut right = [0.0; 3];
                    for pair in by_triangle.of(t).iter().map(|&at| &pairs[at as usize]) {
                        let off = value(source, &pair.source, attribute)
                            - value(level, &pair.level, attribute);
                        let b = pair.level.barycentrics() * from.weight(pair);
                        (0..3).for_each(|k| right[k] += b[k] * off);
                    }
                    right
                })
                .collect();
            system.solve(&graph.sum_corners(&right), &free, ITERATIONS, TOLERANCE)
        })
        .collect();
    let before = level.attributes.clone();
    for (wedge, row) in level.attributes.chunks_exact_mut(attributes).enumerate() {
        for (x, step) in row.iter_mut().zip(&steps) {
            *x = (f64::from(*x) + step[wedge]) as f32;
        }
    }
    (0..level.layout.uv_sets).for_each(|set| unfold(level, &before, set));
}

/// An attribute at a point of a mesh.
fn value(mesh: &Mesh, point: &SurfacePoint, attribute: usize) -> f64 {
    let (wedges, b) = (mesh.triangles[point.triangle], point.barycentrics());
    (0..3).map(|slot| f64::from(mesh.row(wedges[slot])[attribute]) * b[slot]).sum()
}

fn uv(mesh: &Mesh, point: &SurfacePoint, set: usize) -> DVec2 {
    let at = mesh.layout.uv(set);
    DVec2::new(value(mesh, point, at), value(mesh, point, at + 1))
}

/// Whether the UVs of a pair are nearer than half a triangle of the level: farther apart, they lie
/// in two charts.
fn in_same_chart(source: &Mesh, level: &Mesh, pair: &Pair) -> bool {
    (0..level.layout.uv_sets).all(|set| {
        let off = uv(source, &pair.source, set).distance(uv(level, &pair.level, set));
        let [a, b, c] = level.triangles[pair.level.triangle].map(|w| level.uv(w, set).as_dvec2());
        off <= 0.5 * a.distance(b).max(b.distance(c)).max(c.distance(a))
    })
}

fn element<'a>(pairs: impl Iterator<Item = &'a Pair>, source: &Source<'_>) -> Element<f64> {
    let mut element = Element::default();
    for pair in pairs {
        let (b, weight) = (pair.level.barycentrics(), source.weight(pair));
        for slot in 0..3 {
            element.corners[slot] += weight * b[slot] * b[slot];
            element.edges[slot] += weight * b[slot] * b[(slot + 1) % 3];
        }
    }
    element
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
