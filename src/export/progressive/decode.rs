//! Splits from blocks, as many as are asked for or are there.

use super::blocks::{Damage, Reader};
use super::header::{Form, Header};
use super::observer::Observer;
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
    read_observed(header, blocks, fineness, most, &mut ())
}

/// As [`read_splits`], while somebody looks on.
pub(super) fn read_observed(
    header: &Header,
    blocks: &[u8],
    fineness: Fineness,
    most: usize,
    observer: &mut impl Observer,
) -> Result<Decoded, Damage> {
    let (forms, columns) = header.forms();
    let (mut first, mut at) = Reader::unpack(blocks, columns, most)?;
    let mut surfaces = Vec::new();
    for (index, form) in forms.iter().enumerate() {
        let mut surface = Surface::new(form.layout, form.strides.clone());
        let changes = surface.split(&mut first)?;
        surface.place(&changes, &mut ReadValues { from: &mut first, form })?;
        observer.begun(index, &surface);
        surfaces.push(surface);
    }
    let triangles = surfaces.iter().map(|own| own.triangles.len() as u64).sum();
    let (error, splits) = (header.error, 0);
    let (damage, rest) = (None, None);
    let mut out = Decoded { surfaces, triangles, splits, error, damage, rest };
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
        match out.read_block(reader, &forms, fineness, observer) {
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
        observer: &mut impl Observer,
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
                observer.unsettled(index, &self.surfaces[index]);
                continue;
            }
            let next = u64::from(from.peek(TRIANGLES)?);
            if self.is_fine(fineness, next) {
                return Ok(false);
            }
            let surface = &mut self.surfaces[index];
            let changes = surface.split(&mut from)?;
            observer.parted(index, surface, &changes);
            surface.place(&changes, &mut ReadValues { from: &mut from, form: &forms[index] })?;
            observer.placed(index, surface, &changes, self.error);
            (self.triangles, self.splits) = (self.triangles + next, self.splits + 1);
            let bits = self.error.to_bits().checked_sub(from.next(ERROR)?);
            self.error = f32::from_bits(bits.ok_or(Damage::Changed)?);
        }
        Ok(true)
    }
}
