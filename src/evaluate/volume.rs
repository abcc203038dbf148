//! Volume, area and extent of a surface, and the defects that keep it from being a closed manifold.
//!
//! The signed volume is Σ v₀·(v₁×v₂)/6 over the triangles, each corner taken from the surface's
//! center of area: the divergence theorem for the field x/3. It is the volume enclosed if the surface
//! is closed and its triangles are counter-clockwise from outside, negative if they are clockwise,
//! and depends on the place of the center if the surface is open; so two open surfaces are compared
//! by it only roughly. That center moves and turns with the surface, and so the volume stays.
//!
//! All sums are in f64 and in the order of the triangles.

use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;
use seamwise_attr::area_vector;

/// A surface's measures. Indices of `triangles` must be in range, for every function here.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measures {
    /// Signed volume, in cubic units of the positions.
    pub volume: f64,
    /// Sum of the triangles' areas, in square units.
    pub area: f64,
    /// Length of the bounding box's diagonal, over the positions that triangles use.
    pub diagonal: f64,
}

/// Counts of what keeps a surface from being a closed manifold, over points: positions welded
/// bitwise, −0 being 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Soundness {
    /// Triangles with two corners at one point, or with all on a line (their area is 0 in f64).
    pub degenerate_triangles: usize,
    /// Edges of exactly one triangle.
    pub border_edges: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
}

/// The smallest box around the positions that triangles use, as its least and greatest corner. None
/// if there are no triangles.
pub fn bounding_box(positions: &[Vec3], triangles: &[[u32; 3]]) -> Option<[Vec3; 2]> {
    let mut used = triangles.iter().flatten().map(|&p| positions[p as usize]);
    let first = used.next()?;
    Some(used.fold([first; 2], |[min, max], p| [min.min(p), max.max(p)]))
}

/// The length of the diagonal of [`bounding_box`]; 0 if there are no triangles.
pub fn bounding_diagonal(positions: &[Vec3], triangles: &[[u32; 3]]) -> f64 {
    bounding_box(positions, triangles)
        .map_or(0.0, |[min, max]| max.as_dvec3().distance(min.as_dvec3()))
}

/// Volume, area and diagonal.
pub fn measure(positions: &[Vec3], triangles: &[[u32; 3]]) -> Measures {
    let Some([min, max]) = bounding_box(positions, triangles) else { return Measures::default() };
    // Near all of it, so that little is lost to rounding.
    let middle = (min.as_dvec3() + max.as_dvec3()) * 0.5;
    let (mut volume, mut area) = (0.0, 0.0);
    let (mut vector, mut moment) = (DVec3::ZERO, DVec3::ZERO);
    for &triangle in triangles {
        let [a, b, c] = triangle.map(|p| positions[p as usize].as_dvec3() - middle);
        volume += a.dot(b.cross(c));
        let own = area_vector(triangle.map(|p| positions[p as usize]));
        area += own.length();
        vector += own;
        moment += (a + b + c) * (own.length() / 3.0);
    }
    if area > 0.0 {
        // (a−g)·((b−g)×(c−g)) = a·(b×c) − g·((b−a)×(c−a)); a closed surface's vectors add up to 0.
        volume -= (moment / area).dot(vector);
    }
    let diagonal = max.as_dvec3().distance(min.as_dvec3());
    Measures { volume: volume / 6.0, area: area / 2.0, diagonal }
}

/// Counts the flaws. A triangle with two corners at one point has no edges that count; one whose
/// corners are on a line has all three.
pub fn check_soundness(positions: &[Vec3], triangles: &[[u32; 3]]) -> Soundness {
    let points = weld(positions);
    let mut soundness = Soundness::default();
    let mut edges = Vec::with_capacity(3 * triangles.len());
    for &triangle in triangles {
        let [a, b, c] = triangle.map(|p| points[p as usize]);
        let is_collapsed = a == b || b == c || c == a;
        if is_collapsed || area_vector(triangle.map(|p| positions[p as usize])) == DVec3::ZERO {
            soundness.degenerate_triangles += 1;
        }
        if !is_collapsed {
            edges.extend([(a, b), (b, c), (c, a)].map(|(p, q)| (p.min(q), p.max(q))));
        }
    }
    edges.sort_unstable();
    for same in edges.chunk_by(|a, b| a == b) {
        match same.len() {
            1 => soundness.border_edges += 1,
            2 => {}
            _ => soundness.non_manifold_edges += 1,
        }
    }
    soundness
}

/// One per position: the index of the first that has its bits, −0 being 0.
fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut first = FxHashMap::default();
    let bits = |p: &Vec3| (*p + Vec3::ZERO).to_array().map(f32::to_bits);
    (0..).zip(positions).map(|(at, p)| *first.entry(bits(p)).or_insert(at)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of side 2, its corners not shared between faces.
    fn cube(center: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let mut positions = Vec::new();
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for sign in [-1.0f32, 1.0] {
                let mut normal = Vec3::ZERO;
                normal[axis] = sign;
                let mut u = Vec3::ZERO;
                u[(axis + 1) % 3] = 1.0;
                let v = normal.cross(u);
                let base = positions.len() as u32;
                positions.extend([-u - v, u - v, u + v, v - u].map(|q| center + normal + q));
                triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
            }
        }
        (positions, triangles)
    }

    #[test]
    fn a_cube_measures_exactly_wherever_it_is() {
        for center in [Vec3::ZERO, Vec3::new(1e6, -1e6, 3e6), Vec3::splat(1.0)] {
            let (positions, triangles) = cube(center);
            let measures = measure(&positions, &triangles);
            assert_eq!((measures.volume, measures.area), (8.0, 24.0), "{center}");
            assert_eq!(measures.diagonal, 12f64.sqrt());
            assert_eq!(check_soundness(&positions, &triangles), Soundness::default());
        }
    }

    #[test]
    fn turning_a_cube_inside_out_turns_the_sign() {
        let (positions, mut triangles) = cube(Vec3::ONE);
        triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert_eq!(measure(&positions, &triangles).volume, -8.0);
    }

    #[test]
    fn flaws_are_counted() {
        // An open cube, a fin on a diagonal, a triangle on a line and one on two points.
        let (mut positions, mut triangles) = cube(Vec3::ZERO);
        triangles.truncate(10);
        let fin = positions.len() as u32;
        positions.push(Vec3::splat(-3.0));
        let [a, _, b] = triangles[0];
        triangles.push([a, b, fin]);
        positions.extend([5.0, 6.0, 7.0].map(|x| Vec3::new(x, 5.0, 5.0)));
        triangles.extend([[fin + 1, fin + 2, fin + 3], [a, a, b]]);
        let soundness = check_soundness(&positions, &triangles);
        assert_eq!(soundness.degenerate_triangles, 2);
        // Four of the hole, two of the fin, three of the line.
        assert_eq!(soundness.border_edges, 9);
        assert_eq!(soundness.non_manifold_edges, 1);
    }

    #[test]
    fn minus_zero_is_zero() {
        let positions = [Vec3::new(-0.0, 1.0, -0.0), Vec3::Y, Vec3::X];
        assert_eq!(weld(&positions), [0, 0, 2]);
    }

    #[test]
    fn nothing_measures_nothing() {
        assert_eq!(measure(&[Vec3::ONE], &[]), Measures::default());
        assert_eq!(bounding_diagonal(&[Vec3::ONE], &[]), 0.0);
    }
}
