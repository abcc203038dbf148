//! Levels of detail as documents: one self-contained asset per level, and one with the source and
//! all levels, linked by the extension `MSFT_lod`.

use std::collections::BTreeSet;

use glam::{DMat4, Vec3};
use gltf::json::accessor::ComponentType;
use rustc_hash::FxHashMap;
use serde_json::{Map, Value, json};

use crate::accessor::Elements;
use crate::asset::{Asset, EncodedImage};
use crate::certificate::Screen;
use crate::dress::{LevelTextures, dress, dress_apart};
use crate::error::{Error, Result};
use crate::geometry::{Geometry, Part};
use crate::nodes::world_nodes;
use crate::pack::Packer;
use crate::parts::LevelPart;
use crate::primitive::Primitive;
use crate::prune::prune;

/// One level of a surface, ready to be written.
#[derive(Clone, Debug)]
pub struct LevelMesh<'a> {
    /// The source.
    pub geometry: &'a Geometry,
    /// One per part of the source.
    pub parts: Vec<Option<LevelPart>>,
}

/// A level of a whole asset.
#[derive(Clone, Debug)]
pub struct DressedLevel<'a> {
    /// One per surface.
    pub meshes: Vec<LevelMesh<'a>>,
    /// What they wear.
    pub textures: LevelTextures,
}

/// The asset with the surfaces of its meshes replaced by one level of each, in the textures of that
/// level.
///
/// # Errors
/// [`Error::Invalid`] if the document's meshes are malformed.
pub fn level_asset(asset: &Asset, level: &DressedLevel<'_>) -> Result<Asset> {
    let DressedLevel { meshes, textures } = level;
    let mut packer = Packer::new(asset, &replaced_accessors(asset, meshes)?);
    let materials = dress(&mut packer, textures)?;
    for surface in meshes {
        for &mesh in &surface.geometry.meshes {
            let source = asset.json["meshes"][mesh]["primitives"].clone();
            let own = (surface, mesh);
            let mut primitives = level_primitives(&mut packer, &source, own, &materials)?;
            if primitives.is_empty() {
                leave_out(packer.json(), mesh);
                primitives.push(nothing(&mut packer));
            }
            packer.json()["meshes"][mesh]["primitives"] = Value::Array(primitives);
        }
    }
    let merged = textures.merged.iter().flat_map(|own| &own.materials);
    prune(&mut packer, &merged.copied().collect())?;
    Ok(packer.finish())
}

/// What `MSFT_screencoverage` is reckoned from.
#[derive(Clone, Copy, Debug)]
pub struct Coverage<'a> {
    /// The screen.
    pub screen: &'a Screen,
    /// The largest size of each level in pixels, as [`Screen::largest_sizes`] gives them.
    pub sizes: &'a [f64],
    /// The diagonal of the asset's bounding box in world units.
    pub diagonal: f64,
}

