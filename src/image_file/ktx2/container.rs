//! The form of KTX2 files (KTX File Format Specification, version 2.0): a header, an index of mip levels, a
//! descriptor of the data's format, keys with values, and the levels, the smallest first.

/// Offsets in the header of the width, the height, the number of levels, the scheme of the levels'
/// compression, and the length of the decompressed first level (KTX 2.0 §3).
pub(super) const WIDTH: usize = 20;
pub(super) const HEIGHT: usize = 24;
const LEVELS: usize = 40;
pub(super) const SCHEME: usize = 44;
pub(super) const LENGTH: usize = 96;
/// The scheme of Zstandard.
pub(super) const ZSTANDARD: u32 = 2;

/// The first bytes of every file.
const IDENTIFIER: [u8; 12] = *b"\xabKTX 20\xbb\r\n\x1a\n";
/// Bytes of the header and of an entry in the index of levels.
const HEADER_BYTES: usize = 80;
const ENTRY_BYTES: usize = 24;

/// The little-endian number at a place of a file.
pub(super) fn number(file: &[u8], at: usize) -> Option<u32> {
    file.get(at..)?.first_chunk().map(|&bytes| u32::from_le_bytes(bytes))
}

/// Width and height in texels.
pub(crate) fn size(file: &[u8]) -> Option<[u32; 2]> {
    Some([number(file, WIDTH)?, number(file, HEIGHT)?])
}

/// Number of mip levels.
pub(crate) fn level_count(file: &[u8]) -> Option<u32> {
    number(file, LEVELS)
}

/// A texture in blocks of UASTC.
pub(super) struct Texture {
    /// Width and height in texels.
    pub(super) size: [u32; 2],
    /// Whether its texels are colors: in sRGB, with the primaries of BT.709.
    pub(super) is_color: bool,
    pub(super) has_alpha: bool,
    /// The levels, the largest first.
    pub(super) levels: Vec<Level>,
}

/// A mip level.
pub(super) struct Level {
    /// Its blocks, compressed by Zstandard.
    pub(super) bytes: Vec<u8>,
    /// Bytes of the blocks.
    pub(super) block_bytes: usize,
}

impl Texture {
    /// The file.
    pub(super) fn to_file(&self) -> Vec<u8> {
        let format = self.data_format();
        let keys = [("KTXorientation", "rd"), ("KTXwriter", WRITER)].map(key).concat();
        let format_at = HEADER_BYTES + ENTRY_BYTES * self.levels.len();
        let keys_at = format_at + format.len();
        let [width, height] = self.size;
        let mut file = IDENTIFIER.to_vec();
        // No Vulkan format, types of one byte, no depth, no layers, one face.
        let levels = self.levels.len() as u32;
        let head = [0, 1, width, height, 0, 0, 1, levels, ZSTANDARD];
        let places = [format_at, format.len(), keys_at, keys.len()].map(|own| own as u32);
        head.iter().chain(&places).for_each(|own| file.extend(own.to_le_bytes()));
        // No data that is common to all levels.
        file.extend([0; 16]);
        let mut at = keys_at + keys.len();
        let mut entries = vec![[0u64; 3]; self.levels.len()];
        for (entry, level) in entries.iter_mut().zip(&self.levels).rev() {
            *entry = [at, level.bytes.len(), level.block_bytes].map(|own| own as u64);
            at += level.bytes.len();
        }
        entries.iter().flatten().for_each(|own| file.extend(own.to_le_bytes()));
        file.extend(format);
        file.extend(keys);
        self.levels.iter().rev().for_each(|level| file.extend(&level.bytes));
        file
    }

    /// The descriptor of the data's format (Khronos Data Format Specification 1.3 §5), as `KHR_texture_basisu` asks
    /// for it: primaries and transfer function tell colors from other data.
    fn data_format(&self) -> Vec<u8> {
        const BASIC: u32 = 0;
        const VERSION: u16 = 2;
        const UASTC: u8 = 166;
        // Primaries of BT.709 or none that are told, sRGB or linear; RGBA or RGB.
        let (primaries, transfer) = if self.is_color { (1, 2) } else { (0, 1) };
        let channel = if self.has_alpha { 3 } else { 0 };
        let mut block = BASIC.to_le_bytes().to_vec();
        block.extend(VERSION.to_le_bytes());
        // The length of this block, once it is known.
        block.extend([0; 2]);
        block.extend([UASTC, primaries, transfer, 0]);
        // Four by four texels, less one each, in 16 bytes of a single plane.
        block.extend([3, 3, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0]);
        // One sample: from bit 0 on 128 bits, less one, from the least to the greatest number.
        block.extend([0, 0, 127, channel, 0, 0, 0, 0]);
        block.extend([0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff]);
        let length = block.len() as u16;
        block[6..8].copy_from_slice(&length.to_le_bytes());
        let total = (block.len() + 4) as u32;
        [total.to_le_bytes().to_vec(), block].concat()
    }
}

/// The name of the program that wrote a file.
const WRITER: &str = concat!("seamwise ", env!("CARGO_PKG_VERSION"));

/// A key and its value, each ended by a zero, to a multiple of four bytes.
fn key((key, value): (&str, &str)) -> Vec<u8> {
    let text = format!("{key}\0{value}\0");
    let mut bytes = (text.len() as u32).to_le_bytes().to_vec();
    bytes.extend(text.as_bytes());
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_lie_where_the_index_says_the_smallest_first() {
        let level = |byte, length| Level { bytes: vec![byte; length], block_bytes: 16 * length };
        let levels = vec![level(7, 5), level(8, 3), level(9, 1)];
        let texture = Texture { size: [8, 4], is_color: true, has_alpha: false, levels };
        let file = texture.to_file();
        assert_eq!((size(&file), level_count(&file)), (Some([8, 4]), Some(3)));
        let mut end = file.len();
        for (index, (byte, length)) in [(7, 5), (8, 3), (9, 1)].into_iter().enumerate() {
            let own = |field: usize| {
                number(&file, HEADER_BYTES + ENTRY_BYTES * index + 8 * field).unwrap() as usize
            };
            assert_eq!((own(0) + own(1), own(1), own(2)), (end, length, 16 * length));
            assert!(file[own(0)..end].iter().all(|own| *own == byte));
            end = own(0);
        }
        // Keys end where the levels begin.
        let [at, length] = [56, 60].map(|at| number(&file, at).unwrap() as usize);
        assert_eq!(at + length, end);
        assert!(file[at..end].windows(9).any(|own| own == b"KTXwriter"));
    }

    #[test]
    fn colors_and_other_data_are_told_apart_by_primaries_and_transfer_function() {
        let of = |is_color, has_alpha| {
            let texture = Texture { size: [4, 4], is_color, has_alpha, levels: Vec::new() };
            let format = texture.data_format();
            assert_eq!(format.len(), 44);
            assert_eq!((format[0], format[10], format[12]), (44, 40, 166));
            (format[13], format[14], format[31])
        };
        assert_eq!(of(true, false), (1, 2, 0));
        assert_eq!(of(false, true), (0, 1, 3));
    }
}
