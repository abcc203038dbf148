//! Limits on the distance of a simplified surface from its reference, and on the area that it may
//! lose.
//!
//! A cost is an area times a squared distance, so a corner of a floor may go as cheaply as a bump of a
//! ball, and once all that is cheap is gone or barred whatever is left is taken. Here no step is done
//! that leaves a point of the reference, the surface as it was when the descent began, farther than a
//! limit from what is left, or puts a triangle farther than that from the reference; and what recedes at
//! borders, gets thinner and is removed may add up to a share of the area.
//!
//! Each point carries samples of the reference, its points and places spread over its large
//! triangles, and a bound on how far the surface around it is off: a collapse to x maps the
//! triangles around a and b to those around x, and moves no place of them farther than x is from a
//! or b. While the bound is within the limit nothing is tested. Beyond, the samples of a and b look
//! for the triangles around x and places on these for the reference, and what is found is the bound
//! from then on. (One-sided distances on both sides, as Klein, Liebich and Straßer, "Mesh reduction
//! with error control", Visualization 1996.)
//!
//! Guaranteed: at each step that was tested, samples and places were within the limit. Not
//! guaranteed: the same between them, nor after a polish, which moves all points: low-poly props
//! reach 1.5 times the limit, plates full of holes 1.74.

mod star;

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::pairs::root;
use super::reference::Reference;
use crate::collapse::Plan;
use crate::id::PointId;
use crate::metric::Metric;
use crate::settings::Limits;
use crate::topology::Topology;
use star::{Star, nearest_corner, search_around};

/// End of a list of samples.
const NO_LINK: u32 = u32::MAX;
/// The most samples of a point that are tested, spread evenly over its list.
const MOST_ASKED: usize = 256;

/// A side of a triangle of the reference is cut into so many samples at most, fewer if all triangles
/// together would have more than so many, and one of a triangle that is looked at into so many places.
const MOST_A_SIDE: usize = 16;
const MOST_SAMPLES: usize = 200_000;
const MOST_A_SIDE_ASKED: usize = 6;

/// The budget of tests, each of a sample against a triangle: so many for each sample, and so many
/// more. A search of the reference counts as `LOOKUPS_PER_PLACE` of them. Beyond, no step that
/// would need tests is allowed: in a soup of triangles that reach over each other there is no end
/// to them.
const LOOKS_PER_SAMPLE: usize = 100;
const MAX_LOOKUPS: usize = 20_000_000;
const LOOKUPS_PER_PLACE: usize = 64;

/// Points of a shell that are compared with what lies behind it.
const MOST_SEEN: usize = 4;

/// No limit is less than this, which the reference is rounded by: even what is flat would stay.
const ROUNDING: f64 = 1e-7;

/// Triangles of sides above so many times the limit are features themselves.
const LARGE_TRIANGLE_RATIO: f64 = 4.0;

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
    /// Per point: how far the surface around it is off at most, and the one that it has merged into, or
    /// itself.
    bounds: Vec<f64>,
    merged_into: Vec<PointId>,
    /// Contrasts of shells of the reference to what lies behind them, as far as they were computed.
    contrasts: FxHashMap<u32, f64>,
    /// Tests that are left of the budget.
    looks: usize,
    /// The results of the step that is tried, and of the last one that was allowed.
    trial: Step,
    step: Step,
}

/// The results of a step, if it is done.
#[derive(Default)]
struct Step {
    bound: f64,
    lost: f64,
    /// The points whose samples were tested, and the point that carries each sample from then on.
    asked: Vec<PointId>,
    carriers: Vec<(u32, PointId)>,
}

impl DeviationGuard {
    /// A guard of the surface as it stands, with the colors of its points if there are any.
    pub(super) fn new(
        topology: &Topology,
        metric: &Metric,
        colors: Vec<[f32; 3]>,
        limits: Limits,
    ) -> Self {
        let points = metric.positions.len();
        let reference = Reference::new(topology, metric, colors);
        let mut guard = Self {
            limit: limits.deviation.max(ROUNDING),
            may_lose: 0.0,
            lost: 0.0,
            reference,
            samples: metric.positions.clone(),
            first: (0..points as u32).collect(),
            last: (0..points as u32).collect(),
            next: vec![NO_LINK; points],
            bounds: vec![0.0; points],
            merged_into: (0..points).map(PointId::new).collect(),
            contrasts: FxHashMap::default(),
            looks: 0,
            trial: Step::default(),
            step: Step::default(),
        };
        guard.spread_samples(metric, limits.area);
        guard.looks = LOOKS_PER_SAMPLE * guard.samples.len() + MAX_LOOKUPS;
        guard
    }

