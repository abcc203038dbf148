//! Rasterises UV triangles: the texels that one covers, and their barycentrics in it.
//!
//! A texel is covered when its centre lies in the triangle or on its outline. Each edge is a
//! function E(p) = d × (p − a), positive on one side (Pineda, "A parallel algorithm for polygon
//! rasterization", SIGGRAPH 1988). The endpoints of an edge are put in one order before E is
//! computed, so that the two triangles at an edge get the same number with opposite signs: no
//! centre falls between them, whatever the rounding. Rounding is monotone, so the texels an edge
//! lets through in a row are those on one side of some texel, and a triangle's row is one span.
//!
//! Guaranteed: a centre exactly on an outline is covered; triangles that share an edge leave no
//! gap; nothing outside the window is visited, so work is bounded by it; triangles with a NaN or an
//! infinity, or without area, cover nothing. Not guaranteed: the texels on a shared edge belong to
//! both triangles, not to one; coordinates beyond 2^52 texels carry no fraction to be exact about.

use std::ops::Range;

use glam::{DVec2, Vec2};

/// Texel coordinates beyond this have no fraction left in an f64.
const MAX_COORDINATE: i64 = 1 << 52;

/// A UV in texels of an image of `size` (width, height): (0, 0) is its top left corner. Exact for
/// images of up to 2^29 texels a side.
#[inline]
pub fn to_texels(uv: Vec2, size: [usize; 2]) -> DVec2 {
    uv.as_dvec2() * DVec2::new(size[0] as f64, size[1] as f64)
}

/// A texel whose centre a triangle covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Column, not wrapped: negative or beyond the image where the UVs are.
    pub x: i64,
    /// Row, not wrapped.
    pub y: i64,
    /// Weights of the triangle's corners at the texel's centre; at least 0, sum 1.
    pub barycentrics: [f64; 3],
}

/// The texels that may be visited: columns and rows, not wrapped.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Window {
    /// Columns.
    pub x: Range<i64>,
    /// Rows.
    pub y: Range<i64>,
}

impl Window {
    /// The texels of an image.
    pub fn image(width: usize, height: usize) -> Self {
        Self { x: 0..width as i64, y: 0..height as i64 }
    }

    /// Every texel whose coordinates mean something.
    pub(crate) fn columns_of_rows(y: Range<i64>) -> Self {
        Self { x: -MAX_COORDINATE..MAX_COORDINATE, y }
    }
}

/// A directed edge as a function that is positive inside the triangle.
#[derive(Clone, Copy, Debug)]
struct Edge {
    start: DVec2,
    along: DVec2,
    sign: f64,
    /// Added to the function to grow the triangle.
    slack: f64,
}

impl Edge {
    fn new(a: DVec2, b: DVec2) -> Self {
        let forward = (a.x, a.y) <= (b.x, b.y);
        let (start, end) = if forward { (a, b) } else { (b, a) };
        Self { start, along: end - start, sign: if forward { 1.0 } else { -1.0 }, slack: 0.0 }
    }

    #[inline]
    fn at(&self, p: DVec2) -> f64 {
        let from = p - self.start;
        self.sign * (self.along.x * from.y - self.along.y * from.x) + self.slack
    }

    /// The slope of the function along a row.
    #[inline]
    fn slope(&self) -> f64 {
        -self.sign * self.along.y
    }

    /// The x where the function is 0 in the row at `y`. Rounded; callers check their neighbours.
    #[inline]
    fn zero(&self, y: f64) -> f64 {
        let rise = self.sign * self.along.x * (y - self.start.y) + self.slack;
        self.start.x - rise / self.slope()
    }
}

/// A triangle in texels, ready to be rasterised.
#[derive(Clone, Copy, Debug)]
pub struct UvTriangle {
    corners: [DVec2; 3],
    /// Edge `i` lies opposite corner `i`.
    edges: [Edge; 3],
    /// The width that the triangle is grown by for what filtering reads, in texels; else 0.
    reach: f64,
}

