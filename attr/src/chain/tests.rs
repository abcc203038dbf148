use super::*;
use crate::settings::Settings;
use crate::testing::{grid, sphere, surface};
use glam::Vec3;
use proptest::prelude::*;

fn chain(mesh: &Mesh, targets: &[usize]) -> Vec<Level> {
    simplify_chain(mesh, targets, &Options::default(), &AtomicUsize::new(0)).unwrap()
}

/// Edges by how many triangles they have: (one, two, more).
fn edge_counts(mesh: &Mesh) -> (usize, usize, usize) {
    let mut edges: Vec<[PointId; 2]> = (0..mesh.triangles.len())
        .flat_map(|triangle| {
            let [a, b, c] = mesh.triangle_points(triangle);
            [(a, b), (b, c), (c, a)].map(|(p, q)| [p.min(q), p.max(q)])
        })
        .collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| a == b).fold((0, 0, 0), |(one, two, more), run| match run.len() {
        1 => (one + 1, two, more),
        2 => (one, two + 1, more),
        _ => (one, two, more + 1),
    })
}

#[test]
fn a_flat_grid_goes_to_two_triangles_without_error() {
    let level = chain(&grid(8), &[2]).remove(0);
    assert_eq!((level.mesh.triangles.len(), level.stopped), (2, None));
    assert!(level.error < 1e-6);
    let area: f32 = (0..2)
        .map(|t| {
            let [a, b, c] = level.mesh.triangle_positions(t);
            (b - a).cross(c - a).length() / 2.0
        })
        .sum();
    assert!((area - 1.0).abs() < 1e-4, "area {area}");
}

#[test]
fn a_sphere_stays_closed_and_near_itself_through_its_seam_and_poles() {
    let source = sphere(24);
    let targets = [1000, 500, 250, 60];
    for (level, target) in chain(&source, &targets).iter().zip(targets) {
        level.mesh.validate().unwrap();
        let triangles = level.mesh.triangles.len();
        assert!(triangles <= target && triangles + 2 > target, "{triangles} of {target}");
        let (one, _, more) = edge_counts(&level.mesh);
        assert_eq!((one, more), (0, 0));
        for p in &level.mesh.positions {
            assert!((p.length() - 1.0).abs() < 0.2, "{p}");
        }
    }
}

#[test]
fn an_unreachable_target_says_why() {
    let level = chain(&sphere(6), &[1]).remove(0);
    assert_eq!(level.stopped, Some(Stop::NoLegalCollapse));
    assert!(level.mesh.triangles.len() >= 4);
}

#[test]
fn the_error_limit_ends_the_descent() {
    let options: Options<'_> = Settings { max_error: Some(1e-3), ..Settings::default() }.into();
    let levels = simplify_chain(&sphere(16), &[10], &options, &AtomicUsize::new(0)).unwrap();
    assert_eq!(levels[0].stopped, Some(Stop::ErrorLimit));
    assert!(levels[0].error <= 1e-3 && levels[0].mesh.triangles.len() > 10);
}

#[test]
fn a_mesh_far_away_or_tiny_gives_the_same_triangles() {
    // Powers of two, so that the move itself rounds nothing that the scale of a unit sphere
    // does not: coordinates keep 2⁻³ of 2²⁰, so the sphere is made on that lattice first.
    let snapped = |mut mesh: Mesh, map: &dyn Fn(Vec3) -> Vec3| {
        for p in &mut mesh.positions {
            *p = map((*p * 512.0).round());
        }
        mesh
    };
    let near = chain(&snapped(sphere(12), &|p| p), &[100]).remove(0);
    let far = chain(&snapped(sphere(12), &|p| p + Vec3::splat(1_048_576.0)), &[100]).remove(0);
    let tiny = chain(&snapped(sphere(12), &|p| p / 536_870_912.0), &[100]).remove(0);
    assert_eq!(near.mesh.triangles, far.mesh.triangles);
    assert_eq!(near.mesh.triangles, tiny.mesh.triangles);
}

#[test]
fn small_shells_are_removed_rather_than_stop_the_descent() {
    let mut soup = grid(8);
    let quad = grid(1);
    for copy in 0..20u32 {
        let (points, wedges) = (soup.positions.len() as u32, soup.wedge_points.len() as u32);
        let at = |p: &Vec3| *p * 0.01 + Vec3::new(copy as f32 * 0.05, 0.0, 1.0);
        soup.positions.extend(quad.positions.iter().map(at));
        soup.wedge_points.extend(quad.wedge_points.iter().map(|p| PointId(p.0 + points)));
        soup.attributes.extend(&quad.attributes);
        soup.triangles.extend(quad.triangles.iter().map(|t| t.map(|w| WedgeId(w.0 + wedges))));
        soup.groups.extend(&quad.groups);
    }
    let level = chain(&soup, &[6]).remove(0);
    assert_eq!(level.stopped, None);
    assert!(level.mesh.positions.iter().any(|p| p.z == 0.0), "the large sheet stays");
}

#[test]
fn a_string_keeps_its_length() {
    let string = surface(20, |x, y| {
        let turn = if x == 1.0 { 0.0 } else { x * std::f32::consts::TAU };
        let wave = 0.006 * (60.0 * y).sin();
        Vec3::new(y, 0.003 * turn.cos(), 0.003 * turn.sin() + wave)
    });
    let length = |mesh: &Mesh| {
        let xs = mesh.positions.iter().map(|p| p.x);
        xs.clone().fold(f32::MIN, f32::max) - xs.fold(f32::MAX, f32::min)
    };
    for level in chain(&string, &[200, 100, 50]) {
        let kept = length(&level.mesh);
        assert!(kept > 0.98, "{kept} at {} triangles", level.target);
    }
}

#[test]
fn levels_are_the_same_with_one_thread_and_with_two() {
    let mesh = sphere(24);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| chain(&mesh, &[300, 100]))
    };
    for (one, two) in run(1).iter().zip(run(2)) {
        assert_eq!(one.mesh, two.mesh);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn a_bumpy_sheet_stays_sound(seed in 0.0..100.0f32, ratio in 0.02..0.9f64) {
        let source = surface(12, |x, y| {
            Vec3::new(x, y, 0.1 * ((x * 9.0 + seed).sin() * (y * 7.0 - seed).cos()))
        });
        let target = (source.triangles.len() as f64 * ratio) as usize;
        let level = chain(&source, &[target]).remove(0);
        level.mesh.validate().unwrap();
        prop_assert!(level.mesh.triangles.len() <= target.max(2));
        prop_assert_eq!(edge_counts(&level.mesh).2, 0);
        for wedges in &level.mesh.triangles {
            let [a, b, c] = wedges.map(|wedge| level.mesh.uv(wedge, 0));
            prop_assert!((b - a).perp_dot(c - a) > 0.0, "a UV triangle folded over");
        }
    }
}
