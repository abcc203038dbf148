//! Cuts strips that are far longer than the atlas, which would make all else small.

use super::charts::Chart;
use super::shape::Shape;

/// The longest a shape may be, over the side of a square of the area of all: one twice as long as
/// wide stays whole even where it is all there is.
const LONGEST: f64 = 1.5;

/// Halves strips until none is too long; single triangles are shrunk instead.
pub(super) fn cut_strips(
    charts: &mut Vec<Chart>,
    mut shapes: Vec<Shape>,
    lay_out: impl Fn(&Chart) -> Shape,
) -> Vec<Shape> {
    let area: f64 = shapes.iter().map(|shape| shape.area).sum();
    let longest = LONGEST * area.sqrt();
    let mut at = 0;
    while at < shapes.len() {
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
