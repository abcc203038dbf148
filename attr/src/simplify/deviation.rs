//! How far a descent may take the surface from where it set out, and how much of it may go.
//!
//! A cost is an area times a squared distance, so a corner of a floor may go as cheaply as a bump of a
//! ball, and once all that is cheap is gone or barred whatever is left is taken. Here no step is done
//! that leaves a point of the reference, the surface as it was when the descent began, farther than a
//! limit from what is left, or puts a triangle farther than that from the reference; and borders and
//! shells that go may add up to a share of the area.
//!
//! Each point carries samples of the reference, its points and the middles of its large triangles, and a
//! bound on how far the surface around it is off: a collapse to x maps the triangles around a and b to
//! those around x, and moves no place of them farther than x is from a or b. While the bound keeps to
//! the limit nothing is asked. Beyond, the samples of a and b look for the triangles around x and places
//! on these for the reference, and what is found is the bound from then on. (One-sided distances on both
//! sides, as Klein, Liebich and Straßer, "Mesh reduction with error control", Visualization 1996.)
//!
//! Guaranteed: at each step that was asked about, samples and places were within the limit. Not
//! guaranteed: the same between them, nor after a polish, which moves all points.

use glam::DVec3;

use super::reference::Reference;
use crate::collapse::Plan;
use crate::id::PointId;
use crate::metric::Metric;
use crate::topology::Topology;
use crate::triangle::square_to_origin;

/// End of a list of samples.
const NONE: u32 = u32::MAX;
/// So many samples of a point are asked at most, spread evenly over its list.
const MOST_ASKED: usize = 256;

/// What a descent may lose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// How far the surface may be off, in the units of the metric.
    pub(crate) deviation: f64,
    /// The share of its area that borders and shells may lose.
    pub(crate) area: f64,
}

/// Keeps a descent within its limits.
pub(super) struct DeviationGuard {
    limit: f64,
    /// The area that may go and that is gone, in the units of the metric.
    may_lose: f64,
    lost: f64,
    reference: Reference,
    samples: Vec<DVec3>,
    /// Samples by the point that carries them, as linked lists.
    first: Vec<u32>,
    last: Vec<u32>,
    next: Vec<u32>,
    /// Per point: how far the surface around it is off at most.
    bounds: Vec<f64>,
    /// What the step that is looked at comes to, and the last one that was allowed.
    trial: Step,
    step: Step,
}

/// What a step that is allowed comes to.
#[derive(Default)]
struct Step {
    bound: f64,
    lost: f64,
    /// Who carries which sample from then on, if they were asked.
    carriers: Vec<(u32, PointId)>,
}

impl DeviationGuard {
    /// A guard of the surface as it stands.
    pub(super) fn new(topology: &Topology, metric: &Metric, limits: Limits) -> Self {
        let (reference, points) = (Reference::new(topology, metric), metric.positions.len());
        let mut guard = Self {
            limit: limits.deviation,
            may_lose: 0.0,
            lost: 0.0,
            reference,
            samples: metric.positions.clone(),
            first: (0..points as u32).collect(),
            last: (0..points as u32).collect(),
            next: vec![NONE; points],
            bounds: vec![0.0; points],
            trial: Step::default(),
            step: Step::default(),
        };
        let triangles: Vec<[PointId; 3]> = guard.reference.triangles().collect();
        for points in triangles {
            let [a, b, c] = points.map(|point| metric.positions[point]);
            guard.may_lose += limits.area * (b - a).cross(c - a).length() / 2.0;
            let longest = [a - b, b - c, c - a].map(DVec3::length).into_iter().fold(0.0, f64::max);
            if longest > guard.limit {
                let sample = guard.samples.len() as u32;
                guard.samples.push((a + b + c) / 3.0);
                guard.next.push(NONE);
                guard.carry(sample, points[0]);
            }
        }
        guard
    }

    /// Adds a sample to a point's list.
    fn carry(&mut self, sample: u32, point: PointId) {
        self.next[sample as usize] = NONE;
        match self.last[point] {
            NONE => self.first[point] = sample,
            last => self.next[last as usize] = sample,
        }
        self.last[point] = sample;
    }

