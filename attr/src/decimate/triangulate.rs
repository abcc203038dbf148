//! A hole triangulated by splitting it in two, over and over.

use glam::DVec3;

/// The least distance of a corner to the plane of a split, over the length of the split: less makes slivers.
const LEAST_ASPECT: f64 = 0.01;

/// The triangles of a polygon whose corners go counter-clockwise around `normal`, as indices: each time along the
/// line that is shortest beside how far the others keep away from it, the plane through it along the normal
/// having one part on either side. `None` if there is no such line, or a triangle lies at an angle beyond
/// `cosine` to the normal. Two corners have no triangle.
pub(super) fn triangulate(
    corners: &[DVec3],
    normal: DVec3,
    cosine: f64,
) -> Option<Vec<[usize; 3]>> {
    let mut triangles = Vec::new();
    let mut waiting: Vec<Vec<usize>> = vec![(0..corners.len()).collect()];
    while let Some(part) = waiting.pop() {
        match part[..] {
            [] | [_] | [_, _] => {}
            [a, b, c] => {
                let cross = (corners[b] - corners[a]).cross(corners[c] - corners[a]);
                let along = cross.dot(normal);
                if along <= 0.0 || along < cosine * cross.length() {
                    return None;
                }
                triangles.push([a, b, c]);
            }
            _ => waiting.extend(split(&part, corners, normal)?),
        }
    }
    Some(triangles)
}

/// Both parts of a polygon on either side of its best split.
fn split(part: &[usize], corners: &[DVec3], normal: DVec3) -> Option<[Vec<usize>; 2]> {
    let mut best = (LEAST_ASPECT, None);
    for from in 0..part.len() {
        for to in from + 2..part.len() {
            // The first and the last are neighbors.
            if from + part.len() == to + 1 {
                continue;
            }
            let aspect = aspect(part, [from, to], corners, normal);
            if aspect > best.0 {
                best = (aspect, Some([from, to]));
            }
        }
    }
    let [from, to] = best.1?;
    Some([part[from..=to].to_vec(), [&part[to..], &part[..=from]].concat()])
}

/// The least distance of the other corners to the plane of a split, over its length; 0 or less where one is on
/// the wrong side.
fn aspect(part: &[usize], [from, to]: [usize; 2], corners: &[DVec3], normal: DVec3) -> f64 {
    let (start, along) = (corners[part[from]], corners[part[to]] - corners[part[from]]);
    let across = normal.cross(along).normalize_or_zero();
    // Counter-clockwise, what comes between the two lies to the right of the line.
    let least = (0..part.len()).filter(|&at| at != from && at != to).map(|at| {
        let side = across.dot(corners[part[at]] - start);
        if from < at && at < to { -side } else { side }
    });
    least.fold(f64::INFINITY, f64::min) / along.length()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[DVec3], triangles: &[[usize; 3]]) -> f64 {
        let one = |[a, b, c]: &[usize; 3]| {
            (corners[*b] - corners[*a]).cross(corners[*c] - corners[*a]).z / 2.0
        };
        triangles.iter().map(one).sum()
    }

    #[test]
    fn a_polygon_is_covered_once_a_hollow_one_too() {
        let at = |step: i32| (40.0 * f64::from(step)).to_radians().sin_cos();
        let ring: Vec<DVec3> = (0..9).map(at).map(|(y, x)| DVec3::new(x, y, 0.0)).collect();
        let triangles = triangulate(&ring, DVec3::Z, 0.2).unwrap();
        let whole = 4.5 * 40f64.to_radians().sin();
        assert!(triangles.len() == 7 && (area(&ring, &triangles) - whole).abs() < 1e-12);
        // An L: two of the lines between its corners lie outside.
        let hollow = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]]
            .map(|[x, y]| DVec3::new(x, y, 0.0));
        let triangles = triangulate(&hollow, DVec3::Z, 0.2).unwrap();
        assert!(triangles.len() == 4 && (area(&hollow, &triangles) - 3.0).abs() < 1e-12);
        assert!(triangulate(&hollow, DVec3::NEG_Z, 0.2).is_none(), "the other way round");
        assert_eq!(triangulate(&hollow[..2], DVec3::Z, 0.2), Some(Vec::new()));
    }
}
