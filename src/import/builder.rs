//! A glTF document put together from plain lists.

use glam::{DVec3, Vec3};
use serde_json::{Value, json};

use super::finite::recompute_normals;
use super::offset::{Fit, fit};
use super::part::{Part, Vertices};
use crate::document::asset::Asset;
use crate::image_file::encoded::EncodedImage;
use crate::warning::Warnings;

/// glTF's number for a 32-bit float.
const FLOAT: u32 = 5126;
/// glTF's number for a 32-bit unsigned integer.
const UNSIGNED_INT: u32 = 5125;

/// A document that grows.
#[derive(Debug)]
pub(super) struct Document {
    json: Value,
    bytes: Vec<u8>,
    images: Vec<EncodedImage>,
    meshes: Vec<(String, Vec<Part>)>,
    pub(super) warnings: Warnings,
    /// The material of what has none.
    plain: Option<usize>,
}

impl Document {
    pub(super) fn new() -> Self {
        let json = json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]});
        Self {
            json,
            bytes: Vec::new(),
            images: Vec::new(),
            meshes: Vec::new(),
            warnings: Warnings::default(),
            plain: None,
        }
    }

    /// Appends an object to a list and tells its index.
    pub(super) fn add(&mut self, list: &str, object: Value) -> usize {
        match &mut self.json[list] {
            Value::Array(objects) => {
                objects.push(object);
                objects.len() - 1
            }
            empty => {
                *empty = json!([object]);
                0
            }
        }
    }

    /// Adds an image and tells its index.
    pub(super) fn add_image(&mut self, name: &str, image: EncodedImage) -> usize {
        self.images.push(image);
        self.add("images", json!({"uri": name}))
    }

    /// Says that an extension is used, and required where a reader without it would fail.
    pub(super) fn use_extension(&mut self, name: &str, required: bool) {
        let lists = ["extensionsUsed", "extensionsRequired"];
        for list in &lists[..1 + usize::from(required)] {
            if !self.json[*list].as_array().is_some_and(|names| names.contains(&json!(name))) {
                self.add(list, json!(name));
            }
        }
    }

    /// Adds a mesh, which a node is to show.
    pub(super) fn add_mesh(&mut self, name: &str, parts: Vec<Part>) {
        self.meshes.push((name.to_owned(), parts));
    }

    pub(super) fn into_asset(mut self) -> Asset {
        let mut meshes = std::mem::take(&mut self.meshes);
        meshes.iter_mut().flat_map(|(_, parts)| parts).for_each(Part::drop_unplaced);
        let fit = fit(&meshes.iter().flat_map(|(_, parts)| parts).collect::<Vec<_>>());
        let offset = self.offset(fit);
        for (name, parts) in meshes {
            self.write_mesh(&name, parts, offset);
        }
        self.add("buffers", json!({"byteLength": self.bytes.len()}));
        Asset {
            json: self.json,
            buffers: vec![self.bytes.into()],
            images: self.images,
            warnings: self.warnings,
        }
    }

    /// The offset that is taken off all positions, if any. Warns of it, and of positions that are rounded.
    fn offset(&mut self, fit: Fit) -> Option<DVec3> {
        let at = "all positions";
        match fit {
            Fit::Whole => None,
            Fit::Offset(offset) => {
                let DVec3 { x, y, z } = offset;
                let what = format!(
                    "they are too far from 0 for floats: {x} {y} {z} is in the translation of their \
                     nodes and in `extras.offset`; write local coordinates to have none"
                );
                self.warnings.add(at, what);
                Some(offset)
            }
            Fit::Rounded => {
                let what = "they are too large and too fine for floats, and are rounded by more \
                            than a hundredth of the median edge; cut the model into parts";
                self.warnings.add(at, what);
                None
            }
        }
    }

    /// A mesh and the node that shows it, moved by what is taken off its positions.
    fn write_mesh(&mut self, name: &str, parts: Vec<Part>, offset: Option<DVec3>) {
        let origin = offset.unwrap_or_default();
        let primitives: Vec<Value> =
            parts.into_iter().map(|part| self.primitive(part, origin)).collect();
        let mesh = self.add("meshes", json!({"name": name, "primitives": primitives}));
        let mut node = json!({"name": name, "mesh": mesh});
        if let Some(offset) = offset.map(|offset| offset.to_array()) {
            node["translation"] = json!(offset);
            node["extras"] = json!({"offset": offset});
        }
        let node = self.add("nodes", node);
        if let Some(roots) = self.json["scenes"][0]["nodes"].as_array_mut() {
            roots.push(json!(node));
        }
    }

    fn primitive(&mut self, part: Part, origin: DVec3) -> Value {
        let Vertices { positions, mut normals, uvs, colors } = part.vertices;
        recompute_normals(&positions, &part.triangles, &mut normals);
        let local = |position| (DVec3::from_array(position) - origin).as_vec3().to_array();
        let positions: Vec<[f32; 3]> = positions.into_iter().map(local).collect();
        let mut attributes = json!({"POSITION": self.accessor(&positions, "VEC3")});
        let bound = |pick: fn(Vec3, Vec3) -> Vec3| {
            let vectors = positions.iter().map(|&position| Vec3::from_array(position));
            vectors.reduce(pick).unwrap_or_default().to_array()
        };
        let last = self.json["accessors"].as_array_mut().and_then(|list| list.last_mut());
        if let Some(accessor) = last {
            accessor["min"] = json!(bound(Vec3::min));
            accessor["max"] = json!(bound(Vec3::max));
        }
        if !normals.is_empty() {
            attributes["NORMAL"] = json!(self.accessor(&normals, "VEC3"));
        }
        if !uvs.is_empty() {
            attributes["TEXCOORD_0"] = json!(self.accessor(&uvs, "VEC2"));
        }
        if colors.iter().any(|color| color[3] != 1.0) {
            attributes["COLOR_0"] = json!(self.accessor(&colors, "VEC4"));
        } else if !colors.is_empty() {
            let colors: Vec<[f32; 3]> = colors.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
            attributes["COLOR_0"] = json!(self.accessor(&colors, "VEC3"));
        }
        let material = part.material.unwrap_or_else(|| self.plain());
        let bytes = part.triangles.iter().flat_map(|index| index.to_le_bytes());
        let indices = self.stored(bytes, part.triangles.len(), UNSIGNED_INT, "SCALAR");
        json!({"attributes": attributes, "indices": indices, "material": material})
    }

    /// The material of what has none: glTF's own default is a metal.
    fn plain(&mut self) -> usize {
        let matte = || json!({"name": "plain", "pbrMetallicRoughness": {"metallicFactor": 0.0}});
        match self.plain {
            Some(material) => material,
            None => {
                let material = self.add("materials", matte());
                *self.plain.insert(material)
            }
        }
    }

    fn accessor<const N: usize>(&mut self, values: &[[f32; N]], shape: &str) -> usize {
        let bytes = values.iter().flatten().flat_map(|x| x.to_le_bytes());
        self.stored(bytes, values.len(), FLOAT, shape)
    }

    /// An accessor over bytes that are appended to the buffer, which stays a multiple of four.
    fn stored(
        &mut self,
        bytes: impl Iterator<Item = u8>,
        count: usize,
        component: u32,
        shape: &str,
    ) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        let view = json!({"buffer": 0, "byteOffset": start, "byteLength": length});
        let view = self.add("bufferViews", view);
        let accessor =
            json!({"bufferView": view, "componentType": component, "count": count, "type": shape});
        self.add("accessors", accessor)
    }
}
