//! The meshes of an asset that are one surface.
//!
//! Scans come cut into tiles, a mesh each. Simplified one by one, their borders go apart and the ground
//! shows cracks. So meshes whose borders meet, edge by edge at bitwise equal positions, are simplified as one
//! surface, with one budget. They must stand in the same place for good: each shown once, by nodes of
//! equal world transforms, and nothing moves them.

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};
use seamwise_attr::{Mesh, PointId, border_edges};

use super::edges::{Point, point};
use super::geometry::{Geometry, Part, check_size, is_motion};
use crate::document::asset::Asset;
use crate::document::nodes::world_nodes;
use crate::error::Result;
use crate::limit::MemoryLimit;

/// Every surface of an asset, welded, in the order of their first meshes; none if it has no triangles.
///
/// # Errors
/// [`Error::Invalid`](crate::error::Error::Invalid) if one can't be read, or all take more memory than `limit`.
pub fn weld_all(asset: &Asset, limit: MemoryLimit) -> Result<Vec<Geometry>> {
    check_size(asset, limit)?;
    let meshes = 0..asset.count("meshes");
    let read: Vec<Option<Geometry>> =
        meshes.into_par_iter().map(|mesh| Geometry::read(asset, &[mesh])).collect::<Result<_>>()?;
    let mut alone: Vec<Geometry> = read.into_iter().flatten().collect();
    let several: Vec<Vec<usize>> =
        bordering(&alone, &places(asset)?).into_iter().filter(|meshes| meshes.len() > 1).collect();
    let joined: FxHashSet<usize> = several.iter().flatten().copied().collect();
    alone.retain(|geometry| !joined.contains(&geometry.meshes[0]));
    let read: Vec<Option<Geometry>> =
        several.par_iter().map(|meshes| Geometry::read(asset, meshes)).collect::<Result<_>>()?;
    alone.extend(read.into_iter().flatten());
    alone.sort_by_key(|geometry| geometry.meshes[0]);
    Ok(alone)
}

/// A world transform, to the bit.
type Place = [u64; 16];

/// The places of meshes that are shown once and never move.
fn places(asset: &Asset) -> Result<FxHashMap<usize, Place>> {
    let mut shown: FxHashMap<usize, Option<Place>> = FxHashMap::default();
    if asset.count("animations") > 0 {
        return Ok(FxHashMap::default());
    }
    for (node, world) in world_nodes(asset)? {
        let at = format!("/nodes/{node}");
        if let Some(mesh) = asset.reference(&at, "mesh", "meshes")? {
            let json = &asset.json["nodes"][node];
            let is_plain = json.get("skin").is_none() && json.get("extensions").is_none();
            let place = is_plain.then(|| world.to_cols_array().map(f64::to_bits));
            shown.entry(mesh).and_modify(|place| *place = None).or_insert(place);
        }
    }
    Ok(shown.into_iter().filter_map(|(mesh, place)| Some((mesh, place?))).collect())
}

/// An edge at its place, from one position to the other.
type Border = (Place, [Point; 2]);

/// The meshes of surfaces of one mesh each, together with those that they border on.
fn bordering(alone: &[Geometry], places: &FxHashMap<usize, Place>) -> Vec<Vec<usize>> {
    let borders: Vec<Vec<Border>> = alone
        .par_iter()
        .map(|geometry| match places.get(&geometry.meshes[0]) {
            Some(place) if !geometry.parts.iter().any(moves) => {
                borders(&geometry.welded.mesh, place)
            }
            _ => Vec::new(),
        })
        .collect();
    let mut owners: FxHashMap<Border, usize> = FxHashMap::default();
    for (at, edges) in borders.iter().enumerate() {
        owners.extend(edges.iter().map(|&edge| (edge, at)));
    }
    let across = |(place, [from, to]): Border| owners.get(&(place, [to, from])).copied();
    let mut seen = vec![false; alone.len()];
    let flood = |start: usize| {
        let mut members = Vec::new();
        if !std::mem::replace(&mut seen[start], true) {
            members.push(start);
        }
        let mut next = 0;
        while let Some(&at) = members.get(next) {
            for other in borders[at].iter().copied().filter_map(across) {
                if !std::mem::replace(&mut seen[other], true) {
                    members.push(other);
                }
            }
            next += 1;
        }
        members.sort_unstable();
        members.into_iter().map(|at| alone[at].meshes[0]).collect()
    };
    (0..alone.len()).map(flood).collect()
}

