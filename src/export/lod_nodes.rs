//! Nodes for the levels of a node's mesh, beside it in one document.
//!
//! A level may bring a [`Grid`]: its positions are integers, and the node that shows it stands for a
//! scale and a move besides its own. These go to a child of their own, so that whatever moves the node
//! still does.

use serde_json::{Map, Value, json};

use crate::document::animation::{channels, moves, retarget, sets_weights};
use crate::document::extensions::remove_extension;
use crate::error::{Error, Result};
use crate::level::quantize::Grid;

/// The layout of levels in the file of all of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// Each node names a node for each level, in `MSFT_lod`; only readers of that extension show them.
    MsftLod,
    /// Each node holds the source and its levels as children called `<name>_LOD0` and so on, as scripts
    /// and pipelines of game engines look for them. Readers of glTF show all of them at once.
    Names,
    /// The coarsest level, which names finer ones of each mesh and larger sizes of each texture in files of
    /// their own, in `NEEDLE_progressive`; a loader of that fetches them where they are seen.
    Needle,
    /// No file of all levels: each is a file of its own, which is what most programs can use.
    #[default]
    None,
}

/// The mesh and grid of a level, for the node that shows it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Shown {
    /// The mesh; none if the level has no triangle left of it.
    pub(crate) mesh: Option<usize>,
    /// The grid of its positions, if they are integers.
    pub(crate) grid: Option<Grid>,
}

/// Adds a node for each level of the mesh that a node shows, and returns the node of the source: the
/// node itself or a child of it.
pub(crate) fn add_levels(
    json: &mut Value,
    node: usize,
    levels: &[Shown],
    layout: Layout,
) -> Result<usize> {
    match layout {
        Layout::None | Layout::Needle => Ok(node),
        Layout::MsftLod => link_levels(json, node, levels),
        Layout::Names => group_levels(json, node, levels),
    }
}

/// Names the levels in the `MSFT_lod` of the node that shows the mesh.
///
/// Levels replace their node as a whole, its children and what moves it too. So where a node has
/// children or is moved by an animation, its mesh first goes to a child of its own, together with
/// what belongs to the mesh.
fn link_levels(json: &mut Value, node: usize, levels: &[Shown]) -> Result<usize> {
    let stays = json["nodes"][node].get("children").is_none() && !is_moved(json, node);
    let node = if stays {
        node
    } else {
        let name = name_of(json, node).map(|name| format!("{name}_mesh"));
        hoist_mesh(json, node, name)?
    };
    let mut ids = Vec::with_capacity(levels.len());
    for (level, shown) in levels.iter().enumerate() {
        let mut copy = json["nodes"][node].clone();
        remove_extension(&mut copy, "MSFT_lod");
        add_suffix(&mut copy, level + 1);
        ids.push(add_level(json, copy, *shown)?);
    }
    animate_levels(json, ("nodes", node), &ids);
    json["nodes"][node]["extensions"]["MSFT_lod"] = json!({"ids": ids});
    Ok(node)
}

/// Makes the node a group of the source and its levels.
fn group_levels(json: &mut Value, node: usize, levels: &[Shown]) -> Result<usize> {
    let mesh = json["nodes"][node]["mesh"].as_u64().unwrap_or_default();
    let mesh = json["meshes"][mesh as usize].get("name").and_then(Value::as_str);
    let name = name_of(json, node).or_else(|| mesh.map(str::to_owned));
    let name = name.unwrap_or_else(|| format!("node{node}"));
    let finest = hoist_mesh(json, node, Some(format!("{name}_LOD0")))?;
    let mut ids = Vec::with_capacity(levels.len());
    for (level, shown) in levels.iter().enumerate() {
        let mut copy = json["nodes"][finest].clone();
        copy["name"] = json!(format!("{name}_LOD{}", level + 1));
        let id = add_level(json, copy, *shown)?;
        add_child(json, node, id);
        ids.push(id);
    }
    animate_levels(json, ("nodes", finest), &ids);
    Ok(finest)
}

/// Adds a node that shows a level.
fn add_level(json: &mut Value, mut node: Value, shown: Shown) -> Result<usize> {
    match (shown.mesh, node.as_object_mut()) {
        (None, Some(node)) => drop(node.shift_remove("mesh")),
        (mesh, _) => node["mesh"] = json!(mesh),
    }
    let id = push(json, "nodes", node)?;
    if let (Some(grid), Some(_)) = (shown.grid, shown.mesh) {
        place_on_grid(json, id, grid)?;
    }
    Ok(id)
}

