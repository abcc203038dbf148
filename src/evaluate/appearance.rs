//! How different two surfaces look at corresponding points: color and shading normal.
//!
//! Textures are not known here: a caller says what a surface looks like through [`Appearance`].

use glam::Vec3;
use rayon::prelude::*;
use seamwise_attr::TriangleId;

use super::distance::{Correspondence, Pair};

/// Pairs that one task looks up. Sums are taken per chunk, then in the order of the chunks, so they
/// do not depend on the thread count.
const CHUNK: usize = 1024;

/// The base color and shading normal of a surface, at any point of it.
pub trait Appearance: Sync {
    /// Base color, encoded as sRGB, 0…1. `barycentrics`: one per corner, sum 1.
    fn color(&self, triangle: TriangleId, barycentrics: Vec3) -> [f32; 3];

    /// Shading normal; its length is of no matter. Zero where there is none.
    fn normal(&self, triangle: TriangleId, barycentrics: Vec3) -> Vec3;
}

/// Differences in appearance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AppearanceErrors {
    /// Root of the mean over the pairs of |c − c′|²/3, colors encoded as sRGB: 1 for black against
    /// white.
    pub color_rms: f64,
    /// Root of the mean of the squared angle between the shading normals, in degrees. Pairs without
    /// a normal on either side do not count.
    pub normal_degrees_rms: f64,
}

/// Sums over pairs.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    color: f64,
    colors: usize,
    angle: f64,
    angles: usize,
}

impl Sums {
    fn add(self, other: Self) -> Self {
        Self {
            color: self.color + other.color,
            colors: self.colors + other.colors,
            angle: self.angle + other.angle,
            angles: self.angles + other.angles,
        }
    }

    fn errors(self) -> AppearanceErrors {
        AppearanceErrors {
            color_rms: (self.color / self.colors.max(1) as f64).sqrt(),
            normal_degrees_rms: (self.angle / self.angles.max(1) as f64).sqrt(),
        }
    }
}

/// The errors of each direction, and of both: pooled, as if all pairs were one list.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TwoSidedErrors {
    /// At samples of the reference.
    pub forward: AppearanceErrors,
    /// At samples of the candidate.
    pub backward: AppearanceErrors,
    /// At all of them.
    pub pooled: AppearanceErrors,
}

/// Compares the looks of `reference` and `candidate` over the pairs of both directions: `forward`
/// from samples of the reference, `backward` from samples of the candidate.
pub fn compare_appearance(
    reference: &impl Appearance,
    candidate: &impl Appearance,
    forward: &Correspondence,
    backward: &Correspondence,
) -> TwoSidedErrors {
    let forward = sum_pairs(reference, candidate, &forward.pairs);
    let backward = sum_pairs(candidate, reference, &backward.pairs);
    TwoSidedErrors {
        forward: forward.errors(),
        backward: backward.errors(),
        pooled: forward.add(backward).errors(),
    }
}

fn sum_pairs(from: &impl Appearance, to: &impl Appearance, pairs: &[Pair]) -> Sums {
    let chunks: Vec<Sums> = pairs
        .par_chunks(CHUNK)
        .map(|pairs| pairs.iter().map(|p| difference(from, to, p)).fold(Sums::default(), Sums::add))
        .collect();
    chunks.into_iter().fold(Sums::default(), Sums::add)
}

fn difference(from: &impl Appearance, to: &impl Appearance, pair: &Pair) -> Sums {
    let (triangle, barycentrics) = (pair.sample.triangle, pair.sample.barycentrics.as_vec3());
    let (other, at) = (pair.target.triangle, pair.target.barycentrics.as_vec3());
    let color = Vec3::from(from.color(triangle, barycentrics)).as_dvec3()
        - Vec3::from(to.color(other, at)).as_dvec3();
    let a = from.normal(triangle, barycentrics).as_dvec3();
    let b = to.normal(other, at).as_dvec3();
    let has_normals = a.length_squared() > 0.0 && b.length_squared() > 0.0;
    // Exactly 0 for equal normals, unlike the arc cosine.
    let angle = if has_normals { a.cross(b).length().atan2(a.dot(b)).to_degrees() } else { 0.0 };
    Sums {
        color: color.length_squared() / 3.0,
        colors: 1,
        angle: angle * angle,
        angles: usize::from(has_normals),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::distance::{SampledSurface, correspond};

    /// A square whose color runs from `color` at its first corner to white at its second, and whose
    /// normal leans by `lean` degrees.
    struct Look {
        color: [f32; 3],
        lean: f32,
    }

    const SQUARE: [Vec3; 4] = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
    const HALVES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    impl Appearance for Look {
        fn color(&self, _: TriangleId, barycentrics: Vec3) -> [f32; 3] {
            self.color.map(|c| c + (1.0 - c) * barycentrics.y)
        }

        fn normal(&self, triangle: TriangleId, barycentrics: Vec3) -> Vec3 {
            if self.lean.is_nan() {
                return Vec3::ZERO;
            }
            let lean = self.lean.to_radians();
            // Of any length, and not the same everywhere.
            Vec3::new(lean.sin(), 0.0, lean.cos()) * (0.3 + barycentrics.x + triangle.0 as f32)
        }
    }

    fn compare(reference: &Look, candidate: &Look) -> TwoSidedErrors {
        let surface = SampledSurface::new(&SQUARE, &HALVES, 5000, 3);
        let pairs = correspond(&surface, &surface).unwrap();
        compare_appearance(reference, candidate, &pairs, &pairs)
    }

    #[test]
    fn a_look_differs_from_itself_by_nothing_at_all() {
        let look = Look { color: [0.1, 0.7, 0.3], lean: 33.3 };
        assert_eq!(compare(&look, &look), TwoSidedErrors::default());
    }

    #[test]
    fn known_looks_differ_by_known_amounts() {
        let white = Look { color: [1.0; 3], lean: 0.0 };
        let black = Look { color: [0.0; 3], lean: 30.0 };
        let errors = compare(&white, &black);
        // The mean of (1 − b)² over a triangle is 1/2.
        assert!((errors.pooled.color_rms - 0.5f64.sqrt()).abs() < 2e-3, "{errors:?}");
        assert!((errors.pooled.normal_degrees_rms - 30.0).abs() < 1e-4);
        assert_eq!(errors.forward, errors.backward);
    }

    #[test]
    fn missing_normals_are_left_out() {
        let leaning = Look { color: [0.5; 3], lean: 10.0 };
        let none = Look { color: [0.5; 3], lean: f32::NAN };
        assert_eq!(compare(&leaning, &none), TwoSidedErrors::default());
    }

    #[test]
    fn pooled_weighs_the_directions_by_their_pairs() {
        let (white, black) =
            (Look { color: [1.0; 3], lean: 0.0 }, Look { color: [0.0; 3], lean: 0.0 });
        let surface = SampledSurface::new(&SQUARE, &HALVES, 5000, 3);
        let pairs = correspond(&surface, &surface).unwrap();
        let errors = compare_appearance(&white, &black, &pairs, &Correspondence::default());
        assert_eq!((errors.pooled, errors.backward), (errors.forward, AppearanceErrors::default()));
    }
}
