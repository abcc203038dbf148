//! The medallion of the ship, in millimetres about its middle.

use std::f64::consts::PI;

use crate::drawing::{COBALT, Drawing, RED, TURQUOISE, WASH, WHITE};
use crate::motif::frame;

/// A ship under three sails in a round medallion.
pub(crate) fn ship() -> Drawing {
    let mut drawing = Drawing::default();
    frame(&mut drawing, WHITE);
    sea(&mut drawing);
    rigging(&mut drawing);
    sails(&mut drawing);
    hull(&mut drawing);
    drawing.fill_lined(
        &[
            (-22.5, 11.0),
            (-22.5, 11.0),
            (-25.5, 14.0),
            (-23.5, 18.0),
            (-19.5, 18.2),
            (-19.5, 18.2),
            (-22.4, 15.6),
        ],
        RED,
        0.5,
        COBALT,
    );
    for (x, y) in [(23.0, 14.0), (20.0, 19.5), (26.0, 8.0)] {
        for (dx, dy) in [(0.0, 0.0), (2.0, 0.9), (1.2, -1.3)] {
            drawing.dot((x + dx, y + dy), 0.62, COBALT);
        }
    }
    drawing
}

fn sea(drawing: &mut Drawing) {
    let half = |y: f64| (32.3f64.powi(2) - y * y).sqrt();
    let mut knots = vec![(-half(-15.0), -15.0), (-half(-15.0), -15.0)];
    knots.extend((1..12).map(|k| {
        let angle = PI + 0.46 + (PI - 0.92) * f64::from(k) / 12.0;
        (32.3 * angle.cos(), 32.3 * angle.sin())
    }));
    knots.extend([(half(-15.0), -15.0); 2]);
    drawing.fill(&knots, TURQUOISE * 0.55);
    for (row, y) in [-16.0, -20.0, -24.0, -28.0].into_iter().enumerate() {
        let (width, shift) = (7.0, if row % 2 == 0 { 0.0 } else { 3.5 });
        for k in -5..=5 {
            let x = f64::from(k) * width + shift;
            if x.abs() + 3.0 < half(y) {
                drawing.stroke(
                    &[
                        (x - 3.4, y - 0.8),
                        (x - 1.6, y + 1.2),
                        (x + 0.6, y + 1.4),
                        (x + 1.7, y + 0.2),
                        (x + 0.8, y - 0.6),
                    ],
                    [0.3, 0.95, 0.4],
                    COBALT,
                );
            }
        }
    }
}

fn rigging(drawing: &mut Drawing) {
    for (x, top) in [(-13.0, 17.0), (1.5, 26.0), (14.5, 18.0)] {
        drawing.stroke(&[(x, -8.0), (x + 0.2, 6.0), (x + 0.2, top)], [1.1, 1.0, 0.7], COBALT);
        drawing.stroke(&[(x, top), (x - 8.0, -5.0)], [0.3, 0.3, 0.3], COBALT);
        drawing.stroke(&[(x, top), (x + 8.0, -5.0)], [0.3, 0.3, 0.3], COBALT);
        // A pennant that flies to the left.
        drawing.fill(
            &[
                (x, top),
                (x, top),
                (x - 3.0, top + 0.9),
                (x - 7.5, top - 0.6),
                (x - 7.5, top - 0.6),
                (x - 3.2, top - 1.6),
                (x, top - 2.4),
                (x, top - 2.4),
            ],
            RED,
        );
    }
    drawing.stroke(&[(21.0, -4.0), (29.0, 1.5)], [0.9, 0.7, 0.4], COBALT);
    drawing.stroke(&[(29.0, 1.5), (14.7, 18.0)], [0.3, 0.3, 0.3], COBALT);
}

fn sails(drawing: &mut Drawing) {
    for (x, y, w, h) in [(-13.0, 5.0, 5.6, 7.5), (1.5, 11.0, 7.2, 10.0), (14.5, 5.6, 5.6, 8.0)] {
        let sail = [
            (x - w, y + h),
            (x - w, y + h),
            (x + w, y + h),
            (x + w, y + h),
            (x + w + 3.0, y),
            (x + w * 1.05, y - h),
            (x + w * 1.05, y - h),
            (x, y - h + 2.2),
            (x - w * 1.05, y - h),
            (x - w * 1.05, y - h),
            (x - w + 3.0, y),
        ];
        drawing.fill_lined(&sail, WHITE, 0.9, COBALT);
        for stripe in 0..3 {
            let left = x - w + 2.0 * w * (0.12 + 0.3 * f64::from(stripe));
            drawing.stroke(
                &[(left + 0.8, y + h - 0.8), (left + 3.4, y), (left + 0.6, y - h + 2.0)],
                [1.2, 1.9, 1.2],
                if stripe == 1 { RED } else { WASH * 1.7 },
            );
        }
        drawing.stroke(&[(x - w - 1.2, y + h), (x + w + 1.2, y + h)], [0.6, 1.0, 0.6], COBALT);
    }
}

fn hull(drawing: &mut Drawing) {
    let sheer = [
        (-25.0, 1.5),
        (-25.0, 1.5),
        (-17.0, -4.0),
        (-6.0, -6.6),
        (8.0, -6.4),
        (17.0, -4.2),
        (25.0, 0.5),
        (25.0, 0.5),
        (20.5, -9.0),
        (13.0, -15.5),
        (13.0, -15.5),
        (0.0, -16.6),
        (-13.0, -15.5),
        (-13.0, -15.5),
        (-21.0, -9.0),
    ];
    drawing.fill_lined(&sheer, TURQUOISE, 1.1, COBALT);
    drawing.stroke(
        &[(-23.0, -3.0), (-13.0, -8.4), (0.0, -9.8), (14.0, -8.2), (22.8, -3.8)],
        [1.6, 2.0, 1.6],
        WHITE,
    );
    for k in 0..11 {
        let x = -18.0 + 3.7 * f64::from(k);
        drawing.dot((x, -9.7 + 0.0103 * (x * x)), 0.75, RED);
    }
    for (y, w) in [(-11.8, 16.5), (-13.8, 13.5)] {
        drawing.stroke(&[(-w, y + 1.4), (0.0, y), (w, y + 1.4)], [0.4, 0.55, 0.4], COBALT);
    }
    drawing.fill_lined(
        &[
            (-26.0, 1.5),
            (-26.0, 1.5),
            (-26.5, 6.0),
            (-26.5, 6.0),
            (-18.0, 2.5),
            (-18.0, 2.5),
            (-17.4, -3.4),
            (-17.4, -3.4),
        ],
        WASH * 1.6,
        0.9,
        COBALT,
    );
}
