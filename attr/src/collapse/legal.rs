//! The legal placements of a merged point, and their cost beside the quadrics.
//!
//! | a collapse is illegal if it | rule |
//! |---|---|
//! | lets two outlines meet but along an outline | `crosses_surface` |
//! | pinches the surface (Dey et al., "Topology preserving edge contraction", 1999) | `breaks_link` |
//! | lays a triangle on another | `doubles_triangle` |
//! | rotates a triangle by more than the options allow | [`turns`] |
//! | turns a triangle's back on a direction that its shell faces | `turns_back` |
//! | makes a sliver of a triangle, with next to nothing of its quality left | [`is_worse_sliver`] |
//! | changes the sign of a triangle's area in a UV set | [`folds`] |
//!
//! The first three are about the topology, the others about the place as well. Two changes of topology
//! are allowed: a hole of three edges may close, and points without an edge between them may meet,
//! where borders that lead to a common neighbor become one edge.

use glam::{DVec2, DVec3};

use super::{Candidate, Plan};
use crate::id::PointId;
use crate::metric::Metric;
use crate::settings::Cost;
use crate::shape::{folds, is_worse_sliver, turns};
use crate::topology::{Topology, on_outline};
use crate::triangle::FromCorner;

/// The cost of an end that comes off the surface, beside its quadric.
///
/// A quadric is about planes, and planes have no end: the tip of a string slides along its sides at
/// no cost. Lab note (`cargo bench --bench quality -- --alone --full --views 6 --resolution 256 --samples
/// 30000`): RMS sRGB luminance, RMS distance and RMS color over those without, geometric mean over
/// four levels each of a scanned box, a pan, a gelatin box, a racquet, a helmet and a ship:
///
/// | | luminance | distance | color |
/// |---|---|---|---|
/// | 1 | 0.988 | 0.942 | 0.99 |
/// | **2** | 0.979 | 0.914 | 0.95 |
/// | 4 | 0.993 | 0.904 | 0.99 |
/// | 2, for the place that is best without it | 0.981 | 0.929 | 0.95 |
const EXPOSURE: f64 = 2.0;

impl Plan {
    /// The cheapest place, legal or not, with what it exposes in its cost; `None` if nothing would
    /// be left around it.
    pub(crate) fn cheapest(&mut self, metric: &Metric) -> Option<Candidate> {
        if self.surviving.is_empty() { None } else { self.search(metric, |_, _| true) }
    }

    /// The cheapest legal place that `allows` approves, with what it exposes in its cost: `cheapest` if
    /// that is legal. The last place that `allows` is asked about and approves is the one. The topology must
    /// allow the collapse.
    pub(crate) fn best(
        &mut self,
        topology: &Topology,
        metric: &Metric,
        cheapest: Candidate,
        mut allows: impl FnMut(&Self, DVec3) -> bool,
    ) -> Option<Candidate> {
        let mut is_legal = |plan: &mut Self, position| {
            plan.keeps_shape(topology, metric, position) && allows(plan, position)
        };
        if is_legal(self, cheapest.position) {
            return Some(cheapest);
        }
        self.search(metric, is_legal)
    }

    fn search(
        &mut self,
        metric: &Metric,
        mut is_legal: impl FnMut(&mut Self, DVec3) -> bool,
    ) -> Option<Candidate> {
        let mut best: Option<Candidate> = None;
        for position in self.places(metric).into_iter().flatten() {
            let cost = self.total.evaluate(position);
            if best.is_some_and(|best| best.cost <= cost) {
                continue;
            }
            let exposure = if metric.space.cost == Cost::Classic { 0.0 } else { EXPOSURE };
            let cost = cost + exposure * self.exposure(metric, position);
            if best.is_none_or(|best| cost < best.cost) && is_legal(self, position) {
                best = Some(Candidate { cost, position });
            }
        }
        best
    }

