//! The motifs of the bands and the belly, each drawn once in millimetres about its own origin, y up.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use crate::drawing::{COBALT, Drawing, Ink, NIGHT, RED, TURQUOISE, WASH, WHITE};

/// Radius of the medallions' inside.
pub(crate) const MEDALLION: f64 = 33.0;

/// A spiral of fine tendrils with leaves and a flower in the middle, about 21 mm wide: the filling
/// of the belly.
pub(crate) fn spiral() -> Drawing {
    let mut drawing = Drawing::default();
    let arm = |t: f64| DVec2::from_angle(0.4 + 4.4 * PI * t) * (10.4 - 7.4 * t);
    let chain: Vec<DVec2> = (0..=56).map(|k| arm(f64::from(k) / 56.0)).collect();
    drawing.trace(chain, [0.85, 0.7, 0.5], COBALT);
    for leaf in 0..15 {
        let t = 0.02 + f64::from(leaf) * 0.055;
        let (at, ahead) = (arm(t), (arm(t + 0.01) - arm(t)).normalize());
        let side = if leaf % 2 == 0 { ahead.perp() } else { -ahead.perp() };
        let tip = at + ahead * 1.5 + side * 1.55;
        let bend = at + ahead * 1.1 + side * 0.45;
        drawing.stroke(&[at.into(), bend.into(), tip.into()], [0.5, 1.25, 0.3], COBALT);
    }
    flower(&mut drawing, (0.0, 0.0), 3.3, 6);
    drawing
}

/// A flower of `petals` turquoise petals about a red heart.
fn flower(drawing: &mut Drawing, (x, y): (f64, f64), radius: f64, petals: u32) {
    for ink in [COBALT, TURQUOISE] {
        let size = if ink == COBALT { 0.44 } else { 0.30 };
        for petal in 0..petals {
            let (sin, cos) = (TAU * f64::from(petal) / f64::from(petals)).sin_cos();
            let center = (x + 0.68 * radius * cos, y + 0.68 * radius * sin);
            drawing.dot(center, size * radius, ink);
        }
    }
    drawing.dot((x, y), 0.46 * radius, COBALT);
    drawing.dot((x, y), 0.34 * radius, RED);
}

/// A petal of the lower body, 30 mm wide and high from its root at the origin.
pub(crate) fn petal() -> Drawing {
    let mut drawing = Drawing::default();
    let leaf = |w: f64, low: f64, high: f64| {
        [
            (-w, low),
            (-w, low),
            (-w * 0.98, high * 0.45),
            (-w * 0.66, high * 0.82),
            (0.0, high),
            (0.0, high),
            (w * 0.66, high * 0.82),
            (w * 0.98, high * 0.45),
            (w, low),
            (w, low),
        ]
    };
    drawing.fill(&leaf(15.2, -1.0, 31.5), NIGHT);
    drawing.fill(&leaf(13.2, -1.0, 29.4), WHITE);
    drawing.fill_lined(&leaf(11.4, 0.0, 26.6), WASH, 0.6, COBALT);
    palmette(&mut drawing);
    drawing
}

/// A red heart with turquoise wings and cobalt veins, in the middle of a petal.
fn palmette(drawing: &mut Drawing) {
    drawing.fill_lined(
        &[
            (0.0, 4.0),
            (0.0, 4.0),
            (-4.6, 10.0),
            (-3.0, 16.0),
            (0.0, 21.5),
            (0.0, 21.5),
            (3.0, 16.0),
            (4.6, 10.0),
        ],
        WHITE,
        0.7,
        COBALT,
    );
    drawing
        .fill(&[(0.0, 7.0), (-2.5, 11.5), (0.0, 18.0), (0.0, 18.0), (2.5, 11.5), (0.0, 7.0)], RED);
    for side in [-1.0, 1.0] {
        drawing.fill_lined(
            &[
                (side * 1.5, 2.5),
                (side * 1.5, 2.5),
                (side * 6.5, 5.5),
                (side * 8.6, 12.5),
                (side * 8.6, 12.5),
                (side * 5.6, 8.0),
            ],
            TURQUOISE,
            0.55,
            COBALT,
        );
        drawing.stroke(
            &[(side * 1.0, 22.0), (side * 4.0, 20.0), (side * 6.0, 16.0)],
            [0.3, 1.1, 0.4],
            COBALT,
        );
        drawing.dot((side * 8.2, 16.0), 0.7, COBALT);
    }
}

/// One wave of the frieze, 26 mm long and about 20 mm high, centred; waves join end to end.
pub(crate) fn wave() -> Drawing {
    let mut drawing = Drawing::default();
    drawing.fill(
        &[
            (-13.0, -10.5),
            (-13.0, -10.5),
            (-13.0, -5.8),
            (-13.0, -5.8),
            (-6.0, -4.0),
            (-1.0, 2.6),
            (3.0, 6.2),
            (3.0, 6.2),
            (8.0, 0.0),
            (13.0, -5.8),
            (13.0, -5.8),
            (13.0, -10.5),
            (13.0, -10.5),
        ],
        TURQUOISE * 0.8,
    );
    let curl =
        |t: f64| DVec2::new(3.2, 1.6) + DVec2::from_angle(PI * (0.93 - 2.35 * t)) * (6.6 - 5.4 * t);
    let mut crest = vec![
        DVec2::new(-17.0, -5.4),
        DVec2::new(-13.0, -5.8),
        DVec2::new(-8.0, -4.6),
        DVec2::new(-5.0, -1.6),
    ];
    crest.extend((0..=36).map(|k| curl(f64::from(k) / 36.0)));
    drawing.trace(crest, [2.2, 3.0, 0.9], NIGHT);
    for k in 0..6 {
        let (t, out) = (0.05 + 0.085 * f64::from(k), 2.6 - 0.15 * f64::from(k));
        let at = DVec2::new(3.2, 1.6)
            + (curl(t) - DVec2::new(3.2, 1.6)).normalize() * (6.6 - 5.4 * t + out);
        drawing.dot(at.into(), 0.75 - 0.05 * f64::from(k), COBALT);
    }
    for (y, from, to) in [(-7.6, -12.0, 8.0), (-9.0, -6.0, 12.0)] {
        let middle = 0.5 * (from + to);
        drawing.stroke(&[(from, y), (middle, y + 0.5), (to, y)], [0.2, 0.7, 0.2], COBALT);
    }
    drawing.stroke(&[(6.5, -3.6), (9.5, -4.6), (13.0, -5.6)], [0.3, 0.8, 0.5], COBALT);
    drawing.dot((-9.5, 4.5), 1.3, RED);
    drawing
}

/// The border of a medallion: a ground, rings and a row of beads.
pub(crate) fn frame(drawing: &mut Drawing, ground: Ink) {
    drawing.dot((0.0, 0.0), MEDALLION + 4.4, COBALT);
    drawing.dot((0.0, 0.0), MEDALLION + 3.6, WHITE);
    for bead in 0..48 {
        let at = DVec2::from_angle(TAU * f64::from(bead) / 48.0) * (MEDALLION + 2.1);
        drawing.dot(at.into(), 0.85, if bead % 2 == 0 { RED } else { TURQUOISE });
    }
    drawing.dot((0.0, 0.0), MEDALLION + 0.8, COBALT);
    drawing.dot((0.0, 0.0), MEDALLION - 0.3, ground);
}
