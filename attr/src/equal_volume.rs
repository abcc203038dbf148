//! The planes on which a collapse keeps the volume, or the area within a border (Lindstrom & Turk, "Fast and memory efficient
//! polygonal simplification", Visualization 1998, §4.1; as a Lagrange constraint Hoppe, "New quadric
//! metric", Visualization 1999).
//!
//! The tetrahedra between the triangles t around an edge and the merged point v have signed volumes
//! that add up to nothing where
//!
//! ```text
//! Σ n_t · v = Σ n_t · p_t,     n_t = (b − a) × (c − a),  p_t any corner of t
//! ```
//!
//! Where the triangles around the edge all but close, their normals cancel and no v changes much: there is
//! no such plane, and the collapse is free.
//!
//! The area vectors of these triangles add up to what their rim encloses. Seen along the sum before, with unit
//! vector n, it stays what it is where
//!
//! ```text
//! Σ ((p − q) × n) · v = Σ n_t · n − Σ (p × q) · n,     p, q the corners but v of a triangle that stays
//! ```
//!
//! Within a surface p and q go all around, and both sides are nothing: no border recedes there.

use glam::DVec3;

/// The normals must add up to this share of what they would if they were parallel.
const LEAST_SHARE: f64 = 0.05;

/// Points v with normal · v = offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    /// Unit normal.
    pub(crate) normal: DVec3,
    pub(crate) offset: f64,
}

impl Plane {
    /// The plane on which a point may replace the inner points of `triangles` without a change of
    /// volume.
    pub(crate) fn of_equal_volume(triangles: impl Iterator<Item = [DVec3; 3]>) -> Option<Self> {
        let (mut sum, mut offset, mut area) = (DVec3::ZERO, 0.0, 0.0);
        for [a, b, c] in triangles {
            let normal = (b - a).cross(c - a);
            sum += normal;
            offset += normal.dot(a);
            area += normal.length();
        }
        let length = sum.length();
        (length > LEAST_SHARE * area)
            .then(|| Self { normal: sum / length, offset: offset / length })
    }

    /// The plane on which a point may replace the inner points of `triangles` without a change of the area
    /// that they cover, where `staying` are the other corners of those that are left.
    pub(crate) fn of_equal_area(
        triangles: impl Iterator<Item = [DVec3; 3]>,
        staying: impl Iterator<Item = [DVec3; 2]>,
    ) -> Option<Self> {
        let before: DVec3 = triangles.map(|[a, b, c]| (b - a).cross(c - a)).sum();
        let view = before.normalize_or_zero();
        let (mut sum, mut offset, mut length) = (DVec3::ZERO, before.dot(view), 0.0);
        for [p, q] in staying {
            sum += (p - q).cross(view);
            offset -= p.cross(q).dot(view);
            length += p.distance(q);
        }
        let size = sum.length();
        (size > LEAST_SHARE * length).then(|| Self { normal: sum / size, offset: offset / size })
    }

    /// The signed distance of a point above the plane.
    pub(crate) fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// The point of the plane below another.
    pub(super) fn foot(&self, point: DVec3) -> DVec3 {
        point - self.normal * self.height(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pyramid_keeps_its_volume_when_its_tip_slides_at_one_height() {
        let base = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        let tip = DVec3::new(0.3, 0.6, 0.8);
        let sides = |tip: DVec3| (0..4).map(move |k| [base[k], base[(k + 1) % 4], tip]);
        let plane = Plane::of_equal_volume(sides(tip)).unwrap();
        assert!((plane.normal - DVec3::Z).length() < 1e-12);
        let foot = plane.foot(DVec3::new(0.9, 0.1, 2.0));
        assert!((foot - DVec3::new(0.9, 0.1, 0.8)).length() < 1e-12);
        let volume = |tip| sides(tip).map(|[a, b, c]| a.dot(b.cross(c))).sum::<f64>();
        assert!((volume(foot) - volume(tip)).abs() < 1e-12);
    }

    #[test]
    fn a_fan_at_a_border_keeps_its_area_where_its_tip_slides_along_the_border() {
        // Two triangles from a tip on the border x = 0 to the points of a rim.
        let rim = [DVec3::NEG_Y, DVec3::X, DVec3::Y];
        let tip = DVec3::new(-0.1, 0.2, 0.0);
        let fan = |tip: DVec3| [[tip, rim[0], rim[1]], [tip, rim[1], rim[2]]];
        let others = [[rim[0], rim[1]], [rim[1], rim[2]]];
        let plane = Plane::of_equal_area(fan(tip).into_iter(), others.into_iter()).unwrap();
        let area =
            |tip: DVec3| fan(tip).map(|[a, b, c]| (b - a).cross(c - a)).iter().sum::<DVec3>().z;
        let foot = plane.foot(DVec3::new(0.7, -0.4, 0.3));
        assert!((area(foot) - area(tip)).abs() < 1e-12);
        assert!((plane.normal.abs() - DVec3::X).length() < 1e-12);
        let closed = [[rim[0], rim[1]], [rim[1], rim[2]], [rim[2], rim[0]]];
        assert_eq!(Plane::of_equal_area(fan(tip).into_iter(), closed.into_iter()), None);
    }

    #[test]
    fn a_closed_surface_has_no_such_plane() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|t| t.map(|k| p[k]));
        assert_eq!(Plane::of_equal_volume(faces.into_iter()), None);
    }
}
