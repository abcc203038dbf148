//! One collapse: which wedges unify, where the point goes, whether that is legal, and doing it.
//!
//! Two points of an edge merge, or the three of a loop of edges around a handle or a neck. The wedges that meet in a collapsing triangle unify: their quadrics
//! add. Every other wedge stays itself. The reduced quadrics of all resulting wedges and the
//! points' own constraints add up to one quadric in position; its minimizer places the point, and
//! each wedge then takes its own best attributes there. So a seam moves as one, and no number of
//! wedges forbids a collapse.

mod area;
mod legal;
mod loops;
mod place;
mod plain;

use glam::DVec3;

use crate::equal_volume::Plane;
use crate::id::{CornerId, PointId, TriangleId, WedgeId};
use crate::marks::Marks;
use crate::metric::Metric;
use crate::quadric::{self, PointQuadric};
use crate::sets::DisjointSets;
use crate::settings::Cost;
use crate::topology::Topology;

/// The merged wedges of a collapse and the quadrics they add up to. Reused from one collapse to
/// the next, so that evaluating one allocates nothing.
pub(crate) struct Plan {
    /// The points that merge, first the one that stays.
    points: Vec<PointId>,
    /// The wedges at them, point by point with where those of each end, and which of the merged wedges
    /// each becomes.
    wedges: Vec<WedgeId>,
    wedge_ends: Vec<usize>,
    merged_of: Vec<u32>,
    /// Per merged wedge: its first member, its summed quadric and whether a triangle still uses it.
    members: Vec<WedgeId>,
    quadrics: Vec<f64>,
    used: Vec<bool>,
    /// The triangles that collapse, and the corners that survive at any of them with the positions
    /// of the other two of their triangles.
    collapsing: Vec<TriangleId>,
    surviving: Vec<CornerId>,
    star: Vec<[DVec3; 2]>,
    /// The points of the collapsing triangles that do not merge, once they are computed.
    rim: Vec<PointId>,
    /// The area that each of them stands for.
    areas: Vec<f64>,
    /// Cost as a function of position.
    total: PointQuadric,
    weight: f64,
    /// The plane of placements that keep the area within a border, or the volume, if that is to be kept.
    kept: Option<Plane>,
    slots: Marks,
    counts: [Marks; 2],
    near: [Vec<PointId>; 2],
    sets: DisjointSets,
    row: Vec<f64>,
}

/// A place for the merged point and what it costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Candidate {
    pub(crate) cost: f64,
    pub(crate) position: DVec3,
}

impl Plan {
    /// An empty plan for meshes of so many points and wedges.
    pub(crate) fn new(points: usize, wedges: usize) -> Self {
        Self {
            points: Vec::new(),
            wedges: Vec::new(),
            wedge_ends: Vec::new(),
            merged_of: Vec::new(),
            members: Vec::new(),
            quadrics: Vec::new(),
            used: Vec::new(),
            collapsing: Vec::new(),
            surviving: Vec::new(),
            star: Vec::new(),
            rim: Vec::new(),
            areas: Vec::new(),
            total: PointQuadric::default(),
            weight: 0.0,
            kept: None,
            slots: Marks::new(wedges),
            counts: [Marks::new(points), Marks::new(points)],
            near: [Vec::new(), Vec::new()],
            sets: DisjointSets::default(),
            row: Vec::new(),
        }
    }

    /// Whether no triangle is left that the collapse would take.
    pub(crate) fn is_void(&self) -> bool {
        self.collapsing.is_empty()
    }

    /// The points that merge, first the one that stays.
    pub(crate) fn points(&self) -> &[PointId] {
        &self.points
    }

    /// The corners at them that stay.
    pub(crate) fn surviving(&self) -> &[CornerId] {
        &self.surviving
    }

    /// The area that the merged quadrics were summed over.
    pub(crate) fn weight(&self) -> f64 {
        self.weight
    }

