//! Blocks of columns: bytes of one kind together, since those are alike.

use std::io::{Read, Write};

use flate2::Crc;
use flate2::read::DeflateDecoder;
use flate2::write::DeflateEncoder;

/// Bytes before a block's payload: its length, its checksum.
pub(super) const HEADER: usize = 8;

/// The reason why a block can't be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Damage {
    /// The file ends within it.
    Truncated,
    /// Its bytes are not what was written.
    Changed,
}

/// A result of reading.
pub(super) type Result<T> = std::result::Result<T, Damage>;

/// Columns of a block, written.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns(Vec<Vec<u8>>);

impl Columns {
    /// So many empty columns.
    pub(super) fn new(count: usize) -> Self {
        Self(vec![Vec::new(); count])
    }

    pub(super) fn byte(&mut self, column: usize, byte: u8) {
        self.0[column].push(byte);
    }

    /// A number, seven bits a byte, the least first.
    pub(super) fn number(&mut self, column: usize, mut number: u32) {
        while number > 127 {
            self.0[column].push(number as u8 | 128);
            number >>= 7;
        }
        self.0[column].push(number as u8);
    }

    /// A word, each byte in a column of its own, the least first.
    pub(super) fn word(&mut self, column: usize, word: u32) {
        for (at, byte) in word.to_le_bytes().into_iter().enumerate() {
            self.0[column + at].push(byte);
        }
    }

    /// The block: its length, its checksum, then for each column its length, that of its packed bytes, or 0
    /// if it is stored as it is, and these.
    pub(super) fn pack(&self) -> std::io::Result<Vec<u8>> {
        let mut payload = Self::new(1);
        for column in &self.0 {
            let mut encoder = DeflateEncoder::new(Vec::new(), flate2::Compression::best());
            encoder.write_all(column)?;
            let packed = encoder.finish()?;
            let is_smaller = packed.len() < column.len();
            payload.number(0, column.len() as u32);
            if !column.is_empty() {
                payload.number(0, if is_smaller { packed.len() as u32 } else { 0 });
                payload.0[0].extend(if is_smaller { &packed } else { column });
            }
        }
        let payload = payload.0.swap_remove(0);
        let length = payload.len() as u32;
        Ok([&length.to_le_bytes()[..], &checksum(&payload).to_le_bytes(), &payload].concat())
    }
}

fn checksum(bytes: &[u8]) -> u32 {
    let mut crc = Crc::new();
    crc.update(bytes);
    crc.sum()
}

/// Columns of a block, being read.
#[derive(Clone, Debug, Default)]
pub(super) struct Reader {
    columns: Vec<Vec<u8>>,
    at: Vec<usize>,
}

impl Reader {
    /// Reads the block at the start of `bytes`, of so many columns, which may hold up to `most` bytes. Returns
    /// how long it is.
    pub(super) fn unpack(bytes: &[u8], count: usize, most: usize) -> Result<(Self, usize)> {
        let header = bytes.get(..HEADER).ok_or(Damage::Truncated)?;
        let word = |at: usize| u32::from_le_bytes([0, 1, 2, 3].map(|byte| header[at + byte]));
        let length = word(0) as usize;
        let payload = bytes[HEADER..].get(..length).ok_or(Damage::Truncated)?;
        if checksum(payload) != word(4) {
            return Err(Damage::Changed);
        }
        let (mut rest, mut left) = (payload, most);
        let mut columns = Vec::new();
        for _ in 0..count {
            let column = unpack_column(&mut rest, left)?;
            left -= column.len();
            columns.push(column);
        }
        Ok((Self { at: vec![0; columns.len()], columns }, HEADER + length))
    }

    /// A block as it was written.
    #[cfg(test)]
    pub(super) fn of(columns: Columns) -> Self {
        Self { at: vec![0; columns.0.len()], columns: columns.0 }
    }

    /// The columns, to be written anew.
    #[cfg(test)]
    pub(super) fn into_columns(self, change: impl FnOnce(&mut [Vec<u8>])) -> Columns {
        let mut columns = self.columns;
        change(&mut columns);
        Columns(columns)
    }

