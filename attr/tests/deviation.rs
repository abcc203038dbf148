//! No level is farther from its source than the limit, on meshes that are hard to keep.

mod shapes;

use std::sync::atomic::AtomicUsize;

use glam::Vec3;
use proptest::prelude::*;
use rayon::ThreadPoolBuilder;
use seamwise_attr::{Level, Mesh, Options, Settings, Stop, simplify_chain};
use shapes::{KINDS, Kind, Noise, Soup, diagonal, farthest, make};

/// Limits, as shares of the diagonal.
const SHARES: [f64; 7] = [0.0, 1e-4, 0.002, 0.01, 0.025, 0.1, 0.4];

/// A mesh of any kind, near the origin and about 1 in size, tiny, or far away.
fn any_mesh() -> impl Strategy<Value = (Kind, Mesh)> {
    (0..KINDS.len(), any::<u64>(), 0..3).prop_map(|(kind, seed, place)| {
        let mut soup = make(KINDS[kind], &mut Noise::new(seed));
        match place {
            0 => {}
            1 => soup.map(|p| p * 1e-6),
            _ => soup.map(|p| p * 1000.0 + Vec3::splat(1e6)),
        }
        (KINDS[kind], soup.mesh())
    })
}

fn any_limit() -> impl Strategy<Value = f64> {
    (0..SHARES.len()).prop_map(|at| SHARES[at])
}

fn levels(mesh: &Mesh, options: &Options<'_>) -> Vec<Level> {
    let targets = [2, 4, 16, usize::MAX].map(|part| (mesh.triangles.len() / part).max(1));
    simplify_chain(mesh, &targets, options, &AtomicUsize::new(0)).expect("levels")
}

fn within(limit: f64) -> Options<'static> {
    Settings { max_deviation: Some(limit), ..Settings::default() }.into()
}

/// Fails unless each level is a mesh that is at its target, or stopped by the limit or for want of a
/// collapse.
fn assert_sound(levels: &[Level]) {
    for level in levels {
        level.mesh.validate().expect("a sound level");
        assert!(level.mesh.positions.iter().all(|p| p.is_finite()));
        assert!(!level.mesh.triangles.is_empty(), "nothing is left");
        let is_there = level.mesh.triangles.len() <= level.target;
        assert!(is_there != level.stopped.is_some(), "{:?} at {}", level.stopped, level.target);
    }
}

/// Fails unless both surfaces are within `slack` times the limit of each other. Positions are rounded to f32
/// where they are.
fn assert_near(mesh: &Mesh, level: &Mesh, limit: f64, slack: f64) {
    let diagonal = diagonal(mesh);
    let most = mesh.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
    let rounding = 1e-6 * diagonal + 2.0 * f64::from(f32::EPSILON * most);
    let spacing = (limit / 3.0).max(diagonal / 80.0);
    for (from, to) in [(mesh, level), (level, mesh)] {
        let off = farthest(from, to, spacing);
        assert!(off <= slack * limit + rounding, "{} of the limit {limit}", off / limit);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn source_and_level_are_near_each_other((kind, mesh) in any_mesh(), share in any_limit()) {
        prop_assume!(!mesh.triangles.is_empty());
        let limit = share * diagonal(&mesh);
        let levels = levels(&mesh, &within(limit));
        assert_sound(&levels);
        // Places that are asked lie up to the limit apart, and farther on large triangles: a hole may hide
        // between them.
        let slack = if let Kind::Holes = kind { 2.0 } else { 1.5 };
        levels.iter().for_each(|level| assert_near(&mesh, &level.mesh, limit, slack));
    }

    #[test]
    fn only_a_limit_stops_a_descent_for_the_sake_of_the_shape((_, mesh) in any_mesh()) {
        prop_assume!(!mesh.triangles.is_empty());
        let levels = levels(&mesh, &Options::default());
        assert_sound(&levels);
        prop_assert!(levels.iter().all(|level| level.stopped != Some(Stop::Deviation)));
    }

    #[test]
    fn the_last_level_has_hardly_more_triangles_within_a_looser_limit(
        (_, mesh) in any_mesh(),
        tight in any_limit(),
        loose in any_limit(),
    ) {
        prop_assume!(!mesh.triangles.is_empty() && tight < loose);
        let diagonal = diagonal(&mesh);
        let [tight, loose] = [tight, loose].map(|share| {
            let levels = levels(&mesh, &within(share * diagonal));
            levels.iter().map(|level| level.mesh.triangles.len()).collect::<Vec<_>>()
        });
        for (tight, loose) in tight.into_iter().zip(loose) {
            prop_assert!(loose <= tight + tight / 10 + 16, "{} after {}", loose, tight);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn levels_within_a_limit_do_not_depend_on_the_number_of_threads(
        (_, mesh) in any_mesh(),
        share in any_limit(),
    ) {
        prop_assume!(!mesh.triangles.is_empty());
        let limit = share * diagonal(&mesh);
        let on = |threads: usize| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| levels(&mesh, &within(limit)))
        };
        for (one, three) in on(1).iter().zip(on(3)) {
            prop_assert_eq!(&one.mesh, &three.mesh);
            prop_assert_eq!(one.stopped, three.stopped);
        }
    }
}

#[test]
fn one_triangle_stays_whatever_the_limit() {
    let soup = Soup { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]] };
    for limit in [0.0, f64::MIN_POSITIVE, 1.0, 1e30, f64::INFINITY] {
        let levels = levels(&soup.mesh(), &within(limit));
        assert_sound(&levels);
        assert!(levels.iter().all(|level| level.mesh.triangles.len() == 1));
    }
}

#[test]
fn a_limit_of_zero_takes_what_is_flat_and_nothing_else() {
    let mut soup = Soup::default();
    soup.sheet([8, 8], |x, y| Vec3::new(x, y, 0.0), |_, _| false);
    let flat = levels(&soup.mesh(), &within(0.0)).pop().expect("a level");
    assert!(flat.mesh.triangles.len() < 16, "{}", flat.mesh.triangles.len());
    assert_near(&soup.mesh(), &flat.mesh, 0.0, 1.0);
    soup.map(|p| p + Vec3::Z * (9.0 * p.x).sin() * (7.0 * p.y).cos());
    let bent = levels(&soup.mesh(), &within(0.0)).pop().expect("a level");
    assert_eq!((bent.mesh.triangles.len(), bent.stopped), (128, Some(Stop::Deviation)));
}

#[test]
fn a_limit_larger_than_the_mesh_stops_nothing() {
    for (kind, seed) in KINDS.into_iter().zip(1..) {
        let mesh = make(kind, &mut Noise::new(seed)).mesh();
        let (free, loose) = (levels(&mesh, &Options::default()), levels(&mesh, &within(1e3)));
        assert_sound(&loose);
        for (free, loose) in free.iter().zip(&loose) {
            assert_eq!(free.mesh.triangles.len(), loose.mesh.triangles.len(), "{kind:?}");
        }
    }
}

#[test]
fn limits_that_make_no_sense_are_refused() {
    let soup = Soup { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]] };
    let mesh = soup.mesh();
    let colors = [[0.0; 3]; 2];
    let bad = [
        within(-1.0),
        within(f64::NAN),
        Settings { max_lost_area: -0.1, ..within(1.0).settings }.into(),
        Settings { max_lost_area: 1.1, ..within(1.0).settings }.into(),
        Settings { max_lost_area: f64::NAN, ..within(1.0).settings }.into(),
        Options { colors: &colors, ..within(1.0) },
    ];
    for options in bad {
        assert!(simplify_chain(&mesh, &[1], &options, &AtomicUsize::new(0)).is_err());
    }
}
