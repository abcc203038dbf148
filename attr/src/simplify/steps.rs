//! Simplification in steps: quadrics are summed anew between them.

use std::sync::atomic::AtomicUsize;

use super::evaluated::Evaluated;
use super::{Descent, Step, Stop};
use crate::id::TriangleId;
use crate::metric::Faces;
use crate::rank::rank_all;

/// Quadrics are summed anew each time that the surface has shrunk to this share.
///
/// Summed once, they count planes that are long gone several times over, and stay loyal to a shape that
/// only the polish can bring back. Rebuilding them at each collapse is no better: thin parts wander
/// off. Lab note (`cargo bench --bench quality -- --alone --full --views 6 --resolution 256 --samples 30000`):
/// RMS sRGB luminance, RMS distance and RMS color over those of quadrics that are summed once, geometric
/// mean over four polished levels each of a scanned box, a pan, a gelatin box, a racquet, a helmet and a
/// ship:
///
/// | summed anew | luminance | distance | color |
/// |---|---|---|---|
/// | at each level | 0.982 | 0.975 | 0.975 |
/// | at 0.6 | 0.969 | 0.951 | 0.957 |
/// | **at 0.75** | 0.950 | 0.926 | 0.933 |
/// | at 0.8 | 0.960 | 0.932 | 0.965 |
/// | at 0.9 | 0.959 | 0.925 | 0.914 |
/// | for each collapse | 0.964 | 0.983 | 0.976 |
/// | at 0.75, but the planes of outlines | 0.960 | 0.993 | 0.962 |
pub(crate) const REBUILD_SHARE: f64 = 0.75;

impl Descent<'_> {
    /// Like [`descend`](Self::descend), with quadrics of the surface as it was at most one step
    /// before.
    pub(crate) fn descend_in_steps(
        &mut self,
        target: usize,
        removed: &AtomicUsize,
    ) -> Option<Stop> {
        loop {
            if self.triangles() < self.source.triangles.len() {
                self.rebuild_quadrics();
            }
            let next = target.max((REBUILD_SHARE * self.triangles() as f64) as usize);
            let stopped = self.descend(next, 1.0, removed);
            if next == target || stopped.is_some() {
                return stopped;
            }
        }
    }

    /// Sums the quadrics of the triangles as they lie now, and queues all edges anew.
    pub(crate) fn rebuild_quadrics(&mut self) {
        if let Some(steps) = &mut self.steps {
            steps.push(Step::RebuildQuadrics);
        }
        self.sum_quadrics();
        self.bounds.fill(0.0);
        self.evaluated = Evaluated::new(&self.bounds, self.point_sources.len());
        self.aside.fill(false);
        self.rejected.clear();
        self.retried_at = self.triangles();
        self.is_held_back = false;
        self.queue = rank_all(&self.topology, &self.metric, &self.bounds, &self.locked);
        self.queue_pairs();
    }

    /// Sums the quadrics of the triangles as they lie now.
    pub(super) fn sum_quadrics(&mut self) {
        let topology = &self.topology;
        let all = (0..self.groups.len()).map(TriangleId::new);
        let live: Vec<TriangleId> = all.filter(|&t| topology.is_live(t)).collect();
        let faces = Faces {
            wedges: &live.iter().map(|&t| topology.wedges(t)).collect::<Vec<_>>(),
            points: &live.iter().map(|&t| topology.points(t)).collect::<Vec<_>>(),
            groups: &live.iter().map(|&t| self.groups[t]).collect::<Vec<_>>(),
        };
        self.metric.weigh_motion(self.source.triangles.len() as f64 / live.len().max(1) as f64);
        self.metric.sum(&faces, &self.point_sources);
    }
}