/// Puts a node's mesh where its integers stand for what they should.
pub(crate) fn place_on_grid(json: &mut Value, node: usize, grid: Grid) -> Result<()> {
    let child = hoist_mesh(json, node, None)?;
    json["nodes"][child]["translation"] = json!(grid.low);
    json["nodes"][child]["scale"] = json!([grid.step, grid.step, grid.step]);
    Ok(())
}

/// Moves a node's mesh, skin, morph weights and instances to a new child; animations of the weights
/// follow.
fn hoist_mesh(json: &mut Value, node: usize, name: Option<String>) -> Result<usize> {
    let mut child = Map::new();
    child.extend(name.map(|name| ("name".to_owned(), json!(name))));
    let parent = &mut json["nodes"][node];
    let mut extensions = Map::new();
    for name in OF_INSTANCES {
        extensions.extend(remove_extension(parent, name).map(|own| (name.to_owned(), own)));
    }
    let parent = parent
        .as_object_mut()
        .ok_or_else(|| Error::invalid(format!("/nodes/{node}"), "not an object"))?;
    for key in ["mesh", "skin", "weights"] {
        child.extend(parent.shift_remove(key).map(|value| (key.to_owned(), value)));
    }
    if !extensions.is_empty() {
        child.insert("extensions".into(), Value::Object(extensions));
    }
    let child = push(json, "nodes", Value::Object(child))?;
    add_child(json, node, child);
    for channel in channels(json).flatten().filter(|own| sets_weights(own, "nodes", node)) {
        retarget(channel, child);
    }
    Ok(child)
}

/// Extensions of a node that belong to its mesh.
const OF_INSTANCES: [&str; 2] = ["EXT_mesh_gpu_instancing", "EXT_instance_features"];

/// Lets the levels of an object follow the animations of its morph weights. The object is in `list`,
/// `nodes` or `meshes`, and so are they.
pub(crate) fn animate_levels(json: &mut Value, (list, object): (&str, usize), levels: &[usize]) {
    for channels in channels(json) {
        let own: Vec<Value> =
            channels.iter().filter(|own| sets_weights(own, list, object)).cloned().collect();
        for (mut channel, level) in
            own.iter().cloned().flat_map(|c| levels.iter().map(move |&l| (c.clone(), l)))
        {
            retarget(&mut channel, level);
            channels.push(channel);
        }
    }
}

/// Whether an animation moves a node; that of its morph weights does not.
fn is_moved(json: &mut Value, node: usize) -> bool {
    channels(json).flatten().any(|channel| moves(channel, node))
}

fn name_of(json: &Value, node: usize) -> Option<String> {
    json["nodes"][node].get("name").and_then(Value::as_str).map(str::to_owned)
}

fn add_child(json: &mut Value, node: usize, child: usize) {
    let children = &mut json["nodes"][node]["children"];
    match children.as_array_mut() {
        Some(children) => children.push(json!(child)),
        None => *children = json!([child]),
    }
}

/// Marks the name of a level's object.
pub(crate) fn add_suffix(json: &mut Value, level: usize) {
    if let Some(name) = json.get("name").and_then(Value::as_str) {
        json["name"] = json!(format!("{name}_lod{level}"));
    }
}

