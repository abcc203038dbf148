//! The generalized quadric over position and attributes (Garland & Heckbert, "Simplifying surfaces
//! with color and texture using quadric error metrics", Visualization 1998; Hoppe, "New quadric
//! metric", Visualization 1999).
//!
//! Over a triangle of unit normal n, each attribute s_j is the linear function g_jᵀp + d_j, its
//! gradient g_j lying in the triangle's plane. A vertex (p, s) off the triangle costs
//!
//! ```text
//! Q(p, s) = (nᵀp + d)² + Σ_j (g_jᵀp + d_j − s_j)²
//! ```
//!
//! times the triangle's weight. Summed over triangles, the matrix keeps a special form: its
//! attribute block is the summed weight w times the identity. So a wedge stores 11 + 4m numbers
//! for m attributes, and for a fixed p the best attributes are in closed form,
//! s*(p) = −(Bᵀp + b_s) / w. Putting them back leaves a plain quadric in p alone
//! ([`reduce`]): a collapse costs one 3×3 solve, however many attributes it carries.
//!
//! Guarantee: `Q ≥ 0` and `reduce(Q)(p) = min_s Q(p, s)` up to rounding; positions are expected
//! within a few units of the origin, where f64 leaves twelve digits to a cost.

use glam::DVec3;

/// Most attributes that a wedge may carry through the metric.
pub(crate) const MAX_ATTRIBUTES: usize = 16;

/// Offsets in a packed quadric: A_pp, b_p, c, w, then B's column and b_s for each attribute.
const A: usize = 0;
const B: usize = 6;
const C: usize = 9;
const W: usize = 10;
const ATTRIBUTES: usize = 11;

/// Numbers in the packed quadric of `attributes` attributes.
pub(crate) const fn stride(attributes: usize) -> usize {
    ATTRIBUTES + 4 * attributes
}

/// A quadric in position alone: pᵀAp + 2bᵀp + c, with A symmetric.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointQuadric {
    /// xx, xy, xz, yy, yz, zz of A.
    pub a: [f64; 6],
    /// The linear term.
    pub b: DVec3,
    /// The constant term.
    pub c: f64,
}

impl PointQuadric {
    /// `weight` times the squared distance to the plane through `point` with unit `normal`.
    pub fn from_plane(point: DVec3, normal: DVec3, weight: f64) -> Self {
        let d = -normal.dot(point);
        Self { a: outer(normal).map(|x| x * weight), b: normal * (d * weight), c: d * d * weight }
    }

    /// `weight` times the squared distance to `point`.
    pub fn from_point(point: DVec3, weight: f64) -> Self {
        Self {
            a: [weight, 0.0, 0.0, weight, 0.0, weight],
            b: point * -weight,
            c: point.length_squared() * weight,
        }
    }

    /// Adds another quadric: the cost of both.
    #[inline]
    pub fn add(&mut self, other: &Self) {
        for (mine, theirs) in self.a.iter_mut().zip(other.a) {
            *mine += theirs;
        }
        self.b += other.b;
        self.c += other.c;
    }

    /// The cost at `p`, never below zero: what rounding leaves there is nothing.
    #[inline]
    pub fn evaluate(&self, p: DVec3) -> f64 {
        let ap = self.apply(p);
        (p.dot(ap) + 2.0 * self.b.dot(p) + self.c).max(0.0)
    }

    /// A p.
    #[inline]
    pub(crate) fn apply(&self, p: DVec3) -> DVec3 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        DVec3::new(
            xx * p.x + xy * p.y + xz * p.z,
            xy * p.x + yy * p.y + yz * p.z,
            xz * p.x + yz * p.y + zz * p.z,
        )
    }
}

/// The upper triangle of vvᵀ.
#[inline]
fn outer(v: DVec3) -> [f64; 6] {
    [v.x * v.x, v.x * v.y, v.x * v.z, v.y * v.y, v.y * v.z, v.z * v.z]
}

/// One attribute over a triangle: the value at p is gᵀp + d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gradient {
    /// The gradient in the triangle's plane.
    pub g: DVec3,
    /// The offset.
    pub d: f64,
}