    /// The squared distances of the ends to the triangles around `position`, times the area that
    /// each end stands for, summed.
    fn exposure(&self, metric: &Metric, position: DVec3) -> f64 {
        let mut sum = 0.0;
        // Each triangle is looked at once for two ends.
        for (pair, areas) in self.points.chunks(2).zip(self.areas.chunks(2)) {
            let ends = [pair[0], pair[pair.len() - 1]].map(|end| metric.positions[end] - position);
            let mut squares = ends.map(DVec3::length_squared);
            for [a, b] in &self.star {
                let triangle = FromCorner::new(*a - position, *b - position);
                for (square, end) in squares.iter_mut().zip(ends) {
                    *square = square.min(triangle.square_to(end));
                }
            }
            sum += areas.iter().zip(squares).map(|(area, square)| area * square).sum::<f64>();
        }
        sum
    }

    /// Whether the surface stays a surface, by the rules of the topology.
    pub(crate) fn keeps_topology(&mut self, topology: &Topology) -> bool {
        for side in 0..2 {
            let point = self.points[side];
            topology.neighbors(point, &mut self.counts[side], &mut self.near[side]);
        }
        !(self.crosses_surface() || self.breaks_link(topology) || self.doubles_triangle(topology))
    }

    /// The triangles at the edge between the two points, if there is one.
    fn triangles_at_edge(&self) -> Option<u32> {
        self.counts[0].get(self.points[1].index())
    }

    /// The triangles at the edges between another point and each of the two, if it has both edges.
    fn triangles_at_both(&self, point: PointId) -> Option<[u32; 2]> {
        Some([self.counts[0].get(point.index())?, self.counts[1].get(point.index())?])
    }

    /// Whether both points are on an outline, and their edge is not.
    fn crosses_surface(&self) -> bool {
        let on_outline = |side: usize| on_outline(&self.counts[side], &self.near[side]);
        self.triangles_at_edge() == Some(2) && on_outline(0) && on_outline(1)
    }

    /// Whether the points have a neighbor in common that is not opposite their edge, over any number of
    /// triangles an edge. One whose both edges are borders may be such a bridge at the side of the edge that
    /// lacks a triangle.
    fn breaks_link(&self, topology: &Topology) -> bool {
        let gone = self.points[1];
        let opposite = |point: PointId| {
            self.collapsing.iter().any(|&triangle| topology.slot_of(triangle, point).is_some())
        };
        let others = self.near[1].iter().filter(|&&point| point != gone && !opposite(point));
        let mut bridges = others.filter_map(|&point| self.triangles_at_both(point)).zip(1..);
        let most = match self.triangles_at_edge() {
            None => 2,
            Some(1) => 1,
            Some(_) => 0,
        };
        bridges.any(|(triangles, count)| count > most || triangles != [1, 1])
    }

    /// Whether a triangle at one point gets the corners of one at the other.
    fn doubles_triangle(&self, topology: &Topology) -> bool {
        let [kept, gone] = [self.points[0], self.points[1]];
        self.surviving.iter().any(|&corner| {
            let [a, b] = topology.others(corner);
            topology.slot_of(corner.triangle(), gone).is_some()
                && self.triangles_at_both(a).is_some()
                && self.triangles_at_both(b).is_some()
                && topology.corners(kept).any(|corner| {
                    let others = topology.others(corner);
                    others == [a, b] || others == [b, a]
                })
        })
    }

    /// Whether every surviving triangle keeps its shape at `position`, by the other rules.
    pub(crate) fn keeps_shape(
        &mut self,
        topology: &Topology,
        metric: &Metric,
        position: DVec3,
    ) -> bool {
        let layout = metric.space.layout;
        self.place_attributes(metric, position);
        self.surviving.iter().all(|&corner| {
            let triangle = corner.triangle();
            let before = topology.points(triangle).map(|point| metric.positions[point]);
            let mut after = before;
            after[corner.slot()] = position;
            if turns(before, after, metric.space.rotation_cosine)
                || is_worse_sliver(before, after)
                || metric.turns_back(self.points[0], before, after)
            {
                return false;
            }
            let wedges = topology.wedges(triangle);
            (0..layout.uv_sets).all(|set| {
                let uv = |row: &[f64]| DVec2::from_slice(&row[layout.uv(set)..]);
                let before = wedges.map(|wedge| uv(metric.row(wedge)));
                let mut after = before;
                after[corner.slot()] = uv(self.placed_row(metric, topology.wedge(corner)));
                !folds(before, after)
            })
        })
    }
}