/// Appends an object to a list of the document.
pub(crate) fn push(json: &mut Value, list: &str, object: Value) -> Result<usize> {
    let list = json[list]
        .as_array_mut()
        .ok_or_else(|| Error::invalid(format!("/{list}"), "not a list"))?;
    list.push(object);
    Ok(list.len() - 1)
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

    fn meshes(indices: &[usize]) -> Vec<Shown> {
        indices.iter().map(|&mesh| Shown { mesh: Some(mesh), grid: None }).collect()
    }

    #[test]
    fn a_leaf_names_a_node_for_each_level() {
        let mut json = document();
        add_levels(&mut json, 1, &meshes(&[7, 8]), Layout::MsftLod).unwrap();
        assert_eq!(json["nodes"][1]["extensions"]["MSFT_lod"]["ids"], json!([2, 3]));
        assert_eq!(json["nodes"][3], json!({"name": "hand_lod2", "mesh": 8}));
    }

    #[test]
    fn a_node_with_children_hands_its_mesh_to_a_child_so_that_they_stay() {
        let mut json = document();
        add_levels(&mut json, 0, &meshes(&[7]), Layout::MsftLod).unwrap();
        let nodes = &json["nodes"];
        assert_eq!(nodes[0]["children"], json!([1, 2]));
        assert!(nodes[0].get("mesh").is_none() && nodes[0].get("rotation").is_some());
        assert_eq!((&nodes[2]["mesh"], &nodes[2]["weights"]), (&json!(0), &json!([0.5])));
        assert_eq!(nodes[2]["extensions"]["MSFT_lod"]["ids"], json!([3]));
        let nodes: Vec<&Value> = json["animations"][0]["channels"]
            .as_array()
            .unwrap()
            .iter()
            .map(|channel| &channel["target"]["node"])
            .collect();
        assert_eq!(nodes, [&json!(2), &json!(0), &json!(3)], "weights follow, for the level too");
    }

    #[test]
    fn a_node_that_an_animation_moves_hands_its_mesh_to_a_child_so_that_levels_move() {
        let mut json = document();
        json["animations"][0]["channels"][1]["target"]["node"] = json!(1);
        let linked = add_levels(&mut json, 1, &meshes(&[7]), Layout::MsftLod).unwrap();
        assert_eq!((linked, &json["nodes"][1]["children"]), (2, &json!([2])));
    }

    #[test]
    fn an_animation_by_pointers_moves_levels_as_one_by_numbers_does() {
        let mut json = document();
        let by = |pointer: &str| {
            json!({"target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {
                "pointer": pointer}}}})
        };
        json["nodes"][1]["extensions"] = json!({"KHR_node_visibility": {"visible": false}});
        json["animations"] = json!([{"channels": [
            by("/nodes/1/extensions/KHR_node_visibility/visible"), by("/nodes/1/weights/0"),
        ]}]);
        let linked = add_levels(&mut json, 1, &meshes(&[7]), Layout::MsftLod).unwrap();
        assert_eq!((linked, &json["nodes"][1]["children"]), (2, &json!([2])));
        assert!(json["nodes"][1]["extensions"].get("KHR_node_visibility").is_some());
        let channels = json["animations"][0]["channels"].as_array().unwrap();
        let expected = [
            by("/nodes/1/extensions/KHR_node_visibility/visible"),
            by("/nodes/2/weights/0"),
            by("/nodes/3/weights/0"),
        ];
        assert_eq!(channels[..], expected);
    }

    #[test]
    fn engines_find_levels_by_the_names_of_siblings() {
        let mut json = document();
        json["meshes"] = json!([{"name": "arms"}]);
        add_levels(&mut json, 0, &meshes(&[7, 8]), Layout::Names).unwrap();
        let nodes = &json["nodes"];
        assert_eq!(nodes[0]["children"], json!([1, 2, 3, 4]));
        assert_eq!(nodes[0]["name"], "arm");
        assert!(nodes[0].get("mesh").is_none());
        assert_eq!(nodes[2], json!({"name": "arm_LOD0", "mesh": 0, "weights": [0.5]}));
        assert_eq!(nodes[4], json!({"name": "arm_LOD2", "mesh": 8, "weights": [0.5]}));
        json["nodes"][1] = json!({"mesh": 0});
        add_levels(&mut json, 1, &[Shown::default()], Layout::Names).unwrap();
        assert_eq!(
            json["nodes"][6],
            json!({"name": "arms_LOD1"}),
            "nothing left, named as the mesh"
        );
    }

    #[test]
    fn integers_are_scaled_and_moved_by_a_child() {
        let mut json = document();
        let grid = Some(Grid { low: [1.0, 2.0, 3.0], step: 0.5 });
        add_levels(&mut json, 1, &[Shown { mesh: Some(7), grid }], Layout::MsftLod).unwrap();
        assert_eq!(json["nodes"][2], json!({"name": "hand_lod1", "children": [3]}));
        assert_eq!(
            json["nodes"][3],
            json!({"mesh": 7, "translation": [1.0, 2.0, 3.0], "scale": [0.5, 0.5, 0.5]})
        );
    }
}
