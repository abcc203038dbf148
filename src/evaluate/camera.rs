//! The fixed rig of views.
//!
//! Cameras stand at the vertices of the small rhombicuboctahedron, all permutations of
//! (±1, ±1, ±(1 + √2)), around the reference's bounding sphere and look at its center (Lindstrom &
//! Turk, "Image-driven simplification", TOG 2000): 24 views, nearly evenly spread, none along an
//! axis. The bounding sphere fills the frame but for a margin of 2 %, so the rig depends on the
//! reference only and every candidate is seen by the same cameras.

use glam::{DQuat, DVec3, Vec3};

use super::scene::Scene;

/// Views of the whole rig.
pub const MAX_VIEWS: usize = 24;

/// Vertical and horizontal field of view: 40°, that of a 50 mm lens on a small sensor; less would
/// hide perspective, more would show little but the middle of the surface.
const FIELD_OF_VIEW: f64 = 40.0 * std::f64::consts::PI / 180.0;

/// Share of the half frame that the bounding sphere reaches.
const FILL: f64 = 0.98;

/// A camera of square frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where it stands, in metres of the world.
    pub eye: DVec3,
    /// Unit vectors in the world: to the right of the image, up, and from the eye into the scene.
    pub right: DVec3,
    /// See `right`.
    pub up: DVec3,
    /// See `right`.
    pub forward: DVec3,
    /// Unit vector in the world to the zenith of the surrounding that lights what it sees.
    pub zenith: DVec3,
    /// Half the frame's width at distance 1.
    pub half_width: f64,
    /// Distance of the near plane along `forward`, in metres, above 0; nothing nearer is seen.
    pub near: f64,
}

impl Camera {
    /// A camera at `eye` that looks at `target`, which must be another point, with the world's +y
    /// upward in the image and as the zenith of the light; where it looks along y, +z is upward.
    pub fn look_at(eye: DVec3, target: DVec3, field_of_view: f64, near: f64) -> Self {
        let forward = (target - eye).normalize_or(DVec3::NEG_Z);
        let vertical = if forward.y.abs() < 0.999 { DVec3::Y } else { DVec3::Z };
        let right = forward.cross(vertical).normalize();
        let up = right.cross(forward);
        let half_width = (0.5 * field_of_view).tan();
        Self { eye, right, up, forward, zenith: DVec3::Y, half_width, near }
    }

    /// A point of the world in the camera's frame: right, up and the depth along `forward`.
    #[inline]
    pub fn to_view(&self, point: Vec3) -> DVec3 {
        let relative = point.as_dvec3() - self.eye;
        DVec3::new(relative.dot(self.right), relative.dot(self.up), relative.dot(self.forward))
    }
}

/// The cameras that see the reference and every candidate.
#[derive(Clone, Debug, PartialEq)]
pub struct Rig {
    /// Where all cameras look, in metres of the world.
    pub center: DVec3,
    /// In a fixed order: each view is as far as can be from those before it.
    pub cameras: Vec<Camera>,
    /// Width and height of each image in pixels.
    pub resolution: usize,
}

impl Rig {
    /// Cameras around the sphere of `center` and `radius`, in metres, that sees `resolution` pixels
    /// each way.
    ///
    /// `views` is held to 1…24; a smaller number takes the first of an order in which each view is
    /// the farthest from all before it, so any number of views is spread. A radius that is not
    /// above 0 counts as 1, a resolution of 0 as 1.
    pub fn new(center: Vec3, radius: f32, views: usize, resolution: usize) -> Self {
        let radius = if radius > 0.0 && radius.is_finite() { f64::from(radius) } else { 1.0 };
        let center = center.as_dvec3();
        // The sphere's outline is a cone of sine radius / distance.
        let distance = radius / (FILL * (0.5 * FIELD_OF_VIEW).tan()).atan().sin();
        let near = 0.01 * distance;
        let cameras = directions()
            .into_iter()
            .take(views.clamp(1, MAX_VIEWS))
            .map(|direction| {
                Camera::look_at(center + direction * distance, center, FIELD_OF_VIEW, near)
            })
            .collect();
        Self { center, cameras, resolution: resolution.max(1) }
    }

