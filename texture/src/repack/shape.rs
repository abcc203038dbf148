//! A chart laid flat: scaled to the surface, turned to its smallest rectangle.

use glam::{DVec2, Vec2Swizzles};

use super::UvMesh;
use super::charts::{Chart, bounds};
use super::faces::Faces;

/// A chart in the plane, in units of the surface.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    /// One per new vertex: the vertex it came from, in ascending order.
    pub(super) vertices: Vec<u32>,
    /// One per new vertex, from (0, 0) to `size`.
    pub(super) places: Vec<DVec2>,
    /// Indices into `vertices`.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Extent, the longer side first.
    pub(super) size: DVec2,
    /// Area of its triangles.
    pub(super) area: f64,
}

impl Shape {
    /// Lays a chart out so that its area is the one it has in space, times the square of
    /// `density`.
    pub(super) fn new(mesh: &UvMesh<'_>, faces: &Faces<'_>, chart: &Chart, density: f64) -> Self {
        let corners = |&triangle: &u32| mesh.triangles[triangle as usize];
        let mut vertices: Vec<u32> = chart.triangles.iter().flat_map(corners).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let local = |vertex| vertices.binary_search(&vertex).expect("a vertex of the chart") as u32;
        let triangles: Vec<[u32; 3]> =
            chart.triangles.iter().map(|triangle| corners(triangle).map(local)).collect();
        let places = vertices.iter().map(|&vertex| faces.place(chart.kind, vertex)).collect();
        let mut shape = Self { vertices, places, triangles, size: DVec2::ZERO, area: 0.0 };
        let flat: f64 = shape.corners().map(|c| 0.5 * super::faces::turn(c)).sum();
        let surface: f64 = chart.triangles.iter().map(|&t| faces.area(t as usize)).sum();
        let scale = (surface / flat).sqrt() * density;
        let scale = if scale.is_finite() { scale } else { 0.0 };
        let along = smallest_rectangle(&hull(shape.places.clone()));
        let turn = DVec2::new(along.x, -along.y) * scale;
        shape.places.iter_mut().for_each(|p| *p = turn.rotate(*p));
        shape.stand();
        shape.area = flat * scale * scale;
        shape
    }

    /// Corners of its triangles.
    pub(super) fn corners(&self) -> impl Iterator<Item = [DVec2; 3]> {
        self.triangles.iter().map(|triangle| triangle.map(|v| self.places[v as usize]))
    }

    /// Shrinks it to a length.
    pub(super) fn shrink_to(&mut self, length: f64) {
        let factor = length / self.size.x;
        self.places.iter_mut().for_each(|p| *p *= factor);
        self.size *= factor;
        self.area *= factor * factor;
    }

    /// Moves it to the origin, its longer side along x.
    fn stand(&mut self) {
        let [low, high] = bounds(self.corners());
        let size = high - low;
        let upright = size.y > size.x;
        for p in &mut self.places {
            *p = if upright { DVec2::new(high.y - p.y, p.x - low.x) } else { *p - low };
        }
        self.size = if upright { size.yx() } else { size };
    }
}

/// The convex hull, without collinear points; positive orientation (Andrew, "Another efficient
/// algorithm for convex hulls in two dimensions", 1979).
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let mut hull: Vec<DVec2> = Vec::new();
    let mut extend = |points: &mut dyn Iterator<Item = &DVec2>| {
        let start = hull.len();
        for &p in points {
            while let [.., a, b] = hull[start..]
                && (b - a).perp_dot(p - a) <= 0.0
            {
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
    };
    extend(&mut points.iter());
    extend(&mut points.iter().rev());
    hull
}

/// The direction of the rectangle of least area around a convex outline: one of its sides lies on
/// an edge (Freeman & Shapira, "Determining the minimum-area encasing rectangle for an arbitrary
/// closed curve", 1975), found with calipers that go once around.
fn smallest_rectangle(hull: &[DVec2]) -> DVec2 {
    let count = hull.len();
    let at = |i: usize| hull[i % count];
    let mut best = (f64::INFINITY, DVec2::X);
    // The points farthest along, farthest above, farthest back.
    let mut far = [1, 1, 1];
    for i in 0..count {
        let along = (at(i + 1) - at(i)).normalize_or_zero();
        let directions = [along, along.perp(), -along];
        let mut previous = i + 1;
        for (far, direction) in far.iter_mut().zip(directions) {
            *far = (*far).max(previous);
            while *far < i + count && direction.dot(at(*far + 1) - at(*far)) > 0.0 {
                *far += 1;
            }
            previous = *far;
        }
        let width = along.dot(at(far[0]) - at(far[2]));
        let area = width * along.perp_dot(at(far[1]) - at(i));
        if along != DVec2::ZERO && area < best.0 {
            best = (area, along);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn area_along(points: &[DVec2], along: DVec2) -> f64 {
        let turn = DVec2::new(along.x, -along.y);
        let turned = points.iter().map(|&p| [turn.rotate(p); 3]);
        let [low, high] = bounds(turned);
        (high - low).element_product()
    }

    #[test]
    fn a_turned_rectangle_is_found() {
        let along = DVec2::from_angle(0.4);
        let corners = [[0.0, 0.0], [5.0, 0.0], [5.0, 2.0], [0.0, 2.0], [2.0, 1.0]];
        let points: Vec<DVec2> = corners.map(|p| along.rotate(p.into())).to_vec();
        assert_eq!(hull(points.clone()).len(), 4);
        let found = smallest_rectangle(&hull(points.clone()));
        assert!((area_along(&points, found) - 10.0).abs() < 1e-9);
    }

    #[test]
    fn points_and_lines_have_a_direction() {
        for points in [vec![DVec2::ONE; 3], vec![DVec2::ZERO, DVec2::ONE, DVec2::splat(2.0)]] {
            let along = smallest_rectangle(&hull(points));
            assert!((along.length() - 1.0).abs() < 1e-12);
        }
    }

    proptest! {
        #[test]
        fn calipers_find_the_least_over_all_edges(
            points in prop::collection::vec([-9.0..9.0f64, -9.0..9.0f64], 3..40),
        ) {
            let points: Vec<DVec2> = points.into_iter().map(DVec2::from).collect();
            let outline = hull(points.clone());
            let edges = (0..outline.len()).map(|i| outline[(i + 1) % outline.len()] - outline[i]);
            let least = edges.map(|e| area_along(&points, e.normalize())).fold(f64::MAX, f64::min);
            let found = area_along(&points, smallest_rectangle(&outline));
            prop_assert!((found - least).abs() < 1e-9 * (1.0 + least), "{found} {least}");
        }
    }
}
