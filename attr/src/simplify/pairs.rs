//! Points of two shells that may meet though no edge joins them (the virtual edges of Garland &
//! Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997, §3).
//!
//! Every point is paired with the nearest few of other shells within a distance, found by a grid of cells
//! of that size; of its own shell too if that is asked for, but for those over whose common neighbor the surface
//! would be pinched. A pair is queued like an edge and costs what its quadrics say. Where borders meet, their
//! edges become one, so that a crack closes point by point; closed shells come to touch.

use glam::{DVec3, IVec3};
use rustc_hash::FxHashMap;

use super::{Descent, Stop};
use crate::id::{EdgeId, PointId};
use crate::item::Item;
use crate::marks::Marks;
use crate::settings::Cost;
use crate::topology::Topology;

/// A point is paired with so many others at most.
const MAX_PAIRS_PER_POINT: usize = 4;

/// Pairs of points, and the points that they have merged into.
#[derive(Default)]
pub(super) struct Pairs {
    pairs: Vec<[PointId; 2]>,
    /// Per point: the one that it has merged into, or itself. Empty if there are no pairs.
    merged_into: Vec<PointId>,
}

impl Pairs {
    /// Pairs points that are not `locked` over less than `distance`.
    fn find(
        topology: &Topology,
        positions: &[DVec3],
        (distance, own_shell): (f64, bool),
        is_locked: impl Fn(PointId) -> bool,
    ) -> Self {
        let mut near_by_edges = NearByEdges::new(positions.len());
        let shells = shells(topology, positions.len());
        let points = (0..positions.len()).map(PointId::new);
        let free: Vec<PointId> = points.filter(|&point| !is_locked(point)).collect();
        let mut cells: FxHashMap<IVec3, FxHashMap<PointId, Vec<PointId>>> = FxHashMap::default();
        let cell = |point: PointId| (positions[point] / distance).floor().as_ivec3();
        for &point in &free {
            cells.entry(cell(point)).or_default().entry(shells[point]).or_default().push(point);
        }
        let mut pairs = Vec::new();
        for &point in &free {
            near_by_edges.find(topology, point, own_shell);
            let may_meet = |shell: PointId, other: PointId| {
                shell != shells[point] || own_shell && !near_by_edges.has(other)
            };
            let away = |other: PointId| positions[other].distance_squared(positions[point]);
            let mut near: Vec<(f64, PointId)> = around(cell(point))
                .filter_map(|cell| cells.get(&cell))
                .flat_map(|shells_there| shells_there.iter())
                .filter(|(shell, _)| own_shell || **shell != shells[point])
                .flat_map(|(&shell, others)| others.iter().map(move |&other| (shell, other)))
                .filter(|&(shell, other)| may_meet(shell, other))
                .map(|(_, other)| (away(other), other))
                .filter(|(away, _)| *away < distance * distance)
                .collect();
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let lesser_first = |(_, other): &(f64, PointId)| [point.min(*other), point.max(*other)];
            pairs.extend(near.iter().take(MAX_PAIRS_PER_POINT).map(lesser_first));
        }
        pairs.sort_unstable();
        pairs.dedup();
        let count = if pairs.is_empty() { 0 } else { positions.len() };
        Self { pairs, merged_into: (0..count).map(PointId::new).collect() }
    }

    /// The points that a pair has merged into; `None` if that is one point.
    fn ends(&mut self, pair: usize) -> Option<[PointId; 2]> {
        let [a, b] = self.pairs[pair].map(|point| root(&mut self.merged_into, point));
        (a != b).then(|| [a.min(b), a.max(b)])
    }

    /// Notes that the second point has merged into the first.
    pub(super) fn merge(&mut self, [kept, gone]: [PointId; 2]) {
        if let Some(into) = self.merged_into.get_mut(gone.index()) {
            *into = kept;
        }
    }
}

