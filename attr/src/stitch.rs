//! Borders that are meant to be one: seams whose two sides a rounding has moved apart, and parts that were
//! rounded on grids of their own.
//!
//! They are found by their edges, not by the distance of points alone. Two border edges are one if
//!
//! - they run between the same places in opposite senses, as the edges of two triangles do that go on into
//!   each other, within what roundings and grids explain;
//! - no other edge does so as well: of several layers none can be told to go on in another;
//! - they are far longer than that distance, so that it can be told from the shape;
//! - their triangles do not lie back to back: front and back of a thin plate are two sheets.

use glam::DVec3;
use rustc_hash::FxHashMap;

use crate::edges::{EdgeKind, visit_edges};
use crate::id::{PointId, WedgeId};
use crate::mesh::Mesh;
use crate::sets::DisjointSets;
use crate::vertices::Precision;

/// Steps of a float, at the largest coordinate, that a position may be off by rounding. In floats the sine of
/// a whole turn is off by 1.5 of them.
const ROUNDING_STEPS: f64 = 2.0;

/// How many times longer than the distance across a seam its edges are at least.
const MIN_EDGE: f64 = 4.0;

/// More edges than this around one place are a crowd, in which none is told from the others.
const MAX_CROWD: usize = 64;

/// Triangles lie back to back if they enclose an angle of less than 30°.
const BACK_TO_BACK: f64 = 0.866;

/// A border edge in the space that it is compared in.
#[derive(Clone, Copy, Debug)]
pub struct BorderEdge {
    /// Its ends in its mesh, as its triangle runs along it.
    pub points: [PointId; 2],
    /// The places of its ends.
    pub ends: [DVec3; 2],
    /// The place of its triangle's third corner.
    pub third: DVec3,
    /// How far its ends may be off by rounding.
    pub rounding: f64,
    /// The grid that they lie on, and how far they may be off by it.
    pub precision: Precision,
    /// Edges of one set are never one with another, but for the set of 0.
    pub apart: u32,
}

impl BorderEdge {
    /// The distance that positions with coordinates up to this may be off by rounding.
    pub fn rounding_of(largest: f64) -> f64 {
        ROUNDING_STEPS * f64::from(f32::EPSILON) * largest
    }

    /// The unit vector into its triangle, at right angles to it; zero without area.
    fn inward(&self) -> DVec3 {
        let [from, to] = self.ends;
        let (along, across) = ((to - from).normalize_or_zero(), self.third - from);
        (across - along * along.dot(across)).normalize_or_zero()
    }

    fn middle(&self) -> DVec3 {
        (self.ends[0] + self.ends[1]) / 2.0
    }

    /// How far its ends may be from those of another that it is one with.
    fn tolerance(&self, other: &Self, reach: Reach) -> f64 {
        let rounding = self.rounding + other.rounding;
        if reach == Reach::Rounding || self.precision.grid == other.precision.grid {
            rounding
        } else {
            rounding + self.precision.slack + other.precision.slack
        }
    }

    fn is_one_with(&self, other: &Self, reach: Reach) -> bool {
        let ([a, b], [c, d]) = (self.ends, other.ends);
        let most = self.tolerance(other, reach);
        let is_near = a.distance(d) <= most && b.distance(c) <= most;
        is_near
            && a.distance(b).min(c.distance(d)) >= MIN_EDGE * most
            && self.inward().dot(other.inward()) <= BACK_TO_BACK
            && (self.apart == 0 || self.apart != other.apart)
    }
}

/// The reasons for a distance that are taken into account.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Reach {
    Rounding,
    Grid,
}

/// The pairs of edges that are meant to be one, by their places in the list.
pub fn stitched_edges(edges: &[BorderEdge]) -> Vec<[usize; 2]> {
    let mut pairs = Vec::new();
    let mut left: Vec<usize> = (0..edges.len()).collect();
    for reach in [Reach::Rounding, Reach::Grid] {
        let found = unique_pairs(edges, &left, reach);
        let mut is_paired = vec![false; edges.len()];
        found.iter().flatten().for_each(|&edge| is_paired[edge] = true);
        left.retain(|&edge| !is_paired[edge]);
        pairs.extend(found);
    }
    pairs
}

