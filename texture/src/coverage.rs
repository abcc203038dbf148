//! The texels of an image that a set of UV triangles covers, under its wrap modes.
//!
//! Each span of a triangle adds 1 where it begins and takes 1 where it ends; one running sum per
//! row at the end tells which texels any span covered. So a triangle costs its rows, not its
//! texels, and a file of a million triangles that each cover the whole image is still bounded.

use std::ops::Range;

use rayon::prelude::*;

use crate::raster::{UvTriangle, Window};
use crate::wrap::Wrap;

/// A triangle over more repeats of the image than this is taken for its bounding box's columns in
/// all rows: it would cost rows without end, and one that tall leaves little out.
const MOST_REPEATS: i64 = 8;

/// Covered texels in the making.
pub(crate) struct Coverage {
    width: usize,
    height: usize,
    wrap: [Wrap; 2],
    /// `width + 1` per row: spans begun less spans ended at that column.
    steps: Vec<i32>,
    /// One per row: whether one span covered all of it.
    full: Vec<bool>,
    full_rows: usize,
}

impl Coverage {
    /// No texel covered yet.
    pub(crate) fn new(width: usize, height: usize, wrap: [Wrap; 2]) -> Self {
        let steps = vec![0; (width + 1) * height];
        Self { width, height, wrap, steps, full: vec![false; height], full_rows: 0 }
    }

    /// Adds a triangle, in texels of this image; tells whether it covers any texel.
    pub(crate) fn add(&mut self, triangle: &UvTriangle) -> bool {
        if self.full_rows == self.height {
            return true;
        }
        let rows = triangle.rows();
        let height = self.height as i64;
        if self.wrap[1] == Wrap::Clamp {
            let before = rows.start < 0 && self.mark(0, triangle.columns_within([f64::MIN, -0.5]));
            let inside = self.add_rows(triangle, 0..height);
            let after = rows.end > height && {
                let below = triangle.columns_within([height as f64 + 0.5, f64::MAX]);
                self.mark(self.height - 1, below)
            };
            before || inside || after
        } else if rows.end - rows.start > MOST_REPEATS * height {
            (0..self.height).all(|y| self.mark(y, triangle.columns()))
        } else {
            self.add_rows(triangle, rows)
        }
    }

    fn add_rows(&mut self, triangle: &UvTriangle, rows: Range<i64>) -> bool {
        let mut any = false;
        triangle.spans(&Window::columns_of_rows(rows), |y, span| {
            let row = self.wrap[1].texel(y, self.height);
            any |= self.mark(row, span);
        });
        any
    }

    /// Covers a span of unwrapped columns in a row of the image; tells whether there was one.
    fn mark(&mut self, y: usize, span: Range<i64>) -> bool {
        if span.is_empty() {
            return false;
        }
        let width = self.width as i64;
        let period = if self.wrap[0] == Wrap::Mirror { 2 * width } else { width };
        match self.wrap[0] {
            Wrap::Clamp => {
                let first = span.start.clamp(0, width - 1);
                self.step(y, first..(span.end - 1).clamp(0, width - 1) + 1);
            }
            _ if span.end - span.start >= period => self.step(y, 0..width),
            wrap => {
                for copy in span.start.div_euclid(width)..=(span.end - 1).div_euclid(width) {
                    let start = (span.start - copy * width).max(0);
                    let end = (span.end - copy * width).min(width);
                    if wrap == Wrap::Mirror && copy.rem_euclid(2) == 1 {
                        self.step(y, width - end..width - start);
                    } else {
                        self.step(y, start..end);
                    }
                }
            }
        }
        true
    }

    fn step(&mut self, y: usize, columns: Range<i64>) {
        if columns == (0..self.width as i64) && !self.full[y] {
            self.full[y] = true;
            self.full_rows += 1;
        }
        let row = y * (self.width + 1);
        let [start, end] = [columns.start, columns.end].map(|x| row + x as usize);
        self.steps[start] = self.steps[start].wrapping_add(1);
        self.steps[end] = self.steps[end].wrapping_sub(1);
    }

    /// One per texel, row after row: whether it is covered.
    pub(crate) fn finish(self) -> Vec<bool> {
        let mut covered = vec![false; self.width * self.height];
        let rows = covered.par_chunks_mut(self.width.max(1));
        rows.zip(self.steps.par_chunks(self.width + 1)).for_each(|(row, steps)| {
            let mut open = 0i32;
            for (covered, step) in row.iter_mut().zip(steps) {
                open = open.wrapping_add(*step);
                *covered = open != 0;
            }
        });
        covered
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec2;
    use proptest::prelude::*;

    const MODES: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

    fn coverage(size: [usize; 2], wrap: [Wrap; 2], corners: [[f64; 2]; 3]) -> Vec<bool> {
        let mut coverage = Coverage::new(size[0], size[1], wrap);
        if let Some(triangle) = UvTriangle::new(corners.map(DVec2::from)) {
            coverage.add(&triangle);
        }
        coverage.finish()
    }

    #[test]
    fn a_span_over_the_edge_comes_back_where_the_mode_says() {
        // Columns 3 to 5 of an image four wide, one row.
        let read = |wrap| {
            coverage([4, 1], [wrap, Wrap::Clamp], [[3.0, 0.5], [6.0, 0.0], [6.0, 1.0]])
                .iter()
                .map(|&covered| u8::from(covered))
                .collect::<Vec<_>>()
        };
        assert_eq!(read(Wrap::Repeat), [1, 1, 0, 1]);
        assert_eq!(read(Wrap::Mirror), [0, 0, 1, 1]);
        assert_eq!(read(Wrap::Clamp), [0, 0, 0, 1]);
    }

    #[test]
    fn a_triangle_over_more_repeats_than_numbers_can_tell_covers_the_image() {
        let corners = [[-1e34, -1e34], [1e34, -1e34], [0.0, 1e34]];
        for wrap in MODES {
            assert!(coverage([16, 9], [wrap, wrap], corners).iter().all(|&c| c));
        }
        let strip =
            coverage([8, 8], [Wrap::Clamp, Wrap::Repeat], [[0.0, 0.0], [2.0, 0.0], [0.0, 1e9]]);
        assert_eq!(strip.iter().filter(|&&c| c).count(), 16);
    }

    proptest! {
        #[test]
        fn spans_cover_what_single_texels_would(
            size in [1..9usize, 1..9usize],
            modes in [0..3usize, 0..3usize],
            corners in prop::array::uniform3([-20.0..20.0f64, -20.0..20.0f64]),
        ) {
            let wrap = modes.map(|m| MODES[m]);
            let [width, height] = size;
            let found = coverage(size, wrap, corners);
            let mut texels = vec![false; width * height];
            if let Some(triangle) = UvTriangle::new(corners.map(DVec2::from)) {
                triangle.texels(&Window { x: -40..40, y: -40..40 }, |t| {
                    texels[wrap[1].texel(t.y, height) * width + wrap[0].texel(t.x, width)] = true;
                });
            }
            if wrap[1] == Wrap::Clamp {
                // Beyond the image a clamped row stands for all positions, not only for centres.
                prop_assert!(texels.iter().zip(&found).all(|(&texel, &span)| span || !texel));
            } else {
                prop_assert!(
                    texels == found || height < 5,
                    "beyond {} repeats the box is taken", MOST_REPEATS
                );
                prop_assert!(texels.iter().zip(&found).all(|(&texel, &span)| span || !texel));
            }
        }
    }
}
