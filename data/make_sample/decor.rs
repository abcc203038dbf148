//! Which motif lies where on the ewer. Everything is asked of a point of the surface, never of a
//! texel, so the painting runs on across every seam.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::drawing::{COBALT, Drawing, Ink, NIGHT, RED, TURQUOISE, WASH, WHITE};
use crate::motif::{MEDALLION, petal, spiral, wave};
use crate::noise::{fractal, step};
use crate::profile::{FRIEZE_SPAN, PETAL_SPAN, PETALS, Part, Profile};
use crate::script::{inscription, mark};
use crate::ship::ship;
use crate::tulips::tulips;

/// A point of the surface, as the painter sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    /// Millimetres.
    pub(crate) position: DVec3,
    pub(crate) part: Part,
    /// Arc length along the outline or the tube, millimetres.
    pub(crate) along: f64,
    /// Around a tube, in turns.
    pub(crate) around: f64,
    /// See [`crate::model::Model::hollows`].
    pub(crate) hollow: f64,
}

impl Spot {
    /// Turns about the ewer's axis, −½…½.
    fn turn(&self) -> f64 {
        (-self.position.z).atan2(self.position.x) / TAU
    }

    /// Millimetres from the ewer's axis.
    pub(crate) fn radius(&self) -> f64 {
        self.position.x.hypot(self.position.z)
    }
}

/// All motifs, drawn once.
pub(crate) struct Decor {
    profile: Profile,
    spiral: Drawing,
    petal: Drawing,
    wave: Drawing,
    ship: Drawing,
    tulips: Drawing,
    inscription: Drawing,
    mark: Drawing,
}

/// Circumference that the inscription is drawn for, millimetres.
const SCRIPT_AROUND: f64 = 200.0;
/// Spirals around the belly and rows of them.
const SPIRALS: (f64, f64) = (26.0, 4.0);
/// The painted field of the belly, in parts of the body's outline.
const FIELD: (f64, f64) = (0.375, 0.735);

/// A line of `width` about `center`, drawn by a hand: 1 on it.
fn line(at: f64, center: f64, width: f64) -> f64 {
    1.0 - step(width / 2.0 - 0.2, width / 2.0 + 0.2, (at - center).abs())
}

impl Decor {
    pub(crate) fn new() -> Self {
        Self {
            profile: Profile::new(),
            spiral: spiral(),
            petal: petal(),
            wave: wave(),
            ship: ship(),
            tulips: tulips(),
            inscription: inscription(SCRIPT_AROUND, 10.5),
            mark: mark(),
        }
    }

    /// The ink at a point of the glaze.
    pub(crate) fn ink(&self, spot: &Spot) -> Ink {
        // The hand is not a ruler: everything is drawn a quarter of a millimetre off.
        let shake = |seed| 0.45 * fractal(spot.position / 11.0, 2, seed);
        let (start, end) = match spot.part {
            Part::Spout | Part::Handle => (0.0, 1.0),
            part => self.profile.span(part),
        };
        let hand = DVec2::new(shake(91), shake(92));
        let up = spot.along - start + hand.y;
        match spot.part {
            Part::Body => self.body(spot, up, end - start, hand),
            Part::Neck => self.neck(spot, up, end - start, hand),
            Part::Lid => self.lid(spot, up, end - start),
            Part::Base => {
                self.mark.over(DVec2::new(spot.position.x, spot.position.z) + hand, WHITE)
            }
            Part::Spout => spout(spot, up),
            Part::Handle => handle(spot, up),
            _ => WHITE,
        }
    }

    /// Whether the raised frieze of waves is here.
    pub(crate) fn in_frieze(&self, spot: &Spot) -> bool {
        let (start, end) = self.profile.span(Part::Body);
        let part = (spot.along - start) / (end - start);
        spot.part == Part::Body && (FRIEZE_SPAN.0..FRIEZE_SPAN.1).contains(&part)
    }

    /// A row of petals about the axis: `up` runs 0…1 from root to tip.
    fn petals(&self, turn: f64, up: f64, under: Ink) -> Ink {
        let across = (PETALS * turn).rem_euclid(1.0) - 0.5;
        self.petal.over(DVec2::new(across, up) * 30.0, under)
    }

