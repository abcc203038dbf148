//! Positions fitted by point-to-plane distances both ways.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::pairs::{Pair, Sampled};
use super::system::{Element, Graph, Symmetric, System};
use crate::buckets::Buckets;
use crate::edges::{EdgeKind, visit_edges};
use crate::mesh::Mesh;
use crate::sample::Sample;
use crate::shape::{is_worse_sliver, turns};

const ITERATIONS: usize = 30;
const TOLERANCE: f64 = 1e-3;

/// A distance to a plane, felt by the corners of one triangle of the level.
struct Row {
    barycentrics: DVec3,
    normal: DVec3,
    /// How far the level is off along the normal.
    offset: f64,
}

/// A level as the descent left it.
pub(super) struct Descended<'a> {
    pub(super) positions: Vec<Vec3>,
    /// One per point, or empty.
    pub(super) locked: &'a [bool],
}

/// One round: pairs samples of both surfaces and moves the points of the level.
pub(super) fn fit(
    source: &Sampled<'_>,
    samples: &[Sample],
    level: &mut Mesh,
    descended: &Descended<'_>,
    damping: f64,
) {
    let sampled = Sampled::new(level);
    let there = source.pair(samples, &sampled, |_, _| true);
    let back = sampled.pair(&sampled.sample(samples.len()), source, |_, _| true);
    let rows = rows(&there, &back, source, &sampled);
    let graph = Graph::new(
        (0..level.triangles.len()).map(|t| level.triangle_points(t).map(|p| p.0)).collect(),
        level.positions.len(),
    );
    let triangles =
        there.iter().map(|p| p.foot.triangle.0).chain(back.iter().map(|p| p.sample.triangle.0));
    let by_triangle = Buckets::new(triangles, level.triangles.len());
    let (elements, right): (Vec<_>, Vec<_>) = (0..level.triangles.len())
        .into_par_iter()
        .map(|triangle| element(by_triangle.of(triangle).iter().map(|&row| &rows[row as usize])))
        .unzip();
    let damping = damping * rows.len() as f64 / level.positions.len() as f64;
    let system = System::new(&graph, &elements, damping);
    let free = free_points(level, descended.locked);
    let moves = system.solve(&graph.sum_corners(&right), &free, ITERATIONS, TOLERANCE);
    let moved =
        level.positions.iter().zip(&moves).map(|(p, by)| (p.as_dvec3() + *by).as_vec3()).collect();
    level.positions = keep_shape(level, &descended.positions, moved);
}

fn rows(there: &[Pair], back: &[Pair], source: &Sampled<'_>, level: &Sampled<'_>) -> Vec<Row> {
    let there = there.iter().map(|pair| {
        let normal = level.normals[pair.foot.triangle];
        Row { barycentrics: pair.foot.barycentrics, normal, offset: normal.dot(pair.offset) }
    });
    let back = back.iter().map(|pair| {
        let normal = source.normals[pair.foot.triangle];
        Row { barycentrics: pair.sample.barycentrics, normal, offset: -normal.dot(pair.offset) }
    });
    there.chain(back).collect()
}

/// The normal equations of the rows on one triangle.
fn element<'a>(rows: impl Iterator<Item = &'a Row>) -> (Element<Symmetric>, [DVec3; 3]) {
    let (mut element, mut right) = (Element::default(), [DVec3::ZERO; 3]);
    for row in rows {
        let b = row.barycentrics;
        for slot in 0..3 {
            element.corners[slot] += Symmetric::outer(row.normal, b[slot] * b[slot]);
            element.edges[slot] += Symmetric::outer(row.normal, b[slot] * b[(slot + 1) % 3]);
            right[slot] -= row.normal * (b[slot] * row.offset);
        }
    }
    (element, right)
}

/// All points but those of borders, of edges with more than two triangles, and `locked` ones.
fn free_points(mesh: &Mesh, locked: &[bool]) -> Vec<bool> {
    let mut free = vec![true; mesh.positions.len()];
    free.iter_mut().zip(locked).for_each(|(free, locked)| *free = !locked);
    visit_edges(mesh, |kind, sides| {
        if matches!(kind, EdgeKind::Border | EdgeKind::Complex) {
            sides[0].0.iter().for_each(|&point| free[point] = false);
        }
    });
    free
}

/// `moved` without the points of every triangle that would turn or become a sliver, as seen from
/// where the descent left it; those stay where the last round left them.
fn keep_shape(level: &Mesh, descended: &[Vec3], mut moved: Vec<Vec3>) -> Vec<Vec3> {
    loop {
        let is_bad = |&triangle: &usize| {
            let points = level.triangle_points(triangle);
            let at = |positions: &[Vec3]| points.map(|p| positions[p.index()].as_dvec3());
            let (first, before, after) = (at(descended), at(&level.positions), at(&moved));
            before != after && (turns(first, after) || is_worse_sliver(first, after))
        };
        let bad: Vec<usize> = (0..level.triangles.len()).into_par_iter().filter(is_bad).collect();
        if bad.is_empty() {
            return moved;
        }
        for triangle in bad {
            for point in level.triangle_points(triangle) {
                moved[point] = level.positions[point];
            }
        }
    }
}
