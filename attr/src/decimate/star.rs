//! The triangles around a point, cut where seams run through it.

use super::Decimation;
use crate::id::{PointId, WedgeId};

/// A point of more triangles stays until some of its neighbors are gone: a hole of so many sides takes long.
const MAX_TRIANGLES: usize = 48;

/// The triangles around a point that may go.
pub(super) struct Star {
    /// One, or two on both sides of a seam.
    pub(super) sectors: Vec<Sector>,
}

/// Triangles around a point that no seam runs through.
pub(super) struct Sector {
    pub(super) triangles: Vec<u32>,
    /// The wedges of the neighbors, counter-clockwise from outside.
    pub(super) rim: Vec<WedgeId>,
    /// Whether they go all the way around: else the last and the first are ends of a border or a seam.
    pub(super) is_closed: bool,
}

/// A triangle at the point: the neighbors' wedges and its own.
#[derive(Clone, Copy)]
struct Spoke {
    triangle: u32,
    from: WedgeId,
    to: WedgeId,
    own: WedgeId,
}

impl Star {
    /// The star of a point; `None` if it has none, is a corner, or more than one sheet meets there.
    pub(super) fn of(surface: &Decimation<'_>, point: PointId) -> Option<Self> {
        let around = &surface.around[point.index()];
        if around.is_empty() || around.len() > MAX_TRIANGLES {
            return None;
        }
        let place = |wedge: WedgeId| surface.mesh.wedge_points[wedge];
        let spoke = |&triangle: &u32| {
            let wedges = surface.triangles[triangle as usize];
            let slot = wedges.iter().position(|&wedge| place(wedge) == point)?;
            let [from, to] = [1, 2].map(|step| wedges[(slot + step) % 3]);
            Some(Spoke { triangle, from, to, own: wedges[slot] })
        };
        let spokes: Vec<Spoke> = around.iter().map(spoke).collect::<Option<_>>()?;
        let (fan, is_closed) = in_order(&spokes, place)?;
        let is_cut = |a: &Spoke, b: &Spoke| {
            let group = |spoke: &Spoke| surface.groups[spoke.triangle as usize];
            a.own != b.own || a.to != b.from || group(a) != group(b)
        };
        let next = |at: usize| &fan[(at + 1) % fan.len()];
        let last = if is_closed { fan.len() } else { fan.len() - 1 };
        let cuts: Vec<usize> = (0..last).filter(|&at| is_cut(&fan[at], next(at))).collect();
        let part = |from: usize, to: usize| {
            let spokes = (from..to).map(|at| fan[at % fan.len()]);
            Sector::open(spokes)
        };
        let sectors = match (is_closed, &cuts[..]) {
            (true, []) => vec![Sector { is_closed: true, ..Sector::of(fan.iter().copied()) }],
            (true, &[a, b]) => vec![part(a + 1, b + 1), part(b + 1, a + 1 + fan.len())],
            (false, []) => vec![part(0, fan.len())],
            _ => return None,
        };
        Some(Self { sectors })
    }

    /// Whether a triangle is of the star.
    pub(super) fn has(&self, triangle: u32) -> bool {
        self.sectors.iter().any(|own| own.triangles.contains(&triangle))
    }
}

impl Sector {
    fn of(spokes: impl Iterator<Item = Spoke> + Clone) -> Self {
        Self {
            triangles: spokes.clone().map(|own| own.triangle).collect(),
            rim: spokes.map(|own| own.from).collect(),
            is_closed: false,
        }
    }

    fn open(spokes: impl Iterator<Item = Spoke> + Clone) -> Self {
        let end = spokes.clone().last().map(|own| own.to);
        let mut sector = Self::of(spokes);
        sector.rim.extend(end);
        sector
    }

    /// Whether two wedges are neighbors on the rim, or the ends of an open one.
    pub(super) fn is_side(&self, [a, b]: [WedgeId; 2]) -> bool {
        let at = |wedge: WedgeId| self.rim.iter().position(|&own| own == wedge);
        let (Some(a), Some(b)) = (at(a), at(b)) else { return false };
        let steps = (b + self.rim.len() - a) % self.rim.len();
        steps == 1 || steps + 1 == self.rim.len()
    }
}

/// The spokes one after the other, from border to border or all the way around; `None` if they are not one fan.
fn in_order(spokes: &[Spoke], place: impl Fn(WedgeId) -> PointId) -> Option<(Vec<Spoke>, bool)> {
    let meet = |a: &Spoke, b: &Spoke| place(a.to) == place(b.from);
    let follows = |of: &Spoke| spokes.iter().filter(|own| meet(of, own)).collect::<Vec<_>>();
    let leads = |to: &Spoke| spokes.iter().filter(|own| meet(own, to)).count();
    let is_one = |own: &Spoke| follows(own).len() <= 1 && leads(own) <= 1;
    if !spokes.iter().all(is_one) {
        return None;
    }
    let start = spokes.iter().find(|own| leads(own) == 0);
    let mut fan = vec![*start.unwrap_or(&spokes[0])];
    while let Some(&next) = follows(&fan[fan.len() - 1]).first()
        && next.triangle != fan[0].triangle
    {
        fan.push(*next);
    }
    let whole = fan.len() == spokes.len() && (start.is_some() || fan.len() > 2);
    whole.then_some((fan, start.is_none()))
}
