//! A surface whose points are looked for by walking: from triangle to triangle while that is nearer.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::fans::Fans;
use crate::id::{CornerId, TriangleId};
use crate::mesh::Mesh;
use crate::surface::Surface;
use crate::triangle::{area_vector, closest_on_triangle};

/// Points whose normals have a cosine below this lie on two sheets.
const SAME_SIDE: f32 = 0.2;
/// The most steps from one triangle to the next. Most walks take one or two, those through the slivers
/// around the pole of a sphere some dozens.
const STEPS: usize = 128;
/// The most triangles around a point that are all looked at.
const MAX_FAN: usize = 64;
/// Below this square of the sine between two sides, a triangle is left to the careful search.
const LEAST_SINE_SQUARE: f64 = 1e-12;

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    pub(super) triangle: TriangleId,
    /// The barycentrics of the second and the third corner.
    weights: [f32; 2],
}

impl SurfacePoint {
    pub(super) fn new(triangle: TriangleId, barycentrics: DVec3) -> Self {
        Self { triangle, weights: [barycentrics.y as f32, barycentrics.z as f32] }
    }

    /// One per corner, sum 1.
    pub(super) fn barycentrics(&self) -> DVec3 {
        let [second, third] = self.weights.map(f64::from);
        DVec3::new(1.0 - second - third, second, third)
    }
}

/// The point of a triangle nearest to a place.
#[derive(Clone, Copy)]
struct Step {
    triangle: TriangleId,
    weights: DVec3,
    square: f64,
}

/// A surface as it lies now.
pub(super) struct Sheet<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) fans: Arc<Fans>,
    /// One per triangle: its unit normal, zero if it has no area.
    normals: Vec<Vec3>,
}

impl<'a> Sheet<'a> {
    pub(super) fn new(mesh: &'a Mesh, fans: Arc<Fans>) -> Self {
        let corners = |t: &[u32; 3]| t.map(|point| mesh.positions[point as usize]);
        let normals = fans
            .triangles
            .par_iter()
            .map(|t| area_vector(corners(t)).normalize_or_zero().as_vec3())
            .collect();
        Self { mesh, fans, normals }
    }

    /// This surface as a tree, to be searched everywhere.
    pub(super) fn surface(&self) -> Surface {
        Surface::new(&self.mesh.positions, self.fans.triangles.iter().copied())
    }

    /// The unit normal of a triangle, zero if it has no area.
    #[inline]
    pub(super) fn normal(&self, triangle: TriangleId) -> DVec3 {
        self.normals[triangle].as_dvec3()
    }

    /// The corners of a triangle.
    #[inline]
    pub(super) fn corners(&self, triangle: TriangleId) -> [DVec3; 3] {
        self.fans.triangles[triangle.index()].map(|p| self.mesh.positions[p as usize].as_dvec3())
    }

    /// The position of a point.
    #[inline]
    pub(super) fn place(&self, point: &SurfacePoint) -> DVec3 {
        let ([a, b, c], weights) = (self.corners(point.triangle), point.barycentrics());
        a * weights.x + b * weights.y + c * weights.z
    }

    /// Whether a triangle faces about the way that `normal` points.
    #[inline]
    fn faces(&self, triangle: TriangleId, normal: Vec3) -> bool {
        self.normals[triangle].dot(normal) > SAME_SIDE
    }

    /// The point of this surface, given as `surface` too, nearest to one of `other`, on the same side and
    /// not beyond `max`.
    pub(super) fn find(
        &self,
        surface: &Surface,
        other: &Self,
        point: &SurfacePoint,
        max: f64,
    ) -> Option<SurfacePoint> {
        let normal = other.normals[point.triangle];
        let found = surface.closest_foot(other.place(point), max, |t| self.faces(t, normal))?;
        Some(SurfacePoint::new(found.triangle, found.barycentrics))
    }

