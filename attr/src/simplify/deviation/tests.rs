use std::sync::atomic::AtomicUsize;

use glam::Vec3;

use crate::chain::{Level, simplify_chain};
use crate::options::Options;
use crate::settings::Settings;
use crate::simplify::Stop;
use crate::surface::Surface;
use crate::testing::{sphere, surface};
use crate::{Layout, Mesh, Vertices, weld};

/// Meshes side by side as one, without attributes.
fn scene(parts: &[(&Mesh, &dyn Fn(Vec3) -> Vec3)]) -> Mesh {
    let mut vertices =
        Vertices { layout: Layout { uv_sets: 0, normal: false, color: 0 }, ..Vertices::default() };
    for (mesh, place) in parts {
        let first = vertices.positions.len() as u32;
        vertices.positions.extend(mesh.positions.iter().map(|&p| place(p)));
        let triangles = (0..mesh.triangles.len()).map(|t| mesh.triangle_points(t));
        vertices.triangles.extend(triangles.map(|t| t.map(|p| p.0 + first)));
    }
    vertices.groups = vec![0; vertices.triangles.len()];
    weld(&vertices).unwrap().mesh
}

/// A flat sheet of n × n squares over 0…1, without those that `is_hole` names.
fn plate(n: usize, is_hole: impl Fn(usize, usize) -> bool) -> Mesh {
    let mut mesh = surface(n, |x, y| Vec3::new(x, y, 0.0));
    let stays = |t: usize| !is_hole(t / 2 % n, t / 2 / n);
    let kept: Vec<bool> = (0..n * n * 2).map(stays).collect();
    let mut kept = kept.iter();
    mesh.triangles.retain(|_| kept.next() == Some(&true));
    mesh.groups.truncate(mesh.triangles.len());
    mesh
}

fn triangle(corners: [Vec3; 3]) -> Mesh {
    let vertices = Vertices {
        layout: Layout { uv_sets: 0, normal: false, color: 0 },
        positions: corners.to_vec(),
        triangles: vec![[0, 1, 2]],
        groups: vec![0],
        ..Vertices::default()
    };
    weld(&vertices).unwrap().mesh
}

fn level(mesh: &Mesh, target: usize, options: &Options<'_>) -> Level {
    simplify_chain(mesh, &[target], options, &AtomicUsize::new(0)).unwrap().remove(0)
}

fn within(limit: f64) -> Options<'static> {
    Settings { max_deviation: Some(limit), ..Settings::default() }.into()
}

/// The distance of a place to a mesh.
fn off(mesh: &Mesh, place: Vec3) -> f32 {
    let triangles = (0..mesh.triangles.len()).map(|t| mesh.triangle_points(t).map(|p| p.0));
    let surface = Surface::new(&mesh.positions, triangles);
    surface.closest_point(place).unwrap().distance_squared.sqrt()
}

fn area(mesh: &Mesh) -> f32 {
    let corners = (0..mesh.triangles.len()).map(|t| mesh.triangle_positions(t));
    corners.map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum()
}

#[test]
fn a_floor_of_two_triangles_keeps_its_corners_beside_a_ball_at_any_target() {
    let (floor, ball) = (plate(1, |_, _| false), sphere(24));
    let mesh = scene(&[(&floor, &|p| p * 4.0), (&ball, &|p| p + Vec3::new(2.0, 2.0, 1.2))]);
    for target in [1000, 100, 20, 6, 1] {
        let level = level(&mesh, target, &within(0.1));
        for corner in [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X + Vec3::Y] {
            let off = off(&level.mesh, corner * 4.0);
            assert!(off <= 0.1, "{off} at {target}");
        }
        assert!(level.mesh.triangles.len() <= target || level.stopped == Some(Stop::Deviation));
    }
}

#[test]
fn a_window_closes_only_if_the_limit_is_larger_than_its_radius() {
    let mesh = plate(12, |x, y| (4..8).contains(&x) && (4..8).contains(&y));
    let middle = Vec3::new(0.5, 0.5, 0.0);
    for limit in [0.01, 0.05, 0.09] {
        let level = level(&mesh, 2, &within(limit));
        assert!(off(&level.mesh, middle) > 0.02, "closed at {limit}");
        assert_eq!(level.stopped, Some(Stop::Deviation));
    }
    assert!(off(&level(&mesh, 2, &within(0.25)).mesh, middle) < 1e-3);
}

