//! The part of a surface around a place, for many searches that are near to each other.
//!
//! A search through the tree opens the same nodes for each of the texels or samples that lie beside each
//! other. Here the triangles that come within a reach of a place are listed once; a point near the place
//! then looks at those alone. The list holds the answer if the point's distance to it and that to the
//! place together are no more than the reach, by the triangle inequality.
//!
//! Of each triangle four planes are kept, its own and one through each edge: how far a point lies off
//! the first, or outside of one of the others, bounds its distance from below, and tells for nearly every
//! triangle that it is too far. The planes are in f32 and counted from the place; what is left is measured
//! in f64, so that the answer is that of [`Surface::closest_foot`] to the bit.

use glam::{DVec3, Vec3};

use crate::id::TriangleId;
use crate::surface::{Foot, Surface};
use crate::triangle::closest_on_triangle;

/// Triangles whose bounds are found at a time.
const LANES: usize = 8;
/// More triangles are no list that is worth to be walked for each point.
const MOST: usize = 64;
/// More than bounds are off by rounding, over the lengths that they are counted from.
const SLACK: f64 = 4e-6;

/// Square of the share of the longest edge that a triangle's height is at least, for planes to bound it.
const NEEDLE: f64 = 1e-12;

/// Planes of triangles: normals and offsets, those of the triangles themselves first.
#[derive(Clone, Copy, Debug)]
struct Planes([[[f32; LANES]; 4]; 4]);

impl Planes {
    /// Those of no triangles: infinitely far.
    const NONE: Self = {
        let mut planes = [[[0.0; LANES]; 4]; 4];
        planes[0][3] = [f32::INFINITY; LANES];
        Self(planes)
    };

    fn set(&mut self, lane: usize, corners: &[Vec3; 3], place: DVec3) {
        let [a, b, c] = corners.map(|corner| corner.as_dvec3() - place);
        let normal = (b - a).cross(c - a);
        let longest = (b - a).length_squared().max((c - a).length_squared());
        // That of a needle may point anywhere.
        let is_flat = normal.length_squared() > NEEDLE * longest * longest;
        let normal = if is_flat { normal } else { DVec3::ZERO };
        let out = |start: DVec3, end: DVec3| ((end - start).cross(normal), start);
        let planes = [(normal, a), out(a, b), out(b, c), out(c, a)];
        for (own, (normal, through)) in self.0.iter_mut().zip(planes) {
            // Of what has no area, a plane that bounds nothing.
            let unit = normal.normalize_or_zero();
            let all = unit.as_vec3().extend((unit.dot(through)) as f32).to_array();
            own.iter_mut().zip(all).for_each(|(own, number)| own[lane] = number);
        }
    }

    /// Less than the distance of each triangle to a point.
    #[inline]
    fn bounds(&self, point: Vec3) -> [f32; LANES] {
        let [x, y, z] = point.to_array();
        let [plane, sides @ ..] = &self.0;
        let mut bounds = [0.0; LANES];
        for lane in 0..LANES {
            let off = |of: &[[f32; LANES]; 4]| {
                of[0][lane] * x + of[1][lane] * y + of[2][lane] * z - of[3][lane]
            };
            let mut most = off(plane).abs();
            for side in sides {
                let out = off(side);
                most = if out > most { out } else { most };
            }
            bounds[lane] = most;
        }
        bounds
    }
}

/// The triangles of a surface that come within a reach of a place.
#[derive(Clone, Debug)]
pub struct Vicinity {
    place: DVec3,
    /// Below 0 if nothing can be told.
    reach: f64,
    planes: Vec<Planes>,
    corners: Vec<[Vec3; 3]>,
    ids: Vec<TriangleId>,
}

impl Default for Vicinity {
    /// One that tells nothing.
    fn default() -> Self {
        let (planes, corners, ids) = (Vec::new(), Vec::new(), Vec::new());
        Self { place: DVec3::ZERO, reach: -1.0, planes, corners, ids }
    }
}

impl Vicinity {
    /// Becomes that of a place, of the triangles that `keep` approves. It tells nothing if they are
    /// very many.
    pub fn gather(
        &mut self,
        surface: &Surface,
        place: Vec3,
        reach: f64,
        keep: impl Fn(TriangleId) -> bool,
    ) {
        self.planes.clear();
        self.corners.clear();
        self.ids.clear();
        (self.place, self.reach) = (place.as_dvec3(), reach);
        let is_told = surface.visit_within(place, reach, |triangle, corners| {
            if keep(triangle) {
                self.corners.push(*corners);
                self.ids.push(triangle);
            }
            self.ids.len() <= MOST
        });
        if !is_told {
            self.reach = -1.0;
            return;
        }
        self.planes.resize(self.ids.len().div_ceil(LANES), Planes::NONE);
        for (at, corners) in self.corners.iter().enumerate() {
            self.planes[at / LANES].set(at % LANES, corners, self.place);
        }
    }

