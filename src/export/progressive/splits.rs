//! The values of a split, read and written.

use glam::Vec3;
use seamwise_attr::{Layout, Mesh, PointId, WedgeId};

use super::blocks::{Columns, Damage, Reader, Result};
use super::header::Form;
use super::script::{EXACT_POINTS, EXACT_WEDGES, POSITIONS, ROWS};
use super::surface::{Values, to_unit};
use super::values::COLUMNS;

/// Values from a block.
pub(super) struct ReadValues<'a> {
    pub(super) from: &'a mut Reader,
    pub(super) form: &'a Form,
}

impl Values for ReadValues<'_> {
    fn position(&mut self, _: u32, expected: Vec3) -> Result<Vec3> {
        let is_exact = self.from.byte(EXACT_POINTS)? == 1;
        let (coding, mut position) = (self.form.position, expected.to_array());
        for (at, x) in position.iter_mut().enumerate() {
            let column = POSITIONS + at * COLUMNS;
            *x = match is_exact {
                true => coding.get(self.from, column, *x)?,
                false => coding.get_near(self.from, column, *x)?,
            };
        }
        finite(&position)?;
        Ok(position.into())
    }

    fn row(&mut self, _: u32, row: &mut [f32]) -> Result<()> {
        let (is_exact, layout) = (self.from.byte(EXACT_WEDGES)? == 1, self.form.layout);
        for (at, coding) in self.form.row.iter().enumerate() {
            let column = ROWS + at * COLUMNS;
            row[at] = match is_exact {
                true => coding.get(self.from, column, expected(layout, row, at))?,
                false => coding.get_near(self.from, column, row[at])?,
            };
        }
        if !is_exact {
            to_unit(layout, row);
        }
        finite(row)
    }

    fn carried(&mut self, _: u32, group: u32, bytes: &mut [u8]) -> Result<()> {
        for (byte, column) in bytes.iter_mut().zip(self.form.carried[group as usize]..) {
            *byte = byte.wrapping_add(self.from.byte(column)?);
        }
        Ok(())
    }
}

fn finite(values: &[f32]) -> Result<()> {
    if values.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Damage::Changed) }
}

/// What is expected of an exact value of a row once those before it are known: the last of a normal follows
/// from the others.
fn expected(layout: Layout, row: &[f32], at: usize) -> f32 {
    if layout.normal && at == layout.normal() + 2 {
        let [x, y] = [row[at - 2], row[at - 1]].map(f64::from);
        let z = (1.0 - x * x - y * y).max(0.0).sqrt() as f32;
        return z.copysign(row[at]);
    }
    row[at]
}

/// Values of a mesh, written. What is written is what a reader makes of it.
pub(super) struct WriteValues<'a> {
    pub(super) out: &'a mut Columns,
    pub(super) form: &'a Form,
    /// The mesh as it is to be, and the source.
    pub(super) mesh: &'a Mesh,
    pub(super) source: &'a Mesh,
    /// Points and wedges of the source by their numbers in the file.
    pub(super) points: &'a [PointId],
    pub(super) wedges: &'a [WedgeId],
    /// What else a wedge carries.
    pub(super) carried: &'a dyn Fn(WedgeId) -> Vec<u8>,
}

impl Values for WriteValues<'_> {
    fn position(&mut self, point: u32, expected: Vec3) -> Result<Vec3> {
        let name = self.points[point as usize];
        let position = self.mesh.positions[name].to_array();
        let is_exact = is_same(&position, &self.source.positions[name].to_array());
        self.out.byte(EXACT_POINTS, u8::from(is_exact));
        let (coding, mut told) = (self.form.position, expected.to_array());
        for (at, x) in told.iter_mut().enumerate() {
            let column = POSITIONS + at * COLUMNS;
            let values = [position[at], *x];
            if is_exact {
                coding.put(self.out, column, values);
                *x = position[at];
            } else {
                *x = coding.put_near(self.out, column, values);
            }
        }
        Ok(told.into())
    }

    fn row(&mut self, wedge: u32, row: &mut [f32]) -> Result<()> {
        let (name, layout) = (self.wedges[wedge as usize], self.form.layout);
        let own = self.mesh.row(name);
        let is_exact = is_same(own, self.source.row(name));
        self.out.byte(EXACT_WEDGES, u8::from(is_exact));
        for (at, coding) in self.form.row.iter().enumerate() {
            let column = ROWS + at * COLUMNS;
            if is_exact {
                coding.put(self.out, column, [own[at], expected(layout, row, at)]);
                row[at] = own[at];
            } else {
                row[at] = coding.put_near(self.out, column, [own[at], row[at]]);
            }
        }
        if !is_exact {
            to_unit(layout, row);
        }
        Ok(())
    }

    fn carried(&mut self, wedge: u32, group: u32, bytes: &mut [u8]) -> Result<()> {
        let own = (self.carried)(self.wedges[wedge as usize]);
        for ((byte, own), column) in
            bytes.iter_mut().zip(own).zip(self.form.carried[group as usize]..)
        {
            self.out.byte(column, own.wrapping_sub(*byte));
            *byte = own;
        }
        Ok(())
    }
}

fn is_same(a: &[f32], b: &[f32]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}
