//! The promises of the polish, held on whole levels.

use std::sync::atomic::AtomicUsize;

use glam::{DVec2, DVec3, Vec3};
use proptest::prelude::*;

use super::*;
use crate::chain::{Level, polish_chain, simplify_chain};
use crate::edges::{EdgeKind, visit_edges};
use crate::options::Options;
use crate::sample::sample_surface;
use crate::shape::{folds, turns};
use crate::surface::Surface;
use crate::testing::{sphere, surface};
use crate::{Vertices, weld};

/// A mesh in two groups, with wedges of their own, that meet at x = 0.5.
pub(super) fn parted(mesh: &Mesh) -> Mesh {
    let middle = |t: usize| mesh.triangle_positions(t).iter().map(|p| p.x / 3.0).sum::<f32>();
    let vertices = Vertices {
        layout: mesh.layout,
        positions: mesh.wedge_points.iter().map(|&point| mesh.positions[point]).collect(),
        triangles: mesh.triangles.iter().map(|wedges| wedges.map(|wedge| wedge.0)).collect(),
        groups: (0..mesh.triangles.len()).map(|t| u32::from(middle(t) > 0.5)).collect(),
        attributes: mesh.attributes.clone(),
        ..Vertices::default()
    };
    weld(&vertices).expect("a sound mesh").mesh
}

fn descend(mesh: &Mesh, share: f64) -> Vec<Level> {
    let target = (mesh.triangles.len() as f64 * share) as usize;
    simplify_chain(mesh, &[target], &Options::default(), &AtomicUsize::new(0)).unwrap()
}

fn polished(mesh: &Mesh, levels: &[Level]) -> Vec<Level> {
    let mut levels = levels.to_vec();
    let (options, polish) = (Options::default(), Polish::default());
    polish_chain(mesh, &mut levels, &options, &polish, &AtomicUsize::new(0)).unwrap();
    levels
}

fn triangles(mesh: &Mesh) -> Vec<[u32; 3]> {
    (0..mesh.triangles.len()).map(|t| mesh.triangle_points(t).map(|p| p.0)).collect()
}

/// RMS distance of one surface's samples to the other, by the plain nearest point.
fn distance(from: &Mesh, to: &Mesh) -> f64 {
    let other = Surface::new(&to.positions, triangles(to));
    let own = triangles(from);
    let samples = sample_surface(&from.positions, &own, 4000, 99);
    let squares = samples.iter().map(|sample| {
        let corners = from.triangle_positions(sample.triangle.index()).map(Vec3::as_dvec3);
        let b = sample.barycentrics;
        let point = corners[0] * b.x + corners[1] * b.y + corners[2] * b.z;
        other.closest_foot(point, f64::INFINITY, |_| true).unwrap().point.distance_squared(point)
    });
    (squares.sum::<f64>() / samples.len() as f64).sqrt()
}

fn bumps(x: f32, y: f32) -> Vec3 {
    Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos())
}

#[test]
fn a_level_comes_nearer_both_ways() {
    for mesh in [sphere(24), surface(40, bumps)] {
        let before = descend(&mesh, 0.1);
        let after = polished(&mesh, &before);
        let both = |level: &Mesh| [distance(&mesh, level), distance(level, &mesh)];
        let (was, is) = (both(&before[0].mesh), both(&after[0].mesh));
        assert!((0..2).all(|way| is[way] < 0.95 * was[way]), "{is:?} after {was:?}");
    }
}

#[test]
fn attributes_follow_their_surface() {
    // On the sheet every UV is its point's x and y, before and after.
    let mesh = surface(40, bumps);
    let [level] = &polished(&mesh, &descend(&mesh, 0.1))[..] else { panic!("one level") };
    let moved = level.mesh.wedge_points.iter().enumerate().map(|(wedge, &point)| {
        let at = level.mesh.positions[point].truncate();
        at.distance(level.mesh.uv(crate::WedgeId::new(wedge), 0))
    });
    let worst = moved.fold(0.0f32, f32::max);
    assert!(worst < 0.01, "{worst}");
}

#[test]
fn a_seam_that_has_moved_over_what_is_flat_comes_back() {
    let mesh = parted(&surface(40, |x, y| Vec3::new(x, y, 0.0)));
    let mut level = descend(&mesh, 0.2);
    let mut seam = Vec::new();
    visit_edges(&level[0].mesh, |kind, sides| {
        seam.extend(sides[0].0.into_iter().filter(|_| kind == EdgeKind::Seam));
    });
    let inside = |p: &Vec3| p.y > 0.01 && p.y < 0.99;
    seam.retain(|&p| inside(&level[0].mesh.positions[p]));
    assert!(seam.len() > 4, "{}", seam.len());
    for &point in &seam {
        level[0].mesh.positions[point].x = 0.504;
    }
    let after = polished(&mesh, &level).remove(0).mesh;
    let worst = seam.iter().map(|&p| (after.positions[p].x - 0.5).abs()).fold(0.0, f32::max);
    assert!(worst < 0.7 * 0.004, "{worst}");
}

