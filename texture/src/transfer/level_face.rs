//! Faces of a level as texels are made for them.

use glam::{DVec2, Vec3};

use super::owners::Placed;
use super::shading_mesh::ShadingTriangle;
use super::{Face, Job};

/// A face of the level, ready for all of its texels.
pub(super) struct LevelFace {
    pub(super) placed: Placed,
    pub(super) triangle: ShadingTriangle,
    pub(super) group: u32,
    pub(super) chart: u32,
}

impl LevelFace {
    /// The face in an image of `fine` parts of texels.
    pub(super) fn new(job: &Job<'_>, face: &Face, fine: [usize; 2]) -> Self {
        let level = &job.pairs[face.pair as usize].level;
        let triangle = face.triangle as usize;
        Self {
            placed: Placed::new(face.uvs, fine, job.wrap),
            triangle: level.triangle(triangle),
            group: level.mesh.groups[triangle],
            chart: level.charts[triangle],
        }
    }

    /// The position of a place in the image in the face's plane, in parts of texels.
    pub(super) fn position_at(&self, place: DVec2) -> Vec3 {
        self.triangle.position(self.placed.weights_at(place))
    }
}
