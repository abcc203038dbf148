//! The parts pulled by hand: spout and handle, tubes about a plane curve whose first (and last)
//! ring is the rim of a hole in the turned body.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::model::{Corner, Model, Triangle, chart_named};
use crate::noise::{mix, step};
use crate::profile::{Part, arc_lengths, curve_through, interpolate};

/// A curve in the plane z = 0 with the frame of its tubes.
struct Path {
    chain: Vec<DVec2>,
    lengths: Vec<f64>,
}

impl Path {
    fn new(knots: &[(f64, f64)]) -> Self {
        let knots: Vec<DVec2> = knots.iter().copied().map(DVec2::from).collect();
        let chain = curve_through(&knots, 64);
        let lengths = arc_lengths(&chain);
        Self { chain, lengths }
    }

    /// A point around the curve: at a part of its length, on the side `turn` (0: +z, ¼: T × z),
    /// `radii` millimetres away along z and across it.
    fn around(&self, part: f64, turn: f64, radii: DVec2) -> DVec3 {
        let whole = self.lengths[self.lengths.len() - 1];
        let at = |length: f64| interpolate(&self.chain, &self.lengths, length);
        let tangent = at(part * whole + 0.5) - at(part * whole - 0.5);
        let side = tangent.extend(0.0).normalize().cross(DVec3::Z);
        let (sin, cos) = (TAU * turn).sin_cos();
        at(part * whole).extend(0.0) + DVec3::Z * (cos * radii.x) + side * (sin * radii.y)
    }
}

/// A ring of points around a tube, counter-clockwise seen along it.
struct Ring {
    points: Vec<usize>,
    along: f64,
    /// Mean distance from its middle.
    radius: f64,
}

/// The rim's points in the order of a tube's ring: turned, and reversed where the tube ends, so
/// that they lie nearest.
fn match_rim(model: &Model, rim: &[usize], ring: &[DVec3]) -> Vec<usize> {
    let count = rim.len();
    let turned = |start: usize, reversed: bool| -> Vec<usize> {
        let step = if reversed { count - 1 } else { 1 };
        (0..count).map(|k| rim[(start + k * step) % count]).collect()
    };
    let cost = |order: &Vec<usize>| -> f64 {
        order.iter().zip(ring).map(|(&p, q)| model.points[p].distance_squared(*q)).sum()
    };
    (0..count)
        .flat_map(|start| [turned(start, false), turned(start, true)])
        .min_by(|a, b| cost(a).total_cmp(&cost(b)))
        .expect("a rim has points")
}

/// Rows of rings from a rim to the tube's wall: for each point a parabola that leaves the rim
/// towards the wall's foot and arrives along the wall.
fn fillet(
    model: &Model,
    rim: &[usize],
    foot: &[DVec3],
    wall: &[DVec3],
    rows: usize,
) -> Vec<Vec<DVec3>> {
    let row = |k: usize| {
        let t = k as f64 / rows as f64;
        let bend = |j: usize| {
            let (a, b) = (model.points[rim[j]].lerp(foot[j], t), foot[j].lerp(wall[j], t));
            a.lerp(b, t)
        };
        (0..rim.len()).map(bend).collect()
    };
    (1..rows).map(row).collect()
}

/// Measures rings and gives them points; `first` and `last` are the points of rims.
fn add_rings(
    model: &mut Model,
    rows: Vec<Vec<DVec3>>,
    first: Vec<usize>,
    last: Option<Vec<usize>>,
) -> Vec<Ring> {
    let mut all = vec![first];
    all.extend(rows.into_iter().map(|row| row.into_iter().map(|p| model.add_point(p)).collect()));
    all.extend(last);
    let mut rings: Vec<Ring> = vec![];
    for points in all {
        let at: Vec<DVec3> = points.iter().map(|&p| model.points[p]).collect();
        let count = at.len() as f64;
        let middle = at.iter().sum::<DVec3>() / count;
        let radius = at.iter().map(|p| p.distance(middle)).sum::<f64>() / count;
        let along = rings.last().map_or(0.0, |ring| {
            let before = ring.points.iter().map(|&p| model.points[p]);
            ring.along + before.zip(&at).map(|(p, q)| p.distance(*q)).sum::<f64>() / count
        });
        rings.push(Ring { points, along, radius });
    }
    rings
}

/// A strip of a tube: which columns of it, and what they are.
struct Strip {
    columns: std::ops::Range<usize>,
    chart: usize,
    part: Part,
    smoothing: usize,
}

/// Joins neighbouring rings into the quads of a strip.
fn add_strip(model: &mut Model, rings: &[Ring], strip: &Strip) {
    let Strip { columns, chart, part, smoothing } = strip;
    let middle = (columns.start + columns.end) as f64 / 2.0;
    for pair in rings.windows(2) {
        let count = pair[0].points.len();
        let corner = |ring: &Ring, column: usize| Corner {
            point: ring.points[column % count],
            flat: DVec2::new(
                TAU * (column as f64 - middle) / count as f64 * ring.radius,
                ring.along,
            ),
            along: ring.along,
            around: column as f64 / count as f64,
        };
        for column in columns.clone() {
            let [a, b] = [column, column + 1].map(|c| corner(&pair[0], c));
            let [d, c] = [column, column + 1].map(|c| corner(&pair[1], c));
            let (chart, part, smoothing) = (*chart, *part, *smoothing);
            model.add_quad([a, b, c, d], Triangle { corners: [a; 3], chart, part, smoothing });
        }
    }
}

/// Rows of rings before a fillet reaches the wall.
const FILLET: usize = 5;

