//! The levels of each mesh as files, and the densities by which a loader picks one.
//!
//! A loader compares d / c with a target T, 200,000 unless a page sets another: d is the density of a level, c
//! the largest side of the primitive's box as it is seen, over the height of the screen. So a level is left for
//! the next coarser one where c falls to d / T. The coarser one may be shown up to S pixels of the asset's
//! diagonal D (see [`screen`](crate::screen)), where a primitive whose own diagonal is p has p · S / D. Of a box
//! with this diagonal, however it is turned, the largest side is no less than p / √3: of a rod that points
//! along the diagonal of the view it is that. So with H pixels of height
//!
//! d = T · S · p / (√3 · D · H),
//!
//! and no level is shown larger than its certificate says, wherever the eye is; along the axes of a rod finer
//! ones are shown from √3 times farther than needed.
//!
//! Where nothing was measured, d is the number of triangles, which is what the loader's own words say: T is the
//! most triangles of what fills the screen.
//!
//! A primitive of which a level has nothing left stays as the last level that has some of it: primitives are
//! found by their place in the mesh, and what is not there at first can't become finer.

use glam::{DMat4, Vec3};
use rustc_hash::FxHashMap;
use serde_json::{Map, Value, json};

use super::extension::Beside;
use super::sources::Sources;
use crate::document::accessor;
use crate::document::asset::Asset;
use crate::document::edit::Packer;
use crate::document::nodes::mesh_worlds;
use crate::document::primitive::Primitive;
use crate::error::Result;
use crate::export::document::{Coverage, add_geometry};
use crate::level::AssetLevel;
use crate::level::part::LevelPart;

/// Triangles of what fills the screen, where a page says nothing else.
const TARGET: f64 = 200_000.0;
/// The largest density: of a level that no coarser one is ever told from.
const MOST: f64 = 1e12;

/// The part that a primitive, by its mesh and its place there, is made of in the last of these levels: that of
/// the last one that has any of it. None if that is the source's own.
pub(super) fn part_of<'a>(
    levels: &'a [AssetLevel<'a>],
    primitive: [usize; 2],
) -> Option<&'a LevelPart> {
    levels.iter().rev().find_map(|level| {
        let own = level.meshes.iter().find(|own| own.geometry.meshes.contains(&primitive[0]))?;
        let mut parts = own.geometry.parts.iter();
        let place =
            parts.position(|part| [part.primitive.mesh, part.primitive.index] == primitive)?;
        own.parts.as_ref()?.get(place)?.as_ref()
    })
}

/// The levels of all meshes.
pub(super) struct MeshFiles<'a> {
    sources: &'a Sources<'a>,
    /// By mesh: the least length in the scene of one in the mesh.
    scales: FxHashMap<usize, f64>,
}

impl<'a> MeshFiles<'a> {
    pub(super) fn new(sources: &'a Sources<'a>) -> Result<Self> {
        let least = |(mesh, worlds): (usize, Vec<DMat4>)| {
            let lengths = worlds.iter().map(|world| world.determinant().abs().cbrt());
            (mesh, lengths.fold(f64::INFINITY, f64::min))
        };
        Ok(Self { sources, scales: mesh_worlds(sources.asset)?.into_iter().map(least).collect() })
    }

    /// Writes the levels of a mesh that are finer than the coarsest, and returns what leads to them; none if it
    /// is shown nowhere, or is the same in all levels.
    pub(super) fn write(&self, mesh: usize, beside: &mut Beside<'_>) -> Result<Option<Value>> {
        let Sources { asset, levels, .. } = *self.sources;
        let Some(&scale) = self.scales.get(&mesh) else { return Ok(None) };
        let primitives = Primitive::of_mesh(asset, mesh)?;
        let diagonals: Vec<f64> = primitives
            .iter()
            .map(|own| Ok(scale * diagonal(asset, own)?))
            .collect::<Result<_>>()?;
        let is_same = |level: usize, own: &Primitive| {
            let [fine, coarse] = [level, level + 1].map(|end| part_of(&levels[..end], place(own)));
            fine == coarse
        };
        let (mut documents, mut densities, mut counts) = (Vec::new(), Vec::new(), Vec::new());
        for level in 0..levels.len() {
            if primitives.iter().all(|own| is_same(level, own)) {
                continue;
            }
            let (document, own) = self.document(level, mesh, &primitives)?;
            documents.push((format!("mesh{mesh}_lod{level}"), document));
            let of_primitive = |(diagonal, count): (&f64, &Counts)| match &self.sources.coverage {
                Some(coverage) => density(coverage, level, *diagonal),
                None => count.indices as f64 / 3.0,
            };
            densities.push(diagonals.iter().zip(&own).map(of_primitive).collect::<Vec<f64>>());
            counts.push(own);
        }
        if documents.is_empty() {
            return Ok(None);
        }
        let (guids, mut lods) = beside.add(documents, &["/meshes/0".to_owned()])?;
        for ((lod, densities), counts) in lods.iter_mut().zip(densities).zip(counts) {
            lod["densities"] = json!(densities);
            lod["indexCount"] = json!(counts.iter().map(|own| own.indices).sum::<usize>());
            lod["vertexCount"] = json!(counts.iter().map(|own| own.vertices).sum::<usize>());
        }
        Ok(Some(json!({"guid": guids[0], "lods": lods})))
    }

