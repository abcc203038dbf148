//! The ewer's outline: a chain of smooth curves in the (radius, height) half-plane, from the middle
//! of the underside to the top of the knob, and the relief that stands on it.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::noise::{fractal, mix, step};

/// What a piece of the surface is; it decides how it is painted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Part {
    Base,
    Foot,
    Body,
    Neck,
    Collar,
    Lid,
    Knob,
    Spout,
    Tip,
    Bore,
    Handle,
}

impl Part {
    /// Whether it is gilt metal; all else is glazed.
    pub(crate) fn is_metal(self) -> bool {
        matches!(self, Part::Foot | Part::Collar | Part::Knob | Part::Tip | Part::Bore)
    }
}

/// One stretch of the outline.
pub(crate) struct Section {
    pub(crate) part: Part,
    /// (radius, height) in millimetres; the last knot is the first of the next section.
    knots: &'static [(f64, f64)],
    /// Rows of quads.
    pub(crate) rows: usize,
    /// Sections of one number meet smoothly, others in a crease.
    pub(crate) smoothing: usize,
}

/// From the middle of the underside to the top of the knob.
pub(crate) const SECTIONS: [Section; 10] = [
    Section {
        part: Part::Base,
        knots: &[(0.0, 7.5), (15.0, 7.0), (30.0, 6.0), (39.0, 4.0), (43.0, 0.0)],
        rows: 11,
        smoothing: 0,
    },
    Section { part: Part::Foot, knots: &[(43.0, 0.0), (50.5, 0.0)], rows: 2, smoothing: 1 },
    Section {
        part: Part::Foot,
        knots: &[
            (50.5, 0.0),
            (51.2, 2.5),
            (49.0, 5.5),
            (44.0, 10.0),
            (41.0, 15.0),
            (43.2, 17.5),
            (43.0, 20.0),
            (40.0, 22.0),
        ],
        rows: 11,
        smoothing: 2,
    },
    Section {
        part: Part::Body,
        knots: &[
            (40.0, 22.0),
            (58.0, 31.0),
            (76.0, 52.0),
            (86.0, 78.0),
            (88.0, 102.0),
            (81.0, 130.0),
            (66.0, 155.0),
            (50.0, 176.0),
            (39.0, 195.0),
        ],
        rows: 52,
        smoothing: 3,
    },
    Section {
        part: Part::Neck,
        knots: &[
            (39.0, 195.0),
            (32.0, 214.0),
            (28.8, 235.0),
            (28.6, 250.0),
            (31.0, 266.0),
            (37.0, 281.0),
        ],
        rows: 25,
        smoothing: 3,
    },
    Section {
        part: Part::Collar,
        knots: &[(37.0, 281.0), (40.2, 283.0), (41.0, 286.0), (40.2, 289.0), (37.0, 291.0)],
        rows: 6,
        smoothing: 4,
    },
    Section {
        part: Part::Lid,
        knots: &[(37.0, 291.0), (36.5, 297.0), (31.0, 307.0), (21.0, 314.5), (9.0, 319.0)],
        rows: 12,
        smoothing: 5,
    },
    Section {
        part: Part::Knob,
        knots: &[
            (9.0, 319.0),
            (8.2, 321.0),
            (5.2, 323.5),
            (5.0, 327.0),
            (9.5, 331.0),
            (12.5, 337.0),
        ],
        rows: 9,
        smoothing: 6,
    },
    Section {
        part: Part::Knob,
        knots: &[(12.5, 337.0), (10.5, 343.5), (6.0, 348.0), (3.0, 352.5), (0.0, 354.5)],
        rows: 8,
        smoothing: 6,
    },
    Section { part: Part::Knob, knots: &[(0.0, 354.5)], rows: 0, smoothing: 6 },
];

/// Petals around the lower body.
pub(crate) const PETALS: f64 = 16.0;
/// The petals' roots and tips, in parts of the body's outline.
pub(crate) const PETAL_SPAN: (f64, f64) = (0.035, 0.36);
/// The frieze's lower and upper edge, in parts of the body's outline.
pub(crate) const FRIEZE_SPAN: (f64, f64) = (0.75, 0.875);

