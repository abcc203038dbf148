//! Layers that lie on each other, back to back: leaves, cloth and paper as front and flipped copy.
//!
//! Such copies have all positions in common, so the weld makes one surface of both: inner edges of four
//! triangles, and where the sheet ends an edge of two that looks like any inner one. Nothing would hold its
//! outline then. Here front and back become surfaces of their own again, which meet nowhere: each is a
//! sheet with a border, and is simplified as one.
//!
//! Two triangles at an edge are back to back if they lie on the same side of it and run along it in opposite
//! senses. Where two do at an edge of two, or two pairs do at an edge of four, it is a fold. A triangle with at
//! least two folds is one of a layer; a fold counts if all of its triangles are. So a blade, which is
//! sharp along one edge, or a flap in a scan stays whole.

use glam::DVec3;

use crate::edges::{Side, visit_sides};
use crate::id::{CornerId, PointId, WedgeId};
use crate::mesh::Mesh;
use crate::sets::DisjointSets;

/// Triangles are on the same side of an edge if they enclose at most the angle of this cosine, 12°. Copies of
/// a bent sheet may be cut along other diagonals.
const SAME_SIDE: f64 = 0.98;

/// Triangles that go on into each other across an edge.
type Link = [usize; 2];

/// A fold: its points, its triangles, and which of them go on into each other.
struct Fold {
    points: [PointId; 2],
    triangles: Vec<usize>,
    links: Vec<Link>,
}

/// Gives each layer points and wedges of its own.
pub(crate) fn separate_layers(mesh: &mut Mesh, wedge_vertices: &mut Vec<u32>) {
    let folds = find_folds(mesh);
    if folds.is_empty() {
        return;
    }
    let mut sets = DisjointSets::new(mesh.triangles.len() * 3);
    let mut join = |points: [PointId; 2], triangles: &[usize]| {
        for point in points {
            let mut corners = triangles.iter().map(|&triangle| corner(mesh, triangle, point));
            let first = corners.next().expect("an edge has a triangle");
            corners.for_each(|corner| _ = sets.join(first.0, corner.0));
        }
    };
    let mut is_folded = vec![false; mesh.positions.len()];
    for fold in &folds {
        fold.points.iter().for_each(|&point| is_folded[point] = true);
        fold.links.iter().for_each(|link| join(fold.points, link));
    }
    let mut next = folds.iter().peekable();
    visit_edges(mesh, |sides| {
        let points = sides[0].0;
        if next.next_if(|fold| fold.points == points).is_none() {
            let triangles: Vec<usize> = sides.iter().map(|side| side.1).collect();
            join(points, &triangles);
        }
    });
    split(mesh, wedge_vertices, &mut sets, &is_folded);
}

fn visit_edges(mesh: &Mesh, visit: impl FnMut(&[Side])) {
    let points: Vec<[PointId; 3]> =
        (0..mesh.triangles.len()).map(|triangle| mesh.triangle_points(triangle)).collect();
    visit_sides(&points, mesh.positions.len(), visit);
}

/// The corner of a triangle at one of its points.
fn corner(mesh: &Mesh, triangle: usize, point: PointId) -> CornerId {
    let slot = mesh.triangle_points(triangle).iter().position(|&own| own == point);
    CornerId::new(3 * triangle + slot.expect("a point of the triangle"))
}

/// The folds between layers, in the order of their points.
fn find_folds(mesh: &Mesh) -> Vec<Fold> {
    let (mut folds, mut counts) = (Vec::new(), vec![0u8; mesh.triangles.len()]);
    visit_edges(mesh, |sides| {
        if let Some(links) = links(mesh, sides) {
            let triangles: Vec<usize> = sides.iter().map(|side| side.1).collect();
            triangles.iter().for_each(|&triangle| counts[triangle] += 1);
            folds.push(Fold { points: sides[0].0, triangles, links });
        }
    });
    folds.retain(|fold| fold.triangles.iter().all(|&triangle| counts[triangle] >= 2));
    folds
}

/// The pairs of triangles that go on into each other at a fold; `None` if the edge is no fold.
fn links(mesh: &Mesh, sides: &[Side]) -> Option<Vec<Link>> {
    let points = sides[0].0;
    let runs_up = |triangle: usize| {
        let own = mesh.triangle_points(triangle);
        (0..3).any(|slot| [own[slot], own[(slot + 1) % 3]] == points)
    };
    let backs = |a: usize, b: usize| {
        are_on_one_side(mesh, points, [a, b])
            && inward(mesh, points, a).dot(inward(mesh, points, b)) > SAME_SIDE
    };
    if let &[(_, a), (_, b)] = sides {
        return (backs(a, b) && runs_up(a) != runs_up(b)).then(Vec::new);
    }
    if sides.len() != 4 {
        return None;
    }
    let (up, down): (Vec<usize>, Vec<usize>) =
        sides.iter().map(|side| side.1).partition(|&triangle| runs_up(triangle));
    match (&up[..], &down[..]) {
        (&[a, b], &[c, d]) if backs(a, c) && backs(b, d) => Some(vec![[a, d], [b, c]]),
        (&[a, b], &[c, d]) if backs(a, d) && backs(b, c) => Some(vec![[a, c], [b, d]]),
        _ => None,
    }
}