    /// The triangle around `vertex` whose middle is nearest to a point of `other`, of those on the same
    /// side. None where too many lie around it, too.
    pub(super) fn start(
        &self,
        vertex: u32,
        other: &Self,
        point: &SurfacePoint,
    ) -> Option<TriangleId> {
        let fan = self.fans.corners(vertex);
        if fan.len() > MAX_FAN {
            return None;
        }
        let (p, normal) = (other.place(point) * 3.0, other.normals[point.triangle]);
        let middle = |t: TriangleId| self.corners(t).into_iter().sum::<DVec3>();
        fan.map(CornerId::triangle)
            .filter(|&t| self.faces(t, normal))
            .map(|t| (middle(t).distance_squared(p), t))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, triangle)| triangle)
    }

    /// The nearest point, found from `start` by going to neighbors while they are nearer. Not
    /// always the nearest of all, but never farther than what `start` has.
    pub(super) fn follow(
        &self,
        start: TriangleId,
        other: &Self,
        point: &SurfacePoint,
    ) -> SurfacePoint {
        self.walk(start, other, point).0
    }

    /// The same from a triangle that is only near; none if the way is too long.
    pub(super) fn reach(
        &self,
        start: TriangleId,
        other: &Self,
        point: &SurfacePoint,
    ) -> Option<SurfacePoint> {
        let (found, is_end) = self.walk(start, other, point);
        is_end.then_some(found)
    }

    /// Where a walk comes to, and whether it ends there.
    fn walk(&self, start: TriangleId, other: &Self, point: &SurfacePoint) -> (SurfacePoint, bool) {
        let (p, normal) = (other.place(point), other.normals[point.triangle]);
        let mut best = self.closest(start, p);
        let mut is_end = false;
        for _ in 0..STEPS {
            let from = best.triangle;
            self.step(&mut best, p, normal);
            is_end = best.triangle == from;
            if is_end {
                break;
            }
        }
        (SurfacePoint::new(best.triangle, best.weights), is_end)
    }

    /// Goes to the nearest of the triangles that meet at the foot `best`.
    #[inline]
    fn step(&self, best: &mut Step, p: DVec3, normal: Vec3) {
        let (from, is_zero) = (best.triangle, best.weights.to_array().map(|weight| weight == 0.0));
        let points = self.fans.triangles[from.index()];
        let mut look = |t: TriangleId| {
            if t != from && self.faces(t, normal) {
                let next = self.closest(t, p);
                if next.square < best.square {
                    *best = next;
                }
            }
        };
        let corner = (0..3).find(|&slot| is_zero[(slot + 1) % 3] && is_zero[(slot + 2) % 3]);
        match corner.map(|slot| self.fans.corners(points[slot])) {
            Some(fan) if fan.len() <= MAX_FAN => fan.map(CornerId::triangle).for_each(look),
            _ => {
                for slot in (0..3).filter(|&slot| is_zero[slot]) {
                    let across = self.fans.at_edge(points[(slot + 1) % 3], points[(slot + 2) % 3]);
                    across.for_each(&mut look);
                }
            }
        }
    }

    /// The nearest point of a triangle: at once if it lies inside, as most do.
    #[inline(always)]
    fn closest(&self, triangle: TriangleId, p: DVec3) -> Step {
        let [a, b, c] = self.corners(triangle);
        let (ab, ac, ap) = (b - a, c - a, p - a);
        let (bb, bc, cc) = (ab.dot(ab), ab.dot(ac), ac.dot(ac));
        let (to_b, to_c) = (ap.dot(ab), ap.dot(ac));
        let square = bb * cc - bc * bc;
        let (y, z) = (cc * to_b - bc * to_c, bb * to_c - bc * to_b);
        let x = square - y - z;
        if x > 0.0 && y > 0.0 && z > 0.0 && square > LEAST_SINE_SQUARE * bb * cc {
            let weights = DVec3::new(x, y, z) / square;
            let square = (ap - ab * weights.y - ac * weights.z).length_squared();
            return Step { triangle, weights, square };
        }
        let corners = self.mesh.triangle_positions(triangle.index());
        let (weights, _, square) = closest_on_triangle(p, &corners);
        Step { triangle, weights, square }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::grid;

    #[test]
    fn a_point_is_followed_over_a_sheet_to_what_is_nearest() {
        let mut below = grid(8);
        let above = grid(8);
        for p in &mut below.positions {
            p.z = -0.1;
        }
        let sheet = |mesh| Sheet::new(mesh, Arc::new(Fans::of(mesh)));
        let (below, above) = (sheet(&below), sheet(&above));
        let surface = below.surface();
        let middle = DVec3::new(0.5, 0.3, 0.2);
        for t in 0..above.mesh.triangles.len() {
            let point = SurfacePoint::new(TriangleId::new(t), middle);
            let nearest = below.find(&surface, &above, &point, f64::INFINITY).expect("a foot");
            let start = TriangleId::new(above.mesh.triangles.len() / 2);
            let found = below.follow(start, &above, &point);
            assert_eq!(found.triangle, nearest.triangle);
            assert!((above.place(&point) - below.place(&found)).length() < 0.1 + 1e-6);
        }
    }
}
