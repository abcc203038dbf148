//! How many pixels an error spans where it is seen.

use glam::{DMat4, Mat3, Vec2, Vec3};

use super::bounds::{Bounds, cosine_of_sum, sine_of};
use crate::error::{Error, Result};

/// The share that an error counts with where nothing of it is seen: outside of the picture, or facing away.
/// Not 0, so that what comes into view is not at its coarsest.
const UNSEEN: f32 = 0.1;

/// Pixels of error that shading counts as which is off by a unit vector over one pixel, up to where a flattened
/// relief is seen.
///
/// A hilly terrain of 500,000 triangles, 10,000 of them for an eye at its edge: lit luminance over that of a level
/// of as many triangles is 0.81 with 0, 0.79 with 0.4 and 0.80 with 1; the largest error of the shape 1.4, 1.4 and
/// 2.4 pixels.
const SHADING: f32 = 0.4;

/// An eye, and the picture that it sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    eye: Vec3,
    /// The directions of the picture: right, up and back, unit vectors.
    axes: Mat3,
    /// Tangents of half the field of view, across and upright.
    tangents: [f32; 2],
    /// Pixels that a length spans that is as far away as it is long.
    pixels: f32,
}

impl Camera {
    /// An eye that looks at a place, +y up. `field_of_view` is upright, in radians; the picture has so many pixels
    /// across and upright.
    ///
    /// # Errors
    /// [`Error::Options`] if nothing can be seen so.
    pub fn new(eye: Vec3, target: Vec3, field_of_view: f32, size: [u32; 2]) -> Result<Self> {
        let fail = |what: &str| Err(Error::Options { what: what.into() });
        if !eye.is_finite() || !target.is_finite() || eye == target {
            return fail("an eye must look at another place than its own");
        }
        if !(field_of_view > 0.0 && field_of_view < std::f32::consts::PI) || size.contains(&0) {
            return fail(
                "a field of view lies between 0 and 180 degrees, and a picture has pixels",
            );
        }
        let back = (eye - target).normalize();
        let up = if back.y.abs() < 0.999 { Vec3::Y } else { Vec3::Z };
        let right = up.cross(back).normalize();
        let tangent = (0.5 * field_of_view).tan();
        let [width, height] = size.map(|pixels| pixels as f32);
        Ok(Self {
            eye,
            axes: Mat3::from_cols(right, back.cross(right), back),
            tangents: [tangent * width / height, tangent],
            pixels: height / (2.0 * tangent),
        })
    }

    /// The same camera in the space of a thing that a matrix brings into the world, as if that scaled alike in all
    /// directions; none if nothing is left of it.
    pub fn in_space(&self, world: &DMat4) -> Option<Self> {
        let back = world.inverse();
        if world.determinant() == 0.0 || !back.is_finite() {
            return None;
        }
        let axis = |axis: Vec3| back.transform_vector3(axis.as_dvec3()).normalize().as_vec3();
        let Mat3 { x_axis, y_axis, z_axis } = self.axes;
        let axes = Mat3::from_cols(axis(x_axis), axis(y_axis), axis(z_axis));
        Some(Self { eye: back.transform_point3(self.eye.as_dvec3()).as_vec3(), axes, ..*self })
    }

    /// The place of the eye.
    pub fn eye(&self) -> Vec3 {
        self.eye
    }

    /// Pixels that a length at a distance from the eye spans.
    pub fn pixels_of(&self, length: f32, distance: f32) -> f32 {
        self.pixels * length / distance
    }

    /// Whether a sphere is in the picture, in part at least.
    pub fn sees(&self, center: Vec3, radius: f32) -> bool {
        let [x, y, z] = (self.axes.transpose() * (center - self.eye)).to_array();
        let inside = |x: f32, tangent: f32| {
            (x.abs() + tangent * z) / (1.0 + tangent * tangent).sqrt() <= radius
        };
        z <= radius && inside(x, self.tangents[0]) && inside(y, self.tangents[1])
    }

    /// Where a place is in the picture: pixels from its middle, right and up; none if it is not before the eye.
    pub fn project(&self, place: Vec3) -> Option<Vec2> {
        let [x, y, z] = (self.axes.transpose() * (place - self.eye)).to_array();
        (z < 0.0).then(|| self.pixels / -z * Vec2::new(x, y))
    }

    /// Pixels that what a collapse leaves is off by at most, counted by how it is seen: of its shape or, where that
    /// is more, of its shading. No distance is less than `near`.
    pub(crate) fn error(&self, bounds: &Bounds, near: f32) -> f32 {
        let way = bounds.center - self.eye;
        let distance = way.length();
        let scale = self.pixels / (distance - bounds.radius).max(near);
        if !self.sees(bounds.center, bounds.radius) {
            return UNSEEN * scale * bounds.error;
        }
        if bounds.radius >= distance {
            return scale * self.stretch(-1.0) * bounds.error;
        }
        // The sine of the angle between the way to the middle and one to any part.
        let (way, spread) = (way / distance, bounds.radius / distance);
        let facing = way.dot(bounds.axis);
        if bounds.faces_away(facing, spread) {
            return UNSEEN * scale * bounds.error;
        }
        let cosine = -way.dot(self.axes.z_axis);
        let stretch =
            self.stretch(cosine_of_sum([cosine, sine_of(cosine)], [sine_of(spread), spread]));
        let shape = bounds.across_view(facing, spread);
        let shading = bounds.shading.seen(way).sqrt();
        // Of an area the root: it is stretched by the square of a side's stretch less its root.
        scale * (stretch * shape).max(SHADING * stretch.powf(0.75) * shading)
    }