impl UvTriangle {
    /// The triangle with these corners (texels, either orientation), or none if one of them is not
    /// finite or they enclose no area.
    pub fn new(corners: [DVec2; 3]) -> Option<Self> {
        let [a, b, c] = corners;
        if !(a.is_finite() && b.is_finite() && c.is_finite()) {
            return None;
        }
        let mut edges = [Edge::new(b, c), Edge::new(c, a), Edge::new(a, b)];
        let area = edges[0].at(a);
        if area == 0.0 || !area.is_finite() {
            return None;
        }
        for edge in &mut edges {
            edge.sign *= area.signum();
        }
        Some(Self { corners, edges, reach: 0.0 })
    }

    /// The triangle grown to all the texels that a filter at a position inside it can give weight
    /// to: those whose centres lie less than `reach` texels away along both axes (the Minkowski sum
    /// with an open square of side 2 · `reach`); 1 for a bilinear tap. Its texels have no
    /// barycentrics within 0…1.
    pub(crate) fn grown_by_filter(mut self, reach: f64) -> Self {
        for edge in &mut self.edges {
            edge.slack = reach * (edge.along.x.abs() + edge.along.y.abs());
        }
        self.reach = reach;
        self
    }

    /// Whether an edge function lets a texel through: the triangle itself is closed, the grown one
    /// open.
    #[inline]
    fn passes(&self, value: f64) -> bool {
        if self.reach > 0.0 { value > 0.0 } else { value >= 0.0 }
    }

    fn bounds(&self, axis: usize) -> [f64; 2] {
        let [a, b, c] = self.corners.map(|corner| corner[axis]);
        [a.min(b).min(c) - self.reach, a.max(b).max(c) + self.reach]
    }

    /// The texels along one axis whose centres lie between two bounds.
    fn centres_between(&self, [low, high]: [f64; 2]) -> Range<i64> {
        let (low, high) = (low - 0.5, high - 0.5);
        let range = if self.reach > 0.0 {
            [low.floor() + 1.0, high.ceil()]
        } else {
            [low.ceil(), high.floor() + 1.0]
        };
        let [start, end] =
            range.map(|at| at.clamp(-MAX_COORDINATE as f64, MAX_COORDINATE as f64) as i64);
        start..end.max(start)
    }

    /// The rows that the triangle's bounding box covers.
    pub(crate) fn rows(&self) -> Range<i64> {
        self.centres_between(self.bounds(1))
    }

    /// The columns that the triangle's bounding box covers.
    pub(crate) fn columns(&self) -> Range<i64> {
        self.centres_between(self.bounds(0))
    }

    /// The columns that the part of the triangle in some range of `y` covers; for a grown triangle
    /// also some at its cut corners that no tap reads.
    pub(crate) fn columns_within(&self, y: [f64; 2]) -> Range<i64> {
        let [low, high] = [y[0] - self.reach, y[1] + self.reach];
        let mut bounds = [f64::INFINITY, f64::NEG_INFINITY];
        let mut add = |x: f64| bounds = [bounds[0].min(x), bounds[1].max(x)];
        for (i, &a) in self.corners.iter().enumerate() {
            let b = self.corners[(i + 1) % 3];
            if (low..=high).contains(&a.y) {
                add(a.x);
            }
            for cut in [low, high] {
                if (a.y < cut) != (b.y < cut) {
                    add(a.x + (b.x - a.x) * ((cut - a.y) / (b.y - a.y)));
                }
            }
        }
        if bounds[0] > bounds[1] {
            return 0..0;
        }
        self.centres_between([bounds[0] - self.reach, bounds[1] + self.reach])
    }

    /// Visits the rows of the triangle in `window`: row, and its covered columns. Rows come in
    /// order; empty ones are left out.
    pub fn spans(&self, window: &Window, mut visit: impl FnMut(i64, Range<i64>)) {
        let (rows, columns) = (self.rows(), self.columns());
        let start = columns.start.max(window.x.start).max(-MAX_COORDINATE);
        let end = columns.end.min(window.x.end).min(MAX_COORDINATE);
        for y in rows.start.max(window.y.start)..rows.end.min(window.y.end) {
            let span = self.span(y, start..end);
            if !span.is_empty() {
                visit(y, span);
            }
        }
    }

