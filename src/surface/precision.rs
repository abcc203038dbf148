//! How exact the positions of a primitive are: the grid that they were rounded to.
//!
//! Integers of `KHR_mesh_quantization` say what their step is. Floats do not, but a decoder of Draco makes
//! them of integers: along each axis all lie a whole number of steps apart, and the step is the same along all.

use glam::{DVec3, Vec3};
use gltf::json::accessor::ComponentType;
use seamwise_attr::Precision;

use crate::document::accessor::Elements;

/// Steps along the longest side of what lies on a grid: with fewer they show, with more they are hardly told
/// from the rounding of floats.
const STEPS: std::ops::RangeInclusive<f64> = 100.0..=3e5;

/// Bits of the coordinates along the longest side, where the box of the grid is that of the positions.
const BITS: std::ops::RangeInclusive<u32> = 8..=18;

/// The least step over the rounding of floats, and the least gap between coordinates in steps that is looked for.
const MIN_STEP: f64 = 10.0;
const GAPS: std::ops::RangeInclusive<u32> = 1..=4;

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
        let largest = f64::from(low.abs().max(high.abs()).max_element());
        let rounding = f64::from(f32::EPSILON) * largest;
        let side = f64::from((high - low).max_element());
        let fits = |step: &f64| {
            let grid = Self { low: low.as_dvec3(), step: *step };
            let most = OFF_GRID + 2.0 * rounding / step;
            *step >= MIN_STEP * rounding
                && STEPS.contains(&(side / step))
                && positions.iter().all(|p| grid.off(p.as_dvec3()) <= most)
        };
        let axis = (high - low).max_position();
        let step = BITS
            .map(|bits| side / f64::from((1u32 << bits) - 1))
            .find(fits)
            .or_else(|| steps(positions.iter().map(|p| p[axis]), rounding).find(fits))?;
        (!is_round(step)).then_some(Self { low: low.as_dvec3(), step })
    }

    /// How far a point is from the grid along the worst axis, in steps.
    fn off(&self, point: DVec3) -> f64 {
        let places = (point - self.low) / self.step;
        (places - places.round()).abs().max_element()
    }

    /// Whether all points of one of two grids lie on the other.
    fn is(&self, other: &Self) -> bool {
        let (fine, coarse) = if self.step <= other.step { (self, other) } else { (other, self) };
        let ratio = coarse.step / fine.step;
        (ratio - ratio.round()).abs() < 1e-6 * ratio && fine.off(coarse.low) < SAME_GRID
    }

    /// Half a diagonal of a cell.
    fn slack(&self) -> f64 {
        self.step * 0.75f64.sqrt()
    }
}

/// Steps that all of some places may be whole numbers of apart.
fn steps(places: impl Iterator<Item = f32>, rounding: f64) -> impl Iterator<Item = f64> {
    let mut places: Vec<f64> = places.map(f64::from).collect();
    places.sort_unstable_by(f64::total_cmp);
    places.dedup();
    let gap = places.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    GAPS.map(move |steps| gap / f64::from(steps))
        .take_while(move |&step| step >= MIN_STEP * rounding)
        .filter_map(move |step| refined(step, &places, rounding))
}

/// The step that all of some places in order are whole numbers of apart, if one near `step` is, which is known
/// from one gap. The more steps apart two places are, the better they tell it; but how many these are must be
/// known before.
fn refined(mut step: f64, places: &[f64], rounding: f64) -> Option<f64> {
    let mut error = 2.0 * rounding / step;
    loop {
        let most = 0.2 / error * step;
        let (mut start, mut widest) = (0, 0.0f64);
        for &place in places {
            while place - places[start] > most {
                start += 1;
            }
            widest = widest.max(place - places[start]);
        }
        let steps = (widest / step).round();
        if steps < 1.0 || (widest / step - steps).abs() > 0.3 {
            return None;
        }
        let next = 2.0 * rounding / widest;
        step = widest / steps;
        if next >= 0.9 * error {
            return (widest >= places.last()? - places[0]).then_some(step);
        }
        error = next;
    }
}

/// Whether a step is the unit of who made the shape, a millimeter, an inch or a sixteenth, and none that a
/// decoder computed: up to three decimal or seven binary digits.
fn is_round(step: f64) -> bool {
    let is_whole = |x: f64| (x - x.round()).abs() < 1e-3;
    let decimal = step / 10f64.powf(step.log10().floor()) * 100.0;
    let binary = step / step.log2().floor().exp2() * 64.0;
    is_whole(decimal) || is_whole(binary)
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
            if bits > 12 {
                continue;
            }
            // Of more bits than these 200 positions can tell without the box.
            let some: Vec<Vec3> = rounded.into_iter().filter(|p| p.y < -7.0).collect();
            let found = Grid::find(&some).unwrap();
            assert!((found.step / f64::from(step) - 1.0).abs() < 1e-4, "{bits} of a larger box");
        }
    }

    #[test]
    fn whole_millimeters_are_no_grid_of_a_decoder() {
        let whole: Vec<Vec3> = cloud().iter().map(|p| (p * 300.0).round()).collect();
        for unit in [1.0, 0.001, 0.0254, 0.0625] {
            let positions: Vec<Vec3> = whole.iter().map(|p| *p * unit).collect();
            assert_eq!(Grid::find(&positions), None, "{unit}");
        }
        let odd: Vec<Vec3> = whole.iter().map(|p| *p * 0.001_234_5).collect();
        assert!(Grid::find(&odd).is_some());
    }

    #[test]
    fn parts_on_one_grid_have_one_number() {
        let mut grids = Grids::default();
        let grid = |low: f64| Some(Grid { low: DVec3::splat(low), step: 0.1 });
        let coarse = Some(Grid { low: DVec3::splat(0.3), step: 0.4 });
        let parts = [None, grid(0.0), grid(0.5), grid(0.55), coarse];
        assert_eq!(parts.map(|own| grids.precision(own, None).grid), [0, 1, 1, 2, 1]);
        let moved = Some(Moved { scale: 2.0, slack: 1.0 });
        let own = grids.precision(grid(0.0), moved);
        assert!(own.grid == 3 && (own.slack - 1.0 - 0.2 * 0.75f64.sqrt()).abs() < 1e-12);
    }
}
