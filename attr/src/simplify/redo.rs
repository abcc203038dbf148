//! The steps of a descent as they are carried out, and taken again: most of the time goes into finding them.

use glam::DVec3;

use super::Descent;
use super::shells::small_shell;
use crate::collapse::Plan;
use crate::id::PointId;
use crate::progressive::log::Names;
use crate::settings::Placement;

/// A step of a descent, by its own points; with the largest error so far, in the units of the metric.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// Points become one at a place: three, or two and the second again.
    Merge { points: [PointId; 3], position: DVec3, error: f64 },
    /// The shell of a point goes.
    RemoveShell { point: PointId, error: f64 },
    /// Quadrics are summed anew.
    RebuildQuadrics,
}

impl Step {
    /// The merger of the points of a plan.
    pub(super) fn merge(plan: &Plan, position: DVec3, error: f64) -> Self {
        let of = |at: usize| plan.points()[at.min(plan.points().len() - 1)];
        Self::Merge { points: [0, 1, 2].map(of), position, error }
    }
}

impl Descent<'_> {
    /// Keeps the steps from here on, for [`redo`](Self::redo).
    pub(crate) fn keep_steps(&mut self) {
        self.steps = Some(Vec::with_capacity(self.triangles() / 2));
    }

    /// The steps that were kept.
    pub(crate) fn into_steps(self) -> Vec<Step> {
        let mut steps = self.steps.unwrap_or_default();
        steps.shrink_to_fit();
        steps
    }

    /// Takes steps of a descent of the same surface until at most `target` triangles are left, and returns
    /// those that come next.
    pub(crate) fn redo<'s>(&mut self, mut steps: &'s [Step], target: usize) -> &'s [Step] {
        while self.triangles() > target
            && let Some((&step, rest)) = steps.split_first()
        {
            self.take(step);
            steps = rest;
        }
        steps
    }

    fn take(&mut self, step: Step) {
        match step {
            Step::Merge { points, position, error } => {
                self.error = error;
                let count = if points[1] == points[2] { 2 } else { 3 };
                self.plan.set(&self.topology, &self.metric, &points[..count]);
                self.carry_out(position);
            }
            Step::RemoveShell { point, error } => {
                self.error = error;
                let shell = small_shell(&self.topology, point, &mut self.counts);
                self.carry_off(&shell.unwrap_or_default(), point);
            }
            Step::RebuildQuadrics => self.sum_quadrics(),
        }
    }

    /// Applies the plan.
    pub(super) fn carry_out(&mut self, position: DVec3) {
        if let Some(log) = &mut self.log {
            log.begin(&self.plan, Names::of(&self.point_sources, &self.wedge_sources));
        }
        self.pass_on_sources(position);
        self.plan.apply(&mut self.topology, &mut self.metric, position);
        if let Some(log) = &mut self.log {
            let names = Names::of(&self.point_sources, &self.wedge_sources);
            let error = self.error * self.metric.space.unit;
            log.end(&self.plan, names, (&self.topology, &self.metric, &self.groups), error);
        }
    }

    /// Sets the source point and wedges of the merged point: those of the end that lies nearest.
    fn pass_on_sources(&mut self, position: DVec3) {
        let distance = |point: PointId| self.metric.positions[point].distance_squared(position);
        let kept = self.plan.points()[0];
        let mut nearer = kept;
        for &gone in &self.plan.points()[1..] {
            self.pairs.merge([kept, gone]);
            if distance(gone) < distance(nearer) {
                nearer = gone;
            }
        }
        let old = self.point_sources[nearer];
        self.point_sources[kept] = old;
        let ends = self.metric.space.placement == Placement::Ends;
        for (member, wedge) in self.plan.merges() {
            // With ends, a wedge goes on as the one whose row it takes.
            let is_kept = ends && self.topology.wedge_point(wedge) == nearer;
            if is_kept || self.source.wedge_points[self.wedge_sources[wedge]] == old {
                self.wedge_sources[member] = self.wedge_sources[wedge];
            }
        }
    }
}
