//! The minimizer of a quadric in position.

use glam::DVec3;
use nalgebra::{Matrix3, Vector3};

use crate::equal_volume::Plane;
use crate::quadric::PointQuadric;

/// The point that minimizes `quadric` plus `pull` times the squared distance to `anchor`.
///
/// The pull makes every direction count: on a flat patch or along a straight edge, where the
/// quadric alone has no single minimum, the answer is the one nearest to `anchor` instead of a
/// point far away. With a plane, the minimum is that of its points, by a Lagrange multiplier. `None` if the sum is still not positive definite, which rounding can cause when
/// `pull` is zero or vanishes beside the quadric (Sylvester's criterion).
pub(crate) fn minimize(
    quadric: &PointQuadric,
    anchor: DVec3,
    pull: f64,
    plane: Option<Plane>,
) -> Option<DVec3> {
    let [xx, xy, xz, yy, yz, zz] = quadric.a;
    let (xx, yy, zz) = (xx + pull, yy + pull, zz + pull);
    let matrix = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let inverse = matrix.try_inverse()?;
    // The last entry of the inverse is the second leading minor over the determinant.
    if !(xx > 0.0 && xx * yy > xy * xy && inverse.m33 > 0.0) {
        return None;
    }
    let right = anchor * pull - quadric.b;
    let solve = |right: DVec3| {
        let solution = inverse * Vector3::new(right.x, right.y, right.z);
        DVec3::new(solution.x, solution.y, solution.z)
    };
    let mut point = solve(right);
    if let Some(plane) = plane {
        let along = solve(plane.normal);
        point -= along * (plane.height(point) / plane.normal.dot(along));
    }
    point.is_finite().then_some(point)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planes(planes: &[(DVec3, DVec3)]) -> PointQuadric {
        let mut sum = PointQuadric::default();
        for &(point, normal) in planes {
            sum.add(&PointQuadric::from_plane(point, normal, 1.0));
        }
        sum
    }

    #[test]
    fn three_planes_meet_in_their_corner() {
        let corner = DVec3::new(0.25, -0.5, 0.75);
        let quadric = planes(&[(corner, DVec3::X), (corner, DVec3::Y), (corner, DVec3::Z)]);
        let found = minimize(&quadric, DVec3::ZERO, 1e-9, None).unwrap();
        assert!((found - corner).length() < 1e-8);
    }

    #[test]
    fn a_flat_patch_gives_the_foot_of_the_anchor() {
        let quadric = planes(&[(DVec3::Z, DVec3::Z)]);
        let found = minimize(&quadric, DVec3::new(0.3, 0.4, 9.0), 1e-4, None).unwrap();
        assert!((found - DVec3::new(0.3, 0.4, 1.0)).length() < 1e-2);
    }

    #[test]
    fn on_a_plane_no_neighbor_on_it_costs_less() {
        let quadric = planes(&[
            (DVec3::new(0.1, 0.0, 0.4), DVec3::new(0.6, 0.0, 0.8)),
            (DVec3::Y, DVec3::Y),
            (DVec3::X, DVec3::new(0.0, 0.28, 0.96)),
        ]);
        let plane = Plane { normal: DVec3::new(2.0, -1.0, 2.0) / 3.0, offset: 0.7 };
        let best = minimize(&quadric, DVec3::ZERO, 0.0, Some(plane)).unwrap();
        assert!(plane.height(best).abs() < 1e-12);
        for step in [plane.normal.any_orthonormal_vector(), plane.normal.cross(DVec3::X)] {
            for step in [step * 1e-3, step * -1e-3] {
                assert!(quadric.evaluate(best + step) > quadric.evaluate(best));
            }
        }
    }
}