/// The asset as it is, its images replaced by `images`, with every level of its meshes beside it:
/// each node with such a mesh names a node for each level, in `MSFT_lod`.
///
/// `levels` holds one entry per level, the finest first, each with the same meshes in the same
/// order. With `coverage`, each such node says how much of the screen it must cover for each level
/// to be shown, in `MSFT_screencoverage`.
///
/// # Errors
/// [`Error::Invalid`] if the document's meshes or nodes are malformed.
pub fn chain_asset(
    asset: &Asset,
    levels: &[DressedLevel<'_>],
    images: &[EncodedImage],
    coverage: Option<&Coverage<'_>>,
) -> Result<Asset> {
    let mut packer = Packer::new(asset, &[]);
    for (index, image) in images.iter().enumerate() {
        packer.set_image(index, image.clone());
    }
    let mut level_meshes = vec![Vec::new(); asset.count("meshes")];
    for (level, DressedLevel { meshes, textures }) in levels.iter().enumerate() {
        let materials = dress_apart(&mut packer, asset, textures)?;
        for (surface, &mesh) in
            meshes.iter().flat_map(|s| s.geometry.meshes.iter().map(move |m| (s, m)))
        {
            let mut json = asset.json["meshes"][mesh].clone();
            let own = (surface, mesh);
            let primitives = level_primitives(&mut packer, &json["primitives"], own, &materials)?;
            let is_left = !primitives.is_empty();
            json["primitives"] = Value::Array(primitives);
            add_suffix(&mut json, level + 1);
            let index = is_left.then(|| push(packer.json(), "meshes", json)).transpose()?;
            level_meshes[mesh].push(index);
        }
    }
    let worlds: FxHashMap<usize, DMat4> = world_nodes(asset)?.into_iter().collect();
    for node in 0..asset.count("nodes") {
        let Some(mesh) = asset.reference(&format!("/nodes/{node}"), "mesh", "meshes")? else {
            continue;
        };
        if level_meshes[mesh].is_empty() {
            continue;
        }
        let linked = link_levels(packer.json(), node, &level_meshes[mesh])?;
        let surface = levels
            .iter()
            .flat_map(|level| &level.meshes)
            .find(|level| level.geometry.meshes.contains(&mesh));
        if let (Some(coverage), Some(level), Some(world)) = (coverage, surface, worlds.get(&node)) {
            let share = diagonal(level.geometry, mesh, world) / coverage.diagonal;
            let coverages = coverage.screen.coverages(coverage.sizes, share);
            add_coverage(&mut packer.json()["nodes"][linked], &coverages);
        }
    }
    name_extension(packer.json(), "MSFT_lod");
    Ok(packer.finish())
}

/// The accessors of the surfaces that nothing else in the document refers to.
fn replaced_accessors(asset: &Asset, meshes: &[LevelMesh<'_>]) -> Result<Vec<usize>> {
    let (mut replaced, mut kept) = (BTreeSet::new(), BTreeSet::new());
    for mesh in 0..asset.count("meshes") {
        let is_replaced = meshes.iter().any(|level| level.geometry.meshes.contains(&mesh));
        for primitive in Primitive::of_mesh(asset, mesh)? {
            let used =
                if is_replaced && primitive.is_surface() { &mut replaced } else { &mut kept };
            used.extend(primitive.indices);
            used.extend(primitive.attributes.iter().map(|&(_, accessor)| accessor));
            used.extend(primitive.targets.iter().flatten().map(|&(_, accessor)| accessor));
        }
    }
    for list in ["animations", "skins", "nodes"] {
        collect_accessors(asset.json.get(list).unwrap_or(&Value::Null), &mut kept);
    }
    Ok(replaced.difference(&kept).copied().collect())
}

/// Every accessor named in animations, skins and instanced nodes.
fn collect_accessors(json: &Value, found: &mut BTreeSet<usize>) {
    match json {
        Value::Object(object) => {
            for (key, value) in object {
                let index = value.as_u64().map(|index| index as usize);
                match (key.as_str(), index) {
                    ("input" | "output" | "inverseBindMatrices", Some(index)) => {
                        found.insert(index);
                    }
                    ("attributes", None) => {
                        let attributes = value.as_object().into_iter().flat_map(Map::values);
                        found.extend(attributes.filter_map(Value::as_u64).map(|i| i as usize));
                    }
                    _ => collect_accessors(value, found),
                }
            }
        }
        Value::Array(list) => list.iter().for_each(|value| collect_accessors(value, found)),
        _ => {}
    }
}

/// The primitives of a mesh with its surface parts replaced; points and lines stay. None at all if a
/// surface of several meshes has no triangle left in this one. `materials` tells which the level wears
/// instead of the source's.
fn level_primitives(
    packer: &mut Packer,
    source: &Value,
    (surface, mesh): (&LevelMesh<'_>, usize),
    materials: &[usize],
) -> Result<Vec<Value>> {
    let mut primitives = Vec::new();
    for (index, json) in source.as_array().into_iter().flatten().enumerate() {
        let is_own = |part: &Part| [part.primitive.mesh, part.primitive.index] == [mesh, index];
        match surface.geometry.parts.iter().position(is_own).map(|part| &surface.parts[part]) {
            None => primitives.push(json.clone()),
            Some(None) => {}
            Some(Some(part)) => {
                let mut json = level_primitive(packer, json, part)?;
                change_materials(&mut json, materials);
                primitives.push(json);
            }
        }
    }
    Ok(primitives)
}

/// Puts other materials on a primitive, and on its variants.
fn change_materials(primitive: &mut Value, materials: &[usize]) {
    let change = |json: &mut Value| {
        if let Some(material) = json.get_mut("material") {
            let own = material.as_u64().and_then(|own| materials.get(own as usize));
            *material = own.map_or(Value::Null, |own| json!(own));
        }
    };
    let mappings = primitive.pointer_mut("/extensions/KHR_materials_variants/mappings");
    mappings.and_then(Value::as_array_mut).into_iter().flatten().for_each(change);
    change(primitive);
}

/// Takes a mesh from the nodes that show it.
fn leave_out(json: &mut Value, mesh: usize) {
    for node in json["nodes"].as_array_mut().into_iter().flatten().filter_map(Value::as_object_mut)
    {
        if node.get("mesh") == Some(&json!(mesh)) {
            node.shift_remove("mesh");
        }
    }
}

/// A primitive of one triangle without area, for a mesh that no node shows but whose index stays.
fn nothing(packer: &mut Packer) -> Value {
    let (component, bytes) = (ComponentType::F32, vec![0; 36]);
    let corners = Elements { bytes, component, components: 3, normalized: false };
    json!({"attributes": {"POSITION": packer.add_vertices(&corners, true)}})
}

fn level_primitive(packer: &mut Packer, source: &Value, part: &LevelPart) -> Result<Value> {
    let mut json = source.clone();
    let object = json.as_object_mut().ok_or_else(|| Error::Internal {
        what: "a primitive that was read is not an object".into(),
    })?;
    let mut add_all = |attributes: &[(String, Elements)]| {
        let add = |(name, elements): &(String, Elements)| {
            (name.clone(), json!(packer.add_vertices(elements, name == "POSITION")))
        };
        Value::Object(attributes.iter().map(add).collect())
    };
    object.insert("attributes".into(), add_all(&part.attributes));
    if !part.targets.is_empty() {
        let targets = part.targets.iter().map(|target| add_all(target)).collect();
        object.insert("targets".into(), Value::Array(targets));
    }
    object.insert("indices".into(), json!(packer.add_indices(&part.indices)));
    object.shift_remove("mode");
    if let Some(extensions) = object.get_mut("extensions").and_then(Value::as_object_mut) {
        extensions.shift_remove("KHR_draco_mesh_compression");
        if extensions.is_empty() {
            object.shift_remove("extensions");
        }
    }
    Ok(json)
}

/// The diagonal of a mesh's bounding box, as long as it is in the world on average over directions.
fn diagonal(geometry: &Geometry, mesh: usize, world: &DMat4) -> f64 {
    let welded = &geometry.welded.mesh;
    let is_own = |&t: &usize| geometry.parts[welded.groups[t] as usize].primitive.mesh == mesh;
    let own = (0..welded.triangles.len()).filter(is_own);
    let (low, high) = own
        .flat_map(|triangle| welded.triangle_positions(triangle))
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    f64::from((high - low).length()) * world.determinant().abs().cbrt()
}

/// Writes `MSFT_screencoverage` beside what a node's extras hold.
fn add_coverage(node: &mut Value, coverages: &[f64]) {
    if let Some(node) = node.as_object_mut()
        && let Some(extras) = node.entry("extras").or_insert_with(|| json!({})).as_object_mut()
    {
        extras.insert("MSFT_screencoverage".into(), json!(coverages));
    }
}

/// Adds a node for each level and names them in the `MSFT_lod` of the node that shows the mesh,
/// which it returns.
///
/// Levels replace their node as a whole, its children too. So where a node has children, its mesh
/// first moves to a child of its own, together with what belongs to the mesh.
fn link_levels(json: &mut Value, node: usize, meshes: &[Option<usize>]) -> Result<usize> {
    let has_children = json["nodes"][node].get("children").is_some();
    let node = if has_children { hoist_mesh(json, node)? } else { node };
    let mut ids = Vec::with_capacity(meshes.len());
    for (level, mesh) in meshes.iter().enumerate() {
        let mut copy = json["nodes"][node].clone();
        match (mesh, copy.as_object_mut()) {
            (None, Some(node)) => drop(node.shift_remove("mesh")),
            _ => copy["mesh"] = json!(mesh),
        }
        if let Some(extensions) = copy.get_mut("extensions").and_then(Value::as_object_mut) {
            extensions.shift_remove("MSFT_lod");
        }
        add_suffix(&mut copy, level + 1);
        ids.push(push(json, "nodes", copy)?);
    }
    json["nodes"][node]["extensions"]["MSFT_lod"] = json!({"ids": ids});
    Ok(node)
}

/// Moves a node's mesh, skin and morph weights to a new child; animations of the weights follow.
fn hoist_mesh(json: &mut Value, node: usize) -> Result<usize> {
    let mut child = Map::new();
    let parent = json["nodes"][node]
        .as_object_mut()
        .ok_or_else(|| Error::invalid(format!("/nodes/{node}"), "not an object"))?;
    if let Some(name) = parent.get("name").and_then(Value::as_str) {
        child.insert("name".into(), json!(format!("{name}_mesh")));
    }
    for key in ["mesh", "skin", "weights"] {
        child.extend(parent.shift_remove(key).map(|value| (key.to_owned(), value)));
    }
    let instancing = parent
        .get_mut("extensions")
        .and_then(|extensions| extensions.as_object_mut()?.shift_remove("EXT_mesh_gpu_instancing"));
    if let Some(instancing) = instancing {
        child.insert("extensions".into(), json!({"EXT_mesh_gpu_instancing": instancing}));
    }
    let child = push(json, "nodes", Value::Object(child))?;
    if let Some(children) = json["nodes"][node]["children"].as_array_mut() {
        children.push(json!(child));
    }
    let animations = json.get_mut("animations").and_then(Value::as_array_mut);
    for animation in animations.into_iter().flatten() {
        let channels = animation.get_mut("channels").and_then(Value::as_array_mut);
        for target in channels.into_iter().flatten().filter_map(|c| c.get_mut("target")) {
            if target["node"] == json!(node) && target["path"] == "weights" {
                target["node"] = json!(child);
            }
        }
    }
    Ok(child)
}

/// Marks the name of a level's object.
fn add_suffix(json: &mut Value, level: usize) {
    if let Some(name) = json.get("name").and_then(Value::as_str) {
        json["name"] = json!(format!("{name}_lod{level}"));
    }
}

/// Appends an object to a list of the document.
fn push(json: &mut Value, list: &str, object: Value) -> Result<usize> {
    let list = json[list]
        .as_array_mut()
        .ok_or_else(|| Error::invalid(format!("/{list}"), "not a list"))?;
    list.push(object);
    Ok(list.len() - 1)
}

/// Lists an extension among those used.
fn name_extension(json: &mut Value, name: &str) {
    let used = &mut json["extensionsUsed"];
    match used.as_array_mut() {
        Some(used) if used.iter().any(|own| own == name) => {}
        Some(used) => used.push(json!(name)),
        None => *used = json!([name]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn document() -> Value {
        json!({
            "nodes": [
                {"name": "arm", "mesh": 0, "weights": [0.5], "children": [1], "rotation": [0, 0, 0, 1]},
                {"name": "hand", "mesh": 0},
            ],
            "animations": [{"channels": [
                {"target": {"node": 0, "path": "weights"}},
                {"target": {"node": 0, "path": "rotation"}},
            ]}],
        })
    }

    #[test]
    fn a_leaf_names_a_node_for_each_level() {
        let mut json = document();
        link_levels(&mut json, 1, &[Some(7), Some(8)]).unwrap();
        assert_eq!(json["nodes"][1]["extensions"]["MSFT_lod"]["ids"], json!([2, 3]));
        assert_eq!(json["nodes"][3], json!({"name": "hand_lod2", "mesh": 8}));
    }

    #[test]
    fn a_node_with_children_hands_its_mesh_to_a_child_so_that_they_stay() {
        let mut json = document();
        link_levels(&mut json, 0, &[Some(7)]).unwrap();
        let nodes = &json["nodes"];
        assert_eq!(nodes[0]["children"], json!([1, 2]));
        assert!(nodes[0].get("mesh").is_none() && nodes[0].get("rotation").is_some());
        assert_eq!((&nodes[2]["mesh"], &nodes[2]["weights"]), (&json!(0), &json!([0.5])));
        assert_eq!(nodes[2]["extensions"]["MSFT_lod"]["ids"], json!([3]));
        let channels = &json["animations"][0]["channels"];
        assert_eq!(channels[0]["target"]["node"], 2, "weights follow the mesh");
        assert_eq!(channels[1]["target"]["node"], 0, "the rotation stays");
    }

    #[test]
    fn accessors_of_animations_skins_and_instances_are_found() {
        let json = json!([
            {"samplers": [{"input": 3, "output": 4, "interpolation": "LINEAR"}]},
            {"inverseBindMatrices": 5, "joints": [0]},
            {"extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 6}}}},
        ]);
        let mut found = BTreeSet::new();
        collect_accessors(&json, &mut found);
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [3, 4, 5, 6]);
    }
}
