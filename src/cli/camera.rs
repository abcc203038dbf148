//! A camera as it is typed.

use glam::DVec3;

use seamwise::evaluate::camera::Camera;

use super::place::numbers;

/// A place, a point that is looked at, and a field of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CameraArg {
    eye: DVec3,
    target: DVec3,
    degrees: f64,
}

impl CameraArg {
    /// The camera of a scene that is counted from `origin`.
    pub(crate) fn camera(&self, origin: DVec3) -> Camera {
        let near = 1e-3 * self.eye.distance(self.target);
        Camera::look_at(self.eye - origin, self.target - origin, self.degrees.to_radians(), near)
    }
}

/// The field of view of a camera that none is given for: that of the rig.
const DEGREES: f64 = 40.0;

/// Reads `x,y,z,x,y,z` or `x,y,z,x,y,z,degrees`.
pub(crate) fn parse_camera(text: &str) -> std::result::Result<CameraArg, String> {
    let numbers = numbers(text).unwrap_or_default();
    let (place, degrees) = match numbers[..] {
        [.., degrees] if numbers.len() == 7 => (&numbers[..6], degrees),
        _ => (&numbers[..], DEGREES),
    };
    let wrong = || {
        format!(
            "{text} is no camera like 0,1,5,0,1,0,40: its place, what it looks at, degrees of its view"
        )
    };
    if place.len() != 6 || !(0.1..=170.0).contains(&degrees) {
        return Err(wrong());
    }
    let (eye, target) = (DVec3::from_slice(place), DVec3::from_slice(&place[3..]));
    if eye == target { Err(wrong()) } else { Ok(CameraArg { eye, target, degrees }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_two_places_and_may_have_an_angle() {
        let own = parse_camera("0,0,5, 0,0,0,90").unwrap();
        let camera = own.camera(DVec3::X);
        assert_eq!((camera.eye, camera.forward), (DVec3::new(-1.0, 0.0, 5.0), DVec3::NEG_Z));
        assert!((camera.half_width - 1.0).abs() < 1e-12);
        assert_eq!(parse_camera("0,0,5,0,0,0").unwrap().degrees, DEGREES);
        for wrong in ["0,0,5", "0,0,5,0,0,5,40", "0,0,5,0,0,0,180", "a,0,5,0,0,0,40", ""] {
            assert!(parse_camera(wrong).is_err(), "{wrong}");
        }
    }
}
