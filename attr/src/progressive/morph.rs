//! Where a level comes to lie in a coarser one.
//!
//! Every collapse between two levels moves points to where one of them goes on, and unifies wedges. Followed to
//! the end, each point and wedge of the finer level lies on one of the coarser. Moved there, triangles that stay
//! are those of the coarser level, and those that vanish have two corners at one place: both surfaces are the same.

use std::ops::Range;

use glam::Vec3;

use crate::chain::Level;
use crate::id::{PointId, WedgeId};
use crate::mesh::Mesh;
use crate::progressive::mesh::ProgressiveMesh;

/// The place in a coarser level that a wedge comes to lie at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MorphEnd {
    /// A wedge of that level.
    Wedge(WedgeId),
    /// A position, where none of its group is: triangles there have no area any more, so that other
    /// attributes do not matter.
    Place(Vec3),
}

impl ProgressiveMesh {
    /// Where each wedge of a level comes to lie in a coarser one. `collapses` of the record lead from the one to
    /// the other; 0 is the source. Positions and attributes may be others than on record, as after a polish; the
    /// mesh is where the coarser level is then.
    pub fn morph(
        &mut self,
        fine: &Level,
        coarse: &Level,
        collapses: Range<usize>,
    ) -> Vec<MorphEnd> {
        self.seek(collapses.end);
        let ends = self.ends(coarse, collapses);
        let places = ends.places(fine);
        let at_points = wedges_at_points(&coarse.mesh);
        let [groups, coarse_groups] = [&fine.mesh, &coarse.mesh].map(wedge_groups);
        let end = |wedge: usize| {
            let point = fine.mesh.wedge_points[WedgeId::new(wedge)];
            let name = fine.point_sources[point.index()];
            let root = ends.roots[name.index()];
            let Some(at) = ends.points[root.index()] else {
                return MorphEnd::Place(places[root.index()]);
            };
            let own = &at_points[at.index()];
            let is_own = |&&end: &&WedgeId| coarse_groups[end.index()] == groups[wedge];
            let known = ends.wedges[fine.wedge_sources[wedge].index()];
            let known = own.iter().filter(is_own).find(|&&end| known == Some(end));
            let row = fine.mesh.row(WedgeId::new(wedge));
            let off = |end: &WedgeId| distance(row, coarse.mesh.row(*end));
            let nearest = || own.iter().filter(is_own).min_by(|a, b| off(a).total_cmp(&off(b)));
            let end = known.or_else(nearest);
            end.map_or(MorphEnd::Place(coarse.mesh.positions[at]), |&end| MorphEnd::Wedge(end))
        };
        (0..fine.mesh.wedge_points.len()).map(end).collect()
    }

    /// Follows the collapses back from a level.
    fn ends(&self, coarse: &Level, collapses: Range<usize>) -> Ends {
        let state = self.state();
        let mut ends = Ends {
            roots: (0..state.positions.len()).map(PointId::new).collect(),
            shells: (0..state.positions.len()).map(PointId::new).collect(),
            points: vec![None; state.positions.len()],
            wedges: vec![None; state.wedge_points.len()],
        };
        for (at, name) in coarse.point_sources.iter().enumerate() {
            ends.points[name.index()] = Some(PointId::new(at));
        }
        for (at, name) in coarse.wedge_sources.iter().enumerate() {
            ends.wedges[name.index()] = Some(WedgeId::new(at));
        }
        for at in collapses.rev() {
            let collapse = self.collapse(at);
            if let [kept, gone @ ..] = collapse.points {
                gone.iter().for_each(|gone| ends.roots[gone.index()] = ends.roots[kept.index()]);
            } else {
                // Triangles that are away keep the corners that they had.
                for &triangle in collapse.triangles {
                    let [a, b, c] = state.triangle_points(triangle.index());
                    ends.join(a, b);
                    ends.join(a, c);
                }
            }
            for change in collapse.corners {
                ends.wedges[change.before.index()] = ends.wedges[change.after.index()];
            }
        }
        ends
    }
}

/// What points and wedges of the source are after some collapses.
struct Ends {
    /// Per point of the source: the one that it goes on by.
    roots: Vec<PointId>,
    /// Per point: another of its shell, if that is removed, or itself.
    shells: Vec<PointId>,
    /// The points and wedges of the coarser level by their names.
    points: Vec<Option<PointId>>,
    wedges: Vec<Option<WedgeId>>,
}

impl Ends {
    fn shell(&self, mut point: PointId) -> PointId {
        while self.shells[point.index()] != point {
            point = self.shells[point.index()];
        }
        point
    }

    fn join(&mut self, a: PointId, b: PointId) {
        let [a, b] = [self.shell(a), self.shell(b)];
        self.shells[a.max(b).index()] = a.min(b);
    }

    /// Per point of the source that is in the coarser level no more: the middle of those of the finer level that
    /// go with it, all of a shell that is removed.
    fn places(&self, fine: &Level) -> Vec<Vec3> {
        let mut sums = vec![(glam::DVec3::ZERO, 0.0); self.roots.len()];
        for (&name, position) in fine.point_sources.iter().zip(&fine.mesh.positions) {
            let (sum, count) = &mut sums[self.shell(self.roots[name.index()]).index()];
            (*sum, *count) = (*sum + position.as_dvec3(), *count + 1.0);
        }
        let place = |point: usize| {
            let (sum, count) = sums[self.shell(PointId::new(point)).index()];
            (sum / f64::max(count, 1.0)).as_vec3()
        };
        (0..self.roots.len()).map(place).collect()
    }
}

fn wedges_at_points(mesh: &Mesh) -> Vec<Vec<WedgeId>> {
    let mut at_points = vec![Vec::new(); mesh.positions.len()];
    for (wedge, point) in mesh.wedge_points.iter().enumerate() {
        at_points[point.index()].push(WedgeId::new(wedge));
    }
    at_points
}

/// The group of each wedge.
fn wedge_groups(mesh: &Mesh) -> Vec<u32> {
    let mut groups = vec![0; mesh.wedge_points.len()];
    for (wedges, &group) in mesh.triangles.iter().zip(mesh.groups.iter()) {
        wedges.iter().for_each(|wedge| groups[wedge.index()] = group);
    }
    groups
}

fn distance(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}