/// The outline as one dense chain with its arc length.
pub(crate) struct Profile {
    /// (radius, height), millimetres.
    chain: Vec<DVec2>,
    /// Arc length at each link of `chain`, millimetres.
    lengths: Vec<f64>,
    /// Arc length where each section starts; the last is the whole.
    starts: Vec<f64>,
}

impl Profile {
    /// Links of the chain between two knots.
    const LINKS: usize = 64;

    pub(crate) fn new() -> Self {
        let (mut chain, mut links) = (vec![], vec![]);
        for (index, section) in SECTIONS.iter().enumerate() {
            links.push(chain.len());
            let knot = |k: usize| DVec2::from(section.knots[k]);
            let count = section.knots.len();
            let smooth = |other: Option<&'static Section>| {
                other.filter(|other| other.smoothing == section.smoothing)
            };
            let before = index.checked_sub(1).and_then(|i| smooth(SECTIONS.get(i)));
            let after = smooth(SECTIONS.get(index + 1));
            let tangent = |k: usize| {
                let low = if k > 0 {
                    knot(k - 1)
                } else {
                    before.map_or(knot(0), |b| DVec2::from(b.knots[b.knots.len() - 2]))
                };
                let high = if k + 1 < count {
                    knot(k + 1)
                } else {
                    after.and_then(|a| a.knots.get(1)).map_or(knot(k), |&next| DVec2::from(next))
                };
                (high - low).normalize()
            };
            for k in 0..count - 1 {
                let span = knot(k).distance(knot(k + 1));
                let (a, b) = (tangent(k) * span, tangent(k + 1) * span);
                chain.extend((0..Self::LINKS).map(|link| {
                    hermite(knot(k), a, knot(k + 1), b, link as f64 / Self::LINKS as f64)
                }));
            }
        }
        chain.push(DVec2::from(SECTIONS[SECTIONS.len() - 1].knots[0]));
        let lengths = arc_lengths(&chain);
        let starts = links.iter().map(|&link| lengths[link]).collect();
        Self { chain, lengths, starts }
    }

    /// Arc length at a (fractional) row of a section.
    pub(crate) fn length_at(&self, section: usize, row: f64) -> f64 {
        let (start, end) = (self.starts[section], self.starts[section + 1]);
        mix(start, end, row / SECTIONS[section].rows as f64)
    }

    /// Arc length where a part begins and ends.
    pub(crate) fn span(&self, part: Part) -> (f64, f64) {
        let first = SECTIONS.iter().position(|s| s.part == part).unwrap_or(0);
        let last = SECTIONS.iter().rposition(|s| s.part == part && s.rows > 0).unwrap_or(0);
        (self.starts[first], self.starts[last + 1])
    }

    /// (radius, height) at an arc length, without relief.
    pub(crate) fn at(&self, length: f64) -> DVec2 {
        interpolate(&self.chain, &self.lengths, length)
    }

    /// The point of the surface at an arc length and a turn (in turns about the axis, seen from
    /// above counter-clockwise), with its relief and the wobble of a hand-thrown pot.
    pub(crate) fn surface(&self, section: usize, row: f64, turn: f64) -> DVec3 {
        let length = self.length_at(section, row);
        let flat = self.at(length);
        let along = self.at(length + 0.4) - self.at(length - 0.4);
        let out = DVec2::new(along.y, -along.x).normalize_or(DVec2::Y);
        let angle = TAU * turn;
        let place = |p: DVec2| DVec3::new(p.x * angle.cos(), p.y, -p.x * angle.sin());
        let wobble = 0.6 * fractal(place(flat) / 45.0, 2, 11) * step(2.0, 25.0, flat.x);
        let part = SECTIONS[section].part;
        let (start, end) = self.span(part);
        place(flat + out * (wobble + relief(part, turn, (length - start) / (end - start))))
    }
}

/// How far the form stands out of its outline, in millimetres. `along` runs 0…1 over the part.
/// Zero at both ends of a part, so that parts meet.
pub(crate) fn relief(part: Part, turn: f64, along: f64) -> f64 {
    match part {
        Part::Body => {
            let (low, high) = FRIEZE_SPAN;
            let band = step(low, low + 0.03, along) * (1.0 - step(high - 0.03, high, along));
            let swell = (TAU * PETALS * turn - 40.0 * (along - low)).sin();
            4.6 * petal(turn, along) + band * (0.9 + 0.6 * swell)
        }
        Part::Lid => {
            let lobe = (PI * PETALS * turn).sin().abs();
            1.9 * lobe * step(0.05, 0.25, along) * (1.0 - step(0.55, 0.95, along))
        }
        Part::Knob => 1.1 * (PI * 16.0 * turn).cos().abs() * bump(along, 0.55, 0.25),
        Part::Foot => 1.3 * (PI * 16.0 * turn).cos().abs() * bump(along, 0.52, 0.22),
        _ => 0.0,
    }
}

