//! The meshes of an asset that are one surface.
//!
//! Scans and terrains come cut into tiles, a mesh each. Simplified one by one, their borders go apart and the
//! ground shows cracks. So meshes whose borders meet in the scene, edge by edge, are simplified as one
//! surface, with one budget: at positions that agree bitwise where one place shows both, and otherwise
//! within what roundings, grids and the transforms of nodes explain (see `stitch.rs` of `seamwise_attr`).
//! They must stand in the same place for good: each shown once, by nodes whose world transforms differ by a
//! move, a turn and a scale at most, and nothing moves them.

use glam::{DMat4, DVec3};
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};
use seamwise_attr::{
    BorderEdge, DisjointSets, Mesh, PointId, Precision, border_edges, placed_borders,
    stitched_edges,
};

use super::edges::{Point, point};
use super::frame::Similarity;
use super::geometry::{Geometry, check_size};
use super::part::{Member, Part, is_motion};
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
    let read =
        |mesh: usize| Geometry::read_members(asset, &[Member { mesh, frame: None, slack: 0.0 }]);
    let meshes = 0..asset.count("meshes");
    let read: Vec<Option<Geometry>> = meshes.into_par_iter().map(read).collect::<Result<_>>()?;
    let mut alone: Vec<Geometry> = read.into_iter().flatten().collect();
    let worlds = places(asset)?;
    let several = bordering(&alone, &worlds);
    let members: Vec<Vec<Member>> =
        several.iter().map(|meshes| members(&alone, meshes, &worlds)).collect();
    let joined: FxHashSet<usize> = members.iter().flatten().map(|member| member.mesh).collect();
    alone.retain(|geometry| !joined.contains(&geometry.meshes[0]));
    let read = members.par_iter().map(|members| Geometry::read_members(asset, members));
    let read: Vec<Option<Geometry>> = read.collect::<Result<_>>()?;
    alone.extend(read.into_iter().flatten());
    alone.sort_by_key(|geometry| geometry.meshes[0]);
    Ok(alone)
}

/// The world transforms of meshes that are shown once and never move.
fn places(asset: &Asset) -> Result<FxHashMap<usize, DMat4>> {
    let mut shown: FxHashMap<usize, Option<DMat4>> = FxHashMap::default();
    if asset.count("animations") > 0 {
        return Ok(FxHashMap::default());
    }
    for (node, world) in world_nodes(asset)? {
        let at = format!("/nodes/{node}");
        if let Some(mesh) = asset.reference(&at, "mesh", "meshes")? {
            let json = &asset.json["nodes"][node];
            let is_plain = json.get("skin").is_none() && json.get("extensions").is_none();
            let place = (is_plain && world.is_finite()).then_some(world);
            shown.entry(mesh).and_modify(|place| *place = None).or_insert(place);
        }
    }
    Ok(shown.into_iter().filter_map(|(mesh, place)| Some((mesh, place?))).collect())
}

/// A world transform, to the bit.
type Place = [u64; 16];

fn bits(world: &DMat4) -> Place {
    world.to_cols_array().map(f64::to_bits)
}

/// The members of a surface, in the space of the first. One that is like its neighbors but not like the first
/// is none.
fn members(alone: &[Geometry], meshes: &[usize], worlds: &FxHashMap<usize, DMat4>) -> Vec<Member> {
    let first = worlds[&meshes[0]];
    let member = |&mesh: &usize| {
        let world = worlds[&mesh];
        let own = alone.iter().find(|geometry| geometry.meshes[0] == mesh);
        let is_same = bits(&world) == bits(&first);
        let frame = if is_same { None } else { Some(Similarity::between(&world, &first)?) };
        let there = own.map_or(0.0, |own| extent(&own.welded.mesh, &world));
        let unit = first.determinant().abs().cbrt();
        let slack = if frame.is_some() { BorderEdge::rounding_of(there) / unit } else { 0.0 };
        Some(Member { mesh, frame, slack })
    };
    meshes.iter().filter_map(member).collect()
}

/// The largest coordinate of a mesh in the world.
fn extent(mesh: &Mesh, world: &DMat4) -> f64 {
    let there = mesh.positions.iter().map(|p| world.transform_point3(p.as_dvec3()));
    there.map(|p| p.abs().max_element()).fold(0.0, f64::max)
}

/// An edge at its place, from one position to the other.
type Border = (Place, [Point; 2]);