    /// Whether all triangles that come so near to a point are listed.
    #[inline]
    pub fn covers(&self, point: DVec3, distance: f64) -> bool {
        point.distance(self.place) + distance <= self.reach
    }

    /// The point nearest to `p`, within `max`, of the listed triangles that `accept` approves. It is
    /// that of the surface if its distance is [covered](Self::covers).
    #[inline]
    pub fn closest_foot(
        &self,
        p: DVec3,
        max: f64,
        accept: impl Fn(TriangleId) -> bool,
    ) -> Option<Foot> {
        let off = p - self.place;
        let slack = SLACK * (self.reach + off.length());
        let mut bounds = [[f32::INFINITY; LANES]; MOST / LANES + 1];
        let (mut first, mut least) = (0, f32::INFINITY);
        for (block, (planes, bounds)) in self.planes.iter().zip(&mut bounds).enumerate() {
            *bounds = planes.bounds(off.as_vec3());
            for (lane, bound) in bounds.iter().enumerate() {
                if *bound < least {
                    (first, least) = (block * LANES + lane, *bound);
                }
            }
        }
        let mut best: Option<Foot> = None;
        let (mut square, mut enough) = (max * max, ((max + slack) as f32).next_up());
        let count = self.ids.len();
        // The one of the least bound is most often the nearest.
        let rest = (0..count).filter(|&at| at != first);
        for at in (first..count).take(1).chain(rest) {
            if bounds[at / LANES][at % LANES] > enough {
                continue;
            }
            let triangle = self.ids[at];
            let (barycentrics, point, distance_squared) = closest_on_triangle(p, &self.corners[at]);
            let is_better = distance_squared < square
                || (distance_squared == square && best.is_none_or(|best| triangle < best.triangle));
            if is_better && accept(triangle) {
                best = Some(Foot { triangle, barycentrics, point, distance_squared });
                square = distance_squared;
                enough = ((square.sqrt() + slack) as f32).next_up();
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_point() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-20i8..20).prop_map(|p| Vec3::from(p.map(f32::from)) / 7.0)
    }

    proptest! {
        #[test]
        fn what_is_covered_is_what_the_surface_says(
            positions in prop::collection::vec(any_point(), 3..40),
            triangles in prop::collection::vec(prop::array::uniform3(0u32..1000), 1..100),
            place in any_point(), reach in 0.0f64..3.0, skipped in 1u32..4,
            queries in prop::collection::vec((any_point(), 0.0f64..1.0), 40),
        ) {
            let count = positions.len() as u32;
            let triangles: Vec<_> = triangles.iter().map(|t| t.map(|p| p % count)).collect();
            let surface = Surface::new(&positions, triangles.iter().copied());
            let mut vicinity = Vicinity::default();
            vicinity.gather(&surface, place, reach, |_| true);
            let accept = |triangle: TriangleId| triangle.0.is_multiple_of(skipped);
            for (query, share) in queries {
                let p = place.as_dvec3().lerp(query.as_dvec3(), share * 0.3);
                for max in [f64::INFINITY, share] {
                    let own = surface.closest_foot(p, max, accept);
                    let found = vicinity.closest_foot(p, max, accept);
                    let distance = found.map_or(max, |foot| foot.distance_squared.sqrt());
                    if vicinity.covers(p, distance) {
                        prop_assert_eq!(found, own);
                    }
                }
            }
        }
    }

    #[test]
    fn nothing_is_told_of_no_place_and_of_very_many_triangles() {
        let surface = Surface::new(&[Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]; MOST + 1]);
        let mut vicinity = Vicinity::default();
        for (place, reach) in [(Vec3::ZERO, 1.0), (Vec3::NAN, 1.0), (Vec3::ZERO, f64::NAN)] {
            vicinity.gather(&surface, place, reach, |_| true);
            assert!(!vicinity.covers(DVec3::ZERO, 0.0));
        }
        vicinity.gather(&surface, Vec3::ZERO, 1.0, |triangle| triangle.0 < 3);
        assert!(vicinity.covers(DVec3::ZERO, 0.5) && !vicinity.covers(DVec3::ZERO, 1.5));
        let foot = vicinity.closest_foot(DVec3::Z * 0.25, f64::INFINITY, |_| true);
        assert_eq!(foot.map(|foot| (foot.triangle.0, foot.distance_squared)), Some((0, 0.0625)));
    }
}
