//! Places shapes of cells on a square board, first fit.
//!
//! For each row of the board a pyramid of bits is kept: at level k, bit x tells whether any of the
//! cells x…x + 2^k − 1 is taken (a sparse table). Whether a run of any length fits at 64 columns at
//! once is then two words ORed, and most rows are told off by their longest free run alone.

use super::cells::{Mask, Run};

/// Words beyond a row, so that words may be read across its end.
const MARGIN: usize = 2;

/// Free and taken cells.
pub(super) struct Board {
    side: usize,
    padding: usize,
    /// Words of a row at one level.
    words: usize,
    levels: usize,
    /// A bit per cell, row after row, level after level.
    bits: Vec<u64>,
    /// One per row: its longest run of free cells.
    longest: Vec<usize>,
}

impl Board {
    /// A board of free cells. Shapes will have `padding` free cells between them.
    pub(super) fn new(side: usize, padding: usize) -> Self {
        let words = side.div_ceil(64) + MARGIN;
        let levels = side.ilog2() as usize + 1;
        let bits = vec![0; side * levels * words];
        Self { side, padding, words, levels, bits, longest: vec![side; side] }
    }

    /// The first free place in rows `from`…`to`: topmost, then leftmost.
    pub(super) fn first_fit(&self, mask: &Mask, from: usize, to: usize) -> Option<[usize; 2]> {
        let [width, height] = mask.size;
        if width > self.side || height > self.side {
            return None;
        }
        let longest = mask.runs[0];
        for y in from..=to.min(self.side - height) {
            if self.longest[y + longest.row as usize] < longest.length as usize {
                continue;
            }
            for first in (0..=self.side - width).step_by(64) {
                let free = self.free(mask, y, first);
                if free != 0 {
                    return Some([first + free.trailing_zeros() as usize, y]);
                }
            }
        }
        None
    }

    /// A bit for each of 64 columns: whether a shape fits there in a row.
    fn free(&self, mask: &Mask, y: usize, first: usize) -> u64 {
        let columns = self.side - mask.size[0] + 1 - first;
        let mut free = if columns >= 64 { !0 } else { (1 << columns) - 1 };
        for run in &mask.runs {
            free &= !self.taken(run, y, first);
            if free == 0 {
                break;
            }
        }
        free
    }

    /// A bit for each of 64 columns: whether a run there meets a taken cell.
    #[inline]
    fn taken(&self, run: &Run, y: usize, first: usize) -> u64 {
        let level = run.length.ilog2();
        let row = self.row(y + run.row as usize, level as usize);
        let start = first + run.start as usize;
        word_at(row, start) | word_at(row, start + (run.length - (1 << level)) as usize)
    }

    #[inline]
    fn row(&self, y: usize, level: usize) -> &[u64] {
        &self.bits[(y * self.levels + level) * self.words..][..self.words]
    }

    /// Takes the cells of a shape, and the padding around them.
    pub(super) fn take(&mut self, mask: &Mask, [x, y]: [usize; 2]) {
        let row_length = self.levels * self.words;
        let rows =
            |row: usize| row.saturating_sub(self.padding)..(row + self.padding + 1).min(self.side);
        for run in &mask.runs {
            let start = x + run.start as usize;
            let end = (start + run.length as usize + self.padding).min(self.side);
            for row in rows(y + run.row as usize) {
                let bits = &mut self.bits[row * row_length..][..self.words];
                set(bits, start.saturating_sub(self.padding), end);
            }
        }
        for row in rows(y).start..rows(y + mask.size[1] - 1).end {
            self.update(row);
        }
    }

    /// Makes anew what follows from a row's cells.
    fn update(&mut self, row: usize) {
        let row_length = self.levels * self.words;
        let levels = &mut self.bits[row * row_length..][..row_length];
        for level in 1..self.levels {
            let (below, this) = levels[(level - 1) * self.words..].split_at_mut(self.words);
            for (word, to) in this[..self.words - MARGIN + 1].iter_mut().enumerate() {
                *to = below[word] | word_at(below, 64 * word + (1 << (level - 1)));
            }
        }
        self.longest[row] = longest_free(&levels[..self.words], self.side);
    }
}

