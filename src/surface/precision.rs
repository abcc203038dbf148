//! How exact the positions of a primitive are: the grid that they were rounded to.
//!
//! Integers of `KHR_mesh_quantization` say what their step is. Floats do not, but a decoder of Draco makes
//! them of integers: all lie on a grid whose step is the longest side of their box in 2ⁿ − 1 parts, from the
//! least coordinates on.

use glam::{DVec3, Vec3};
use gltf::json::accessor::ComponentType;
use seamwise_attr::Precision;

use crate::document::accessor::Elements;

/// The bits of coordinates that are looked for: with fewer a step shows, with more it is hardly told from
/// the rounding of floats.
const BITS: std::ops::RangeInclusive<u32> = 8..=18;

/// Positions that must lie on a grid before that is no accident.
const MIN_POSITIONS: usize = 32;

/// How far from it they may lie, in steps, besides the rounding of floats.
const OFF_GRID: f64 = 1e-3;

/// Two grids are one if a step or a point of theirs is off by less, in steps.
const SAME_GRID: f64 = 0.02;

/// A grid of equal steps along all axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    low: DVec3,
    step: f64,
}

impl Grid {
    /// The grid of positions as they are stored, if they lie on one. `floats` are their values.
    pub(super) fn of(elements: &Elements, floats: &[Vec3]) -> Option<Self> {
        let steps = match elements.component {
            ComponentType::I8 => 127.0,
            ComponentType::U8 => 255.0,
            ComponentType::I16 => 32767.0,
            ComponentType::U16 => 65535.0,
            _ => return Self::find(floats),
        };
        let step = if elements.normalized { 1.0 / steps } else { 1.0 };
        Some(Self { low: DVec3::ZERO, step })
    }

    fn find(positions: &[Vec3]) -> Option<Self> {
        if positions.len() < MIN_POSITIONS {
            return None;
        }
        let bounds = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) =
            positions.iter().fold(bounds, |(low, high), &p| (low.min(p), high.max(p)));
        let side = f64::from((high - low).max_element());
        let rounding = f64::from(f32::EPSILON) * f64::from(low.abs().max(high.abs()).max_element());
        let low = low.as_dvec3();
        BITS.map(|bits| Self { low, step: side / f64::from((1u32 << bits) - 1) }).find(|grid| {
            let most = OFF_GRID + rounding / grid.step;
            most < 0.1 && positions.iter().all(|p| grid.off(p.as_dvec3()) <= most)
        })
    }

    /// How far a point is from the grid along the worst axis, in steps.
    fn off(&self, point: DVec3) -> f64 {
        let places = (point - self.low) / self.step;
        (places - places.round()).abs().max_element()
    }

    fn is(&self, other: &Self) -> bool {
        (self.step / other.step - 1.0).abs() < 1e-6 && self.off(other.low) < SAME_GRID
    }

    /// Half a diagonal of a cell.
    fn slack(&self) -> f64 {
        self.step * 0.75f64.sqrt()
    }
}

/// The grids of a surface's parts, by their numbers: 0 is that of floats.
#[derive(Default)]
pub(super) struct Grids {
    known: Vec<Option<Grid>>,
}

impl Grids {
    /// The precision of a part on this grid, if any. A part in another frame than the surface's has a grid
    /// of its own, which is off by `moved` besides and `scale` times as coarse.
    pub(super) fn precision(&mut self, grid: Option<Grid>, frame: Option<Moved>) -> Precision {
        let slack = grid.map_or(0.0, |grid| grid.slack());
        if let Some(Moved { scale, slack: moved }) = frame {
            self.known.push(None);
            return Precision { grid: self.known.len() as u32, slack: slack * scale + moved };
        }
        let Some(grid) = grid else { return Precision::default() };
        let place = self.known.iter().position(|own| own.is_some_and(|own| own.is(&grid)));
        let place = place.unwrap_or_else(|| {
            self.known.push(Some(grid));
            self.known.len() - 1
        });
        Precision { grid: place as u32 + 1, slack }
    }
}

/// The space of a part within that of its surface.
#[derive(Clone, Copy)]
pub(super) struct Moved {
    /// The factor on lengths.
    pub(super) scale: f64,
    /// How far its positions may be off by the move, in the units of the surface.
    pub(super) slack: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud() -> Vec<Vec3> {
        let at = |k: u32, by: f32| (k as f32 * by).fract();
        (0..200).map(|k| Vec3::new(at(k, 0.618), at(k, 0.414) * 3.0 - 9.0, at(k, 0.732))).collect()
    }

    #[test]
    fn positions_of_a_draco_file_tell_their_grid_and_others_have_none() {
        let positions = cloud();
        assert_eq!(Grid::find(&positions), None);
        for bits in [8, 11, 14, 16] {
            let low = positions.iter().copied().reduce(Vec3::min).unwrap();
            let high = positions.iter().copied().reduce(Vec3::max).unwrap();
            let step = (high - low).max_element() / ((1u32 << bits) - 1) as f32;
            let rounded: Vec<Vec3> =
                positions.iter().map(|p| ((*p - low) / step).round() * step + low).collect();
            let found = Grid::find(&rounded).unwrap();
            assert!((found.step / f64::from(step) - 1.0).abs() < 1e-4, "{bits}");
        }
    }

    #[test]
    fn parts_on_one_grid_have_one_number() {
        let mut grids = Grids::default();
        let grid = |low: f64| Some(Grid { low: DVec3::splat(low), step: 0.1 });
        let numbers =
            [None, grid(0.0), grid(0.5), grid(0.55)].map(|own| grids.precision(own, None).grid);
        assert_eq!(numbers, [0, 1, 1, 2]);
        let moved = Some(Moved { scale: 2.0, slack: 1.0 });
        let own = grids.precision(grid(0.0), moved);
        assert!(own.grid == 3 && (own.slack - 1.0 - 0.2 * 0.75f64.sqrt()).abs() < 1e-12);
    }
}
