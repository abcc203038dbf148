//! The quadrics of a surface's points as plain sums of planes, to be looked at.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use glam::{DVec3, Vec3};

use crate::chain::check;
use crate::error::Result;
use crate::id::{PointId, WedgeId};
use crate::mesh::Mesh;
use crate::options::Options;
use crate::quadric::PointQuadric;
use crate::settings::{Cost, Settings};
use crate::simplify::Descent;
use crate::space::Space;
use crate::working_mesh::WorkingMesh;

/// A surface and the quadric of each of its points.
#[derive(Clone, Debug, Default)]
pub struct PlaneQuadrics {
    /// One per point.
    pub positions: Vec<Vec3>,
    /// The points of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// One per point: the squared distances to the planes of all triangles that it stands for, summed, in
    /// squared units of the mesh.
    pub quadrics: Vec<PointQuadric>,
    /// Where positions are counted from in the quadrics.
    pub origin: DVec3,
}

/// Simplifies a mesh to `target` triangles by [`Cost::Classic`], its shape alone, and tells the quadric that
/// each point has gathered by then: at its own number of triangles that of the triangles around it.
///
/// # Errors
/// [`Error::Invalid`](crate::Error::Invalid) if the mesh does not validate.
pub fn sum_planes(mesh: &Mesh, target: usize) -> Result<PlaneQuadrics> {
    let shape = shape_of(mesh);
    let settings = Settings { cost: Cost::Classic, ..Settings::default() };
    let options: Options<'_> = settings.into();
    check(&shape, &[target], &options)?;
    let space = Arc::new(Space::of(&shape, &options));
    let working = WorkingMesh::new(&shape, &space);
    let mut descent = Descent::new(&shape, working, Vec::new(), f64::INFINITY);
    descent.descend(target, 1.0, &AtomicUsize::new(0));
    let (level, sources, _) = descent.snapshot();
    let quadrics = descent.point_quadrics();
    let in_mesh = |source: &PointId| {
        let own = &quadrics[*source];
        // Of p/u, and u² times as much: squared lengths of the mesh.
        PointQuadric { a: own.a, b: own.b * space.unit, c: own.c * space.unit * space.unit }
    };
    Ok(PlaneQuadrics {
        triangles: (0..level.triangles.len())
            .map(|triangle| level.triangle_points(triangle).map(|point| point.0))
            .collect(),
        quadrics: sources.iter().map(in_mesh).collect(),
        positions: level.positions,
        origin: space.center,
    })
}

/// A mesh without attributes and groups.
fn shape_of(mesh: &Mesh) -> Mesh {
    Mesh {
        positions: mesh.positions.clone(),
        wedge_points: (0..mesh.positions.len()).map(PointId::new).collect(),
        triangles: (0..mesh.triangles.len())
            .map(|triangle| mesh.triangle_points(triangle).map(|point| WedgeId::new(point.index())))
            .collect(),
        groups: vec![0; mesh.triangles.len()],
        ..Mesh::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isosurface::Isosurface;
    use crate::testing::{grid, sphere};

    #[test]
    fn at_the_full_size_a_quadric_is_of_the_planes_around_its_point() {
        let mesh = sphere(12);
        let own = sum_planes(&mesh, mesh.triangles.len()).unwrap();
        assert_eq!(own.triangles.len(), mesh.triangles.len());
        let probe = DVec3::new(0.3, 0.1, -0.2);
        for (point, quadric) in own.quadrics.iter().enumerate() {
            let around = own.triangles.iter().filter(|own| own.contains(&(point as u32)));
            let squares = around.map(|corners| {
                let [a, b, c] = corners.map(|at| own.positions[at as usize].as_dvec3());
                (b - a).cross(c - a).normalize_or_zero().dot(probe - a).powi(2)
            });
            let direct: f64 = squares.sum();
            let found = quadric.evaluate(probe - own.origin);
            assert!((found - direct).abs() < 1e-5 * (1.0 + direct), "{found} {direct}");
        }
    }

    #[test]
    fn a_level_keeps_what_its_points_have_gathered_and_a_flat_one_is_open() {
        let mesh = sphere(16);
        let own = sum_planes(&mesh, mesh.triangles.len() / 4).unwrap();
        assert!(own.triangles.len() <= mesh.triangles.len() / 4);
        // Every plane counts once at each of its three points, whatever they merged into.
        let gathered: f64 = own.quadrics.iter().map(|own| own.a[0] + own.a[3] + own.a[5]).sum();
        assert!((gathered - 3.0 * mesh.triangles.len() as f64).abs() < 1e-6, "{gathered}");
        let flat = sum_planes(&grid(4), 32).unwrap();
        assert!(flat.quadrics.iter().all(|own| own.isosurface(1.0) == Isosurface::Open));
    }
}
