//! Buffer views compressed by meshoptimizer's codecs, as `EXT_meshopt_compression` describes them.
//!
//! Nothing is lost: vertices and all other elements come back to the bit, triangles turned at most.
//! The vertex codec is that of version 0, the only one of the extension's. A view is compressed if
//! accessors tell what it is: one kind of element, or the indices of one kind of primitive; what it is
//! not, an image or a sparse accessor's values, stays as it is. There is no copy for readers without
//! the extension, so it is required: the views name a buffer that has no bytes.

use std::sync::Arc;

use meshopt::{encode_index_buffer, encode_index_sequence, encode_vertex_buffer_level};
use serde_json::{Value, json};

use super::stride::by_stride;
use crate::document::asset::Asset;
use crate::document::extensions::require_extension;
use crate::document::references::property_views;
use crate::error::{Error, Result};

/// The extension.
const NAME: &str = "EXT_meshopt_compression";

/// The codec's effort, of 0 to 3: what meshoptimizer itself takes if it is told nothing.
const EFFORT: i32 = 2;

/// The version of the vertex codec that the extension knows.
const VERSION: i32 = 0;

/// The content of a buffer view, as far as its accessors agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    /// No accessor refers to it.
    Unknown,
    /// Elements of so many bytes.
    Elements(usize),
    /// Indices of triangles, of so many bytes each.
    Triangles(usize),
    /// Indices of anything else.
    Indices(usize),
    /// Several of these, or something that has no codec.
    Mixed,
}

impl Use {
    fn and(self, other: Self) -> Self {
        match self {
            Self::Unknown => other,
            own if own == other => own,
            _ => Self::Mixed,
        }
    }

    fn mode(self) -> &'static str {
        match self {
            Self::Triangles(_) => "TRIANGLES",
            Self::Indices(_) => "INDICES",
            _ => "ATTRIBUTES",
        }
    }
}

/// Compresses what can be of an asset whose bytes lie in one buffer.
///
/// # Errors
/// [`Error::Invalid`] if a view runs past the buffer.
pub(crate) fn squeeze(asset: &Asset) -> Result<Asset> {
    let (uses, properties) = (uses(asset), property_views(&asset.json));
    let mut json = asset.json.clone();
    let (mut bytes, mut decoded) = (Vec::new(), 0usize);
    for (index, own) in uses.into_iter().enumerate() {
        let plain = asset.view(index)?.0;
        let stream = encode(plain, own)?.filter(|(stream, _)| stream.len() < plain.len());
        let alignment = if properties.contains(&index) { 8 } else { 4 };
        bytes.resize(usize::next_multiple_of(bytes.len(), alignment), 0);
        let start = bytes.len();
        let view = &mut json["bufferViews"][index];
        let Some((stream, stride)) = stream else {
            view["byteOffset"] = json!(start);
            bytes.extend_from_slice(plain);
            continue;
        };
        decoded = decoded.next_multiple_of(4);
        view["buffer"] = json!(1);
        view["byteOffset"] = json!(decoded);
        view["extensions"][NAME] = json!({
            "buffer": 0, "byteOffset": start, "byteLength": stream.len(), "byteStride": stride,
            "count": plain.len() / stride, "mode": own.mode(),
        });
        decoded += plain.len();
        bytes.extend(stream);
    }
    if decoded == 0 {
        return Ok(asset.clone());
    }
    let fallback = json!({"byteLength": decoded, "extensions": {NAME: {"fallback": true}}});
    json["buffers"] = json!([{"byteLength": bytes.len()}, fallback]);
    require_extension(&mut json, NAME);
    let images = asset.images.clone();
    Ok(Asset { json, buffers: vec![bytes.into(), Arc::default()], images, ..Asset::default() })
}

