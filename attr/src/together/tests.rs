use super::*;
use crate::chain::simplify_chain;
use crate::settings::Settings;
use crate::testing::{grid, sphere, surface};
use glam::Vec3;

fn shared<'a>(mesh: &'a Mesh, stretches: &'a [f64]) -> Shared<'a> {
    Shared { mesh, options: Options::default(), stretches }
}

/// Triangles of each surface at each level.
fn left(surfaces: &[Shared<'_>], targets: &[usize]) -> Vec<Vec<usize>> {
    let chains = simplify_together(surfaces, targets, &AtomicUsize::new(0)).unwrap();
    let triangles = |level: &Level| {
        level.mesh.validate().unwrap();
        level.mesh.triangles.len()
    };
    chains.iter().map(|chain| chain.iter().map(triangles).collect()).collect()
}

#[test]
fn a_plane_gives_what_a_sphere_keeps_and_the_sum_meets_its_target() {
    let (plane, ball) = (grid(40), sphere(24));
    let targets = [2200, 800, 300];
    let left = left(&[shared(&plane, &[1.0]), shared(&ball, &[1.0])], &targets);
    for (level, target) in targets.into_iter().enumerate() {
        let sum = left[0][level] + left[1][level];
        assert!(sum <= target && sum + 1 >= target, "{sum} of {target}");
    }
    assert!(left[0][1] < 10 && left[1][1] > 780, "{left:?}");
    assert!(left[0][2] >= 1);
}

#[test]
fn like_surfaces_get_alike_and_one_alone_what_it_would() {
    let ball = sphere(24);
    let twins = left(&[shared(&ball, &[1.0]), shared(&ball, &[1.0])], &[1000, 300]);
    assert!(twins[0].iter().zip(&twins[1]).all(|(a, b)| a.abs_diff(*b) <= 10), "{twins:?}");
    let alone = simplify_together(&[shared(&ball, &[3.0])], &[500, 99], &AtomicUsize::new(0));
    let chain = simplify_chain(&ball, &[500, 99], &Options::default(), &AtomicUsize::new(0));
    for (one, other) in alone.unwrap()[0].iter().zip(chain.unwrap()) {
        assert_eq!(one.mesh, other.mesh);
    }
}

#[test]
fn what_is_shown_large_or_often_gets_more() {
    let bumps = surface(30, |x, y| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()));
    let gets = |stretches: &[f64]| {
        let left = left(&[shared(&bumps, &[1.0]), shared(&bumps, stretches)], &[900]);
        left[1][0] as f64 / left[0][0] as f64
    };
    // A cost is about the cube of a triangle's area in its own space, and the hedge is a power.
    let (twice, often) = (gets(&[2.0]), gets(&[1.0; 16]));
    assert!((twice / 16f64.powf(1.0 / f64::from(3 + HEDGE)) - 1.0).abs() < 0.15, "{twice}");
    assert_eq!(twice, often);
    let small = bumps.positions.iter().map(|&p| p * 0.25).collect();
    let small = Mesh { positions: small, ..bumps.clone() };
    let left = left(&[shared(&bumps, &[1.0]), shared(&small, &[8.0])], &[900]);
    assert_eq!(left[1][0] as f64 / left[0][0] as f64, twice, "a mesh in other units");
}

#[test]
fn a_small_thing_stays_beside_a_vast_plain() {
    let (mut plain, ball) = (grid(40), sphere(24));
    plain.positions.iter_mut().for_each(|p| *p = (*p + Vec3::splat(0.3)) * 3000.0);
    let left = left(&[shared(&plain, &[1.0]), shared(&ball, &[1.0])], &[1000]);
    assert!(left[0][0] < 40, "{left:?}");
}

#[test]
fn limits_and_locks_hold_and_what_stops_says_so() {
    let (plane, ball) = (grid(12), sphere(12));
    let locked = vec![true; plane.positions.len()];
    let surfaces = [
        Shared {
            options: Options { locked: &locked, ..Options::default() },
            ..shared(&plane, &[1.0])
        },
        Shared {
            options: Settings { max_error: Some(5e-2), ..Settings::default() }.into(),
            ..shared(&ball, &[1.0])
        },
    ];
    let chains = simplify_together(&surfaces, &[790, 290], &AtomicUsize::new(0)).unwrap();
    assert_eq!(chains[0][1].mesh.triangles.len(), plane.triangles.len());
    assert_eq!([chains[0][0].stopped, chains[1][0].stopped], [None, None]);
    let stops = [chains[0][1].stopped, chains[1][1].stopped];
    assert_eq!(stops, [Some(Stop::NoLegalCollapse), Some(Stop::ErrorLimit)]);
    assert!(chains[1][1].error <= 5e-2);
}

#[test]
fn levels_are_the_same_with_one_thread_and_with_three() {
    let bumps = surface(30, |x, y| Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos()));
    let (plane, ball) = (grid(30), sphere(24));
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let all = [&bumps, &plane, &ball].map(|mesh| shared(mesh, &[1.0]));
        pool.install(|| simplify_together(&all, &[2000, 500, 100], &AtomicUsize::new(0)))
    };
    for (one, three) in run(1).unwrap().iter().zip(run(3).unwrap()) {
        assert!(one.iter().zip(three).all(|(one, three)| one.mesh == three.mesh));
    }
}

#[test]
fn steps_that_are_taken_again_lead_to_the_same_bit() {
    let (plane, ball) = (grid(12), sphere(24));
    let locked = vec![true; plane.positions.len()];
    let stays = Options { locked: &locked, ..Options::default() };
    for settings in [Settings::default(), Settings::for_diagonal(2.0)] {
        let surfaces = [
            Shared { options: stays, ..shared(&plane, &[1.0]) },
            Shared { options: settings.into(), ..shared(&ball, &[1.0]) },
        ];
        for left in [1000, 400, 100] {
            let target = plane.triangles.len() + left;
            let removed = AtomicUsize::new(0);
            let chains = simplify_together(&surfaces, &[target], &removed).unwrap();
            let chain =
                simplify_chain(&ball, &[left], &settings.into(), &AtomicUsize::new(0)).unwrap();
            assert_eq!(chains[1][0].mesh, chain[0].mesh);
            assert_eq!(chains[1][0].error.to_bits(), chain[0].error.to_bits());
            assert_eq!(chains[1][0].wedge_sources, chain[0].wedge_sources);
            let all = plane.triangles.len() + ball.triangles.len();
            assert!(removed.into_inner() <= all - target);
        }
    }
}

#[test]
fn what_costs_little_goes_as_far_as_it_has_to() {
    let waves = |height: f32| {
        surface(30, |x, y| Vec3::new(x, y, height * (9.0 * x).sin() * (7.0 * y).cos()))
    };
    let (high, low) = (waves(0.3), waves(1e-5));
    let left = left(&[shared(&high, &[1.0]), shared(&low, &[1.0])], &[1000, 300]);
    for (level, target) in [1000, 300].into_iter().enumerate() {
        let sum = left[0][level] + left[1][level];
        assert!(sum <= target && sum + 1 >= target, "{sum} of {target}");
    }
    assert!(left[1][1] < 150 / MARGIN, "{left:?}");
}
