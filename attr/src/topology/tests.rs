use super::*;
use crate::mesh::Mesh;
use crate::testing::grid;

fn of(mesh: &Mesh) -> Topology {
    Topology::new(mesh.triangles.clone(), mesh.wedge_points.clone(), mesh.positions.len())
}

fn neighbors(topology: &Topology, point: u32) -> Vec<u32> {
    let (mut counts, mut out) = (Marks::new(16), Vec::new());
    topology.neighbors(PointId(point), &mut counts, &mut out);
    let mut found: Vec<u32> = out.iter().map(|p| p.0).collect();
    found.sort_unstable();
    found
}

#[test]
fn a_grid_point_sees_its_six_neighbors_and_a_corner_its_two_or_three() {
    let topology = of(&grid(3));
    assert_eq!(neighbors(&topology, 5), [0, 1, 4, 6, 9, 10]);
    assert_eq!(neighbors(&topology, 3), [2, 7]);
}

#[test]
fn only_the_rim_is_outline() {
    let topology = of(&grid(3));
    let (mut counts, mut out) = (Marks::new(16), Vec::new());
    for point in 0..16 {
        topology.neighbors(PointId(point), &mut counts, &mut out);
        let inner = matches!(point, 5 | 6 | 9 | 10);
        assert_eq!(on_outline(&counts, &out), !inner, "point {point}");
    }
}

#[test]
fn removing_and_merging_keep_the_lists_true() {
    let mut topology = of(&grid(3));
    let shared: Vec<_> = topology
        .corners(PointId(5))
        .map(CornerId::triangle)
        .filter(|&t| topology.slot_of(t, PointId(6)).is_some())
        .collect();
    assert_eq!(shared.len(), 2);
    for triangle in shared {
        topology.remove(triangle);
    }
    topology.merge(PointId(5), PointId(6), &mut Marks::new(16));
    assert_eq!(topology.live_count(), 16);
    assert_eq!(neighbors(&topology, 5), [0, 1, 2, 4, 7, 9, 10, 11]);
    assert_eq!(topology.corners(PointId(6)).count(), 0);
}

#[test]
fn edges_keep_their_ids_while_their_ends_move() {
    let mut topology = of(&grid(3));
    assert_eq!(topology.edge_count(), 2 * 3 * 4 + 9);
    let id = |topology: &Topology, ends: [u32; 2]| {
        let edge = |&edge: &EdgeId| topology.ends(edge) == Some(ends.map(PointId));
        (0..33).map(EdgeId).find(edge)
    };
    let (collapsing, left, right, far) = (
        id(&topology, [5, 6]).unwrap(),
        id(&topology, [5, 10]).unwrap(),
        id(&topology, [6, 10]).unwrap(),
        id(&topology, [6, 7]).unwrap(),
    );
    for triangle in (0..18).map(TriangleId) {
        let has = |point| topology.slot_of(triangle, PointId(point)).is_some();
        if has(5) && has(6) {
            topology.remove(triangle);
        }
    }
    topology.merge(PointId(5), PointId(6), &mut Marks::new(16));
    assert_eq!(id(&topology, [5, 10]), Some(left), "the kept point's edge stays");
    assert_eq!((topology.ends(right), id(&topology, [5, 7])), (None, Some(far)));
    assert!(topology.edges(PointId(5)).all(|edge| edge != right && edge != collapsing));
    let mut own: Vec<EdgeId> = topology.edges(PointId(5)).collect();
    own.sort_unstable();
    own.dedup();
    assert_eq!(own.len(), 8);
}