/// The gradients of the barycentrics of a triangle's second and third corner, by which any attribute
/// has its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slopes {
    origin: DVec3,
    /// `None` if the triangle is thinner than a millionth of its length.
    slopes: Option<[DVec3; 2]>,
}

impl Slopes {
    /// Solves for them in the 2×2 basis of two edges.
    pub(crate) fn new(p: [DVec3; 3]) -> Self {
        let (e, f) = (p[1] - p[0], p[2] - p[0]);
        let (ee, ef, ff) = (e.dot(e), e.dot(f), f.dot(f));
        let determinant = ee * ff - ef * ef;
        let is_thin = determinant <= 1e-12 * ee * ff || determinant <= 0.0;
        let inverse = 1.0 / determinant;
        let slopes = [(e * ff - f * ef) * inverse, (f * ee - e * ef) * inverse];
        Self { origin: p[0], slopes: (!is_thin).then_some(slopes) }
    }

    /// The linear function that takes the values `s` at the corners, or their mean everywhere if
    /// there are no slopes.
    #[inline]
    pub(crate) fn gradient(&self, s: [f64; 3]) -> Gradient {
        let Some([second, third]) = self.slopes else {
            return Gradient { g: DVec3::ZERO, d: (s[0] + s[1] + s[2]) / 3.0 };
        };
        let g = second * (s[1] - s[0]) + third * (s[2] - s[0]);
        Gradient { g, d: s[0] - g.dot(self.origin) }
    }
}

impl Gradient {
    /// The linear function in the plane of `p` that takes the values `s` at its corners. A triangle
    /// thinner than a millionth of its length has no usable gradient: there the attribute is taken to
    /// be constant, at its mean.
    pub fn new(p: [DVec3; 3], s: [f64; 3]) -> Self {
        Slopes::new(p).gradient(s)
    }

    /// The same function in the plane through `point`, that also changes by `slope` off it.
    pub(crate) fn rising(self, slope: DVec3, point: DVec3) -> Self {
        Self { g: self.g + slope, d: self.d - slope.dot(point) }
    }
}

/// The packed quadric of a triangle.
///
/// `plane` is a point of the triangle and its unit normal, `gradients` one per attribute; `weight`
/// is the share of the triangle's area that falls to each of its wedges.
pub(crate) fn set_triangle(
    quadric: &mut [f64],
    (point, normal): (DVec3, DVec3),
    gradients: impl Iterator<Item = Gradient>,
    weight: f64,
) {
    let mut sum = PointQuadric::from_plane(point, normal, 1.0);
    for (packed, Gradient { g, d }) in quadric[ATTRIBUTES..].chunks_exact_mut(4).zip(gradients) {
        packed.copy_from_slice(&[-weight * g.x, -weight * g.y, -weight * g.z, -weight * d]);
        sum.add(&PointQuadric { a: outer(g), b: g * d, c: d * d });
    }
    quadric[A..B].copy_from_slice(&sum.a.map(|x| x * weight));
    quadric[B..C].copy_from_slice(&(sum.b * weight).to_array());
    quadric[C] = sum.c * weight;
    quadric[W] = weight;
}

/// Adds packed quadrics.
#[inline]
pub(crate) fn add(quadric: &mut [f64], other: &[f64]) {
    for (mine, theirs) in quadric.iter_mut().zip(other) {
        *mine += theirs;
    }
}

/// Adds `factor` times a packed quadric.
#[inline]
pub(crate) fn add_scaled(quadric: &mut [f64], other: &[f64], factor: f64) {
    for (mine, theirs) in quadric.iter_mut().zip(other) {
        *mine += theirs * factor;
    }
}

/// The weight of a packed quadric: the area it was summed over.
#[inline]
pub(crate) fn weight(quadric: &[f64]) -> f64 {
    quadric[W]
}