/// The pillow of a petal: 0 on its outline and outside, 1 on its back.
pub(crate) fn petal(turn: f64, along: f64) -> f64 {
    let (low, high) = PETAL_SPAN;
    let up = (along - low) / (high - low);
    if !(0.0..1.0).contains(&up) {
        return 0.0;
    }
    let across = (PETALS * turn).rem_euclid(1.0) - 0.5;
    let width = 0.5 * (1.0 - up.powi(4)).sqrt();
    let inside = (1.0 - (across / width).powi(2)).max(0.0);
    inside.powf(0.8) * step(0.0, 0.18, up) * (1.0 - step(0.55, 1.0, up) * 0.75)
}

fn bump(value: f64, center: f64, radius: f64) -> f64 {
    step(0.0, 1.0, 1.0 - ((value - center) / radius).abs())
}

/// Cubic Hermite curve from `p` with tangent `a` to `q` with tangent `b`.
fn hermite(p: DVec2, a: DVec2, q: DVec2, b: DVec2, t: f64) -> DVec2 {
    let (t2, t3) = (t * t, t * t * t);
    p * (2.0 * t3 - 3.0 * t2 + 1.0)
        + a * (t3 - 2.0 * t2 + t)
        + q * (3.0 * t2 - 2.0 * t3)
        + b * (t3 - t2)
}

/// The smooth chain through `knots` (Catmull-Rom tangents of chord length), `links` a span.
pub(crate) fn curve_through(knots: &[DVec2], links: usize) -> Vec<DVec2> {
    let last = knots.len() - 1;
    let tangent = |k: usize| (knots[(k + 1).min(last)] - knots[k.saturating_sub(1)]).normalize();
    let mut chain = vec![];
    for k in 0..last {
        let span = knots[k].distance(knots[k + 1]);
        chain.extend((0..links).map(|link| {
            let t = link as f64 / links as f64;
            hermite(knots[k], tangent(k) * span, knots[k + 1], tangent(k + 1) * span, t)
        }));
    }
    chain.push(knots[last]);
    chain
}

/// Arc length at every link of a chain.
pub(crate) fn arc_lengths(chain: &[DVec2]) -> Vec<f64> {
    let mut lengths = vec![0.0];
    for pair in chain.windows(2) {
        lengths.push(lengths[lengths.len() - 1] + pair[0].distance(pair[1]));
    }
    lengths
}

/// The point of a chain at an arc length, clamped to its ends.
pub(crate) fn interpolate(chain: &[DVec2], lengths: &[f64], length: f64) -> DVec2 {
    let after = lengths.partition_point(|&l| l <= length).clamp(1, chain.len() - 1);
    let span = lengths[after] - lengths[after - 1];
    let t = ((length - lengths[after - 1]) / span).clamp(0.0, 1.0);
    chain[after - 1].lerp(chain[after], t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outline_runs_from_pole_to_pole_through_every_knot() {
        let profile = Profile::new();
        let whole = profile.lengths[profile.lengths.len() - 1];
        assert_eq!(profile.at(0.0), DVec2::new(0.0, 7.5));
        assert_eq!(profile.at(whole), DVec2::new(0.0, 354.5));
        for knot in SECTIONS.iter().flat_map(|section| section.knots) {
            let nearest = |p: &DVec2| p.distance(DVec2::from(*knot));
            assert!(profile.chain.iter().map(nearest).fold(f64::MAX, f64::min) < 1e-9);
        }
    }

    #[test]
    fn relief_is_zero_where_parts_meet() {
        for part in SECTIONS.map(|section| section.part) {
            for turn in [0.0, 0.013, 0.4] {
                assert_eq!((relief(part, turn, 0.0), relief(part, turn, 1.0)), (0.0, 0.0));
            }
        }
    }
}