    /// Bytes in all columns.
    pub(super) fn len(&self) -> usize {
        self.columns.iter().map(Vec::len).sum()
    }

    /// Whether a column has been read to its end.
    pub(super) fn is_done(&self, column: usize) -> bool {
        self.at[column] == self.columns[column].len()
    }

    pub(super) fn byte(&mut self, column: usize) -> Result<u8> {
        let byte = self.columns[column].get(self.at[column]).ok_or(Damage::Changed)?;
        self.at[column] += 1;
        Ok(*byte)
    }

    pub(super) fn number(&mut self, column: usize) -> Result<u32> {
        let (number, length) = number(&self.columns[column][self.at[column]..])?;
        self.at[column] += length;
        Ok(number)
    }

    /// The next number, which is read again.
    pub(super) fn peek(&self, column: usize) -> Result<u32> {
        number(&self.columns[column][self.at[column]..]).map(|(number, _)| number)
    }

    pub(super) fn word(&mut self, column: usize) -> Result<u32> {
        let mut word = [0; 4];
        for (at, byte) in word.iter_mut().enumerate() {
            *byte = self.byte(column + at)?;
        }
        Ok(u32::from_le_bytes(word))
    }
}

fn unpack_column(rest: &mut &[u8], most: usize) -> Result<Vec<u8>> {
    let mut length = || {
        let (number, length) = number(rest)?;
        *rest = &rest[length..];
        Ok(number as usize)
    };
    let whole = length()?;
    if whole == 0 {
        return Ok(Vec::new());
    }
    let packed = length()?;
    let stored = rest.get(..if packed > 0 { packed } else { whole }).ok_or(Damage::Changed)?;
    *rest = &rest[stored.len()..];
    if whole > most {
        return Err(Damage::Changed);
    }
    if packed == 0 {
        return Ok(stored.to_vec());
    }
    let mut column = Vec::new();
    let read = DeflateDecoder::new(stored).take(whole as u64 + 1).read_to_end(&mut column);
    if read.is_err() || column.len() != whole { Err(Damage::Changed) } else { Ok(column) }
}

/// The number at the start of bytes, and how many it takes.
fn number(bytes: &[u8]) -> Result<(u32, usize)> {
    let mut number = 0u64;
    for (at, &byte) in bytes.iter().enumerate().take(5) {
        number |= u64::from(byte & 127) << (7 * at);
        if byte < 128 {
            let number = u32::try_from(number).map_err(|_| Damage::Changed)?;
            return Ok((number, at + 1));
        }
    }
    Err(Damage::Changed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written() -> Columns {
        let mut columns = Columns::new(6);
        for number in [0, 127, 128, 65_535, u32::MAX] {
            columns.number(0, number);
            columns.word(2, number);
        }
        (0..=255).for_each(|byte| columns.byte(1, byte));
        columns
    }

    #[test]
    fn what_was_written_is_read() {
        let mut bytes = written().pack().unwrap();
        bytes.extend(b"what follows");
        let (mut reader, length) = Reader::unpack(&bytes, 6, 1000).unwrap();
        assert_eq!(&bytes[length..], b"what follows");
        for number in [0, 127, 128, 65_535, u32::MAX] {
            assert_eq!(reader.peek(0).unwrap(), number);
            assert_eq!((reader.number(0).unwrap(), reader.word(2).unwrap()), (number, number));
        }
        assert!((0..=255).all(|byte| reader.byte(1) == Ok(byte)));
        assert!(reader.is_done(0) && reader.byte(1) == Err(Damage::Changed));
    }

    #[test]
    fn what_is_cut_or_changed_is_told() {
        let bytes = written().pack().unwrap();
        for length in 0..bytes.len() {
            let cut = Reader::unpack(&bytes[..length], 6, 1000);
            assert_eq!(cut.unwrap_err(), Damage::Truncated);
        }
        for at in 4..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 1;
            assert_eq!(Reader::unpack(&changed, 6, 1000).unwrap_err(), Damage::Changed);
        }
        assert_eq!(Reader::unpack(&bytes, 6, 100).unwrap_err(), Damage::Changed, "too much");
    }
}