/// Whether a skin or a morph target moves a part.
fn moves(part: &Part) -> bool {
    !part.targets.is_empty() || part.carried.iter().any(|(name, _)| is_motion(name))
}

fn borders(mesh: &Mesh, place: &Place) -> Vec<Border> {
    let ends = |edge: [PointId; 2]| edge.map(|end| point(mesh.positions[end]));
    border_edges(mesh).into_iter().map(|edge| (*place, ends(edge))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    /// Two squares side by side, a mesh each, as `nodes` show them.
    fn tiles(nodes: &Value) -> Asset {
        let mut bytes = Vec::new();
        for x in [0.0f32, 1.0] {
            for corner in [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x + 1.0, 1.0, 0.0], [x, 1.0, 0.0]] {
                bytes.extend(corner.into_iter().flat_map(f32::to_le_bytes));
            }
        }
        let indices = bytes.len();
        bytes.extend([0u8, 1, 2, 0, 2, 3]);
        let primitive = |at: usize| json!({"attributes": {"POSITION": at}, "indices": 2});
        let square = |at: usize| {
            json!({"bufferView": 0, "byteOffset": 48 * at, "componentType": 5126, "count": 4,
                "type": "VEC3"})
        };
        let json = json!({
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": (0..nodes.as_array().map_or(0, Vec::len)).collect::<Vec<_>>()}],
            "nodes": nodes,
            "meshes": [{"primitives": [primitive(0)]}, {"primitives": [primitive(1)]}],
            "accessors": [square(0), square(1),
                {"bufferView": 1, "componentType": 5121, "count": 6, "type": "SCALAR"}],
            "bufferViews": [{"buffer": 0, "byteLength": indices},
                {"buffer": 0, "byteOffset": indices, "byteLength": 6}],
            "buffers": [{"byteLength": bytes.len()}],
        });
        Asset { json, buffers: vec![bytes], ..Asset::default() }
    }

    fn meshes(nodes: &Value) -> Vec<Vec<usize>> {
        let surfaces = weld_all(&tiles(nodes), MemoryLimit::default()).unwrap();
        surfaces.into_iter().map(|geometry| geometry.meshes).collect()
    }

    #[test]
    fn tiles_with_a_common_border_are_one_surface() {
        let nodes =
            json!([{"mesh": 0, "translation": [5, 0, 0]}, {"mesh": 1, "translation": [5, 0, 0]}]);
        let surfaces = weld_all(&tiles(&nodes), MemoryLimit::default()).unwrap();
        assert_eq!(surfaces.len(), 1);
        assert_eq!(surfaces[0].meshes, [0, 1]);
        assert_eq!(surfaces[0].welded.mesh.positions.len(), 6);
        assert_eq!(border_edges(&surfaces[0].welded.mesh).len(), 6);
    }

    #[test]
    fn what_stands_elsewhere_moves_or_is_shown_twice_stays_alone() {
        let elsewhere = json!([{"mesh": 0}, {"mesh": 1, "translation": [5, 0, 0]}]);
        let twice = json!([{"mesh": 0}, {"mesh": 1}, {"mesh": 1}]);
        let skinned = json!([{"mesh": 0}, {"mesh": 1, "skin": 0}]);
        for nodes in [elsewhere, twice, skinned] {
            assert_eq!(meshes(&nodes), [[0], [1]], "{nodes}");
        }
        let mut asset = tiles(&json!([{"mesh": 0}, {"mesh": 1}]));
        asset.json["animations"] = json!([{"channels": []}]);
        assert_eq!(weld_all(&asset, MemoryLimit::default()).unwrap().len(), 2);
    }
}
