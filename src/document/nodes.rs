//! The world transforms of a document's nodes.

use glam::{DMat4, DQuat, DVec3, Mat4};
use gltf::json;
use nalgebra::{Matrix3, Vector3};
use rustc_hash::FxHashMap;
use serde_json::Value;

use super::asset::Asset;
use super::instances::instances;
use crate::error::{Error, Result};

/// The nodes of the default scene with their world transforms.
pub(crate) fn world_nodes(asset: &Asset) -> Result<Vec<(usize, DMat4)>> {
    let roots: Vec<usize> = match asset.reference("", "scene", "scenes")? {
        Some(scene) => references(asset, &format!("/scenes/{scene}/nodes"))?,
        None if asset.count("scenes") > 0 => references(asset, "/scenes/0/nodes")?,
        None => {
            let mut is_child = vec![false; asset.count("nodes")];
            for node in 0..is_child.len() {
                for child in references(asset, &format!("/nodes/{node}/children"))? {
                    is_child[child] = true;
                }
            }
            (0..is_child.len()).filter(|&node| !is_child[node]).collect()
        }
    };
    let mut seen = vec![false; asset.count("nodes")];
    let mut stack: Vec<(usize, DMat4)> =
        roots.into_iter().rev().map(|root| (root, DMat4::IDENTITY)).collect();
    let mut nodes = Vec::new();
    while let Some((node, parent)) = stack.pop() {
        let at = format!("/nodes/{node}");
        if std::mem::replace(&mut seen[node], true) {
            return Err(Error::invalid(at, "it is reached twice: nodes must form a tree"));
        }
        let world = parent * local_transform(asset, &at)?;
        let children = references(asset, &format!("{at}/children"))?;
        stack.extend(children.into_iter().rev().map(|child| (child, world)));
        nodes.push((node, world));
    }
    Ok(nodes)
}

/// World transforms by mesh, one for each node that shows it and each of the node's instances. A
/// skinned mesh is where its vertices are: its node does not move it.
pub(crate) fn mesh_worlds(asset: &Asset) -> Result<FxHashMap<usize, Vec<DMat4>>> {
    let mut worlds: FxHashMap<usize, Vec<DMat4>> = FxHashMap::default();
    for (node, world) in world_nodes(asset)? {
        let at = format!("/nodes/{node}");
        if let Some(mesh) = asset.reference(&at, "mesh", "meshes")? {
            let is_skinned = asset.reference(&at, "skin", "skins")?.is_some();
            let world = if is_skinned { DMat4::IDENTITY } else { world };
            let shown = instances(asset, &at)?.into_iter().map(|instance| world * instance);
            worlds.entry(mesh).or_default().extend(shown);
        }
    }
    Ok(worlds)
}

/// A list of node indices, empty if there is none.
fn references(asset: &Asset, at: &str) -> Result<Vec<usize>> {
    let count = asset.json.pointer(at).and_then(Value::as_array).map_or(0, Vec::len);
    (0..count)
        .map(|entry| asset.reference(at, &entry.to_string(), "nodes"))
        .filter_map(Result::transpose)
        .collect()
}

/// The transform of a node in its parent.
pub(crate) fn local_transform(asset: &Asset, at: &str) -> Result<DMat4> {
    let node: json::Node = asset.parse(at)?;
    if let Some(matrix) = node.matrix {
        return Ok(Mat4::from_cols_array(&matrix).as_dmat4());
    }
    let vector = |v: Option<[f32; 3]>, default: DVec3| {
        v.map_or(default, |v| DVec3::from_array(v.map(f64::from)))
    };
    let rotation = node
        .rotation
        .map_or(DQuat::IDENTITY, |q| DQuat::from_array(q.0.map(f64::from)).normalize());
    let rotation = if rotation.is_finite() { rotation } else { DQuat::IDENTITY };
    let (scale, translation) =
        (vector(node.scale, DVec3::ONE), vector(node.translation, DVec3::ZERO));
    Ok(DMat4::from_scale_rotation_translation(scale, rotation, translation))
}

/// The largest singular value of the linear parts of transforms; 1 if none has a size.
pub(crate) fn largest_stretch(worlds: &[DMat4]) -> f64 {
    stretches(worlds).into_iter().fold(0.0, f64::max)
}

/// The largest singular value of the linear part of each transform that has a size; 1 if none has.
pub(crate) fn stretches(worlds: &[DMat4]) -> Vec<f64> {
    let stretch = |world: &DMat4| {
        let columns = [world.x_axis, world.y_axis, world.z_axis];
        let linear = Matrix3::from_columns(&columns.map(|c| Vector3::new(c.x, c.y, c.z)));
        linear.singular_values().max()
    };
    let has_size = |stretch: &f64| *stretch > 0.0 && stretch.is_finite();
    let sized: Vec<f64> = worlds.iter().map(stretch).filter(has_size).collect();
    if sized.is_empty() { vec![1.0] } else { sized }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn the_largest_stretch_is_along_the_longest_axis_of_any_node() {
        let turn = DMat4::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        let scaled = |scale: DVec3| turn * DMat4::from_scale(scale) * turn;
        let worlds = [scaled(DVec3::new(2.0, -5.0, 1.0)), scaled(DVec3::splat(3.0))];
        assert!((largest_stretch(&worlds) - 5.0).abs() < 1e-12);
        assert_eq!(largest_stretch(&[DMat4::from_scale(DVec3::ZERO)]), 1.0);
    }
}