/// One per view: what its accessors hold.
fn uses(asset: &Asset) -> Vec<Use> {
    let mut uses = vec![Use::Unknown; asset.count("bufferViews")];
    let mut add = |view: &Value, own: Use| {
        if let Some(known) = view.as_u64().and_then(|view| uses.get_mut(view as usize)) {
            *known = known.and(own);
        }
    };
    let indices = index_accessors(&asset.json);
    for (number, accessor) in list(&asset.json, "accessors").enumerate() {
        let view = &accessor["bufferView"];
        let stride =
            || asset.json["bufferViews"][view.as_u64()? as usize].get("byteStride")?.as_u64();
        let size = size(accessor);
        let is_start = accessor.get("byteOffset").is_none_or(|offset| offset == 0);
        let own =
            match indices.iter().find(|(index, _)| *index == number) {
                Some((_, is_triangles)) if is_start && (size == 2 || size == 4) => {
                    if *is_triangles { Use::Triangles(size) } else { Use::Indices(size) }
                }
                Some(_) => Use::Mixed,
                None => Use::Elements(stride().map_or(size, |stride| stride as usize)),
            };
        add(view, own);
        for part in ["indices", "values"] {
            add(
                accessor.pointer(&format!("/sparse/{part}/bufferView")).unwrap_or(&Value::Null),
                Use::Mixed,
            );
        }
    }
    for image in list(&asset.json, "images") {
        add(&image["bufferView"], Use::Mixed);
    }
    uses
}

/// The accessors of indices, and whether they are those of triangle lists alone.
fn index_accessors(json: &Value) -> Vec<(usize, bool)> {
    let mut found: Vec<(usize, bool)> = Vec::new();
    for primitive in list(json, "meshes").flat_map(|mesh| list(mesh, "primitives")) {
        let Some(index) = primitive.get("indices").and_then(Value::as_u64) else { continue };
        let is_triangles = primitive.get("mode").is_none_or(|mode| mode == 4);
        match found.iter_mut().find(|(own, _)| *own == index as usize) {
            Some((_, known)) => *known &= is_triangles,
            None => found.push((index as usize, is_triangles)),
        }
    }
    found
}

fn list<'a>(json: &'a Value, key: &str) -> impl Iterator<Item = &'a Value> + use<'a> {
    json.get(key).and_then(Value::as_array).into_iter().flatten()
}

/// Bytes of an element; columns of small matrices are padded, and not told apart here.
fn size(accessor: &Value) -> usize {
    let component = match accessor["componentType"].as_u64() {
        Some(5120 | 5121) => 1,
        Some(5122 | 5123) => 2,
        _ => 4,
    };
    let components = match accessor["type"].as_str() {
        Some("VEC2") => 2,
        Some("VEC3") => 3,
        Some("VEC4") => 4,
        Some("MAT4") => 16,
        Some("SCALAR") => 1,
        _ => 0,
    };
    component * components
}

/// The stream of a view, and the bytes of one of its elements. None if there is no codec for it.
fn encode(plain: &[u8], own: Use) -> Result<Option<(Vec<u8>, usize)>> {
    let (Use::Elements(stride) | Use::Triangles(stride) | Use::Indices(stride)) = own else {
        return Ok(None);
    };
    if stride == 0 || plain.is_empty() || !plain.len().is_multiple_of(stride) {
        return Ok(None);
    }
    let indices = || -> Vec<u32> {
        let word = |bytes: &[u8]| bytes.iter().rev().fold(0, |sum, &b| sum << 8 | u32::from(b));
        plain.chunks_exact(stride).map(word).collect()
    };
    let stream = match own {
        Use::Triangles(_) if (plain.len() / stride).is_multiple_of(3) => {
            let indices = indices();
            encode_index_buffer(&indices, count(&indices))
        }
        Use::Triangles(_) => return Ok(None),
        Use::Indices(_) => {
            let indices = indices();
            encode_index_sequence(&indices, count(&indices))
        }
        _ => match by_stride!(stride, encode_rows, plain) {
            Some(stream) => stream,
            None => return Ok(None),
        },
    };
    let stream = stream.map_err(Error::internal)?;
    Ok(Some((stream, stride)))
}

fn count(indices: &[u32]) -> usize {
    indices.iter().max().map_or(0, |&most| most as usize + 1)
}

