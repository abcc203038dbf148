//! The steps of a descent as it takes them, by the points and wedges of the source.
//!
//! A point or a wedge is named by the one of the source that it stands for: no two that are there stand for
//! the same. So pieces of a surface that is cut and joined agree on names. Triangles need none: those
//! that go are the ones with two of the points that merge.

use glam::Vec3;

use crate::collapse::Plan;
use crate::id::{PointId, TriangleId, WedgeId};
use crate::metric::Metric;
use crate::space::Space;
use crate::topology::Topology;

/// Steps in order, in flat lists.
#[derive(Clone, Debug, Default)]
pub(crate) struct Log {
    steps: Vec<Step>,
    /// The points of each step: of a merger first the one whose name the merged point goes on by; of a
    /// shell that is removed any one.
    points: Vec<PointId>,
    /// Wedges of triangles that stay and the names that they go on by.
    renamed: Vec<[WedgeId; 2]>,
    /// The wedges of the merged point by their new names, and a row of the layout for each.
    moved: Vec<WedgeId>,
    rows: Vec<f32>,
    /// The names of the wedges of the step at hand before it.
    before: Vec<WedgeId>,
    /// The numbers of steps when surfaces that go down together were last compared, and when levels
    /// were made.
    pub(crate) phases: Vec<usize>,
    pub(crate) levels: Vec<usize>,
}

/// Ends of a step in the flat lists.
#[derive(Clone, Copy, Debug, Default)]
struct Step {
    /// The place of the merged point; none if a shell goes.
    position: Option<Vec3>,
    error: f64,
    points: usize,
    renamed: usize,
    moved: usize,
}

/// A step of a descent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoggedStep<'a> {
    pub(crate) position: Option<Vec3>,
    /// Root of the area-weighted cost, the largest up to here in its descent, in the units of the mesh.
    pub(crate) error: f64,
    pub(crate) points: &'a [PointId],
    pub(crate) renamed: &'a [[WedgeId; 2]],
    pub(crate) moved: &'a [WedgeId],
    pub(crate) rows: &'a [f32],
}

/// The names of points and wedges.
#[derive(Clone, Copy)]
pub(crate) struct Names<'a> {
    pub(crate) points: &'a [PointId],
    pub(crate) wedges: &'a [WedgeId],
}

impl<'a> Names<'a> {
    /// The names that lists give.
    pub(crate) fn of(points: &'a [PointId], wedges: &'a [WedgeId]) -> Self {
        Self { points, wedges }
    }
}

impl Log {
    /// An empty one, if one is asked for.
    pub(crate) fn of(space: &Space) -> Option<Self> {
        space.records.then(Self::default)
    }

    /// Number of steps.
    pub(crate) fn len(&self) -> usize {
        self.steps.len()
    }

    /// Notes how wedges are named before a plan is applied.
    pub(crate) fn begin(&mut self, plan: &Plan, names: Names<'_>) {
        self.points.extend(plan.points().iter().map(|&point| names.points[point]));
        self.before.clear();
        self.before.extend(plan.merges().map(|(_, wedge)| names.wedges[wedge]));
    }

    /// Notes what has become of them. `groups` has one entry per triangle.
    pub(crate) fn end(
        &mut self,
        plan: &Plan,
        names: Names<'_>,
        (topology, metric, groups): (&Topology, &Metric, &[u32]),
        error: f64,
    ) {
        let kept = plan.points()[0];
        let own = self.steps.last().map_or(0, |step| step.points);
        let first = self.points[own..].iter().position(|&point| point == names.points[kept]);
        self.points.swap(own, own + first.unwrap_or(0));
        let after = plan.merges().map(|(member, _)| names.wedges[member]);
        let renamed = self.before.iter().zip(after).map(|(&before, after)| [before, after]);
        self.renamed.extend(renamed.filter(|[before, after]| before != after));
        let wedge = |&corner: &crate::id::CornerId| {
            let triangle: TriangleId = corner.triangle();
            (topology.wedge(corner), groups[triangle])
        };
        let mut wedges: Vec<(WedgeId, u32)> = plan.surviving().iter().map(wedge).collect();
        wedges.sort_unstable();
        wedges.dedup();
        for (wedge, group) in wedges {
            self.moved.push(names.wedges[wedge]);
            metric.unscaled_row(wedge, group, &mut self.rows);
        }
        self.finish(Some(metric.position(kept)), error);
    }

    /// Notes that the shell of a point goes.
    pub(crate) fn remove_shell(&mut self, point: PointId, error: f64) {
        self.points.push(point);
        self.finish(None, error);
    }

    fn finish(&mut self, position: Option<Vec3>, error: f64) {
        let [points, renamed, moved] = [self.points.len(), self.renamed.len(), self.moved.len()];
        self.steps.push(Step { position, error, points, renamed, moved });
    }

    /// A step; `width` floats are a row.
    pub(crate) fn step(&self, at: usize, width: usize) -> LoggedStep<'_> {
        let end = self.steps[at];
        let start = at.checked_sub(1).map_or(Step::default(), |before| self.steps[before]);
        LoggedStep {
            position: end.position,
            error: end.error,
            points: &self.points[start.points..end.points],
            renamed: &self.renamed[start.renamed..end.renamed],
            moved: &self.moved[start.moved..end.moved],
            rows: &self.rows[start.moved * width..end.moved * width],
        }
    }

    fn push(&mut self, step: LoggedStep<'_>) {
        self.points.extend_from_slice(step.points);
        self.renamed.extend_from_slice(step.renamed);
        self.moved.extend_from_slice(step.moved);
        self.rows.extend_from_slice(step.rows);
        self.finish(step.position, step.error);
    }

    /// Marks that a level was made.
    pub(crate) fn mark_level(&mut self) {
        self.levels.push(self.len());
    }

    /// Marks that surfaces which go down together are compared.
    pub(crate) fn mark_phase(&mut self) {
        self.phases.push(self.len());
    }

    /// Adds the steps of pieces that do not touch, so that all go down side by side; `width` floats are
    /// a row.
    pub(crate) fn append_side_by_side(&mut self, pieces: &[Self], width: usize) {
        let lengths: Vec<usize> = pieces.iter().map(Self::len).collect();
        let mut next = vec![0; pieces.len()];
        for piece in side_by_side(&lengths) {
            let piece = piece as usize;
            self.push(pieces[piece].step(next[piece], width));
            next[piece] += 1;
        }
    }
}

/// The lists that each entry comes from where lists of these lengths are taken in equal shares.
pub(crate) fn side_by_side(lengths: &[usize]) -> Vec<u32> {
    let share = |at: usize, length: usize| (at as f64 + 0.5) / length as f64;
    let mut order: Vec<(f64, u32)> = (0..)
        .zip(lengths)
        .flat_map(|(list, &length)| (0..length).map(move |at| (share(at, length), list)))
        .collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    order.into_iter().map(|(_, list)| list).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_taken_in_equal_shares() {
        assert_eq!(side_by_side(&[2, 4]), [1, 0, 1, 1, 0, 1]);
        assert_eq!(side_by_side(&[0, 1, 0]), [1]);
    }
}
