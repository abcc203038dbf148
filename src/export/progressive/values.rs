//! Numbers told by what they are off from what is expected.
//!
//! A value of the source is told exactly: as the number of floats between it and the expected one, or of
//! steps of the grid that all values of its kind lie on. Any other is rounded to a step.

use super::blocks::{Columns, Reader, Result};

/// Columns of a value: four for the bytes of an exact one, one for steps.
pub(super) const COLUMNS: usize = 5;

/// Grids that values of files lie on: small integers, whole or normalized.
const GRIDS: [f32; 6] = [1.0, 255.0, 127.0, 65_535.0, 32_767.0, 65_536.0];

/// The way in which values of a kind are told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coding {
    /// The length that values between are rounded to.
    pub(super) step: f32,
    /// The number of steps in 1 of the grid of the source's values, 0 if there is none.
    pub(super) grid: f32,
}

impl Coding {
    /// The coding of values of the source.
    pub(super) fn of(values: &(impl Iterator<Item = f32> + Clone), step: f32) -> Self {
        let on_grid =
            |grid: f32| values.clone().all(|x| from_grid(to_grid(x, grid), grid) == bits(x));
        let grid = GRIDS.into_iter().find(|&grid| on_grid(grid)).unwrap_or(0.0);
        Self { step, grid }
    }

    /// Tells an exact value.
    pub(super) fn put(self, out: &mut Columns, column: usize, [value, expected]: [f32; 2]) {
        let difference = if self.grid > 0.0 {
            to_grid(value, self.grid).wrapping_sub(to_grid(expected, self.grid))
        } else {
            order(value).wrapping_sub(order(expected))
        };
        out.word(column, zigzag(difference));
    }

    /// The exact value that was told.
    pub(super) fn get(self, from: &mut Reader, column: usize, expected: f32) -> Result<f32> {
        let difference = unzigzag(from.word(column)?);
        Ok(f32::from_bits(if self.grid > 0.0 {
            from_grid(to_grid(expected, self.grid).wrapping_add(difference), self.grid)
        } else {
            disorder(order(expected).wrapping_add(difference))
        }))
    }

    /// Tells a value to a step. Returns what is read.
    pub(super) fn put_near(
        self,
        out: &mut Columns,
        column: usize,
        [value, expected]: [f32; 2],
    ) -> f32 {
        let steps = (f64::from(value) - f64::from(expected)) / f64::from(self.step);
        let steps = steps.round() as i32;
        out.number(column + 4, zigzag(steps));
        self.stepped(expected, steps)
    }

    fn stepped(self, from: f32, steps: i32) -> f32 {
        (f64::from(from) + f64::from(steps) * f64::from(self.step)) as f32
    }

    /// The value that was told to a step.
    pub(super) fn get_near(self, from: &mut Reader, column: usize, expected: f32) -> Result<f32> {
        Ok(self.stepped(expected, unzigzag(from.number(column + 4)?)))
    }
}

/// The bits of a value: of two zeros only one lies on a grid.
fn bits(x: f32) -> u32 {
    x.to_bits()
}

fn to_grid(x: f32, grid: f32) -> i32 {
    (f64::from(x) * f64::from(grid)).round() as i32
}

fn from_grid(steps: i32, grid: f32) -> u32 {
    ((f64::from(steps) / f64::from(grid)) as f32).to_bits()
}

/// The place of a float among all floats.
fn order(x: f32) -> i32 {
    let bits = x.to_bits() as i32;
    bits ^ ((bits >> 31) as u32 >> 1) as i32
}

fn disorder(place: i32) -> u32 {
    (place ^ ((place >> 31) as u32 >> 1) as i32) as u32
}

fn zigzag(x: i32) -> u32 {
    (x << 1 ^ x >> 31) as u32
}

fn unzigzag(x: u32) -> i32 {
    (x >> 1) as i32 ^ -((x & 1) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn told(coding: Coding, value: f32, expected: f32, is_near: bool) -> f32 {
        let mut columns = Columns::new(COLUMNS);
        if is_near {
            coding.put_near(&mut columns, 0, [value, expected]);
            coding.get_near(&mut Reader::of(columns), 0, expected).unwrap()
        } else {
            coding.put(&mut columns, 0, [value, expected]);
            coding.get(&mut Reader::of(columns), 0, expected).unwrap()
        }
    }

    proptest! {
        #[test]
        fn values_come_back_to_the_bit_whatever_was_expected(value: f32, expected: f32) {
            let coding = Coding { step: 1.0, grid: 0.0 };
            prop_assert_eq!(told(coding, value, expected, false).to_bits(), value.to_bits());
        }

        #[test]
        fn values_on_a_grid_come_back_to_the_bit(value in 0u8..=255, expected: f32) {
            let value = f32::from(value) / 255.0;
            let coding = Coding::of(&[value, 0.2].into_iter(), 1.0);
            prop_assert!(coding.grid > 0.0);
            prop_assert_eq!(told(coding, value, expected, false).to_bits(), value.to_bits());
        }

        #[test]
        fn values_between_come_back_to_a_step(value in -10f32..10.0, expected in -10f32..10.0) {
            let coding = Coding { step: 0.125, grid: 0.0 };
            prop_assert!((told(coding, value, expected, true) - value).abs() <= 0.0626);
        }
    }

    #[test]
    fn a_negative_zero_is_on_no_grid() {
        assert_eq!(Coding::of(&[-0.0, 1.0].into_iter(), 1.0).grid, 0.0);
        assert_eq!(Coding::of(&[0.5, 1.0].into_iter(), 1.0).grid, 65_536.0);
    }
}