/// The profile of the tip, (part of the path, millimetres beyond the wall): a step, a waist, the lip
/// and back inside.
const TIP: [(f64, f64); 16] = [
    (0.863, 0.9),
    (0.875, 1.2),
    (0.887, 1.0),
    (0.905, 0.35),
    (0.93, 0.25),
    (0.955, 0.7),
    (0.975, 1.6),
    (0.99, 2.2),
    (0.998, 2.2),
    (1.0, 1.4),
    (0.997, 0.2),
    (0.985, -0.8),
    (0.965, -1.4),
    (0.94, -1.7),
    (0.91, -1.8),
    (0.88, -1.9),
];

/// Adds the spout: two halves of glaze, a gilt tip with its lip, and the bore.
pub(crate) fn add_spout(model: &mut Model, rim: &[usize]) {
    let path = Path::new(&[
        (87.5, 100.0),
        (106.0, 103.5),
        (124.0, 119.0),
        (133.0, 148.0),
        (137.0, 182.0),
        (144.0, 214.0),
        (158.0, 240.0),
        (173.0, 256.0),
    ]);
    let count = rim.len();
    let radius = |t: f64| mix(13.5, 6.4, step(-0.25, 1.05, t)) + 1.2 * (1.0 - step(0.0, 0.25, t));
    let row = |t: f64, radius: f64| -> Vec<DVec3> {
        (0..count).map(|j| path.around(t, j as f64 / count as f64, DVec2::splat(radius))).collect()
    };
    let root = 0.09;
    let rim = match_rim(model, rim, &row(root, radius(root)));
    let foot = row(0.02, radius(root));
    let mut rows = fillet(model, &rim, &foot, &row(root, radius(root)), FILLET);
    let glazed = 44;
    rows.extend(
        (0..=glazed).map(|k| mix(root, 0.86, k as f64 / glazed as f64)).map(|t| row(t, radius(t))),
    );
    let tip_from = rows.len();
    rows.extend(TIP.map(|(t, beyond)| row(t, radius(t) + beyond)));
    let rings = add_rings(model, rows, rim, None);
    let quarter = count / 4;
    let strip = |columns, name, part, smoothing| Strip {
        columns,
        chart: chart_named(name),
        part,
        smoothing,
    };
    let (outer, inner) = (&rings[..=tip_from], &rings[tip_from..]);
    add_strip(model, outer, &strip(3 * quarter..5 * quarter, "spout, near half", Part::Spout, 3));
    add_strip(model, outer, &strip(quarter..3 * quarter, "spout, far half", Part::Spout, 3));
    add_strip(model, inner, &strip(3 * quarter..7 * quarter, "spout, tip", Part::Tip, 7));
    let end = &rings[rings.len() - 1];
    let points = end.points.iter().map(|&p| model.points[p]);
    let pole = points.sum::<DVec3>() / count as f64;
    let pole = model.add_point(pole);
    add_cap(model, end, pole);
}

/// Closes a tube with a fan about `pole`.
fn add_cap(model: &mut Model, end: &Ring, pole: usize) {
    let count = end.points.len();
    let rim = |column: usize| {
        let around = column as f64 / count as f64;
        let flat = DVec2::from_angle(TAU * around) * end.radius;
        Corner { point: end.points[column % count], flat, along: end.along, around }
    };
    for column in 0..count {
        let (along, around) = (end.along + end.radius, (column as f64 + 0.5) / count as f64);
        let middle = Corner { point: pole, flat: DVec2::ZERO, along, around };
        model.triangles.push(Triangle {
            corners: [rim(column), rim(column + 1), middle],
            chart: chart_named("spout, bore"),
            part: Part::Bore,
            smoothing: 8,
        });
    }
}

/// Adds the handle: a rope of two strands from the neck down to the belly.
pub(crate) fn add_handle(model: &mut Model, upper: &[usize], lower: &[usize]) {
    let path = Path::new(&[
        (-28.6, 249.0),
        (-47.0, 262.0),
        (-72.0, 266.0),
        (-98.0, 252.0),
        (-112.0, 222.0),
        (-113.0, 188.0),
        (-106.0, 160.0),
        (-94.0, 140.0),
        (-81.0, 128.0),
    ]);
    let count = upper.len();
    let row = |t: f64| -> Vec<DVec3> {
        let ends = step(0.05, 0.16, t) * (1.0 - step(0.84, 0.95, t));
        let point = |j: usize| {
            let turn = j as f64 / count as f64;
            let twist = (TAU * turn - 9.0 * PI * t).cos().abs();
            let size = mix(6.4, 5.9 + 2.5 * twist, ends) + 1.6 * step(0.75, 0.96, t);
            path.around(t, turn, DVec2::new(size * 1.12, size * 0.94))
        };
        (0..count).map(point).collect()
    };
    let (start, end) = (0.07, 0.93);
    let first = match_rim(model, upper, &row(start));
    let last = match_rim(model, lower, &row(end));
    let mut rows = fillet(model, &first, &row(0.02), &row(start), FILLET);
    let plain = 78;
    rows.extend((0..=plain).map(|k| row(mix(start, end, k as f64 / plain as f64))));
    let mut landing = fillet(model, &last, &row(0.98), &row(end), FILLET);
    landing.reverse();
    rows.extend(landing);
    let rings = add_rings(model, rows, first, Some(last));
    let cut = 3 * count / 4;
    let strip = |name| Strip {
        columns: cut..cut + count,
        chart: chart_named(name),
        part: Part::Handle,
        smoothing: 3,
    };
    let split = rings.len() - 22;
    add_strip(model, &rings[..=split], &strip("handle"));
    add_strip(model, &rings[split..], &strip("handle, foot"));
}
