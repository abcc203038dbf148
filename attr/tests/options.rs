//! Options of a simplification hold from the first collapse to the last step of a polish.

#[path = "../src/testing.rs"]
mod testing;

use std::sync::atomic::AtomicUsize;

use glam::Vec3;
use seamwise_attr::{
    Cost, Layout, Level, Mesh, Options, Placement, PointId, Polish, Settings, Vertices, WedgeId,
    polish_chain, simplify_chain, weld,
};
use testing::{grid, sphere, surface};

fn chain(mesh: &Mesh, target: usize, options: &Options<'_>) -> Level {
    simplify_chain(mesh, &[target], options, &AtomicUsize::new(0)).unwrap().remove(0)
}

fn polished(mesh: &Mesh, level: Level, options: &Options<'_>) -> Level {
    let mut levels = [level];
    let polish = Polish::default();
    polish_chain(mesh, &mut levels, options, &polish, &AtomicUsize::new(0)).unwrap();
    let [level] = levels;
    level
}

/// Fails unless every locked point of the source is there as it was, all of its wedges too.
fn assert_kept(mesh: &Mesh, locked: &[bool], level: &Level) {
    let bits = |row: &[f32]| row.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let mut found = vec![0; mesh.wedge_points.len()];
    for (wedge, &source) in level.wedge_sources.iter().enumerate() {
        let point = level.mesh.wedge_points[wedge];
        let stands_for = level.point_sources[point];
        if locked[stands_for.index()] {
            let (own, old) = (level.mesh.positions[point], mesh.positions[stands_for]);
            assert_eq!(bits(&own.to_array()), bits(&old.to_array()));
            let own = level.mesh.row(WedgeId::new(wedge));
            assert_eq!(bits(own), bits(mesh.row(source)));
            found[source.index()] += 1;
        }
    }
    for (wedge, &point) in mesh.wedge_points.iter().enumerate() {
        assert!(!locked[point.index()] || found[wedge] == 1, "wedge {wedge}");
    }
}

#[test]
fn locked_points_keep_their_bits_through_descent_and_polish() {
    let bumps = surface(30, |x, y| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()));
    for mesh in [bumps, sphere(24)] {
        let locked: Vec<bool> = mesh.positions.iter().map(|p| p.x > 0.6).collect();
        for cost in [Cost::Quadric, Cost::EdgeLength] {
            let options =
                Options { locked: &locked, ..Settings { cost, ..Settings::default() }.into() };
            let level = chain(&mesh, mesh.triangles.len() / 2, &options);
            assert_eq!(level.stopped, None);
            assert_kept(&mesh, &locked, &level);
            assert_kept(&mesh, &locked, &polished(&mesh, level, &options));
        }
    }
}

#[test]
fn locks_hold_in_regions_and_stop_what_is_locked_whole() {
    let mesh = sphere(182);
    let locked: Vec<bool> = mesh.positions.iter().map(|p| p.z > 0.5).collect();
    let options = Options { locked: &locked, ..Options::default() };
    assert_kept(&mesh, &locked, &chain(&mesh, mesh.triangles.len() / 2, &options));
    let (mesh, locked) = (grid(4), [true; 25]);
    let options = Options { locked: &locked, ..Options::default() };
    let level = chain(&mesh, 2, &options);
    assert_eq!((level.mesh.triangles.len(), level.stopped.is_some()), (32, true));
}

#[test]
fn no_triangle_turns_farther_than_allowed() {
    let bumps = surface(30, |x, y| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()));
    let normal = |mesh: &Mesh, triangle: usize| {
        let [a, b, c] = mesh.triangle_positions(triangle);
        (b - a).cross(c - a).normalize()
    };
    let steepest = |level: &Level| {
        let count = level.mesh.triangles.len();
        (0..count).map(|t| normal(&level.mesh, t).z).fold(1.0f32, f32::min)
    };
    let tight = Settings { max_rotation: 5.0, ..Settings::default() }.into();
    let (loose, tight) = (chain(&bumps, 60, &Options::default()), chain(&bumps, 60, &tight));
    assert!(tight.mesh.triangles.len() > loose.mesh.triangles.len());
    assert!(steepest(&tight) >= steepest(&loose));
}

#[test]
fn a_closed_surface_keeps_its_volume_through_descent_and_polish() {
    let mesh = sphere(24);
    let volume = |mesh: &Mesh| {
        let corners = (0..mesh.triangles.len()).map(|t| mesh.triangle_positions(t));
        corners.map(|[a, b, c]| a.as_dvec3().dot(b.cross(c).as_dvec3())).sum::<f64>()
    };
    let off = |level: &Level| (volume(&level.mesh) / volume(&mesh) - 1.0).abs();
    let kept = Settings { keep_volume: true, ..Settings::default() }.into();
    let (free, level) = (chain(&mesh, 100, &Options::default()), chain(&mesh, 100, &kept));
    assert!(off(&level) < 1e-5 && off(&level) < 0.1 * off(&free), "{} {}", off(&level), off(&free));
    let polished = polished(&mesh, level, &kept);
    assert!(off(&polished) < 1e-5, "{}", off(&polished));
}