/// The meshes of surfaces of one mesh each, those together that border on one another; none that stay alone.
fn bordering(alone: &[Geometry], worlds: &FxHashMap<usize, DMat4>) -> Vec<Vec<usize>> {
    let world = |geometry: &Geometry| {
        let world = worlds.get(&geometry.meshes[0])?;
        (!geometry.parts.iter().any(moves)).then_some(*world)
    };
    let placed: Vec<Option<DMat4>> = alone.iter().map(world).collect();
    if placed.iter().flatten().count() < 2 {
        return Vec::new();
    }
    let borders: Vec<Vec<Border>> = alone
        .par_iter()
        .zip(&placed)
        .map(|(own, world)| world.map_or_else(Vec::new, |world| borders(own, &bits(&world))))
        .collect();
    let mut owners: FxHashMap<Border, u32> = FxHashMap::default();
    for (at, edges) in (0..).zip(&borders) {
        owners.extend(edges.iter().map(|&edge| (edge, at)));
    }
    let mut sets = DisjointSets::new(alone.len());
    let across = |&(place, [from, to]): &Border| owners.get(&(place, [to, from])).copied();
    for (at, edges) in (0..).zip(&borders) {
        edges.iter().filter_map(across).for_each(|other| _ = sets.join(at, other));
    }
    let is_met = |at: usize, edge: &BorderEdge| {
        let place = placed[at].as_ref().map(bits);
        let ends = edge.points.map(|end| point(alone[at].welded.mesh.positions[end]));
        place.is_some_and(|place| across(&(place, ends)).is_some_and(|other| other as usize != at))
    };
    join_across(alone, &placed, &is_met, &mut sets);
    let mut together: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
    for (at, geometry) in (0..).zip(alone) {
        together.entry(sets.root(at)).or_default().push(geometry.meshes[0]);
    }
    let mut several: Vec<Vec<usize>> =
        together.into_values().filter(|meshes| meshes.len() > 1).collect();
    several.iter_mut().for_each(|meshes| meshes.sort_unstable());
    several.sort_unstable();
    several
}

/// Joins meshes whose borders meet in the world but not bitwise. Edges that are met bitwise do not ask.
fn join_across(
    alone: &[Geometry],
    placed: &[Option<DMat4>],
    is_met: &(impl Fn(usize, &BorderEdge) -> bool + Sync),
    sets: &mut DisjointSets,
) {
    let edges = (0..alone.len()).into_par_iter().flat_map_iter(|at| {
        let edges = placed[at].map_or_else(Vec::new, |world| {
            let mut edges = placed_borders(&alone[at].welded.mesh, &alone[at].precision);
            edges.retain(|edge| !is_met(at, edge));
            in_world(&mut edges, &world, at as u32 + 1);
            edges
        });
        edges.into_iter()
    });
    let edges: Vec<BorderEdge> = edges.collect();
    for [a, b] in stitched_edges(&edges) {
        let [a, b] = [a, b].map(|edge| edges[edge].apart - 1);
        let [Some(own), Some(other)] = [a, b].map(|at| placed[at as usize]) else { continue };
        if bits(&own) == bits(&other) || Similarity::between(&own, &other).is_some() {
            sets.join(a, b);
        }
    }
}

/// Brings the borders of a mesh, number `own`, to where they are shown.
fn in_world(edges: &mut [BorderEdge], world: &DMat4, own: u32) {
    let columns = [world.x_axis, world.y_axis, world.z_axis].map(|axis| axis.truncate().length());
    let stretch = columns.into_iter().fold(0.0, f64::max);
    for edge in edges.iter_mut() {
        edge.ends = edge.ends.map(|end| world.transform_point3(end));
        edge.third = world.transform_point3(edge.third);
    }
    let largest = |edge: &BorderEdge| edge.ends.map(|end: DVec3| end.abs().max_element());
    let largest = edges.iter().flat_map(largest).fold(0.0, f64::max);
    for edge in edges {
        edge.rounding = edge.rounding * stretch + BorderEdge::rounding_of(largest);
        edge.precision = Precision { grid: own, slack: edge.precision.slack * stretch };
        edge.apart = own;
    }
}

/// Whether a skin or a morph target moves a part.
fn moves(part: &Part) -> bool {
    !part.targets.is_empty() || part.carried.iter().any(|(name, _)| is_motion(name))
}

fn borders(geometry: &Geometry, place: &Place) -> Vec<Border> {
    let mesh = &geometry.welded.mesh;
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
        Asset { json, buffers: vec![bytes.into()], ..Asset::default() }
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
