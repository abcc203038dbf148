//! Levels of detail as documents: one self-contained asset per level, and one with the source and
//! all levels, in one of the ways that `lod_nodes` tells.

use glam::{DMat4, Vec3};
use gltf::json::accessor::ComponentType;
use rustc_hash::FxHashMap;
use serde_json::{Value, json};

use super::files::OutputOptions;
use super::lod_nodes::{
    Layout, Shown, add_levels, add_suffix, animate_levels, place_on_grid, push,
};
use super::materials::{add_level_materials, replace_textures};
use super::vertex_pool::{Shared, SharedParts};
use crate::document::accessor::{Elements, Named};
use crate::document::asset::Asset;
use crate::document::edit::Packer;
use crate::document::extensions::{drop_unused_extension, name_extension, remove_extension};
use crate::document::known_extensions::lost_with_geometry;
use crate::document::nodes::world_nodes;
use crate::document::primitive::Primitive;
use crate::document::prune::prune;
use crate::document::references::replaced_accessors;
use crate::error::{Error, Result};
use crate::image_file::encoded::EncodedImage;
use crate::level::geomorph::SourceMorph;
use crate::level::part::LevelPart;
use crate::level::{AssetLevel, LevelMesh};
use crate::screen::Screen;
use crate::surface::geometry::Geometry;
use crate::surface::part::Part;

/// The asset with the surfaces of its meshes replaced by one level of each, in the textures of that
/// level.
///
/// # Errors
/// [`Error::Invalid`] if the document's meshes are malformed.
pub fn level_asset(asset: &Asset, level: &AssetLevel<'_>) -> Result<Asset> {
    let AssetLevel { meshes, textures } = level;
    let is_replaced = |primitive: &Primitive| {
        let is_own = |level: &&LevelMesh<'_>| level.geometry.meshes.contains(&primitive.mesh);
        primitive.is_surface() && meshes.iter().find(is_own).is_some_and(|l| l.parts.is_some())
    };
    let mut packer = Packer::new(asset, &replaced_accessors(asset, is_replaced)?);
    let materials = replace_textures(&mut packer, textures)?;
    for surface in meshes {
        for &mesh in &surface.geometry.meshes {
            let source = asset.json["meshes"][mesh]["primitives"].clone();
            let own = (surface, mesh);
            let mut primitives = level_primitives(&mut packer, &source, own, &materials, |_| None)?;
            if primitives.is_empty() {
                leave_out(packer.json(), mesh);
                primitives.push(nothing(&mut packer));
            }
            packer.json()["meshes"][mesh]["primitives"] = Value::Array(primitives);
            if surface.has_target {
                name_target(&mut packer.json()["meshes"][mesh]);
            }
            if let Some(grid) = surface.grid {
                for node in nodes_of(asset, mesh)? {
                    if packer.json()["nodes"][node].get("mesh").is_some() {
                        place_on_grid(packer.json(), node, grid)?;
                    }
                }
            }
        }
    }
    let merged = textures.merged.iter().flat_map(|own| &own.materials);
    prune(&mut packer, &merged.copied().collect())?;
    lost_with_geometry().for_each(|name| drop_unused_extension(packer.json(), name));
    Ok(packer.finish())
}

/// The nodes that show a mesh.
fn nodes_of(asset: &Asset, mesh: usize) -> Result<Vec<usize>> {
    let mut nodes = Vec::new();
    for node in 0..asset.count("nodes") {
        if asset.reference(&format!("/nodes/{node}"), "mesh", "meshes")? == Some(mesh) {
            nodes.push(node);
        }
    }
    Ok(nodes)
}

/// The input of `MSFT_screencoverage`.
#[derive(Clone, Copy, Debug)]
pub struct Coverage<'a> {
    /// The screen.
    pub screen: &'a Screen,
    /// The largest size of each level in pixels, as [`switch_sizes`](crate::screen::switch_sizes) gives
    /// them.
    pub sizes: &'a [f64],
    /// The diagonal of the asset's bounding box in world units.
    pub diagonal: f64,
}

