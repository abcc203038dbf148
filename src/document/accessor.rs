//! Typed reading of any glTF accessor (glTF 2.0 §3.6.2): every component type, normalized,
//! strided, sparse, or without a buffer view.
//!
//! Every accessor is first made tight, however the file stores it: `count` elements one after the
//! other. Every size is checked against the bytes there are before anything is allocated.

use gltf::json::accessor::{Accessor as Json, ComponentType, Type, sparse::Sparse};
use gltf::json::validation::Checked;

use super::asset::Asset;
use crate::error::{Error, Result};

/// Most bytes of zeros that an accessor without a buffer view may stand for, per byte of all
/// buffers: zeros cost a file nothing, so nothing else bounds them. In earnest they lie under the
/// sparse values of a morph target, which has as many elements as there are positions, each of at
/// most twice the size.
const ZEROS_PER_BYTE: usize = 4;

/// An accessor's elements, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Elements {
    /// `count · components · component.size()` bytes, little-endian.
    pub bytes: Vec<u8>,
    /// The type of each component.
    pub component: ComponentType,
    /// Components per element.
    pub components: usize,
    /// Whether integers stand for 0…1 or −1…1.
    pub normalized: bool,
}

/// Reads the accessor at `index`; `at` is the place that refers to it.
///
/// # Errors
/// [`Error::Invalid`] if it is missing, malformed or runs past its data.
pub fn read(asset: &Asset, index: usize, at: &str) -> Result<Elements> {
    if index >= asset.count("accessors") {
        return Err(Error::invalid(at, format!("there is no accessor {index}")));
    }
    let at = format!("/accessors/{index}");
    let parsed = parse(asset, &at)?;
    elements(asset, &at, parsed)
}

/// The 4 × 4 matrices of the accessor at `index`, column after column; `at` is the place that refers to
/// it.
///
/// # Errors
/// [`Error::Invalid`] if it is missing or malformed, or holds something else.
pub(crate) fn matrices(asset: &Asset, index: usize, at: &str) -> Result<Vec<[f32; 16]>> {
    let place = format!("/accessors/{index}");
    let json: Json = asset.parse(&place)?;
    let (Checked::Valid(component), Checked::Valid(Type::Mat4)) = (json.component_type, json.type_)
    else {
        return Err(Error::invalid(at, format!("accessor {index} holds no 4 × 4 matrices")));
    };
    let read = elements(asset, &place, (json, component.0, 16))?;
    Ok(read.floats().as_chunks().0.to_vec())
}

/// The elements of an accessor as parsed.
fn elements(
    asset: &Asset,
    at: &str,
    (json, component, components): (Json, ComponentType, usize),
) -> Result<Elements> {
    let size = component.size() * components;
    let count = usize::try_from(json.count.0).unwrap_or(usize::MAX);
    let mut bytes = match json.buffer_view {
        Some(view) => {
            let offset = json.byte_offset.unwrap_or_default().0;
            tight(asset, at, view.value(), Run { offset, count, size })?
        }
        None => vec![0; zeros(asset, at, count, size)?],
    };
    if let Some(sparse) = &json.sparse {
        replace_sparse(asset, at, sparse, &mut bytes, size)?;
    }
    Ok(Elements { bytes, component, components, normalized: json.normalized })
}

/// The number of an accessor's elements, and of their bytes together: checked as [`read`] does, and
/// nothing is copied.
///
/// # Errors
/// As [`read`].
pub(crate) fn measure(asset: &Asset, index: usize) -> Result<[u64; 2]> {
    let at = format!("/accessors/{index}");
    let (json, component, components) = parse(asset, &at)?;
    let size = component.size() * components;
    let count = usize::try_from(json.count.0).unwrap_or(usize::MAX);
    match json.buffer_view {
        Some(view) => {
            let offset = json.byte_offset.unwrap_or_default().0;
            Run { offset, count, size }.within(asset, &at, view.value())?;
        }
        None => drop(zeros(asset, &at, count, size)?),
    }
    Ok([count as u64, (count * size) as u64])
}

/// The bytes of an accessor without a buffer view, if it may have so many.
fn zeros(asset: &Asset, at: &str, count: usize, size: usize) -> Result<usize> {
    let there: usize = asset.buffers.iter().map(|own| own.len()).sum();
    let bytes = count.checked_mul(size).filter(|&bytes| bytes / ZEROS_PER_BYTE <= there);
    bytes.ok_or_else(|| Error::invalid(at, format!("{count} elements without data")))
}

