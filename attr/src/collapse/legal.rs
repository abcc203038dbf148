//! The legal placements of a merged point, and their cost beside the quadrics.

use glam::{DVec2, DVec3};

use super::{Candidate, Plan};
use crate::id::PointId;
use crate::metric::Metric;
use crate::shape::{folds, is_worse_sliver, turns};
use crate::topology::{Topology, on_outline};
use crate::triangle::square_to_origin;

/// The cost of an end that comes off the surface, beside its quadric.
///
/// A quadric is about planes, and planes have no end: the tip of a string slides along its sides at
/// no cost. Lab note (`cargo bench --bench quality -- --alone --views 6 --resolution 256 --samples
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
            let cost = cost + EXPOSURE * self.exposure(metric, position);
            if best.is_none_or(|best| cost < best.cost) && is_legal(self, position) {
                best = Some(Candidate { cost, position });
            }
        }
        best
    }

    /// The squared distances of the ends to the triangles around `position`, times the area that
    /// each end stands for, summed.
    fn exposure(&self, metric: &Metric, position: DVec3) -> f64 {
        let off = |end: DVec3| {
            let tip = position - end;
            let squares =
                self.star.iter().map(|[a, b]| square_to_origin([tip, *a - end, *b - end]));
            squares.fold(f64::INFINITY, f64::min)
        };
        let ends = self.points.iter().map(|&point| metric.positions[point]);
        ends.zip(&self.areas).map(|(end, area)| area * off(end)).sum()
    }

    /// Whether the surface stays a surface: the link condition (Dey et al., "Topology preserving
    /// edge contraction", 1999) over any number of triangles an edge, two outline points meet only
    /// along an outline, and no triangle comes to lie on another. Two changes of topology are allowed: a
    /// hole of three edges may close, and points without an edge between them may meet, where borders
    /// that lead to a common neighbor become one edge.
    pub(crate) fn keeps_topology(&mut self, topology: &Topology) -> bool {
        let [kept, gone] = [self.points[0], self.points[1]];
        for (side, point) in [kept, gone].into_iter().enumerate() {
            topology.neighbors(point, &mut self.counts[side], &mut self.near[side]);
        }
        let triangles = self.counts[0].get(gone.index());
        let outline = |side: usize| on_outline(&self.counts[side], &self.near[side]);
        if triangles == Some(2) && outline(0) && outline(1) {
            return false;
        }
        let opposite = |point: PointId| {
            self.collapsing.iter().any(|&triangle| topology.slot_of(triangle, point).is_some())
        };
        let both = |point: PointId| {
            Some((self.counts[0].get(point.index())?, self.counts[1].get(point.index())?))
        };
        let bridges =
            self.near[1].iter().filter(|&&p| p != gone && !opposite(p)).filter_map(|&p| both(p));
        let most = match triangles {
            None => 2,
            Some(1) => 1,
            Some(_) => 0,
        };
        if bridges.zip(1..).any(|(edges, count)| count > most || edges != (1, 1)) {
            return false;
        }
        !self.surviving.iter().any(|&corner| {
            let [a, b] = topology.others(corner);
            topology.slot_of(corner.triangle(), gone).is_some()
                && both(a).is_some()
                && both(b).is_some()
                && topology.corners(kept).any(|corner| {
                    let others = topology.others(corner);
                    others == [a, b] || others == [b, a]
                })
        })
    }

    /// Whether every surviving triangle keeps its shape at `position`: none turns by more than
    /// the options allow, none becomes a sliver with next to nothing of its quality left, none changes the sign of
    /// its area in a UV set.
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
            if turns(before, after, metric.space.rotation_cosine) || is_worse_sliver(before, after)
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
