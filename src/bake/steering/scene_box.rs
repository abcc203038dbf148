//! The box around all that a scene shows.

use glam::{DMat4, DVec3};
use rustc_hash::FxHashMap;

use crate::surface::geometry::Geometry;

/// A box along the axes of the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct SceneBox {
    pub(super) low: DVec3,
    pub(super) high: DVec3,
}

impl SceneBox {
    /// The box around every mesh, wherever it is shown; one that is not shown counts where it lies.
    pub(super) fn around(geometries: &[Geometry], worlds: &FxHashMap<usize, Vec<DMat4>>) -> Self {
        let mut own = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        for geometry in geometries {
            let worlds = worlds.get(&geometry.meshes[0]).filter(|worlds| !worlds.is_empty());
            for world in worlds.map_or(&[DMat4::IDENTITY][..], Vec::as_slice) {
                own.add(geometry, world);
            }
        }
        own
    }

    fn add(&mut self, geometry: &Geometry, world: &DMat4) {
        for position in &geometry.welded.mesh.positions {
            let p = world.transform_point3(position.as_dvec3());
            (self.low, self.high) = (self.low.min(p), self.high.max(p));
        }
    }

    /// The length from corner to corner, in the units of the scene.
    pub(super) fn diagonal(&self) -> f64 {
        (self.high - self.low).max(DVec3::ZERO).length()
    }
}
