//! Layers that nearly touch: which of two is in front stays.
//!
//! A decal lies a thousandth above its wall, an eye in its head. Each is a shell of its own, cut into
//! triangles of its own, and a level of either is off by more than what lies between them. So where a shell of
//! the source has another close behind it, its level is looked at from there too: where what was behind
//! has come before it, the points of the front are moved out, by as little as brings it before it again.
//!
//! Guaranteed: no point moves farther than twice what a sample calls for, and no triangle turns over. Not guaranteed: the order between
//! the samples, nor where a shell passes through another.

use std::collections::BTreeMap;

use glam::{DMat4, DVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::chain::Level;
use crate::mesh::Mesh;
use crate::sets::DisjointSets;
use crate::surface::{Hit, Surface};

/// How far behind a shell another is looked for, as a share of the diagonal around all of them.
const REACH: f64 = 0.01;
/// Nearer than this share of the diagonal nothing is in front of anything.
const LEAST_GAP: f64 = 1e-6;
/// The share of the gap that has to be left.
const KEPT_GAP: f32 = 0.25;
/// Two layers face about the same way: the least cosine between their normals.
const LEAST_COSINE: f32 = 0.5;
/// Places of each triangle: its corners, drawn in by this share, and its middle.
const INSET: f32 = 0.1;
/// Of fewer places than this share of a pair of shells nothing is done.
const LEAST_SUNK: f64 = 0.005;
/// The largest move of a point in all, in lengths of the first.
const MAX_MOVE: f32 = 2.0;
/// A layer has the other behind it at this share of the places that are asked first, and so many are.
const LEAST_SHARE: f64 = 0.5;
const MAX_ASKED: usize = 64;
/// Moves that one may lead to.
const ROUNDS: usize = 8;
/// A move turns no triangle by more than this cosine.
const LEAST_TURN: f64 = 0.3;

/// One of the surfaces that a scene shows, with its levels.
#[derive(Debug)]
pub struct Layered<'a> {
    /// The surface.
    pub source: &'a Mesh,
    /// Its levels; as many of each surface.
    pub levels: &'a mut [Level],
    /// Where the scene shows it.
    pub world: DMat4,
    /// One per point of the source, or empty: a locked point stays.
    pub locked: &'a [bool],
}

