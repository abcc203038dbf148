//! The kinds of edges where triangles meet, and how many there are of each.

use crate::buckets::Buckets;
use crate::id::{CornerId, PointId, WedgeId};
use crate::mesh::Mesh;
use crate::sets::DisjointSets;

/// The kind of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EdgeKind {
    /// Two triangles that share both wedges.
    Inner,
    /// Two triangles whose wedges differ in their normals alone.
    Crease,
    /// Two triangles whose wedges differ in UV, color or group.
    Seam,
    /// One triangle.
    Border,
    /// More than two triangles.
    Complex,
}

/// One triangle at an edge: the edge's points, the lesser first, and the triangle.
pub(crate) type Side = ([PointId; 2], usize);

/// Visits every edge with its sides, in the order of its points.
pub(crate) fn visit_edges(mesh: &Mesh, mut visit: impl FnMut(EdgeKind, &[Side])) {
    let points: Vec<[PointId; 3]> =
        (0..mesh.triangles.len()).map(|triangle| mesh.triangle_points(triangle)).collect();
    visit_sides(&points, mesh.positions.len(), |sides| {
        let kind = match sides {
            [_] => EdgeKind::Border,
            [a, b] => meeting(mesh, a, b),
            _ => EdgeKind::Complex,
        };
        visit(kind, sides);
    });
}

/// Visits the sides of every edge of triangles over so many points, in the order of its points.
pub(crate) fn visit_sides(
    triangles: &[[PointId; 3]],
    points: usize,
    mut visit: impl FnMut(&[Side]),
) {
    let side = |corner: CornerId| {
        let (points, slot) = (triangles[corner.triangle().index()], corner.slot());
        let (from, to) = (points[slot], points[(slot + 1) % 3]);
        ([from.min(to), from.max(to)], corner.triangle().index())
    };
    let corners = (0..triangles.len() * 3).map(CornerId::new);
    let by_lesser = Buckets::new(corners.map(|corner| side(corner).0[0].0), points);
    let mut sides: Vec<Side> = Vec::new();
    for point in 0..points {
        sides.clear();
        sides.extend(by_lesser.of(point).iter().map(|&corner| side(CornerId(corner))));
        sides.sort_unstable();
        sides.chunk_by(|a, b| a.0 == b.0).for_each(&mut visit);
    }
}

/// The edges of one triangle alone, each from point to point as its triangle runs along it.
pub fn border_edges(mesh: &Mesh) -> Vec<[PointId; 2]> {
    let mut borders = Vec::new();
    visit_edges(mesh, |kind, sides| {
        if let (EdgeKind::Border, &[([lesser, greater], triangle)]) = (kind, sides) {
            let own = mesh.triangle_points(triangle);
            let runs_up = (0..3).any(|slot| [own[slot], own[(slot + 1) % 3]] == [lesser, greater]);
            borders.push(if runs_up { [lesser, greater] } else { [greater, lesser] });
        }
    });
    borders
}

/// The kind of the edge between two triangles.
fn meeting(mesh: &Mesh, a: &Side, b: &Side) -> EdgeKind {
    let (own, other) = (wedges_at(mesh, a), wedges_at(mesh, b));
    if own == other {
        return EdgeKind::Inner;
    }
    let layout = mesh.layout;
    let without_normal = |wedge: WedgeId| {
        let row = mesh.row(wedge);
        row[..layout.normal()].iter().chain(&row[layout.color()..]).map(|x| x.to_bits())
    };
    let differ = |slot: usize| !without_normal(own[slot]).eq(without_normal(other[slot]));
    if mesh.groups[a.1] != mesh.groups[b.1] || differ(0) || differ(1) {
        EdgeKind::Seam
    } else {
        EdgeKind::Crease
    }
}

/// The wedges of a triangle at the ends of one of its edges.
fn wedges_at(mesh: &Mesh, &(points, triangle): &Side) -> [WedgeId; 2] {
    let own = mesh.triangle_points(triangle);
    points.map(|point| {
        let slot = own.iter().position(|&p| p == point).expect("an edge's point is its triangle's");
        mesh.triangles[triangle][slot]
    })
}

/// Counts of edges, points, charts and shells, as they limit a simplifier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Census {
    /// Edges whose two triangles differ in UV, color or group.
    pub seams: usize,
    /// Edges whose two triangles differ in their normals alone.
    pub creases: usize,
    /// Edges of one triangle.
    pub borders: usize,
    /// Edges of more than two triangles.
    pub complex: usize,
    /// Points with three wedges or more.
    pub junctions: usize,
    /// Charts: sets of triangles joined by edges that are no seams.
    pub charts: usize,
    /// Shells: sets of triangles joined by edges of any kind.
    pub shells: usize,
}

impl Census {
    /// Counts a mesh.
    pub fn new(mesh: &Mesh) -> Self {
        let mut census = Self::default();
        let triangles = mesh.triangles.len();
        let (mut charts, mut shells) = (DisjointSets::new(triangles), DisjointSets::new(triangles));
        (census.charts, census.shells) = (triangles, triangles);
        visit_edges(mesh, |kind, sides| {
            match kind {
                EdgeKind::Inner => {}
                EdgeKind::Crease => census.creases += 1,
                EdgeKind::Seam => census.seams += 1,
                EdgeKind::Border => census.borders += 1,
                EdgeKind::Complex => census.complex += 1,
            }
            for pair in sides.windows(2) {
                let [a, b] = [pair[0].1 as u32, pair[1].1 as u32];
                census.shells -= usize::from(shells.join(a, b));
                if matches!(kind, EdgeKind::Inner | EdgeKind::Crease) {
                    census.charts -= usize::from(charts.join(a, b));
                }
            }
        });
        let mut wedges = vec![0u32; mesh.positions.len()];
        for &point in &mesh.wedge_points {
            wedges[point] += 1;
        }
        census.junctions = wedges.iter().filter(|&&count| count >= 3).count();
        census
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{grid, sphere};

    #[test]
    fn a_grid_has_borders_and_one_chart() {
        let expected = Census { borders: 12, charts: 1, shells: 1, ..Census::default() };
        assert_eq!(Census::new(&grid(3)), expected);
    }

    #[test]
    fn a_sphere_has_one_seam_from_pole_to_pole() {
        let census = Census::new(&sphere(8));
        assert_eq!((census.borders, census.complex, census.shells, census.charts), (0, 0, 1, 1));
        // The caps' triangles each have a wedge of their own at the pole, so the edges to it are
        // seams too, but for the first and last, which are already counted.
        assert_eq!((census.seams, census.junctions), (8 + 2 * 15, 2));
    }

    #[test]
    fn a_material_boundary_is_a_seam_and_parts_charts_but_not_shells() {
        let mut mesh = grid(1);
        // The second triangle gets wedges of its own.
        let wedges = mesh.triangles[1].map(|wedge| {
            let (point, row) = (mesh.wedge_points[wedge], mesh.row(wedge).to_vec());
            mesh.wedge_points.push(point);
            mesh.attributes.extend(row);
            WedgeId::new(mesh.wedge_points.len() - 1)
        });
        mesh.triangles[1] = wedges;
        mesh.groups[1] = 1;
        let census = Census::new(&mesh);
        assert_eq!((census.seams, census.charts, census.shells), (1, 2, 1));
    }
}
