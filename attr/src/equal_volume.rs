//! The plane on which a collapse keeps the volume (Lindstrom & Turk, "Fast and memory efficient
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
    fn a_closed_surface_has_no_such_plane() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|t| t.map(|k| p[k]));
        assert_eq!(Plane::of_equal_volume(faces.into_iter()), None);
    }
}