#[test]
fn an_island_keeps_its_area_though_its_coast_gets_coarser() {
    let (rings, around) = (12, 96);
    let mut positions = vec![Vec3::ZERO];
    for ring in 1..=rings {
        for at in 0..around {
            let turn = at as f32 / around as f32 * std::f32::consts::TAU;
            let radius = ring as f32 / rings as f32 * (1.0 + 0.1 * (7.0 * turn).sin());
            positions.push(Vec3::new(radius * turn.cos(), radius * turn.sin(), 0.0));
        }
    }
    let at = |ring: u32, k: u32| if ring == 0 { 0 } else { 1 + (ring - 1) * around + k % around };
    let mut indices = Vec::new();
    for (ring, k) in (0..rings).flat_map(|ring| (0..around).map(move |k| (ring, k))) {
        let [a, b, c, d] = [at(ring, k), at(ring + 1, k), at(ring + 1, k + 1), at(ring, k + 1)];
        indices.extend([a, b, c]);
        if ring > 0 {
            indices.extend([a, c, d]);
        }
    }
    let mesh = weld(&Vertices::new(&positions, &indices).expect("an island")).expect("one").mesh;
    let area = |mesh: &Mesh| {
        let corners = (0..mesh.triangles.len()).map(|t| mesh.triangle_positions(t));
        corners.map(|[a, b, c]| f64::from((b - a).cross(c - a).z)).sum::<f64>()
    };
    let off = |level: &Level| (area(&level.mesh) / area(&mesh) - 1.0).abs();
    let kept = Settings { keep_area: true, ..Settings::default() }.into();
    let (free, level) = (chain(&mesh, 30, &Options::default()), chain(&mesh, 30, &kept));
    assert!(off(&level) < 1e-5 && off(&level) < 0.1 * off(&free), "{} {}", off(&level), off(&free));
    assert!(off(&polished(&mesh, level, &kept)) < 1e-5);
}

#[test]
fn the_ends_placement_keeps_vertices_of_the_source_to_the_bit() {
    let mesh = sphere(24);
    let options = Settings { placement: Placement::Ends, ..Settings::default() }.into();
    let level = chain(&mesh, 200, &options);
    assert!(level.mesh.triangles.len() <= 200);
    let kept = |level: &Level| {
        let own = |wedge: usize| {
            let (id, source) = (WedgeId::new(wedge), level.wedge_sources[wedge]);
            let point = level.point_sources[level.mesh.wedge_points[wedge]];
            level.mesh.row(id) == mesh.row(source) && mesh.wedge_points[source] == point
        };
        let rows = (0..level.wedge_sources.len()).filter(|&wedge| own(wedge)).count();
        rows as f64 / level.wedge_sources.len() as f64
    };
    for level in [&level, &polished(&mesh, level.clone(), &options)] {
        for (p, &source) in level.mesh.positions.iter().zip(&level.point_sources) {
            assert_eq!(*p, mesh.positions[source]);
        }
        assert!(kept(level) > 0.95, "{}", kept(level));
    }
}

#[test]
fn edge_lengths_leave_no_short_edges_and_quadrics_lie_nearer() {
    let mesh = surface(30, |x, y| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()));
    let with = |cost, placement| {
        chain(&mesh, 300, &Settings { cost, placement, ..Settings::default() }.into())
    };
    let shortest = |level: &Level| {
        let triangles = (0..level.mesh.triangles.len()).map(|t| level.mesh.triangle_positions(t));
        triangles
            .flat_map(|[a, b, c]| [a.distance(b), b.distance(c), c.distance(a)])
            .fold(f32::MAX, f32::min)
    };
    let quadric = with(Cost::Quadric, Placement::Best);
    let length = with(Cost::EdgeLength, Placement::Middle);
    assert!(length.mesh.triangles.len() <= 300);
    assert!(shortest(&length) > 1.5 * shortest(&quadric));
    assert!(length.error > 2.0 * quadric.error, "{} {}", length.error, quadric.error);
}

#[test]
fn figures_and_lists_that_make_no_sense_are_refused() {
    let refused = |options: &Options<'_>| {
        let refused = simplify_chain(&grid(2), &[2], options, &AtomicUsize::new(0));
        refused.unwrap_err().to_string()
    };
    let options = Options { locked: &[true], ..Options::default() };
    assert!(refused(&options).contains("1 locks for 9 points"));
    for max_rotation in [0.0, 91.0, f64::NAN] {
        let options = Settings { max_rotation, ..Settings::default() }.into();
        assert!(refused(&options).contains("at most 90 degrees"));
    }
}
