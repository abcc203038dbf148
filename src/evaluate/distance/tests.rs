use super::*;

type Soup = (Vec<Vec3>, Vec<[u32; 3]>);

fn sphere(radius: f32, side: u32) -> Soup {
    let row = side + 1;
    let point = |at: u32| {
        let polar = (at / row) as f32 / side as f32 * std::f32::consts::PI;
        let around = (at % row) as f32 / side as f32 * std::f32::consts::TAU;
        let (sin, cos) = polar.sin_cos();
        Vec3::new(sin * around.cos(), sin * around.sin(), cos) * radius
    };
    let quads = (0..side * side).map(|at| at / side * row + at % side);
    let triangles = quads.flat_map(|a| [[a, a + row, a + row + 1], [a, a + row + 1, a + 1]]);
    ((0..row * row).map(point).collect(), triangles.collect())
}

/// A square of side 1 in the plane z = `height`, seen from above or from below.
fn square(height: f32, is_up: bool) -> Soup {
    let positions = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let positions = positions.map(|(x, y)| Vec3::new(x, y, height)).to_vec();
    let triangles = if is_up { [[0, 1, 2], [0, 2, 3]] } else { [[0, 2, 1], [0, 3, 2]] };
    (positions, triangles.to_vec())
}

fn join(a: &Soup, b: &Soup) -> Soup {
    let base = a.0.len() as u32;
    let moved = b.1.iter().map(|t| t.map(|p| p + base));
    ([&a.0[..], &b.0].concat(), a.1.iter().copied().chain(moved).collect())
}

fn sampled(soup: &Soup, count: usize) -> SampledSurface<'_> {
    SampledSurface::new(&soup.0, &soup.1, count, 1)
}

fn both_ways(a: &Soup, b: &Soup) -> [Distances; 2] {
    let (a, b) = (sampled(a, 20_000), sampled(b, 20_000));
    [correspond(&a, &b), correspond(&b, &a)].map(|way| way.unwrap().distances())
}

#[test]
fn a_surface_is_nowhere_away_from_itself() {
    let mut soup = sphere(3.7, 40);
    soup.0.iter_mut().for_each(|p| *p += Vec3::new(1e3, -50.0, 0.01));
    // Its triangles twice, once inside out, in another order and each begun at another corner.
    let double = join(&soup, &soup);
    let mut turned = double.clone();
    turned.1.iter_mut().skip(3200).for_each(|t| t.swap(0, 1));
    let mut shuffled = turned.clone();
    shuffled.1.reverse();
    shuffled.1.iter_mut().enumerate().for_each(|(at, t)| t.rotate_left(at % 3));
    for (a, b) in [(&soup, &soup), (&double, &double), (&turned, &shuffled)] {
        assert_eq!(both_ways(a, b), [Distances::default(); 2]);
    }
    let (a, b) = (sampled(&turned, 5000), sampled(&shuffled, 10));
    for pair in correspond(&a, &b).unwrap().pairs {
        let at = |surface: &SampledSurface<'_>, s: Sample| {
            let [p, q, r] = surface.corners(s.triangle);
            let normal = surface.normal(s.triangle).normalize();
            (p * s.barycentrics.x + q * s.barycentrics.y + r * s.barycentrics.z, normal)
        };
        let ((p, n), (q, m)) = (at(&a, pair.sample), at(&b, pair.target));
        assert!(p.distance(q) < 1e-12 && n.distance(m) < 1e-12);
    }
}

#[test]
fn a_surface_cut_otherwise_is_off_by_rounding_only() {
    // The same squares with the other diagonal: no triangle is shared.
    let square = square(0.1, true);
    let other = (square.0.clone(), vec![[0, 1, 3], [1, 2, 3]]);
    for distances in both_ways(&square, &other) {
        assert!(distances.max < 1e-15, "{}", distances.max);
    }
}

#[test]
fn a_sphere_one_percent_larger_is_one_percent_away() {
    for distances in both_ways(&sphere(1.0, 200), &sphere(1.01, 200)) {
        for figure in [distances.rms, distances.mean, distances.max] {
            assert!((figure - 0.01).abs() < 1e-4, "{figure}");
        }
    }
}

#[test]
fn parallel_squares_are_as_far_as_they_are() {
    let height = f64::from(0.1f32);
    for distances in both_ways(&square(0.0, true), &square(0.1, true)) {
        for figure in [distances.rms, distances.mean, distances.max] {
            assert!((figure - height).abs() < 1e-12, "{figure}");
        }
    }
}

#[test]
fn a_spike_is_far_one_way_and_seen_at_its_tip() {
    let flat = square(0.0, true);
    let spike = (vec![Vec3::ZERO, Vec3::new(1e-3, 0.0, 0.0), Vec3::Z], vec![[0, 1, 2]]);
    let [there, back] = both_ways(&flat, &join(&flat, &spike));
    assert_eq!(there, Distances::default());
    assert_eq!(back.max, 1.0);
    assert!(back.rms < 0.1);
    assert_eq!(there.symmetric(back), back);
}

#[test]
fn the_sides_of_a_thin_sheet_are_kept_apart() {
    // Up at 0.002 over down at 0, against the same moved up by 0.0015: without a look at the
    // sides, all of the lower side corresponds to the upper, and back.
    let sheet = |lift: f32| join(&square(lift + 0.002, true), &square(lift, false));
    let (a, b) = (sheet(0.0), sheet(0.0015));
    let (a, b) = (sampled(&a, 1000), sampled(&b, 1000));
    for (from, to) in [(&a, &b), (&b, &a)] {
        let found = correspond(from, to).unwrap();
        assert!(found.pairs.iter().all(|pair| {
            from.normal(pair.sample.triangle).dot(to.normal(pair.target.triangle)) > 0.0
        }));
        // The distance is still that of the nearest point.
        assert!(found.distances().mean < 0.0011);
    }
}

#[test]
fn a_single_side_answers_where_there_is_no_other() {
    let (up, down) = (square(0.0, true), square(0.5, false));
    let found = correspond(&sampled(&up, 100), &sampled(&down, 100)).unwrap();
    assert_eq!(found.pairs.len(), 100);
    assert!((found.distances().max - 0.5).abs() < 1e-12);
}

#[test]
fn nothing_is_said_about_nothing() {
    let (square, nothing) = (square(0.0, true), (vec![Vec3::ZERO], Vec::new()));
    let line = (vec![Vec3::ZERO, Vec3::X], vec![[0, 1, 0]]);
    assert!(correspond(&sampled(&square, 9), &sampled(&nothing, 9)).is_none());
    assert!(correspond(&sampled(&nothing, 9), &sampled(&square, 9)).is_none());
    assert!(correspond(&sampled(&line, 9), &sampled(&square, 9)).is_none());
    assert!(correspond(&sampled(&square, 9), &sampled(&line, 9)).is_some());
}

#[test]
fn the_thread_count_does_not_show() {
    let (a, b) = (sphere(1.0, 40), sphere(1.1, 31));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| correspond(&sampled(&a, 5000), &sampled(&b, 10)).unwrap())
    };
    assert_eq!(on(1), on(3));
}
