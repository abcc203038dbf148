//! Triangles as a camera sees them: where the ray of a sample meets them.
//!
//! Rasterization in homogeneous coordinates (Olano & Greer, "Triangle scan conversion using 2D
//! homogeneous coordinates", Graphics Hardware 1997): for corners p₀ p₁ p₂ in the camera's frame and
//! a ray q = (x, y, 1) the numbers eᵢ = q·(pⱼ × pₖ) are the barycentrics times their sum Σe, and the
//! ray meets the plane at depth p₀·(p₁ × p₂) / Σe. So nothing is clipped, a triangle may reach
//! behind the camera, barycentrics are perspective-correct, and their change from pixel to pixel is
//! known in closed form.

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::camera::Camera;
use super::scene::Scene;

/// Samples per pixel along each axis.
pub(super) const SAMPLES: usize = 2;

/// A scene's vertices as one camera sees them.
pub(super) struct View<'a> {
    pub(super) scene: &'a Scene,
    pub(super) camera: &'a Camera,
    /// Pixels per axis.
    pub(super) resolution: usize,
    /// One per vertex, in the camera's frame.
    points: Vec<DVec3>,
}

impl<'a> View<'a> {
    pub(super) fn new(scene: &'a Scene, camera: &'a Camera, resolution: usize) -> Self {
        let points = scene.positions.iter().map(|point| camera.to_view(*point)).collect();
        Self { scene, camera, resolution, points }
    }

    /// Samples per axis.
    pub(super) fn size(&self) -> usize {
        self.resolution * SAMPLES
    }

    /// Where a point of the image, in samples from its top left corner, lies at depth 1.
    pub(super) fn ray(&self, at: DVec2) -> DVec3 {
        let scaled = (2.0 * at / self.size() as f64 - 1.0) * self.camera.half_width;
        DVec3::new(scaled.x, -scaled.y, 1.0)
    }

    /// Where a point of the camera's frame lies in the image, in samples from its top left corner.
    pub(super) fn place(&self, point: DVec3) -> DVec2 {
        let scale = self.size() as f64 * 0.5;
        let tangent = point.truncate() / (point.z * self.camera.half_width);
        DVec2::new(1.0 + tangent.x, 1.0 - tangent.y) * scale
    }

    /// The triangle, ready to be intersected; nothing if it names a vertex that is not there, or is
    /// seen from no side.
    pub(super) fn facet(&self, triangle: usize) -> Option<Facet> {
        let [a, b, c] = self.scene.triangles[triangle];
        let point = |vertex: u32| self.points.get(vertex as usize).copied();
        Facet::new(triangle, [point(a)?, point(b)?, point(c)?])
    }
}

/// A triangle as intersected with rays from the eye.
pub(super) struct Facet {
    /// Its index in the scene.
    pub(super) triangle: usize,
    /// Whether the eye sees the side from which the corners run counter-clockwise.
    pub(super) front: bool,
    /// In the camera's frame.
    pub(super) corners: [DVec3; 3],
    /// The numbers e of a ray are `edges · ray`, one per column's coordinate; at least 0 inside.
    pub(super) edges: DMat3,
    /// Six times the volume of triangle and eye, above 0.
    pub(super) volume: f64,
}

/// A point of a triangle under an image point.
pub(super) struct Hit {
    pub(super) barycentrics: Vec3,
    /// Change of the barycentrics from one pixel to the next to the right.
    pub(super) dx: Vec3,
    /// The same for the next pixel up.
    pub(super) dy: Vec3,
}

impl Facet {
    fn new(triangle: usize, corners: [DVec3; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        let edge = b.cross(c);
        let volume = a.dot(edge);
        if !volume.is_finite() || volume == 0.0 {
            return None;
        }
        let front = volume > 0.0;
        let edges = DMat3::from_cols(edge, c.cross(a), a.cross(b)).transpose();
        let edges = if front { edges } else { -edges };
        Some(Self { triangle, front, corners, edges, volume: volume.abs() })
    }

    /// Unit normal in the camera's frame, towards the eye; zero if rounding leaves none.
    pub(super) fn normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        // Its dot product with a corner has the sign of the signed volume.
        if self.front { -normal } else { normal }
    }

    /// The numbers e at an image point, in samples, and their change from one sample to the next to the
    /// right and down.
    pub(super) fn numbers(&self, view: &View<'_>, at: DVec2) -> [DVec3; 3] {
        let sample = 2.0 * view.camera.half_width / view.size() as f64;
        let DMat3 { x_axis, y_axis, .. } = self.edges;
        [self.edges * view.ray(at), x_axis * sample, y_axis * -sample]
    }

    /// The point under an image point inside the triangle.
    pub(super) fn hit(&self, view: &View<'_>, at: DVec2) -> Hit {
        let [numbers, right, down] = self.numbers(view, at);
        let sum = numbers.element_sum();
        let barycentrics = numbers / sum;
        // The quotient rule on eᵢ / Σe.
        let change = |numbers: DVec3| {
            let pixel = numbers * SAMPLES as f64;
            ((pixel - barycentrics * pixel.element_sum()) / sum).as_vec3()
        };
        Hit { barycentrics: barycentrics.as_vec3(), dx: change(right), dy: change(-down) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn barycentrics_change_from_pixel_to_pixel_as_the_derivative_says() {
        let scene = Scene {
            positions: vec![
                Vec3::new(0.2, 0.1, -3.0),
                Vec3::new(2.2, 0.0, -1.0),
                Vec3::new(-1.1, 1.9, -1.0),
            ],
            triangles: vec![[0, 1, 2]],
            ..Scene::default()
        };
        let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, std::f64::consts::FRAC_PI_2, 0.1);
        let view = View::new(&scene, &camera, 1000);
        let facet = view.facet(0).unwrap();
        let at = DVec2::new(1000.0, 900.0);
        let step = SAMPLES as f64;
        let change = |step: DVec2| {
            let [before, after] = [at - step, at + step].map(|at| facet.hit(&view, at));
            (after.barycentrics - before.barycentrics) / 2.0
        };
        let hit = facet.hit(&view, at);
        assert!((hit.dx - change(DVec2::X * step)).length() < 1e-6);
        assert!((hit.dy - change(DVec2::NEG_Y * step)).length() < 1e-6);
        assert!((hit.barycentrics.element_sum() - 1.0).abs() < 1e-6);
    }
}
