//! Vertex decimation, as a baseline to compare with (Schroeder, Zarge & Lorensen, "Decimation of triangle
//! meshes", SIGGRAPH 1992): points go one by one, and the hole that each leaves is triangulated anew.
//!
//! The point that lies nearest to the plane of the triangles around it goes first; one of a border or of a seam
//! that lies nearest to the line between its two neighbors along that. In the paper all within a distance
//! go, which grows; here a queue has them in their order. Corners, points where more than two
//! seams meet or more than one sheet does, stay.
//!
//! Guaranteed: points and wedges are the source's to the bit; no edge gets more than two triangles, no
//! triangle turns by more than the options allow from the plane of its hole, no UV area changes its sign;
//! locked points stay; the same result at any number of threads. Not guaranteed: that targets are reached, nor
//! anything about the distance to the source: what a point is off adds up over those that went around it, which is
//! more than the surface is off there, or less.

mod star;
mod triangulate;

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec2, DVec3};

use crate::chain::{Level, check};
use crate::error::Result;
use crate::id::{PointId, WedgeId};
use crate::mesh::Mesh;
use crate::options::Options;
use crate::queue::Queue;
use crate::shape::folds;
use crate::simplify::Stop;
use star::{Sector, Star};
use triangulate::triangulate;

/// Simplifies `mesh` to each of `targets` by removing points, whose importance multiplies their distances.
///
/// Of the options, those about costs, places and deviation count for nothing. As
/// [`simplify_chain`](crate::simplify_chain) in all else.
///
/// # Errors
/// As [`simplify_chain`](crate::simplify_chain).
pub fn decimate_chain(
    mesh: &Mesh,
    targets: &[usize],
    options: &Options<'_>,
    removed: &AtomicUsize,
) -> Result<Vec<Level>> {
    check(mesh, targets, options)?;
    let mut decimation = Decimation::new(mesh, options);
    let level = |&target: &usize| {
        let stopped = decimation.descend(target, removed);
        decimation.level(target, stopped)
    };
    Ok(targets.iter().map(level).collect())
}

/// A surface that loses its points.
struct Decimation<'a> {
    mesh: &'a Mesh,
    options: &'a Options<'a>,
    positions: Vec<DVec3>,
    triangles: Vec<[WedgeId; 3]>,
    groups: Vec<u32>,
    live: Vec<bool>,
    live_count: usize,
    /// Per point: its live triangles.
    around: Vec<Vec<u32>>,
    queue: Queue,
    /// Per point: the greatest distance that any around it went at.
    off: Vec<f64>,
    rotation_cosine: f64,
    max_error: f64,
    error: f64,
}

impl<'a> Decimation<'a> {
    fn new(mesh: &'a Mesh, options: &'a Options<'a>) -> Self {
        let mut around = vec![Vec::new(); mesh.positions.len()];
        for triangle in 0..mesh.triangles.len() {
            for point in mesh.triangle_points(triangle) {
                around[point.index()].push(triangle as u32);
            }
        }
        let mut own = Self {
            mesh,
            options,
            positions: mesh.positions.iter().map(|p| p.as_dvec3()).collect(),
            triangles: mesh.triangles.clone(),
            groups: mesh.groups.clone(),
            live: vec![true; mesh.triangles.len()],
            live_count: mesh.triangles.len(),
            around,
            queue: Queue::default(),
            off: vec![0.0; mesh.positions.len()],
            rotation_cosine: options.settings.rotation_cosine(),
            max_error: options.settings.max_error.unwrap_or(f64::INFINITY),
            error: 0.0,
        };
        (0..mesh.positions.len()).map(PointId::new).for_each(|point| own.queue(point));
        own
    }

    fn points(&self, triangle: u32) -> [PointId; 3] {
        self.triangles[triangle as usize].map(|wedge| self.mesh.wedge_points[wedge])
    }

    /// Queues a point by its distance, if it may go at all.
    fn queue(&mut self, point: PointId) {
        if self.options.locked.get(point.index()) == Some(&true) {
            return;
        }
        if let Some(star) = Star::of(self, point) {
            self.queue.push(self.cost(&star, point), point.0);
        }
    }

