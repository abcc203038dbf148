//! Greedy simplification: the cheapest collapse first, until a target is reached (Garland &
//! Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997).

mod crowd;
mod deviation;
mod evaluated;
mod loops;
mod pairs;
mod redo;
mod reference;
mod results;
mod shells;
mod steps;
mod stop;

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::collapse::{Candidate, Plan};
use crate::id::{EdgeId, PointId, WedgeId};
use crate::item::Item;
use crate::marks::Marks;
use crate::mesh::{Layout, Mesh};
use crate::metric::Metric;
use crate::progressive::log::Log;
use crate::queue::Queue;
use crate::rank::{edge_bounds, rank_all};
use crate::settings::{Cost, Limits};
use crate::topology::Topology;
use crate::working_mesh::WorkingMesh;
use crowd::Crowd;
pub(crate) use crowd::MAX_CARD_SCALE;
use deviation::DeviationGuard;
use evaluated::Evaluated;
use pairs::Pairs;
pub(crate) use redo::Step;
pub(crate) use steps::REBUILD_SHARE;
pub use stop::Stop;

/// Collapses that were found illegal are tried again each time the mesh has shrunk to this share
/// of its size: what surrounded them has changed by then.
const RETRY_SHARE: f64 = 0.9;

/// A mesh that is being simplified, with a lazy priority queue: keys are lower bounds, re-evaluated
/// on pop.
///
/// A key is the cost when the item was last evaluated. It stays a lower bound because quadrics only
/// grow until they are summed anew, and then all edges are queued anew; only exposure, and the
/// extra cost where the cheapest placement was illegal, can shrink, and rarely do. So a collapse
/// leaves the keys of its neighbors alone, and an item that has come to cost more than the next key
/// is queued again when it is popped. Lengths may shrink, so where they order collapses the edges
/// around each are queued anew.
pub(crate) struct Descent<'a> {
    source: &'a Mesh,
    layout: Layout,
    topology: Topology,
    metric: Metric,
    /// Per triangle.
    groups: Vec<u32>,
    /// Per point: whether it stays as it is.
    locked: Vec<bool>,
    /// Number of points that were not locked at first.
    free_points: usize,
    /// Packed [`Item`]s.
    queue: Queue,
    /// Per edge: a lower bound of its cost when this descent began, 0 if none was known.
    bounds: Vec<f32>,
    evaluated: Evaluated,
    /// Per edge: whether it was found illegal and is left out until its surroundings change.
    aside: Vec<bool>,
    rejected: Vec<(f64, Item)>,
    /// Its triangles when those were last queued again.
    retried_at: usize,
    pairs: Pairs,
    plan: Plan,
    counts: Marks,
    /// Per point and per wedge: the one of the source that it stands for.
    point_sources: Vec<PointId>,
    wedge_sources: Vec<WedgeId>,
    max_error: f64,
    /// The limits on deviation, if there are any, and whether an item was put aside because of
    /// them.
    guard: Option<DeviationGuard>,
    is_held_back: bool,
    crowd: Crowd,
    /// The largest error so far, in the units of the metric.
    error: f64,
    /// The collapses so far, if they are kept on record.
    log: Option<Log>,
    /// The steps so far, if they are to be taken again.
    steps: Option<Vec<Step>>,
}

impl<'a> Descent<'a> {
    /// `working` was made from `source`. Edges with a point that is `locked`, here or by the options,
    /// stay as they are. `max_error` is in the units of the metric.
    pub(crate) fn new(
        source: &'a Mesh,
        working: WorkingMesh,
        locked: Vec<bool>,
        max_error: f64,
    ) -> Self {
        let mut own = Self::unranked(source, working, locked, max_error);
        own.queue = rank_all(&own.topology, &own.metric, &own.bounds, &own.locked);
        own
    }

    /// The same with nothing in the queue.
    pub(crate) fn unranked(
        source: &'a Mesh,
        working: WorkingMesh,
        mut locked: Vec<bool>,
        max_error: f64,
    ) -> Self {
        let (points, wedges) = (working.point_sources.len(), working.wedge_points.len());
        let topology = Topology::new(working.triangles, working.wedge_points, points);
        working.metric.space.lock(&working.point_sources, &mut locked);
        let held = locked.iter().filter(|locked| **locked).count();
        let crowd = Crowd::of(&topology, &working.metric, &working.groups, &working.point_sources);
        let bounds = match working.metric.space.cost {
            Cost::Quadric | Cost::Classic => edge_bounds(&topology, &working.bounds),
            Cost::EdgeLength => vec![0.0; topology.edge_count()],
        };
        Self {
            source,
            layout: source.layout,
            queue: Queue::default(),
            evaluated: Evaluated::new(&bounds, points),
            bounds,
            metric: working.metric,
            groups: working.groups,
            locked,
            free_points: points - held,
            aside: vec![false; topology.edge_count()],
            rejected: Vec::new(),
            retried_at: topology.live_count(),
            pairs: Pairs::default(),
            plan: Plan::new(points, wedges),
            counts: Marks::new(points),
            point_sources: working.point_sources,
            wedge_sources: working.wedge_sources,
            max_error,
            guard: None,
            is_held_back: false,
            crowd,
            error: working.error,
            log: working.log,
            steps: None,
            topology,
        }
    }