    /// The rig around a scene's [`bounding_sphere`].
    pub fn around(scene: &Scene, views: usize, resolution: usize) -> Self {
        let (center, radius) = bounding_sphere(scene);
        Self::new(center, radius, views, resolution)
    }

    /// The same cameras and their light, turned about the world's origin: a scene turned alike looks
    /// to them as it did.
    pub fn turned(mut self, rotation: DQuat) -> Self {
        self.center = rotation * self.center;
        for camera in &mut self.cameras {
            let Camera { eye, right, up, forward, zenith, .. } = camera;
            for vector in [eye, right, up, forward, zenith] {
                *vector = rotation * *vector;
            }
        }
        self
    }

    /// Pixels that a length of 1 at the center spans, of a frame one pixel wide.
    fn scale(&self) -> f64 {
        let camera = &self.cameras[0];
        1.0 / (2.0 * camera.half_width * camera.eye.distance(self.center))
    }

    /// Pixels that a length at the center, in metres, spans if seen across.
    pub fn pixels(&self, length: f64) -> f64 {
        length * self.scale() * self.resolution as f64
    }

    /// Some of the cameras, by their places in the order.
    pub(super) fn with_views(&self, views: &[usize]) -> Self {
        let cameras = views.iter().map(|&view| self.cameras[view]).collect();
        Self { cameras, ..self.clone() }
    }

    /// The same cameras with frames of so many pixels each way, at least 1.
    pub fn at_resolution(&self, resolution: usize) -> Self {
        Self { resolution: resolution.max(1), ..self.clone() }
    }
}

/// A sphere around all triangles: the center of their bounding box, and the distance to their
/// farthest vertex, in metres. Up to √3 of the smallest such sphere. Vertices that no triangle uses
/// and those that are not finite do not count; an empty scene gives the unit sphere.
pub fn bounding_sphere(scene: &Scene) -> (Vec3, f32) {
    let points = || {
        let vertices = scene.triangles.as_flattened().iter();
        vertices
            .filter_map(|vertex| scene.positions.get(*vertex as usize))
            .filter(|point| point.is_finite())
    };
    let low = points().fold(Vec3::INFINITY, |low, point| low.min(*point));
    let high = points().fold(Vec3::NEG_INFINITY, |high, point| high.max(*point));
    if !low.is_finite() {
        return (Vec3::ZERO, 1.0);
    }
    let center = low + 0.5 * (high - low);
    (center, points().map(|point| point.distance(center)).fold(0.0, f32::max))
}

