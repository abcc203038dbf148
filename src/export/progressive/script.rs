//! The columns of a block, and the symbols that tell how a split changes triangles.

use std::collections::VecDeque;

use super::blocks::{Columns, Damage, Reader, Result};
use super::values::COLUMNS;

/// Twice the surface of the step; and one for a surface that is taken back from a level.
pub(super) const STEP: usize = 0;
/// Triangles that a split brings.
pub(super) const TRIANGLES: usize = 1;
/// By how much the bits of the error fall, as a number.
pub(super) const ERROR: usize = 2;
/// The point that splits and 1, or 0.
pub(super) const CENTER: usize = 3;
/// Points of the wedges at it.
pub(super) const MOVED: usize = 4;
/// Wedges of the corners at it.
pub(super) const CORNERS: usize = 5;
/// Groups of new triangles, and wedges of their corners.
pub(super) const GROUPS: usize = 6;
pub(super) const WEDGES: usize = 7;
/// Points of new wedges.
pub(super) const POINTS: usize = 8;
/// Points and wedges by their numbers.
pub(super) const NUMBERS: usize = 9;
/// How positions, and rows, are told: [`NEAR`], [`EXACT`] or [`KNOWN`].
pub(super) const EXACT_POINTS: usize = 10;
pub(super) const EXACT_WEDGES: usize = 11;
/// Splits from a level to the one before it.
pub(super) const SPAN: usize = 12;
/// Positions, rows of attributes, and then what else vertices carry.
pub(super) const POSITIONS: usize = 13;
pub(super) const ROWS: usize = POSITIONS + 3 * COLUMNS;

/// Ways in which a value is told: to a step, exactly, being the source's, or not at all, being the source's that was
/// told before.
pub(super) const NEAR: u8 = 0;
pub(super) const EXACT: u8 = 1;
pub(super) const KNOWN: u8 = 2;

/// Numbers of symbols of a point: that which splits, a new one, one by its number; then new ones and
/// neighbors in turn.
pub(super) const SPLIT_POINT: u32 = 0;
pub(super) const NEW_POINT: u32 = 1;
pub(super) const NUMBERED_POINT: u32 = 2;
/// Numbers of symbols of a wedge: a new one, one by its number; then those that are moved, new ones and
/// neighbors in turn.
pub(super) const NEW_WEDGE: u32 = 0;
pub(super) const NUMBERED_WEDGE: u32 = 1;

/// A place that symbols come from.
pub(super) trait Symbols {
    /// The next symbol of a column.
    fn next(&mut self, column: usize) -> Result<u32>;
}

impl Symbols for Reader {
    fn next(&mut self, column: usize) -> Result<u32> {
        self.number(column)
    }
}

/// The symbols of one split.
#[derive(Clone, Debug, Default)]
pub(super) struct Script([VecDeque<u32>; POSITIONS]);

impl Script {
    pub(super) fn put(&mut self, column: usize, symbol: u32) {
        self.0[column].push_back(symbol);
    }

    /// Writes all symbols.
    pub(super) fn write(&self, out: &mut Columns) {
        for (column, symbols) in self.0.iter().enumerate() {
            symbols.iter().for_each(|&symbol| out.number(column, symbol));
        }
    }
}

impl Symbols for Script {
    fn next(&mut self, column: usize) -> Result<u32> {
        self.0[column].pop_front().ok_or(Damage::Changed)
    }
}
