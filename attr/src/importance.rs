//! Importance of each point of a mesh: factors for [`Options::importance`](crate::Options).

use glam::{DMat4, DVec3, Vec3};

use crate::edges::{Side, visit_edges};
use crate::mesh::Mesh;
use crate::triangle::area_vector;

/// A camera, in the units of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Eye {
    /// A camera at this place.
    At(DVec3),
    /// A camera far away, that looks along this vector of any length.
    Along(DVec3),
}

/// A view from which a level is to look right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The camera.
    pub eye: Eye,
    /// Triangles whose normal has at least this cosine to the direction of the eye count more, in −1…1.
    pub cosine: f64,
    /// The factor by which they count more.
    pub weight: f64,
}

/// Per point: the mean of `view.weight` for triangles that face the eye and 1 for the others, by their
/// area. `to_world` places the mesh in the scene.
pub fn view_importance(mesh: &Mesh, to_world: &DMat4, view: &View) -> Vec<f32> {
    let mirrors = to_world.determinant().signum();
    let mut sums = vec![(0.0, 0.0); mesh.positions.len()];
    for triangle in 0..mesh.triangles.len() {
        let p = mesh.triangle_positions(triangle).map(|p| to_world.transform_point3(p.as_dvec3()));
        let area = (p[1] - p[0]).cross(p[2] - p[0]) * mirrors;
        let towards = match view.eye {
            Eye::At(eye) => eye - (p[0] + p[1] + p[2]) / 3.0,
            Eye::Along(direction) => -direction,
        };
        let faces = area.dot(towards) >= view.cosine * area.length() * towards.length();
        let factor = if faces { view.weight } else { 1.0 };
        for point in mesh.triangle_points(triangle) {
            let (weighed, whole) = &mut sums[point.index()];
            *weighed += factor * area.length();
            *whole += area.length();
        }
    }
    sums.into_iter().map(|(sum, area)| if area > 0.0 { (sum / area) as f32 } else { 1.0 }).collect()
}

/// Per point: (1 + H)^`strength`, with H the mean curvature by half the longest side of the box around the mesh, by the
/// angles at the edges (Cohen-Steiner & Morvan, "Restricted Delaunay triangulations and normal cycle",
/// SoCG 2003): H = Σ length · |angle| / (4 A), over the edges at the point and a third of the area of its
/// triangles. Borders have no angle.
pub fn curvature_importance(mesh: &Mesh, strength: f64) -> Vec<f32> {
    let points = mesh.positions.len();
    let (mut angle_sums, mut areas) = (vec![0.0; points], vec![0.0; points]);
    for triangle in 0..mesh.triangles.len() {
        let third = area_vector(mesh.triangle_positions(triangle)).length() / 6.0;
        mesh.triangle_points(triangle).iter().for_each(|point| areas[point.index()] += third);
    }
    visit_edges(mesh, |_, sides: &[Side]| {
        if let [(ends, first), (_, second)] = *sides {
            let length = mesh.positions[ends[0]].distance(mesh.positions[ends[1]]);
            let [a, b] = [first, second].map(|t| area_vector(mesh.triangle_positions(t)));
            let angle = f64::from(length) * a.cross(b).length().atan2(a.dot(b));
            ends.iter().for_each(|point| angle_sums[point.index()] += angle);
        }
    });
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    mesh.positions.iter().for_each(|&p| (low, high) = (low.min(p), high.max(p)));
    let radius = f64::from((high - low).max_element()) / 2.0;
    let factor = |(angle, area): (f64, f64)| {
        let curvature = if area > 0.0 { radius * angle / (4.0 * area) } else { 0.0 };
        (1.0 + curvature).powf(strength) as f32
    };
    angle_sums.into_iter().zip(areas).map(factor).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;
    use crate::chain::simplify_chain;
    use crate::options::Options;
    use crate::testing::sphere;

    fn points_where(mesh: &Mesh, is_meant: impl Fn(Vec3) -> bool) -> usize {
        mesh.positions.iter().filter(|&&p| is_meant(p)).count()
    }

    #[test]
    fn a_camera_gets_the_side_that_it_sees() {
        let mesh = sphere(24);
        let view = View { eye: Eye::At(DVec3::new(0.0, 9.0, 5.0)), cosine: 0.0, weight: 30.0 };
        // The scene turns z to y, mirrors it, and moves the sphere away from the origin.
        let to_world = DMat4::from_translation(DVec3::new(0.0, 0.0, 5.0))
            * DMat4::from_cols_array(&[
                1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0,
            ]);
        let importance = view_importance(&mesh, &to_world, &view);
        for (p, &factor) in mesh.positions.iter().zip(&importance) {
            assert!(p.z.abs() < 0.3 || (factor > 15.0) == (p.z > 0.0), "{p}: {factor}");
        }
        let options = Options { importance: &importance, ..Options::default() };
        let chain = |options: &Options<'_>| {
            simplify_chain(&mesh, &[300], options, &AtomicUsize::new(0)).unwrap().remove(0).mesh
        };
        let share = |mesh: &Mesh| points_where(mesh, |p| p.z > 0.0) as f64 / 150.0;
        let (plain, steered) = (share(&chain(&Options::default())), share(&chain(&options)));
        assert!((0.4..0.6).contains(&plain) && steered > 0.68, "{plain} → {steered}");
    }

    #[test]
    fn a_sphere_is_bent_alike_everywhere_by_the_inverse_of_its_radius() {
        for radius in [0.5f32, 4.0] {
            let mut mesh = sphere(48);
            mesh.positions.iter_mut().for_each(|p| *p *= radius);
            let factors = curvature_importance(&mesh, 1.0);
            let near_equator = mesh
                .positions
                .iter()
                .zip(&factors)
                .filter(|(p, _)| p.z.abs() < 0.5 * radius && p.y.abs() > 0.1 * radius);
            for (p, &factor) in near_equator {
                assert!((factor - 2.0).abs() < 0.1, "{p}: {factor}");
            }
        }
    }

    #[test]
    fn a_common_factor_changes_nothing() {
        let mesh = sphere(24);
        let chain = |importance: &[f32]| {
            let options = Options { importance, ..Options::default() };
            simplify_chain(&mesh, &[500], &options, &AtomicUsize::new(0)).unwrap().remove(0)
        };
        // A power of two rounds nothing.
        let (one, four) = (chain(&[]), chain(&vec![4.0; mesh.positions.len()]));
        assert_eq!(one.mesh, four.mesh);
        assert_eq!(one.error, four.error);
    }
}
