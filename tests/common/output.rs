//! Outputs as the gltf crate reads and validates them, and their geometry, decoded here and not by
//! the code under test.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use gltf::Semantic;
use gltf::accessor::DataType;
use serde_json::Value;

/// A validated document with its binary chunk.
pub(crate) struct Output {
    pub(crate) gltf: gltf::Gltf,
    /// The document as it stands in the file.
    pub(crate) json: Value,
    bin: Vec<u8>,
}

/// A triangle primitive of an output.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) material: Option<usize>,
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) normals: Vec<Vec<f32>>,
    pub(crate) uvs: Vec<Vec<f32>>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Bits of an index in the file; 0 if there is none.
    pub(crate) index_bits: usize,
}

/// A position by its bits, with −0 as 0.
pub(crate) type Point = [u32; 3];

impl Output {
    /// Reads and validates a .glb.
    pub(crate) fn read(path: &Path) -> Self {
        let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        Self::from_bytes(&bytes, &path.display().to_string())
    }

    /// Validates the bytes of a .glb.
    pub(crate) fn from_bytes(bytes: &[u8], name: &str) -> Self {
        let glb = gltf::Glb::from_slice(bytes).expect("a container");
        let json: Value = serde_json::from_slice(&glb.json).expect("a document");
        let bin = glb.bin.map(std::borrow::Cow::into_owned).unwrap_or_default();
        // The crate refuses files that require an extension it lacks; the rest it can judge.
        let mut known = json.clone();
        let required = known.get_mut("extensionsRequired").and_then(Value::as_array_mut);
        if let Some(required) = required {
            let beyond = [
                "CESIUM_RTC",
                "EXT_mesh_features",
                "EXT_of_tomorrow",
                "EXT_structural_metadata",
                "KHR_lights_punctual",
                "KHR_materials_clearcoat",
                "EXT_texture_webp",
                "KHR_mesh_quantization",
                "KHR_node_visibility",
                "KHR_texture_basisu",
                "KHR_xmp_json_ld",
            ];
            required.retain(|extension| beyond.iter().all(|name| extension != name));
        }
        let textures = known.get_mut("textures").and_then(Value::as_array_mut);
        for texture in textures.into_iter().flatten() {
            let texture = texture.as_object_mut().expect("a texture");
            let names = ["EXT_texture_webp", "KHR_texture_basisu"];
            let source = names
                .iter()
                .find_map(|name| texture.get("extensions")?.get(name)?.get("source").cloned());
            if let Some(source) = source {
                texture.insert("source".to_owned(), source);
            }
            // The crate knows no texture without one, which glTF does.
            texture.entry("source").or_insert(Value::from(0));
        }
        let known = super::build::glb(known.to_string().as_bytes(), &bin);
        let gltf = gltf::Gltf::from_slice(&known).unwrap_or_else(|e| panic!("{name}: {e:?}"));
        Self { gltf, json, bin }
    }

    /// The rows of an accessor, normalized integers as floats.
    pub(crate) fn rows(&self, accessor: &gltf::Accessor<'_>) -> Vec<Vec<f32>> {
        let bytes = self.element_bytes(accessor);
        let component = accessor.data_type().size();
        let read = |bytes| decode(bytes, accessor.data_type(), accessor.normalized());
        let rows = bytes.chunks_exact(accessor.size());
        rows.map(|row| row.chunks_exact(component).map(read).collect()).collect()
    }

    /// The bytes of an accessor's elements, sparse ones put in their places.
    pub(crate) fn element_bytes(&self, accessor: &gltf::Accessor<'_>) -> Vec<u8> {
        let size = accessor.size();
        let mut bytes = match accessor.view() {
            None => vec![0; accessor.count() * size],
            Some(view) => {
                let stride = view.stride().unwrap_or(size);
                let own = &self.bin[view.offset()..view.offset() + view.length()];
                let element = |i: usize| own[accessor.offset() + i * stride..][..size].to_vec();
                (0..accessor.count()).flat_map(element).collect()
            }
        };
        if let Some(sparse) = accessor.sparse() {
            let (indices, values) = (sparse.indices(), sparse.values());
            assert!(matches!(indices.index_type(), gltf::accessor::sparse::IndexType::U16));
            for i in 0..sparse.count() {
                let at = indices.view().offset() + indices.offset() + 2 * i;
                let index = u16::from_le_bytes([self.bin[at], self.bin[at + 1]]) as usize;
                let value = values.view().offset() + values.offset() + i * size;
                bytes[index * size..][..size].copy_from_slice(&self.bin[value..][..size]);
            }
        }
        bytes
    }

    /// The triangle primitives of a mesh.
    pub(crate) fn parts(&self, mesh: usize) -> Vec<Part> {
        let mesh = self.gltf.meshes().nth(mesh).expect("a mesh");
        mesh.primitives()
            .filter(|primitive| primitive.mode() == gltf::mesh::Mode::Triangles)
            .map(|primitive| self.part(&primitive))
            .collect()
    }

    fn part(&self, primitive: &gltf::Primitive<'_>) -> Part {
        let rows = |semantic| primitive.get(&semantic).map_or(Vec::new(), |a| self.rows(&a));
        let positions = rows(Semantic::Positions);
        let (indices, index_bits) = match primitive.indices() {
            None => ((0..positions.len() as u32).collect(), 0),
            Some(accessor) => self.indices(&accessor),
        };
        assert_eq!(indices.len() % 3, 0, "indices are not in threes");
        Part {
            material: primitive.material().index(),
            positions: positions.iter().map(|p| [p[0], p[1], p[2]]).collect(),
            normals: rows(Semantic::Normals),
            uvs: rows(Semantic::TexCoords(0)),
            triangles: indices.as_chunks().0.to_vec(),
            index_bits,
        }
    }

