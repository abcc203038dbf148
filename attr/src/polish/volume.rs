//! The volume that a fit has changed, put back.
//!
//! All points that may move go along their normals by one common length, found by Newton's method: the
//! slope of the volume over that length is the area around them, so it is as short as the fit was near.

use glam::{DVec3, Vec3};

use crate::mesh::Mesh;
use crate::triangle::area_vector;

/// The volume is a cubic of the length, and all but linear near its root.
const STEPS: usize = 4;

/// `moved`, with the volume that `level` has. Only `free` points move.
pub(super) fn restore(level: &Mesh, moved: Vec<Vec3>, free: &[bool]) -> Vec<Vec3> {
    let (wanted, origin) = (volume(level, &level.positions), moved.clone());
    let normals = normals(level, &moved);
    let mut length = 0.0;
    let mut positions = moved;
    for _ in 0..STEPS {
        let slope: f64 = gradients(level, &positions)
            .iter()
            .zip(&normals)
            .zip(free)
            .filter(|(_, free)| **free)
            .map(|((gradient, normal), _)| gradient.dot(*normal))
            .sum();
        if slope <= 0.0 {
            break;
        }
        length += (wanted - volume(level, &positions)) / slope;
        for (point, position) in positions.iter_mut().enumerate() {
            if free[point] {
                *position = (origin[point].as_dvec3() + normals[point] * length).as_vec3();
            }
        }
    }
    positions
}

/// The signed volume between the surface and the origin, whose place matters only if it has borders that
/// move.
fn volume(mesh: &Mesh, positions: &[Vec3]) -> f64 {
    let corners = |t| mesh.triangle_points(t).map(|p| positions[p.index()].as_dvec3());
    let sixths = (0..mesh.triangles.len()).map(corners).map(|[a, b, c]| a.dot(b.cross(c)));
    sixths.sum::<f64>() / 6.0
}

/// Per point: how the volume changes with it, a third of the area vectors around.
fn gradients(mesh: &Mesh, positions: &[Vec3]) -> Vec<DVec3> {
    let mut gradients = vec![DVec3::ZERO; positions.len()];
    for triangle in 0..mesh.triangles.len() {
        let points = mesh.triangle_points(triangle);
        let share = area_vector(points.map(|p| positions[p.index()])) / 6.0;
        points.iter().for_each(|point| gradients[point.index()] += share);
    }
    gradients
}

fn normals(mesh: &Mesh, positions: &[Vec3]) -> Vec<DVec3> {
    gradients(mesh, positions).into_iter().map(DVec3::normalize_or_zero).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::sphere;

    #[test]
    fn a_sphere_blown_up_goes_back_to_its_volume_and_held_points_stay() {
        let mesh = sphere(12);
        let free: Vec<bool> = mesh.positions.iter().map(|p| p.z < 0.9).collect();
        let blow = |(p, free): (&Vec3, &bool)| if *free { *p * 1.1 } else { *p };
        let moved: Vec<Vec3> = mesh.positions.iter().zip(&free).map(blow).collect();
        let restored = restore(&mesh, moved, &free);
        let ratio = volume(&mesh, &restored) / volume(&mesh, &mesh.positions);
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
        for point in 0..free.len() {
            assert!(free[point] || restored[point] == mesh.positions[point]);
        }
    }
}
