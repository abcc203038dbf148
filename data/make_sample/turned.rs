//! The parts thrown on the wheel: rings of points about the axis, with holes where the spout and
//! the handle join.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::model::{Corner, Model, Triangle, chart_named};
use crate::noise::{mix, step};
use crate::profile::{Part, Profile, SECTIONS};

/// A round hole in the grid of a section.
pub(crate) struct Hole {
    /// Index into [`SECTIONS`].
    section: usize,
    /// The grid point in its middle: column of [`Hole::columns`], row of the section.
    column: i64,
    row: i64,
    /// Cells from the middle to the rim; the rim has eight times as many points.
    half: i64,
    /// Columns of the rings it lies in.
    columns: i64,
}

/// Where the spout, the upper and the lower end of the handle join.
pub(crate) const HOLES: [Hole; 3] = [
    Hole { section: 3, column: 0, row: 24, half: 4, columns: 128 },
    Hole { section: 4, column: 32, row: 17, half: 3, columns: 64 },
    Hole { section: 3, column: 64, row: 31, half: 3, columns: 128 },
];

impl Hole {
    /// Columns from the middle, by the shorter way around.
    fn across(&self, column: f64) -> f64 {
        let columns = self.columns as f64;
        (column - self.column as f64 + columns / 2.0).rem_euclid(columns) - columns / 2.0
    }

    /// Moves grid points about the hole so that its square rim becomes round; the shift fades out
    /// at 2.4 times the rim.
    fn round(&self, at: DVec2) -> DVec2 {
        let offset = DVec2::new(self.across(at.x), at.y - self.row as f64);
        let (square, length) = (offset.abs().max_element(), offset.length());
        if square == 0.0 {
            return at;
        }
        let half = self.half as f64;
        let fade = step(half, 2.4 * half, square);
        at + offset * (mix(square / length, 1.0, fade) - 1.0)
    }

    /// Whether the cell right of `column` and above `row` is cut out.
    fn holds(&self, column: usize, row: usize) -> bool {
        let across = self.across(column as f64 + 0.5).abs();
        let up = (row as f64 + 0.5 - self.row as f64).abs();
        across.max(up) < self.half as f64
    }

    /// The grid points of the rim, (column, row), counter-clockwise from outside.
    fn rim(&self) -> Vec<(usize, usize)> {
        let h = self.half;
        let side = |f: fn(i64, i64) -> (i64, i64)| (-h..h).map(move |k| f(k, h));
        side(|k, h| (k, -h))
            .chain(side(|k, h| (h, k)))
            .chain(side(|k, h| (-k, h)))
            .chain(side(|k, h| (-h, -k)))
            .map(|(x, y)| {
                ((self.column + x).rem_euclid(self.columns) as usize, (self.row + y) as usize)
            })
            .collect()
    }
}

/// A ring of points at one row of a section.
struct Ring {
    points: Vec<usize>,
    /// One per point: turn about the axis, near its index over the number of points.
    turns: Vec<f64>,
    /// One per point: arc length along the outline.
    along: Vec<f64>,
}

/// How many columns a ring of this radius has: cells stay about as wide as they are high.
fn columns(radius: f64) -> usize {
    match radius {
        r if r > 38.0 => 128,
        r if r > 15.0 => 64,
        r if r > 6.5 => 32,
        r if r > 2.5 => 16,
        r if r > 1e-9 => 8,
        _ => 1,
    }
}

fn ring(model: &mut Model, profile: &Profile, section: usize, row: usize) -> Ring {
    let count = columns(profile.at(profile.length_at(section, row as f64)).x);
    let place = |column: usize| {
        let here = DVec2::new(column as f64, row as f64);
        let holes = HOLES.iter().filter(|h| h.section == section && h.columns == count as i64);
        holes.fold(here, |here, hole| hole.round(here))
    };
    let places: Vec<DVec2> = (0..count).map(place).collect();
    let turns: Vec<f64> = places.iter().map(|p| p.x / count as f64).collect();
    let position = |(p, &turn): (&DVec2, &f64)| profile.surface(section, p.y, turn);
    let positions: Vec<DVec3> = places.iter().zip(&turns).map(position).collect();
    let points = positions.into_iter().map(|p| model.add_point(p)).collect();
    Ring { points, turns, along: places.iter().map(|p| profile.length_at(section, p.y)).collect() }
}

/// How a chart of a turned part is unrolled.
enum Unroll {
    /// About the pole at this arc length; seen from below if `true`.
    Disc(f64, bool),
    /// As a gore about a meridian: x is the angle from `center` times the radius, drawn towards
    /// `radius` by `straight` (1: a rectangle). The cut is opposite the center.
    Gore { center: f64, radius: f64, straight: f64 },
}