    /// Spreads samples over the large triangles of the reference, and adds up the area that may go.
    fn spread_samples(&mut self, metric: &Metric, share: f64) {
        let triangles: Vec<[PointId; 3]> = self.reference.triangles().collect();
        let corners = |points: [PointId; 3]| points.map(|point| metric.positions[point]);
        let count = |most_a_side: usize| -> usize {
            let of =
                |&points: &[PointId; 3]| cuts(corners(points), self.limit, most_a_side).pow(2) / 2;
            triangles.iter().map(of).sum()
        };
        let mut most_a_side = MOST_A_SIDE;
        while most_a_side > 1 && count(most_a_side) > MOST_SAMPLES {
            most_a_side /= 2;
        }
        for points in triangles {
            let corners = corners(points);
            let [a, b, c] = corners;
            self.may_lose += share * (b - a).cross(c - a).length() / 2.0;
            for place in spread(corners, self.limit, most_a_side) {
                let sample = self.samples.len() as u32;
                self.samples.push(place);
                self.next.push(NO_LINK);
                let corner = nearest_corner(place, [0, 1, 2].map(|k| (points[k], corners[k])));
                self.carry(sample, corner);
            }
        }
    }

    /// Takes tests off the budget; false if none is left.
    fn look(&mut self, count: usize) -> bool {
        self.looks = self.looks.saturating_sub(count);
        self.looks > 0
    }

    /// Adds a sample to a point's list.
    fn carry(&mut self, sample: u32, point: PointId) {
        self.next[sample as usize] = NO_LINK;
        match self.last[point] {
            NO_LINK => self.first[point] = sample,
            last => self.next[last as usize] = sample,
        }
        self.last[point] = sample;
    }

