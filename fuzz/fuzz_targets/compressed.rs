//! Any bytes as a stream of a codec, in a document that is well otherwise: meshoptimizer's views,
//! Draco's primitives, and images of all kinds, KTX2 among them.
//!
//! The first byte chooses the codec. For a view the mode, the filter, the stride and the count, of two
//! bytes, follow; then the stream.
//!
//! `SEAMWISE_CORPUS=fuzz/corpus cargo test --test suite seeds` makes inputs to start from; then
//! `cargo +nightly fuzz run compressed -- -max_total_time=600 -timeout=5 -rss_limit_mb=2048`

#![no_main]

mod reading;

use libfuzzer_sys::fuzz_target;
use reading::read_document;
use serde_json::{Value, json};

const MODES: [&str; 3] = ["ATTRIBUTES", "TRIANGLES", "INDICES"];
const FILTERS: [&str; 5] = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"];

fuzz_target!(|bytes: &[u8]| {
    let Some((kind, stream)) = bytes.split_first() else { return };
    match (kind % 3, stream) {
        (0, [mode, filter, stride, low, high, stream @ ..]) => {
            view(stream, [*mode, *filter, *stride], u16::from_le_bytes([*low, *high]));
        }
        (1, stream) => primitive(stream),
        (2, stream) => image(stream),
        _ => {}
    }
});

/// A mesh whose positions are a compressed view, or its indices.
fn view(stream: &[u8], [mode, filter, stride]: [u8; 3], count: u16) {
    let length = usize::from(count) * usize::from(stride);
    let mode = usize::from(mode) % MODES.len();
    let extension = json!({
        "buffer": 0, "byteLength": stream.len(), "byteStride": stride, "count": count,
        "mode": MODES[mode], "filter": FILTERS[usize::from(filter) % FILTERS.len()],
    });
    let views = json!([{"buffer": 0, "byteLength": length, "extensions": {
        "EXT_meshopt_compression": extension}}]);
    let accessor = match (mode, stride) {
        (0, _) => {
            json!({"bufferView": 0, "componentType": 5120, "count": length / 3, "type": "VEC3"})
        }
        (_, 2) => json!({"bufferView": 0, "componentType": 5123, "count": count, "type": "SCALAR"}),
        _ => json!({"bufferView": 0, "componentType": 5125, "count": count, "type": "SCALAR"}),
    };
    let zeros = json!({"componentType": 5126, "count": 3, "type": "VEC3"});
    let primitive = match mode {
        0 => json!({"attributes": {"POSITION": 0}}),
        _ => json!({"attributes": {"POSITION": 1}, "indices": 0}),
    };
    document(json!([accessor, zeros]), views, primitive, json!([]), stream);
}

/// A mesh in Draco's codec.
fn primitive(stream: &[u8]) {
    let accessor = |component: u32, shape: &str| json!({"componentType": component, "count": 3, "type": shape});
    let accessors = json!([
        accessor(5125, "SCALAR"),
        accessor(5126, "VEC3"),
        accessor(5126, "VEC3"),
        accessor(5126, "VEC2")
    ]);
    let primitive = json!({
        "attributes": {"POSITION": 1, "NORMAL": 2, "TEXCOORD_0": 3}, "indices": 0,
        "extensions": {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {
            "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}}},
    });
    document(accessors, whole(stream), primitive, json!([]), stream);
}

/// A material that wears a picture.
fn image(file: &[u8]) {
    let accessors = json!([{"componentType": 5126, "count": 3, "type": "VEC3"}]);
    let primitive = json!({"attributes": {"POSITION": 0}, "material": 0});
    document(accessors, whole(file), primitive, json!([{"bufferView": 0}]), file);
}

/// One view over all bytes.
fn whole(bytes: &[u8]) -> Value {
    json!([{"buffer": 0, "byteLength": bytes.len()}])
}

fn document(accessors: Value, views: Value, primitive: Value, images: Value, bin: &[u8]) {
    let json = json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}], "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": bin.len()}], "images": images,
        "textures": [{"source": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
    });
    read_document(&json, bin);
}
