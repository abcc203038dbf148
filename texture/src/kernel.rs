//! The kernels of pull and push, one axis at a time, on cells of sums and weights.
//!
//! Both of the method's kernels are products of a row and a column: (1 2 2 1) / 6 for pull, (¼ ¾)
//! for push. So rows are reduced first and then combined, and each row of either pass is plain
//! arithmetic on neighbors in memory. Here are also the passes from one level to the next.

use rayon::prelude::*;

use crate::wrap::Wrap;

/// Rows that one thread works on at a time.
pub(crate) const ROWS: usize = 16;

/// The factor by which a coarse texel counts more than its share of valid texels, at most in full.
///
/// Weights that are plain shares (1) leave a texel beside a chart mostly to coarser levels, so that
/// the fill steps away from the chart at its very outline. Held-out rings of texels of two scanned
/// atlases (popcorn box, 2048²; frying pan, 1024²), RMS error of the fill in 8-bit sRGB steps:
///
/// | trust | 2 wide | 8 wide | 32 wide | the first texel (ring of 8) |
/// |---|---|---|---|---|
/// | 1 | 24.6, 16.6 | 40.5, 21.8 | 44.7, 26.6 | 17.7, 13.4 |
/// | 2 | 16.5, 13.9 | 33.6, 20.7 | 38.9, 26.2 | 8.8, 11.6 |
/// | 4 | 14.9, 13.3 | 32.4, 20.0 | 38.1, 24.4 | 7.7, 11.0 |
/// | 36 | 14.0, 12.9 | 32.4, 19.4 | 37.8, 25.2 | 7.1, 10.7 |
///
/// More than 4 gains little, and loses some of it in wide gaps.
const TRUST: f32 = 4.0;

/// The channels of a texel, each times the weight, and the weight last.
pub(crate) type Cell<const N: usize> = [f32; N];

/// A level of the pyramid.
pub(crate) struct Level<const N: usize> {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) cells: Vec<Cell<N>>,
}

/// Four neighbors along an axis, weighted (1 2 2 1) / 6.
#[inline]
pub(crate) fn reduce<const N: usize>(near: [&Cell<N>; 4]) -> Cell<N> {
    let mut cell = [0.0; N];
    for k in 0..N {
        cell[k] = (near[0][k] + near[3][k]) * (1.0 / 6.0) + (near[1][k] + near[2][k]) * (1.0 / 3.0);
    }
    cell
}

/// Turns the share of valid texels in a sum into a weight, and the sum with it.
#[inline]
pub(crate) fn trust<const N: usize>(cell: &mut Cell<N>) {
    let share = cell[N - 1];
    let gain = TRUST.min(1.0 / share);
    for sum in &mut cell[..N - 1] {
        *sum *= gain;
    }
    cell[N - 1] = (TRUST * share).min(1.0);
}

/// Continues a row of `size` cells that starts at index 1 by one cell before and two after it.
pub(crate) fn pad<const N: usize>(row: &mut [Cell<N>], wrap: Wrap, size: usize) {
    for beyond in [-1, size as i64, size as i64 + 1] {
        if let Some(at) = row.get(wrap.texel(beyond, size) + 1).copied()
            && let Some(cell) = row.get_mut((beyond + 1) as usize)
        {
            *cell = at;
        }
    }
}

/// The rows of a coarse level that lie nearest to row `y` of the finer one, ¾ and ¼, with one cell
/// before and one after.
pub(crate) fn blend_rows<const N: usize>(
    coarse: &Level<N>,
    y: usize,
    wrap: [Wrap; 2],
    blended: &mut [Cell<N>],
) {
    let width = coarse.width;
    let nearest = y / 2;
    let next = (nearest + 2 * (y % 2)) as i64 - 1;
    let next = wrap[1].texel(next, coarse.height);
    let row = |y: usize| &coarse.cells[y * width..(y + 1) * width];
    for ((cell, near), far) in blended[1..].iter_mut().zip(row(nearest)).zip(row(next)) {
        for k in 0..N {
            cell[k] = 0.75 * near[k] + 0.25 * far[k];
        }
    }
    pad(blended, wrap[0], width);
}

/// The cells of a blended row that lie nearest to column `x` of the finer level, ¾ and ¼.
#[inline]
pub(crate) fn blend_columns<const N: usize>(blended: &[Cell<N>], x: usize) -> Cell<N> {
    let near = &blended[x / 2 + 1];
    let far = &blended[x / 2 + 2 * (x % 2)];
    let mut cell = [0.0; N];
    for k in 0..N {
        cell[k] = 0.75 * near[k] + 0.25 * far[k];
    }
    cell
}

/// The level that is coarser than another.
pub(crate) fn pull_level<const N: usize>(fine: &Level<N>, wrap: [Wrap; 2]) -> Level<N> {
    let width = fine.width;
    pull_rows([width, fine.height], wrap, |y, row: &mut [Cell<N>]| {
        row.copy_from_slice(&fine.cells[y * width..(y + 1) * width]);
    })
}