    fn body(&self, spot: &Spot, up: f64, whole: f64, hand: DVec2) -> Ink {
        let (turn, part) = (spot.turn() + hand.x / (TAU * spot.radius()), up / whole);
        let mut ink = WHITE;
        if part > FIELD.0 && part < FIELD.1 {
            ink = self.field(spot, up - FIELD.0 * whole, (FIELD.1 - FIELD.0) * whole, turn);
        } else if part < PETAL_SPAN.1 + 0.02 {
            ink = ink
                .lerp(TURQUOISE * 0.8, step(0.06, 0.08, part) * (1.0 - step(0.345, 0.355, part)));
            ink = self.petals(
                turn,
                1.08 * (part - PETAL_SPAN.0) / (PETAL_SPAN.1 - PETAL_SPAN.0),
                ink,
            );
        } else if part > FRIEZE_SPAN.0 && part < FRIEZE_SPAN.1 {
            let across = (PETALS * turn).rem_euclid(1.0) - 0.5;
            let high = (part - FRIEZE_SPAN.0) / (FRIEZE_SPAN.1 - FRIEZE_SPAN.0) - 0.5;
            ink = self.wave.over(DVec2::new(across * 26.0, high * 24.0), ink);
        } else if part > 0.90 {
            ink = ink.lerp(TURQUOISE * 0.8, step(0.905, 0.91, part));
            ink = self.petals(turn + 0.5 / PETALS, (part - 0.903) / 0.1, ink);
        }
        for (at, width, color) in [
            (0.012, 1.6, COBALT),
            (0.028, 0.6, COBALT),
            (0.357, 1.4, COBALT),
            (0.368, 0.6, COBALT),
            (0.742, 0.6, COBALT),
            (0.751, 1.4, COBALT),
            (0.876, 1.4, COBALT),
            (0.885, 0.6, COBALT),
            (0.894, 1.0, RED),
        ] {
            ink = ink.lerp(color, line(up, at * whole, width));
        }
        ink
    }

    /// The belly: spirals, and on them the two medallions and the roots of spout and handle.
    fn field(&self, spot: &Spot, up: f64, high: f64, turn: f64) -> Ink {
        let row = (up / high * SPIRALS.1).floor();
        let column = SPIRALS.0 * turn + 0.5 * row;
        let flip = if column.floor().rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
        let x = (column.rem_euclid(1.0) - 0.5) * 21.0 * flip;
        let y = (up / high * SPIRALS.1 - row - 0.5) * 22.6;
        let mut ink = self.spiral.over(DVec2::new(x, y), WHITE);
        for (center, drawing) in [(0.25, &self.ship), (-0.25, &self.tulips)] {
            let across = (turn - center) * TAU * spot.radius();
            let at = DVec2::new(across, up - 0.5 * high);
            if at.length() < MEDALLION + 6.0 {
                ink = ink.lerp(WHITE, 1.0 - step(MEDALLION + 5.0, MEDALLION + 5.5, at.length()));
                ink = drawing.over(at, ink);
            }
        }
        ink
    }

    fn neck(&self, spot: &Spot, up: f64, whole: f64, hand: DVec2) -> Ink {
        let (turn, part) = (spot.turn() + hand.x / (TAU * spot.radius()), up / whole);
        let mut ink = WHITE;
        if (0.08..0.33).contains(&part) {
            let across = (turn + 0.25).rem_euclid(1.0) * SCRIPT_AROUND;
            ink = self.inscription.over(DVec2::new(across, up - 0.205 * whole), ink);
        } else if (0.36..0.60).contains(&part) {
            ink = diaper(turn, up - 0.36 * whole, ink);
        } else if part > 0.62 {
            ink = ink.lerp(TURQUOISE * 0.8, step(0.66, 0.67, part));
            ink = self.petals(turn, (0.985 - part) / 0.34, ink);
        }
        for (at, width, color) in [
            (0.01, 1.0, RED),
            (0.05, 0.6, COBALT),
            (0.066, 1.3, COBALT),
            (0.335, 1.3, COBALT),
            (0.352, 0.6, COBALT),
            (0.60, 0.6, COBALT),
            (0.617, 1.3, COBALT),
            (0.99, 1.6, COBALT),
        ] {
            ink = ink.lerp(color, line(up, at * whole, width));
        }
        ink
    }

