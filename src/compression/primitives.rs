//! Primitives in Draco's codec (`KHR_draco_mesh_compression`).
//!
//! A stream holds the triangles of a primitive and attributes by number; the primitive's accessors
//! say what they are to be read as, and lack their bytes. They get them here, each in a buffer view
//! of its own, together with the number of elements and the bounds that really came out: streams
//! quantize. The first takes the place of the stream's view, so that no stream is left behind.
//!
//! The decoder is in Rust without `unsafe`, and takes limits: a stream of a kilobyte may stand for
//! millions of points in earnest, so what all streams of a file make is held against the memory
//! limit. A stream that several primitives share is decoded once.

use std::collections::{BTreeMap, BTreeSet};

use draco_core::{
    DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute, PointIndex,
};
use gltf::json::accessor::ComponentType;
use serde_json::{Map, Value, json};

use super::append::append;
use crate::document::accessor::{self, Elements};
use crate::document::asset::Asset;
use crate::document::edit::{aligned, bounds, put};
use crate::document::extensions::{remove_extension, unlist_extension};
use crate::error::{Error, Result};
use crate::limit::{Budget, MemoryLimit};

/// The extension.
const NAME: &str = "KHR_draco_mesh_compression";

/// Most bytes that the decoder takes for a point or a triangle besides their attributes.
const BYTES_PER_ELEMENT: u64 = 128;

/// The part of a stream that an accessor stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    /// An attribute by its number.
    Attribute(u32),
    Indices,
}

/// A stream and the accessors that it fills.
struct Stream {
    /// The first primitive that names it.
    at: String,
    parts: BTreeMap<usize, Part>,
}

/// Decodes all primitives that are compressed, and takes the extension from the document.
///
/// # Errors
/// [`Error::Invalid`] with the primitive.
pub(super) fn expand(asset: &mut Asset, limit: MemoryLimit) -> Result<()> {
    let mut budget = Budget::of(limit);
    for (view, stream) in streams(asset)? {
        let fault = |what: String| Error::invalid(&stream.at, what);
        let mesh = decode(asset.view(view)?.0, budget.left()).map_err(fault)?;
        let mut slot = Some(view);
        for (&accessor, &part) in &stream.parts {
            let at = format!("/accessors/{accessor}");
            let fault = |what: String| Error::invalid(&at, what);
            let empty = accessor::without_elements(asset, &at)?;
            let elements = elements(&mesh, part, empty).map_err(fault)?;
            let size = elements.bytes.len() as u64;
            budget.take("decoded primitives", size).map_err(fault)?;
            fill(asset, [accessor, view], slot.take(), &elements, part)?;
        }
    }
    unlist_extension(&mut asset.json, NAME);
    Ok(())
}

/// Every stream by its view, taken from the primitives. An accessor that several parts are to fill, as
/// writers leave it that merge equal accessors, is copied: the first keeps it.
fn streams(asset: &mut Asset) -> Result<BTreeMap<usize, Stream>> {
    let mut streams: BTreeMap<usize, Stream> = BTreeMap::new();
    let mut taken = BTreeSet::new();
    let mut own_accessors = BTreeMap::new();
    for at in compressed(&asset.json) {
        let own = format!("{at}/extensions/{NAME}");
        let view = asset
            .reference(&own, "bufferView", "bufferViews")?
            .ok_or_else(|| Error::invalid(&own, "it names no buffer view"))?;
        let parts = parts(asset, &at)?;
        let stream =
            streams.entry(view).or_insert_with(|| Stream { at: own, parts: BTreeMap::new() });
        for Filled { reference, accessor, part } in parts {
            let json = &mut asset.json;
            let own = *own_accessors.entry((view, part, accessor)).or_insert_with(|| {
                if taken.insert(accessor) {
                    return accessor;
                }
                let copy = json["accessors"][accessor].clone();
                put(json, "accessors", None, copy)
            });
            if let Some(index) = asset.json.pointer_mut(&reference) {
                *index = json!(own);
            }
            stream.parts.insert(own, part);
        }
        if let Some(primitive) = asset.json.pointer_mut(&at) {
            remove_extension(primitive, NAME);
            // A strip is compressed as the triangles that it stands for.
            primitive.as_object_mut().map(|primitive| primitive.shift_remove("mode"));
        }
    }
    Ok(streams)
}

