//! Targets of animation channels: properties of nodes by number, or any property by its pointer
//! (`KHR_animation_pointer`).

use serde_json::{Value, json};

/// The name of morph weights in targets and pointers.
const WEIGHTS: &str = "weights";

/// The channels of each animation.
pub(crate) fn channels(json: &mut Value) -> impl Iterator<Item = &mut Vec<Value>> {
    let animations = json.get_mut("animations").and_then(Value::as_array_mut);
    animations.into_iter().flatten().filter_map(|a| a.get_mut("channels")?.as_array_mut())
}

/// Whether a channel changes anything of a node but its morph weights.
pub(crate) fn moves(channel: &Value, node: usize) -> bool {
    let target = &channel["target"];
    let by_number = target["node"] == json!(node) && target["path"] != WEIGHTS;
    by_number || property(target, "nodes", node).is_some_and(|property| !is_weights(property))
}

/// Whether a channel changes the morph weights of an object of `list`: `nodes` or `meshes`.
pub(crate) fn sets_weights(channel: &Value, list: &str, index: usize) -> bool {
    let target = &channel["target"];
    let by_number = list == "nodes" && target["node"] == json!(index) && target["path"] == WEIGHTS;
    by_number || property(target, list, index).is_some_and(is_weights)
}

/// Lets a channel that changes something of an object change the same of another in its list.
pub(crate) fn retarget(channel: &mut Value, to: usize) {
    let target = &mut channel["target"];
    if target.get("node").is_some() {
        target["node"] = json!(to);
    } else if let Some(pointer) = target.pointer_mut(POINTER) {
        let mut parts: Vec<String> =
            pointer.as_str().unwrap_or_default().split('/').map(str::to_owned).collect();
        if let Some(index) = parts.get_mut(2) {
            *index = to.to_string();
        }
        *pointer = json!(parts.join("/"));
    }
}

const POINTER: &str = "/extensions/KHR_animation_pointer/pointer";

/// The property that a target's pointer names, as a path in an object of `list`; `None` if it names
/// nothing of that object.
fn property<'a>(target: &'a Value, list: &str, index: usize) -> Option<&'a str> {
    let pointer = target.pointer(POINTER)?.as_str()?;
    pointer.strip_prefix(&format!("/{list}/{index}/"))
}

/// Whether a property is all morph weights or one of them.
fn is_weights(property: &str) -> bool {
    property == WEIGHTS || property.starts_with("weights/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pointer(pointer: &str) -> Value {
        let extension = json!({"KHR_animation_pointer": {"pointer": pointer}});
        json!({"target": {"path": "pointer", "extensions": extension}})
    }

    #[test]
    fn a_pointer_is_understood_as_a_number_is() {
        let number = |path: &str| json!({"target": {"node": 3, "path": path}});
        for (channel, is_moved, has_weights) in [
            (number("translation"), true, false),
            (number("weights"), false, true),
            (pointer("/nodes/3/translation"), true, false),
            (pointer("/nodes/3/extensions/KHR_node_visibility/visible"), true, false),
            (pointer("/nodes/3/weights"), false, true),
            (pointer("/nodes/3/weights/1"), false, true),
            (pointer("/nodes/31/translation"), false, false),
            (pointer("/materials/3/alphaCutoff"), false, false),
            (pointer("/meshes/3/weights"), false, false),
        ] {
            let own = (moves(&channel, 3), sets_weights(&channel, "nodes", 3));
            assert_eq!(own, (is_moved, has_weights), "{channel}");
        }
        assert!(sets_weights(&pointer("/meshes/3/weights/0"), "meshes", 3));
    }

    #[test]
    fn a_target_moves_on_to_another_object_of_its_list() {
        for (mut channel, expected) in [
            (pointer("/nodes/3/weights/1"), pointer("/nodes/12/weights/1")),
            (
                json!({"target": {"node": 3, "path": "weights"}}),
                json!({"target": {"node": 12, "path": "weights"}}),
            ),
        ] {
            retarget(&mut channel, 12);
            assert_eq!(channel, expected);
        }
    }
}
