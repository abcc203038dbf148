//! What a descent is to keep to.

use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::metric::Weights;

/// Options of a simplification.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Options<'a> {
    /// Weights of the metric.
    pub weights: Weights,
    /// No collapse may have an error above this, in the units of the mesh.
    pub max_error: Option<f64>,
    /// One per point, or empty if all are free: a locked point keeps its position and the
    /// attributes of its wedges to the bit, and no edge at it collapses.
    pub locked: &'a [bool],
}

impl Options<'_> {
    /// Checks that every figure makes sense and every list fits `mesh`.
    pub(crate) fn check(&self, mesh: &Mesh) -> Result<()> {
        let w = self.weights;
        if [w.uv, w.normal, w.color, w.border, w.seam].iter().any(|w| !w.is_finite() || *w < 0.0) {
            return Err(Error::Options { what: "weights must be finite and not negative".into() });
        }
        let points = mesh.positions.len();
        if !self.locked.is_empty() && self.locked.len() != points {
            let what = format!("{} locks for {points} points", self.locked.len());
            return Err(Error::Options { what });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;
    use crate::chain::{Level, polish_chain, simplify_chain};
    use crate::polish::Polish;
    use crate::testing::{grid, sphere, surface};
    use glam::Vec3;

    fn chain(mesh: &Mesh, target: usize, options: &Options<'_>) -> Level {
        simplify_chain(mesh, &[target], options, &AtomicUsize::new(0)).unwrap().remove(0)
    }

    fn polished(mesh: &Mesh, level: Level) -> Level {
        let mut levels = [level];
        polish_chain(mesh, &mut levels, &Polish::default(), &AtomicUsize::new(0)).unwrap();
        let [level] = levels;
        level
    }

    /// Fails unless every locked point of the source is there as it was, all of its wedges too.
    fn assert_kept(mesh: &Mesh, locked: &[bool], level: &Level) {
        let bits = |row: &[f32]| row.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        let mut found = vec![0; mesh.wedge_points.len()];
        for (wedge, &source) in level.wedge_sources.iter().enumerate() {
            let point = level.mesh.wedge_points[wedge];
            let stands_for = level.point_sources[point];
            if locked[stands_for.index()] {
                let (own, old) = (level.mesh.positions[point], mesh.positions[stands_for]);
                assert_eq!(bits(&own.to_array()), bits(&old.to_array()));
                let own = level.mesh.row(crate::WedgeId::new(wedge));
                assert_eq!(bits(own), bits(mesh.row(source)));
                found[source.index()] += 1;
            }
        }
        for (wedge, &point) in mesh.wedge_points.iter().enumerate() {
            assert!(!locked[point.index()] || found[wedge] == 1, "wedge {wedge}");
        }
    }

    #[test]
    fn locked_points_keep_their_bits_through_descent_and_polish() {
        let bumps = surface(30, |x, y| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()));
        for mesh in [bumps, sphere(24)] {
            let locked: Vec<bool> = mesh.positions.iter().map(|p| p.x > 0.6).collect();
            let options = Options { locked: &locked, ..Options::default() };
            let level = chain(&mesh, mesh.triangles.len() / 2, &options);
            assert_eq!(level.stopped, None);
            assert_kept(&mesh, &locked, &level);
            assert_kept(&mesh, &locked, &polished(&mesh, level));
        }
    }

    #[test]
    fn locks_hold_in_regions_and_stop_what_is_locked_whole() {
        let mesh = sphere(182);
        let locked: Vec<bool> = mesh.positions.iter().map(|p| p.z > 0.5).collect();
        let options = Options { locked: &locked, ..Options::default() };
        assert_kept(&mesh, &locked, &chain(&mesh, mesh.triangles.len() / 2, &options));
        let (mesh, locked) = (grid(4), [true; 25]);
        let options = Options { locked: &locked, ..Options::default() };
        let level = chain(&mesh, 2, &options);
        assert_eq!((level.mesh.triangles.len(), level.stopped.is_some()), (32, true));
    }

    #[test]
    fn lists_that_do_not_fit_are_refused() {
        let options = Options { locked: &[true], ..Options::default() };
        let refused = simplify_chain(&grid(2), &[2], &options, &AtomicUsize::new(0));
        assert!(refused.unwrap_err().to_string().contains("1 locks for 9 points"));
    }
}
