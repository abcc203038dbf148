//! One stream of meshoptimizer's codecs, with its filter.

use meshopt::{
    FilterComponent, decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat,
    decode_index_buffer, decode_index_sequence, decode_vertex_buffer,
};
use serde::Deserialize;

use super::stride::by_stride;
use crate::document::asset::Asset;

/// The extension's object in a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Stream {
    pub(super) buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    pub(super) byte_length: usize,
    pub(super) byte_stride: usize,
    pub(super) count: usize,
    mode: Mode,
    #[serde(default)]
    filter: Filter,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

type Decoded = std::result::Result<Vec<u8>, String>;

impl Stream {
    /// Its bytes.
    pub(super) fn bytes<'a>(&self, asset: &'a Asset) -> std::result::Result<&'a [u8], String> {
        let buffer = asset.buffers.get(self.buffer).ok_or("there is no such buffer")?;
        let end = self.byte_offset.checked_add(self.byte_length);
        let bytes = end.and_then(|end| buffer.get(self.byte_offset..end));
        bytes.ok_or_else(|| {
            let Self { byte_offset, byte_length, .. } = self;
            format!("{byte_length} bytes at {byte_offset} run past its buffer of {}", buffer.len())
        })
    }

    /// The decoded elements, little-endian.
    pub(super) fn decode(&self, bytes: &[u8]) -> Decoded {
        let Self { count, byte_stride: stride, .. } = *self;
        match (self.mode, self.filter, stride) {
            (_, _, _) if count == 0 => Err("no elements".to_owned()),
            (Mode::Attributes, Filter::None, _) => rows(bytes, count, stride),
            (Mode::Attributes, Filter::Octahedral, 4) => {
                filtered(bytes, count, decode_filter_oct, i8::to_le_bytes)
            }
            (Mode::Attributes, Filter::Octahedral, 8) => {
                filtered(bytes, count, decode_filter_oct, i16::to_le_bytes)
            }
            (Mode::Attributes, Filter::Quaternion, 8) => {
                filtered(bytes, count, decode_filter_quat, i16::to_le_bytes)
            }
            (Mode::Attributes, Filter::Exponential, _) => exponential(bytes, count, stride),
            (Mode::Attributes, Filter::Color, 4) => {
                filtered(bytes, count, decode_filter_color, u8::to_le_bytes)
            }
            (Mode::Attributes, Filter::Color, 8) => {
                filtered(bytes, count, decode_filter_color, u16::to_le_bytes)
            }
            (Mode::Triangles, Filter::None, 2) if count.is_multiple_of(3) => {
                words(decode_index_buffer(bytes, count), u16::to_le_bytes)
            }
            (Mode::Triangles, Filter::None, 4) if count.is_multiple_of(3) => {
                words(decode_index_buffer(bytes, count), u32::to_le_bytes)
            }
            (Mode::Indices, Filter::None, 2) => {
                words(decode_index_sequence(bytes, count), u16::to_le_bytes)
            }
            (Mode::Indices, Filter::None, 4) => {
                words(decode_index_sequence(bytes, count), u32::to_le_bytes)
            }
            (mode, filter, _) => {
                Err(format!("{mode:?} of {count} × {stride} bytes with filter {filter:?}"))
            }
        }
    }
}

/// Numbers to bytes.
fn words<T, const N: usize>(decoded: meshopt::Result<Vec<T>>, bytes: fn(T) -> [u8; N]) -> Decoded {
    Ok(decoded.map_err(|error| damaged(&error))?.into_iter().flat_map(bytes).collect())
}

fn damaged(error: &meshopt::Error) -> String {
    format!("its stream is damaged or of another length ({error})")
}

/// Elements of four components, filtered.
fn filtered<C: FilterComponent, const N: usize>(
    stream: &[u8],
    count: usize,
    filter: fn(&mut [[C; 4]]),
    bytes: fn(C) -> [u8; N],
) -> Decoded {
    let mut rows: Vec<[C; 4]> =
        decode_vertex_buffer(stream, count).map_err(|error| damaged(&error))?;
    filter(&mut rows);
    Ok(rows.into_iter().flatten().flat_map(bytes).collect())
}

/// Elements of floats, each on its own with its exponent.
fn exponential(stream: &[u8], count: usize, stride: usize) -> Decoded {
    let rows = rows(stream, count, stride)?;
    let mut floats: Vec<[u32; 1]> =
        rows.as_chunks().0.iter().map(|&float| [u32::from_le_bytes(float)]).collect();
    decode_filter_exp(&mut floats);
    Ok(floats.into_iter().flatten().flat_map(u32::to_le_bytes).collect())
}

/// An element of so many bytes; arrays of any length have no default.
#[derive(Clone)]
struct Row<const N: usize>([u8; N]);

impl<const N: usize> Default for Row<N> {
    fn default() -> Self {
        Self([0; N])
    }
}

fn rows_of<const N: usize>(stream: &[u8], count: usize) -> Decoded {
    words(decode_vertex_buffer(stream, count), |row: Row<N>| row.0)
}

/// Elements as they are: of 4, 8, … 256 bytes.
fn rows(stream: &[u8], count: usize, stride: usize) -> Decoded {
    by_stride!(stride, rows_of, stream, count)
        .unwrap_or_else(|| Err(format!("elements of {stride} bytes")))
}
