//! The promises of a decimation, held on whole levels.

use glam::Vec3;
use proptest::prelude::*;

use super::*;
use crate::edges::Census;
use crate::shape::turns;
use crate::testing::{sphere, surface};

fn decimated(mesh: &Mesh, target: usize, options: &Options<'_>) -> Level {
    decimate_chain(mesh, &[target], options, &AtomicUsize::new(0)).unwrap().remove(0)
}

/// The same surface without attributes, so that nothing is a seam.
fn bare(mesh: &Mesh) -> Mesh {
    let corners = |t| mesh.triangle_points(t).map(|point| WedgeId(point.0));
    Mesh {
        positions: mesh.positions.clone(),
        wedge_points: (0..mesh.positions.len()).map(PointId::new).collect(),
        triangles: (0..mesh.triangles.len()).map(corners).collect(),
        groups: mesh.groups.clone(),
        ..Mesh::default()
    }
}

/// The least and the greatest coordinate x, y of the positions, and the area over the plane.
fn extent(mesh: &Mesh) -> [f32; 5] {
    let fold = |pick: fn(Vec3, Vec3) -> Vec3| mesh.positions.iter().copied().reduce(pick).unwrap();
    let (low, high) = (fold(Vec3::min), fold(Vec3::max));
    let areas = (0..mesh.triangles.len()).map(|t| {
        let [a, b, c] = mesh.triangle_positions(t);
        (b - a).cross(c - a).z / 2.0
    });
    [low.x, low.y, high.x, high.y, areas.sum()]
}

#[test]
fn what_is_flat_goes_but_for_its_corners() {
    let flat = surface(12, |x, y| Vec3::new(x, y, 0.0));
    let level = decimated(&flat, 2, &Options::default());
    assert_eq!((level.mesh.triangles.len(), level.mesh.positions.len()), (2, 4));
    assert_eq!(extent(&level.mesh), [0.0, 0.0, 1.0, 1.0, 1.0]);
    assert!(level.error < 1e-7 && level.stopped.is_none());
}

#[test]
fn a_sphere_stays_closed_round_and_its_own() {
    // The ring around a pole ends seams, and stays.
    holds_a_sphere(&sphere(32), [2000, 1000]);
    holds_a_sphere(&bare(&sphere(32)), [800, 200]);
}

fn holds_a_sphere(mesh: &Mesh, targets: [usize; 2]) {
    let [fine, coarse] =
        &decimate_chain(mesh, &targets, &Options::default(), &AtomicUsize::new(0)).unwrap()[..]
    else {
        panic!("two levels")
    };
    let before = Census::new(mesh);
    for level in [fine, coarse] {
        level.mesh.validate().unwrap();
        let census = Census::new(&level.mesh);
        assert_eq!((census.borders, census.complex), (before.borders, 0));
        assert_eq!((census.charts, census.shells), (before.charts, 1));
        assert!(level.mesh.triangles.len() <= level.target && level.stopped.is_none());
        for (position, &source) in level.mesh.positions.iter().zip(&level.point_sources) {
            assert_eq!(*position, mesh.positions[source]);
        }
        for (wedge, &source) in level.wedge_sources.iter().enumerate() {
            assert_eq!(level.mesh.row(WedgeId::new(wedge)), mesh.row(source));
        }
        let middle = |t| level.mesh.triangle_positions(t).iter().sum::<Vec3>().length() / 3.0;
        let least = (0..level.mesh.triangles.len()).map(middle).fold(1.0, f32::min);
        assert!(least > 0.8, "{least}");
    }
    assert!(coarse.error > fine.error && fine.error > 0.0);
}

#[test]
fn locked_points_and_an_error_limit_hold() {
    let mesh = surface(16, |x, y| Vec3::new(x, y, 0.2 * (9.0 * x).sin() * (7.0 * y).cos()));
    let locked: Vec<bool> = mesh.positions.iter().map(|p| p.x < 0.3).collect();
    let options = Options { locked: &locked, ..Options::default() };
    let level = decimated(&mesh, 10, &options);
    let kept = level.point_sources.iter().filter(|source| locked[source.index()]).count();
    assert_eq!(kept, locked.iter().filter(|own| **own).count());
    let mut limited = Options::default();
    limited.settings.max_error = Some(0.01);
    let level = decimated(&mesh, 1, &limited);
    assert_eq!(level.stopped, Some(Stop::ErrorLimit));
    assert!(level.error <= 0.01 && level.mesh.triangles.len() < mesh.triangles.len());
}

#[test]
fn what_counts_more_stays_longer() {
    let mesh = bare(&sphere(24));
    let importance: Vec<f32> =
        mesh.positions.iter().map(|p| if p.z > 0.0 { 30.0 } else { 1.0 }).collect();
    let level = decimated(&mesh, 300, &Options { importance: &importance, ..Options::default() });
    let above = level.mesh.positions.iter().filter(|p| p.z > 0.0).count();
    assert!(3 * above > 2 * level.mesh.positions.len(), "{above}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// On rough sheets: no triangle faces down that none did, the plan is covered once, and borders are one loop.
    #[test]
    fn a_rough_sheet_stays_a_sheet(heights in prop::collection::vec(-0.05f32..0.05, 12 * 12), share in 0.05f64..0.9) {
        let mesh = surface(11, |x, y| {
            let at = |t: f32| (t * 11.0).round() as usize;
            Vec3::new(x, y, heights[at(y) * 12 + at(x)])
        });
        let target = (mesh.triangles.len() as f64 * share) as usize;
        let level = decimated(&mesh, target, &Options::default());
        level.mesh.validate().unwrap();
        let census = Census::new(&level.mesh);
        prop_assert_eq!((census.complex, census.shells), (0, 1));
        let flat = [DVec3::ZERO, DVec3::X, DVec3::Y];
        for t in 0..level.mesh.triangles.len() {
            let own = level.mesh.triangle_positions(t).map(Vec3::as_dvec3);
            prop_assert!(!turns(flat, own, 0.0));
        }
    }
}
