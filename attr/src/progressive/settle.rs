//! Levels that were polished, on the way down.
//!
//! At the place of each level points and wedges take the values that it has, to the bit, and go on from
//! there. So that nothing jumps, a mesh between two such places is moved on its way to the next: by the
//! share of its collapses that are done, of what the point or wedge that each ends in will be moved by.

use glam::Vec3;

use crate::chain::Level;
use crate::id::{PointId, WedgeId};
use crate::mesh::Mesh;
use crate::progressive::mesh::{Collapse, Extracted, ProgressiveMesh, Settle};

impl ProgressiveMesh {
    /// The mesh as its collapses have left it, as a level.
    pub fn level(&self) -> Level {
        let Extracted { mesh, points, wedges } = self.extract_recorded();
        let (target, error) = (mesh.triangles.len(), f64::from(self.error()));
        Level { mesh, point_sources: points, wedge_sources: wedges, target, error, stopped: None }
    }

    /// Takes positions and attributes of levels, each after so many collapses, the finest first: those of
    /// [`levels`](Self::levels), or any between. Of two at one place the first counts.
    pub fn settle(&mut self, places: &[usize], levels: &[&Level]) {
        self.seek(0);
        for (&at, level) in places.iter().zip(levels) {
            if at > self.settles.last().map_or(0, |last| last.at) {
                self.seek(at);
                let settle = self.settled(at, level);
                self.settles.push(settle);
                self.swap_settled(self.settles.len() - 1);
            }
        }
        self.seek(0);
    }

    /// The values of the mesh before it was settled, if it is where a level was made.
    pub fn unsettled(&self) -> Option<Unsettled<'_>> {
        let at = self.settles.binary_search_by_key(&self.applied(), |settle| settle.at).ok()?;
        let settle = &self.settles[at];
        let before = at.checked_sub(1).map_or(0, |before| self.settles[before].at);
        Some(Unsettled {
            points: &settle.points,
            positions: &settle.positions,
            wedges: &settle.wedges,
            rows: &settle.rows,
            collapses: settle.at - before,
        })
    }

    /// What a level changes of the mesh as it is now.
    fn settled(&self, at: usize, level: &Level) -> Settle {
        let (mut own, state) = (Settle { at, ..Settle::default() }, self.state());
        for (&point, &position) in level.point_sources.iter().zip(&level.mesh.positions) {
            own.points.push(point);
            own.positions.push(position);
            own.moves.push(position - state.positions[point]);
        }
        for (wedge, &source) in level.wedge_sources.iter().enumerate() {
            let row = level.mesh.row(WedgeId::new(wedge));
            own.wedges.push(source);
            own.rows.extend_from_slice(row);
            own.row_moves.extend(row.iter().zip(state.row(source)).map(|(to, from)| to - from));
        }
        own
    }

    /// The mesh as it is now, moved on its way to where it is settled next.
    pub fn extract(&self) -> Extracted {
        let mut out = self.extract_recorded();
        let next = self.settles.partition_point(|settle| settle.at <= self.applied());
        let before = next.checked_sub(1).map_or(0, |last| self.settles[last].at);
        if let Some(settle) = self.settles.get(next)
            && before < self.applied()
        {
            let share = (self.applied() - before) as f32 / (settle.at - before) as f32;
            self.move_towards(settle, share, &mut out);
        }
        out
    }

    fn move_towards(&self, settle: &Settle, share: f32, out: &mut Extracted) {
        let Mesh { positions, wedge_points, .. } = self.state();
        let mut ends =
            Ends { points: vec![None; positions.len()], wedges: vec![None; wedge_points.len()] };
        (0..).zip(&settle.points).for_each(|(at, &point)| ends.points[point] = Some(at));
        (0..).zip(&settle.wedges).for_each(|(at, &wedge)| ends.wedges[wedge] = Some(at));
        for at in (self.applied()..settle.at).rev() {
            ends.split(&self.collapse(at));
        }
        for (position, &point) in out.mesh.positions.iter_mut().zip(&out.points) {
            if let Some(end) = ends.points[point] {
                *position += share * settle.moves[end];
            }
        }
        let layout = self.layout();
        if layout.is_empty() {
            return;
        }
        let rows = out.mesh.attributes.chunks_exact_mut(layout.len());
        for (row, &wedge) in rows.zip(&out.wedges) {
            if let Some(end) = ends.wedges[wedge] {
                let moves = &settle.row_moves[end * layout.len()..][..layout.len()];
                row.iter_mut().zip(moves).for_each(|(x, by)| *x += share * by);
                if layout.normal {
                    let normal = &mut row[layout.normal()..][..3];
                    let unit = Vec3::from_slice(normal).normalize_or(Vec3::Z);
                    normal.copy_from_slice(&unit.to_array());
                }
            }
        }
    }
}

/// The values of a mesh before it took those of a level, as its last collapses had left them.
#[derive(Clone, Copy, Debug)]
pub struct Unsettled<'a> {
    /// The points that are there.
    pub points: &'a [PointId],
    /// Their positions.
    pub positions: &'a [Vec3],
    /// The wedges that are there.
    pub wedges: &'a [WedgeId],
    /// A row of the layout for each.
    pub rows: &'a [f32],
    /// Number of collapses since the level before, or the source.
    pub collapses: usize,
}

/// The place in a settled mesh that each point and wedge ends in.
struct Ends {
    points: Vec<Option<usize>>,
    wedges: Vec<Option<usize>>,
}

impl Ends {
    /// What splits off ends where it came from.
    fn split(&mut self, collapse: &Collapse<'_>) {
        if let [kept, gone @ ..] = collapse.points {
            gone.iter().for_each(|&gone| self.points[gone] = self.points[*kept]);
        }
        for change in collapse.corners {
            self.wedges[change.before] = self.wedges[change.after];
        }
    }
}