/// The asset as it is, its images replaced by `images`, with every level of its meshes beside it, in
/// the layout that `output` has, and with vertices in common if it says so.
///
/// `levels` holds one entry per level, the finest first, each with the same meshes in the same
/// order. With `coverage`, each node of an `MSFT_lod` says how much of the screen it must cover for
/// each level to be shown, in `MSFT_screencoverage`.
///
/// # Errors
/// [`Error::Invalid`] if the document's meshes or nodes are malformed.
pub fn chain_asset(
    asset: &Asset,
    levels: &[AssetLevel<'_>],
    images: &[EncodedImage],
    output: OutputOptions,
    coverage: Option<&Coverage<'_>>,
) -> Result<Asset> {
    let OutputOptions { layout, share_vertices, .. } = output;
    let shared = share_vertices.then(|| Shared::find(asset, levels)).transpose()?;
    let shared = shared.unwrap_or_default();
    let mut packer = Packer::new(asset, &shared.replaced);
    for (index, image) in images.iter().enumerate() {
        packer.set_image(index, image.clone());
    }
    let shared = shared.write(&mut packer);
    let shown = add_meshes(&mut packer, asset, levels, &shared)?;
    let worlds: FxHashMap<usize, DMat4> = world_nodes(asset)?.into_iter().collect();
    for node in 0..asset.count("nodes") {
        let Some(mesh) = asset.reference(&format!("/nodes/{node}"), "mesh", "meshes")? else {
            continue;
        };
        let Some(surface) = levels
            .iter()
            .flat_map(|level| &level.meshes)
            .find(|level| level.geometry.meshes.contains(&mesh))
        else {
            continue;
        };
        let linked = add_levels(packer.json(), node, &shown[mesh], layout)?;
        let world = worlds.get(&node).filter(|_| layout == Layout::MsftLod);
        if let (Some(coverage), Some(world)) = (coverage, world) {
            let share = diagonal(surface.geometry, mesh, world) / coverage.diagonal;
            let coverages = coverage.screen.coverages(coverage.sizes, share);
            add_coverage(&mut packer.json()["nodes"][linked], &coverages);
        }
    }
    if layout == Layout::MsftLod {
        name_extension(packer.json(), "MSFT_lod");
        drop_unused_extension(packer.json(), "MSFT_lod");
    }
    Ok(packer.finish())
}

/// Tells programs what the only morph target of a mesh is, which has no share in it at first.
fn name_target(mesh: &mut Value) {
    mesh["weights"] = json!([0.0]);
    if !mesh["extras"].is_object() {
        mesh["extras"] = json!({});
    }
    mesh["extras"]["targetNames"] = json!(["geomorph"]);
}

/// A document of the source and its levels whose primitives of the source tell the way to the first level.
///
/// # Errors
/// [`Error::Internal`] if it lacks one of the primitives.
pub(crate) fn with_source_morphs(document: &Asset, morphs: &[SourceMorph]) -> Result<Asset> {
    let mut packer = Packer::new(document, &[]);
    for SourceMorph { mesh, primitive, attributes, target } in morphs {
        let mut add = |(name, elements): &Named| {
            let bounds = name == "POSITION";
            (name.clone(), json!(packer.add_vertices(elements, bounds)))
        };
        let attributes: Vec<_> = attributes.iter().map(&mut add).collect();
        let target: Option<Value> =
            target.as_ref().map(|own| Value::Object(own.iter().map(&mut add).collect()));
        let at = format!("/meshes/{mesh}/primitives/{primitive}");
        let own = packer.json().pointer_mut(&at);
        let own = own.ok_or_else(|| Error::internal("a primitive of the source is not there"))?;
        if let Some(all) = own["attributes"].as_object_mut() {
            all.extend(attributes);
        }
        if let Some(target) = target {
            own["targets"] = json!([target]);
            name_target(&mut packer.json()["meshes"][*mesh]);
        }
    }
    Ok(packer.finish())
}

/// Adds a mesh for every level of each. One entry per mesh of the source, with what its levels are
/// shown by, the finest first.
fn add_meshes(
    packer: &mut Packer,
    asset: &Asset,
    levels: &[AssetLevel<'_>],
    shared: &SharedParts,
) -> Result<Vec<Vec<Shown>>> {
    let mut shown = vec![Vec::new(); asset.count("meshes")];
    for (level, AssetLevel { meshes, textures }) in levels.iter().enumerate() {
        let materials = add_level_materials(packer, asset, textures)?;
        for (surface, &mesh) in
            meshes.iter().flat_map(|s| s.geometry.meshes.iter().map(move |m| (s, m)))
        {
            // Not the asset's, which has no part in what is shared.
            let mut json = packer.json()["meshes"][mesh].clone();
            let own = (surface, mesh);
            let shared = |index| shared.get(&(level, [mesh, index]));
            let primitives =
                level_primitives(packer, &json["primitives"], own, &materials, shared)?;
            let is_left = !primitives.is_empty();
            json["primitives"] = Value::Array(primitives);
            if surface.has_target {
                name_target(&mut json);
            }
            add_suffix(&mut json, level + 1);
            let index = is_left.then(|| push(packer.json(), "meshes", json)).transpose()?;
            shown[mesh].push(Shown { mesh: index, grid: surface.grid });
        }
    }
    for (mesh, shown) in shown.iter().enumerate() {
        let levels: Vec<usize> = shown.iter().filter_map(|level| level.mesh).collect();
        animate_levels(packer.json(), ("meshes", mesh), &levels);
    }
    Ok(shown)
}

/// The primitives of a mesh with its surface parts replaced; points and lines stay. None at all if a
/// surface of several meshes has no triangle left in this one. `materials` tells which the level uses
/// instead of the source's, `shared` what a part is made of if its vertices are there already.
fn level_primitives<'a>(
    packer: &mut Packer,
    source: &Value,
    (surface, mesh): (&LevelMesh<'_>, usize),
    materials: &[usize],
    shared: impl Fn(usize) -> Option<&'a Value>,
) -> Result<Vec<Value>> {
    let mut primitives = Vec::new();
    for (index, json) in source.as_array().into_iter().flatten().enumerate() {
        let is_own = |part: &Part| [part.primitive.mesh, part.primitive.index] == [mesh, index];
        let Some(part) = surface.geometry.parts.iter().position(is_own) else {
            primitives.push(json.clone());
            continue;
        };
        let mut json = match surface.parts.as_ref().map(|parts| &parts[part]) {
            None => json.clone(),
            Some(None) => continue,
            Some(Some(part)) => match shared(index) {
                Some(geometry) => with_geometry(json, geometry.clone())?,
                None => {
                    let geometry = add_geometry(packer, part);
                    with_geometry(json, geometry)?
                }
            },
        };
        change_materials(&mut json, materials);
        primitives.push(json);
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

/// The accessors of a level's part.
pub(crate) fn add_geometry(packer: &mut Packer, part: &LevelPart) -> Value {
    let mut add_all = |attributes: &[Named]| {
        let add = |(name, elements): &Named| {
            (name.clone(), json!(packer.add_vertices(elements, name == "POSITION")))
        };
        Value::Object(attributes.iter().map(add).collect())
    };
    let mut geometry = json!({"attributes": add_all(&part.attributes)});
    if !part.targets.is_empty() {
        geometry["targets"] = part.targets.iter().map(|target| add_all(target)).collect();
    }
    geometry["indices"] = json!(packer.add_indices(&part.indices));
    geometry
}

/// A primitive of the source with a list of triangles of other accessors.
pub(crate) fn with_geometry(source: &Value, geometry: Value) -> Result<Value> {
    let mut json = source.clone();
    let (Some(object), Value::Object(geometry)) = (json.as_object_mut(), geometry) else {
        return Err(Error::internal("a primitive that was read is not an object"));
    };
    object.extend(geometry);
    object.shift_remove("mode");
    for name in lost_with_geometry().chain(["KHR_draco_mesh_compression"]) {
        remove_extension(&mut json, name);
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