    /// A lower bound of the cost of collapsing the edge between two points: the least of their
    /// quadrics over all placements, or the squared length of the edge if that is to order
    /// collapses. Doesn't gather the triangles around the points where each has one wedge: nothing
    /// else is in the sum then.
    pub(crate) fn cost_lower_bound(
        &mut self,
        topology: &Topology,
        metric: &Metric,
        points: [PointId; 2],
    ) -> f64 {
        if metric.space.cost == Cost::EdgeLength {
            let [a, b] = points.map(|point| metric.positions[point]);
            return a.distance_squared(b);
        }
        if let [Some(a), Some(b)] = points.map(|point| topology.sole_wedge(point)) {
            self.merge_of(&points);
            self.kept = None;
            let (a, b) = (metric.quadric(a), metric.quadric(b));
            self.total = quadric::reduce_sum(a, b);
            points.iter().for_each(|&point| metric.constraints.add_to(&mut self.total, point));
            self.weight = quadric::weight(a) + quadric::weight(b);
        } else {
            self.set(topology, metric, &points);
        }
        self.least(metric)
    }

    /// The least of the merged quadrics over all placements.
    pub(crate) fn least(&self, metric: &Metric) -> f64 {
        match self.places(metric) {
            [Some(minimizer), ..] => self.total.evaluate(minimizer),
            places => places
                .into_iter()
                .flatten()
                .map(|place| self.total.evaluate(place))
                .fold(f64::INFINITY, f64::min),
        }
    }

    fn merge_of(&mut self, points: &[PointId]) {
        self.points.clear();
        self.points.extend_from_slice(points);
    }

    /// Works out the merging of the two points of an edge, or of the three of a loop.
    pub(crate) fn set(&mut self, topology: &Topology, metric: &Metric, points: &[PointId]) {
        self.merge_of(points);
        let sole = |at: usize| topology.sole_wedge(points[at]);
        if let (2, Some(a), Some(b)) = (points.len(), sole(0), sole(1)) {
            self.set_plain(topology, metric, [a, b]);
        } else {
            self.collect(topology, metric);
            self.unify(topology);
            self.sum(metric);
        }
        self.kept = self.kept_plane(topology, metric);
    }

    /// The plane of the placements that keep what is to be kept: the area at a border, else the volume.
    fn kept_plane(&self, topology: &Topology, metric: &Metric) -> Option<Plane> {
        let space = &metric.space;
        if !(space.keep_area || space.keep_volume) {
            return None;
        }
        let triangles = self.surviving.iter().map(|corner| corner.triangle());
        let around = triangles.chain(self.collapsing.iter().copied());
        let corners = || {
            let corners = around.clone();
            corners.map(|t| topology.points(t).map(|point| metric.positions[point]))
        };
        let star = || self.surviving.iter().map(|&corner| self.others_of(topology, metric, corner));
        let area = if space.keep_area { Plane::of_equal_area(corners(), star()) } else { None };
        let volume = || if space.keep_volume { Plane::of_equal_volume(corners()) } else { None };
        area.or_else(volume)
    }

    /// The places of the other two points of a corner's triangle, in their order around it.
    fn others_of(&self, topology: &Topology, metric: &Metric, corner: CornerId) -> [DVec3; 2] {
        let (points, slot) = (topology.points(corner.triangle()), corner.slot());
        [1, 2].map(|step| metric.positions[points[(slot + step) % 3]])
    }

    fn collect(&mut self, topology: &Topology, metric: &Metric) {
        self.wedges.clear();
        self.wedge_ends.clear();
        self.collapsing.clear();
        self.surviving.clear();
        self.star.clear();
        self.slots.clear();
        for (at, &point) in self.points.iter().enumerate() {
            for corner in topology.corners(point) {
                let wedge = topology.wedge(corner);
                if self.slots.get(wedge.index()).is_none() {
                    self.slots.set(wedge.index(), self.wedges.len() as u32);
                    self.wedges.push(wedge);
                }
                let [a, b] = topology.others(corner);
                let merges = |others: &[PointId]| others.contains(&a) || others.contains(&b);
                if merges(&self.points[..at]) {
                    continue;
                }
                if merges(&self.points[at + 1..]) {
                    self.collapsing.push(corner.triangle());
                } else {
                    self.surviving.push(corner);
                    self.star.push([metric.positions[a], metric.positions[b]]);
                }
            }
            self.wedge_ends.push(self.wedges.len());
        }
    }

