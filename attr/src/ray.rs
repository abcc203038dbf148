//! A ray against triangles, in f64, and against boxes, in f32.

use glam::{BVec3, DVec3, Vec3};

use crate::bvh::Node;

/// More than rounding in f32 takes off the way along a ray to a box, on both sides of a comparison
/// (Ize, "Robust BVH ray traversal", JCGT 2013).
pub(crate) const RAY_MARGIN: f64 = 1.0 + 8.0 * f32::EPSILON as f64;

/// A ray made ready to be tested against triangles, after Woop, Benthin & Wald, "Watertight
/// ray/triangle intersection", JCGT 2013: sheared so that it runs along its longest axis. Two
/// triangles then see their shared edge with opposite signs, and no ray slips between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shear {
    origin: DVec3,
    axes: [usize; 3],
    shear: DVec3,
}

impl Shear {
    /// `direction` is finite and not zero.
    pub(crate) fn new(origin: Vec3, direction: Vec3) -> Self {
        let z = direction.abs().max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let direction = direction.as_dvec3();
        let along = direction[z];
        let shear = DVec3::new(direction[axes[0]] / along, direction[axes[1]] / along, 1.0 / along);
        Self { origin: origin.as_dvec3(), axes, shear }
    }

    /// Distance (in lengths of the direction, at least 0) and barycentrics of the hit, from either
    /// side, edges included. A triangle seen edge-on or without area is not hit.
    pub(crate) fn hit(&self, corners: &[Vec3; 3]) -> Option<(f64, DVec3)> {
        let [a, b, c] = corners.map(|corner| {
            let q = corner.as_dvec3() - self.origin;
            let z = q[self.axes[2]];
            let (x, y) = (q[self.axes[0]], q[self.axes[1]]);
            DVec3::new(x - self.shear.x * z, y - self.shear.y * z, z * self.shear.z)
        });
        let weights =
            DVec3::new(c.x * b.y - c.y * b.x, a.x * c.y - a.y * c.x, b.x * a.y - b.y * a.x);
        if weights.min_element() < 0.0 && weights.max_element() > 0.0 {
            return None;
        }
        let sum = weights.x + weights.y + weights.z;
        if sum == 0.0 {
            return None;
        }
        let weights = weights / sum;
        let distance = weights.dot(DVec3::new(a.z, b.z, c.z));
        (distance >= 0.0).then_some((distance, weights))
    }
}

/// A ray made ready to be tested against boxes.
pub(crate) struct Slabs {
    origin: Vec3,
    /// One over the direction; 0 where it is 0.
    inverse: Vec3,
    /// The axes along which the ray does not move.
    still: BVec3,
    /// Infinity on those axes, where the ray never leaves a box; 0 on the others.
    never: Vec3,
}

impl Slabs {
    pub(crate) fn new(origin: Vec3, direction: Vec3) -> Self {
        let still = direction.cmpeq(Vec3::ZERO);
        Self {
            origin,
            inverse: Vec3::select(still, Vec3::ZERO, direction.recip()),
            still,
            never: Vec3::select(still, Vec3::INFINITY, Vec3::ZERO),
        }
    }

    /// The distance along the ray at which it enters a node's box, at least 0; infinite if it
    /// misses.
    #[inline]
    pub(crate) fn entry(&self, node: &Node) -> f64 {
        let (low, high) = (node.min - self.origin, node.max - self.origin);
        let inside = low.cmple(Vec3::ZERO) & high.cmpge(Vec3::ZERO);
        let (start, end) = (low * self.inverse, high * self.inverse);
        let enter = start.min(end).max_element().max(0.0);
        let leave = (start.max(end) + self.never).min_element();
        let misses =
            (self.still & !inside).any() || f64::from(enter) > f64::from(leave) * RAY_MARGIN;
        if misses { f64::INFINITY } else { f64::from(enter) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_point() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-8i8..8).prop_map(|p| Vec3::from(p.map(f32::from)) / 4.0)
    }

    #[test]
    fn both_sides_are_hit_and_edges_belong() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for (direction, distance) in [(Vec3::NEG_Z, 2.0), (Vec3::new(0.0, 0.0, -4.0), 0.5)] {
            let origin = Vec3::new(0.5, 0.5, 2.0);
            let (found, weights) = Shear::new(origin, direction).hit(&corners).unwrap();
            assert_eq!((found, weights), (distance, DVec3::new(0.0, 0.5, 0.5)));
            let below = Shear::new(origin * Vec3::new(1.0, 1.0, -1.0), -direction);
            assert_eq!(below.hit(&corners).unwrap(), (found, weights));
        }
        assert!(Shear::new(Vec3::NEG_X, Vec3::X).hit(&corners).is_none(), "seen edge-on");
    }

    #[test]
    fn a_ray_that_stands_still_on_an_axis_enters_a_flat_box() {
        let node = Node { min: Vec3::ZERO, max: Vec3::new(0.0, 1.0, 1.0), count: 1, offset: 0 };
        let entry = |origin, direction| Slabs::new(origin, direction).entry(&node);
        assert_eq!(entry(Vec3::new(0.0, 0.5, -2.0), Vec3::Z), 2.0);
        assert_eq!(entry(Vec3::new(0.1, 0.5, -2.0), Vec3::Z), f64::INFINITY);
        assert_eq!(entry(Vec3::new(0.0, 0.5, 2.0), Vec3::Z), f64::INFINITY);
        assert_eq!(entry(Vec3::new(0.0, 0.5, 0.5), Vec3::Z), 0.0);
    }

    proptest! {
        /// A ray aimed at a point inside hits it there.
        #[test]
        fn a_ray_hits_what_it_is_aimed_at(
            corners in prop::array::uniform3(any_point()), origin in any_point(), u in 0.1..0.4f32, v in 0.1..0.4f32
        ) {
            let [a, b, c] = corners;
            let target = a * (1.0 - u - v) + b * u + c * v;
            let height = (target - origin).dot((b - a).cross(c - a)).abs();
            prop_assume!(height > 1e-2);
            let (distance, weights) = Shear::new(origin, target - origin).hit(&corners).unwrap();
            prop_assert!((distance - 1.0).abs() < 1e-3);
            prop_assert!((weights - DVec3::new(f64::from(1.0 - u - v), f64::from(u), f64::from(v))).length() < 1e-3);
        }
    }
}
