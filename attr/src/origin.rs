//! The place of a level on its source: for each wedge of the level three wedges of the source and
//! their shares, by which anything that the metric does not see can be blended.
//!
//! A point's foot is the nearest point of the source on the part of the surface that it came from.
//! Nearest alone will not do: a lip of a closed mouth is nearest to the other lip as well, and moves
//! with it no more once the mouth opens. So the search floods the triangles from the source point that
//! the point stands for, across edges that lie no farther from the point than that one does. What it
//! finds is the nearest point of all that is connected within this ball.
//!
//! Guarantees: all wedges at a point whose groups are of one kind have the same foot, so that
//! whatever is the same for all wedges at a source point is the same for them too; a point that lies
//! where its source point does has that for its foot, alone; the same at any thread count. Not
//! guaranteed: the nearest point where the ball holds more than [`MAX_VISITED_TRIANGLES`] triangles.
//!
//! Lab note: levels of a head of 8,778 triangles at 50, 25, 12.5 and 6.25 % look at 7, 9, 13 and 21
//! triangles a point, 318 at most. A flood through points instead of edges looks at two to four times as
//! many, and at the corners of the mouth finds the other lip: morph targets of the first level are then
//! off by up to 0.91 % of the diagonal, else by 0.64 %. To ask for the same side as well gains nothing.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::buckets::Buckets;
use crate::chain::Level;
use crate::id::{PointId, TriangleId, WedgeId};
use crate::mesh::Mesh;
use crate::triangle::closest_on_triangle;

/// Most triangles that are looked at for one point, so that no mesh makes it slow: thousands of
/// slivers may all pass through one ball.
const MAX_VISITED_TRIANGLES: usize = 4096;
/// Smaller shares are none: a point that no collapse moved may still be off by a rounding.
const LEAST_SHARE: f64 = 1e-6;
/// Points that one thread looks up at least.
const AT_ONCE: usize = 256;

/// The place of a wedge of a level on the source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// One at each corner of a triangle of the source. Of several wedges at a corner it is the one
    /// most like the level's.
    pub wedges: [WedgeId; 3],
    /// One per entry of `wedges`, at least 0, sum 1.
    pub barycentrics: DVec3,
}

/// Finds the origin of each wedge of `level`, which was made from `source`.
///
/// `kinds`: one per group of the source. Groups of one kind may stand in for each other: a wedge's
/// origin may lie on another group of its kind, where that is nearest.
///
/// # Panics
/// If a group has no kind, or the level was made from another mesh.
pub fn find_origins(source: &Mesh, level: &Level, kinds: &[u32]) -> Vec<Origin> {
    let finder = OriginFinder::new(source, level, kinds);
    let wedges = (0..level.mesh.wedge_points.len()).map(WedgeId::new);
    let mut asked: Vec<(Key, WedgeId)> = wedges.clone().map(|w| (finder.key(w), w)).collect();
    asked.sort_unstable();
    asked.dedup_by_key(|(key, _)| *key);
    let feet: Vec<Origin> = asked
        .par_iter()
        .with_min_len(AT_ONCE)
        .map_init(Search::default, |search, &(_, wedge)| finder.foot(wedge, search))
        .collect();
    let foot = |wedge| &feet[asked.partition_point(|(key, _)| *key < finder.key(wedge))];
    wedges.map(|wedge| finder.origin(wedge, foot(wedge))).collect()
}

/// A point of a level and the kind of the groups that meet there: one foot each.
type Key = (PointId, u32);

/// Finds places on the source.
pub(crate) struct OriginFinder<'a> {
    source: &'a Mesh,
    level: &'a Level,
    kinds: &'a [u32],
    /// Corners of the source by their points.
    corners: Buckets,
    /// Wedges of the source by their points.
    wedges: Buckets,
    /// One per wedge of the source: its group.
    groups: Vec<u32>,
}

/// A flood's state, kept for the next.
#[derive(Default)]
pub(crate) struct Search {
    kind: u32,
    seen: FxHashSet<u32>,
    /// The triangles to look at and those that were.
    queue: Vec<u32>,
}

