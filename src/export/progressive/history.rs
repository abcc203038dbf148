//! What happens to surfaces while they are refined, written down.

use glam::Vec3;

use super::header::Header;
use super::observer::Observer;
use super::surface::{Changes, Surface};

/// No wedge.
pub(super) const NONE: u32 = u32::MAX;

/// What has happened to all surfaces so far.
pub(super) struct History {
    /// Triangles at each time.
    pub(super) triangles: Vec<u32>,
    pub(super) surfaces: Vec<Lines>,
}

/// What has happened to a surface.
#[derive(Clone, Default)]
pub(super) struct Lines {
    /// Per triangle.
    pub(super) births: Vec<u32>,
    /// Corners with the times from which on they have wedges.
    pub(super) corners: Vec<[u32; 3]>,
    /// Wedges with the times of their values, and these: each is a wedge of a surface of its own, twice.
    pub(super) wedges: Vec<[u32; 2]>,
    pub(super) values: Surface,
    pub(super) ends: Surface,
    pub(super) carried: Vec<Vec<u8>>,
    /// Per wedge.
    pub(super) parents: Vec<u32>,
    pub(super) places: Vec<u32>,
    pub(super) shares: Vec<(u32, f32)>,
}

impl History {
    pub(super) fn new(header: &Header) -> Self {
        let surfaces = vec![Lines::default(); header.surfaces.len()];
        Self { triangles: vec![0], surfaces }
    }

    fn time(&self) -> u32 {
        self.triangles.len() as u32 - 1
    }
}

impl Observer for History {
    fn begun(&mut self, index: usize, surface: &Surface) {
        let lines = &mut self.surfaces[index];
        lines.values.layout = surface.layout;
        lines.ends.layout = surface.layout;
        lines.add_triangles(surface, 0);
        lines.add_all(surface, 0);
        lines.descend(surface, None);
        self.triangles[0] += surface.triangles.len() as u32;
    }

    fn placed(&mut self, index: usize, surface: &Surface, changes: &Changes, _: f32) {
        let time = self.time() + 1;
        let lines = &mut self.surfaces[index];
        let new = surface.triangles.len() - lines.births.len();
        lines
            .corners
            .extend(changes.corners.iter().map(|&[corner, wedge, _]| [corner, time, wedge]));
        lines.add_triangles(surface, time);
        let wedges = changes.wedges.iter().map(|new| new.wedge);
        for wedge in changes.moved.iter().copied().chain(wedges) {
            lines.add_value(surface, wedge, time);
        }
        lines.descend(surface, Some(changes));
        lines.shares.push((time, surface.share()));
        self.triangles.push(self.triangles[time as usize - 1] + new as u32);
    }

    fn unsettled(&mut self, index: usize, surface: &Surface) {
        // It is the level still until the next split.
        let time = self.time() + 1;
        self.surfaces[index].add_all(surface, time);
    }
}

impl Lines {
    fn add_triangles(&mut self, surface: &Surface, time: u32) {
        for triangle in self.births.len()..surface.triangles.len() {
            self.births.push(time);
            let corners = (0..).zip(surface.triangles[triangle]);
            self.corners.extend(corners.map(|(at, wedge)| [triangle as u32 * 3 + at, time, wedge]));
        }
    }

    fn add_all(&mut self, surface: &Surface, time: u32) {
        for wedge in 0..surface.wedge_points.len() as u32 {
            self.add_value(surface, wedge, time);
        }
    }

    fn add_value(&mut self, surface: &Surface, wedge: u32, time: u32) {
        self.wedges.push([wedge, time]);
        let position = surface.positions[surface.wedge_points[wedge as usize] as usize];
        self.values.add_alone(position, surface.row(wedge));
        let (position, row) = surface.end(wedge);
        self.ends.add_alone(position, &row);
        self.carried.push(surface.carried(wedge).to_vec());
    }

    /// Tells where wedges come from that have none yet.
    fn descend(&mut self, surface: &Surface, changes: Option<&Changes>) {
        self.parents.resize(surface.wedge_points.len(), NONE);
        self.places.resize(surface.wedge_points.len(), NONE);
        let Some(changes) = changes else { return };
        let group = |wedge: u32| surface.wedge_groups[wedge as usize];
        for new in &changes.wedges {
            let parent = new.like.filter(|_| new.was_one);
            let is_new_point = surface.wedge_points[new.wedge as usize] >= changes.first_point;
            let at_center = || {
                let mut own = changes.moved.iter().filter(|own| group(**own) == group(new.wedge));
                own.next().copied()
            };
            let place = parent.or_else(|| surface.elder(new.wedge).filter(|_| !is_new_point));
            self.parents[new.wedge as usize] = parent.unwrap_or(NONE);
            self.places[new.wedge as usize] = place.or_else(at_center).unwrap_or(NONE);
        }
    }
}

impl Surface {
    /// Adds a wedge at a point of its own.
    fn add_alone(&mut self, position: Vec3, row: &[f32]) {
        self.wedge_points.push(self.positions.len() as u32);
        self.positions.push(position);
        self.rows.extend(row);
    }
}