    /// Keeps the surface within `limits` from here on, if there are any.
    pub(crate) fn guard(&mut self, limits: Option<Limits>) {
        let Some(limits) = limits else { return };
        let colors = self.metric.space.colors_of(&self.point_sources);
        self.guard = Some(DeviationGuard::new(&self.topology, &self.metric, colors, limits));
    }

    /// Whether deviation is limited.
    pub(crate) fn is_guarded(&self) -> bool {
        self.guard.is_some()
    }

    /// Number of points that were not locked at first.
    pub(crate) fn free_points(&self) -> usize {
        self.free_points
    }

    fn is_locked(&self, point: PointId) -> bool {
        self.locked.get(point.index()) == Some(&true)
    }

    /// Triangles now.
    pub(crate) fn triangles(&self) -> usize {
        self.topology.live_count()
    }

    /// Root of the largest area-weighted cost of any collapse so far, in the units of the mesh.
    pub(crate) fn error(&self) -> f64 {
        self.error * self.metric.space.unit
    }

    /// The record of the collapses so far, if there is one.
    pub(crate) fn log(&mut self) -> Option<&mut Log> {
        self.log.as_mut()
    }

    /// Collapses until at most `target` triangles are left, counting on `removed` as it goes.
    pub(crate) fn descend(
        &mut self,
        target: usize,
        queue_slack: f64,
        removed: &AtomicUsize,
    ) -> Option<Stop> {
        self.retried_at = self.triangles();
        self.descend_while(|_, triangles| triangles > target, queue_slack, removed)
    }

    /// Collapses while `goes_on` is true of the least key and of the triangles left. A collapse is
    /// done if no key is below the share `queue_slack` of its cost.
    pub(crate) fn descend_while(
        &mut self,
        mut goes_on: impl FnMut(f64, usize) -> bool,
        queue_slack: f64,
        removed: &AtomicUsize,
    ) -> Option<Stop> {
        while goes_on(self.queue.least(), self.triangles()) {
            if (self.triangles() as f64) < RETRY_SHARE * self.retried_at as f64 {
                self.retry_rejected();
            }
            let key = self.queue.least();
            let Some(packed) = self.queue.pop() else {
                if self.triangles() == self.retried_at {
                    let held_back = self.is_held_back;
                    return Some(if held_back { Stop::Deviation } else { Stop::NoLegalCollapse });
                }
                self.retry_rejected();
                continue;
            };
            let step = match Item::unpack(packed) {
                Item::Edge(edge) => self.collapse(edge, key, queue_slack),
                Item::Shell(point) => self.remove_shell(point, queue_slack),
                Item::Pair(pair) => self.join(pair, queue_slack),
                Item::Loop(edge) => self.close_loop(edge, queue_slack),
            };
            match step {
                Ok(triangles) => {
                    removed.fetch_add(triangles, Ordering::Relaxed);
                }
                Err(stop) => {
                    self.queue.push(0.0, packed);
                    return Some(stop);
                }
            }
        }
        None
    }

    /// Collapses an edge at its cheapest legal placement, or queues it again if another item may be
    /// cheaper. `key` is what it was queued with. Returns the number of triangles removed.
    fn collapse(&mut self, edge: EdgeId, key: f64, queue_slack: f64) -> Result<usize, Stop> {
        let Some(points) = self.topology.ends(edge) else { return Ok(0) };
        let item = Item::Edge(edge);
        let mut lower_bound = None;
        if !self.evaluated.stands(edge, points) || self.metric.space.cost == Cost::EdgeLength {
            let own = self.plan.cost_lower_bound(&self.topology, &self.metric, points);
            self.evaluated.set(edge);
            if self.must_wait(item, own, queue_slack) {
                return Ok(0);
            }
            lower_bound = Some(own);
        }
        if self.is_plain_card(points[0]) {
            self.reject(lower_bound.unwrap_or(key), item, points[0]);
            return Ok(0);
        }
        self.plan.set(&self.topology, &self.metric, &points);
        if self.plan.is_void() { Ok(0) } else { self.merge(item, lower_bound, points, queue_slack) }
    }