/// The chart of a section at a turn, and how it is unrolled.
fn chart_at(profile: &Profile, section: usize, turn: f64) -> (usize, Unroll) {
    let gore = |center, radius, straight| Unroll::Gore { center, radius, straight };
    let end = profile.length_at(8, SECTIONS[8].rows as f64);
    match SECTIONS[section].part {
        Part::Base => (chart_named("base"), Unroll::Disc(0.0, true)),
        Part::Foot => (chart_named("foot"), gore(0.62, 46.0, 1.0)),
        Part::Body => {
            let side = ((4.0 * turn).round() as usize) % 4;
            (side, gore(side as f64 / 4.0, 70.0, 0.0))
        }
        Part::Neck => (chart_named("neck"), gore(0.5, 31.0, 0.8)),
        Part::Collar => (chart_named("collar"), gore(0.3, 39.0, 1.0)),
        Part::Lid => {
            let top = profile.span(Part::Lid).1;
            (chart_named("lid"), Unroll::Disc(top + 8.0, false))
        }
        _ if section == 7 => (chart_named("knob, stem"), gore(0.25, 9.0, 0.9)),
        _ => (chart_named("knob, cap"), Unroll::Disc(end, false)),
    }
}

/// A corner of a ring in its chart. `index` may run past the end of the ring: it wraps.
fn corner(ring: &Ring, index: usize, profile: &Profile, unroll: &Unroll, middle: f64) -> Corner {
    let count = ring.points.len();
    let (at, wraps) = (index % count, index / count);
    let (turn, along) = (ring.turns[at] + wraps as f64, ring.along[at]);
    let flat = match unroll {
        Unroll::Disc(pole, below) => {
            let angle = TAU * turn;
            let y = if *below { -angle.sin() } else { angle.sin() };
            DVec2::new(angle.cos(), y) * (along - pole).abs()
        }
        Unroll::Gore { center, radius, straight } => {
            let from_center = (middle - center + 0.5).rem_euclid(1.0) - 0.5 + (turn - middle);
            let own = profile.at(along).x;
            DVec2::new(TAU * from_center * mix(own, *radius, *straight), along)
        }
    };
    Corner { point: ring.points[at], flat, along, around: 0.0 }
}

/// Joins two rings of one section, the lower first; either may have twice the other's points, or
/// be a single pole.
fn join(model: &mut Model, profile: &Profile, section: usize, row: usize, rings: [&Ring; 2]) {
    let [low, high] = rings;
    let (a, b) = (low.points.len(), high.points.len());
    let cells = if a == 1 || b == 1 { a.max(b) } else { a.min(b) };
    for cell in 0..cells {
        let middle = (cell as f64 + 0.5) / cells as f64;
        let (chart, unroll) = chart_at(profile, section, middle);
        let at = |ring: &Ring, index: usize| corner(ring, index, profile, &unroll, middle);
        let (part, smoothing) = (SECTIONS[section].part, SECTIONS[section].smoothing);
        let like = |corners: [Corner; 3]| Triangle { corners, chart, part, smoothing };
        let (next, twice) = (cell + 1, 2 * cell);
        if a == b {
            let cut =
                |h: &Hole| h.section == section && h.columns == a as i64 && h.holds(cell, row);
            if !HOLES.iter().any(cut) {
                let quad = [at(low, cell), at(low, next), at(high, next), at(high, cell)];
                model.add_quad(quad, like([quad[0]; 3]));
            }
        } else if a == 1 {
            model.triangles.push(like([at(low, 0), at(high, next), at(high, cell)]));
        } else if b == 1 {
            model.triangles.push(like([at(low, cell), at(low, next), at(high, 0)]));
        } else if a == 2 * b {
            let [p, q, r] = [twice, twice + 1, twice + 2].map(|i| at(low, i));
            let [s, t] = [cell, next].map(|i| at(high, i));
            model.triangles.extend([[p, q, s], [q, t, s], [q, r, t]].map(like));
        } else {
            let [p, q] = [cell, next].map(|i| at(low, i));
            let [r, s, t] = [twice, twice + 1, twice + 2].map(|i| at(high, i));
            model.triangles.extend([[p, s, r], [p, q, s], [q, t, s]].map(like));
        }
    }
}

/// Adds foot, body, neck, lid and knob; gives the rims of [`HOLES`], counter-clockwise from
/// outside.
pub(crate) fn add_turned(model: &mut Model, profile: &Profile) -> [Vec<usize>; 3] {
    let mut rims: [Vec<usize>; 3] = Default::default();
    let mut below = ring(model, profile, 0, 0);
    for (section, spec) in SECTIONS.iter().enumerate() {
        let mut rows: Vec<Vec<usize>> = vec![below.points.clone()];
        for row in 0..spec.rows {
            let above = ring(model, profile, section, row + 1);
            join(model, profile, section, row, [&below, &above]);
            rows.push(above.points.clone());
            below = above;
        }
        for (hole, rim) in HOLES.iter().zip(&mut rims).filter(|(h, _)| h.section == section) {
            *rim = hole.rim().into_iter().map(|(column, row)| rows[row][column]).collect();
        }
    }
    rims
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rim_of_a_hole_is_round_and_far_points_stay() {
        for hole in &HOLES {
            let rim = hole.rim();
            assert_eq!(rim.len() as i64, 8 * hole.half);
            for (column, row) in rim {
                let at = hole.round(DVec2::new(column as f64, row as f64));
                let away = DVec2::new(hole.across(at.x), at.y - hole.row as f64).length();
                assert!((away - hole.half as f64).abs() < 1e-12);
            }
            let far = DVec2::new(hole.column as f64 + 12.0, hole.row as f64);
            assert!(hole.round(far).abs_diff_eq(far, 1e-12));
        }
    }
}