/// The points that a point has an edge to, and those beyond an inner edge: to merge with these would pinch the
/// surface.
struct NearByEdges {
    counts: [Marks; 2],
    near: [Vec<PointId>; 2],
    found: Marks,
}

impl NearByEdges {
    fn new(points: usize) -> Self {
        let marks = || Marks::new(points);
        Self { counts: [marks(), marks()], near: Default::default(), found: marks() }
    }

    /// Finds those of a point, if they are asked for at all.
    fn find(&mut self, topology: &Topology, point: PointId, is_asked: bool) {
        self.found.clear();
        if !is_asked {
            return;
        }
        self.found.set(point.index(), 1);
        let Self { counts: [own_counts, counts], near: [own, near], found } = self;
        topology.neighbors(point, own_counts, own);
        for &neighbor in own.iter() {
            found.set(neighbor.index(), 1);
            topology.neighbors(neighbor, counts, near);
            let is_border = |other: PointId| counts.get(other.index()) == Some(1);
            let pinched = near.iter().filter(|other| !(is_border(point) && is_border(**other)));
            pinched.for_each(|other| found.set(other.index(), 1));
        }
    }

    fn has(&self, point: PointId) -> bool {
        self.found.get(point.index()).is_some()
    }
}

impl Descent<'_> {
    /// Finds and queues the pairs of points that may meet, if any may.
    pub(crate) fn find_pairs(&mut self) {
        let distance = self.metric.space.join_distance;
        if distance > 0.0 {
            let is_locked = |point| self.is_locked(point);
            let reach = (distance, self.metric.space.join_own_shell);
            self.pairs = Pairs::find(&self.topology, &self.metric.positions, reach, is_locked);
            self.queue_pairs();
        }
    }

    /// Queues all pairs with key 0: their costs are computed on pop.
    pub(super) fn queue_pairs(&mut self) {
        let pairs = 0..self.pairs.pairs.len() as u32;
        pairs.for_each(|pair| self.queue.push(0.0, Item::Pair(pair).pack()));
    }

    /// Merges a pair, or queues it again if another item may be cheaper.
    pub(super) fn join(&mut self, pair: u32, queue_slack: f64) -> Result<usize, Stop> {
        let item = Item::Pair(pair);
        let Some(points) = self.pairs.ends(pair as usize) else { return Ok(0) };
        let is_gone = |point: &PointId| self.topology.corners(*point).next().is_none();
        if points.iter().any(is_gone) {
            return Ok(0);
        }
        self.plan.set(&self.topology, &self.metric, &points);
        // Points that have got an edge by now are queued as that.
        if !self.plan.is_void() {
            return Ok(0);
        }
        let mut lower_bound = 0.0;
        if self.metric.space.cost == Cost::EdgeLength {
            lower_bound = self.plan.cost_lower_bound(&self.topology, &self.metric, points);
            if self.must_wait(item, lower_bound, queue_slack) {
                return Ok(0);
            }
        }
        self.merge(item, Some(lower_bound), points, queue_slack)
    }
}

/// The cells around one, itself among them.
fn around(cell: IVec3) -> impl Iterator<Item = IVec3> {
    (0..27).map(move |at| cell + IVec3::new(at % 3 - 1, at / 3 % 3 - 1, at / 9 - 1))
}

/// Per point: the least point of its shell.
fn shells(topology: &Topology, points: usize) -> Vec<PointId> {
    let mut parents: Vec<PointId> = (0..points).map(PointId::new).collect();
    for edge in (0..topology.edge_count()).map(EdgeId::new) {
        if let Some(ends) = topology.ends(edge) {
            let [a, b] = ends.map(|point| root(&mut parents, point));
            parents[a.max(b)] = a.min(b);
        }
    }
    (0..points).map(|point| root(&mut parents, PointId::new(point))).collect()
}