/// The next coarser level of one of `size`, whose rows `read` writes out. Columns are reduced
/// first, then rows.
pub(crate) fn pull_rows<const N: usize>(
    size: [usize; 2],
    wrap: [Wrap; 2],
    read: impl Fn(usize, &mut [Cell<N>]) + Sync,
) -> Level<N> {
    let [width, height] = size.map(|n| n.div_ceil(2));
    let mut cells = vec![[0.0; N]; width * height];
    let blocks = cells.par_chunks_mut(width * ROWS).enumerate();
    blocks.for_each_init(
        || (vec![[0.0; N]; size[0] + 3], vec![[0.0; N]; width * (2 * ROWS + 2)]),
        |(padded, reduced), (block, cells)| {
            let rows = cells.len() / width;
            let top = (2 * block * ROWS) as i64 - 1;
            for (y, out) in (top..).zip(reduced.chunks_exact_mut(width).take(2 * rows + 2)) {
                read(wrap[1].texel(y, size[1]), &mut padded[1..=size[0]]);
                pad(padded, wrap[0], size[0]);
                for (cell, near) in out.iter_mut().zip(padded.windows(4).step_by(2)) {
                    *cell = reduce([&near[0], &near[1], &near[2], &near[3]]);
                }
            }
            for (y, out) in cells.chunks_exact_mut(width).enumerate() {
                let rows: [&[Cell<N>]; 4] =
                    std::array::from_fn(|k| &reduced[(2 * y + k) * width..][..width]);
                for (x, cell) in out.iter_mut().enumerate() {
                    *cell = reduce([&rows[0][x], &rows[1][x], &rows[2][x], &rows[3][x]]);
                    trust(cell);
                }
            }
        },
    );
    Level { width, height, cells }
}

/// Fills what is missing in a level from the coarser one.
pub(crate) fn push_level<const N: usize>(coarse: &Level<N>, fine: &mut Level<N>, wrap: [Wrap; 2]) {
    let width = fine.width;
    let blocks = fine.cells.par_chunks_mut(width * ROWS).enumerate();
    blocks.for_each_init(
        || vec![[0.0; N]; coarse.width + 2],
        |blended, (block, cells)| {
            for (y, row) in (block * ROWS..).zip(cells.chunks_exact_mut(width)) {
                blend_rows(coarse, y, wrap, blended);
                for (x, cell) in row.iter_mut().enumerate() {
                    let given = blend_columns(blended, x);
                    let (weight, given_weight) = (cell[N - 1], given[N - 1]);
                    let filled = given_weight * (1.0 - weight) + weight;
                    // w·x of the new w and x; the division turns Σ h w x into tx.
                    let share = (1.0 - weight) / given_weight;
                    for k in 0..N - 1 {
                        cell[k] = (given[k] * share + cell[k]) * filled;
                    }
                    cell[N - 1] = filled;
                }
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reducing_weighs_one_two_two_one() {
        let cells = [[6.0, 1.0], [12.0, 0.0], [0.0, 1.0], [60.0, 1.0]];
        let [sum, weight] = reduce([&cells[0], &cells[1], &cells[2], &cells[3]]);
        assert!((sum - 15.0).abs() < 1e-5 && (weight - 4.0 / 6.0).abs() < 1e-6);
    }

    #[test]
    fn a_share_counts_fourfold_and_at_most_in_full() {
        let trusted = |mut cell: Cell<2>| {
            trust(&mut cell);
            cell
        };
        assert_eq!(trusted([1.0, 0.125]), [4.0, 0.5]);
        assert_eq!(trusted([3.0, 0.5]), [6.0, 1.0]);
        assert_eq!(trusted([0.0, 0.0]), [0.0, 0.0]);
    }

    #[test]
    fn a_row_continues_as_its_sampler_reads_on() {
        let padded = |wrap, size: usize| {
            let mut row: Vec<Cell<1>> = vec![[0.0]; size + 3];
            (0..size).for_each(|x| row[x + 1] = [x as f32]);
            pad(&mut row, wrap, size);
            row.concat()
        };
        assert_eq!(padded(Wrap::Repeat, 3), [2.0, 0.0, 1.0, 2.0, 0.0, 1.0]);
        assert_eq!(padded(Wrap::Mirror, 3), [0.0, 0.0, 1.0, 2.0, 2.0, 1.0]);
        assert_eq!(padded(Wrap::Clamp, 1), [0.0; 4]);
    }

    #[test]
    fn a_finer_texel_lies_a_quarter_cell_from_the_nearest() {
        let level = Level { width: 2, height: 1, cells: vec![[0.0], [4.0]] };
        let mut blended = [[0.0]; 4];
        blend_rows(&level, 0, [Wrap::Clamp; 2], &mut blended);
        let finer: Vec<f32> = (0..4).map(|x| blend_columns(&blended, x)[0]).collect();
        assert_eq!(finer, [0.0, 1.0, 3.0, 4.0]);
    }
}