    fn cost(&self, star: &Star, point: PointId) -> f64 {
        let importance = self.options.importance.get(point.index()).map_or(1.0, |x| f64::from(*x));
        importance * self.distance(star, point)
    }

    /// The distance that a point goes at: what was gone around it before, and its own.
    fn distance(&self, star: &Star, point: PointId) -> f64 {
        self.off[point] + self.own_distance(star, point)
    }

    /// The distance of a point to the line between the ends of its border or seam, or to the plane of its star.
    fn own_distance(&self, star: &Star, point: PointId) -> f64 {
        let place = |wedge: WedgeId| self.positions[self.mesh.wedge_points[wedge]];
        let own = self.positions[point];
        let [Sector { rim, is_closed: false, .. }, ..] = &star.sectors[..] else {
            let (normal, center) = self.plane(star.sectors.iter().flat_map(|own| &own.triangles));
            return normal.dot(own - center).abs();
        };
        let (from, to) = (place(rim[0]), place(rim[rim.len() - 1]));
        let line = (to - from).normalize_or_zero();
        (own - from).reject_from(if line == DVec3::ZERO { DVec3::X } else { line }).length()
    }

    /// The mean plane of triangles by their area: its normal and a point of it.
    fn plane<'t>(&self, triangles: impl Iterator<Item = &'t u32>) -> (DVec3, DVec3) {
        let (mut normal, mut center, mut area) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for &triangle in triangles {
            let [a, b, c] = self.points(triangle).map(|point| self.positions[point]);
            let cross = (b - a).cross(c - a);
            normal += cross;
            center += (a + b + c) * (cross.length() / 3.0);
            area += cross.length();
        }
        (normal.normalize_or_zero(), if area > 0.0 { center / area } else { center })
    }

    fn descend(&mut self, target: usize, removed: &AtomicUsize) -> Option<Stop> {
        while self.live_count > target {
            let Some(point) = self.queue.pop().map(PointId) else {
                return Some(Stop::NoLegalCollapse);
            };
            let Some(star) = Star::of(self, point) else { continue };
            let cost = self.cost(&star, point);
            if self.queue.has_cheaper(cost) {
                self.queue.push(cost, point.0);
                continue;
            }
            let distance = self.distance(&star, point);
            if distance > self.max_error {
                self.queue.push(cost, point.0);
                return Some(Stop::ErrorLimit);
            }
            let Some(filled) = self.fill(&star) else { continue };
            self.error = self.error.max(distance);
            let before = self.live_count;
            self.apply(&star, filled, distance);
            removed.fetch_add(before - self.live_count, Ordering::Relaxed);
        }
        None
    }

    /// The triangles of the hole that a star leaves, with the sector of each; `None` if there are no legal ones.
    fn fill(&self, star: &Star) -> Option<Vec<(usize, [WedgeId; 3])>> {
        let mut filled = Vec::new();
        for (at, sector) in star.sectors.iter().enumerate() {
            let (normal, _) = self.plane(sector.triangles.iter());
            let places: Vec<DVec3> = sector
                .rim
                .iter()
                .map(|&wedge| self.positions[self.mesh.wedge_points[wedge]])
                .collect();
            let own = triangulate(&places, normal, self.rotation_cosine)?;
            filled.extend(own.into_iter().map(|corners| (at, corners.map(|c| sector.rim[c]))));
        }
        (self.keeps_surface(star, &filled) && self.keeps_charts(star, &filled)).then_some(filled)
    }

    /// Whether every new edge is new, but for those between neighbors on the rim, which may have but one triangle
    /// beyond; whether no triangle is there already, and something is left at the rim.
    fn keeps_surface(&self, star: &Star, filled: &[(usize, [WedgeId; 3])]) -> bool {
        let beyond = |a: PointId, b: PointId| {
            let has = |t: &&u32| !star.has(**t) && self.points(**t).contains(&b);
            self.around[a.index()].iter().filter(has).count()
        };
        let point = |wedge: WedgeId| self.mesh.wedge_points[wedge];
        // What closes an open sector is an edge at both of its sides.
        let closing_is_well = |sector: &Sector| {
            let (from, to) = (point(sector.rim[0]), point(sector.rim[sector.rim.len() - 1]));
            let has_rim = star.sectors.iter().any(|own| !own.is_closed && own.rim.len() == 2);
            match (sector.is_closed, has_rim, star.sectors.len()) {
                (true, ..) => true,
                (false, false, _) => beyond(from, to) == 0,
                (false, true, 1) => beyond(from, to) == 1,
                (false, true, _) => beyond(from, to) <= 1,
            }
        };
        let is_new = |(at, corners): &(usize, [WedgeId; 3])| {
            let points = corners.map(point);
            let is_there = |t: &u32| {
                let own = self.points(*t);
                !star.has(*t) && points.iter().all(|point| own.contains(point))
            };
            let sides = [(0, 1), (1, 2), (2, 0)].map(|(a, b)| [corners[a], corners[b]]);
            let inner = sides.iter().filter(|side| !star.sectors[*at].is_side(**side));
            !self.around[points[0].index()].iter().any(is_there)
                && inner.clone().all(|&[a, b]| beyond(point(a), point(b)) == 0)
        };
        star.sectors.iter().all(closing_is_well) && filled.iter().all(is_new)
    }

    /// Whether no new triangle has its UVs the other way round than those that it stands for.
    fn keeps_charts(&self, star: &Star, filled: &[(usize, [WedgeId; 3])]) -> bool {
        let uvs = |corners: [WedgeId; 3], set| -> [DVec2; 3] {
            corners.map(|wedge| self.mesh.uv(wedge, set).as_dvec2())
        };
        filled.iter().all(|&(at, corners)| {
            (0..self.mesh.layout.uv_sets).all(|set| {
                let old = star.sectors[at].triangles.iter();
                let mut old = old.map(|&t| uvs(self.triangles[t as usize], set));
                !old.any(|before| folds(before, uvs(corners, set)))
            })
        })
    }

    /// Takes the triangles of a star out, and puts others into the hole; its point went at `distance`.
    fn apply(&mut self, star: &Star, filled: Vec<(usize, [WedgeId; 3])>, distance: f64) {
        let mut rim = Vec::new();
        for sector in &star.sectors {
            rim.extend(sector.rim.iter().map(|&wedge| self.mesh.wedge_points[wedge]));
            for &triangle in &sector.triangles {
                self.live[triangle as usize] = false;
                self.live_count -= 1;
                for corner in self.points(triangle) {
                    self.around[corner.index()].retain(|own| *own != triangle);
                }
            }
        }
        for (sector, corners) in filled {
            let triangle = self.triangles.len() as u32;
            self.triangles.push(corners);
            self.groups.push(self.groups[star.sectors[sector].triangles[0] as usize]);
            self.live.push(true);
            self.live_count += 1;
            for corner in self.points(triangle) {
                self.around[corner.index()].push(triangle);
            }
        }
        rim.sort_unstable();
        rim.dedup();
        for point in rim {
            self.off[point] = self.off[point].max(distance);
            self.queue(point);
        }
    }

    /// The surface as it stands.
    fn level(&self, target: usize, stopped: Option<Stop>) -> Level {
        let source = self.mesh;
        let mut mesh = Mesh { layout: source.layout, ..Mesh::default() };
        let (mut point_sources, mut wedge_sources) = (Vec::new(), Vec::new());
        let mut new_points = vec![None; source.positions.len()];
        let mut new_wedges = vec![None; source.wedge_points.len()];
        for triangle in (0..self.triangles.len()).filter(|&triangle| self.live[triangle]) {
            let corners = self.triangles[triangle].map(|wedge| {
                *new_wedges[wedge.index()].get_or_insert_with(|| {
                    let old = source.wedge_points[wedge];
                    let point = *new_points[old.index()].get_or_insert_with(|| {
                        mesh.positions.push(source.positions[old]);
                        point_sources.push(old);
                        PointId::new(mesh.positions.len() - 1)
                    });
                    mesh.wedge_points.push(point);
                    mesh.attributes.extend_from_slice(source.row(wedge));
                    wedge_sources.push(wedge);
                    WedgeId::new(mesh.wedge_points.len() - 1)
                })
            });
            mesh.triangles.push(corners);
            mesh.groups.push(self.groups[triangle]);
        }
        Level { mesh, point_sources, wedge_sources, target, error: self.error, stopped }
    }
}

#[cfg(test)]
mod tests;
