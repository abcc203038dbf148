//! The medallion of the tulips, in millimetres about its middle.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use crate::drawing::{Drawing, NIGHT, RED, TURQUOISE, WHITE};
use crate::motif::frame;

/// Tulips, a carnation and saz leaves, reserved on a dark medallion.
pub(crate) fn tulips() -> Drawing {
    let mut drawing = Drawing::default();
    frame(&mut drawing, NIGHT);
    for stem in [
        [(0.0, -29.0), (-3.0, -14.0), (-12.0, -2.0), (-15.5, 9.0)],
        [(0.0, -29.0), (4.0, -14.0), (12.5, -4.0), (14.5, 6.0)],
        [(0.0, -29.0), (0.5, -14.0), (-0.5, 0.0), (0.0, 10.0)],
    ] {
        drawing.stroke(&stem, [1.1, 1.2, 1.0], TURQUOISE * 0.55);
    }
    saz(&mut drawing, &[(-1.0, -27.0), (-13.0, -22.0), (-21.5, -12.0), (-24.5, 3.0)]);
    saz(&mut drawing, &[(1.0, -27.0), (13.0, -21.0), (21.0, -12.0), (25.5, 1.0)]);
    tulip(&mut drawing, (-15.5, 8.0), 0.28, 1.0);
    tulip(&mut drawing, (14.6, 5.0), -0.22, 0.92);
    carnation(&mut drawing, (0.0, 10.0));
    for (x, y) in [(-6.5, -9.0), (6.6, -10.5), (-7.0, 25.5), (9.0, 25.0)] {
        for k in 0..5 {
            let at = DVec2::from_angle(TAU * f64::from(k) / 5.0 + x) * 1.5;
            drawing.dot((x + at.x, y + at.y), 0.85, WHITE);
        }
        drawing.dot((x, y), 0.8, RED);
    }
    drawing
}

/// A long leaf along a curve, with a white vein.
fn saz(drawing: &mut Drawing, spine: &[(f64, f64)]) {
    drawing.stroke(spine, [0.8, 8.0, 0.4], WHITE);
    drawing.stroke(spine, [0.2, 6.4, 0.1], TURQUOISE);
    drawing.stroke(spine, [0.5, 0.9, 0.3], WHITE);
    for pair in spine.windows(2) {
        let (from, to) = (DVec2::from(pair[0]), DVec2::from(pair[1]));
        for t in [0.25, 0.65] {
            let (at, along) = (from.lerp(to, t), (to - from).normalize());
            let (left, right) =
                (at + along * 2.0 + along.perp() * 2.0, at + along * 2.0 - along.perp() * 2.0);
            drawing.stroke(&[left.into(), at.into(), right.into()], [0.2, 0.7, 0.2], NIGHT);
        }
    }
}

fn tulip(drawing: &mut Drawing, at: (f64, f64), angle: f64, scale: f64) {
    let mut head = Drawing::default();
    let side = |s: f64| {
        [
            (0.0, -1.0),
            (0.0, -1.0),
            (s * 5.4, 2.5),
            (s * 4.6, 9.5),
            (s * 7.0, 17.0),
            (s * 7.0, 17.0),
            (s * 1.2, 11.0),
            (0.0, 4.0),
        ]
    };
    let middle = [
        (0.0, -0.5),
        (0.0, -0.5),
        (-3.3, 5.5),
        (-2.2, 12.0),
        (0.0, 18.0),
        (0.0, 18.0),
        (2.2, 12.0),
        (3.3, 5.5),
    ];
    for s in [-1.0, 1.0] {
        head.fill_lined(&side(s), RED, 1.1, WHITE);
    }
    head.fill_lined(&middle, RED, 1.1, WHITE);
    head.stroke(&[(0.0, 2.0), (0.0, 7.0), (0.0, 13.5)], [0.3, 0.8, 0.2], WHITE);
    drawing.place(&head, angle, DVec2::splat(scale), at);
}

/// A fan of toothed petals over a green cup.
fn carnation(drawing: &mut Drawing, at: (f64, f64)) {
    let mut head = Drawing::default();
    let mut fan = vec![(0.0, 0.0), (0.0, 0.0)];
    for tooth in 0..9 {
        let angle = |step: f64| PI * (0.93 - 0.86 * (f64::from(tooth) + step) / 8.5);
        for (step, radius) in [(0.0, 12.6), (0.5, 10.4)] {
            let (sin, cos) = angle(step).sin_cos();
            fan.extend([(radius * cos, radius * sin); 2]);
        }
    }
    head.fill_lined(&fan, WHITE, 0.4, WHITE);
    for ray in 0..9 {
        let (sin, cos) = (PI * (0.90 - 0.80 * f64::from(ray) / 8.0)).sin_cos();
        head.stroke(&[(3.0 * cos, 3.0 * sin), (10.0 * cos, 10.0 * sin)], [0.5, 1.7, 0.9], RED);
    }
    head.fill_lined(
        &[(0.0, -2.5), (0.0, -2.5), (-2.8, 0.5), (-2.6, 4.0), (0.0, 3.0), (2.6, 4.0), (2.8, 0.5)],
        TURQUOISE,
        0.8,
        WHITE,
    );
    drawing.place(&head, 0.0, DVec2::splat(1.0), at);
}
