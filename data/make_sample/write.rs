//! The mesh and the images as one binary glTF 2.0 file.

use std::borrow::Cow;
use std::collections::BTreeMap;

use gltf::binary::{Glb, Header};
use serde_json::{Value, json};

use crate::atlas::Atlas;
use crate::maps::Maps;
use crate::model::Model;

/// Vertices and indices of one primitive, as the file stores them.
#[derive(Default)]
struct Primitive {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    indices: Vec<u16>,
}

/// The binary chunk and what describes it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    /// Appends a view, aligned to four bytes; gives its index.
    fn add_view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view =
            json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Appends a vertex attribute; gives its accessor's index.
    fn add_floats<const N: usize>(&mut self, rows: &[[f32; N]], bounds: bool) -> usize {
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|f| f.to_le_bytes()).collect();
        let view = self.add_view(&bytes, Some(34962));
        let mut accessor = json!({
            "bufferView": view,
            "componentType": 5126,
            "count": rows.len(),
            "type": if N == 2 { "VEC2" } else { "VEC3" },
        });
        if bounds {
            let fold = |start: f32, pick: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..N).map(|i| rows.iter().fold(start, |best, row| pick(best, row[i]))).collect()
            };
            accessor["min"] = json!(fold(f32::INFINITY, f32::min));
            accessor["max"] = json!(fold(f32::NEG_INFINITY, f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Appends indices; gives their accessor's index.
    fn add_indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.add_view(&bytes, Some(34963));
        self.accessors.push(json!({
            "bufferView": view, "componentType": 5123, "count": indices.len(), "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }
}

/// Splits the corners into vertices: one for each point, chart, UV and normal.
fn primitives(model: &Model, atlas: &Atlas) -> [Primitive; 2] {
    let mut both: [Primitive; 2] = Default::default();
    let mut known: [BTreeMap<[u32; 6], u16>; 2] = Default::default();
    let normals = model.normals();
    for ((triangle, uvs), normals) in model.triangles.iter().zip(&atlas.uvs).zip(&normals) {
        let material = usize::from(triangle.part.is_metal());
        let (primitive, known) = (&mut both[material], &mut known[material]);
        for ((corner, uv), normal) in triangle.corners.iter().zip(uvs).zip(normals) {
            let (uv, normal) = (uv.as_vec2().to_array(), normal.as_vec3().to_array());
            let [u, v] = uv.map(f32::to_bits);
            let [x, y, z] = normal.map(f32::to_bits);
            let next = primitive.positions.len() as u16;
            let vertex = *known.entry([corner.point as u32, u, v, x, y, z]).or_insert(next);
            if vertex == next {
                primitive.positions.push(model.points[corner.point].as_vec3().to_array());
                primitive.normals.push(normal);
                primitive.uvs.push(uv);
            }
            primitive.indices.push(vertex);
        }
    }
    both
}

/// The materials: both read the one atlas.
fn materials() -> Value {
    let material = |name: &str| {
        json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorTexture": { "index": 0 },
                "metallicRoughnessTexture": { "index": 2 },
            },
            "normalTexture": { "index": 1 },
            "occlusionTexture": { "index": 2 },
        })
    };
    json!([material("glazed fritware"), material("gilt mounts")])
}

/// Appends the images; gives their descriptions.
fn add_images(buffer: &mut Buffer, maps: &Maps) -> Vec<Value> {
    let mut images = vec![];
    for (name, mime, bytes) in [
        ("base color", "image/png", &maps.base_color),
        ("normal", "image/png", &maps.normal),
        ("occlusion, roughness, metallic", "image/jpeg", &maps.surface),
    ] {
        let view = buffer.add_view(bytes, None);
        images.push(json!({ "name": name, "mimeType": mime, "bufferView": view }));
    }
    images
}

/// The whole file.
///
/// # Errors
/// What the JSON and GLB writers report.
pub(crate) fn glb(model: &Model, atlas: &Atlas, maps: &Maps) -> anyhow::Result<Vec<u8>> {
    let mut buffer = Buffer::default();
    let mut meshes = vec![];
    for (material, primitive) in primitives(model, atlas).iter().enumerate() {
        meshes.push(json!({
            "attributes": {
                "POSITION": buffer.add_floats(&primitive.positions, true),
                "NORMAL": buffer.add_floats(&primitive.normals, false),
                "TEXCOORD_0": buffer.add_floats(&primitive.uvs, false),
            },
            "indices": buffer.add_indices(&primitive.indices),
            "material": material,
        }));
    }
    let images = add_images(&mut buffer, maps);
    buffer.bytes.resize(buffer.bytes.len().next_multiple_of(4), 0);
    let textures: Vec<Value> =
        (0..images.len()).map(|image| json!({ "sampler": 0, "source": image })).collect();
    let (sin, cos) = 15f64.to_radians().sin_cos();
    let document = json!({
        "asset": {
            "version": "2.0",
            "generator": "seamwise make_sample",
            "copyright": "CC0 1.0: no rights reserved",
            "extras": {
                "title": "Ewer with a ship and tulips",
                "license": "CC0-1.0",
                "source": "made by data/make_sample",
            },
        },
        "scene": 0,
        "scenes": [{ "name": "showcase", "nodes": [0] }],
        "nodes": [
            { "name": "turntable", "rotation": [0.0, sin as f32, 0.0, cos as f32], "children": [1] },
            { "name": "ewer, millimetres", "scale": [0.001, 0.001, 0.001], "mesh": 0 },
        ],
        "meshes": [{ "name": "ewer", "primitives": meshes }],
        "materials": materials(),
        "textures": textures,
        "images": images,
        "samplers": [{ "magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497 }],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{ "byteLength": buffer.bytes.len() }],
    });
    let glb = Glb {
        header: Header { magic: *b"glTF", version: 2, length: 0 },
        json: Cow::Owned(serde_json::to_vec(&document)?),
        bin: Some(Cow::Owned(buffer.bytes)),
    };
    Ok(glb.to_vec()?)
}
