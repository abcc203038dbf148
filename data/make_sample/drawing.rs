//! Brush and line on a plane, in millimetres: filled outlines and tapering strokes, laid one over
//! the other.

use std::f64::consts::TAU;

use glam::{DVec2, DVec4};

use crate::noise::{mix, step};
use crate::profile::curve_through;

/// How much of each pigment lies on the glaze, and how far the paint stands up:
/// (cobalt, turquoise, bole red, relief), each 0…1.
pub(crate) type Ink = DVec4;

/// Bare glaze.
pub(crate) const WHITE: Ink = DVec4::ZERO;
/// Cobalt line.
pub(crate) const COBALT: Ink = DVec4::new(1.0, 0.0, 0.0, 0.25);
/// Cobalt ground, darker than line.
pub(crate) const NIGHT: Ink = DVec4::new(1.15, 0.1, 0.0, 0.1);
/// Thin cobalt.
pub(crate) const WASH: Ink = DVec4::new(0.26, 0.05, 0.0, 0.05);
/// Copper turquoise.
pub(crate) const TURQUOISE: Ink = DVec4::new(0.04, 0.9, 0.0, 0.2);
/// The thick iron-red slip of Iznik.
pub(crate) const RED: Ink = DVec4::new(0.0, 0.0, 1.0, 1.0);

/// One mark.
struct Shape {
    /// A stroke's spine or a fill's closed outline.
    line: Vec<DVec2>,
    /// A stroke's half width at its start, middle and end; `None` fills.
    widths: Option<[f64; 3]>,
    ink: Ink,
    low: DVec2,
    high: DVec2,
}

/// Marks in the order they are laid.
#[derive(Default)]
pub(crate) struct Drawing {
    shapes: Vec<Shape>,
}

/// Half the width of an edge's blur: about a third of a texel of the sample's atlas.
const BLUR: f64 = 0.2;

impl Drawing {
    fn add(&mut self, line: Vec<DVec2>, widths: Option<[f64; 3]>, ink: Ink) {
        let margin = DVec2::splat(widths.map_or(0.0, |w| w[0].max(w[1]).max(w[2])) + BLUR);
        let low = line.iter().fold(DVec2::MAX, |low, &p| low.min(p)) - margin;
        let high = line.iter().fold(DVec2::MIN, |high, &p| high.max(p)) + margin;
        self.shapes.push(Shape { line, widths, ink, low, high });
    }

    /// A stroke through `knots` whose width swells from `widths[0]` over `widths[1]` to
    /// `widths[2]`.
    pub(crate) fn stroke(&mut self, knots: &[(f64, f64)], widths: [f64; 3], ink: Ink) {
        self.add(smooth(knots), Some(widths.map(|w| w / 2.0)), ink);
    }

    /// A stroke along a chain that is already smooth.
    pub(crate) fn trace(&mut self, chain: Vec<DVec2>, widths: [f64; 3], ink: Ink) {
        self.add(chain, Some(widths.map(|w| w / 2.0)), ink);
    }

    /// Fills the smooth outline through `knots`; a knot named twice in a row is a corner.
    pub(crate) fn fill(&mut self, knots: &[(f64, f64)], ink: Ink) {
        self.add(outline(knots), None, ink);
    }

    /// Fills an outline and draws along it.
    pub(crate) fn fill_lined(&mut self, knots: &[(f64, f64)], ink: Ink, width: f64, line: Ink) {
        self.fill(knots, ink);
        self.add(outline(knots), Some([width / 2.0; 3]), line);
    }

    /// A filled disc.
    pub(crate) fn dot(&mut self, center: (f64, f64), radius: f64, ink: Ink) {
        self.add(vec![DVec2::from(center); 2], Some([radius; 3]), ink);
    }

    /// A circle's line.
    pub(crate) fn circle(&mut self, center: (f64, f64), radius: f64, width: f64, ink: Ink) {
        let at = |k: usize| DVec2::from(center) + DVec2::from_angle(TAU * k as f64 / 72.0) * radius;
        self.add((0..=72).map(at).collect(), Some([width / 2.0; 3]), ink);
    }

    /// Another drawing's marks, turned by `angle` (radians), scaled and moved.
    pub(crate) fn place(&mut self, other: &Drawing, angle: f64, scale: DVec2, offset: (f64, f64)) {
        let turn = DVec2::from_angle(angle);
        let size = scale.abs().min_element();
        for shape in &other.shapes {
            let line = shape.line.iter().map(|&p| turn.rotate(p * scale) + DVec2::from(offset));
            self.add(line.collect(), shape.widths.map(|w| w.map(|w| w * size)), shape.ink);
        }
    }

