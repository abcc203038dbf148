//! The values of a split, read and written.

use glam::Vec3;
use seamwise_attr::{Layout, Mesh, PointId, WedgeId};

use super::blocks::{Columns, Damage, Reader, Result};
use super::header::Form;
use super::script::{EXACT, EXACT_POINTS, EXACT_WEDGES, KNOWN, NEAR, POSITIONS, ROWS};
use super::told::{Values, to_unit};
use super::values::COLUMNS;

/// Values from a block.
pub(super) struct ReadValues<'a> {
    pub(super) from: &'a mut Reader,
    pub(super) form: &'a Form,
}

impl Values for ReadValues<'_> {
    fn position(&mut self, _: u32, expected: Vec3, known: &mut Option<Vec3>) -> Result<Vec3> {
        let told = self.from.byte(EXACT_POINTS)?;
        if told == KNOWN {
            return known.ok_or(Damage::Changed);
        }
        let (coding, mut position) = (self.form.position, expected.to_array());
        for (at, x) in position.iter_mut().enumerate() {
            let column = POSITIONS + at * COLUMNS;
            *x = match told {
                EXACT => coding.get(self.from, column, *x)?,
                NEAR => coding.get_near(self.from, column, *x)?,
                _ => return Err(Damage::Changed),
            };
        }
        finite(&position)?;
        let position = position.into();
        if told == EXACT {
            *known = Some(position);
        }
        Ok(position)
    }

    fn row(&mut self, _: u32, row: &mut [f32], known: Option<&[f32]>) -> Result<bool> {
        let (told, layout) = (self.from.byte(EXACT_WEDGES)?, self.form.layout);
        if told == KNOWN {
            row.copy_from_slice(known.ok_or(Damage::Changed)?);
            return Ok(true);
        }
        for own in in_order(layout, row) {
            let (coding, column) = (self.form.row[own[0]], ROWS + own[1] * COLUMNS);
            let expected = expected(layout, row, own);
            row[own[0]] = match told {
                EXACT => coding.get(self.from, column, expected)?,
                NEAR => coding.get_near(self.from, column, expected)?,
                _ => return Err(Damage::Changed),
            };
        }
        if told == NEAR {
            to_unit(layout, row);
        }
        finite(row)?;
        Ok(told == EXACT)
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

/// The floats of a row in the order in which they are told, each with the one whose columns it goes into: the largest
/// of a normal comes last, since it follows from the others.
fn in_order(layout: Layout, row: &[f32]) -> impl Iterator<Item = [usize; 2]> + use<> {
    let start = layout.normal();
    let normal = if layout.normal { start..start + 3 } else { 0..0 };
    let largest = normal
        .clone()
        .fold(start, |largest, at| if row[at].abs() > row[largest].abs() { at } else { largest });
    (0..row.len()).map(move |place| {
        let at = match place {
            _ if !normal.contains(&place) => place,
            _ if place + 1 == normal.end => largest,
            _ => place + usize::from(place >= largest),
        };
        [at, place]
    })
}

/// What is expected of a value of a row, told in a place, once those before it are known.
fn expected(layout: Layout, row: &[f32], [at, place]: [usize; 2]) -> f32 {
    let start = layout.normal();
    if !layout.normal || place != start + 2 {
        return row[at];
    }
    let others = (start..start + 3).filter(|&own| own != at).map(|own| f64::from(row[own]));
    let rest = 1.0 - others.map(|x| x * x).sum::<f64>();
    (rest.max(0.0).sqrt() as f32).copysign(row[at])
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
    fn position(&mut self, point: u32, expected: Vec3, known: &mut Option<Vec3>) -> Result<Vec3> {
        let name = self.points[point as usize];
        let own = self.mesh.positions[name];
        let position = own.to_array();
        let told = told(&position, &self.source.positions[name].to_array(), known.is_some());
        self.out.byte(EXACT_POINTS, told);
        if told == KNOWN {
            return Ok(own);
        }
        let (coding, mut near) = (self.form.position, expected.to_array());
        for (at, x) in near.iter_mut().enumerate() {
            let column = POSITIONS + at * COLUMNS;
            let values = [position[at], *x];
            match told {
                EXACT => coding.put(self.out, column, values),
                _ => *x = coding.put_near(self.out, column, values),
            }
        }
        if told == EXACT {
            *known = Some(own);
            return Ok(own);
        }
        Ok(near.into())
    }

    fn row(&mut self, wedge: u32, row: &mut [f32], known: Option<&[f32]>) -> Result<bool> {
        let (name, layout) = (self.wedges[wedge as usize], self.form.layout);
        let own = self.mesh.row(name);
        let told = told(own, self.source.row(name), known.is_some());
        self.out.byte(EXACT_WEDGES, told);
        if told == KNOWN {
            row.copy_from_slice(own);
            return Ok(true);
        }
        for [at, place] in in_order(layout, row) {
            let (coding, column) = (self.form.row[at], ROWS + place * COLUMNS);
            let values = [own[at], expected(layout, row, [at, place])];
            if told == EXACT {
                coding.put(self.out, column, values);
                row[at] = own[at];
            } else {
                row[at] = coding.put_near(self.out, column, values);
            }
        }
        if told == NEAR {
            to_unit(layout, row);
        }
        Ok(told == EXACT)
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

/// How a value is told that is to be this, where the source has that.
fn told(own: &[f32], source: &[f32], is_known: bool) -> u8 {
    let is_source = own.iter().zip(source).all(|(a, b)| a.to_bits() == b.to_bits());
    match (is_source, is_known) {
        (false, _) => NEAR,
        (true, false) => EXACT,
        (true, true) => KNOWN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_of_a_normal_comes_last_and_follows_from_the_others() {
        let layout = Layout { uv_sets: 1, normal: true, color: 0 };
        let row = [0.9, 0.8, 0.1, -0.7, 0.2];
        let order: Vec<[usize; 2]> = in_order(layout, &row).collect();
        assert_eq!(order, [[0, 0], [1, 1], [2, 2], [4, 3], [3, 4]]);
        let told = [0.9, 0.8, 0.6, -0.7, 0.0];
        assert!((expected(layout, &told, [3, 4]) + 0.8).abs() < 1e-6);
        assert_eq!(expected(layout, &told, [2, 2]), 0.6, "the others as they are");
        assert_eq!(in_order(Layout::default(), &[]).count(), 0);
    }
}