#[test]
fn the_tip_of_a_triangle_that_vanishes_does_not_come_off_unseen() {
    // A long triangle that hangs on one edge of a sheet.
    let sheet = plate(4, |_, _| false);
    let ear = Vec3::new(1.2, 1.0, 0.0);
    let hung = triangle([Vec3::X, ear, Vec3::new(1.0, 0.25, 0.0)]);
    let mesh = scene(&[(&sheet, &|p| p), (&hung, &|p| p)]);
    for target in [20, 8, 4, 2, 1] {
        let level = level(&mesh, target, &within(0.05));
        assert!(off(&level.mesh, ear) <= 0.05, "{} at {target}", off(&level.mesh, ear));
    }
}

#[test]
fn a_small_shell_vanishes_near_another_and_stays_far_away() {
    let (sheet, small) = (plate(8, |_, _| false), plate(1, |_, _| false));
    for (height, vanishes) in [(0.01, true), (0.3, false)] {
        let place = |p: Vec3| p * 0.02 + Vec3::new(0.5, 0.5, height);
        let mesh = scene(&[(&sheet, &|p| p), (&small, &place)]);
        let level = level(&mesh, 2, &within(0.05));
        let top = level.mesh.positions.iter().map(|p| p.z).fold(0.0, f32::max);
        assert_eq!(top < height / 2.0, vanishes, "{top}");
    }
}

#[test]
fn shells_in_a_row_do_not_vanish_each_into_the_next() {
    let card = plate(1, |_, _| false);
    let places: Vec<_> = (0..20).map(|at| move |p: Vec3| p + Vec3::Z * 0.04 * at as f32).collect();
    let parts: Vec<(&Mesh, &dyn Fn(Vec3) -> Vec3)> =
        places.iter().map(|place| (&card, place as &dyn Fn(Vec3) -> Vec3)).collect();
    let mesh = scene(&parts);
    let level = level(&mesh, 1, &within(0.05));
    for &p in &mesh.positions {
        assert!(off(&level.mesh, p) <= 0.05, "{p} is {} off", off(&level.mesh, p));
    }
    assert!(level.mesh.triangles.len() < 40, "some may be removed");
}

#[test]
fn a_row_of_cards_keeps_the_area_that_may_not_go() {
    let card = plate(2, |_, _| false);
    let place =
        |at: usize| move |p: Vec3| p * Vec3::new(0.02, 1.0, 1.0) + Vec3::Z * 0.02 * at as f32;
    let places: Vec<_> = (0..24).map(place).collect();
    let parts: Vec<(&Mesh, &dyn Fn(Vec3) -> Vec3)> =
        places.iter().map(|place| (&card, place as &dyn Fn(Vec3) -> Vec3)).collect();
    let mesh = scene(&parts);
    for max_lost_area in [0.0, 0.1, 0.5, 0.9] {
        let level = level(&mesh, 1, &Settings { max_lost_area, ..within(0.1).settings }.into());
        let kept = f64::from(area(&level.mesh) / area(&mesh));
        assert!(kept >= 1.0 - max_lost_area - 1e-4, "{kept} with {max_lost_area}");
        assert_eq!(level.stopped, Some(Stop::Deviation));
    }
}

#[test]
fn a_shell_of_a_color_of_its_own_outlasts_its_twin_of_the_color_behind() {
    let (wall, lamp) = (plate(6, |_, _| false), triangle([Vec3::ZERO, Vec3::X, Vec3::Y]));
    let left = |p: Vec3| p * 0.1 + Vec3::new(0.2, 0.45, 0.01);
    let right = |p: Vec3| p * 0.1 + Vec3::new(0.7, 0.45, 0.01);
    let mesh = scene(&[(&wall, &|p| p), (&lamp, &left), (&lamp, &right)]);
    for lit in [false, true] {
        let is_lit = |p: Vec3| p.z > 0.0 && (p.x > 0.5) == lit;
        let colors: Vec<[f32; 3]> =
            mesh.positions.iter().map(|&p| [f32::from(is_lit(p)); 3]).collect();
        let level = level(&mesh, 3, &Options { colors: &colors, ..within(0.05) });
        let lamps = level.mesh.positions.iter().filter(|p| p.z > 0.005);
        let (kept, of_lit): (Vec<&Vec3>, Vec<bool>) = lamps.map(|p| (p, is_lit(*p))).unzip();
        assert!(!kept.is_empty() && of_lit.iter().all(|&lit| lit), "{kept:?}");
    }
}