    /// The columns of row `y` that all three edges let through.
    fn span(&self, y: i64, columns: Range<i64>) -> Range<i64> {
        let centre = y as f64 + 0.5;
        let Range { mut start, mut end } = columns;
        for edge in &self.edges {
            let inside = |x: i64| self.passes(edge.at(DVec2::new(x as f64 + 0.5, centre)));
            let slope = edge.slope();
            if slope == 0.0 {
                if !inside(start) {
                    return 0..0;
                }
                continue;
            }
            let guess = (edge.zero(centre) - 0.5)
                .ceil()
                .clamp(-MAX_COORDINATE as f64, MAX_COORDINATE as f64)
                as i64;
            if slope > 0.0 {
                start = start.max(first_where(inside, guess));
            } else {
                end = end.min(first_where(|x| !inside(x), guess));
            }
        }
        start..end.max(start)
    }

    /// Visits every texel of the triangle in `window`, row by row.
    pub fn texels(&self, window: &Window, mut visit: impl FnMut(Texel)) {
        self.spans(window, |y, span| {
            for x in span {
                let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                visit(Texel { x, y, barycentrics: self.barycentrics(centre) });
            }
        });
    }

    /// Weights of the corners at `p` (texels): sum 1, negative beyond an edge.
    #[inline]
    pub fn barycentrics(&self, p: DVec2) -> [f64; 3] {
        let areas = self.edges.map(|edge| edge.at(p) - edge.slack);
        let sum = areas[0] + areas[1] + areas[2];
        if sum > 0.0 { areas.map(|area| area / sum) } else { [1.0 / 3.0; 3] }
    }

    /// [`Self::barycentrics`] at `p`, if it lies in the triangle or on its outline.
    #[inline]
    pub(crate) fn weights_inside(&self, p: DVec2) -> Option<[f64; 3]> {
        let areas = self.edges.map(|edge| edge.at(p) - edge.slack);
        if !areas.iter().all(|&area| area >= 0.0) {
            return None;
        }
        let sum = areas[0] + areas[1] + areas[2];
        Some(if sum > 0.0 { areas.map(|area| area / sum) } else { [1.0 / 3.0; 3] })
    }

    /// Whether `p` (texels) lies in the triangle or on its outline.
    #[inline]
    pub(crate) fn contains(&self, p: DVec2) -> bool {
        self.edges.iter().all(|edge| edge.at(p) - edge.slack >= 0.0)
    }

    /// The point of the triangle nearest to `p`, in texels.
    pub(crate) fn nearest(&self, p: DVec2) -> DVec2 {
        if self.contains(p) {
            return p;
        }
        let on_side = |i: usize| {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % 3]);
            let along = b - a;
            a + along * ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0)
        };
        let [a, b, c] = [0, 1, 2].map(on_side);
        let nearer = |a: DVec2, b: DVec2| {
            if b.distance_squared(p) < a.distance_squared(p) { b } else { a }
        };
        nearer(nearer(a, b), c)
    }

    /// The distance of `p` to the triangle, in texels; 0 inside.
    pub(crate) fn distance(&self, p: DVec2) -> f64 {
        self.nearest(p).distance(p)
    }
}

/// The first integer where `holds`, which is false below some integer and true from it on; `guess`
/// is at most two off, which is what rounding can do to the zero of an edge.
#[inline]
fn first_where(holds: impl Fn(i64) -> bool, guess: i64) -> i64 {
    let mut first = guess;
    for _ in 0..2 {
        if holds(first - 1) {
            first -= 1;
        } else if !holds(first) {
            first += 1;
        } else {
            break;
        }
    }
    first
}

#[cfg(test)]
mod tests;