/// The cost as a function of position alone, with the best attributes everywhere:
/// A' = A_pp − BBᵀ/w, b' = b_p − B b_s/w, c' = c − |b_s|²/w.
#[inline]
pub(crate) fn reduce(quadric: &[f64]) -> PointQuadric {
    let (point, attributes) = quadric.split_at(ATTRIBUTES);
    eliminate(point.try_into().expect("the head of a quadric"), columns(attributes))
}

/// [`reduce`] of the sum of two packed quadrics, which is stored nowhere.
#[inline]
pub(crate) fn reduce_sum(first: &[f64], second: &[f64]) -> PointQuadric {
    let ((mine, my_attributes), (theirs, their_attributes)) =
        (first.split_at(ATTRIBUTES), second.split_at(ATTRIBUTES));
    let sums = columns(my_attributes)
        .zip(columns(their_attributes))
        .map(|(mine, theirs)| std::array::from_fn(|at| mine[at] + theirs[at]));
    eliminate(&std::array::from_fn(|at| mine[at] + theirs[at]), sums)
}

/// B's column and b_s of each attribute.
fn columns(attributes: &[f64]) -> impl Iterator<Item = [f64; 4]> + '_ {
    attributes.chunks_exact(4).map(|packed| [packed[0], packed[1], packed[2], packed[3]])
}

#[inline]
fn eliminate(point: &[f64; ATTRIBUTES], columns: impl Iterator<Item = [f64; 4]>) -> PointQuadric {
    let mut reduced = PointQuadric {
        a: [point[0], point[1], point[2], point[3], point[4], point[5]],
        b: DVec3::new(point[B], point[B + 1], point[B + 2]),
        c: point[C],
    };
    let w = point[W];
    if w <= 0.0 {
        return reduced;
    }
    let inverse = 1.0 / w;
    for [x, y, z, offset] in columns {
        let column = DVec3::new(x, y, z);
        for (entry, square) in reduced.a.iter_mut().zip(outer(column)) {
            *entry -= square * inverse;
        }
        reduced.b -= column * (offset * inverse);
        reduced.c -= offset * offset * inverse;
    }
    reduced
}

