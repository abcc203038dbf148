//! Whether a record of collapses is whole.

use super::mesh::ProgressiveMesh;
use crate::error::{Error, Result};

impl ProgressiveMesh {
    /// Checks that every number is in range, that each collapse finds what it changes as the one before
    /// left it, and that all of them undone give the mesh as it is now, to the bit.
    ///
    /// # Errors
    /// [`Error::Invalid`] names the first collapse that is wrong.
    pub fn validate(&self) -> Result<()> {
        let invalid = |what: String| Err(Error::Invalid { what });
        let mut walked = self.clone();
        walked.seek(0);
        walked.mesh.validate()?;
        if self.counts.len() != self.collapses() + 1 || self.applied > self.collapses() {
            return invalid("collapses and triangle counts differ in number".into());
        }
        for at in 0..self.collapses() {
            if let Some(what) = walked.fault(at) {
                return invalid(format!("collapse {at}: {what}"));
            }
            walked.coarsen(1);
            let left = walked.live.iter().filter(|live| **live).count();
            // Counting is as long as the mesh: not after each.
            if at.is_power_of_two() && left != self.counts[at + 1] {
                return invalid(format!("collapse {at} leaves {left} triangles"));
            }
        }
        walked.seek(self.applied);
        if walked != *self {
            return invalid("collapses that are undone do not give back what was there".into());
        }
        Ok(())
    }

    /// The reason why a collapse that is next can't be done.
    fn fault(&self, at: usize) -> Option<&'static str> {
        let (collapse, mesh) = (self.collapse(at), &self.mesh);
        let [points, wedges] = [mesh.positions.len(), mesh.wedge_points.len()];
        if collapse.points.iter().any(|point| point.index() >= points) {
            return Some("a point that is not there");
        }
        for moved in collapse.moved {
            if moved.wedge.index() >= wedges || mesh.wedge_points[moved.wedge] != moved.before {
                return Some("a wedge is not at the point that it is moved from");
            }
            if !collapse.points.contains(&moved.before) {
                return Some("a wedge of a point that does not merge");
            }
        }
        for &triangle in collapse.triangles {
            if self.live.get(triangle.index()) != Some(&true) {
                return Some("a triangle that is not there vanishes");
            }
        }
        for change in collapse.corners {
            let triangle = change.corner.triangle();
            if self.live.get(triangle.index()) != Some(&true)
                || mesh.triangles[triangle][change.corner.slot()] != change.before
                || change.after.index() >= wedges
            {
                return Some("a corner does not have the wedge that it changes");
            }
        }
        if self.counts[at] - self.counts[at + 1] != collapse.triangles.len() {
            return Some("a count of triangles that is not its own");
        }
        None
    }
}