/// The 24 unit directions, the one nearest a view from the front, right and above first, then
/// always the farthest from all before it, ties by the order of the permutations.
fn directions() -> Vec<DVec3> {
    let long = 1.0 + std::f64::consts::SQRT_2;
    let mut left: Vec<DVec3> = Vec::with_capacity(MAX_VIEWS);
    for axis in [2, 0, 1] {
        for signs in 0..8 {
            let sign = |bit: usize| if signs >> bit & 1 == 0 { 1.0 } else { -1.0 };
            let mut vertex = [sign(0), sign(1), sign(2)];
            vertex[axis] *= long;
            left.push(DVec3::from_array(vertex).normalize());
        }
    }
    let mut order = vec![left.remove(0)];
    while !left.is_empty() {
        let gap = |direction: &DVec3| {
            order.iter().map(|taken| taken.distance(*direction)).fold(f64::INFINITY, f64::min)
        };
        let mut best = 0;
        for at in 1..left.len() {
            // Equal gaps may differ in the last bits; the earlier permutation stays.
            if gap(&left[at]) > gap(&left[best]) + 1e-9 {
                best = at;
            }
        }
        order.push(left.remove(best));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_views_are_the_vertices_of_the_rhombicuboctahedron() {
        let all = directions();
        assert_eq!(all.len(), MAX_VIEWS);
        // Edge 2, circumradius √(1 + 1 + (1 + √2)²); every vertex has four neighbors.
        let edge = 2.0 / (5.0 + 2.0 * std::f64::consts::SQRT_2).sqrt();
        for a in &all {
            let near = all.iter().filter(|b| (a.distance(**b) - edge).abs() < 1e-9).count();
            let nearer = all.iter().filter(|b| a.distance(**b) < edge - 1e-9).count();
            assert_eq!((near, nearer), (4, 1));
        }
    }

    #[test]
    fn few_views_are_spread_and_are_the_first_of_many() {
        let all = directions();
        assert!(all[0].dot(all[1]) < -0.99, "two views see both sides");
        let few = Rig::new(Vec3::ONE, 2.0, 6, 64);
        assert_eq!(few.cameras, Rig::new(Vec3::ONE, 2.0, 24, 64).cameras[..6]);
        assert_eq!(Rig::new(Vec3::ZERO, 1.0, 0, 0).cameras.len(), 1);
        assert_eq!(Rig::new(Vec3::ZERO, 1.0, 99, 0).cameras.len(), MAX_VIEWS);
    }

    #[test]
    fn the_sphere_fills_the_frame_but_for_the_margin() {
        for camera in Rig::new(Vec3::new(1.0, 2.0, 3.0), 5.0, 24, 64).cameras {
            let center = camera.to_view(Vec3::new(1.0, 2.0, 3.0));
            assert!(center.truncate().length() < 1e-9 && center.z > 5.0);
            let outline = (5.0 / center.z).asin().tan() / camera.half_width;
            assert!((outline - FILL).abs() < 1e-9);
            assert!(camera.up.y > 0.0 && camera.near < center.z - 5.0);
            assert!((camera.right.cross(camera.up) + camera.forward).length() < 1e-9);
        }
    }

    #[test]
    fn a_frame_is_as_large_as_a_length_in_it_asks() {
        let rig = Rig::new(Vec3::ONE, 3.0, 4, 200);
        // The sphere's outline is seen a little larger than a length of its diameter at the center.
        let across = rig.pixels(6.0);
        assert!(across > 180.0 && across < 0.98 * 200.0, "{across}");
        let half = rig.at_resolution(100);
        assert_eq!((half.resolution, &half.cameras), (100, &rig.cameras));
        assert!((half.pixels(6.0) - across / 2.0).abs() < 1e-9);
        assert_eq!(rig.at_resolution(0).resolution, 1);
    }

    #[test]
    fn a_rig_turns_with_its_light() {
        let rig = Rig::new(Vec3::new(1.0, 2.0, 3.0), 5.0, 24, 64);
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let turned = rig.clone().turned(quarter);
        assert!((turned.center - DVec3::new(-2.0, 1.0, 3.0)).length() < 1e-9);
        for (before, after) in rig.cameras.iter().zip(&turned.cameras) {
            assert!((after.zenith + DVec3::X).length() < 1e-9);
            let point = after.to_view(Vec3::new(-7.0, 4.0, 1.0));
            assert!((before.to_view(Vec3::new(4.0, 7.0, 1.0)) - point).length() < 1e-9);
        }
    }

    #[test]
    fn the_bounding_sphere_is_of_the_triangles() {
        let scene = Scene {
            positions: vec![Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 2.0, Vec3::Z * 9.0, Vec3::NAN],
            triangles: vec![[0, 1, 2], [0, 1, 4], [0, 1, 77]],
            ..Scene::default()
        };
        assert_eq!(bounding_sphere(&scene), (Vec3::new(1.0, 1.0, 0.0), 2.0f32.sqrt()));
        assert_eq!(bounding_sphere(&Scene::default()), (Vec3::ZERO, 1.0));
    }
}
