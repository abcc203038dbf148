//! The cells of a grid that a triangle touches, and shapes made of such cells.
//!
//! Unlike [`UvTriangle`](crate::UvTriangle), which covers the texels whose centres it holds, these
//! are all cells that any part of a triangle lies in: shapes without common cells do not overlap.

use std::ops::Range;

use glam::DVec2;

/// Visits the rows of a grid of `size` cells that a triangle reaches into, and the columns that it
/// touches there; at least one. Coordinates are in cells; what lies beyond the grid is taken to its
/// rim.
pub(super) fn touched(
    corners: [DVec2; 3],
    size: [usize; 2],
    mut visit: impl FnMut(usize, Range<usize>),
) {
    let y = corners.map(|p| p.y);
    for row in cells(y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]), size[1]) {
        let [low, high] = [row as f64, (row + 1) as f64];
        let mut bounds = [f64::INFINITY, f64::NEG_INFINITY];
        let mut add = |x: f64| bounds = [bounds[0].min(x), bounds[1].max(x)];
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % 3];
            if (low..=high).contains(&a.y)
                || low == 0.0 && a.y < 0.0
                || row + 1 == size[1] && a.y > high
            {
                add(a.x);
            }
            for cut in [low, high] {
                if (a.y < cut) != (b.y < cut) {
                    add(a.x + (b.x - a.x) * ((cut - a.y) / (b.y - a.y)));
                }
            }
        }
        if bounds[0] <= bounds[1] {
            visit(row, cells(bounds[0], bounds[1], size[0]));
        }
    }
}

/// The cells of an axis between two places; at least one.
fn cells(low: f64, high: f64, size: usize) -> Range<usize> {
    let start = (low.floor().max(0.0) as usize).min(size - 1);
    start..(high.ceil().max(0.0) as usize).clamp(start + 1, size)
}

/// Cells of a row that a shape takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Run {
    pub(super) row: u32,
    pub(super) start: u32,
    pub(super) length: u32,
}

/// A shape of cells.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Mask {
    /// Columns and rows.
    pub(super) size: [usize; 2],
    /// The longest first, then rows far apart: what does not fit is likely told off by the first.
    pub(super) runs: Vec<Run>,
    /// The largest square of cells in it.
    pub(super) core: Square,
}

/// A square of cells in a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Square {
    /// Its first row in the shape.
    pub(super) row: usize,
    pub(super) side: usize,
}

impl Mask {
    /// A full square.
    pub(super) fn square(side: usize) -> Self {
        Raster::from_cells([side; 2], vec![true; side * side]).mask()
    }
}

/// A grid of flags, on the way to a [`Mask`].
pub(super) struct Raster {
    size: [usize; 2],
    taken: Vec<bool>,
}

impl Raster {
    /// One flag per cell, row after row.
    pub(super) fn from_cells(size: [usize; 2], taken: Vec<bool>) -> Self {
        Self { size, taken }
    }

    /// The cells that triangles touch, of `size` columns and rows.
    pub(super) fn new(size: [usize; 2], triangles: impl Iterator<Item = [DVec2; 3]>) -> Self {
        let mut taken = vec![false; size[0] * size[1]];
        for corners in triangles {
            touched(corners, size, |row, columns| {
                taken[row * size[0]..][columns].fill(true);
            });
        }
        Self { size, taken }
    }

    /// The shape turned by 90°: (x, y) comes to (height − y, x).
    pub(super) fn turned(&self) -> Self {
        let [width, height] = self.size;
        let mut taken = Vec::with_capacity(self.taken.len());
        for x in 0..width {
            taken.extend((0..height).rev().map(|y| self.taken[y * width + x]));
        }
        Self { size: [height, width], taken }
    }

    /// The shape as runs of cells.
    pub(super) fn mask(&self) -> Mask {
        let mut runs = Vec::new();
        for (row, cells) in (0u32..).zip(self.taken.chunks_exact(self.size[0])) {
            let mut start = 0u32;
            for same in cells.chunk_by(|a, b| a == b) {
                let length = same.len() as u32;
                if same[0] {
                    runs.push(Run { row, start, length });
                }
                start += length;
            }
        }
        runs.sort_by_key(|run| (run.row.reverse_bits(), run.start));
        let longest = (0..runs.len()).max_by_key(|&at| runs[at].length);
        runs.swap(0, longest.expect("a mask has cells"));
        Mask { size: self.size, runs, core: self.core() }
    }