/// The pairs of which either edge is one with the other alone.
fn unique_pairs(edges: &[BorderEdge], left: &[usize], reach: Reach) -> Vec<[usize; 2]> {
    let off = |edge: &BorderEdge| {
        let slack = if reach == Reach::Grid { edge.precision.slack } else { 0.0 };
        edge.rounding + slack
    };
    let most = left.iter().map(|&edge| off(&edges[edge])).fold(0.0, f64::max);
    let cell = 4.0 * most;
    if !(cell > 0.0 && cell.is_finite()) {
        return Vec::new();
    }
    let place = |at: DVec3| (at / cell).floor().to_array().map(|x| x as i64);
    let mut cells: FxHashMap<[i64; 3], Vec<usize>> = FxHashMap::default();
    for &edge in left {
        cells.entry(place(edges[edge].middle())).or_default().push(edge);
    }
    // Middles are at most half a cell apart, so the other is in one of eight cells.
    let partner = |&edge: &usize| -> Option<usize> {
        let (own, half) = (&edges[edge], DVec3::splat(cell / 2.0));
        let [low, high] = [place(own.middle() - half), place(own.middle() + half)];
        let mut found = None;
        for corner in 0..8usize {
            let key = [0, 1, 2].map(|axis| [low, high][(corner >> axis) & 1][axis]);
            let near = cells.get(&key).map_or(&[][..], Vec::as_slice);
            if near.len() > MAX_CROWD {
                return None;
            }
            for &other in near {
                if other != edge && own.is_one_with(&edges[other], reach) {
                    if found.is_some_and(|found| found != other) {
                        return None;
                    }
                    found = Some(other);
                }
            }
        }
        found
    };
    let partners: FxHashMap<usize, usize> =
        left.iter().filter_map(|edge| Some((*edge, partner(edge)?))).collect();
    let is_mutual = |edge: &usize, other: &usize| partners.get(other) == Some(edge);
    let pair = |edge: &usize| {
        let other = partners.get(edge)?;
        (edge < other && is_mutual(edge, other)).then_some([*edge, *other])
    };
    left.iter().filter_map(pair).collect()
}

/// The border edges of a mesh where they lie in it. `precision` has one entry per group, or none.
pub fn placed_borders(mesh: &Mesh, precision: &[Precision]) -> Vec<BorderEdge> {
    let largest = mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
    let rounding = BorderEdge::rounding_of(f64::from(largest));
    let mut borders = Vec::new();
    visit_edges(mesh, |kind, sides| {
        let (EdgeKind::Border, &[(lesser_first, triangle)]) = (kind, sides) else { return };
        let own = mesh.triangle_points(triangle);
        for slot in 0..3 {
            let points = [own[slot], own[(slot + 1) % 3]];
            if [points[0].min(points[1]), points[0].max(points[1])] == lesser_first {
                let at = |point: PointId| mesh.positions[point].as_dvec3();
                let (ends, third) = (points.map(at), at(own[(slot + 2) % 3]));
                let group = mesh.groups[triangle] as usize;
                let precision = precision.get(group).copied().unwrap_or_default();
                borders.push(BorderEdge { points, ends, third, rounding, precision, apart: 0 });
            }
        }
    });
    borders
}

/// Makes one point of those that are meant to be one, at the place of the first. `motion` is the class of a
/// point: points of different ones move apart. Returns the wedges that had another position.
pub(crate) fn stitch(
    mesh: &mut Mesh,
    precision: &[Precision],
    motion: impl Fn(PointId) -> u32,
) -> Vec<OwnPosition> {
    let edges = placed_borders(mesh, precision);
    let mut sets = DisjointSets::new(mesh.positions.len());
    let mut is_any = false;
    for [a, b] in stitched_edges(&edges) {
        let ([from, to], [start, end]) = (edges[a].points, edges[b].points);
        if motion(from) == motion(end) && motion(to) == motion(start) {
            sets.join(from.0, end.0);
            sets.join(to.0, start.0);
            is_any = true;
        }
    }
    if is_any { merge(mesh, &mut sets) } else { Vec::new() }
}

/// The position of a wedge whose point got another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnPosition {
    /// The wedge.
    pub wedge: WedgeId,
    /// The position that its vertices have.
    pub position: glam::Vec3,
}

