//! The largest scale at which all shapes fit the atlas.
//!
//! Shapes are packed as the cells that they touch, largest first, each in the turn of 90° in which
//! its lower end comes out topmost; so small ones fill the holes in and between large ones. Where
//! shapes are few, largest is tried in two senses. The scale is found by bisection. That a smaller
//! scale fits wherever a larger one does is likely and not sure, so the scale is the largest of
//! those looked at.

use std::cmp::Reverse;

use glam::DVec2;
use rayon::prelude::*;

use super::RepackOptions;
use super::board::Board;
use super::cells::{Mask, Raster, turn_by};
use super::shape::Shape;

/// Cells along the atlas at most: in a larger atlas a cell is several texels, so that the time
/// does not grow with it.
const MOST_CELLS: usize = 1024;

/// Bisection ends when the bounds of the scale are within this.
const PRECISION: f64 = 1.004;

/// The first scale looked at, over that which leaves no room; squared with each step down.
const FIRST_STEP: f64 = 0.93;

/// The orders in which shapes are placed, by width and height with padding: the greatest first.
const ORDERS: [fn([usize; 2]) -> [usize; 2]; 2] = [
    |[width, height]| [width.min(height), width.max(height)],
    |[width, height]| [width * height, 0],
];

/// More shapes than this are placed in the first order alone: on levels with 1,381, 1,941 and 4,132
/// charts the second one added 0.4, 0.2 and 0 percent points of coverage, for twice the work.
const MOST_IN_TWO_ORDERS: usize = 1000;

/// The place of a shape in the grid.
#[derive(Clone, Copy, Debug)]
struct Spot {
    /// The least corner, in cells.
    corner: [usize; 2],
    /// Number of turns of 90°.
    turns: u8,
}

/// The shapes in their places.
pub(super) struct Packing {
    grid: Grid,
    /// Cells per unit of the shapes.
    scale: f64,
    spots: Vec<Spot>,
}

/// The cells of an atlas.
#[derive(Clone, Copy, Debug)]
struct Grid {
    /// Texels from the atlas's edge to the first cell.
    border: usize,
    /// Texels along a cell.
    cell: usize,
    side: usize,
    /// Cells between shapes.
    padding: usize,
}

impl Grid {
    /// None if padding leaves no room.
    fn new(options: &RepackOptions) -> Option<Self> {
        let border = options.padding.div_ceil(2);
        let room = options.size.checked_sub(border.checked_mul(2)?)?;
        let cell = options.size.div_ceil(MOST_CELLS).max(1);
        let (side, padding) = (room / cell, options.padding.div_ceil(cell));
        (side > 0).then_some(Self { border, cell, side, padding })
    }
}

impl Packing {
    /// Texels per unit of the shapes.
    pub(super) fn texels_per_unit(&self) -> f64 {
        self.scale * self.grid.cell as f64
    }

    /// The place in the atlas, in texels, of a place in a shape.
    pub(super) fn texels(&self, shape: usize, size: DVec2, place: DVec2) -> DVec2 {
        let Spot { corner, turns } = self.spots[shape];
        let [width, height] = extent(size * self.scale).map(|cells| cells as f64);
        let inner = in_cells(place, size, self.scale);
        let corner = DVec2::new(corner[0] as f64, corner[1] as f64);
        let cells = corner + turn_by(turns, inner, [width, height]);
        cells * self.grid.cell as f64 + self.grid.border as f64
    }
}

/// Columns and rows that a shape of this extent takes.
fn extent(size: DVec2) -> [usize; 2] {
    [size.x, size.y].map(|length| (length.ceil() as usize).max(1))
}

/// A place of a shape in the middle of its cells.
fn in_cells(place: DVec2, size: DVec2, scale: f64) -> DVec2 {
    let size = size * scale;
    let [width, height] = extent(size);
    place * scale + 0.5 * (DVec2::new(width as f64, height as f64) - size)
}

/// Packs all shapes as large as they fit; none if they don't fit at any scale.
pub(super) fn pack(shapes: &[Shape], options: &RepackOptions) -> Option<Packing> {
    let grid = Grid::new(options)?;
    let try_scale = |scale: f64| {
        let spots = place_all(&turned_masks(shapes, scale), grid)?;
        Some(Packing { grid, scale, spots })
    };
    let longest = shapes.iter().map(|shape| shape.size.x).fold(0.0, f64::max);
    if longest <= 0.0 {
        return try_scale(1.0);
    }
    // At this scale each shape takes one cell.
    let least = 1.0 / longest;
    let mut above = most(shapes, grid).min(grid.side as f64 / longest);
    let mut step = FIRST_STEP;
    let mut best = loop {
        let scale = (above * step).max(least);
        if let Some(packing) = try_scale(scale) {
            break packing;
        }
        if scale <= least {
            return None;
        }
        above = scale;
        step *= step;
    };
    while above > best.scale * PRECISION {
        let scale = (above * best.scale).sqrt();
        match try_scale(scale) {
            Some(packing) => best = packing,
            None => above = scale,
        }
    }
    Some(best)
}