/// 64 bits from a place on; 0 beyond the row.
#[inline]
fn word_at(row: &[u64], bit: usize) -> u64 {
    let (word, shift) = (bit / 64, bit % 64);
    let at = |word: usize| row.get(word).copied().unwrap_or(0);
    at(word) >> shift | at(word + 1) << 1 << (63 - shift)
}

/// Sets the bits `start`…`end` − 1.
fn set(bits: &mut [u64], start: usize, end: usize) {
    for (word, bits) in bits.iter_mut().enumerate().take(end.div_ceil(64)).skip(start / 64) {
        let from = !0 << (start.max(64 * word) - 64 * word);
        let to = !0 >> (64 * (word + 1) - end.min(64 * (word + 1)));
        *bits |= from & to;
    }
}

/// The longest run of zeros among the first `side` bits.
fn longest_free(bits: &[u64], side: usize) -> usize {
    let (mut longest, mut free) = (0, 0);
    for (word, &taken) in bits[..side.div_ceil(64)].iter().enumerate() {
        let (mut left, mut taken) = (64.min(side - 64 * word), taken);
        while left > 0 {
            let zeros = (taken.trailing_zeros() as usize).min(left);
            free += zeros;
            longest = longest.max(free);
            left -= zeros;
            if left > 0 {
                taken >>= zeros;
                let ones = (taken.trailing_ones() as usize).min(left);
                taken = taken.checked_shr(ones as u32).unwrap_or(0);
                left -= ones;
                free = 0;
            }
        }
    }
    longest
}

#[cfg(test)]
mod tests {
    use super::super::cells::Raster;
    use super::*;
    use proptest::prelude::*;

    fn mask(cells: &[bool], size: [usize; 2]) -> Mask {
        Raster::from_cells(size, cells.to_vec()).mask()
    }

    #[test]
    fn squares_fill_a_board_with_padding_between_them() {
        let square = mask(&[true; 9], [3, 3]);
        let mut board = Board::new(11, 1);
        let mut places = Vec::new();
        while let Some(place) = board.first_fit(&square, 0, 99) {
            board.take(&square, place);
            places.push(place);
        }
        assert_eq!(places.len(), 9);
        assert_eq!(&places[..4], [[0, 0], [4, 0], [8, 0], [0, 4]]);
    }

    #[test]
    fn what_is_larger_than_the_board_does_not_fit() {
        assert_eq!(Board::new(4, 0).first_fit(&mask(&[true; 5], [5, 1]), 0, 9), None);
        assert_eq!(Board::new(4, 0).first_fit(&mask(&[true; 5], [1, 5]), 0, 9), None);
    }

    proptest! {
        #[test]
        fn the_first_fit_is_that_of_looking_at_every_cell(
            side in 1..150usize,
            padding in 0..4usize,
            shapes in prop::collection::vec(
                (1..70usize, 1..6usize, prop::collection::vec(prop::bool::weighted(0.7), 350)),
                1..12,
            ),
        ) {
            let mut board = Board::new(side, padding);
            let mut taken = vec![false; side * side];
            for (width, height, cells) in shapes {
                let mut cells = cells[..width * height].to_vec();
                cells[0] = true;
                let shape = mask(&cells, [width, height]);
                let at = |[x, y]: [usize; 2]| {
                    let (cells, shape) = (&cells, 0..width * height);
                    shape.filter(move |&i| cells[i]).map(move |i| [x + i % width, y + i / width])
                };
                let fits = |place: &[usize; 2]| at(*place).all(|[x, y]| !taken[y * side + x]);
                let expected = (0..(side + 1).saturating_sub(height))
                    .flat_map(|y| (0..(side + 1).saturating_sub(width)).map(move |x| [x, y]))
                    .find(fits);
                prop_assert_eq!(board.first_fit(&shape, 0, side), expected);
                if let Some(place) = expected {
                    board.take(&shape, place);
                    for [x, y] in at(place) {
                        for v in y.saturating_sub(padding)..(y + padding + 1).min(side) {
                            let row = x.saturating_sub(padding)..(x + padding + 1).min(side);
                            taken[v * side..][row].fill(true);
                        }
                    }
                }
            }
        }
    }
}
