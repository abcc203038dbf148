//! The inscription around the neck and the mark on the underside: a stroke alphabet.

use glam::DVec2;

use crate::drawing::{COBALT, Drawing, Ink, RED};
use crate::noise::mix;

/// What the neck says, all the way around.
pub(crate) const INSCRIPTION: &str = "SEAMWISE * NO SEAM BLEEDS * ";

/// One pull of the nib.
type Pull = &'static [(f64, f64)];

/// The letters in use, as strokes on a grid 4 wide and 6 high.
const LETTERS: [(char, &[Pull]); 11] = [
    ('A', &[&[(0.0, 0.0), (2.0, 6.0)], &[(2.0, 6.0), (4.0, 0.0)], &[(0.8, 2.0), (3.2, 2.0)]]),
    (
        'B',
        &[
            &[(0.4, 0.0), (0.4, 6.0)],
            &[(0.4, 6.0), (2.4, 5.9), (3.2, 4.6), (2.4, 3.3), (0.4, 3.2)],
            &[(0.4, 3.2), (2.8, 3.1), (3.8, 1.6), (2.8, 0.1), (0.4, 0.0)],
        ],
    ),
    (
        'D',
        &[&[(0.4, 0.0), (0.4, 6.0)], &[(0.4, 6.0), (2.9, 5.9), (4.0, 3.0), (2.9, 0.1), (0.4, 0.0)]],
    ),
    (
        'E',
        &[
            &[(0.4, 0.0), (0.4, 6.0)],
            &[(0.4, 6.0), (3.5, 6.0)],
            &[(0.4, 3.1), (2.9, 3.1)],
            &[(0.4, 0.0), (3.7, 0.0)],
        ],
    ),
    ('I', &[&[(2.0, 0.0), (2.0, 6.0)]]),
    ('L', &[&[(0.5, 0.0), (0.5, 6.0)], &[(0.5, 0.0), (3.6, 0.0)]]),
    (
        'M',
        &[
            &[(0.0, 0.0), (0.4, 6.0)],
            &[(0.4, 6.0), (2.0, 1.6)],
            &[(2.0, 1.6), (3.6, 6.0)],
            &[(3.6, 6.0), (4.0, 0.0)],
        ],
    ),
    ('N', &[&[(0.3, 0.0), (0.3, 6.0)], &[(0.3, 6.0), (3.7, 0.0)], &[(3.7, 0.0), (3.7, 6.0)]]),
    (
        'O',
        &[&[
            (2.0, 6.0),
            (0.6, 5.1),
            (0.1, 3.0),
            (0.6, 0.9),
            (2.0, 0.0),
            (3.4, 0.9),
            (3.9, 3.0),
            (3.4, 5.1),
            (2.0, 6.0),
        ]],
    ),
    (
        'S',
        &[&[
            (3.6, 5.0),
            (2.2, 6.0),
            (0.8, 5.5),
            (0.5, 4.4),
            (1.3, 3.4),
            (2.7, 2.7),
            (3.6, 1.6),
            (3.1, 0.4),
            (1.7, 0.0),
            (0.3, 1.0),
        ]],
    ),
    (
        'W',
        &[
            &[(0.0, 6.0), (1.0, 0.0)],
            &[(1.0, 0.0), (2.0, 4.6)],
            &[(2.0, 4.6), (3.0, 0.0)],
            &[(3.0, 0.0), (4.0, 6.0)],
        ],
    ),
];

/// Writes a letter with its middle at `at`, `height` millimetres high, as a broad nib does: thick
/// down, thin up and across.
fn write_letter(drawing: &mut Drawing, letter: char, at: DVec2, height: f64, ink: Ink) {
    let unit = height / 6.0;
    let pulls =
        LETTERS.iter().find(|(name, _)| *name == letter).map_or(&[][..], |(_, pulls)| *pulls);
    for line in pulls {
        let place =
            |&(x, y): &(f64, f64)| (at + (DVec2::new(x, y) - DVec2::new(2.0, 3.0)) * unit).into();
        let knots: Vec<(f64, f64)> = line.iter().map(place).collect();
        let (first, last) = (DVec2::from(knots[0]), DVec2::from(knots[knots.len() - 1]));
        let fall = (first - last).normalize_or(DVec2::Y);
        let steep =
            if line.len() > 2 { 0.8 } else { (fall.x * -0.5 + fall.y.abs() * 0.8).clamp(0.0, 1.0) };
        let width = height * mix(0.10, 0.17, steep);
        drawing.stroke(&knots, [width * 0.9, width, width * 0.9], ink);
    }
}

/// The inscription as one line that closes on itself after `around` millimetres.
pub(crate) fn inscription(around: f64, height: f64) -> Drawing {
    let mut drawing = Drawing::default();
    let count = INSCRIPTION.chars().count() as f64;
    for (index, letter) in INSCRIPTION.chars().enumerate() {
        let at = DVec2::new((index as f64 + 0.5) / count * around, 0.0);
        if letter == '*' {
            for (dx, dy) in [(-1.3, 0.0), (1.3, 0.0), (0.0, 1.3), (0.0, -1.3)] {
                drawing.dot((at.x + dx, dy), 0.95, RED);
            }
            drawing.dot((at.x, 0.0), 0.6, COBALT);
        } else {
            write_letter(&mut drawing, letter, at, height, COBALT);
        }
    }
    drawing
}

/// The potter's mark: two letters in a seal within two rings.
pub(crate) fn mark() -> Drawing {
    let mut drawing = Drawing::default();
    drawing.circle((0.0, 0.0), 19.0, 0.8, COBALT);
    drawing.circle((0.0, 0.0), 17.4, 0.5, COBALT);
    drawing.stroke(&[(-8.0, -8.0), (8.0, -8.0)], [1.0; 3], COBALT);
    drawing.stroke(&[(8.0, -8.0), (8.0, 8.0)], [1.0; 3], COBALT);
    drawing.stroke(&[(8.0, 8.0), (-8.0, 8.0)], [1.0; 3], COBALT);
    drawing.stroke(&[(-8.0, 8.0), (-8.0, -8.0)], [1.0; 3], COBALT);
    write_letter(&mut drawing, 'S', DVec2::new(-3.4, 0.0), 11.0, COBALT);
    write_letter(&mut drawing, 'W', DVec2::new(3.6, 0.0), 11.0, COBALT);
    drawing
}