#[test]
fn what_counts_more_comes_nearer_and_a_common_factor_changes_nothing() {
    let mesh = parted(&surface(40, bumps));
    let level = descend(&mesh, 0.05);
    let fitted = |factor: f32, elsewhere: f32| {
        let of = |p: &Vec3| if p.x < 0.5 { factor } else { elsewhere };
        let importance: Vec<f32> = mesh.positions.iter().map(of).collect();
        let options = Options { importance: &importance, ..Options::default() };
        let mut levels = level.clone();
        polish_chain(&mesh, &mut levels, &options, &Polish::default(), &AtomicUsize::new(0))
            .unwrap();
        levels.remove(0).mesh
    };
    let plain = polished(&mesh, &level).remove(0).mesh;
    assert_eq!(fitted(4.0, 4.0).positions, plain.positions);
    assert_eq!(fitted(4.0, 4.0).attributes, plain.attributes);
    // A point of the level in the middle belongs to both halves: what counts more has its way.
    let off = |level: &Mesh| {
        let surface = Surface::new(&level.positions, triangles(level));
        let points = mesh.positions.iter().filter(|p| (0.4..0.5).contains(&p.x));
        let squares = points.map(|p| {
            let foot = surface.closest_foot(p.as_dvec3(), f64::INFINITY, |_| true).unwrap();
            foot.point.distance_squared(p.as_dvec3())
        });
        squares.sum::<f64>().sqrt()
    };
    let [less, as_is, more] = [&fitted(1.0, 100.0), &plain, &fitted(100.0, 1.0)].map(off);
    assert!(more < as_is && as_is < less, "{more} {as_is} {less}");
}

#[test]
fn the_bits_do_not_depend_on_the_number_of_threads() {
    let mesh = sphere(32);
    let levels = descend(&mesh, 0.25);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| polished(&mesh, &levels)).remove(0).mesh
    };
    let (one, three) = (on(1), on(3));
    assert_eq!(one.positions, three.positions);
    assert_eq!(one.attributes, three.attributes);
}

#[test]
fn a_level_that_lost_nothing_stays_as_it_is() {
    let mesh = sphere(8);
    let levels = descend(&mesh, 1.0);
    let after = polished(&mesh, &levels);
    assert_eq!(after[0].mesh.positions, levels[0].mesh.positions);
    assert_eq!(after[0].mesh.attributes, levels[0].mesh.attributes);
}

#[test]
fn figures_that_make_no_sense_are_refused() {
    let mesh = sphere(8);
    for polish in [
        Polish { density: -1.0, ..Polish::default() },
        Polish { damping: f64::NAN, ..Polish::default() },
        Polish { attribute_damping: f64::INFINITY, ..Polish::default() },
    ] {
        let mut levels = descend(&mesh, 0.5);
        let (options, done) = (Options::default(), AtomicUsize::new(0));
        assert!(polish_chain(&mesh, &mut levels, &options, &polish, &done).is_err());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// On rough sheets: borders stay, no triangle turns over in space or in UV, all is finite.
    #[test]
    fn promises_hold(heights in prop::collection::vec(-0.2f32..0.2, 16 * 16), share in 0.05f64..0.9) {
        let mesh = surface(15, |x, y| {
            let at = |t: f32| (t * 15.0).round() as usize;
            Vec3::new(x, y, heights[at(y) * 16 + at(x)])
        });
        let before = descend(&mesh, share).remove(0);
        let after = polished(&mesh, std::slice::from_ref(&before)).remove(0).mesh;
        let before = before.mesh;
        prop_assert!(after.positions.iter().all(|p| p.is_finite()));
        prop_assert!(after.attributes.iter().all(|a| a.is_finite()));
        for t in 0..before.triangles.len() {
            let at = |mesh: &Mesh| -> [DVec3; 3] { mesh.triangle_positions(t).map(Vec3::as_dvec3) };
            prop_assert!(at(&before) == at(&after) || !turns(at(&before), at(&after), 75f64.to_radians().cos()));
            let uv = |mesh: &Mesh| -> [DVec2; 3] { mesh.triangles[t].map(|w| mesh.uv(w, 0).as_dvec2()) };
            prop_assert!(!folds(uv(&before), uv(&after)));
        }
        let mut held = Vec::new();
        visit_edges(&before, |kind, sides| {
            if kind == EdgeKind::Border {
                held.extend(sides[0].0);
            }
        });
        prop_assert!(held.iter().all(|&p| before.positions[p] == after.positions[p]));
    }
}
