//! Cuts strips that are longer than the atlas, which would make all else small.
//!
//! Lab note, levels of 25 % at 1024², padding 4: FlightHelmet, TennisRacquet, dutch_ship, popcorn,
//! mars_tiles and a tile of photogrammetry, each material alone and all in one, 19 layouts of 13,096
//! charts. Coverage is the geometric mean.
//!
//! | slender | cut beyond | charts more | coverage |
//! |---|---|---|---|
//! | never | | | 53.3 % |
//! | 0.1 | 0.6, 0.8, 1.0 | 240, 110, 43 | 56.6 %, 56.5 %, 56.5 % |
//! | 0.2 | 0.6, 0.8, 1.0 | 262, 123, 47 | 57.4 %, 57.2 %, 57.5 % |
//! | 0.3 | 0.6, 0.8, 1.0 | 280, 129, 49 | 58.0 %, 57.9 %, 58.3 % |
//!
//! A few long ones do the harm. A belt alone held its material at 46 %; cut once, it is at 74 %.

use super::charts::Chart;
use super::shape::Shape;

/// The longest a shape may be, over the side of a square of the area of all: one twice as long as
/// wide stays whole even where it is all there is.
const LONGEST: f64 = 1.5;

/// A shape with less area than this share of the square over its length is slender.
const SLENDER: f64 = 0.3;

/// The longest that a slender shape may be, in the same measure.
const LONGEST_SLENDER: f64 = 1.0;

/// Halves strips until none is too long; single triangles are shrunk instead.
pub(super) fn cut_strips(
    charts: &mut Vec<Chart>,
    mut shapes: Vec<Shape>,
    lay_out: impl Fn(&Chart) -> Shape,
) -> Vec<Shape> {
    let area: f64 = shapes.iter().map(|shape| shape.area).sum();
    let mut at = 0;
    while at < shapes.len() {
        let longest = longest(&shapes[at]) * area.sqrt();
        if shapes[at].size.x <= longest {
            at += 1;
        } else if let Some([left, right]) = halve(&charts[at], &shapes[at]) {
            (shapes[at], charts[at]) = (lay_out(&left), left);
            shapes.push(lay_out(&right));
            charts.push(right);
        } else {
            shapes[at].shrink_to(longest);
            at += 1;
        }
    }
    shapes
}

fn longest(shape: &Shape) -> f64 {
    let is_slender = shape.area < SLENDER * shape.size.x.powi(2);
    if is_slender { LONGEST_SLENDER } else { LONGEST }
}

/// The triangles with centroids on either side of the middle of the longer side, unless all are on
/// one.
fn halve(chart: &Chart, shape: &Shape) -> Option<[Chart; 2]> {
    let is_left = shape.corners().map(|[a, b, c]| (a.x + b.x + c.x) / 3.0 < 0.5 * shape.size.x);
    let mut halves = [false, true].map(|_| Chart { kind: chart.kind, triangles: Vec::new() });
    for (&triangle, is_left) in chart.triangles.iter().zip(is_left) {
        halves[usize::from(!is_left)].triangles.push(triangle);
    }
    halves.iter().all(|half| !half.triangles.is_empty()).then_some(halves)
}