    /// The samples of a point.
    fn samples(&self, point: PointId) -> impl Iterator<Item = u32> + '_ {
        let mut at = self.first[point];
        std::iter::from_fn(move || {
            let sample = (at != NONE).then_some(at)?;
            at = self.next[sample as usize];
            Some(sample)
        })
    }

    /// Whether what is planned may go to `position`. [`keep`](Self::keep) is to follow if it does.
    pub(super) fn allows(
        &mut self,
        plan: &Plan,
        topology: &Topology,
        metric: &Metric,
        position: DVec3,
    ) -> bool {
        let eroded = plan.eroded_area(topology, metric, position);
        self.trial.lost = (self.lost + eroded).max(0.0);
        if eroded > 0.0 && self.trial.lost > self.may_lose {
            return false;
        }
        let off =
            |&point: &PointId| self.bounds[point] + metric.positions[point].distance(position);
        self.trial.bound = plan.points().iter().map(off).fold(0.0, f64::max);
        self.trial.carriers.clear();
        let allowed = self.trial.bound <= self.limit || {
            let star = Star::new(plan, topology, metric, position);
            self.is_covered(&star) && self.is_near_reference(&star)
        };
        if allowed {
            std::mem::swap(&mut self.step, &mut self.trial);
        }
        allowed
    }

    /// Whether the samples of the points that merge find the triangles around the one that is left.
    fn is_covered(&mut self, star: &Star<'_>) -> bool {
        let mut carriers = std::mem::take(&mut self.trial.carriers);
        let (mut farthest, square) = (0.0f64, self.limit * self.limit);
        for &point in star.points {
            let stride = self.samples(point).count().div_ceil(MOST_ASKED).max(1);
            for (at, sample) in self.samples(point).enumerate() {
                let mut carrier = star.points[0];
                if at % stride == 0 && farthest <= square {
                    let (off, nearest) = star.nearest(self.samples[sample as usize], square);
                    farthest = farthest.max(off);
                    carrier = nearest;
                }
                carriers.push((sample, carrier));
            }
        }
        self.trial.carriers = carriers;
        self.trial.bound = farthest.sqrt();
        farthest <= square
    }

    /// Whether places on the triangles around the point that is left are near the reference: itself, the
    /// middles of the edges there and of the triangles.
    fn is_near_reference(&self, star: &Star<'_>) -> bool {
        let x = star.position;
        let edges = star.rim.iter().flat_map(|&(_, [a, b])| [(x + a) / 2.0, (x + b) / 2.0]);
        let middles = star.rim.iter().map(|&(_, [a, b])| (x + a + b) / 3.0);
        let mut places = std::iter::once(x).chain(middles).chain(edges);
        places.all(|place| self.reference.is_near(place, self.limit))
    }

    /// Notes that what was allowed last is done.
    pub(super) fn keep(&mut self, plan: &Plan) {
        let [kept, gone] = [plan.points()[0], plan.points()[1]];
        self.lost = self.step.lost;
        self.bounds[kept] = self.step.bound;
        if self.step.carriers.is_empty() {
            let first = std::mem::replace(&mut self.first[gone], NONE);
            let last = std::mem::replace(&mut self.last[gone], NONE);
            if first == NONE {
                return;
            }
            match self.last[kept] {
                NONE => self.first[kept] = first,
                end => self.next[end as usize] = first,
            }
            self.last[kept] = last;
            return;
        }
        for &point in plan.points() {
            (self.first[point], self.last[point]) = (NONE, NONE);
        }
        let carriers = std::mem::take(&mut self.step.carriers);
        carriers.iter().for_each(|&(sample, point)| self.carry(sample, point));
        self.step.carriers = carriers;
    }

    /// Whether a shell of so much area that consists of `points` may vanish: what it stands for is near
    /// other shells. If so, it is noted as gone.
    pub(super) fn lets_vanish(&mut self, points: &[PointId], area: f64) -> bool {
        let is_near = |sample: u32| {
            self.reference.is_near_others(self.samples[sample as usize], self.limit, points)
        };
        let fits = self.lost + area <= self.may_lose;
        let vanishes = fits && points.iter().all(|&p| self.samples(p).all(is_near));
        if vanishes {
            self.lost += area;
            self.reference.vanish(points);
        }
        vanishes
    }
}

/// The triangles around a merged point.
struct Star<'a> {
    points: &'a [PointId],
    position: DVec3,
    /// The two other points of each, and where they are.
    rim: Vec<([PointId; 2], [DVec3; 2])>,
    topology: &'a Topology,
    metric: &'a Metric,
}

impl<'a> Star<'a> {
    fn new(plan: &'a Plan, topology: &'a Topology, metric: &'a Metric, position: DVec3) -> Self {
        let others = plan.surviving().iter().map(|&corner| topology.others(corner));
        let rim = others.map(|ends| (ends, ends.map(|end| metric.positions[end]))).collect();
        Self { points: plan.points(), position, rim, topology, metric }
    }

    /// The squared distance of a place to the triangles around the merged point, or if that is above
    /// `limit` to those around their other points too; and which of the points it is nearest to is to
    /// carry it.
    fn nearest(&self, place: DVec3, limit: f64) -> (f64, PointId) {
        let from = |p: DVec3| p - place;
        let mut best = (f64::INFINITY, self.points[0]);
        for &(ends, [a, b]) in &self.rim {
            let square = square_to_origin([from(self.position), from(a), from(b)]);
            if square < best.0 {
                let corners = [(self.points[0], self.position), (ends[0], a), (ends[1], b)];
                best = (square, nearest_corner(place, corners));
            }
        }
        if best.0 > limit {
            for &(ends, _) in &self.rim {
                self.search_around(ends[0], place, &mut best);
                self.search_around(ends[1], place, &mut best);
            }
        }
        best
    }

    /// Looks among the triangles at a point that the merged ones have no part in.
    fn search_around(&self, point: PointId, place: DVec3, best: &mut (f64, PointId)) {
        for corner in self.topology.corners(point) {
            let points = self.topology.points(corner.triangle());
            if points.iter().any(|p| self.points.contains(p)) {
                continue;
            }
            let p = points.map(|point| self.metric.positions[point]);
            let square = square_to_origin(p.map(|p| p - place));
            if square < best.0 {
                *best = (square, nearest_corner(place, [0, 1, 2].map(|k| (points[k], p[k]))));
            }
        }
    }
}

/// Which of the corners of a triangle is nearest to a place.
fn nearest_corner(place: DVec3, corners: [(PointId, DVec3); 3]) -> PointId {
    let mut best = (f64::INFINITY, corners[0].0);
    for (point, position) in corners {
        let square = position.distance_squared(place);
        if square < best.0 {
            best = (square, point);
        }
    }
    best.1
}