/// Puts in front again what was in front of a near layer in the source.
pub fn keep_fronts(surfaces: &mut [Layered<'_>]) {
    // What is far from the origin has no digits left for what lies between two layers.
    let first = surfaces.iter().find_map(|own| Some((own.world, own.source.positions.first()?)));
    let Some((world, place)) = first else { return };
    let center = DMat4::from_translation(-world.transform_point3(place.as_dvec3()));
    surfaces.iter_mut().for_each(|own| own.world = center * own.world);
    let source = Soup::of_sources(surfaces);
    let fronts = source.fronts();
    if fronts.is_empty() {
        return;
    }
    for at in 0..surfaces.iter().map(|own| own.levels.len()).min().unwrap_or(0) {
        let mut level = Soup::of_levels(surfaces, at, &source);
        let before = level.positions.clone();
        level.settle(&fronts, source.diagonal());
        level.give_back(surfaces, at, &before);
    }
}

/// The triangles of all surfaces in one space.
struct Soup {
    positions: Vec<Vec3>,
    free: Vec<bool>,
    triangles: Vec<[u32; 3]>,
    /// One per point: its shell.
    shells: Vec<u32>,
    /// The first point of each surface.
    firsts: Vec<usize>,
}

/// A place of the source that has another shell close behind it.
struct Front {
    place: Vec3,
    normal: Vec3,
    gap: f32,
    /// The height over the place up to which nothing else is.
    clear: f32,
    shell: u32,
    behind: u32,
}

impl Soup {
    fn new() -> Self {
        let (positions, free, triangles) = (Vec::new(), Vec::new(), Vec::new());
        Self { positions, free, triangles, shells: Vec::new(), firsts: Vec::new() }
    }

    /// Adds a mesh; `world` tells where it is, `locked` which of its points stay.
    fn add(&mut self, mesh: &Mesh, world: &DMat4, locked: impl Fn(usize) -> bool) {
        let first = self.positions.len();
        self.firsts.push(first);
        let place = |p: &Vec3| world.transform_point3(p.as_dvec3()).as_vec3();
        self.positions.extend(mesh.positions.iter().map(place));
        self.free.extend((0..mesh.positions.len()).map(|point| !locked(point)));
        let points = |t| mesh.triangle_points(t).map(|point| point.0 + first as u32);
        self.triangles.extend((0..mesh.triangles.len()).map(points));
    }

    fn of_sources(surfaces: &[Layered<'_>]) -> Self {
        let mut soup = Self::new();
        surfaces.iter().for_each(|own| soup.add(own.source, &own.world, |_| true));
        let mut sets = DisjointSets::new(soup.positions.len());
        for &[a, b, c] in &soup.triangles {
            sets.join(a, b);
            sets.join(b, c);
        }
        soup.shells = (0..soup.positions.len() as u32).map(|point| sets.root(point)).collect();
        soup
    }

    fn of_levels(surfaces: &[Layered<'_>], at: usize, source: &Self) -> Self {
        let mut soup = Self::new();
        for (own, first) in surfaces.iter().zip(&source.firsts) {
            let level = &own.levels[at];
            let stands_for = |point: usize| level.point_sources[point].index();
            let locked = |point| own.locked.get(stands_for(point)).copied().unwrap_or(false);
            soup.add(&level.mesh, &own.world, locked);
            let shells = (0..level.mesh.positions.len()).map(|point| first + stands_for(point));
            soup.shells.extend(shells.map(|point| source.shells[point]));
        }
        soup
    }

    /// The length from corner to corner of the box around all of it.
    fn diagonal(&self) -> f64 {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &p in &self.positions {
            (low, high) = (low.min(p), high.max(p));
        }
        f64::from((high - low).max(Vec3::ZERO).length())
    }

    fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|point| self.positions[point as usize])
    }

    fn normal(&self, triangle: usize) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// The shell of a triangle.
    fn shell(&self, triangle: usize) -> u32 {
        self.shells[self.triangles[triangle][0] as usize]
    }

    /// The places of layers that have another shell close behind them: of shells that lie before one other for
    /// the most part. Shells that pass through each other, as hair and a head, are off by as much where
    /// they do, and moving them gains nothing.
    fn fronts(&self) -> Vec<Front> {
        let mut shells: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for triangle in 0..self.triangles.len() {
            shells.entry(self.shell(triangle)).or_default().push(triangle);
        }
        if shells.len() < 2 {
            return Vec::new();
        }
        let diagonal = self.diagonal();
        let surface = Surface::new(&self.positions, self.triangles.iter().copied());
        let shells: Vec<Vec<usize>> = shells.into_values().collect();
        let fronts = |triangles: &Vec<usize>| {
            let Some(behind) = self.behind(&surface, triangles, diagonal) else {
                return Vec::new();
            };
            let all = triangles
                .iter()
                .flat_map(|&triangle| self.places(triangle).map(move |at| (triangle, at)));
            let front = |(triangle, place)| self.front(&surface, (triangle, place), diagonal);
            all.filter_map(front).filter(|front| front.behind == behind).collect::<Vec<_>>()
        };
        shells.par_iter().flat_map_iter(fronts).collect()
    }

    /// The shell that most of another has close behind it, as some of its triangles tell.
    fn behind(&self, surface: &Surface, triangles: &[usize], diagonal: f64) -> Option<u32> {
        let some = triangles.iter().step_by(triangles.len().div_ceil(MAX_ASKED));
        let asked = some.clone().count();
        let middle = |&triangle: &usize| {
            let [a, b, c] = self.corners(triangle);
            self.front(surface, (triangle, (a + b + c) / 3.0), diagonal)
        };
        let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
        for front in some.filter_map(middle) {
            *counts.entry(front.behind).or_default() += 1;
        }
        let (behind, count) = counts.into_iter().max_by_key(|&(_, count)| count)?;
        (count as f64 >= LEAST_SHARE * asked as f64).then_some(behind)
    }

    /// Places of a triangle that are looked at.
    fn places(&self, triangle: usize) -> impl Iterator<Item = Vec3> {
        let corners = self.corners(triangle);
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        corners.map(|corner| corner.lerp(middle, INSET)).into_iter().chain([middle])
    }

    /// What is close behind a place of a triangle, if it is another shell that faces the same way.
    fn front(
        &self,
        surface: &Surface,
        (triangle, place): (usize, Vec3),
        diagonal: f64,
    ) -> Option<Front> {
        let normal = self.normal(triangle);
        let least = (LEAST_GAP * diagonal) as f32;
        let reach = (REACH * diagonal) as f32;
        let hit = surface.first_hit(place - normal * least, -normal, reach)?;
        let (shell, behind) = (self.shell(triangle), self.shell(hit.triangle.index()));
        let faces = self.normal(hit.triangle.index()).dot(normal) > LEAST_COSINE;
        let gap = hit.distance + least;
        if shell == behind || !faces {
            return None;
        }
        // What lies over the place too would be taken for what has come before it.
        let over = surface.first_hit(place + normal * least, normal, 2.0 * reach);
        let clear = over.map_or(reach, |over| over.distance / 2.0);
        Some(Front { place, normal, gap, clear, shell, behind })
    }

    /// Moves points until what was in front is.
    fn settle(&mut self, fronts: &[Front], diagonal: f64) {
        let mut triangles: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
        for front in fronts {
            triangles.entry(front.shell).or_default();
            triangles.entry(front.behind).or_default();
        }
        for triangle in 0..self.triangles.len() {
            if let Some(own) = triangles.get_mut(&self.shell(triangle)) {
                own.push(triangle);
            }
        }
        let (descended, reach) = (self.positions.clone(), (REACH * diagonal) as f32);
        // Per point: how far it may move in all.
        let mut most: FxHashMap<u32, f32> = FxHashMap::default();
        let mut left = FxHashSet::default();
        for round in 0..ROUNDS {
            let surfaces: FxHashMap<u32, Surface> = triangles
                .iter()
                .map(|(&shell, own)| {
                    let corners = own.iter().map(|&triangle| self.triangles[triangle]);
                    (shell, Surface::new(&self.positions, corners))
                })
                .collect();
            let sunk: Vec<(Hit, &Front, f32)> = fronts
                .par_iter()
                .filter(|front| !left.contains(&front.pair()))
                .filter_map(|front| {
                    let [own, other] = [front.shell, front.behind]
                        .map(|shell| front.height(&surfaces[&shell], reach));
                    let ((height, hit), (other, _)) = (own?, other?);
                    let missing = other + KEPT_GAP * front.gap - height;
                    (other > height).then_some((hit, front, missing))
                })
                .collect();
            if round == 0 {
                left = rarely(fronts, &sunk);
            }
            let sunk: Vec<_> =
                sunk.into_iter().filter(|own| !left.contains(&own.1.pair())).collect();
            if sunk.is_empty() || !self.raise(&sunk, &triangles, (&descended, &mut most)) {
                return;
            }
        }
    }

    /// Moves the corners of triangles that have sunk; whether any was.
    fn raise(
        &mut self,
        sunk: &[(Hit, &Front, f32)],
        triangles: &FxHashMap<u32, Vec<usize>>,
        (descended, most): (&[Vec3], &mut FxHashMap<u32, f32>),
    ) -> bool {
        let mut moves: FxHashMap<u32, (f32, Vec3)> = FxHashMap::default();
        for (hit, front, missing) in sunk {
            let triangle = triangles[&front.shell][hit.triangle.index()];
            let shares = hit.barycentrics;
            for (slot, point) in self.triangles[triangle].into_iter().enumerate() {
                let by = missing * shares[slot] / shares.length_squared();
                let own = moves.entry(point).or_insert((0.0, Vec3::ZERO));
                if by > own.0 {
                    *own = (by, front.normal);
                }
            }
        }
        let mut points: Vec<(u32, Vec3)> =
            moves.into_iter().map(|(point, (by, normal))| (point, normal * by)).collect();
        points.sort_unstable_by_key(|(point, _)| *point);
        let mut moved = false;
        let before = self.positions.clone();
        for (point, by) in points {
            let most = *most.entry(point).or_insert(MAX_MOVE * by.length());
            let point = point as usize;
            let to = self.positions[point] + by;
            if self.free[point] && to.distance(descended[point]) <= most {
                self.positions[point] = to;
                moved = true;
            }
        }
        self.undo_turns(&before, triangles);
        moved
    }

    /// Puts the points of triangles back that have turned.
    fn undo_turns(&mut self, before: &[Vec3], triangles: &FxHashMap<u32, Vec<usize>>) {
        let vector = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a);
        loop {
            let turned = |&&triangle: &&usize| {
                let points = self.triangles[triangle];
                let at = |all: &[Vec3]| vector(points.map(|p| all[p as usize].as_dvec3()));
                let (old, new) = (at(before), at(&self.positions));
                old != new && old.dot(new) < LEAST_TURN * old.length() * new.length()
            };
            let bad: Vec<usize> = triangles.values().flatten().filter(turned).copied().collect();
            if bad.is_empty() {
                return;
            }
            for point in bad.into_iter().flat_map(|triangle| self.triangles[triangle]) {
                self.positions[point as usize] = before[point as usize];
            }
        }
    }

    /// Gives points that have moved back to the levels.
    fn give_back(&self, surfaces: &mut [Layered<'_>], at: usize, before: &[Vec3]) {
        for (own, &first) in surfaces.iter_mut().zip(&self.firsts) {
            let back = own.world.inverse();
            for (point, p) in own.levels[at].mesh.positions.iter_mut().enumerate() {
                let (old, new) = (before[first + point], self.positions[first + point]);
                if old != new {
                    let by = back.transform_vector3((new - old).as_dvec3());
                    *p = (p.as_dvec3() + by).as_vec3();
                }
            }
        }
    }
}

/// The pairs of shells of which so few places have sunk that those are where they pass through each other.
fn rarely(fronts: &[Front], sunk: &[(Hit, &Front, f32)]) -> FxHashSet<[u32; 2]> {
    let mut counts: FxHashMap<[u32; 2], [usize; 2]> = FxHashMap::default();
    fronts.iter().for_each(|front| counts.entry(front.pair()).or_default()[0] += 1);
    sunk.iter().for_each(|(_, front, _)| counts.entry(front.pair()).or_default()[1] += 1);
    let is_rare = |[all, sunk]: [usize; 2]| (sunk as f64) < LEAST_SUNK * all as f64;
    counts.into_iter().filter(|(_, own)| is_rare(*own)).map(|(pair, _)| pair).collect()
}

impl Front {
    /// The shell and that behind it.
    fn pair(&self) -> [u32; 2] {
        [self.shell, self.behind]
    }

    /// How high a surface is above the place, along its normal, and where; the highest that is clear.
    fn height(&self, surface: &Surface, reach: f32) -> Option<(f32, Hit)> {
        let above = self.place + self.normal * self.clear;
        let hit = surface.first_hit(above, -self.normal, self.clear + reach)?;
        Some((self.clear - hit.distance, hit))
    }
}

#[cfg(test)]
mod tests;