    /// A document of a mesh in one of its levels, 0 the source; and what each primitive has.
    fn document(
        &self,
        level: usize,
        mesh: usize,
        primitives: &[Primitive],
    ) -> Result<(Asset, Vec<Counts>)> {
        let Sources { asset, levels, .. } = *self.sources;
        let json = json!({"asset": {"version": "2.0"}});
        let mut packer = Packer::new(&Asset { json, ..Asset::default() }, &[]);
        let mut written = Vec::new();
        for own in primitives {
            written.push(match part_of(&levels[..level], place(own)) {
                Some(part) => add_geometry(&mut packer, part),
                None => copy(&mut packer, asset, own)?,
            });
        }
        let counts = written.iter().map(|own| Counts::of(packer.json(), own)).collect();
        let mut own = json!({"primitives": written});
        if let Some(name) = asset.json["meshes"][mesh].get("name") {
            own["name"] = name.clone();
        }
        packer.json()["meshes"] = json!([own]);
        // A node without a skin shows no skinned mesh.
        if primitives.iter().all(|own| own.accessor("JOINTS_0").is_none()) {
            packer.json()["nodes"] = json!([{"mesh": 0}]);
            packer.json()["scenes"] = json!([{"nodes": [0]}]);
            packer.json()["scene"] = json!(0);
        }
        Ok((packer.finish(), counts))
    }
}

/// What a primitive has.
struct Counts {
    indices: usize,
    vertices: usize,
}

impl Counts {
    fn of(document: &Value, primitive: &Value) -> Self {
        let count = |accessor: &Value| {
            let own = accessor.as_u64().map(|own| &document["accessors"][own as usize]["count"]);
            own.and_then(Value::as_u64).unwrap_or_default() as usize
        };
        let vertices = count(&primitive["attributes"]["POSITION"]);
        let indices = primitive.get("indices").map_or(vertices, count);
        Self { indices, vertices }
    }
}

/// The mesh of a primitive, and its place there.
fn place(primitive: &Primitive) -> [usize; 2] {
    [primitive.mesh, primitive.index]
}

/// The density of a level, 0 the source, of a primitive with a diagonal in the scene.
fn density(coverage: &Coverage<'_>, level: usize, diagonal: f64) -> f64 {
    let height = 3.0f64.sqrt() * coverage.diagonal * f64::from(coverage.screen.height);
    (TARGET * coverage.sizes[level] * diagonal / height).min(MOST)
}

/// The diagonal of a primitive's box in its mesh.
fn diagonal(asset: &Asset, primitive: &Primitive) -> Result<f64> {
    let bounds = |(low, high): (Vec3, Vec3), own: &Vec3| (low.min(*own), high.max(*own));
    let positions = primitive.positions(asset)?;
    let (low, high) = positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), bounds);
    Ok(if positions.is_empty() { 0.0 } else { f64::from((high - low).length()) })
}

/// The accessors of a primitive of the source, in a document of its own.
fn copy(packer: &mut Packer, asset: &Asset, primitive: &Primitive) -> Result<Value> {
    let mut add_all = |attributes: &[(String, usize)]| {
        let add = |(name, index): &(String, usize)| {
            let elements = accessor::read(asset, *index, &primitive.at)?;
            Ok((name.clone(), json!(packer.add_vertices(&elements, name == "POSITION"))))
        };
        attributes.iter().map(add).collect::<Result<Map<String, Value>>>()
    };
    let mut json = json!({"attributes": add_all(&primitive.attributes)?});
    if !primitive.targets.is_empty() {
        let targets = primitive.targets.iter().map(|own| add_all(own));
        json["targets"] = json!(targets.collect::<Result<Vec<_>>>()?);
    }
    if let Some(indices) = primitive.indices {
        let indices = accessor::read(asset, indices, &primitive.at)?.indices(&primitive.at)?;
        json["indices"] = json!(packer.add_indices(&indices));
    }
    if let Some(mode) = asset.json.pointer(&format!("{}/mode", primitive.at)) {
        json["mode"] = mode.clone();
    }
    Ok(json)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::screen::Screen;

    #[test]
    fn a_primitive_that_fills_its_share_of_a_size_is_shown_up_to_it() {
        let screen = Screen { height: 1000, ..Screen::default() };
        let sizes = [500.0, f64::INFINITY];
        let coverage = Coverage { screen: &screen, sizes: &sizes, diagonal: 4.0 };
        // A rod of half the asset's length, seen along the diagonal of the view: 250 pixels, of which each axis
        // takes 250 / √3 of 1,000.
        let share = 250.0 / 3.0f64.sqrt() / 1000.0;
        assert!((density(&coverage, 0, 2.0) / share - TARGET).abs() < 1e-6);
        assert_eq!(density(&coverage, 1, 2.0), MOST);
    }
}