    /// Joins the wedges of each collapsing triangle, by union-find over the wedges at hand.
    fn unify(&mut self, topology: &Topology) {
        self.sets.reset(self.wedges.len());
        for &triangle in &self.collapsing {
            let mut first = None;
            for (wedge, point) in
                topology.wedges(triangle).into_iter().zip(topology.points(triangle))
            {
                if self.points.contains(&point) {
                    let slot = self.slots.get(wedge.index()).expect("a wedge of a merging point");
                    self.sets.join(*first.get_or_insert(slot), slot);
                }
            }
        }
        self.merged_of.clear();
        self.members.clear();
        for slot in 0..self.wedges.len() as u32 {
            let root = self.sets.root(slot);
            let merged = if root == slot {
                self.members.push(self.wedges[slot as usize]);
                self.members.len() as u32 - 1
            } else {
                self.merged_of[root as usize]
            };
            self.merged_of.push(merged);
        }
        self.used.clear();
        self.used.resize(self.members.len(), false);
        for &corner in &self.surviving {
            let merged = self.merged(topology.wedge(corner));
            self.used[merged] = true;
        }
    }

    fn sum(&mut self, metric: &Metric) {
        let stride = quadric::stride(metric.attributes);
        self.quadrics.clear();
        self.quadrics.resize(self.members.len() * stride, 0.0);
        self.areas.clear();
        let mut start = 0;
        for &end in &self.wedge_ends {
            let weights =
                self.wedges[start..end].iter().map(|&w| quadric::weight(metric.quadric(w)));
            self.areas.push(weights.sum());
            start = end;
        }
        for (&wedge, &merged) in self.wedges.iter().zip(&self.merged_of) {
            let packed = &mut self.quadrics[merged as usize * stride..][..stride];
            quadric::add(packed, metric.quadric(wedge));
        }
        self.add_up(metric);
    }

    /// The merged wedges' quadrics and the points' constraints as one.
    fn add_up(&mut self, metric: &Metric) {
        let stride = quadric::stride(metric.attributes);
        self.total = PointQuadric::default();
        let points = self.points.iter();
        points.for_each(|&point| metric.constraints.add_to(&mut self.total, point));
        self.weight = 0.0;
        for packed in self.quadrics.chunks_exact(stride) {
            self.total.add(&quadric::reduce(packed));
            self.weight += quadric::weight(packed);
        }
    }

    /// The merged wedge that one of the wedges at hand becomes.
    fn merged(&self, wedge: WedgeId) -> usize {
        let slot = self.slots.get(wedge.index()).expect("a wedge of a merging point");
        self.merged_of[slot as usize] as usize
    }

    /// Does the collapse: all points merge into the first, at `position`. A merged wedge
    /// that no triangle uses any more leaves its reduced quadric with the point, so the shape it
    /// saw is not forgotten.
    pub(crate) fn apply(&mut self, topology: &mut Topology, metric: &mut Metric, position: DVec3) {
        self.place_attributes(metric, position);
        for &triangle in &self.collapsing {
            topology.remove(triangle);
        }
        for &corner in &self.surviving {
            let member = self.members[self.merged(topology.wedge(corner))];
            topology.set_wedge(corner, member);
        }
        let kept = self.points[0];
        for &gone in &self.points[1..] {
            topology.merge(kept, gone, &mut self.counts[0]);
            if let Some(&own) = metric.constraints.get(gone) {
                metric.constraints.add(kept, &own);
            }
        }
        topology.set_sole_wedge(kept, self.sole_member());
        metric.positions[kept] = position;
        let (stride, attributes) = (quadric::stride(metric.attributes), metric.attributes);
        for (merged, &member) in self.members.iter().enumerate() {
            let packed = &self.quadrics[merged * stride..][..stride];
            if self.used[merged] {
                metric.quadric_mut(member).copy_from_slice(packed);
                metric
                    .row_mut(member)
                    .copy_from_slice(&self.row[merged * attributes..][..attributes]);
            } else {
                metric.constraints.add(kept, &quadric::reduce(packed));
            }
        }
    }

    /// The merged wedge that is still used, if it is but one.
    fn sole_member(&self) -> Option<WedgeId> {
        let mut used = self.members.iter().zip(&self.used).filter(|(_, used)| **used);
        let first = used.next().map(|(&member, _)| member);
        first.filter(|_| used.next().is_none())
    }

    /// Pairs of a merged wedge that stays in use and a wedge that became it.
    pub(crate) fn merges(&self) -> impl Iterator<Item = (WedgeId, WedgeId)> + '_ {
        self.wedges
            .iter()
            .zip(&self.merged_of)
            .filter(|&(_, &merged)| self.used[merged as usize])
            .map(|(&wedge, &merged)| (self.members[merged as usize], wedge))
    }
}

#[cfg(test)]
mod tests;
