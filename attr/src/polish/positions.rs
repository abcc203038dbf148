//! Positions fitted by point-to-plane distances both ways.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::Guards;
use super::pairs::{Pairs, Source};
use super::sheet::Sheet;
use super::system::{Element, Graph, Symmetric, System};
use super::volume::restore;
use crate::buckets::Buckets;
use crate::edges::{EdgeKind, visit_edges};
use crate::facing::Facing;
use crate::mesh::Mesh;
use crate::shape::{is_worse_sliver, turns};

const ITERATIONS: usize = 30;
const TOLERANCE: f64 = 1e-3;

/// A level as it was before the polish, and what stays through all rounds.
pub(super) struct Descended<'a> {
    positions: Vec<Vec3>,
    facing: &'a Facing,
    /// One per triangle: its shell, by the directions that it faces.
    shells: Vec<u32>,
    graph: Graph,
    /// Per point: whether it may move.
    free: Vec<bool>,
    rotation_cosine: f64,
    keep_volume: bool,
    max_move: f64,
}

impl<'a> Descended<'a> {
    pub(super) fn new(level: &Mesh, guards: &Guards<'a>) -> Self {
        let triangles = (0..level.triangles.len()).map(|t| level.triangle_points(t).map(|p| p.0));
        Self {
            positions: level.positions.clone(),
            facing: guards.facing,
            shells: (0..level.triangles.len())
                .map(|t| guards.facing.shell(guards.point_sources[level.triangle_points(t)[0]]))
                .collect(),
            graph: Graph::new(triangles.collect(), level.positions.len()),
            free: free_points(level, guards.locked),
            rotation_cosine: guards.rotation_cosine,
            keep_volume: guards.keep_volume,
            max_move: guards.max_move,
        }
    }
}

/// One round: where the points of the level come to lie, towards where `pairs` have them.
pub(super) fn fit(
    source: &Source<'_>,
    level: &Sheet<'_>,
    pairs: &Pairs,
    descended: &Descended<'_>,
    damping: f64,
) -> Vec<Vec3> {
    let mesh = level.mesh;
    let Descended { graph, free, .. } = descended;
    let by_triangle =
        Buckets::new(pairs.all.iter().map(|pair| pair.level.triangle.0), mesh.triangles.len());
    let (elements, right): (Vec<_>, Vec<_>) = (0..mesh.triangles.len())
        .into_par_iter()
        .map(|triangle| {
            let rows = by_triangle.of(triangle).iter().map(|&at| row(source, level, pairs, at));
            element(rows)
        })
        .unzip();
    let damping = damping * source.total_weight(&pairs.all) / mesh.positions.len() as f64;
    let system = System::new(graph, &elements, damping);
    drop(elements);
    let moves = system.solve(&graph.sum_corners(&right), free, ITERATIONS, TOLERANCE);
    let moved =
        mesh.positions.iter().zip(&moves).map(|(p, by)| (p.as_dvec3() + *by).as_vec3()).collect();
    let moved = keep_shape(mesh, descended, keep_near(mesh, descended, moved));
    if descended.keep_volume {
        keep_shape(mesh, descended, restore(mesh, moved, free))
    } else {
        moved
    }
}

/// A distance to a plane and how many times it counts, felt by the corners of one triangle of the level.
struct Row {
    barycentrics: DVec3,
    normal: DVec3,
    /// The distance of the level along the normal.
    offset: f64,
    weight: f64,
}

/// The distance of pair `at`, along the normal of the face that was found.
fn row(source: &Source<'_>, level: &Sheet<'_>, pairs: &Pairs, at: u32) -> Row {
    let pair = pairs.all[at as usize];
    let found_on_level = (at as usize) < pairs.there;
    let normal = if found_on_level {
        level.normals[pair.level.triangle]
    } else {
        source.sheet.normals[pair.source.triangle]
    };
    let off = level.place(&pair.level) - source.sheet.place(&pair.source);
    let (barycentrics, weight) = (pair.level.barycentrics(), source.weight(&pair));
    Row { barycentrics, normal, offset: normal.dot(off), weight }
}

/// The normal equations of the rows on one triangle.
fn element(rows: impl Iterator<Item = Row>) -> (Element<Symmetric>, [DVec3; 3]) {
    let (mut element, mut right) = (Element::default(), [DVec3::ZERO; 3]);
    for row in rows {
        let b = row.barycentrics;
        for slot in 0..3 {
            let weight = row.weight * b[slot];
            element.corners[slot] += Symmetric::outer(row.normal, weight * b[slot]);
            element.edges[slot] += Symmetric::outer(row.normal, weight * b[(slot + 1) % 3]);
            right[slot] -= row.normal * (weight * row.offset);
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

/// `moved` without the points that would come too far from where the descent left them; those stay where
/// the last round left them.
fn keep_near(level: &Mesh, descended: &Descended<'_>, mut moved: Vec<Vec3>) -> Vec<Vec3> {
    for (point, p) in moved.iter_mut().enumerate() {
        if f64::from(p.distance(descended.positions[point])) > descended.max_move {
            *p = level.positions[point];
        }
    }
    moved
}

/// `moved` without the points of every triangle that would turn, its back too, or become a sliver, as seen from
/// where the descent left it; those stay where the last round left them.
fn keep_shape(level: &Mesh, descended: &Descended<'_>, mut moved: Vec<Vec3>) -> Vec<Vec3> {
    loop {
        let is_bad = |&triangle: &usize| {
            let points = level.triangle_points(triangle);
            let at = |positions: &[Vec3]| points.map(|p| positions[p.index()].as_dvec3());
            let (first, before, after) =
                (at(&descended.positions), at(&level.positions), at(&moved));
            let turns = |before, after| turns(before, after, descended.rotation_cosine);
            let shell = descended.shells[triangle];
            before != after
                && (turns(first, after)
                    || is_worse_sliver(first, after)
                    || descended.facing.turns_back(shell, first, after))
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
