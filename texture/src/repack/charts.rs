//! Charts: connected triangles that can lie flat beside each other.
//!
//! Triangles are linked across an edge if both have it, are of one group and of one kind. Charts
//! grow along links, breadth first, and take a triangle in unless it overlaps one that they have;
//! what is left over grows into charts of its own.

use std::collections::VecDeque;
use std::ops::Range;

use glam::DVec2;
use rayon::prelude::*;

use super::UvMesh;
use super::faces::{Faces, Kind};
use super::overlap::Region;

/// Triangles of a group to be laid out in one piece.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chart {
    /// The kind of all its triangles but for lines.
    pub(super) kind: Kind,
    /// Its triangles in growing order, each one linked to one before it; after a cut merely some
    /// order.
    pub(super) triangles: Vec<u32>,
}

/// The triangles that are connected through edges.
struct Links {
    /// One per triangle and one more: its part of `others`.
    starts: Vec<u32>,
    others: Vec<u32>,
}

impl Links {
    fn new(mesh: &UvMesh<'_>, faces: &Faces<'_>) -> Self {
        let mut edges = Vec::with_capacity(3 * mesh.triangles.len());
        for (at, &group) in mesh.groups.iter().enumerate() {
            let (corners, kind) = (faces.corners(at), faces.kinds[at]);
            for i in 0..3 {
                let [a, b] = [corners[i], corners[(i + 1) % 3]];
                if a != b {
                    let unfolded = matches!(kind, Kind::Unfolded(_));
                    edges.push((unfolded, a.min(b), a.max(b), group, kind, at as u32));
                }
            }
        }
        edges.par_sort_unstable();
        // Only the next one of many at an edge, so that there are no more links than corners.
        let pairs: Vec<[u32; 2]> = edges
            .array_windows()
            .filter(|[x, y]| (x.0, x.1, x.2, x.3) == (y.0, y.1, y.2, y.3) && joins(x.4, y.4))
            .map(|[x, y]| [x.5, y.5])
            .collect();
        Self::from_pairs(mesh.triangles.len(), &pairs)
    }

    fn from_pairs(count: usize, pairs: &[[u32; 2]]) -> Self {
        let mut starts = vec![0u32; count + 1];
        for &one in pairs.as_flattened() {
            starts[one as usize] += 1;
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut others = vec![0; 2 * pairs.len()];
        for &[a, b] in pairs.iter().rev() {
            for (from, to) in [(a, b), (b, a)] {
                starts[from as usize] -= 1;
                others[starts[from as usize] as usize] = to;
            }
        }
        Self { starts, others }
    }

    fn of(&self, triangle: u32) -> &[u32] {
        let [start, end] = [triangle, triangle + 1].map(|at| self.starts[at as usize] as usize);
        &self.others[start..end]
    }
}

/// Whether neighbors of these kinds may share a chart.
fn joins(a: Kind, b: Kind) -> bool {
    let has_uvs = |kind| matches!(kind, Kind::Upright | Kind::Mirrored);
    a == b || a == Kind::Line && has_uvs(b) || b == Kind::Line && has_uvs(a)
}

/// The charts of a mesh, in the order of their first triangles; lines and spots last.
pub(super) fn grow_charts(mesh: &UvMesh<'_>, faces: &Faces<'_>) -> Vec<Chart> {
    let links = Links::new(mesh, faces);
    let connected = connect(faces, &links);
    // Where each triangle lies in its connected part.
    let mut places = vec![(0u32, 0u32); faces.kinds.len()];
    for (part, chart) in (0u32..).zip(&connected) {
        for (at, &triangle) in (0u32..).zip(&chart.triangles) {
            places[triangle as usize] = (part, at);
        }
    }
    (0u32..)
        .zip(connected)
        .collect::<Vec<_>>()
        .into_par_iter()
        .flat_map_iter(|(part, chart)| {
            let place = |triangle: u32| {
                let (other, at) = places[triangle as usize];
                (other == part).then_some(at as usize)
            };
            without_overlap(faces, &links, chart, place)
        })
        .collect()
}

/// Connected triangles, whether they overlap or not.
fn connect(faces: &Faces<'_>, links: &Links) -> Vec<Chart> {
    let is_dust = |kind| matches!(kind, Kind::Line | Kind::Spot);
    let mut seen = vec![false; faces.kinds.len()];
    let mut charts = Vec::new();
    for dust in [false, true] {
        for seed in 0..faces.kinds.len() {
            let kind = faces.kinds[seed];
            if seen[seed] || is_dust(kind) != dust {
                continue;
            }
            seen[seed] = true;
            let mut triangles = vec![seed as u32];
            let mut next = 0;
            while let Some(&triangle) = triangles.get(next) {
                next += 1;
                for &other in links.of(triangle) {
                    let fits = [kind, Kind::Line].contains(&faces.kinds[other as usize]);
                    if fits && !std::mem::replace(&mut seen[other as usize], true) {
                        triangles.push(other);
                    }
                }
            }
            charts.push(Chart { kind: if dust { Kind::Spot } else { kind }, triangles });
        }
    }
    charts
}

/// Cuts a connected chart until no triangles of one chart overlap. `place`: where a triangle lies
/// in the chart.
fn without_overlap(
    faces: &Faces<'_>,
    links: &Links,
    chart: Chart,
    place: impl Fn(u32) -> Option<usize>,
) -> Vec<Chart> {
    let count = chart.triangles.len();
    if count == 1 || chart.kind == Kind::Spot {
        return vec![chart];
    }
    let corners = |triangle: u32| faces.flat(chart.kind, triangle as usize);
    let mut region = Region::new(bounds(chart.triangles.iter().map(|&t| corners(t))), count);
    let mut taken = vec![false; count];
    let mut charts = Vec::new();
    // Lines are no seeds where another triangle can be one.
    let is_line = |triangle: u32| faces.kinds[triangle as usize] == Kind::Line;
    for lines in [false, true] {
        for seed in seeds(&chart.triangles, lines, is_line) {
            if taken[seed] {
                continue;
            }
            region.clear();
            let mut triangles = Vec::new();
            let mut front = VecDeque::from([chart.triangles[seed]]);
            while let Some(triangle) = front.pop_front() {
                let at = place(triangle).expect("only triangles of the chart are in the front");
                if taken[at] || !(is_line(triangle) || region.add(corners(triangle))) {
                    continue;
                }
                taken[at] = true;
                triangles.push(triangle);
                let free = |&other: &u32| place(other).is_some_and(|at| !taken[at]);
                front.extend(links.of(triangle).iter().copied().filter(free));
            }
            charts.push(Chart { kind: chart.kind, triangles });
        }
    }
    charts
}

/// The positions in `triangles` of lines, or of all others.
fn seeds(
    triangles: &[u32],
    lines: bool,
    is_line: impl Fn(u32) -> bool,
) -> impl Iterator<Item = usize> {
    let at: Range<usize> = 0..triangles.len();
    at.filter(move |&at| is_line(triangles[at]) == lines)
}

/// The least and the greatest coordinates.
pub(super) fn bounds(triangles: impl Iterator<Item = [DVec2; 3]>) -> [DVec2; 2] {
    let infinite = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    triangles.flatten().fold(infinite, |[low, high], p| [low.min(p), high.max(p)])
}