/// An accessor's description, with the type of its components and how many an element has.
fn parse(asset: &Asset, at: &str) -> Result<(Json, ComponentType, usize)> {
    let json: Json = asset.parse(at)?;
    let (Checked::Valid(component), Checked::Valid(shape)) = (json.component_type, json.type_)
    else {
        return Err(Error::invalid(at, "unknown component type or element type"));
    };
    if matches!(shape, Type::Mat2 | Type::Mat3 | Type::Mat4) {
        return Err(Error::invalid(at, "a matrix where a number or a vector belongs"));
    }
    Ok((json, component.0, shape.multiplicity()))
}

/// Bytes that the accessor at a JSON pointer takes in its buffers.
///
/// # Errors
/// [`Error::Invalid`] if it is missing or malformed.
pub(crate) fn stored_bytes(asset: &Asset, at: &str) -> Result<usize> {
    let (json, component, components) = parse(asset, at)?;
    let size = component.size() * components;
    let times = |count: u64, size: usize| (count as usize).saturating_mul(size);
    let dense = json.buffer_view.map_or(0, |_| times(json.count.0, size));
    let Some(sparse) = json.sparse else { return Ok(dense) };
    let index = match sparse.indices.component_type {
        Checked::Valid(component) => component.0.size(),
        Checked::Invalid => 0,
    };
    Ok(dense.saturating_add(times(sparse.count.0, index + size)))
}

/// The storage of the accessor at a JSON pointer, without elements.
///
/// # Errors
/// [`Error::Invalid`] if it is missing or malformed.
#[cfg(feature = "draco")]
pub(crate) fn without_elements(asset: &Asset, at: &str) -> Result<Elements> {
    let (json, component, components) = parse(asset, at)?;
    Ok(Elements { bytes: Vec::new(), component, components, normalized: json.normalized })
}

/// `count` elements of `size` bytes, from `offset` on.
#[derive(Clone, Copy)]
struct Run {
    offset: u64,
    count: usize,
    size: usize,
}

impl Run {
    /// The bytes of a buffer view from its first element on, and how far apart they are; an error if
    /// they run past its end.
    fn within<'a>(&self, asset: &'a Asset, at: &str, view: usize) -> Result<(&'a [u8], usize)> {
        let (bytes, view_json) = asset.view(view)?;
        let Self { offset, count, size } = *self;
        let stride = view_json.byte_stride.map_or(size, |stride| stride.0);
        let start = usize::try_from(offset).unwrap_or(usize::MAX);
        let length = count
            .checked_sub(1)
            .map_or(Some(0), |last| last.checked_mul(stride).and_then(|at| at.checked_add(size)));
        let end = length.and_then(|length| length.checked_add(start));
        let there = end.and_then(|end| bytes.get(start..end)).filter(|_| stride >= size);
        let past_end = || {
            let what = format!(
                "{count} elements of {size} bytes, {stride} apart, run past /bufferViews/{view} of {} bytes",
                bytes.len()
            );
            Error::invalid(at, what)
        };
        Ok((there.ok_or_else(past_end)?, stride))
    }
}

/// Copies elements out of a buffer view.
fn tight(asset: &Asset, at: &str, view: usize, run: Run) -> Result<Vec<u8>> {
    let (bytes, stride) = run.within(asset, at, view)?;
    let Run { count, size, .. } = run;
    if stride == size {
        return Ok(bytes[..count * size].to_vec());
    }
    let mut out = Vec::with_capacity(count * size);
    for element in 0..count {
        out.extend_from_slice(&bytes[element * stride..][..size]);
    }
    Ok(out)
}

/// Puts a sparse accessor's own values over its elements.
fn replace_sparse(
    asset: &Asset,
    at: &str,
    sparse: &Sparse,
    elements: &mut [u8],
    size: usize,
) -> Result<()> {
    let at = format!("{at}/sparse");
    let count = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
    let Checked::Valid(component) = sparse.indices.component_type else {
        return Err(Error::invalid(at, "unknown component type of its indices"));
    };
    let component = component.0;
    let run = Run { offset: sparse.indices.byte_offset.0, count, size: component.size() };
    let indices = tight(asset, &at, sparse.indices.buffer_view.value(), run)?;
    let run = Run { offset: sparse.values.byte_offset.0, count, size };
    let values = tight(asset, &at, sparse.values.buffer_view.value(), run)?;
    let indices = Elements { bytes: indices, component, components: 1, normalized: false };
    for (index, value) in indices.indices(&at)?.into_iter().zip(values.chunks_exact(size)) {
        let start = index as usize * size;
        let Some(element) = elements.get_mut(start..start + size) else {
            return Err(Error::invalid(at, format!("index {index} is past its accessor's end")));
        };
        element.copy_from_slice(value);
    }
    Ok(())
}