/// Squared distance from `p` to an edge.
fn square_to_edge(p: DVec3, ends: [Vec3; 2]) -> f64 {
    let [a, b] = ends.map(Vec3::as_dvec3);
    let (edge, to) = (b - a, p - a);
    let along = (to.dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
    to.distance_squared(edge * along)
}

impl<'a> OriginFinder<'a> {
    pub(crate) fn new(source: &'a Mesh, level: &'a Level, kinds: &'a [u32]) -> Self {
        let points = source.positions.len();
        let mut groups = vec![0; source.wedge_points.len()];
        for (wedges, &group) in source.triangles.iter().zip(&source.groups) {
            wedges.iter().for_each(|&wedge| groups[wedge] = group);
        }
        let at_corners = source.triangles.iter().flatten().map(|&w| source.wedge_points[w].0);
        let corners = Buckets::new(at_corners, points);
        let wedges = Buckets::new(source.wedge_points.iter().map(|p| p.0), points);
        Self { source, level, kinds, corners, wedges, groups }
    }

    /// The kind of a wedge of the source.
    fn kind(&self, wedge: WedgeId) -> u32 {
        self.kinds[self.groups[wedge] as usize]
    }

    fn key(&self, wedge: WedgeId) -> Key {
        (self.level.mesh.wedge_points[wedge], self.kind(self.level.wedge_sources[wedge]))
    }

    /// The foot of the point of a level's wedge. `search` is room to work in.
    fn foot(&self, wedge: WedgeId, search: &mut Search) -> Origin {
        let (point, kind) = self.key(wedge);
        let own = self.level.wedge_sources[wedge];
        search.kind = kind;
        // Where shells were joined, a point may stand for one of another kind.
        [self.level.point_sources[point], self.source.wedge_points[own]]
            .into_iter()
            .find_map(|start| {
                self.flood(self.level.mesh.positions[point].as_dvec3(), start, search)
            })
            .unwrap_or(Origin { wedges: [own; 3], barycentrics: DVec3::X })
    }

    /// The foot of a place near a wedge of the level, connected with what that stands for.
    pub(crate) fn foot_of_place(
        &self,
        place: DVec3,
        wedge: WedgeId,
        search: &mut Search,
    ) -> Origin {
        let (point, kind) = self.key(wedge);
        search.kind = kind;
        let foot = self.flood(place, self.level.point_sources[point], search);
        foot.unwrap_or_else(|| self.foot(wedge, search))
    }

    /// The place nearest to `p` that is connected with `start` within the ball through
    /// it, over triangles of one kind. None if there are none at `start`.
    fn flood(&self, p: DVec3, start: PointId, search: &mut Search) -> Option<Origin> {
        let source = self.source;
        let reach = p.distance_squared(source.positions[start].as_dvec3());
        search.seen.clear();
        search.queue.clear();
        self.spread([start; 2], search);
        let mut best: Option<((f64, TriangleId), DVec3)> = None;
        let mut at = 0;
        while at < search.queue.len() {
            let triangle = TriangleId(search.queue[at]);
            let corners = source.triangle_positions(triangle.index());
            let (weights, _, square) = closest_on_triangle(p, &corners);
            if best.is_none_or(|best| (square, triangle) < best.0) {
                best = Some(((square, triangle), weights));
            }
            let points = source.triangle_points(triangle.index());
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                if reach > 0.0 && square_to_edge(p, [corners[from], corners[to]]) <= reach {
                    self.spread([points[from], points[to]], search);
                }
            }
            at += 1;
        }
        let ((_, triangle), weights) = best?;
        let kept = weights.map(|weight| if weight < LEAST_SHARE { 0.0 } else { weight });
        let barycentrics = kept / kept.element_sum();
        Some(Origin { wedges: source.triangles[triangle], barycentrics })
    }

    /// Queues the triangles at both of two points that were not seen yet.
    fn spread(&self, [a, b]: [PointId; 2], search: &mut Search) {
        let [few, more] = [self.corners.of(a.index()), self.corners.of(b.index())];
        let (corners, other) = if few.len() <= more.len() { (few, b) } else { (more, a) };
        for triangle in corners.iter().map(|corner| corner / 3) {
            if search.queue.len() == MAX_VISITED_TRIANGLES {
                return;
            }
            let kind = self.kinds[self.source.groups[triangle as usize] as usize];
            let is_there = self.source.triangle_points(triangle as usize).contains(&other);
            if is_there && kind == search.kind && search.seen.insert(triangle) {
                search.queue.push(triangle);
            }
        }
    }

    /// The origin of a level's wedge, whose point has `foot`.
    fn origin(&self, wedge: WedgeId, foot: &Origin) -> Origin {
        Origin { wedges: foot.wedges.map(|there| self.like(wedge, there)), ..*foot }
    }

    /// The wedge of the source at the point of `there` that is most like a level's wedge: its own
    /// source, else one of its group, of the nearest row.
    fn like(&self, wedge: WedgeId, there: WedgeId) -> WedgeId {
        let own = self.level.wedge_sources[wedge];
        let point = self.source.wedge_points[there];
        if self.source.wedge_points[own] == point {
            return own;
        }
        let unlike = |other: WedgeId| {
            let rows = self.level.mesh.row(wedge).iter().zip(self.source.row(other));
            let off: f64 = rows.map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2)).sum();
            (self.groups[other] != self.groups[own], off)
        };
        let others = self.wedges.of(point.index()).iter().map(|&other| WedgeId(other));
        others
            .filter(|&other| self.kind(other) == self.kind(own))
            .fold(there, |best, other| if unlike(other) < unlike(best) { other } else { best })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicUsize;

    use super::*;
    use crate::chain::{polish_chain, simplify_chain};
    use crate::options::Options;
    use crate::polish::Polish;
    use crate::surface::Surface;
    use crate::testing::{sphere, surface};

    fn level(source: &Mesh, triangles: usize) -> Level {
        let (options, done) = (Options::default(), AtomicUsize::new(0));
        let mut levels = simplify_chain(source, &[triangles], &options, &done).unwrap();
        polish_chain(source, &mut levels, &options, &Polish::default(), &done).unwrap();
        levels.remove(0)
    }

    fn place(source: &Mesh, origin: &Origin) -> DVec3 {
        let corners = origin.wedges.map(|w| source.positions[source.wedge_points[w]].as_dvec3());
        (0..3).map(|k| corners[k] * origin.barycentrics[k]).sum()
    }

    #[test]
    fn what_no_collapse_moved_comes_from_itself_alone() {
        let source = sphere(12);
        let level = level(&source, source.triangles.len());
        for (wedge, origin) in find_origins(&source, &level, &[0]).iter().enumerate() {
            let slot = (0..3).find(|&k| origin.barycentrics[k] == 1.0).expect("one share");
            assert_eq!(origin.wedges[slot], level.wedge_sources[wedge]);
        }
    }

    #[test]
    fn the_origin_is_the_nearest_point() {
        let source = surface(16, |x, y| Vec3::new(x, y, 0.1 * ((x * 9.0).sin() * (y * 7.0).cos())));
        let level = level(&source, 60);
        let triangles = (0..source.triangles.len()).map(|t| source.triangle_points(t).map(|p| p.0));
        let whole = Surface::new(&source.positions, triangles);
        for (wedge, origin) in find_origins(&source, &level, &[0]).iter().enumerate() {
            let p = level.mesh.positions[level.mesh.wedge_points[wedge]].as_dvec3();
            let nearest = whole.closest_foot(p, f64::INFINITY, |_| true).expect("a foot");
            let off = p.distance(place(&source, origin)) - p.distance(nearest.point);
            assert!(off.abs() < 1e-9, "{off}");
        }
    }

    /// Two sheets over each other, the upper of which starts at `first` wedges and points.
    fn two_sheets(gap: f32) -> (Mesh, u32) {
        let sheet =
            |z: f32| surface(12, move |x, y| Vec3::new(x, y, z + 0.05 * (9.0 * x * y).sin()));
        let (mut mesh, upper) = (sheet(0.0), sheet(gap));
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(&upper.positions);
        mesh.wedge_points.extend(upper.wedge_points.iter().map(|p| PointId(p.0 + first)));
        mesh.attributes.extend(&upper.attributes);
        let wedges = upper.triangles.iter().map(|t| t.map(|w| WedgeId(w.0 + first)));
        mesh.triangles.extend(wedges);
        mesh.groups.extend(&upper.groups);
        (mesh, first)
    }

    #[test]
    fn a_lip_stays_with_its_own_lip() {
        let (source, first) = two_sheets(1e-3);
        let level = level(&source, 90);
        let mut crossed = 0;
        for (wedge, origin) in find_origins(&source, &level, &[0]).iter().enumerate() {
            let is_upper = level.wedge_sources[wedge].0 >= first;
            assert!(origin.wedges.iter().all(|w| (w.0 >= first) == is_upper));
            let height = |w: WedgeId| source.positions[source.wedge_points[w]].z;
            let z = level.mesh.positions[level.mesh.wedge_points[wedge]].z;
            crossed += usize::from((height(origin.wedges[0]) > z) == is_upper);
        }
        assert!(crossed > 0, "no point comes near the other lip, so nothing is shown");
    }

    #[test]
    fn wedges_at_a_point_share_its_foot_and_keep_to_their_side_of_the_seam() {
        let source = sphere(16);
        let level = level(&source, 120);
        let origins = find_origins(&source, &level, &[0]);
        let mut at_seam = 0;
        for (a, &point) in level.mesh.wedge_points.iter().enumerate() {
            for b in (0..a).filter(|&b| level.mesh.wedge_points[b] == point) {
                let points = |o: &Origin| o.wedges.map(|w| source.wedge_points[w]);
                assert_eq!(points(&origins[a]), points(&origins[b]));
                assert_eq!(origins[a].barycentrics, origins[b].barycentrics);
                for w in [a, b] {
                    let own = level.mesh.uv(WedgeId::new(w), 0).x;
                    for there in origins[w].wedges {
                        let at = |other: &&PointId| **other == source.wedge_points[there];
                        let has_both = source.wedge_points.iter().filter(at).count() > 1;
                        let off = (source.uv(there, 0).x - own).abs();
                        assert!(!has_both || off < 0.5, "off by {off}");
                    }
                }
                at_seam += 1;
            }
        }
        assert!(at_seam > 4, "{at_seam}");
    }

    #[test]
    fn groups_of_another_kind_are_not_looked_at() {
        let (mut source, first) = two_sheets(1e-3);
        let is_upper = |t: &[WedgeId; 3]| t[0].0 >= first;
        source.groups = source.triangles.iter().map(|t| u32::from(is_upper(t))).collect();
        let mut level = level(&source, 90);
        // As after a join of both sheets: every point stands for one of the lower.
        level.point_sources.fill(PointId(0));
        for (wedge, origin) in find_origins(&source, &level, &[0, 1]).iter().enumerate() {
            let own = level.wedge_sources[wedge].0 >= first;
            assert!(origin.wedges.iter().all(|w| (w.0 >= first) == own));
        }
    }
}
