//! Splits that were read, as a record has them.

use glam::Vec3;
use seamwise_attr::{Change, CornerId, Moved, PointId, Split, TriangleId, WedgeId};

use super::observer::Observer;
use super::surface::{Changes, Surface};

/// The splits of each surface.
#[derive(Debug)]
pub(super) struct Recorder {
    pub(super) splits: Vec<Vec<Split>>,
    before: Option<Before>,
}

impl Recorder {
    pub(super) fn new(surfaces: usize) -> Self {
        Self { splits: vec![Vec::new(); surfaces], before: None }
    }
}

impl Observer for Recorder {
    fn parted(&mut self, _: usize, surface: &Surface, changes: &Changes) {
        self.before = Some(Before::of(surface, changes));
    }

    fn placed(&mut self, index: usize, surface: &Surface, changes: &Changes, error: f32) {
        let split = self.before.take().map(|before| before.split(surface, changes, error));
        self.splits[index].extend(split);
    }
}

/// What a split of a surface was, from the values before it.
#[derive(Debug)]
struct Before {
    position: Vec3,
    rows: Vec<f32>,
}

impl Before {
    /// The values of what a split has changed the corners of, and not yet the values.
    fn of(surface: &Surface, changes: &Changes) -> Self {
        let position = changes.center.map_or(Vec3::ZERO, |at| surface.positions[at as usize]);
        let rows = changes.moved.iter().flat_map(|&wedge| surface.row(wedge)).copied().collect();
        Self { position, rows }
    }

    /// The split as a record has it.
    fn split(self, surface: &Surface, changes: &Changes, error: f32) -> Split {
        let new = changes.first_point..surface.positions.len() as u32;
        let points = changes.center.into_iter().chain(new).map(PointId);
        let moved = changes.moved.iter().map(|&wedge| Moved {
            wedge: WedgeId(wedge),
            before: PointId(surface.wedge_points[wedge as usize]),
        });
        let corner = |&[corner, before, after]: &[u32; 3]| Change {
            corner: CornerId(corner),
            before: WedgeId(before),
            after: WedgeId(after),
        };
        Split {
            points: if changes.center.is_some() { points.collect() } else { Vec::new() },
            position: self.position,
            error,
            moved: moved.collect(),
            rows: self.rows,
            corners: changes.corners.iter().map(corner).collect(),
            triangles: (changes.first_triangle..surface.triangles.len())
                .map(TriangleId::new)
                .collect(),
        }
    }
}
