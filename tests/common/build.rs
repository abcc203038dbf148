//! glTF documents put together by hand, and written as .glb or .gltf.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use image::RgbaImage;
use serde_json::{Value, json};

use super::shapes::Shape;

/// A document and its one buffer.
#[derive(Clone, Debug)]
pub(crate) struct Build {
    pub(crate) json: Value,
    pub(crate) bin: Vec<u8>,
}

/// glTF's number for a 32-bit float.
pub(crate) const FLOAT: u32 = 5126;

impl Build {
    pub(crate) fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0", "generator": "seamwise tests"},
            "scene": 0,
            "scenes": [{"nodes": []}],
        });
        Self { json, bin: Vec::new() }
    }

    /// A document of one node with one mesh.
    pub(crate) fn of(shape: &Shape) -> Self {
        let mut build = Self::new();
        let primitive = build.primitive(shape);
        build.mesh(vec![primitive]);
        build
    }

    /// Appends an object to a list of the document and tells its index.
    pub(crate) fn add(&mut self, list: &str, object: Value) -> usize {
        let list = &mut self.json[list];
        if list.is_null() {
            *list = json!([]);
        }
        let list = list.as_array_mut().expect("a list");
        list.push(object);
        list.len() - 1
    }

    /// Appends bytes, on a multiple of four, as a buffer view.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        self.bin.extend_from_slice(bytes);
        self.add("bufferViews", view)
    }

    /// An accessor of float vectors, with their bounds.
    pub(crate) fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let bound = |pick: fn(f32, f32) -> f32| -> Vec<f32> {
            (0..N)
                .map(|k| values.iter().map(|value| value[k]).reduce(pick).unwrap_or(0.0))
                .collect()
        };
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        self.add(
            "accessors",
            json!({
                "bufferView": view, "componentType": FLOAT, "count": values.len(), "type": kind,
                "min": bound(f32::min), "max": bound(f32::max),
            }),
        )
    }

    /// An accessor of 4×4 matrices.
    pub(crate) fn matrices(&mut self, values: &[[f32; 16]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let count = values.len();
        let accessor =
            json!({"bufferView": view, "componentType": FLOAT, "count": count, "type": "MAT4"});
        self.add("accessors", accessor)
    }

    /// An accessor of 32-bit indices.
    pub(crate) fn indices(&mut self, values: impl IntoIterator<Item = u32>) -> usize {
        let bytes: Vec<u8> = values.into_iter().flat_map(u32::to_le_bytes).collect();
        let view = self.view(&bytes);
        let count = bytes.len() / 4;
        let accessor =
            json!({"bufferView": view, "componentType": 5125, "count": count, "type": "SCALAR"});
        self.add("accessors", accessor)
    }

    /// An accessor of integers already in bytes.
    pub(crate) fn raw(&mut self, bytes: &[u8], count: usize, component: u32, shape: &str) -> usize {
        let view = self.view(bytes);
        let accessor = json!({
            "bufferView": view, "componentType": component, "count": count, "type": shape,
        });
        self.add("accessors", accessor)
    }

    /// A triangle primitive with positions, normals, UVs and indices.
    pub(crate) fn primitive(&mut self, shape: &Shape) -> Value {
        let attributes = self.attributes(shape);
        let indices = self.indices(shape.triangles.iter().flatten().copied());
        json!({"attributes": attributes, "indices": indices})
    }

    /// The attributes of a shape.
    pub(crate) fn attributes(&mut self, shape: &Shape) -> Value {
        json!({
            "POSITION": self.floats(&shape.positions),
            "NORMAL": self.floats(&shape.normals),
            "TEXCOORD_0": self.floats(&shape.uvs),
        })
    }

    /// A mesh, and a node at the scene's root that holds it; tells the node.
    pub(crate) fn mesh(&mut self, primitives: Vec<Value>) -> usize {
        let mesh = self.add("meshes", json!({"name": "mesh"}));
        self.json["meshes"][mesh]["primitives"] = Value::Array(primitives);
        let node = self.add("nodes", json!({"name": "node", "mesh": mesh}));
        self.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(node));
        node
    }

    /// A rough material with an embedded PNG as its base color, read without wrapping.
    pub(crate) fn textured(&mut self, picture: &RgbaImage) -> usize {
        let view = self.view(&png(picture));
        let source = self.add("images", json!({"bufferView": view, "mimeType": "image/png"}));
        let sampler = self.add("samplers", json!({"wrapS": 33071, "wrapT": 33071}));
        let texture = self.add("textures", json!({"source": source, "sampler": sampler}));
        self.add(
            "materials",
            json!({"name": "textured", "pbrMetallicRoughness": {
                "baseColorTexture": {"index": texture}, "metallicFactor": 0.0,
                "roughnessFactor": 0.7,
            }}),
        )
    }

    /// The document with its buffer named, which is to be `uri` or the binary chunk.
    fn document(&self, uri: Option<&str>) -> Value {
        let mut json = self.json.clone();
        if !self.bin.is_empty() && json.get("buffers").is_none() {
            json["buffers"] = json!([{"byteLength": self.bin.len()}]);
            if let Some(uri) = uri {
                json["buffers"][0]["uri"] = json!(uri);
            }
        }
        json
    }

    /// As a .glb.
    pub(crate) fn glb(&self) -> Vec<u8> {
        glb(self.document(None).to_string().as_bytes(), &self.bin)
    }

    /// As a .gltf with its buffer beside it, in `folder`.
    pub(crate) fn write_gltf(&self, folder: &Path, stem: &str) -> PathBuf {
        let name = format!("{stem}.bin");
        std::fs::write(folder.join(&name), &self.bin).expect("a file is written");
        let path = folder.join(format!("{stem}.gltf"));
        std::fs::write(&path, self.document(Some(&name)).to_string()).expect("a file is written");
        path
    }
}

/// A GLB container, whatever the JSON chunk holds.
pub(crate) fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let chunk = |kind: &[u8; 4], data: &[u8], padding: u8| {
        let length = data.len().next_multiple_of(4);
        let mut chunk = (length as u32).to_le_bytes().to_vec();
        chunk.extend(kind);
        chunk.extend(data);
        chunk.resize(8 + length, padding);
        chunk
    };
    let mut body = chunk(b"JSON", json, b' ');
    if !bin.is_empty() {
        body.extend(chunk(b"BIN\0", bin, 0));
    }
    let length = (12 + body.len() as u32).to_le_bytes();
    [b"glTF".as_slice(), &2u32.to_le_bytes(), &length, &body].concat()
}

/// A picture as a PNG: RGB where it is opaque, else RGBA.
pub(crate) fn png(picture: &RgbaImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let picture = image::DynamicImage::ImageRgba8(picture.clone());
    let is_opaque = picture.as_rgba8().is_some_and(|p| p.pixels().all(|pixel| pixel[3] == 255));
    let picture = if is_opaque { picture.to_rgb8().into() } else { picture };
    picture.write_to(&mut bytes, image::ImageFormat::Png).expect("a PNG is encoded");
    bytes.into_inner()
}
