//! A model as a .glb with what is seen of it and nothing else.

use std::collections::BTreeMap;

use gltf::json::accessor::ComponentType;
use serde_json::{Map, Value, json};

use super::distances::SourceDistances;
use crate::document::accessor::{self, Elements};
use crate::document::asset::Asset;
use crate::document::edit::Packer;
use crate::document::primitive::Primitive;
use crate::error::Result;
use crate::export::glb::to_glb;
use crate::export::progressive::part_timeline::PartTimeline;
use crate::export::progressive::timeline::Timeline;

/// The parts of a document that say what is seen.
const LISTS: [&str; 7] =
    ["scene", "scenes", "nodes", "meshes", "materials", "textures", "samplers"];
/// The attributes that are seen.
const ATTRIBUTES: [&str; 6] =
    ["POSITION", "NORMAL", "TANGENT", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0"];
/// Attributes that place the instances of a mesh.
const INSTANCES: &str = "/extensions/EXT_mesh_gpu_instancing/attributes";
/// Where a primitive, and the document, tell what they are over time; known to the view alone.
const TIMELINE: &str = "SEAMWISE_timeline";

/// Copies accessors of an asset into another document, each once.
struct Copier<'a> {
    from: &'a Asset,
    to: Packer,
    known: BTreeMap<usize, usize>,
}

/// An asset as a .glb without its images, which lie elsewhere in the page in their order, without
/// skins, motion and whatever else is not seen. `distances` become attributes of the source; a `timeline`
/// is told beside the coarsest level.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if an accessor is malformed.
pub(super) fn plain_glb(
    asset: &Asset,
    distances: Option<&SourceDistances>,
    timeline: Option<&Timeline>,
) -> Result<Vec<u8>> {
    let mut json = json!({"asset": {"version": "2.0"}});
    for list in LISTS {
        if let Some(own) = asset.json.get(list) {
            json[list] = own.clone();
        }
    }
    if let Some(extras) = asset.json.pointer("/asset/extras/seamwise") {
        json["asset"]["extras"] = json!({"seamwise": extras});
    }
    if let Some(center) = asset.json.pointer("/extensions/CESIUM_RTC") {
        json["extensions"] = json!({"CESIUM_RTC": center});
    }
    let to = Packer::new(&Asset { json, ..Asset::default() }, &[]);
    let mut copier = Copier { from: asset, to, known: BTreeMap::new() };
    for mesh in 0..asset.count("meshes") {
        for primitive in Primitive::of_mesh(asset, mesh)? {
            copier.copy_primitive(&primitive, distances)?;
            let part = timeline.and_then(|own| own.part([primitive.mesh, primitive.index]));
            if let Some(part) = part {
                copier.add_timeline(part, &primitive.at);
            }
        }
    }
    if let Some(timeline) = timeline {
        let triangles = copier.numbers(&timeline.triangles);
        copier.to.json()["extensions"][TIMELINE] = json!({"triangles": triangles});
    }
    for node in 0..asset.count("nodes") {
        copier.copy_instances(&format!("/nodes/{node}{INSTANCES}"))?;
    }
    to_glb(&copier.to.finish())
}

impl Copier<'_> {
    fn copy_primitive(
        &mut self,
        primitive: &Primitive,
        distances: Option<&SourceDistances>,
    ) -> Result<()> {
        let mut plain = Map::new();
        let mut attributes = Map::new();
        if primitive.is_surface() {
            for name in ATTRIBUTES {
                if let Some(own) = primitive.accessor(name) {
                    let copied = self.copy(own, &primitive.at, name == "POSITION")?;
                    attributes.insert(name.to_owned(), json!(copied));
                }
            }
            let rows = distances.map_or(&[][..], |own| own.of([primitive.mesh, primitive.index]));
            for (group, row) in rows.iter().enumerate() {
                let added = self.to.add_vertices(&bytes_in_fours(row), false);
                attributes.insert(format!("_DISTANCE_{group}"), json!(added));
            }
            if let Some(indices) = primitive.indices {
                let indices =
                    accessor::read(self.from, indices, &primitive.at)?.indices(&primitive.at)?;
                plain.insert("indices".into(), json!(self.to.add_indices(&indices)));
            }
        }
        let before = self.to.json().pointer(&primitive.at).cloned().unwrap_or_default();
        plain.insert("attributes".into(), Value::Object(attributes));
        for key in ["material", "mode"] {
            if let Some(own) = before.get(key) {
                plain.insert(key.into(), own.clone());
            }
        }
        if let Some(own) = self.to.json().pointer_mut(&primitive.at) {
            *own = Value::Object(plain);
        }
        Ok(())
    }

    /// Tells what a primitive is over time.
    fn add_timeline(&mut self, part: &PartTimeline, at: &str) {
        let mut told = Map::new();
        for (name, elements) in [
            ("births", &part.births),
            ("cornerStarts", &part.corners.starts),
            ("cornerTimes", &part.corners.times),
            ("cornerWedges", &part.wedges),
            ("valueStarts", &part.values.starts),
            ("valueTimes", &part.values.times),
            ("parents", &part.parents),
            ("places", &part.places),
            ("shareTimes", &part.share_times),
            ("shares", &part.shares),
        ] {
            told.insert(name.into(), json!(self.to.add_vertices(elements, false)));
        }
        for (name, all) in [("values", &part.attributes), ("ends", &part.ends)] {
            let seen = all.iter().filter(|own| ATTRIBUTES.contains(&own.0.as_str()));
            let added = seen.map(|(name, elements)| {
                (name.clone(), json!(self.to.add_vertices(elements, false)))
            });
            told.insert(name.into(), Value::Object(added.collect()));
        }
        if let Some(own) = self.to.json().pointer_mut(at) {
            own["extensions"] = json!({TIMELINE: told});
        }
    }

    fn numbers(&mut self, numbers: &[u32]) -> usize {
        let bytes = numbers.iter().flat_map(|own| own.to_le_bytes()).collect();
        let component = ComponentType::U32;
        self.to
            .add_vertices(&Elements { bytes, component, components: 1, normalized: false }, false)
    }

    fn copy_instances(&mut self, at: &str) -> Result<()> {
        let attributes = self.from.json.pointer(at).and_then(Value::as_object);
        for name in attributes.into_iter().flat_map(Map::keys) {
            if let Some(own) = self.from.reference(at, name, "accessors")? {
                let copied = self.copy(own, at, false)?;
                self.to
                    .json()
                    .pointer_mut(at)
                    .into_iter()
                    .for_each(|all| all[name] = json!(copied));
            }
        }
        Ok(())
    }

    fn copy(&mut self, accessor: usize, at: &str, bounds: bool) -> Result<usize> {
        if let Some(&known) = self.known.get(&accessor) {
            return Ok(known);
        }
        let elements = accessor::read(self.from, accessor, at)?;
        let copied = self.to.add_vertices(&elements, bounds);
        self.known.insert(accessor, copied);
        Ok(copied)
    }
}

/// Four shares of 0…1 for each vertex, as bytes.
fn bytes_in_fours(row: &[[u8; 4]]) -> Elements {
    Elements {
        bytes: row.as_flattened().to_vec(),
        component: ComponentType::U8,
        components: 4,
        normalized: true,
    }
}