    fn lid(&self, spot: &Spot, up: f64, whole: f64) -> Ink {
        let part = up / whole;
        let ink = TURQUOISE * 0.8 * step(0.10, 0.11, part) * (1.0 - step(0.9, 0.91, part));
        let mut ink = self.petals(spot.turn(), (part - 0.09) / 0.83, ink);
        for (at, width) in [(0.02, 1.6), (0.075, 0.6), (0.95, 2.0)] {
            ink = ink.lerp(COBALT, line(up, at * whole, width));
        }
        ink
    }
}

/// Lozenges of fine line with a dot in each; 20 around, 5.4 mm high.
fn diaper(turn: f64, up: f64, under: Ink) -> Ink {
    let (a, b) = (20.0 * turn + up / 10.8, 20.0 * turn - up / 10.8);
    let to_line = |value: f64| (value.rem_euclid(1.0) - 0.5).abs() * 9.4;
    let grid = 1.0 - step(0.2, 0.6, (4.7 - to_line(a)).min(4.7 - to_line(b)));
    let middle = to_line(a).hypot(to_line(b));
    let ink = under.lerp(COBALT, grid).lerp(COBALT, 1.0 - step(1.3, 1.6, middle));
    ink.lerp(TURQUOISE, 1.0 - step(0.8, 1.0, middle))
}

/// Rings at the root and at the tip, and scales between them.
fn spout(spot: &Spot, up: f64) -> Ink {
    let mut ink = WASH * 0.3;
    let (from, to) = (21.0, 181.0);
    if (from..to).contains(&up) {
        let scale = 9.5;
        let at = |row: f64| {
            let across = 10.0 * spot.around + 0.5 * row;
            DVec2::new((across.rem_euclid(1.0) - 0.5) * 1.06, (up - from) / scale - row)
        };
        // A scale hangs over the row below it: the upper row with a disc here wins.
        let row = ((up - from) / scale).floor();
        let depth = |p: DVec2| (1.0 - p.length() / 0.62) * scale * 0.62;
        let p = [at(row), at(row + 1.0)].into_iter().find(|p| depth(*p) > 0.0).unwrap_or(at(row));
        let inside = depth(p);
        let wash = COBALT * (0.10 + 0.55 * step(2.2, 5.4, inside));
        ink = wash.lerp(COBALT, 1.0 - step(0.55, 0.95, inside));
        ink = ink.lerp(RED, 1.0 - step(0.9, 1.2, (p - DVec2::new(0.0, 0.34)).length() * scale));
    }
    for (center, width, color) in [
        (1.2, 2.2, COBALT),
        (4.0, 0.7, COBALT),
        (11.0, 6.0, TURQUOISE),
        (7.4, 0.8, COBALT),
        (14.6, 0.8, COBALT),
        (19.4, 2.4, COBALT),
        (181.0, 1.6, COBALT),
        (184.0, 0.7, COBALT),
    ] {
        ink = ink.lerp(color, line(up, center, width));
    }
    ink
}

/// Stripes that follow the rope's strands, and rings at the root.
fn handle(spot: &Spot, up: f64) -> Ink {
    let strand = (2.0 * spot.around - up / 29.0).rem_euclid(1.0);
    let off = (strand - 0.5).abs() * 2.0;
    let mut ink = (WASH * 0.3).lerp(NIGHT, 1.0 - step(0.20, 0.24, off));
    ink = ink.lerp(COBALT, line(off, 0.34, 0.05) + line(off, 0.9, 0.1));
    let dot = DVec2::new((off - 0.62) * 8.0, ((up / 4.2).rem_euclid(1.0) - 0.5) * 4.2);
    ink = ink.lerp(TURQUOISE, 1.0 - step(1.0, 1.4, dot.length()));
    for (center, width) in [(1.0, 2.0), (4.2, 0.8)] {
        ink = ink.lerp(COBALT, line(up, center, width));
    }
    ink
}
