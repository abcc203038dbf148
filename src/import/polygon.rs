//! Polygons to triangles.
//!
//! A convex polygon becomes a fan. Another loses one ear after another (Meisters, "Polygons have
//! ears", American Mathematical Monthly 1975) in the plane that its normal (Newell's sum of cross
//! products) leans towards. Every corner stays, those on a straight edge too, since a neighbor may
//! have one there.

use glam::{DVec2, DVec3};

/// Most corners that ears are cut from: it takes up to their third power in steps. A larger polygon
/// becomes a fan.
const MOST_CORNERS: usize = 128;

/// The triangles of a polygon, as numbers of its corners: two fewer than it has corners. It winds
/// as the polygon does.
pub(super) fn triangulate(corners: &[[f64; 3]]) -> Vec<[usize; 3]> {
    let fan = || (2..corners.len()).map(|at| [0, at - 1, at]).collect();
    if corners.len() < 4 || corners.len() > MOST_CORNERS {
        return fan();
    }
    let points = flatten(corners);
    let count = points.len();
    let turn = |at: usize| cross(points[at], points[(at + 1) % count], points[(at + 2) % count]);
    if (0..count).all(|at| turn(at) >= 0.0) { fan() } else { cut_ears(&points) }
}

/// The corners in the plane of two axes that shows the polygon largest, counterclockwise.
fn flatten(corners: &[[f64; 3]]) -> Vec<DVec2> {
    let points: Vec<DVec3> = corners.iter().map(|&corner| DVec3::from_array(corner)).collect();
    let spokes: Vec<DVec3> = points.iter().map(|point| point - points[0]).collect();
    let normal: DVec3 = spokes.windows(2).map(|pair| pair[0].cross(pair[1])).sum();
    let axis = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap_or(2);
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    let sign = normal[axis].signum();
    points.iter().map(|point| DVec2::new(point[u] * sign, point[v])).collect()
}

/// Twice the area of a triangle, positive if it is counterclockwise.
fn cross(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

fn cut_ears(points: &[DVec2]) -> Vec<[usize; 3]> {
    let mut left: Vec<usize> = (0..points.len()).collect();
    let mut triangles = Vec::with_capacity(points.len() - 2);
    while left.len() > 3 {
        let count = left.len();
        let around = |at: usize| [left[(at + count - 1) % count], left[at], left[(at + 1) % count]];
        // One that crosses itself may have no ear: then its corner that turns most goes.
        let area = |at: usize| cross_of(points, around(at));
        let ear = (0..count)
            .find(|&at| is_ear(points, &left, around(at)))
            .or_else(|| (0..count).max_by(|&a, &b| area(a).total_cmp(&area(b))))
            .unwrap_or(0);
        triangles.push(around(ear));
        left.remove(ear);
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}

fn cross_of(points: &[DVec2], [a, b, c]: [usize; 3]) -> f64 {
    cross(points[a], points[b], points[c])
}

/// Whether a corner can be cut off: it turns the right way, and no other lies in its triangle.
fn is_ear(points: &[DVec2], left: &[usize], triangle: [usize; 3]) -> bool {
    let corners = triangle.map(|corner| points[corner]);
    let is_inside = |point: DVec2| {
        let [a, b, c] = corners;
        [(a, b), (b, c), (c, a)].iter().all(|&(from, to)| cross(from, to, point) >= 0.0)
    };
    cross_of(points, triangle) > 0.0
        && left
            .iter()
            .filter(|other| !triangle.contains(other))
            .all(|&other| corners.contains(&points[other]) || !is_inside(points[other]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of an outline in the plane x = 2, with their areas.
    fn areas(outline: &[[f64; 2]]) -> Vec<f64> {
        let corners: Vec<[f64; 3]> = outline.iter().map(|&[y, z]| [2.0, y, z]).collect();
        let triangles = triangulate(&corners);
        assert_eq!(triangles.len(), outline.len() - 2);
        let points: Vec<DVec2> = outline.iter().map(|&[y, z]| DVec2::new(y, z)).collect();
        triangles.iter().map(|&triangle| cross_of(&points, triangle) / 2.0).collect()
    }

    #[test]
    fn a_square_is_cut_once() {
        assert_eq!(areas(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), [0.5, 0.5]);
    }

    /// ```text
    ///  3      an arrowhead, whose dent is at 0
    ///  |\ \
    ///  | 0   2
    ///  |/ /
    ///  1
    /// ```
    #[test]
    fn dents_are_kept_free_whichever_way_the_outline_winds() {
        let mut arrow = vec![[1.0, 0.0], [0.0, -2.0], [3.0, 0.0], [0.0, 2.0]];
        let star: Vec<[f64; 2]> = (0..24)
            .map(|at| {
                let (angle, radius) = (at as f64 * 0.261_799_4, [3.0, 1.0][at % 2]);
                [radius * angle.cos(), radius * angle.sin()]
            })
            .collect();
        for (outline, area) in [(&mut arrow, 4.0), (&mut star.clone(), 9.317)] {
            for sign in [1.0, -1.0] {
                let areas = areas(outline);
                assert!(areas.iter().all(|area| area * sign > 0.0), "{areas:?}");
                assert!((areas.iter().sum::<f64>() - area * sign).abs() < 1e-2, "{areas:?}");
                outline.reverse();
            }
        }
    }

    #[test]
    fn outlines_that_make_no_sense_still_give_triangles() {
        areas(&[[0.0, 0.0]; 9]);
        areas(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [0.5, -1.0]]);
        let zigzag: Vec<[f64; 2]> = (0..500).map(|at| [f64::from(at), f64::from(at % 7)]).collect();
        areas(&zigzag);
    }
}
