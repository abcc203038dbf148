//! The greedy descent: the cheapest collapse first, until a target is reached (Garland & Heckbert,
//! "Surface simplification using quadric error metrics", SIGGRAPH 1997).

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use crate::collapse::Plan;
use crate::id::{PointId, TriangleId, WedgeId};
use crate::marks::Marks;
use crate::mesh::{Layout, Mesh};
use crate::metric::{Metric, Weights};
use crate::queue::{Entry, Queue};
use crate::topology::Topology;

/// Shells of up to this many triangles may vanish as a whole once none of their edges can
/// collapse. A closed shell can't go below four triangles, and a sharp one sticks somewhat above.
const SMALL_SHELL: usize = 16;
/// Collapses that were found illegal are tried again each time the mesh has shrunk to this share
/// of its size: what surrounded them has changed by then.
const RETRY_SHARE: f64 = 0.9;

/// Options of a simplification.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options {
    /// Weights of the metric.
    pub weights: Weights,
    /// No collapse may have an error above this, in the units of the mesh.
    pub max_error: Option<f64>,
}

/// Why a descent ended before its target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// Every edge left would break the surface or fold its texture.
    NoLegalCollapse,
    /// The next collapse would pass the error limit.
    ErrorLimit,
}

impl std::fmt::Display for Stop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NoLegalCollapse => {
                "no edge is left that can collapse without breaking the surface or folding its texture"
            }
            Self::ErrorLimit => "the next collapse would pass the error limit",
        })
    }
}

/// A mesh on its way down.
pub(crate) struct Descent<'a> {
    source: &'a Mesh,
    layout: Layout,
    topology: Topology,
    metric: Metric,
    queue: Queue,
    plan: Plan,
    counts: Marks,
    near: Vec<PointId>,
    /// Per point: how often it has changed.
    versions: Vec<u32>,
    /// Per point and per wedge: the one of the source that it stands for.
    point_sources: Vec<PointId>,
    wedge_sources: Vec<WedgeId>,
    max_error: f64,
    /// The largest error so far, in the units of the metric.
    error: f64,
}

/// What a step of the descent did.
enum Step {
    Removed(usize),
    Nothing,
}

impl<'a> Descent<'a> {
    pub(crate) fn new(source: &'a Mesh, options: &Options) -> Self {
        let metric = Metric::new(source, &options.weights);
        let (points, wedges) = (source.positions.len(), source.wedge_points.len());
        let mut descent = Self {
            source,
            layout: source.layout,
            topology: Topology::new(source),
            queue: Queue::default(),
            plan: Plan::new(points, wedges),
            counts: Marks::new(points),
            near: Vec::new(),
            versions: vec![0; points],
            point_sources: (0..points).map(PointId::new).collect(),
            wedge_sources: (0..wedges).map(WedgeId::new).collect(),
            max_error: options.max_error.map_or(f64::INFINITY, |limit| limit / metric.unit),
            error: 0.0,
            metric,
        };
        descent.rank_all();
        descent
    }

    /// Triangles now.
    pub(crate) fn triangles(&self) -> usize {
        self.topology.live_count()
    }

    /// Root of the largest area-weighted cost of any collapse so far, in the units of the mesh.
    pub(crate) fn error(&self) -> f64 {
        self.error * self.metric.unit
    }

    /// Collapses until at most `target` triangles are left, counting on `removed` as it goes.
    pub(crate) fn descend(&mut self, target: usize, removed: &AtomicUsize) -> Option<Stop> {
        let mut retried_at = self.triangles();
        while self.triangles() > target {
            if (self.triangles() as f64) < RETRY_SHARE * retried_at as f64 {
                retried_at = self.triangles();
                self.queue.retry_rejected();
            }
            let Some(entry) = self.queue.pop() else {
                if self.triangles() == retried_at {
                    return Some(Stop::NoLegalCollapse);
                }
                retried_at = self.triangles();
                self.queue.retry_rejected();
                continue;
            };
            if !self.is_current(&entry) {
                continue;
            }
            let step = if entry.is_shell() { self.vanish(&entry) } else { self.collapse(&entry) };
            match step {
                Ok(Step::Removed(triangles)) => {
                    removed.fetch_add(triangles, Ordering::Relaxed);
                }
                Ok(Step::Nothing) => {}
                Err(stop) => {
                    self.queue.push(entry);
                    return Some(stop);
                }
            }
        }
        None
    }

