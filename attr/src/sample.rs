//! Points spread evenly over a surface, each knowing its triangle.
//!
//! The triangles' areas are laid end to end and cut into equal lengths; the first cut is random, so
//! a triangle of area a out of A gets its share of n samples, n·a/A, rounded up or down, and never
//! none if its share is 1 (systematic sampling; Madow & Madow, Annals of Mathematical Statistics
//! 1944). Within a triangle the samples follow the R₂ sequence (Roberts, "The unreasonable
//! effectiveness of quasirandom sequences", 2018) from a random start, mapped to it without
//! distorting areas (Turk, "Generating random points in triangles", Graphics Gems, 1990).
//!
//! Guarantee: the same samples for the same input, anywhere. Random numbers are hashes of the seed
//! and the triangle's index.

use glam::{DVec3, Vec3};

use crate::id::TriangleId;
use crate::triangle::area_vector;

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// The triangle it lies on.
    pub triangle: TriangleId,
    /// Barycentric coordinates: one per corner, at least 0, sum 1.
    pub barycentrics: DVec3,
}

/// Samples of a surface, made when they are asked for.
#[derive(Clone, Debug, Default)]
pub(crate) struct Samples {
    /// One more than triangles: how many samples the triangles before have.
    starts: Vec<usize>,
    seed: u64,
}

impl Samples {
    /// Spreads `count` samples over the triangles by area. None at all if that is 0 or not finite.
    pub(crate) fn new(positions: &[Vec3], triangles: &[[u32; 3]], count: usize, seed: u64) -> Self {
        let area = |&t: &[u32; 3]| area_vector(t.map(|p| positions[p as usize])).length();
        let total: f64 = triangles.iter().map(area).sum();
        if total <= 0.0 || !total.is_finite() {
            return Self { starts: vec![0; triangles.len() + 1], seed };
        }
        let share = count as f64 / total;
        // Off the ends, so that rounding of the last triangle's end takes no sample away.
        let start = unit(hash(seed, u64::MAX)).clamp(1e-6, 1.0 - 1e-6);
        let mut end = 0.0;
        let ends = triangles.iter().map(|triangle| {
            end += area(triangle);
            // Sample s lies at s + start on the line of areas.
            ((end * share - start).ceil().max(0.0) as usize).min(count)
        });
        Self { starts: std::iter::once(0).chain(ends).collect(), seed }
    }

    /// The samples of one triangle.
    pub(crate) fn of(&self, triangle: TriangleId) -> impl Iterator<Item = Sample> + use<> {
        let at = triangle.index();
        let shift = hash(self.seed, at as u64);
        (0..self.starts[at + 1] - self.starts[at])
            .map(move |rank| Sample { triangle, barycentrics: spread(rank as f64, shift) })
    }
}

/// `count` samples spread over the surface by area, in the order of the triangles. None at all if
/// its area is 0 or not finite.
///
/// # Panics
/// If a triangle names a position that is not there.
pub fn sample_surface(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    count: usize,
    seed: u64,
) -> Vec<Sample> {
    let samples = Samples::new(positions, triangles, count, seed);
    (0..triangles.len()).flat_map(|t| samples.of(TriangleId::new(t))).collect()
}

/// Member `rank` of the R₂ sequence from a start that `shift` chooses, on a triangle.
fn spread(rank: f64, shift: u64) -> DVec3 {
    /// The real root of x³ = x + 1.
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let u = (unit(shift) + rank / PLASTIC).fract();
    let v = (unit(hash(shift, 0)) + rank / (PLASTIC * PLASTIC)).fract();
    let root = u.sqrt();
    DVec3::new(1.0 - root, root * (1.0 - v), root * v)
}

/// A number in 0…1, both excluded.
fn unit(bits: u64) -> f64 {
    ((bits >> 12) as f64 + 0.5) / (1u64 << 52) as f64
}

/// Mixes two numbers (the finalizer of SplitMix64; Steele, Lea & Flood, OOPSLA 2014).
fn hash(seed: u64, index: u64) -> u64 {
    let mut z = seed ^ index.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_triangle_gets_its_share() {
        // A strip of triangles of areas 1, 2, … 20.
        let positions: Vec<Vec3> = (0..=20u16)
            .flat_map(|i| [Vec3::new(0.0, f32::from(i), 0.0), Vec3::new(f32::from(i), 0.0, 0.0)])
            .collect();
        let triangles: Vec<[u32; 3]> = (0..20).map(|i| [0, 2, 2 * i + 3]).collect();
        for seed in 0..20 {
            let samples = sample_surface(&positions, &triangles, 1000, seed);
            assert_eq!(samples.len(), 1000);
            for index in 0..20usize {
                let found = samples.iter().filter(|s| s.triangle.index() == index).count();
                let share = 1000.0 * (index + 1) as f64 / 210.0;
                assert!((found as f64 - share).abs() < 1.0, "{found} for {share}");
            }
        }
    }

    #[test]
    fn samples_are_spread_within_a_triangle() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let samples = sample_surface(&positions, &[[0, 1, 2]], 4096, 7);
        let mean = samples.iter().map(|s| s.barycentrics).sum::<DVec3>() / 4096.0;
        assert!((mean - DVec3::splat(1.0 / 3.0)).abs().max_element() < 1e-3, "{mean}");
        // Four equal quarters, by which corner is nearest, the middle one being the rest.
        for corner in 0..3 {
            let found = samples.iter().filter(|s| s.barycentrics[corner] > 0.5).count();
            assert!(found.abs_diff(1024) < 24, "{found}");
        }
    }

    #[test]
    fn no_area_no_samples() {
        assert!(sample_surface(&[Vec3::ZERO, Vec3::X], &[[0, 1, 0]], 9, 0).is_empty());
        assert!(sample_surface(&[], &[], 9, 0).is_empty());
        assert!(sample_surface(&[Vec3::NAN], &[[0, 0, 0]], 9, 0).is_empty());
    }

    proptest! {
        #[test]
        fn samples_lie_on_their_triangles(count in 1usize..500, seed: u64) {
            let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE];
            let samples = sample_surface(&positions, &[[0, 1, 2], [1, 1, 1], [1, 2, 3]], count, seed);
            prop_assert_eq!(samples.len(), count);
            for sample in samples {
                prop_assert!(sample.triangle != TriangleId(1));
                prop_assert!(sample.barycentrics.min_element() >= 0.0);
                prop_assert!((sample.barycentrics.element_sum() - 1.0).abs() < 1e-15);
            }
        }
    }
}