    /// Indices and how many bits each has in the file.
    fn indices(&self, accessor: &gltf::Accessor<'_>) -> (Vec<u32>, usize) {
        let size = accessor.data_type().size();
        let read =
            |index: &[u8]| index.iter().rev().fold(0, |sum, &byte| sum << 8 | u32::from(byte));
        (self.element_bytes(accessor).chunks_exact(size).map(read).collect(), 8 * size)
    }

    /// The triangles of all meshes of the document.
    pub(crate) fn triangle_count(&self) -> usize {
        let meshes = 0..self.gltf.meshes().len();
        meshes.flat_map(|mesh| self.parts(mesh)).map(|part| part.triangles.len()).sum()
    }

    /// The corners of the box around what the scene shows, without skins and morphs.
    pub(crate) fn scene_box(&self) -> [glam::Vec3; 2] {
        let mut corners = [glam::Vec3::INFINITY, glam::Vec3::NEG_INFINITY];
        let scene = self.gltf.default_scene().expect("a scene");
        let mut nodes: Vec<_> = scene.nodes().map(|node| (node, glam::Mat4::IDENTITY)).collect();
        while let Some((node, above)) = nodes.pop() {
            let world = above * glam::Mat4::from_cols_array_2d(&node.transform().matrix());
            nodes.extend(node.children().map(|child| (child, world)));
            let parts = node.mesh().map_or(Vec::new(), |mesh| self.parts(mesh.index()));
            for part in parts {
                for &vertex in part.triangles.iter().flatten() {
                    let local = glam::Vec3::from_array(part.positions[vertex as usize]);
                    let point = world.transform_point3(local);
                    corners = [corners[0].min(point), corners[1].max(point)];
                }
            }
        }
        corners
    }

    /// The bytes of an image.
    pub(crate) fn image_bytes(&self, index: usize) -> &[u8] {
        let image = self.gltf.images().nth(index).expect("an image");
        match image.source() {
            gltf::image::Source::View { view, .. } => {
                &self.bin[view.offset()..view.offset() + view.length()]
            }
            gltf::image::Source::Uri { uri, .. } => panic!("{uri}: not in the file"),
        }
    }

    /// An image, decoded.
    pub(crate) fn picture(&self, index: usize) -> image::DynamicImage {
        image::load_from_memory(self.image_bytes(index)).expect("a picture")
    }

    /// Every accessor that something refers to.
    pub(crate) fn used_accessors(&self) -> BTreeSet<usize> {
        let mut used = BTreeSet::new();
        for primitive in self.gltf.meshes().flat_map(|mesh| mesh.primitives()) {
            used.extend(primitive.attributes().map(|(_, accessor)| accessor.index()));
            used.extend(primitive.indices().map(|accessor| accessor.index()));
            for target in primitive.morph_targets() {
                let accessors = [target.positions(), target.normals(), target.tangents()];
                used.extend(accessors.into_iter().flatten().map(|accessor| accessor.index()));
            }
        }
        for sampler in self.gltf.animations().flat_map(|animation| animation.samplers()) {
            used.extend([sampler.input().index(), sampler.output().index()]);
        }
        let skins = self.gltf.skins();
        used.extend(skins.filter_map(|skin| skin.inverse_bind_matrices()).map(|a| a.index()));
        used
    }
}

fn decode(bytes: &[u8], kind: DataType, normalized: bool) -> f32 {
    let scaled = |value: f32, most: f32| if normalized { (value / most).max(-1.0) } else { value };
    match kind {
        DataType::U8 => scaled(f32::from(bytes[0]), 255.0),
        DataType::I8 => scaled(f32::from(bytes[0] as i8), 127.0),
        DataType::U16 => scaled(f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
        DataType::I16 => scaled(f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
        DataType::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        DataType::U32 => panic!("a vertex attribute of 32-bit integers"),
    }
}

fn point(position: [f32; 3]) -> Point {
    position.map(|x| if x == 0.0 { 0 } else { x.to_bits() })
}

/// How often each directed edge between points occurs, over all parts as one surface.
pub(crate) fn half_edges(parts: &[Part]) -> BTreeMap<(Point, Point), usize> {
    let mut edges = BTreeMap::new();
    for part in parts {
        for triangle in &part.triangles {
            let [a, b, c] = triangle.map(|vertex| point(part.positions[vertex as usize]));
            for edge in [(a, b), (b, c), (c, a)] {
                *edges.entry(edge).or_insert(0) += 1;
            }
        }
    }
    edges
}

/// The half-edges without a twin.
pub(crate) fn border(parts: &[Part]) -> Vec<[[f32; 3]; 2]> {
    let edges = half_edges(parts);
    let position = |point: Point| point.map(f32::from_bits);
    let is_border = |&(a, b): &(Point, Point)| !edges.contains_key(&(b, a));
    edges.keys().copied().filter(is_border).map(|(a, b)| [position(a), position(b)]).collect()
}

/// Six times the signed volume of a closed surface.
pub(crate) fn volume6(parts: &[Part]) -> f32 {
    let corner = |part: &Part, vertex: u32| glam::Vec3::from_array(part.positions[vertex as usize]);
    let tetrahedron = |part: &Part, t: &[u32; 3]| {
        let [a, b, c] = t.map(|vertex| corner(part, vertex));
        a.dot(b.cross(c))
    };
    parts.iter().map(|p| p.triangles.iter().map(|t| tetrahedron(p, t)).sum::<f32>()).sum()
}