    /// How much longer a length may be in the picture than in its middle, if it is seen in a direction that makes
    /// an angle of this cosine with that of the middle; no more than in a corner.
    fn stretch(&self, cosine: f32) -> f32 {
        let [x, y] = self.tangents;
        let corner = 1.0 + x * x + y * y;
        if cosine > 0.0 { (cosine * cosine).recip().min(corner) } else { corner }
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_PI_2;

    use super::*;

    fn camera() -> Camera {
        let size = [200, 100];
        Camera::new(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, FRAC_PI_2, size).expect("a view")
    }

    #[test]
    fn a_picture_ends_at_its_edges() {
        let camera = camera();
        assert!(camera.sees(Vec3::ZERO, 0.0));
        assert!(camera.sees(Vec3::new(9.9, 4.9, 0.0), 0.0), "the corner of the picture");
        assert!(!camera.sees(Vec3::new(10.1, 0.0, 0.0), 0.0) && !camera.sees(Vec3::Y * 5.1, 0.0));
        assert!(camera.sees(Vec3::Y * 5.1, 0.1));
        assert!(!camera.sees(Vec3::Z * 6.0, 0.9), "behind the eye");
    }

    /// What is off by 0.1 along an axis at a place.
    fn off_along(axis: Vec3, center: Vec3) -> Bounds {
        let (cosine, sine) = (0.995, 0.1);
        Bounds { error: 0.1, along: 0.1, center, axis, cosine, sine, ..Bounds::default() }
    }

    #[test]
    fn an_error_counts_by_distance_and_by_how_it_faces() {
        let of = |center: Vec3, axis: Vec3| camera().error(&off_along(axis, center), 0.01);
        assert!((of(Vec3::ZERO, Vec3::X) - 1.0).abs() < 1e-5, "50 pixels a unit at distance 1");
        assert!((of(Vec3::Z * -5.0, Vec3::X) - 0.5).abs() < 1e-5);
        assert!(of(Vec3::ZERO, Vec3::Z) < 1e-5, "to and from the eye");
        let aslant = Vec3::new(0.6, 0.0, 0.8);
        assert!((of(Vec3::ZERO, aslant) - 0.6).abs() < 1e-5);
        assert!((of(Vec3::ZERO, Vec3::NEG_Z) - UNSEEN).abs() < 1e-5, "faces away");
        assert!((of(Vec3::Z * 6.0, Vec3::Z) - 5.0 * UNSEEN).abs() < 1e-5, "behind the eye");
    }

    #[test]
    fn an_error_counts_by_what_it_spans_in_the_picture() {
        let camera = camera();
        for center in [Vec3::ZERO, Vec3::X * 4.0, Vec3::new(9.0, 4.0, 0.0)] {
            let way = center - camera.eye();
            let axis = way.cross(Vec3::Y).cross(way).normalize();
            let own = camera.error(&off_along(axis, center), 0.01);
            let [from, to] = [center, center + 0.1 * axis].map(|own| camera.project(own).unwrap());
            // In a corner 2.2 times one way, and the square of that the other, which counts.
            assert!((0.99..2.3).contains(&(own / from.distance(to))), "{own} at {center}");
        }
        assert!(camera.project(Vec3::X).unwrap().distance(Vec2::X * 10.0) < 1e-4);
        assert_eq!(camera.project(Vec3::Z * 6.0), None);
    }

    #[test]
    fn shading_counts_by_the_pixels_that_it_is_off_over() {
        // A patch of area π whose normals are off by a right angle all over it, seen from above and aslant.
        let of = |axis: Vec3| {
            let mut bounds = Bounds { axis, cosine: 1.0, ..Bounds::default() };
            bounds.shading.add(std::f32::consts::PI, axis, axis.any_orthonormal_vector());
            camera().error(&bounds, 0.01)
        };
        let pixels = SHADING * 10.0 * (2.0 * std::f32::consts::PI).sqrt();
        assert!((of(Vec3::Z) - pixels).abs() < 1e-4);
        let aslant = Vec3::new(0.75f32.sqrt(), 0.0, 0.5);
        assert!((of(aslant) - pixels * 0.5f32.sqrt()).abs() < 1e-4);
        assert_eq!(of(Vec3::NEG_Z), 0.0);
    }

    #[test]
    fn cameras_of_nothing_are_refused() {
        assert!(Camera::new(Vec3::ZERO, Vec3::ZERO, 1.0, [1, 1]).is_err());
        assert!(Camera::new(Vec3::X, Vec3::ZERO, 4.0, [1, 1]).is_err());
        assert!(Camera::new(Vec3::X, Vec3::ZERO, 1.0, [0, 1]).is_err());
    }
}
