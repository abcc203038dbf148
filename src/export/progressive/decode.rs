//! Splits from blocks, as many as are asked for or are there.

use seamwise_attr::Split;

use super::blocks::{Damage, Reader};
use super::header::{Form, Header};
use super::recorded::Before;
use super::script::{ERROR, SPAN, STEP, Symbols, TRIANGLES};
use super::splits::ReadValues;
use super::surface::Surface;

/// How fine a level is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fineness {
    /// At most so many triangles.
    Triangles(u64),
    /// Not more error than this, in the units of the meshes.
    Error(f32),
    /// The source.
    Source,
}

/// Surfaces as far as they were read.
pub(super) struct Decoded {
    pub(super) surfaces: Vec<Surface>,
    pub(super) triangles: u64,
    pub(super) splits: u64,
    pub(super) error: f32,
    /// The reason why they are coarser than was asked.
    pub(super) damage: Option<Damage>,
    /// What follows the splits, if all of them are done.
    pub(super) rest: Option<usize>,
    /// The splits of each surface, if they are recorded.
    recorded: Option<Vec<Vec<Split>>>,
}

/// As [`read_splits`], with all splits of each surface.
pub(super) fn read_recorded(
    header: &Header,
    blocks: &[u8],
    fineness: Fineness,
    most: usize,
) -> Result<(Decoded, Vec<Vec<Split>>), Damage> {
    let record = Some(vec![Vec::new(); header.surfaces.len()]);
    let mut read = read(header, blocks, (fineness, record), most)?;
    let splits = read.recorded.take().unwrap_or_default();
    Ok((read, splits))
}

/// Reads splits until a level is as fine as it is to be. `most` bytes may be unpacked.
///
/// # Errors
/// [`Damage`] if even the coarsest level can't be read.
pub(super) fn read_splits(
    header: &Header,
    blocks: &[u8],
    fineness: Fineness,
    most: usize,
) -> Result<Decoded, Damage> {
    read(header, blocks, (fineness, None), most)
}

fn read(
    header: &Header,
    blocks: &[u8],
    (fineness, recorded): (Fineness, Option<Vec<Vec<Split>>>),
    most: usize,
) -> Result<Decoded, Damage> {
    let (forms, columns) = header.forms();
    let (mut first, mut at) = Reader::unpack(blocks, columns, most)?;
    let mut surfaces = Vec::new();
    for form in &forms {
        let mut surface = Surface::new(form.layout, form.strides.clone());
        split(&mut surface, form, &mut first, None)?;
        surfaces.push(surface);
    }
    let triangles = surfaces.iter().map(|own| own.triangles.len() as u64).sum();
    let (error, splits) = (header.error, 0);
    let (damage, rest) = (None, None);
    let mut out = Decoded { surfaces, triangles, splits, error, damage, rest, recorded };
    let mut left = most;
    while out.splits < header.splits && !out.is_fine(fineness, 0) {
        let (reader, length) = match Reader::unpack(&blocks[at..], columns, left) {
            Ok(block) => block,
            Err(damage) => {
                out.damage = Some(damage);
                return Ok(out);
            }
        };
        (at, left) = (at + length, left.saturating_sub(reader.len()));
        match out.read_block(reader, &forms, fineness) {
            Ok(true) => {}
            Ok(false) => return Ok(out),
            Err(damage) => {
                out.damage = Some(damage);
                return Ok(out);
            }
        }
    }
    out.rest = (out.splits == header.splits).then_some(at);
    Ok(out)
}

impl Decoded {
    /// Whether the next split, of so many triangles, is not wanted.
    fn is_fine(&self, fineness: Fineness, next: u64) -> bool {
        match fineness {
            Fineness::Triangles(triangles) => self.triangles + next > triangles,
            Fineness::Error(error) => self.error <= error,
            Fineness::Source => false,
        }
    }

    /// Does the steps of a block. Returns whether more are wanted.
    fn read_block(
        &mut self,
        mut from: Reader,
        forms: &[Form],
        fineness: Fineness,
    ) -> Result<bool, Damage> {
        while !from.is_done(STEP) {
            let step = from.next(STEP)?;
            let index = step as usize / 2;
            if index >= self.surfaces.len() {
                return Err(Damage::Changed);
            }
            if step % 2 == 1 {
                // Not before its first split: until then it is the level.
                let is_next = from.peek(STEP)? as usize == step as usize - 1;
                let next = u64::from(from.peek(TRIANGLES)?);
                if !is_next || self.is_fine(fineness, next) {
                    return if is_next { Ok(false) } else { Err(Damage::Changed) };
                }
                let span = from.next(SPAN)?;
                let mut values = ReadValues { from: &mut from, form: &forms[index] };
                self.surfaces[index].unsettle(span, &mut values)?;
                continue;
            }
            let next = u64::from(from.peek(TRIANGLES)?);
            if self.is_fine(fineness, next) {
                return Ok(false);
            }
            let record = self.recorded.as_mut().map(|all| (&mut all[index], self.error));
            split(&mut self.surfaces[index], &forms[index], &mut from, record)?;
            (self.triangles, self.splits) = (self.triangles + next, self.splits + 1);
            let bits = self.error.to_bits().checked_sub(from.next(ERROR)?);
            self.error = f32::from_bits(bits.ok_or(Damage::Changed)?);
        }
        Ok(true)
    }
}

fn split(
    surface: &mut Surface,
    form: &Form,
    from: &mut Reader,
    record: Option<(&mut Vec<Split>, f32)>,
) -> Result<(), Damage> {
    let changes = surface.split(from)?;
    let before = record.is_some().then(|| Before::of(surface, &changes));
    surface.place(&changes, &mut ReadValues { from, form })?;
    if let (Some((all, error)), Some(before)) = (record, before) {
        all.push(before.split(surface, &changes, error));
    }
    Ok(())
}