/// The pointers of all primitives that are compressed.
fn compressed(json: &Value) -> Vec<String> {
    let list =
        |json: &Value, key: &str| json.get(key).and_then(Value::as_array).map_or(0, Vec::len);
    let meshes = 0..list(json, "meshes");
    let primitives = meshes.flat_map(|mesh| {
        let count = list(&json["meshes"][mesh], "primitives");
        (0..count).map(move |index| format!("/meshes/{mesh}/primitives/{index}"))
    });
    primitives.filter(|at| json.pointer(&format!("{at}/extensions/{NAME}")).is_some()).collect()
}

/// An accessor of a primitive that a part of its stream fills.
struct Filled {
    /// The JSON pointer of what names the accessor.
    reference: String,
    accessor: usize,
    part: Part,
}

/// The accessors of a primitive that its stream fills.
fn parts(asset: &Asset, at: &str) -> Result<Vec<Filled>> {
    let mode = asset.json.pointer(&format!("{at}/mode"));
    if mode.is_some_and(|mode| mode != 4 && mode != 5) {
        return Err(Error::invalid(format!("{at}/mode"), "Draco compresses triangles alone"));
    }
    let indices = asset
        .reference(at, "indices", "accessors")?
        .ok_or_else(|| Error::invalid(at, "a compressed primitive without indices"))?;
    let ids = format!("{at}/extensions/{NAME}/attributes");
    let ids: Map<String, Value> = asset.parse(&ids)?;
    let (reference, part) = (format!("{at}/indices"), Part::Indices);
    let mut parts = vec![Filled { reference, accessor: indices, part }];
    for (name, id) in &ids {
        let at = format!("{at}/attributes");
        let fault = |what: &str| Error::invalid(format!("{at}/{name}"), what);
        let accessor = asset.reference(&at, name, "accessors")?;
        let accessor = accessor.ok_or_else(|| fault("it is compressed, and has no accessor"))?;
        let id = id.as_u64().and_then(|id| u32::try_from(id).ok());
        let part = Part::Attribute(id.ok_or_else(|| fault("its id is no number"))?);
        let reference = format!("{at}/{name}");
        parts.push(Filled { reference, accessor, part });
    }
    Ok(parts)
}

fn decode(bytes: &[u8], limit: u64) -> std::result::Result<Mesh, String> {
    let limits = DecodeLimits::default()
        .with_max_points(limit / BYTES_PER_ELEMENT)
        .with_max_faces(limit / BYTES_PER_ELEMENT)
        .with_max_decoded_bytes(limit);
    let mut mesh = Mesh::new();
    MeshDecoder::new()
        .decode(&mut DecoderBuffer::new(bytes).with_limits(limits), &mut mesh)
        .map_err(|error| format!("its stream is damaged or too large ({error})"))?;
    Ok(mesh)
}

/// A part of a stream as its accessor, which is `empty`, asks for it.
fn elements(mesh: &Mesh, part: Part, empty: Elements) -> std::result::Result<Elements, String> {
    match part {
        Part::Indices => indices(mesh, empty),
        Part::Attribute(id) => match mesh.attribute_by_unique_id(id) {
            Some(attribute) => values(attribute, mesh.num_points(), empty),
            None => Err(format!("its stream has no attribute {id}")),
        },
    }
}

fn indices(mesh: &Mesh, mut empty: Elements) -> std::result::Result<Elements, String> {
    let indices = mesh.faces().iter().flatten().map(|point| point.0);
    let most = mesh.num_points().saturating_sub(1);
    empty.bytes = match (empty.component, empty.components) {
        (ComponentType::U8, 1) if most <= 0xff => indices.map(|index| index as u8).collect(),
        (ComponentType::U16, 1) if most <= 0xffff => {
            indices.flat_map(|index| (index as u16).to_le_bytes()).collect()
        }
        (ComponentType::U32, 1) => indices.flat_map(u32::to_le_bytes).collect(),
        _ => return Err(format!("it has no room for indices up to {most}")),
    };
    Ok(empty)
}

/// An attribute's values, one per point: as they are stored if that is what the accessor says, else
/// as the nearest numbers of its type.
fn values(
    attribute: &PointAttribute,
    points: usize,
    mut elements: Elements,
) -> std::result::Result<Elements, String> {
    if usize::from(attribute.num_components()) != elements.components {
        let [own, asked] = [attribute.num_components().into(), elements.components];
        return Err(format!("its stream has {own} components for it, not {asked}"));
    }
    if !is_stored_as(attribute.data_type(), elements.component) {
        let numbers = attribute.read_f32s(points, elements.components);
        let raw = Elements { normalized: false, ..elements.clone() };
        elements.bytes = raw.encode(numbers);
        return Ok(elements);
    }
    let (size, stored) = (elements.size(), attribute.buffer().data());
    for point in 0..points {
        let value = attribute.mapped_index(PointIndex(point as u32)).0 as usize;
        let bytes = value.checked_mul(size).and_then(|start| stored.get(start..)?.get(..size));
        elements.bytes.extend_from_slice(bytes.ok_or("its stream lacks some of its values")?);
    }
    Ok(elements)
}

