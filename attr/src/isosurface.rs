//! Rays, maps and isosurfaces of quadrics in position.
//!
//! A quadric Q(p) = pᵀAp + 2bᵀp + c is a quadratic form in homogeneous coordinates, so all that is done with
//! quadric surfaces can be done with the metric (Garland, "Quadric-based polygonal surface
//! simplification", thesis, CMU 1999, §4.1): along a ray Q is a polynomial of the second degree, whose roots
//! are where the ray meets Q = ε; the normal there is the gradient 2(Ap + b); an affine map M makes
//! M⁻ᵀQM⁻¹ of it. If A is positive definite, Q = ε is an ellipsoid around the minimum c̄ = −A⁻¹b: with
//! A = RᵀR by Cholesky, y = R(p − c̄) has |y|² = ε − Q(c̄), a sphere, so the ellipsoid is the sphere under R⁻¹.

use glam::{DAffine3, DMat3, DVec3};
use nalgebra::Matrix3;

use crate::quadric::PointQuadric;

/// A quadric whose flattest direction bends less than this share of its steepest is not definite: its
/// isosurface is open, or so wide that rounding decides how wide. An angle of a hundred thousandth.
const LEAST_DEFINITE: f64 = 1e-10;

/// A half line; distances along it are counted in lengths of its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Its start.
    pub origin: DVec3,
    /// Its direction, of any length above 0.
    pub direction: DVec3,
}

impl Ray {
    /// The point at a distance along it.
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }
}

/// The surface where a quadric has one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Isosurface {
    /// A closed one.
    Ellipsoid(Ellipsoid),
    /// The quadric is not positive definite: the surface is flat there, or straight along an edge, and what
    /// costs as little runs on without an end.
    Open,
    /// The quadric is above the value everywhere.
    Empty,
}

/// An ellipsoid: the unit sphere under an affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Its center.
    pub center: DVec3,
    /// The linear part of the map, R⁻¹ times the radius of the sphere.
    pub map: DMat3,
    /// Half of its principal axes, the shortest first.
    pub half_axes: DVec3,
    /// Their directions, a rotation.
    pub directions: DMat3,
}

impl Ellipsoid {
    /// The point that a point of the unit sphere becomes.
    pub fn point(&self, on_sphere: DVec3) -> DVec3 {
        self.center + self.map * on_sphere
    }

    /// Its thickness over its width, 0 to 1: near 0 for a disc, 1 for a needle or a ball.
    pub fn thickness(&self) -> f64 {
        self.half_axes.x / self.half_axes.y
    }
}

impl PointQuadric {
    /// Q(p), rounding below zero included.
    fn value(&self, p: DVec3) -> f64 {
        p.dot(self.apply(p) + 2.0 * self.b) + self.c
    }