    /// Ranks every edge, in parallel; the order of the queue does not depend on it.
    fn rank_all(&mut self) {
        let mut edges: Vec<[PointId; 2]> = Vec::with_capacity(self.triangles() * 3);
        for triangle in 0..self.source.triangles.len() {
            let [a, b, c] = self.source.triangle_points(triangle);
            edges.extend([(a, b), (b, c), (c, a)].map(|(p, q)| [p.min(q), p.max(q)]));
        }
        edges.par_sort_unstable();
        edges.dedup();
        let (topology, metric) = (&self.topology, &self.metric);
        let counts = (self.source.positions.len(), self.source.wedge_points.len());
        let entries = edges
            .par_iter()
            .with_min_len(1024)
            .map_init(
                || Plan::new(counts.0, counts.1),
                |plan, &points| {
                    plan.set(topology, metric, points);
                    let cost = plan.candidates(metric).next().map_or(f64::INFINITY, |c| c.cost);
                    Entry { cost, points, versions: [0; 2] }
                },
            )
            .collect::<Vec<_>>();
        self.queue = Queue::from(entries);
    }

    fn is_current(&self, entry: &Entry) -> bool {
        entry.points.map(|point| self.versions[point]) == entry.versions
    }

    fn entry(&self, cost: f64, points: [PointId; 2]) -> Entry {
        Entry { cost, points, versions: points.map(|point| self.versions[point]) }
    }

    /// Collapses an edge at its cheapest legal placement, or queues it again if that costs more
    /// than what waits.
    fn collapse(&mut self, entry: &Entry) -> Result<Step, Stop> {
        self.plan.set(&self.topology, &self.metric, entry.points);
        let legal = self.plan.keeps_topology(&self.topology);
        let best =
            legal.then(|| self.plan.best(&self.topology, &self.metric, self.layout)).flatten();
        let Some(candidate) = best else {
            self.reject(*entry);
            return Ok(Step::Nothing);
        };
        if candidate.cost > entry.cost && self.queue.least() < candidate.cost {
            self.queue.push(Entry { cost: candidate.cost, ..*entry });
            return Ok(Step::Nothing);
        }
        self.charge(candidate.cost, self.plan.weight())?;
        let before = self.triangles();
        self.inherit(entry.points, candidate.position);
        self.plan.apply(&mut self.topology, &mut self.metric, candidate.position);
        for point in entry.points {
            self.versions[point] += 1;
        }
        self.rank_around(entry.points[0]);
        Ok(Step::Removed(before - self.triangles()))
    }

    /// Raises the error to that of a collapse, unless it passes the limit.
    fn charge(&mut self, cost: f64, weight: f64) -> Result<(), Stop> {
        let error = if weight > 0.0 { (cost / weight).sqrt() } else { 0.0 };
        if error > self.max_error {
            return Err(Stop::ErrorLimit);
        }
        self.error = self.error.max(error);
        Ok(())
    }

    /// Passes on what the merged point and its wedges stand for: the end that lies nearer.
    fn inherit(&mut self, [kept, gone]: [PointId; 2], position: glam::DVec3) {
        let distance = |point: PointId| self.metric.positions[point].distance_squared(position);
        let nearer = if distance(gone) < distance(kept) { gone } else { kept };
        let old = self.point_sources[nearer];
        self.point_sources[kept] = old;
        for (member, wedge) in self.plan.merges() {
            if self.source.wedge_points[self.wedge_sources[wedge]] == old {
                self.wedge_sources[member] = self.wedge_sources[wedge];
            }
        }
    }