/// Whether two triangles enclose less than a right angle at an edge of both: told without a root or a
/// quotient, since next to no edges of a surface are so.
fn are_on_one_side(mesh: &Mesh, [from, to]: [PointId; 2], triangles: [usize; 2]) -> bool {
    let at = |point: PointId| mesh.positions[point].as_dvec3();
    let (start, along) = (at(from), at(to) - at(from));
    let [a, b] = triangles.map(|triangle| third(mesh, [from, to], triangle) - start);
    a.dot(b) * along.length_squared() > a.dot(along) * b.dot(along)
}

/// The place of the corner of a triangle that one of its edges lacks.
fn third(mesh: &Mesh, [from, to]: [PointId; 2], triangle: usize) -> DVec3 {
    let other = mesh.triangle_points(triangle).into_iter().find(|&p| p != from && p != to);
    mesh.positions[other.expect("three points")].as_dvec3()
}

/// The unit vector into a triangle, at right angles to one of its edges; zero without area.
fn inward(mesh: &Mesh, [from, to]: [PointId; 2], triangle: usize) -> DVec3 {
    let at = |point: PointId| mesh.positions[point].as_dvec3();
    let along = (at(to) - at(from)).normalize_or_zero();
    let across = third(mesh, [from, to], triangle) - at(from);
    (across - along * along.dot(across)).normalize_or_zero()
}

/// Gives the corners of a folded point that are of one set a point, and wedges, of their own; those of the
/// first corner keep what they have.
fn split(
    mesh: &mut Mesh,
    wedge_vertices: &mut Vec<u32>,
    sets: &mut DisjointSets,
    is_folded: &[bool],
) {
    // By the set of corners: its point, and by the wedge that it had the one it has got.
    let mut first_sets = vec![None; mesh.positions.len()];
    let mut points = rustc_hash::FxHashMap::default();
    let mut wedges = rustc_hash::FxHashMap::default();
    for at in 0..mesh.triangles.len() * 3 {
        let wedge = mesh.triangles[at / 3][at % 3];
        let point = mesh.wedge_points[wedge];
        if !is_folded.get(point.index()).copied().unwrap_or(false) {
            continue;
        }
        let set = sets.root(at as u32);
        if *first_sets[point.index()].get_or_insert(set) == set {
            continue;
        }
        let own_point = *points.entry(set).or_insert_with(|| {
            mesh.positions.push(mesh.positions[point]);
            PointId::new(mesh.positions.len() - 1)
        });
        mesh.triangles[at / 3][at % 3] = *wedges.entry((set, wedge)).or_insert_with(|| {
            let row = mesh.row(wedge).to_vec();
            mesh.attributes.extend(row);
            mesh.wedge_points.push(own_point);
            wedge_vertices.push(wedge_vertices[wedge.index()]);
            WedgeId::new(mesh.wedge_points.len() - 1)
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edges::Census;
    use crate::mesh::Layout;
    use crate::vertices::Vertices;
    use crate::weld::weld;
    use glam::Vec3;

    /// A bent sheet of n × n squares, and a flipped copy of it cut along the same or the other diagonals.
    fn doubled(n: u32, other_diagonals: bool) -> Mesh {
        let mut vertices = Vertices {
            layout: Layout { uv_sets: 0, normal: false, color: 0 },
            ..Vertices::default()
        };
        let at = |i: u32| i as f32 / n as f32;
        for row in 0..=n {
            for column in 0..=n {
                let bent = 0.05 * (3.0 * at(column)).sin();
                vertices.positions.push(Vec3::new(at(column), at(row), bent));
            }
        }
        for row in 0..n {
            for column in 0..n {
                let a = row * (n + 1) + column;
                let [b, c, d] = [a + 1, a + n + 2, a + n + 1];
                vertices.triangles.extend([[a, b, c], [a, c, d]]);
                vertices.triangles.extend(if other_diagonals {
                    [[a, d, b], [b, d, c]]
                } else {
                    [[a, c, b], [a, d, c]]
                });
            }
        }
        vertices.groups = vec![0; vertices.triangles.len()];
        weld(&vertices).unwrap().mesh
    }

    #[test]
    fn front_and_back_of_a_sheet_are_two_sheets() {
        for (n, other_diagonals) in [(1, true), (1, false), (6, true), (6, false)] {
            let mesh = doubled(n, other_diagonals);
            mesh.validate().unwrap();
            let census = Census::new(&mesh);
            let found = (census.shells, census.borders, census.complex);
            assert_eq!(found, (2, 8 * n as usize, 0), "{n} {other_diagonals}");
        }
    }

    #[test]
    fn a_blade_and_three_walls_on_an_edge_stay_whole() {
        let blade = [[0, 1, 2], [1, 0, 3], [2, 3, 0], [3, 2, 1]];
        let walls = [[0, 1, 2], [1, 0, 3], [0, 1, 4]];
        for triangles in [&blade[..], &walls[..]] {
            let mut positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(0.5, 1.0, 0.05)];
            positions.extend([Vec3::new(0.5, 1.0, -0.05), Vec3::new(0.5, -1.0, 0.0)]);
            let groups = vec![0; triangles.len()];
            let vertices = Vertices {
                layout: Layout { uv_sets: 0, normal: false, color: 0 },
                positions,
                triangles: triangles.to_vec(),
                groups,
                ..Vertices::default()
            };
            assert_eq!(Census::new(&weld(&vertices).unwrap().mesh).shells, 1);
        }
    }
}
