use std::sync::Arc;

use super::*;
use crate::Mesh;
use crate::settings::Weights;
use crate::space::Space;
use crate::testing::{grid, sphere};
use crate::working_mesh::WorkingMesh;

fn of(mesh: &Mesh) -> Topology {
    Topology::new(mesh.triangles.clone(), mesh.wedge_points.clone(), mesh.positions.len())
}

fn plan(mesh: &Mesh, points: [u32; 2]) -> (Topology, Metric, Plan) {
    let space = Arc::new(Space::new(mesh, Weights::default()));
    let (topology, metric) = (of(mesh), WorkingMesh::new(mesh, &space).metric);
    let mut plan = Plan::new(mesh.positions.len(), mesh.wedge_points.len());
    plan.set(&topology, &metric, &points.map(PointId));
    (topology, metric, plan)
}

#[test]
fn a_flat_collapse_costs_nothing_and_takes_two_triangles() {
    let mesh = grid(3);
    let (mut topology, mut metric, mut plan) = plan(&mesh, [5, 6]);
    let best = plan.cheapest(&metric).unwrap();
    assert!(best.cost < 1e-12);
    assert!(plan.keeps_topology(&topology));
    assert!(plan.keeps_shape(&topology, &metric, best.position));
    plan.apply(&mut topology, &mut metric, best.position);
    assert_eq!(topology.live_count(), 16);
    let uv = metric.row(topology.wedge(topology.corners(PointId(5)).next().unwrap()));
    assert!((uv[0] / metric.row(mesh.triangles.last().unwrap()[1])[0] - 0.5).abs() < 1e-6);
}

#[test]
fn two_border_points_do_not_meet_across_the_surface() {
    let (topology, _, mut plan) = plan(&grid(1), [0, 3]);
    assert!(!plan.keeps_topology(&topology), "the diagonal of a lone square");
}

#[test]
fn a_hole_of_three_edges_closes_and_a_larger_one_does_not() {
    let mut mesh = grid(5);
    let hole = 2 * (2 * 5 + 2);
    mesh.triangles.remove(hole);
    mesh.groups.remove(hole);
    let [a, b, _] = [14, 15, 21];
    assert!(plan(&mesh, [a, b]).2.keeps_topology(&of(&mesh)));
    mesh.triangles.remove(hole);
    mesh.groups.remove(hole);
    assert!(plan(&mesh, [a, b]).2.keeps_topology(&of(&mesh)), "four edges to three");
    assert!(plan(&mesh, [a, 21]).2.is_void(), "no edge across the hole");
}

#[test]
fn a_placement_beyond_the_neighbors_turns_a_triangle() {
    let mesh = grid(3);
    let (topology, metric, mut plan) = plan(&mesh, [5, 6]);
    let far = DVec3::new(-5.0, 0.0, 0.0);
    assert!(!plan.keeps_shape(&topology, &metric, far));
}

#[test]
fn both_sides_of_a_seam_keep_their_own_uv() {
    let mesh = sphere(8);
    let seam: Vec<u32> = (0..mesh.positions.len() as u32)
        .filter(|&p| mesh.wedge_points.iter().filter(|w| w.0 == p).count() == 2)
        .collect();
    let (mut topology, mut metric, mut plan) = plan(&mesh, [seam[2], seam[3]]);
    assert!(plan.keeps_topology(&topology));
    let best = plan.cheapest(&metric).unwrap();
    plan.apply(&mut topology, &mut metric, best.position);
    let mut us: Vec<f32> = topology
        .corners(PointId(seam[2]))
        .map(|corner| {
            let mut row = Vec::new();
            metric.unscaled_row(topology.wedge(corner), 0, &mut row);
            row[0]
        })
        .collect();
    us.sort_by(f32::total_cmp);
    assert!(us[0].abs() < 0.01 && (us[us.len() - 1] - 1.0).abs() < 0.01, "{us:?}");
}