impl Elements {
    /// Bytes of one element.
    pub fn size(&self) -> usize {
        self.component.size() * self.components
    }

    /// Number of elements.
    pub fn count(&self) -> usize {
        self.bytes.len() / self.size()
    }

    /// The bytes of one element.
    pub fn element(&self, index: usize) -> &[u8] {
        &self.bytes[index * self.size()..][..self.size()]
    }

    /// All components as floats, normalized integers mapped to 0…1 or −1…1 (glTF 2.0 §3.6.2.2).
    pub fn floats(&self) -> Vec<f32> {
        self.decode(&self.bytes, self.normalized)
    }

    /// All components as floats, integers as they are stored.
    pub(crate) fn stored_floats(&self) -> Vec<f32> {
        self.decode(&self.bytes, false)
    }

    /// The components of one element as floats, as [`Elements::floats`] gives them.
    pub fn row(&self, index: usize) -> Vec<f32> {
        self.decode(self.element(index), self.normalized)
    }

    fn decode(&self, bytes: &[u8], normalized: bool) -> Vec<f32> {
        let signed =
            |value: f32, most: f32| if normalized { (value / most).max(-1.0) } else { value };
        let unsigned = |value: f32, most: f32| if normalized { value / most } else { value };
        match self.component {
            ComponentType::I8 => bytes.iter().map(|&b| signed(f32::from(b as i8), 127.0)).collect(),
            ComponentType::U8 => bytes.iter().map(|&b| unsigned(f32::from(b), 255.0)).collect(),
            ComponentType::I16 => {
                words(bytes).map(|b| signed(f32::from(i16::from_le_bytes(b)), 32767.0)).collect()
            }
            ComponentType::U16 => {
                words(bytes).map(|b| unsigned(f32::from(u16::from_le_bytes(b)), 65535.0)).collect()
            }
            ComponentType::U32 => words(bytes).map(|b| u32::from_le_bytes(b) as f32).collect(),
            ComponentType::F32 => words(bytes).map(f32::from_le_bytes).collect(),
        }
    }

    /// Floats as components of this type, the inverse of [`Elements::floats`]: integers are the
    /// nearest there are.
    pub fn encode(&self, values: impl IntoIterator<Item = f32>) -> Vec<u8> {
        let scaled =
            |x: f32, most: f32| if self.normalized { (x * most).round() } else { x.round() };
        let values = values.into_iter();
        match self.component {
            ComponentType::I8 => values.map(|x| scaled(x, 127.0) as i8 as u8).collect(),
            ComponentType::U8 => values.map(|x| scaled(x, 255.0) as u8).collect(),
            ComponentType::I16 => {
                values.flat_map(|x| (scaled(x, 32767.0) as i16).to_le_bytes()).collect()
            }
            ComponentType::U16 => {
                values.flat_map(|x| (scaled(x, 65535.0) as u16).to_le_bytes()).collect()
            }
            ComponentType::U32 => values.flat_map(|x| (x.round() as u32).to_le_bytes()).collect(),
            ComponentType::F32 => values.flat_map(f32::to_le_bytes).collect(),
        }
    }

    /// The shape of an element: component type, components, and whether integers are normalized.
    pub fn shape(&self) -> (ComponentType, usize, bool) {
        (self.component, self.components, self.normalized)
    }

    /// All components as indices.
    ///
    /// # Errors
    /// [`Error::Invalid`] if they are not unsigned integers.
    pub fn indices(&self, at: &str) -> Result<Vec<u32>> {
        let bytes = &self.bytes;
        match self.component {
            ComponentType::U8 => Ok(bytes.iter().map(|&b| u32::from(b)).collect()),
            ComponentType::U16 => {
                Ok(words(bytes).map(|b| u32::from(u16::from_le_bytes(b))).collect())
            }
            ComponentType::U32 => Ok(words(bytes).map(u32::from_le_bytes).collect()),
            _ => Err(Error::invalid(at, "indices must be unsigned integers")),
        }
    }
}

/// The little-endian words of a byte string.
fn words<const N: usize>(bytes: &[u8]) -> impl Iterator<Item = [u8; N]> + '_ {
    bytes.as_chunks::<N>().0.iter().copied()
}

/// Attributes by name.
pub(crate) type Named = (String, Elements);

#[cfg(test)]
mod tests;