    /// Merges two points as planned, or queues the item again. `lower_bound` bounds its cost, if one was
    /// computed.
    fn merge(
        &mut self,
        item: Item,
        lower_bound: Option<f64>,
        points: [PointId; 2],
        queue_slack: f64,
    ) -> Result<usize, Stop> {
        let cheapest = self.plan.cheapest(&self.metric);
        let by_length = self.metric.space.cost == Cost::EdgeLength;
        if let Some(Candidate { cost, .. }) = cheapest
            && !by_length
            && self.must_wait(item, cost, queue_slack)
        {
            return Ok(0);
        }
        let keeps_topology = self.plan.keeps_topology(&self.topology);
        let legal = cheapest.filter(|_| keeps_topology);
        let Some(best) = legal.and_then(|cheapest| self.best(cheapest)) else {
            let lower_bound = lower_bound.unwrap_or_else(|| self.plan.least(&self.metric));
            self.reject(lower_bound, item, points[0]);
            if let (false, Item::Edge(edge)) = (keeps_topology, item) {
                self.queue_loop(edge);
            }
            return Ok(0);
        };
        if !by_length && self.must_wait(item, best.cost, queue_slack) {
            return Ok(0);
        }
        self.apply(best)
    }

    /// Applies the plan, unless it passes the error limit. Returns the number of triangles removed.
    fn apply(&mut self, Candidate { cost, position }: Candidate) -> Result<usize, Stop> {
        self.record_error(cost, self.plan.weight())?;
        let (before, kept) = (self.triangles(), self.plan.points()[0]);
        if let Some(steps) = &mut self.steps {
            steps.push(Step::merge(&self.plan, position, self.error));
        }
        if let Some(guard) = &mut self.guard {
            guard.keep(&self.plan);
        }
        self.carry_out(position);
        self.evaluated.change(kept);
        self.retry_around(kept);
        Ok(before - self.triangles())
    }

    /// The cheapest placement for the plan that is legal and within the limits on deviation.
    fn best(&mut self, cheapest: Candidate) -> Option<Candidate> {
        let Self { plan, topology, metric, guard, is_held_back, .. } = self;
        plan.best(topology, metric, cheapest, |plan, position| {
            let allowed =
                |guard: &mut DeviationGuard| guard.allows(plan, topology, metric, position);
            let allowed = guard.as_mut().is_none_or(allowed);
            *is_held_back |= !allowed;
            allowed
        })
    }

    /// Queues an item again if a key is below the share `queue_slack` of its cost, and returns
    /// whether it did.
    fn must_wait(&mut self, item: Item, cost: f64, queue_slack: f64) -> bool {
        let waits = self.queue.has_cheaper(queue_slack * cost);
        if waits {
            self.queue.push(cost, item.pack());
        }
        waits
    }

    /// Raises the error to that of a collapse, unless it passes the limit.
    fn record_error(&mut self, cost: f64, weight: f64) -> Result<(), Stop> {
        let error = if weight > 0.0 { (cost / weight).sqrt() } else { 0.0 };
        if error > self.max_error {
            return Err(Stop::ErrorLimit);
        }
        self.error = self.error.max(error);
        Ok(())
    }

    /// Puts an illegal item aside. If its shell is small, the shell's end is queued instead.
    fn reject(&mut self, lower_bound: f64, item: Item, point: PointId) {
        if let Item::Edge(edge) = item {
            self.aside[edge] = true;
        }
        self.rejected.push((lower_bound, item));
        self.queue_shell(point);
    }

    /// Queues the edges at a point again that were put aside, and all of them if they may have become
    /// cheaper.
    fn retry_around(&mut self, point: PointId) {
        let any = self.metric.space.cost == Cost::EdgeLength;
        for edge in self.topology.edges(point) {
            if (std::mem::take(&mut self.aside[edge]) || any)
                && let Some(points) = self.topology.ends(edge)
                && !points.iter().any(|&point| self.is_locked(point))
            {
                let lower_bound = self.plan.cost_lower_bound(&self.topology, &self.metric, points);
                self.queue.push(lower_bound, Item::Edge(edge).pack());
            }
        }
    }

    /// Queues all items again that are still aside.
    fn retry_rejected(&mut self) {
        self.retried_at = self.triangles();
        self.is_held_back = false;
        for (lower_bound, item) in self.rejected.drain(..) {
            let is_aside = match item {
                Item::Edge(edge) => std::mem::take(&mut self.aside[edge]),
                Item::Shell(_) | Item::Pair(_) | Item::Loop(_) => true,
            };
            if is_aside {
                self.queue.push(lower_bound, item.pack());
            }
        }
    }
}
