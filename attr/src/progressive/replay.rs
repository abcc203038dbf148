//! The log of a descent done once more on its source, to find what each step changes.

use crate::id::{CornerId, PointId, TriangleId};
use crate::mesh::Mesh;
use crate::progressive::log::{Log, LoggedStep};
use crate::progressive::mesh::{Change, Ends, Moved, ProgressiveMesh};

/// Does the steps of a log on the mesh that they were taken on. `finish` makes the rows of merged wedges
/// what they stand for, and `keeps_ends` tells that merged points are where one of the source was.
pub(super) fn replay(
    source: &Mesh,
    log: &Log,
    keeps_ends: bool,
    finish: impl Fn(&mut [f32]),
) -> ProgressiveMesh {
    let mut replay = Replay::new(source);
    let (mut error, width) = (0.0f64, source.layout.len());
    for at in 0..log.len() {
        let step = log.step(at, width);
        error = error.max(step.error);
        match step.position {
            Some(_) => replay.merge(&step),
            None => replay.remove_shell(step.points[0]),
        }
        let start = replay.out.rows.len();
        replay.out.rows.extend_from_slice(step.rows);
        let mut position = step.position;
        let own = &mut replay.out.rows[start..];
        if width > 0 {
            own.chunks_exact_mut(width).for_each(&finish);
        }
        if keeps_ends {
            position = position.map(|_| source.positions[step.points[0]]);
            for (&wedge, at) in step.moved.iter().zip(0..) {
                if source.wedge_points[wedge] == step.points[0] {
                    own[at * width..][..width].copy_from_slice(source.row(wedge));
                }
            }
        }
        replay.finish(position, error as f32);
    }
    let mut out = replay.out;
    out.levels.clone_from(&log.levels);
    out.applied = out.collapses.len();
    out.seek(0);
    out
}

struct Replay {
    out: ProgressiveMesh,
    /// Per point: its corners, those of triangles that are gone among them.
    corners: Vec<Vec<CornerId>>,
}

impl Replay {
    fn new(source: &Mesh) -> Self {
        let mut corners = vec![Vec::new(); source.positions.len()];
        for triangle in 0..source.triangles.len() {
            for (slot, point) in source.triangle_points(triangle).into_iter().enumerate() {
                corners[point.index()].push(TriangleId::new(triangle).corner(slot));
            }
        }
        let out = ProgressiveMesh {
            mesh: source.clone(),
            live: vec![true; source.triangles.len()],
            applied: 0,
            collapses: Vec::new(),
            points: Vec::new(),
            moved: Vec::new(),
            rows: Vec::new(),
            corners: Vec::new(),
            triangles: Vec::new(),
            counts: vec![source.triangles.len()],
            levels: Vec::new(),
            settles: Vec::new(),
        };
        Self { out, corners }
    }

    fn merge(&mut self, step: &LoggedStep<'_>) {
        let mut joined: Vec<CornerId> = Vec::new();
        for &point in step.points {
            joined.append(&mut self.corners[point.index()]);
        }
        let own = self.out.triangles.len();
        joined.retain(|corner| self.out.live[corner.triangle()]);
        for &corner in &joined {
            let points = self.out.mesh.triangle_points(corner.triangle().index());
            let merging = points.iter().filter(|point| step.points.contains(point)).count();
            if merging > 1 && !self.out.triangles[own..].contains(&corner.triangle()) {
                self.out.triangles.push(corner.triangle());
            }
        }
        for &triangle in &self.out.triangles[own..] {
            self.out.live[triangle] = false;
        }
        joined.retain(|corner| self.out.live[corner.triangle()]);
        for &corner in &joined {
            let wedge = &mut self.out.mesh.triangles[corner.triangle()][corner.slot()];
            let new = step.renamed.iter().find(|[before, _]| before == wedge);
            if let Some(&[before, after]) = new {
                *wedge = after;
                self.out.corners.push(Change { corner, before, after });
            }
        }
        let kept = step.points[0];
        for &wedge in step.moved {
            let before = std::mem::replace(&mut self.out.mesh.wedge_points[wedge], kept);
            self.out.moved.push(Moved { wedge, before });
        }
        self.corners[kept.index()] = joined;
        self.out.points.extend_from_slice(step.points);
    }

    fn remove_shell(&mut self, point: PointId) {
        let mut waiting = vec![point];
        while let Some(point) = waiting.pop() {
            for corner in std::mem::take(&mut self.corners[point.index()]) {
                if std::mem::take(&mut self.out.live[corner.triangle()]) {
                    self.out.triangles.push(corner.triangle());
                    waiting.extend(self.out.mesh.triangle_points(corner.triangle().index()));
                }
            }
        }
    }

    fn finish(&mut self, position: Option<glam::Vec3>, error: f32) {
        let own = self.out.collapses.last().map_or(0, |ends| ends.triangles);
        let gone = self.out.triangles.len() - own;
        self.out.counts.push(self.out.counts.last().map_or(0, |left| left - gone));
        self.out.collapses.push(Ends {
            position,
            error,
            points: self.out.points.len(),
            moved: self.out.moved.len(),
            corners: self.out.corners.len(),
            triangles: self.out.triangles.len(),
        });
        self.out.swap(self.out.collapses.len() - 1);
    }
}