fn encode_rows<const N: usize>(plain: &[u8]) -> meshopt::Result<Vec<u8>> {
    encode_vertex_buffer_level(plain.as_chunks::<N>().0, EFFORT, Some(VERSION))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compression::expand;
    use crate::document::accessor;
    use crate::limit::MemoryLimit;

    /// Rows of 12 bytes, the corners of a strip of triangles, a line's indices and a picture.
    fn asset() -> Asset {
        let rows: Vec<u8> =
            (0..200u16).flat_map(|i| [i as u8, 1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0]).collect();
        let triangles = (0..198u16).flat_map(|i| [i, i + 1, i + 2]).flat_map(u16::to_le_bytes);
        let line: Vec<u8> = (0..200u32).flat_map(u32::to_le_bytes).collect();
        let parts = [rows, triangles.collect(), line, vec![7; 100]];
        let mut views = Vec::new();
        let mut bytes = Vec::new();
        for part in &parts {
            views.push(json!({"buffer": 0, "byteOffset": bytes.len(), "byteLength": part.len()}));
            bytes.extend_from_slice(part);
        }
        Asset {
            json: json!({
                "accessors": [
                    {"bufferView": 0, "componentType": 5126, "count": 200, "type": "VEC3"},
                    {"bufferView": 1, "componentType": 5123, "count": 594, "type": "SCALAR"},
                    {"bufferView": 2, "componentType": 5125, "count": 200, "type": "SCALAR"},
                ],
                "meshes": [{"primitives": [
                    {"attributes": {"POSITION": 0}, "indices": 1},
                    {"attributes": {"POSITION": 0}, "indices": 2, "mode": 3},
                ]}],
                "images": [{"bufferView": 3}],
                "bufferViews": views,
                "buffers": [{"byteLength": bytes.len()}],
            }),
            buffers: vec![bytes.into()],
            ..Asset::default()
        }
    }

    #[test]
    fn what_is_squeezed_is_smaller_and_comes_back() {
        let plain = asset();
        let mut back = squeeze(&plain).unwrap();
        assert!(back.buffers[0].len() < plain.buffers[0].len() / 4, "{}", back.buffers[0].len());
        assert_eq!(back.json["extensionsRequired"], json!([NAME]));
        let modes = [0, 1, 2].map(|view| {
            back.json["bufferViews"][view]["extensions"][NAME]["mode"].as_str().unwrap().to_owned()
        });
        assert_eq!(modes, ["ATTRIBUTES", "TRIANGLES", "INDICES"]);
        assert!(back.json["bufferViews"][3].get("extensions").is_none(), "a picture stays");
        let version =
            back.json["bufferViews"][0]["extensions"][NAME]["byteOffset"].as_u64().unwrap();
        assert_eq!(back.buffers[0][version as usize], 0xa0, "version 0 of the vertex codec");
        expand(&mut back, MemoryLimit::default()).unwrap();
        for index in [0, 2] {
            let read = |asset| accessor::read(asset, index, "").unwrap();
            assert_eq!(read(&back), read(&plain));
        }
        assert_eq!(back.view(3).unwrap().0, plain.view(3).unwrap().0);
        let [own, other] = [&plain, &back].map(|asset| {
            accessor::read(asset, 1, "").unwrap().indices("").unwrap().as_chunks::<3>().0.to_vec()
        });
        for (a, mut b) in own.into_iter().zip(other) {
            let turn = b.iter().position(|index| *index == a[0]);
            b.rotate_left(turn.unwrap());
            assert_eq!(a, b, "turned at most");
        }
    }

    #[test]
    fn views_of_several_kinds_stay_as_they_are() {
        let mut mixed = asset();
        mixed.json["meshes"][0]["primitives"][1]["indices"] = json!(1);
        mixed.json["accessors"][2] =
            json!({"bufferView": 0, "componentType": 5126, "count": 1, "type": "VEC2"});
        let squeezed = squeeze(&mixed).unwrap();
        assert!(squeezed.json["bufferViews"][0].get("extensions").is_none());
        assert_eq!(squeezed.json["bufferViews"][1]["extensions"][NAME]["mode"], "INDICES");
    }
}