fn is_stored_as(stored: DataType, component: ComponentType) -> bool {
    matches!(
        (stored, component),
        (DataType::Int8, ComponentType::I8)
            | (DataType::Uint8, ComponentType::U8)
            | (DataType::Int16, ComponentType::I16)
            | (DataType::Uint16, ComponentType::U16)
            | (DataType::Uint32, ComponentType::U32)
            | (DataType::Float32, ComponentType::F32)
    )
}

/// Gives an accessor its elements, in the buffer of the stream's view; the view in `slot`, or a new
/// one, becomes theirs.
fn fill(
    asset: &mut Asset,
    [accessor, stream]: [usize; 2],
    slot: Option<usize>,
    elements: &Elements,
    part: Part,
) -> Result<()> {
    let is_vertices = part != Part::Indices;
    let (bytes, stride) =
        if is_vertices { aligned(elements) } else { ((&elements.bytes).into(), None) };
    let own = format!("/bufferViews/{stream}");
    let (buffer, start) = append(asset, &own, &bytes)?;
    let mut view = json!({"buffer": buffer, "byteOffset": start, "byteLength": bytes.len()});
    view["target"] = json!(if is_vertices { 34962 } else { 34963 });
    if let Some(stride) = stride {
        view["byteStride"] = json!(stride);
    }
    let views = asset.json["bufferViews"].as_array_mut();
    let views = views.ok_or_else(|| Error::invalid("/bufferViews", "not a list"))?;
    let slot = slot.unwrap_or(views.len());
    if slot == views.len() {
        views.push(view);
    } else {
        views[slot] = view;
    }
    let json = &mut asset.json["accessors"][accessor];
    json["bufferView"] = json!(slot);
    json["count"] = json!(elements.count());
    if let Some(json) = json.as_object_mut() {
        json.shift_remove("byteOffset");
        if json.contains_key("min") || json.contains_key("max") {
            let (low, high) = bounds(elements);
            json.insert("min".to_owned(), json!(low));
            json.insert("max".to_owned(), json!(high));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const STREAM: &[u8] = include_bytes!("../../tests/encoded/patch.drc");

    /// A primitive of 9 × 9 vertices that decodes from `stream`.
    fn asset(stream: &[u8]) -> Asset {
        let accessor = |component: u32, shape: &str| json!({"componentType": component, "count": 81, "type": shape});
        let mut indices = accessor(5123, "SCALAR");
        indices["count"] = json!(384);
        let mut positions = accessor(5126, "VEC3");
        positions["min"] = json!([-1, -1, -1]);
        positions["max"] = json!([1, 1, 1]);
        let ids = json!({"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "JOINTS_0": 3});
        let extension = json!({"bufferView": 0, "attributes": ids});
        let attributes = json!({"POSITION": 1, "NORMAL": 2, "TEXCOORD_0": 3, "JOINTS_0": 4});
        let primitive = json!({
            "attributes": attributes, "indices": 0, "mode": 4, "extensions": {NAME: extension},
        });
        Asset {
            json: json!({
                "extensionsUsed": [NAME], "extensionsRequired": [NAME],
                "accessors": [
                    indices, positions, accessor(5126, "VEC3"), accessor(5126, "VEC2"),
                    accessor(5123, "VEC4"),
                ],
                "bufferViews": [{"buffer": 0, "byteLength": stream.len()}],
                "buffers": [{"byteLength": stream.len()}],
                "meshes": [{"primitives": [primitive.clone(), primitive]}],
            }),
            buffers: vec![stream.to_vec().into()],
            ..Asset::default()
        }
    }

    fn error(asset: &mut Asset) -> String {
        expand(asset, MemoryLimit::default()).unwrap_err().to_string()
    }

    #[test]
    fn a_stream_of_the_reference_encoder_fills_its_accessors() {
        let mut asset = asset(STREAM);
        expand(&mut asset, MemoryLimit::default()).unwrap();
        assert_eq!(asset.json.get("extensionsRequired"), None);
        assert_eq!(asset.json["meshes"][0]["primitives"][1].get("extensions"), None);
        assert_eq!(asset.json["bufferViews"].as_array().unwrap().len(), 5, "shared, decoded once");
        let read = |index| accessor::read(&asset, index, "").unwrap();
        let indices = read(0).indices("").unwrap();
        assert!(indices.len() == 384 && indices.iter().all(|&index| index < 81));
        let [positions, normals, uvs, joints] = [1, 2, 3, 4].map(|index| read(index).floats());
        for vertex in 0..81 {
            let (uv, p) = (&uvs[2 * vertex..][..2], &positions[3 * vertex..][..3]);
            let height = 0.25 * (3.0 * uv[0]).sin() * (2.0 * uv[1]).cos();
            for (own, true_value) in p.iter().zip([2.0 * uv[0] - 1.0, 2.0 * uv[1] - 1.0, height]) {
                assert!((own - true_value).abs() < 1e-3, "{p:?} at {uv:?}");
            }
            assert!((normals[3 * vertex + 2] - 1.0).abs() < 1e-3);
            let place = [0, 1].map(|k| (uv[k] * 8.0).round() % 4.0);
            assert_eq!(joints[4 * vertex..][..4], [place[0], place[1], 0.0, 0.0]);
        }
        let least = positions.iter().copied().fold(f32::INFINITY, f32::min);
        assert_eq!(asset.json["accessors"][1]["min"][0].as_f64().unwrap() as f32, least);
    }

    #[test]
    fn parts_that_share_an_accessor_each_get_their_own_values() {
        // Two UV sets of one primitive on one accessor, and normals where another has positions.
        let mut asset = asset(STREAM);
        let primitives = &mut asset.json["meshes"][0]["primitives"];
        primitives[0]["attributes"]["TEXCOORD_1"] = json!(3);
        primitives[0]["extensions"][NAME]["attributes"]["TEXCOORD_1"] = json!(2);
        primitives[1]["attributes"]["NORMAL"] = json!(1);
        expand(&mut asset, MemoryLimit::default()).unwrap();
        let read = |primitive: usize, name: &str| {
            let at = format!("/meshes/0/primitives/{primitive}/attributes");
            let index = asset.reference(&at, name, "accessors").unwrap().unwrap();
            accessor::read(&asset, index, "").unwrap().floats()
        };
        assert_eq!(read(0, "TEXCOORD_1"), read(0, "TEXCOORD_0"));
        assert_eq!(read(1, "NORMAL"), read(0, "NORMAL"));
        assert_eq!(read(1, "POSITION"), read(0, "POSITION"));
        assert_ne!(read(1, "POSITION"), read(1, "NORMAL"));
    }

    #[test]
    fn a_damaged_stream_is_an_error_or_another_mesh_but_no_panic() {
        for length in 0..STREAM.len() {
            let error = error(&mut asset(&STREAM[..length]));
            assert!(error.starts_with("/meshes/0/primitives/0/extensions/KHR"), "{error}");
        }
        for at in 0..STREAM.len() {
            for bits in [0x01, 0x80, 0xff] {
                let mut bent = STREAM.to_vec();
                bent[at] ^= bits;
                let _ = expand(&mut asset(&bent), MemoryLimit::of_bytes(1 << 26));
            }
        }
    }

    #[test]
    fn what_does_not_fit_its_stream_is_an_error_with_its_place() {
        let own = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
        for (pointer, value, place) in [
            ("/meshes/0/primitives/0/mode".to_owned(), json!(1), "/meshes/0/primitives/0/mode"),
            (format!("{own}/bufferView"), json!(7), own),
            (format!("{own}/attributes"), json!(7), own),
            (format!("{own}/attributes/NORMAL"), json!(-1), "/meshes/0/primitives/0/attributes"),
            (format!("{own}/attributes/NORMAL"), json!(9), "/accessors/2"),
            ("/accessors/2/type".to_owned(), json!("VEC2"), "/accessors/2"),
            ("/accessors/0/componentType".to_owned(), json!(5126), "/accessors/0"),
        ] {
            let mut asset = asset(STREAM);
            *asset.json.pointer_mut(&pointer).unwrap() = value;
            let error = error(&mut asset);
            assert!(error.starts_with(place), "{pointer}: {error}");
        }
        for bytes in [100, 3000] {
            let large = expand(&mut asset(STREAM), MemoryLimit::of_bytes(bytes));
            assert!(large.unwrap_err().to_string().contains("large"));
        }
    }
}
