//! The first keys of edges in the queue, and the keys that one descent passes on to the next.
//!
//! Until they are summed anew, quadrics only grow, so a cost by them is a lower bound of all later
//! costs of the edge; exposure, and the extra cost where the cheapest placement was illegal, can
//! shrink again, but rarely do. Triangles carry these bounds from one descent to the next, where
//! they are the first keys; a bound is computed only for an edge that has none yet.

use rayon::prelude::*;

use crate::collapse::Plan;
use crate::id::{EdgeId, PointId};
use crate::item::Item;
use crate::metric::Metric;
use crate::queue::Queue;
use crate::topology::Topology;

/// The least number of edges that are worth a thread.
const AT_ONCE: usize = 1 << 12;

/// The bounds of edges, from those that triangles carry.
pub(crate) fn edge_bounds(topology: &Topology, triangles: &[[f32; 3]]) -> Vec<f32> {
    let mut bounds = vec![0.0f32; topology.edge_count()];
    for (edges, of_edges) in topology.triangle_edges().iter().zip(triangles) {
        for (&edge, &bound) in edges.iter().zip(of_edges) {
            bounds[edge] = bounds[edge].max(bound);
        }
    }
    bounds
}

/// The bounds that triangles carry on: the keys of the edges that are still queued, and the former
/// bounds of those that are not.
pub(crate) fn triangle_bounds(
    topology: &Topology,
    mut bounds: Vec<f32>,
    waiting: impl Iterator<Item = (f64, u32)>,
) -> Vec<[f32; 3]> {
    for (cost, packed) in waiting {
        if let Item::Edge(edge) = Item::unpack(packed) {
            bounds[edge] = cost as f32;
        }
    }
    topology.triangle_edges().iter().map(|edges| edges.map(|edge| bounds[edge])).collect()
}

/// Queues every edge that is free to move, in parallel; the order of the queue does not depend on
/// it.
pub(crate) fn rank_all(
    topology: &Topology,
    metric: &Metric,
    bounds: &[f32],
    locked: &[bool],
) -> Queue {
    let is_free = |ends: &[PointId; 2]| !ends.iter().any(|p| locked.get(p.index()) == Some(&true));
    let costs: Vec<Option<f64>> = bounds
        .par_iter()
        .enumerate()
        .with_min_len(AT_ONCE)
        .map_init(
            // Next to no edge needs its marks, whose room would have to be cleared each time.
            || Plan::new(0, 0),
            |plan, (edge, &bound)| {
                let ends = topology.ends(EdgeId::new(edge)).filter(is_free)?;
                let lower_bound = |plan: &mut Plan| plan.cost_lower_bound(topology, metric, ends);
                Some(if bound > 0.0 { f64::from(bound) } else { lower_bound(plan) })
            },
        )
        .collect();
    let items = costs.into_iter().enumerate();
    Queue::new(items.filter_map(|(edge, cost)| Some((cost?, Item::Edge(EdgeId::new(edge)).pack()))))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::AtomicUsize;

    use super::*;
    use crate::settings::Weights;
    use crate::simplify::Descent;
    use crate::space::Space;
    use crate::testing::sphere;
    use crate::working_mesh::WorkingMesh;

    #[test]
    fn what_a_descent_hands_on_is_at_most_what_an_edge_costs() {
        let mesh = sphere(24);
        let space = Arc::new(Space::new(&mesh, Weights::default()));
        let mut descent =
            Descent::new(&mesh, WorkingMesh::new(&mesh, &space), Vec::new(), f64::INFINITY);
        descent.descend(mesh.triangles.len() / 2, 1.0, &AtomicUsize::new(0));
        let working = descent.into_working_mesh().compact();
        let (points, wedges) = (working.point_sources.len(), working.wedge_sources.len());
        let topology =
            Topology::new(working.triangles.clone(), working.wedge_points.clone(), points);
        let bounds = edge_bounds(&topology, &working.bounds);
        let (mut plan, mut above, mut same) = (Plan::new(points, wedges), 0, 0);
        for (edge, &bound) in bounds.iter().enumerate() {
            let ends = topology.ends(EdgeId::new(edge)).expect("an edge");
            plan.set(&topology, &working.metric, &ends);
            let cheapest = plan.cheapest(&working.metric).expect("a place").cost as f32;
            assert!(bound > 0.0 && bound < 2.0 * cheapest, "{bound} of {cheapest}");
            above += usize::from(bound > 1.001 * cheapest);
            same += usize::from((0.999..=1.001).contains(&(bound / cheapest)));
        }
        let all = bounds.len();
        assert!(above * 20 < all, "{above} of {all} cost less than they did");
        assert!(same * 10 > all, "{same} of {all} cost what they did");
    }
}
