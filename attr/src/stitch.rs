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
mod tests;