    fn rank_around(&mut self, point: PointId) {
        let mut near = std::mem::take(&mut self.near);
        self.topology.neighbors(point, &mut self.counts, &mut near);
        for &other in &near {
            let points = [point.min(other), point.max(other)];
            self.plan.set(&self.topology, &self.metric, points);
            let best = self.plan.candidates(&self.metric).next();
            let entry = self.entry(best.map_or(f64::INFINITY, |c| c.cost), points);
            self.queue.push(entry);
        }
        self.near = near;
    }

    /// Puts an illegal collapse aside. If its shell is small, the shell's end is queued instead:
    /// its area off by its radius.
    fn reject(&mut self, entry: Entry) {
        self.queue.reject(entry);
        let point = entry.points[0];
        let Some(shell) = self.topology.small_shell(point, SMALL_SHELL, &mut self.counts) else {
            return;
        };
        let (area, radius) = self.measure(&shell);
        let end = self.entry(area * radius * radius, [point; 2]);
        self.queue.push(end);
    }

    /// The area and the radius of a shell.
    fn measure(&self, shell: &[TriangleId]) -> (f64, f64) {
        let mut area = 0.0;
        let (mut low, mut high) = (glam::DVec3::INFINITY, glam::DVec3::NEG_INFINITY);
        for &triangle in shell {
            let p = self.topology.points(triangle).map(|point| self.metric.positions[point]);
            area += (p[1] - p[0]).cross(p[2] - p[0]).length() / 2.0;
            for p in p {
                (low, high) = (low.min(p), high.max(p));
            }
        }
        (area, (high - low).length() / 2.0)
    }

    /// Takes a small shell out, unless it is all there is.
    fn vanish(&mut self, entry: &Entry) -> Result<Step, Stop> {
        let point = entry.points[0];
        let shell = self.topology.small_shell(point, SMALL_SHELL, &mut self.counts);
        let Some(shell) = shell.filter(|s| !s.is_empty() && s.len() < self.triangles()) else {
            return Ok(Step::Nothing);
        };
        let (area, _) = self.measure(&shell);
        self.charge(entry.cost, area)?;
        for &triangle in &shell {
            for point in self.topology.points(triangle) {
                self.versions[point] += 1;
            }
        }
        for &triangle in &shell {
            self.topology.remove(triangle);
        }
        Ok(Step::Removed(shell.len()))
    }

    /// The mesh as it stands, and for each of its points and wedges the one of the source that it
    /// stands for.
    pub(crate) fn snapshot(&self) -> (Mesh, Vec<PointId>, Vec<WedgeId>) {
        let mut mesh = Mesh { layout: self.layout, ..Mesh::default() };
        let (mut point_sources, mut wedge_sources) = (Vec::new(), Vec::new());
        let mut new_points = vec![None; self.source.positions.len()];
        let mut new_wedges = vec![None; self.source.wedge_points.len()];
        for triangle in (0..self.source.triangles.len()).map(TriangleId::new) {
            if !self.topology.is_live(triangle) {
                continue;
            }
            let group = self.source.groups[triangle];
            let points = self.topology.points(triangle);
            let wedges = self.topology.wedges(triangle);
            let corners = std::array::from_fn(|slot| {
                *new_wedges[wedges[slot].index()].get_or_insert_with(|| {
                    let point = *new_points[points[slot].index()].get_or_insert_with(|| {
                        mesh.positions.push(self.metric.position(points[slot]));
                        point_sources.push(self.point_sources[points[slot]]);
                        PointId::new(mesh.positions.len() - 1)
                    });
                    mesh.wedge_points.push(point);
                    self.metric.unscaled_row(wedges[slot], group, &mut mesh.attributes);
                    wedge_sources.push(self.wedge_sources[wedges[slot]]);
                    WedgeId::new(mesh.wedge_points.len() - 1)
                })
            });
            mesh.triangles.push(corners);
            mesh.groups.push(group);
        }
        (mesh, point_sources, wedge_sources)
    }
}