    /// The ink at a point over the ink that was there.
    pub(crate) fn over(&self, at: DVec2, mut under: Ink) -> Ink {
        for shape in &self.shapes {
            if at.cmplt(shape.low).any() || at.cmpgt(shape.high).any() {
                continue;
            }
            let inside = match shape.widths {
                Some(widths) => inside_stroke(&shape.line, widths, at),
                None => inside_outline(&shape.line, at),
            };
            // Pigment gathers at the rim of a wet stroke.
            let pooled = shape.ink * (1.0 + 0.22 * (1.0 - step(0.0, 0.9, inside)));
            under = under.lerp(pooled, step(-BLUR, BLUR, inside));
        }
        under
    }
}

/// The open smooth chain through knots.
fn smooth(knots: &[(f64, f64)]) -> Vec<DVec2> {
    let knots: Vec<DVec2> = knots.iter().copied().map(DVec2::from).collect();
    curve_through(&knots, 10)
}

/// The closed chain through knots: smooth runs between the knots that are named twice.
fn outline(knots: &[(f64, f64)]) -> Vec<DVec2> {
    let knots: Vec<DVec2> = knots.iter().copied().map(DVec2::from).collect();
    let count = knots.len();
    let corner = (0..count).find(|&k| knots[k] == knots[(k + 1) % count]);
    // Without a corner, two knots beyond each end carry the tangent around.
    let Some(corner) = corner else {
        let around: Vec<DVec2> = (0..count + 5).map(|k| knots[k % count]).collect();
        let chain = curve_through(&around, 10);
        return chain[20..=20 + 10 * count].to_vec();
    };
    let mut runs: Vec<Vec<DVec2>> = vec![vec![]];
    for k in 0..=count {
        let knot = knots[(corner + 1 + k) % count];
        let last = runs.last_mut().expect("there is always a run");
        if last.last() == Some(&knot) {
            runs.push(vec![knot]);
        } else {
            last.push(knot);
        }
    }
    runs.iter().filter(|run| run.len() > 1).flat_map(|run| curve_through(run, 10)).collect()
}

/// How deep a point lies in a stroke; negative outside.
fn inside_stroke(line: &[DVec2], [start, middle, end]: [f64; 3], at: DVec2) -> f64 {
    let count = (line.len() - 1) as f64;
    let mut deepest = f64::MIN;
    for (index, pair) in line.windows(2).enumerate() {
        let along = pair[1] - pair[0];
        let t = ((at - pair[0]).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
        let part = (index as f64 + t) / count;
        let swell = 1.0 - (2.0 * part - 1.0).powi(2);
        let width = mix(mix(start, end, part), middle, swell);
        deepest = deepest.max(width - at.distance(pair[0] + along * t));
    }
    deepest
}

/// How deep a point lies in an outline (even–odd); negative outside.
fn inside_outline(line: &[DVec2], at: DVec2) -> f64 {
    let (mut inside, mut nearest) = (false, f64::MAX);
    for (index, &from) in line.iter().enumerate() {
        let to = line[(index + 1) % line.len()];
        let along = to - from;
        let t = ((at - from).dot(along) / along.length_squared().max(1e-12)).clamp(0.0, 1.0);
        nearest = nearest.min(at.distance(from + along * t));
        if (from.y > at.y) != (to.y > at.y) {
            let cross = from.x + (at.y - from.y) / along.y * along.x;
            inside ^= at.x < cross;
        }
    }
    if inside { nearest } else { -nearest }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_later_mark_lies_on_top_and_outside_nothing_changes() {
        let mut drawing = Drawing::default();
        let square = [(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)];
        drawing.fill(&square.map(|corner| [corner; 2]).concat(), COBALT);
        drawing.dot((0.0, 0.0), 2.0, RED);
        assert_eq!(drawing.over(DVec2::ZERO, WHITE), RED);
        assert_eq!(drawing.over(DVec2::new(3.5, -3.5), WHITE), COBALT);
        assert_eq!(drawing.over(DVec2::new(5.5, 0.0), TURQUOISE), TURQUOISE);
    }

    #[test]
    fn a_stroke_is_as_wide_as_asked_in_its_middle_and_at_its_ends() {
        let line = smooth(&[(0.0, 0.0), (10.0, 0.0)]);
        let depth = |x: f64| inside_stroke(&line, [0.5, 2.0, 1.0], DVec2::new(x, 0.0));
        assert!((depth(0.0) - 0.5).abs() < 1e-9);
        assert!((depth(5.0) - 2.0).abs() < 1e-9);
        assert!((depth(10.0) - 1.0).abs() < 1e-9);
    }
}