/// The best attributes at `p`: s*(p) = −(Bᵀp + b_s) / w, written to `attributes`, which stay as
/// they are if the quadric has no weight.
#[inline]
pub(crate) fn best_attributes(quadric: &[f64], p: DVec3, attributes: &mut [f64]) {
    let w = quadric[W];
    if w <= 0.0 {
        return;
    }
    for (attribute, packed) in attributes.iter_mut().zip(quadric[ATTRIBUTES..].chunks_exact(4)) {
        let column = DVec3::new(packed[0], packed[1], packed[2]);
        *attribute = -(column.dot(p) + packed[3]) / w;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Q(p, s) of a packed quadric, with no elimination.
    fn evaluate(quadric: &[f64], p: DVec3, s: &[f64]) -> f64 {
        let point = PointQuadric {
            a: quadric[..6].try_into().unwrap(),
            b: DVec3::new(quadric[B], quadric[B + 1], quadric[B + 2]),
            c: quadric[C],
        };
        let mut cost = p.dot(point.apply(p)) + 2.0 * point.b.dot(p) + point.c;
        for (packed, s) in quadric[ATTRIBUTES..].chunks_exact(4).zip(s) {
            let column = DVec3::new(packed[0], packed[1], packed[2]);
            cost += 2.0 * s * (column.dot(p) + packed[3]) + quadric[W] * s * s;
        }
        cost
    }

    #[derive(Debug)]
    struct Face {
        p: [DVec3; 3],
        s: [[f64; 3]; 2],
        weight: f64,
    }

    fn normal(p: [DVec3; 3]) -> DVec3 {
        (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero()
    }

    fn sum(faces: &[Face]) -> Vec<f64> {
        let (mut quadric, mut one) = (vec![0.0; stride(2)], vec![0.0; stride(2)]);
        for face in faces {
            let gradients = face.s.iter().map(|&s| Gradient::new(face.p, s));
            set_triangle(&mut one, (face.p[0], normal(face.p)), gradients, face.weight);
            add(&mut quadric, &one);
        }
        quadric
    }

    fn vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(DVec3::from_array)
    }

    fn face() -> impl Strategy<Value = Face> {
        let attribute = || prop::array::uniform3(-1.0..1.0f64);
        (prop::array::uniform3(vector()), [attribute(), attribute()], 0.01..1.0f64)
            .prop_filter("a triangle with an area", |(p, _, _)| {
                (p[1] - p[0]).cross(p[2] - p[0]).length() > 0.05
            })
            .prop_map(|(p, s, weight)| Face { p, s, weight })
    }

    #[test]
    fn a_gradient_takes_the_corner_values_and_lies_in_the_plane() {
        let p = [DVec3::new(1.0, 2.0, 0.5), DVec3::new(2.0, 2.5, 0.0), DVec3::new(0.0, 3.0, 1.0)];
        let s = [0.3, -1.0, 2.0];
        let Gradient { g, d } = Gradient::new(p, s);
        for (p, s) in p.iter().zip(s) {
            assert!((g.dot(*p) + d - s).abs() < 1e-12);
        }
        assert!(g.dot(normal(p)).abs() < 1e-12);
    }

    #[test]
    fn a_degenerate_triangle_has_a_constant_attribute() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
        assert_eq!(Gradient::new(p, [0.0, 3.0, 6.0]), Gradient { g: DVec3::ZERO, d: 3.0 });
    }

    proptest! {
        #[test]
        fn cost_is_the_direct_sum_of_squared_distances_and_never_negative(
            faces in prop::collection::vec(face(), 1..6), p in vector(), s in prop::array::uniform2(-1.0..1.0f64),
        ) {
            let direct: f64 = faces.iter().map(|face| {
                let off_plane = normal(face.p).dot(p - face.p[0]);
                let off_attributes: f64 = face.s.iter().zip(s).map(|(&values, s)| {
                    let Gradient { g, d } = Gradient::new(face.p, values);
                    (g.dot(p) + d - s).powi(2)
                }).sum();
                face.weight * (off_plane * off_plane + off_attributes)
            }).sum();
            let cost = evaluate(&sum(&faces), p, &s);
            prop_assert!((cost - direct).abs() <= 1e-9 * (1.0 + direct));
            prop_assert!(cost >= -1e-9 * (1.0 + direct));
        }

        #[test]
        fn elimination_is_the_minimum_over_all_attributes(
            faces in prop::collection::vec(face(), 1..6), p in vector(), step in prop::array::uniform2(-0.1..0.1f64),
        ) {
            let quadric = sum(&faces);
            let mut best = [0.0; 2];
            best_attributes(&quadric, p, &mut best);
            let reduced = reduce(&quadric).evaluate(p);
            let scale = 1.0 + evaluate(&quadric, p, &[0.0; 2]).abs();
            prop_assert!((evaluate(&quadric, p, &best) - reduced).abs() <= 1e-9 * scale);
            let (first, second) = faces.split_at(faces.len() / 2);
            let halves = reduce_sum(&sum(first), &sum(second)).evaluate(p);
            prop_assert!((halves - reduced).abs() <= 1e-9 * scale);
            let off = [best[0] + step[0], best[1] + step[1]];
            prop_assert!(evaluate(&quadric, p, &off) >= reduced - 1e-9 * scale);
        }

        #[test]
        fn gradient_of_the_reduced_cost_is_the_numeric_one(
            faces in prop::collection::vec(face(), 1..6), p in vector(),
        ) {
            let reduced = reduce(&sum(&faces));
            let analytic = 2.0 * (reduced.apply(p) + reduced.b);
            let value = |p: DVec3| p.dot(reduced.apply(p)) + 2.0 * reduced.b.dot(p) + reduced.c;
            let h = 1e-4;
            let numeric = DVec3::from_array([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| {
                (value(p + axis * h) - value(p - axis * h)) / (2.0 * h)
            }));
            prop_assert!((analytic - numeric).length() <= 1e-5 * (1.0 + analytic.length()));
        }
    }
}