/// The representative of a point, with the path to it halved.
pub(super) fn root(parents: &mut [PointId], mut point: PointId) -> PointId {
    while parents[point] != point {
        parents[point] = parents[parents[point]];
        point = parents[point];
    }
    point
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;
    use crate::chain::simplify_chain;
    use crate::edges::Census;
    use crate::id::WedgeId;
    use crate::mesh::Mesh;
    use crate::options::Options;
    use crate::settings::Settings;
    use crate::testing::surface;
    use glam::Vec3;

    /// Two sheets side by side, a crack of `gap` between them.
    fn cracked(n: usize, gap: f32) -> Mesh {
        let bumps = |x, y: f32| Vec3::new(x, y, 0.1 * (9.0 * x).cos() * (7.0 * y).cos());
        let (mut mesh, right) = (surface(n, bumps), surface(n, |x, y| bumps(1.0 - x, y)));
        let (points, wedges) = (mesh.positions.len() as u32, mesh.wedge_points.len() as u32);
        let mirrored = |p: &Vec3| Vec3::new(2.0 + gap - p.x, p.y, p.z);
        mesh.positions.extend(right.positions.iter().map(mirrored));
        mesh.wedge_points.extend(right.wedge_points.iter().map(|p| PointId(p.0 + points)));
        mesh.attributes.extend(&right.attributes);
        mesh.triangles.extend(right.triangles.iter().map(|t| t.map(|w| WedgeId(w.0 + wedges))));
        mesh.groups.extend(&right.groups);
        mesh
    }

    #[test]
    fn points_of_two_shells_are_paired_with_the_nearest_within_the_distance() {
        let mesh = cracked(4, 0.01);
        let topology =
            Topology::new(mesh.triangles.clone(), mesh.wedge_points.clone(), mesh.positions.len());
        let positions: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
        let pairs = Pairs::find(&topology, &positions, (0.02, false), |_| false).pairs;
        assert_eq!(pairs.len(), 5);
        for [a, b] in pairs {
            assert!((positions[a].distance(positions[b]) - 0.01).abs() < 1e-6);
        }
        let locked = Pairs::find(&topology, &positions, (0.02, false), |point| point.0 < 25);
        assert!(locked.pairs.is_empty() && locked.merged_into.is_empty());
    }

    #[test]
    fn a_slit_in_one_shell_closes_if_that_is_asked_for() {
        let (n, mut mesh) = (16, cracked(16, 0.002));
        let points = (mesh.positions.len() / 2) as u32;
        // The sheets hang together above the middle.
        for point in &mut mesh.wedge_points {
            let (row, column) = (point.0 % points / (n + 1), point.0 % points % (n + 1));
            if column == n && row > n / 2 {
                point.0 %= points;
            }
        }
        let census = |join_own_shell| {
            let settings =
                Settings { join_distance: Some(0.02), join_own_shell, ..Settings::default() };
            let target = mesh.triangles.len() / 4;
            let levels = simplify_chain(&mesh, &[target], &settings.into(), &AtomicUsize::new(0));
            Census::new(&levels.unwrap()[0].mesh)
        };
        let (open, closed) = (census(false), census(true));
        assert_eq!((open.shells, closed.shells, closed.complex), (1, 1, 0));
        assert!(closed.borders < open.borders, "{closed:?} {open:?}");
    }

    #[test]
    fn a_crack_closes_within_the_distance_and_not_beyond() {
        let mesh = cracked(16, 0.01);
        let level = |join_distance| {
            let options: Options<'_> = Settings { join_distance, ..Settings::default() }.into();
            let target = mesh.triangles.len() / 16;
            simplify_chain(&mesh, &[target], &options, &AtomicUsize::new(0)).unwrap().remove(0)
        };
        let census = |join_distance| {
            let level = level(join_distance);
            level.mesh.validate().unwrap();
            Census::new(&level.mesh)
        };
        for join_distance in [None, Some(0.005)] {
            assert_eq!(census(join_distance).shells, 2);
        }
        let joined = census(Some(0.02));
        assert_eq!((joined.shells, joined.complex), (1, 0));
        assert!(joined.borders < census(None).borders);
    }
}