    /// The samples of a point.
    fn samples(&self, point: PointId) -> impl Iterator<Item = u32> + '_ {
        let mut at = self.first[point];
        std::iter::from_fn(move || {
            let sample = (at != NO_LINK).then_some(at)?;
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
        let moved = plan.points().iter().map(|&p| metric.positions[p].distance(position));
        let moved = moved.fold(0.0, f64::max);
        // A triangle may be off where its corners are not.
        let around = plan.surviving().iter().flat_map(|&corner| topology.others(corner));
        let around = around.chain(plan.points().iter().copied()).map(|point| self.bounds[point]);
        self.trial.bound = around.fold(0.0, f64::max) + moved;
        // A collapse moves places, but the tip of a triangle that is removed may come off.
        let tips = plan.tips(topology);
        let is_coarse = self.trial.bound > self.limit || !tips.is_empty();
        // Where triangles are small the surface is smoothed, where they are large it gets thinner.
        let is_large = plan.reach(position) > LARGE_TRIANGLE_RATIO * self.limit;
        let area = plan.lost_area(topology, metric, position);
        let lost = if is_coarse || is_large { area.all } else { area.borders };
        self.trial.lost = self.lost + lost;
        if lost > 0.0 && self.trial.lost > self.may_lose {
            return false;
        }
        self.trial.carriers.clear();
        self.trial.asked.clear();
        let allowed = !is_coarse || {
            let star = Star::new(plan, tips, topology, metric, position);
            self.is_covered(&star) && self.stays_near(&star)
        };
        if allowed {
            std::mem::swap(&mut self.step, &mut self.trial);
        }
        allowed
    }

    /// Whether the samples of the points that merge or come off find the triangles around the one that is left.
    fn is_covered(&mut self, star: &Star<'_>) -> bool {
        let mut carriers = std::mem::take(&mut self.trial.carriers);
        let (mut farthest, square) = (0.0f64, self.limit * self.limit);
        for &point in star.points.iter().chain(&star.tips) {
            self.trial.asked.push(point);
            let stride = self.samples(point).count().div_ceil(MOST_ASKED).max(1);
            if !self.look(self.samples(point).count() / stride * star.rim.len()) {
                return false;
            }
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

    /// Whether the triangles around the point that is left are near the reference: the point itself, and
    /// places on each.
    fn stays_near(&mut self, star: &Star<'_>) -> bool {
        let x = star.position;
        let spread = |[a, b]: [DVec3; 2]| {
            let middle = std::iter::once((x + a + b) / 3.0);
            middle.chain(spread([x, a, b], self.limit, MOST_A_SIDE_ASKED))
        };
        let places = std::iter::once(x).chain(star.rim.iter().flat_map(|&(_, ends)| spread(ends)));
        let mut farthest = self.trial.bound;
        for place in places {
            let Some(square) = self.reference.square_to(place, self.limit) else { return false };
            self.looks = self.looks.saturating_sub(LOOKUPS_PER_PLACE);
            farthest = farthest.max(square.sqrt());
        }
        self.trial.bound = farthest;
        true
    }

    /// Notes that what was allowed last is done.
    pub(super) fn keep(&mut self, plan: &Plan) {
        let kept = plan.points()[0];
        self.lost = self.step.lost;
        self.bounds[kept] = self.step.bound;
        plan.points()[1..].iter().for_each(|&gone| self.merged_into[gone] = kept);
        if self.step.carriers.is_empty() {
            plan.points()[1..].iter().for_each(|&gone| self.hand_over(gone, kept));
            return;
        }
        for &point in &self.step.asked {
            (self.first[point], self.last[point]) = (NO_LINK, NO_LINK);
        }
        let carriers = std::mem::take(&mut self.step.carriers);
        carriers.iter().for_each(|&(sample, point)| self.carry(sample, point));
        self.step.carriers = carriers;
    }

    /// Adds the list of a point that is gone to that of another.
    fn hand_over(&mut self, gone: PointId, kept: PointId) {
        let first = std::mem::replace(&mut self.first[gone], NO_LINK);
        let last = std::mem::replace(&mut self.last[gone], NO_LINK);
        if first == NO_LINK {
            return;
        }
        match self.last[kept] {
            NO_LINK => self.first[kept] = first,
            end => self.next[end as usize] = first,
        }
        self.last[kept] = last;
    }

    /// The contrast of a shell that consists of `points` to what lies behind it: 0 to 1. Computed
    /// once a shell, at a few of its points.
    pub(super) fn contrast(&mut self, points: &[PointId]) -> f64 {
        let Some(shell) = points.first().and_then(|&point| self.reference.colored_shell(point))
        else {
            return 0.0;
        };
        if let Some(&known) = self.contrasts.get(&shell) {
            return known;
        }
        if !self.look(LOOKUPS_PER_PLACE * MOST_SEEN) {
            return 0.0;
        }
        let some = points.iter().step_by(points.len().div_ceil(MOST_SEEN));
        let contrasts = some.filter_map(|&point| self.reference.contrast(point, points));
        let (sum, count) = contrasts.fold((0.0, 0), |(sum, count), x| (sum + x, count + 1));
        let contrast = if count == 0 { 0.0 } else { sum / f64::from(count) };
        self.contrasts.insert(shell, contrast);
        contrast
    }

    /// Whether the shell of a point was found before to be one that can't be removed.
    pub(super) fn needs(&self, point: PointId) -> bool {
        self.reference.needs(point)
    }

    /// Whether a shell of so much area that consists of `points` may be removed: what is left of other shells
    /// is near all that it stands for, and stands for that from then on. If so, it is noted as gone.
    pub(super) fn allows_removal(
        &mut self,
        points: &[PointId],
        area: f64,
        topology: &Topology,
        metric: &Metric,
    ) -> bool {
        if self.lost + area > self.may_lose {
            return false;
        }
        let samples: Vec<u32> = points.iter().flat_map(|&point| self.samples(point)).collect();
        if !self.look(LOOKUPS_PER_PLACE * samples.len()) {
            return false;
        }
        let mut heirs = Vec::with_capacity(samples.len());
        for &sample in &samples {
            let Some(heir) = self.heir(sample, points, topology, metric) else {
                self.reference.need(points);
                return false;
            };
            heirs.push(heir);
        }
        self.lost += area;
        self.reference.record_removal(points);
        for &point in points {
            (self.first[point], self.last[point]) = (NO_LINK, NO_LINK);
        }
        for (sample, (off, heir)) in samples.into_iter().zip(heirs) {
            self.bounds[heir] = self.bounds[heir].max(off);
            self.carry(sample, heir);
        }
        true
    }

    /// The point of another shell than that of `points` that may carry a sample, and how far the surface
    /// around it is from that, if it is near enough. It is sought where the nearest place of the reference
    /// has gone.
    fn heir(
        &mut self,
        sample: u32,
        points: &[PointId],
        topology: &Topology,
        metric: &Metric,
    ) -> Option<(f64, PointId)> {
        let place = self.samples[sample as usize];
        let corners = self.reference.nearest_of_others(place, self.limit, points)?;
        let mut best = (f64::INFINITY, corners[0]);
        for corner in corners {
            let point = root(&mut self.merged_into, corner);
            search_around(topology, metric, point, points, place, &mut best);
        }
        let off = best.0.sqrt();
        (off <= self.limit).then_some((off, best.1))
    }
}

/// Number of pieces that a triangle's sides are cut into.
fn cuts([a, b, c]: [DVec3; 3], spacing: f64, most_a_side: usize) -> usize {
    let longest = [a - b, b - c, c - a].map(DVec3::length).into_iter().fold(0.0, f64::max);
    ((longest / spacing).ceil() as usize).clamp(1, most_a_side)
}

/// Places of a triangle a `spacing` apart along its sides, without its corners: none if it is
/// smaller.
fn spread([a, b, c]: [DVec3; 3], spacing: f64, most_a_side: usize) -> impl Iterator<Item = DVec3> {
    let n = cuts([a, b, c], spacing, most_a_side);
    let rows = (0..=n).flat_map(move |i| (0..=n - i).map(move |j| [i, j, n - i - j]));
    let inner = rows.filter(move |row| row.iter().all(|&at| at < n));
    inner.map(move |row| {
        let [u, v, w] = row.map(|at| at as f64 / n as f64);
        a * u + b * v + c * w
    })
}

#[cfg(test)]
mod tests;
