//! Lattice noise from an integer hash: no state, no clock, the same values on every machine.

use glam::{DVec3, I64Vec3};

/// Mixes a lattice point and a seed to 32 evenly spread bits (multiply, rotate and xor rounds).
fn hash(cell: I64Vec3, seed: u32) -> u32 {
    let mut bits = seed.wrapping_mul(0x9e37_79b9) ^ 0x85eb_ca6b;
    for axis in [cell.x, cell.y, cell.z] {
        bits ^= (axis as u32).wrapping_mul(0xcc9e_2d51);
        bits = bits.rotate_left(13).wrapping_mul(0x1b87_3593).wrapping_add(0xe654_6b64);
        bits ^= bits >> 15;
    }
    bits = bits.wrapping_mul(0x2c1b_3c6d);
    bits ^= bits >> 12;
    bits = bits.wrapping_mul(0x297a_2d39);
    bits ^ (bits >> 15)
}

/// A number in 0…1 for a lattice point.
pub(crate) fn unit(cell: I64Vec3, seed: u32) -> f64 {
    f64::from(hash(cell, seed)) / f64::from(u32::MAX)
}

/// Value noise in −1…1, smooth to the second derivative, with features of size one.
pub(crate) fn value(at: DVec3, seed: u32) -> f64 {
    let floor = at.floor();
    let t = at - floor;
    let t = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let cell = floor.as_i64vec3();
    let corner = |x, y, z| unit(cell + I64Vec3::new(x, y, z), seed);
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let edge = |y, z| mix(corner(0, y, z), corner(1, y, z), t.x);
    let face = |z| mix(edge(0, z), edge(1, z), t.y);
    2.0 * mix(face(0), face(1), t.z) - 1.0
}

/// The sum of `octaves` of [`value`], each of half the size and half the height, about −1…1.
pub(crate) fn fractal(at: DVec3, octaves: u32, seed: u32) -> f64 {
    let (mut sum, mut height, mut at) = (0.0, 0.5, at);
    for octave in 0..octaves {
        sum += height * value(at, seed.wrapping_add(octave));
        height *= 0.5;
        // An irrational stretch keeps the octaves' lattices from lining up.
        at = at * 2.03 + DVec3::new(17.17, 5.31, 9.73);
    }
    sum
}

/// Distance to the nearest wall between Voronoi cells of size one: 0 on a crack, about ½ inside.
pub(crate) fn cracks(at: DVec3, seed: u32) -> f64 {
    let home = at.floor().as_i64vec3();
    let seed_of = |cell: I64Vec3| {
        cell.as_dvec3() + DVec3::from_array([0, 1, 2].map(|axis| unit(cell, seed + axis)))
    };
    let around = (-1..=1)
        .flat_map(|z| (-1..=1).flat_map(move |y| (-1..=1).map(move |x| I64Vec3::new(x, y, z))));
    let (mut nearest, mut distance) = (DVec3::ZERO, f64::MAX);
    for offset in around.clone() {
        let point = seed_of(home + offset);
        if point.distance_squared(at) < distance {
            (nearest, distance) = (point, point.distance_squared(at));
        }
    }
    let wall = |point: DVec3| {
        let across = point - nearest;
        (across.length_squared() > 0.0)
            .then(|| (0.5 * (point + nearest) - at).dot(across.normalize()))
    };
    around.filter_map(|offset| wall(seed_of(home + offset))).fold(1.0, f64::min)
}

/// Sparse round spots: 1 in the middle of one, 0 between them. `share` of the unit cells hold one
/// of radius up to `radius` cells.
pub(crate) fn spots(at: DVec3, share: f64, radius: f64, seed: u32) -> f64 {
    let cell = at.floor().as_i64vec3();
    if unit(cell, seed) > share {
        return 0.0;
    }
    let center = cell.as_dvec3()
        + DVec3::from_array([1, 2, 3].map(|axis| 0.3 + 0.4 * unit(cell, seed + axis)));
    let size = radius * (0.35 + 0.65 * unit(cell, seed + 4));
    1.0 - step(0.6 * size, size, at.distance(center))
}

/// Hermite step from 0 at `low` to 1 at `high`.
pub(crate) fn step(low: f64, high: f64, value: f64) -> f64 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// From `a` at 0 to `b` at 1.
pub(crate) fn mix(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn value_noise_takes_the_lattice_values_and_runs_smoothly_between() {
        let at = DVec3::new(3.0, -2.0, 7.0);
        assert_eq!(value(at, 5), 2.0 * unit(at.as_i64vec3(), 5) - 1.0);
        assert!((value(at + 1e-6, 5) - value(at, 5)).abs() < 1e-9);
        assert_ne!(value(at, 5), value(at, 6));
    }

    #[test]
    fn a_crack_is_where_two_cells_are_equally_near() {
        // Along any line the distance to the wall comes down to 0 and never falls below.
        let walls: Vec<f64> =
            (0..4000).map(|k| cracks(DVec3::new(f64::from(k) * 0.001, 0.3, 0.7), 9)).collect();
        assert!(walls.iter().all(|&wall| wall > -1e-12));
        assert!(walls.iter().any(|&wall| wall < 1e-3));
    }
}