/// The scale at which shapes leave no room, or 0: a shape of area a and extent w × h in one piece
/// takes at least a + p (w + h) + p² cells with the padding p to its right and below, and all
/// together have (side + p)².
fn most(shapes: &[Shape], grid: Grid) -> f64 {
    let [side, padding, count] = [grid.side, grid.padding, shapes.len()].map(|x| x as f64);
    let area: f64 = shapes.iter().map(|shape| shape.area).sum();
    let extents: f64 = shapes.iter().map(|shape| shape.size.element_sum()).sum();
    let room = (side + padding).powi(2) - count * padding * padding;
    let linear = 0.5 * padding * extents;
    // area · s² + 2 · linear · s = room
    (room / (linear + (linear * linear + area * room).max(0.0).sqrt())).max(0.0)
}

/// The cells of each shape, turned by 0 to 3 times 90°.
fn turned_masks(shapes: &[Shape], scale: f64) -> Vec<[Mask; 4]> {
    let turned = |shape: &Shape| {
        let corners = shape.corners().map(|c| c.map(|p| in_cells(p, shape.size, scale)));
        let mut raster = Raster::new(extent(shape.size * scale), corners);
        [0, 1, 2, 3].map(|turns| {
            if turns > 0 {
                raster = raster.turned();
            }
            raster.mask()
        })
    };
    shapes.par_iter().map(turned).collect()
}

/// First fit, in the first order that works; none if there is no room for one.
fn place_all(masks: &[[Mask; 4]], grid: Grid) -> Option<Vec<Spot>> {
    let orders = if masks.len() > MOST_IN_TWO_ORDERS { 1 } else { ORDERS.len() };
    ORDERS[..orders].par_iter().find_map_first(|key| {
        let mut order: Vec<usize> = (0..masks.len()).collect();
        order.sort_by_cached_key(|&at| {
            Reverse(key(masks[at][0].size.map(|cells| cells + grid.padding)))
        });
        place_in_order(masks, grid, &order)
    })
}

fn place_in_order(masks: &[[Mask; 4]], grid: Grid, order: &[usize]) -> Option<Vec<Spot>> {
    let mut board = Board::new(grid.side, grid.padding);
    let mut spots = vec![Spot { corner: [0, 0], turns: 0 }; masks.len()];
    let mut squares = Squares::default();
    for &at in order {
        let spot = best_spot(&board, &masks[at], &mut squares)?;
        board.take(&masks[at][usize::from(spot.turns)], spot.corner);
        spots[at] = spot;
    }
    Some(spots)
}

/// The turn and place with the topmost lower end.
fn best_spot(board: &Board, turned: &[Mask; 4], squares: &mut Squares) -> Option<Spot> {
    let mut best: Option<(usize, Spot)> = None;
    for (turns, mask) in (0u8..).zip(turned) {
        if turned[..usize::from(turns)].contains(mask) {
            continue;
        }
        let height = mask.size[1];
        let from = squares.first_row(board, mask.core.side)?.saturating_sub(mask.core.row);
        let to = match best {
            Some((end, _)) if end <= height => continue,
            Some((end, _)) => end - height - 1,
            None => usize::MAX,
        };
        if let Some(corner) = board.first_fit(mask, from, to) {
            best = Some((corner[1] + height, Spot { corner, turns }));
        }
    }
    Some(best?.1)
}

/// The first row in which a square of each side still fits; a shape that holds a square fits no
/// higher. Rows only fill up, so each is looked at once.
#[derive(Default)]
struct Squares {
    /// One per side, as far as they were needed: a square, and the row where it last fit.
    known: Vec<Option<(Mask, usize)>>,
}

impl Squares {
    /// None if there is no room for one.
    fn first_row(&mut self, board: &Board, side: usize) -> Option<usize> {
        if self.known.len() <= side {
            self.known.resize(side + 1, None);
        }
        let (square, row) = self.known[side].get_or_insert_with(|| (Mask::square(side), 0));
        *row = board.first_fit(square, *row, usize::MAX)?[1];
        Some(*row)
    }
}