    /// The gradient 2(Ap + b): normal to the isosurface through `p`, outward.
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        2.0 * (self.apply(p) + self.b)
    }

    /// The distances along the line of a ray where the quadric is `value`, the lesser first; below 0 they lie
    /// behind its start. Where the quadric is linear along the line there is one, and the other is
    /// infinite. `None` if there is none, or the quadric is constant along the line.
    ///
    /// The roots are found from the point between them, so that a start far away costs no digits.
    pub fn intersect(&self, ray: &Ray, value: f64) -> Option<[f64; 2]> {
        let bend = ray.direction.dot(self.apply(ray.direction));
        let slope = |t: f64| ray.direction.dot(self.gradient(ray.at(t)));
        let height = |t: f64| self.value(ray.at(t)) - value;
        let steepest = self.a.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if bend.abs() <= 1e-15 * steepest * ray.direction.length_squared() {
            let root = -height(0.0) / slope(0.0);
            return root.is_finite().then_some([root, f64::INFINITY]);
        }
        let mut middle = -slope(0.0) / (2.0 * bend);
        middle -= slope(middle) / (2.0 * bend);
        let square = -height(middle) / bend;
        if square.is_nan() || square < 0.0 {
            return None;
        }
        let half = square.sqrt();
        Some([middle - half, middle + half])
    }

    /// The quadric that has at M p what this one has at `p`: M⁻ᵀQM⁻¹. `None` if the map can't be undone.
    pub fn transformed(&self, map: &DAffine3) -> Option<Self> {
        let back = map.inverse();
        if !back.is_finite() || map.matrix3.determinant() == 0.0 {
            return None;
        }
        let transposed = back.matrix3.transpose();
        let a = transposed * self.matrix() * back.matrix3;
        let [x, y, z] = [a.x_axis, a.y_axis, a.z_axis];
        Some(Self {
            a: [x.x, x.y, x.z, y.y, y.z, z.z],
            b: transposed * (self.apply(back.translation) + self.b),
            c: self.value(back.translation),
        })
    }

    /// The quadric times a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        Self { a: self.a.map(|x| x * factor), b: self.b * factor, c: self.c * factor }
    }

    /// The surface where the quadric is `value`.
    pub fn isosurface(&self, value: f64) -> Isosurface {
        let eigen = Matrix3::from(self.matrix().to_cols_array_2d()).symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let bends = order.map(|at| eigen.eigenvalues[at]);
        let Some(root) = self.cholesky().filter(|_| bends[2] > LEAST_DEFINITE * bends[0]) else {
            return Isosurface::Open;
        };
        let inverse = root.inverse();
        let center = -(inverse * (inverse.transpose() * self.b));
        let radius = (value - self.value(center)).sqrt();
        // Not of a negative number, nor of none.
        if !(radius > 0.0 && radius.is_finite() && center.is_finite()) {
            return Isosurface::Empty;
        }
        let axis = |at: usize| {
            let column = eigen.eigenvectors.column(at);
            DVec3::new(column[0], column[1], column[2]).normalize_or_zero()
        };
        let (x, y) = (axis(order[0]), axis(order[1]));
        Isosurface::Ellipsoid(Ellipsoid {
            center,
            map: inverse * radius,
            half_axes: DVec3::from_array(bends.map(|bend| radius / bend.sqrt())),
            directions: DMat3::from_cols(x, y, x.cross(y)),
        })
    }

    /// A as a matrix.
    fn matrix(&self) -> DMat3 {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz])
    }

    /// The upper triangular R with A = RᵀR, if A is positive definite.
    fn cholesky(&self) -> Option<DMat3> {
        let [xx, xy, xz, yy, yz, zz] = self.a;
        let root = |square: f64| (square > 0.0 && square.is_finite()).then(|| square.sqrt());
        let first = root(xx)?;
        let (second_x, third_x) = (xy / first, xz / first);
        let second = root(yy - second_x * second_x)?;
        let third_y = (yz - second_x * third_x) / second;
        let third = root(zz - third_x * third_x - third_y * third_y)?;
        Some(DMat3::from_cols(
            DVec3::new(first, 0.0, 0.0),
            DVec3::new(second_x, second, 0.0),
            DVec3::new(third_x, third_y, third),
        ))
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, EulerRot};
    use proptest::prelude::*;

    use super::*;

    /// x²/a² + y²/b² + z²/c², a factor of 0 where an axis has none.
    fn diagonal(squares: [f64; 3]) -> PointQuadric {
        let [x, y, z] = squares;
        PointQuadric { a: [x, 0.0, 0.0, y, 0.0, z], ..PointQuadric::default() }
    }

    fn assert_near(found: Option<[f64; 2]>, expected: [f64; 2]) {
        let found = found.expect("the ray meets it");
        for (found, expected) in found.into_iter().zip(expected) {
            let near = (found - expected).abs() <= 1e-9 * expected.abs().max(1.0);
            assert!(near || found == expected, "{found} {expected}");
        }
    }

    #[test]
    fn a_ray_meets_sphere_cylinder_cone_paraboloid_and_planes_where_their_formulas_say() {
        let ray = |origin: [f64; 3], direction: [f64; 3]| Ray {
            origin: origin.into(),
            direction: direction.into(),
        };
        // A sphere of radius 2 seen from 1e4 away, 1.2 beside its middle: 1e4 ∓ √(4 − 1.44).
        let far = ray([1.2, 0.0, -1e4], [0.0, 0.0, 1.0]);
        assert_near(diagonal([1.0; 3]).intersect(&far, 4.0), [1e4 - 1.6, 1e4 + 1.6]);
        // The same with a direction twice as long.
        let long = Ray { direction: far.direction * 2.0, ..far };
        assert_near(diagonal([1.0; 3]).intersect(&long, 4.0), [5e3 - 0.8, 5e3 + 0.8]);
        assert_eq!(diagonal([1.0; 3]).intersect(&far, 1.0), None, "1.2 beside a radius of 1");
        // A cylinder of radius 1 along z: across it, and along it never.
        let cylinder = diagonal([1.0, 1.0, 0.0]);
        assert_near(
            cylinder.intersect(&ray([-3.0, 0.6, 7.0], [1.0, 0.0, 0.3]), 1.0),
            [3.0 - 0.8, 3.0 + 0.8],
        );
        assert_eq!(cylinder.intersect(&ray([0.1, 0.0, 0.0], [0.0, 0.0, 1.0]), 1.0), None);
        // The cone x² + y² = z² at height 2 from x = −5: at x = ∓2.
        let cone = diagonal([1.0, 1.0, -1.0]);
        assert_near(cone.intersect(&ray([-5.0, 0.0, 2.0], [1.0, 0.0, 0.0]), 0.0), [3.0, 7.0]);
        // Along a line that is as steep as its side, once: (s)² = (s + 1 − 1 …) at x = z + 1.
        let once = cone.intersect(&ray([1.0, 0.0, 0.0], [1.0, 0.0, 1.0]), 0.0);
        assert_near(once, [-0.5, f64::INFINITY]);
        // The paraboloid x² + y² = z, along its axis at x = 0.5: once, at 0.25.
        let paraboloid = PointQuadric { b: DVec3::Z * -0.5, ..diagonal([1.0, 1.0, 0.0]) };
        let along = ray([0.5, 0.0, -2.0], [0.0, 0.0, 1.0]);
        assert_near(paraboloid.intersect(&along, 0.0), [2.25, f64::INFINITY]);
        // The two planes at a distance of 0.1 from a triangle's own.
        let plane = PointQuadric::from_plane(DVec3::Z, DVec3::Z, 1.0);
        assert_near(plane.intersect(&ray([0.0; 3], [0.0, 0.0, 1.0]), 0.01), [0.9, 1.1]);
    }

    #[test]
    fn a_cube_corner_is_a_ball_an_edge_and_a_plane_are_open_and_what_costs_more_everywhere_is_empty()
     {
        let at = DVec3::new(0.3, -0.2, 5.0);
        let mut quadric = PointQuadric::from_plane(at, DVec3::X, 1.0);
        assert_eq!(quadric.isosurface(1.0), Isosurface::Open);
        quadric.add(&PointQuadric::from_plane(at, DVec3::Y, 1.0));
        assert_eq!(quadric.isosurface(1.0), Isosurface::Open);
        quadric.add(&PointQuadric::from_plane(at, DVec3::Z, 1.0));
        let Isosurface::Ellipsoid(ball) = quadric.isosurface(0.04) else { panic!("a ball") };
        assert!((ball.center - at).length() < 1e-12);
        assert!((ball.half_axes - DVec3::splat(0.2)).length() < 1e-12);
        assert!((ball.thickness() - 1.0).abs() < 1e-12);
        quadric.add(&PointQuadric::from_plane(at + DVec3::X, DVec3::X, 1.0));
        assert_eq!(quadric.isosurface(0.5 - 1e-9), Isosurface::Empty, "half from either plane");
    }

    fn vector(most: f64) -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-most..most).prop_map(DVec3::from_array)
    }

    fn affine() -> impl Strategy<Value = DAffine3> {
        (vector(3.0), prop::array::uniform3(0.2..3.0f64), vector(2.0)).prop_map(
            |(turn, scale, moved)| {
                let turn = DQuat::from_euler(EulerRot::XYZ, turn.x, turn.y, turn.z);
                let scale = DMat3::from_diagonal(scale.into());
                let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.3, 1.0, 0.0), DVec3::Z);
                DAffine3::from_mat3_translation(DMat3::from_quat(turn) * shear * scale, moved)
            },
        )
    }

    /// Planes in all directions around a point.
    fn definite() -> impl Strategy<Value = PointQuadric> {
        (vector(1.0), prop::collection::vec((vector(1.0), 0.1..1.0f64), 4..8)).prop_map(
            |(at, planes)| {
                let mut sum = PointQuadric::default();
                for (normal, weight) in planes {
                    let normal = normal.normalize_or(DVec3::X);
                    sum.add(&PointQuadric::from_plane(
                        at + 0.01 * normal.cross(DVec3::ONE),
                        normal,
                        weight,
                    ));
                }
                sum
            },
        )
    }

    proptest! {
        /// The closed form of a sphere under a map is that of the ray under its inverse.
        #[test]
        fn a_ray_meets_a_mapped_sphere_where_the_mapped_ray_meets_the_sphere(
            map in affine(), origin in vector(4.0), toward in vector(0.5),
        ) {
            let direction = map.transform_point3(toward) - origin;
            prop_assume!(direction.length() > 0.1);
            let ray = Ray { origin, direction };
            let mapped = diagonal([1.0; 3]).transformed(&map).unwrap();
            let back = map.inverse();
            let (o, d) = (back.transform_point3(origin), back.transform_vector3(direction));
            let (dd, od, oo) = (d.dot(d), o.dot(d), o.dot(o) - 1.0);
            let root = (od * od - dd * oo).sqrt();
            prop_assume!(root > 1e-2);
            let found = mapped.intersect(&ray, 1.0).unwrap();
            for (found, expected) in found.into_iter().zip([(-od - root) / dd, (-od + root) / dd]) {
                prop_assert!((found - expected).abs() < 1e-9 * expected.abs().max(1.0), "{found} {expected}");
                let normal = mapped.gradient(ray.at(found)).normalize();
                // Normals go by the transposed inverse.
                let own = back.matrix3.transpose() * back.transform_point3(ray.at(found));
                prop_assert!((normal - own.normalize()).length() < 1e-8);
            }
        }

        #[test]
        fn a_quadric_under_a_map_has_there_what_it_had(
            quadric in definite(), map in affine(), p in vector(2.0),
        ) {
            let mapped = quadric.transformed(&map).unwrap();
            let (was, is) = (quadric.value(p), mapped.value(map.transform_point3(p)));
            prop_assert!((was - is).abs() < 1e-9 * (1.0 + was.abs()), "{was} {is}");
        }

        #[test]
        fn every_point_of_an_ellipsoid_has_the_value(quadric in definite(), turn in vector(1.0), value in 1e-3..1.0f64) {
            let Isosurface::Ellipsoid(own) = quadric.isosurface(value) else { return Ok(()) };
            let points = [turn.normalize_or(DVec3::X), DVec3::Y, DVec3::NEG_Z].map(|on| own.point(on));
            let axes = [0, 1, 2].map(|at| own.center + own.directions.col(at) * own.half_axes[at]);
            for point in points.into_iter().chain(axes) {
                let off = (quadric.value(point) - value).abs();
                prop_assert!(off < 1e-6 * value, "{off} of {value}");
            }
            let matrix = own.map * own.map.transpose();
            let squares = DMat3::from_diagonal(own.half_axes * own.half_axes);
            let by_axes = own.directions * squares * own.directions.transpose();
            let scale = own.half_axes.z * own.half_axes.z;
            prop_assert!((matrix - by_axes).to_cols_array().iter().all(|x| x.abs() < 1e-6 * scale));
        }
    }
}
