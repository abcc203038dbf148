//! Positions fitted by point-to-plane distances both ways.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::Guards;
use super::edges::SheetEdge;
use super::fans::Fans;
use super::pairs::{Pairs, Source};
use super::seams::{Pull, seams};
use super::sheet::Sheet;
use super::system::{Element, Graph, Symmetric, System};
use super::volume::restore;
use crate::buckets::Buckets;
use crate::edges::{EdgeKind, visit_edges};
use crate::facing::Facing;
use crate::id::TriangleId;
use crate::mesh::Mesh;
use crate::shape::{is_worse_sliver, turns};

const ITERATIONS: usize = 30;
const TOLERANCE: f64 = 1e-2;
/// Triangles that one thread sums up at least.
const AT_ONCE: usize = 256;

/// A level as it was before the polish, and what stays through all rounds.
pub(super) struct Descended<'a> {
    positions: Vec<Vec3>,
    facing: &'a Facing,
    /// One per triangle: its shell, by the directions that it faces.
    shells: Vec<u32>,
    /// The edges that are to lie on seams of the source.
    seams: Vec<SheetEdge>,
    graph: Graph,
    /// Per point: whether it may move.
    free: Vec<bool>,
    rotation_cosine: f64,
    keep_volume: bool,
    max_move: f64,
}

impl<'a> Descended<'a> {
    pub(super) fn new(
        level: &Mesh,
        fans: Arc<Fans>,
        edges: &[SheetEdge],
        guards: &Guards<'a>,
    ) -> Self {
        Self {
            positions: level.positions.clone(),
            facing: guards.facing,
            shells: (0..level.triangles.len())
                .map(|t| guards.facing.shell(guards.point_sources[level.triangle_points(t)[0]]))
                .collect(),
            seams: seams(edges),
            graph: Graph::new(fans),
            free: free_points(level, guards.locked),
            rotation_cosine: guards.rotation_cosine,
            keep_volume: guards.keep_volume,
            max_move: guards.max_move,
        }
    }
}

/// One round: where the points of the level come to lie, towards where `pairs` and the source's seams have
/// them.
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
    let (mut elements, mut right): (Vec<_>, Vec<_>) = (0..mesh.triangles.len())
        .into_par_iter()
        .with_min_len(AT_ONCE)
        .map(|triangle| equations(source, level, pairs, triangle, by_triangle.of(triangle)))
        .unzip();
    let samples = source.total_weight(&pairs.all[..pairs.there]);
    let density = samples / mesh.triangles.len() as f64;
    for pull in source.pulls(level, &descended.seams, density) {
        let at = pull.at.triangle.index();
        add_pull(&pull, &mut elements[at], &mut right[at]);
    }
    let damping = damping * source.total_weight(&pairs.all) / mesh.positions.len() as f64;
    let system = System::new(graph, &elements, damping);
    drop(elements);
    let right = graph.sum_corners(|corner| right.as_flattened()[corner].as_dvec3());
    let moves = system.solve(&right, free, ITERATIONS, TOLERANCE);
    let moved =
        mesh.positions.iter().zip(&moves).map(|(p, by)| (p.as_dvec3() + *by).as_vec3()).collect();
    let moved = keep_shape(mesh, descended, keep_near(mesh, descended, moved));
    if descended.keep_volume {
        keep_shape(mesh, descended, restore(mesh, moved, free))
    } else {
        moved
    }
}

/// The normal equations of the pairs on one triangle. A pair found on the level has the normal of this
/// triangle, so that of those only the products of barycentrics are summed; any other has the normal of
/// its triangle of the source. Either plane is as far away as any of its points, such as a corner.
fn equations(
    source: &Source<'_>,
    level: &Sheet<'_>,
    pairs: &Pairs,
    triangle: usize,
    own: &[u32],
) -> (Element<Symmetric>, [Vec3; 3]) {
    let (mut element, mut right) = (Element::default(), [DVec3::ZERO; 3]);
    let (mut products, mut offsets) = (Element::<f64>::default(), DVec3::ZERO);
    let corners = level.corners(TriangleId::new(triangle));
    let normal = level.normal(TriangleId::new(triangle));
    for &at in own {
        let pair = &pairs.all[at as usize];
        let (b, weight) = (pair.level.barycentrics(), source.weight(pair));
        if (at as usize) < pairs.there {
            products.add(b, weight);
            let offset = normal.dot(corners[0] - source.sheet.place(&pair.source));
            offsets += b * (weight * offset);
        } else {
            let from = source.sheet.corners(pair.source.triangle)[0];
            let place = corners[0] * b.x + corners[1] * b.y + corners[2] * b.z;
            let normal = source.sheet.normal(pair.source.triangle);
            let mut one = Element::default();
            one.add(b, weight);
            add_outer(&mut element, normal, &one);
            let offset = weight * normal.dot(place - from);
            (0..3).for_each(|slot| right[slot] -= normal * (b[slot] * offset));
        }
    }
    add_outer(&mut element, normal, &products);
    (0..3).for_each(|slot| right[slot] -= normal * offsets[slot]);
    (element, right.map(DVec3::as_vec3))
}

/// Adds the normal equations of a point of a seam.
fn add_pull(pull: &Pull, element: &mut Element<Symmetric>, right: &mut [Vec3; 3]) {
    let b = pull.at.barycentrics();
    let mut products = Element::default();
    products.add(b, pull.weight);
    add_outer(element, pull.across, &products);
    for (slot, right) in right.iter_mut().enumerate() {
        *right -= (pull.across * (b[slot] * pull.weight * pull.off)).as_vec3();
    }
}

/// Adds products of barycentrics, each times n nᵀ.
#[inline]
fn add_outer(element: &mut Element<Symmetric>, normal: DVec3, products: &Element<f64>) {
    for slot in 0..3 {
        element.corners[slot] += Symmetric::outer(normal, products.corners[slot]);
        element.edges[slot] += Symmetric::outer(normal, products.edges[slot]);
    }
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