/// Gives the points of each set the position and place of the first of them, unless a triangle has two
/// corners in it.
fn merge(mesh: &mut Mesh, sets: &mut DisjointSets) -> Vec<OwnPosition> {
    let roots: Vec<u32> = (0..mesh.positions.len() as u32).map(|point| sets.root(point)).collect();
    let mut is_whole = vec![true; roots.len()];
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.triangle_points(triangle).map(|point| roots[point.index()]);
        for root in [(a == b || a == c).then_some(a), (b == c).then_some(b)].into_iter().flatten() {
            is_whole[root as usize] = false;
        }
    }
    let mut first: Vec<Option<PointId>> = vec![None; roots.len()];
    let mut positions = Vec::with_capacity(roots.len());
    let mut places: Vec<PointId> = Vec::with_capacity(roots.len());
    for (point, &root) in roots.iter().enumerate() {
        let next = PointId::new(positions.len());
        let place = match is_whole[root as usize] {
            true => *first[root as usize].get_or_insert(next),
            false => next,
        };
        if place == next {
            positions.push(mesh.positions[PointId::new(point)]);
        }
        places.push(place);
    }
    let mut own_positions = Vec::new();
    for (wedge, point) in mesh.wedge_points.iter_mut().enumerate() {
        let (position, place) = (mesh.positions[*point], places[point.index()]);
        if position != positions[place.index()] {
            own_positions.push(OwnPosition { wedge: WedgeId::new(wedge), position });
        }
        *point = place;
    }
    mesh.positions = positions;
    own_positions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edges::Census;
    use crate::mesh::Layout;
    use crate::vertices::Vertices;
    use crate::weld::{Welded, weld};
    use glam::Vec3;
    use std::f64::consts::TAU;

    /// A grid of columns × rows squares bent to `shape` over 0…1 × 0…1, its last column and row computed.
    fn sheet([columns, rows]: [u32; 2], shape: impl Fn(f64, f64) -> DVec3) -> Vertices {
        let mut vertices = Vertices {
            layout: Layout { uv_sets: 1, normal: false, color: 0 },
            ..Vertices::default()
        };
        for row in 0..=rows {
            for column in 0..=columns {
                let [u, v] =
                    [(column, columns), (row, rows)].map(|(at, n)| f64::from(at) / f64::from(n));
                vertices.positions.push(shape(u, v).as_vec3());
                vertices.attributes.extend([u as f32, v as f32]);
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let a = row * (columns + 1) + column;
                let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
                vertices.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        vertices.groups = vec![0; vertices.triangles.len()];
        vertices
    }

    /// Both as one, the second in a group of its own.
    fn both(mut a: Vertices, b: &Vertices) -> Vertices {
        let (first, group) = (a.positions.len() as u32, a.groups.iter().max().map_or(0, |g| g + 1));
        a.positions.extend(&b.positions);
        a.attributes.extend(&b.attributes);
        a.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + first)));
        a.groups.extend(b.groups.iter().map(|_| group));
        a
    }

    fn census(vertices: &Vertices) -> Census {
        Census::new(&weld(vertices).unwrap().mesh)
    }

    fn torus() -> Vertices {
        sheet([40, 16], |u, v| {
            let [(sin, cos), (up, out)] = [u, v].map(|turn| (turn * TAU).sin_cos());
            DVec3::new((1.0 + 0.4 * out) * cos, (1.0 + 0.4 * out) * sin, 0.4 * up)
        })
    }

    #[test]
    fn a_torus_whose_seams_are_roundings_apart_is_closed_and_its_vertices_stay() {
        let torus = torus();
        let Welded { mesh, wedge_vertices, own_positions, .. } = &weld(&torus).unwrap();
        assert_eq!((Census::new(mesh).borders, Census::new(mesh).complex), (0, 0));
        assert_eq!(mesh.positions.len(), 40 * 16);
        assert!(!own_positions.is_empty());
        let welded = weld(&torus).unwrap();
        for (wedge, &vertex) in wedge_vertices.iter().enumerate() {
            let position = welded.vertex_position(WedgeId::new(wedge));
            assert_eq!(position, torus.positions[vertex as usize]);
        }
    }

    #[test]
    fn poles_that_every_triangle_has_of_its_own_are_one_point() {
        let ball = sheet([24, 12], |u, v| {
            let ((sin, cos), (ring, up)) = ((u * TAU).sin_cos(), (v * TAU / 2.0).sin_cos());
            DVec3::new(ring * cos, ring * sin, up)
        });
        let mut ball = ball;
        let positions = ball.positions.clone();
        let is_thin = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            (b - a).cross(c - a).length() < 1e-6
        };
        ball.triangles.retain(|t| !is_thin(t));
        ball.groups = vec![0; ball.triangles.len()];
        assert_eq!(census(&ball).borders, 0);
    }

    /// The halves of a ball, each rounded to `steps` over its own longest side.
    fn halves(steps: f64, precision: bool) -> Vertices {
        let half = |from: f64| {
            let mut half = sheet([24, 24], |u, v| {
                let (turn, tilt) = ((from + u / 2.0) * TAU, (0.02 + 0.96 * v) * TAU / 2.0);
                DVec3::new(tilt.sin() * turn.cos(), tilt.sin() * turn.sin(), tilt.cos())
            });
            let (low, high) = half
                .positions
                .iter()
                .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), &p| (l.min(p), h.max(p)));
            let step = f64::from((high - low).max_element()) / steps;
            for p in &mut half.positions {
                let places = ((*p - low).as_dvec3() / step).round();
                *p = (low.as_dvec3() + places * step).as_vec3();
            }
            (half, step)
        };
        let ((a, step), (b, _)) = (half(0.1), half(0.6));
        let mut ball = both(a, &b);
        if precision {
            let slack = step * 0.75f64.sqrt();
            ball.precision = [1, 2].map(|grid| Precision { grid, slack }).to_vec();
        }
        ball
    }

    #[test]
    fn halves_on_grids_of_their_own_meet_only_if_that_is_told() {
        // What is left open are the rings around the poles.
        for steps in [1023.0, 16383.0] {
            assert_eq!(census(&halves(steps, true)).borders, 2 * 48);
            assert!(census(&halves(steps, false)).borders > 2 * 48 + 2 * 30);
        }
    }

    #[test]
    fn a_plate_of_two_sheets_and_layers_stay_apart() {
        let flat = |z: f64| sheet([8, 8], move |u, v| DVec3::new(u, v, z + 0.05 * (3.0 * u).sin()));
        let flipped = |z: f64| {
            let mut own = flat(z);
            own.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            own
        };
        for thickness in [0.0, 1e-7, 1e-6] {
            let plate = both(flat(0.0), &flipped(thickness));
            assert_eq!(census(&plate).borders, 64, "{thickness}");
        }
        assert_eq!(census(&both(flat(0.0), &flat(1e-7))).borders, 64);
        // Two layers of two tiles each, all edges along the cut a rounding apart: which goes on in which?
        let tile = |x: f64, z: f64| sheet([8, 8], move |u, v| DVec3::new(x + u, v, z));
        let layer = |z: f64| both(tile(0.0, z), &tile(1.0, z + 6e-8));
        assert_eq!(census(&layer(0.0)).borders, 48);
        assert_eq!(census(&both(layer(0.0), &layer(1.2e-7))).borders, 128);
    }

    #[test]
    fn lips_that_move_apart_stay_apart() {
        let mut lips = both(
            sheet([8, 4], |u, v| DVec3::new(u, v, 0.0)),
            &sheet([8, 4], |u, v| DVec3::new(u, v - 1.0 + 6e-8, 0.0)),
        );
        assert_eq!(census(&lips).shells, 1);
        lips.motion = (0..lips.positions.len()).map(|v| u32::from(v >= 45)).collect();
        assert_eq!(census(&lips).shells, 2);
    }

    #[test]
    fn a_crowd_of_layers_takes_no_time() {
        let card = |k: u32| {
            let off = DVec3::new(0.0, 0.0, 1e-12 * f64::from(k));
            sheet([1, 1], move |u, v| DVec3::new(u, v, 1e-3) + off)
        };
        let mut cards = card(0);
        for k in 1..4000 {
            let (own, first) = (card(k), cards.positions.len() as u32);
            cards.positions.extend(own.positions.iter().map(|p| *p + Vec3::Z * 1e-10 * k as f32));
            cards.attributes.extend(own.attributes);
            cards.triangles.extend(own.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        cards.groups = vec![0; cards.triangles.len()];
        let start = std::time::Instant::now();
        assert!(weld(&cards).is_ok());
        assert!(start.elapsed().as_secs() < 5);
    }

    #[test]
    fn a_strip_narrower_than_a_rounding_keeps_its_triangles() {
        let strip = sheet([4, 1], |u, v| DVec3::new(u, 1e-7 * v, 0.0));
        let welded = weld(&strip).unwrap();
        assert_eq!((welded.mesh.triangles.len(), welded.mesh.positions.len()), (8, 10));
    }
}