    /// The largest square of cells: one that ends at a cell is by 1 larger than the least of those
    /// that end left of it, above it and at the corner between.
    fn core(&self) -> Square {
        let mut largest = Square { row: 0, side: 0 };
        let mut above = vec![0; self.size[0] + 1];
        for (row, cells) in self.taken.chunks_exact(self.size[0]).enumerate() {
            let (mut left, mut corner) = (0, 0);
            for (side, &taken) in above[1..].iter_mut().zip(cells) {
                let ends = if taken { 1 + left.min(corner).min(*side) } else { 0 };
                (corner, left) = (*side, ends);
                *side = ends;
                if ends > largest.side {
                    largest = Square { row: row + 1 - ends, side: ends };
                }
            }
        }
        largest
    }
}

/// A place in a shape of `size`, where it comes to by `turns` of 90°.
pub(super) fn turn_by(turns: u8, p: DVec2, size: [f64; 2]) -> DVec2 {
    let [width, height] = size;
    match turns {
        0 => p,
        1 => DVec2::new(height - p.y, p.x),
        2 => DVec2::new(width - p.x, height - p.y),
        _ => DVec2::new(p.y, width - p.x),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn touched_cells(corners: [[f64; 2]; 3], size: [usize; 2]) -> Vec<[usize; 2]> {
        let mut cells = Vec::new();
        touched(corners.map(DVec2::from), size, |y, columns| {
            cells.extend(columns.map(|x| [x, y]));
        });
        cells
    }

    #[test]
    fn a_triangle_touches_the_cells_that_it_cuts() {
        let cells = touched_cells([[0.0, 0.0], [3.0, 0.0], [0.0, 2.0]], [8, 8]);
        assert_eq!(cells, [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1]]);
    }

    #[test]
    fn a_point_touches_one_cell_and_what_lies_beyond_the_grid_its_rim() {
        assert_eq!(touched_cells([[2.0, 1.0]; 3], [4, 4]), [[2, 1]]);
        assert_eq!(touched_cells([[9.0, 9.0]; 3], [4, 4]), [[3, 3]]);
        assert_eq!(touched_cells([[-9.0, -9.0]; 3], [4, 4]), [[0, 0]]);
    }

    #[test]
    fn four_turns_are_none() {
        let corners = [[0.0, 0.0], [4.6, 0.3], [1.0, 2.5]].map(DVec2::from);
        let raster = Raster::new([5, 3], [corners].into_iter());
        let mut turned = raster.turned();
        let place = corners.map(|p| turn_by(1, p, [5.0, 3.0]));
        assert_eq!(turned.mask(), Raster::new([3, 5], [place].into_iter()).mask());
        for _ in 0..3 {
            turned = turned.turned();
        }
        assert_eq!(turned.mask(), raster.mask());
        for turns in 0..4 {
            let size = if turns % 2 == 0 { [5.0, 3.0] } else { [3.0, 5.0] };
            let back = turn_by((4 - turns) % 4, turn_by(turns, corners[1], [5.0, 3.0]), size);
            assert!((back - corners[1]).length() < 1e-12);
        }
    }

    proptest! {
        #[test]
        fn every_point_of_a_triangle_lies_in_a_touched_cell(
            corners in prop::array::uniform3(prop::array::uniform2(0.0..9.0f64)),
            weights in [0.0..1.0f64, 0.0..1.0f64, 0.01..1.0f64],
        ) {
            let sum: f64 = weights.iter().sum();
            let p = [0, 1].map(|i| (0..3).map(|k| corners[k][i] * weights[k]).sum::<f64>() / sum);
            let cell = p.map(|x| x as usize);
            prop_assert!(touched_cells(corners, [9, 9]).contains(&cell));
        }
    }
}
