//! Whether vertices are stored in ways that only `KHR_mesh_quantization` allows.
//!
//! A level's positions, normals and UVs are floats, so it needs the extension no more, unless its
//! morph targets or a mesh that stayed do.

use serde_json::Value;

use crate::extensions::unlist_extension;

/// The extension.
const NAME: &str = "KHR_mesh_quantization";

/// glTF's numbers of component types.
const UNSIGNED: [u64; 2] = [5121, 5123];
const FLOAT: u64 = 5126;

/// Takes the extension from the document's lists if no vertex needs it.
pub(crate) fn unlist_if_unneeded(json: &mut Value) {
    if !is_needed(json) {
        unlist_extension(json, NAME);
    }
}

fn is_needed(json: &Value) -> bool {
    let list = |json: &Value, key: &str| json.get(key).and_then(Value::as_array).cloned();
    let meshes = list(json, "meshes").unwrap_or_default();
    let primitives = meshes.iter().filter_map(|mesh| list(mesh, "primitives")).flatten();
    primitives.into_iter().any(|primitive| {
        let attributes = primitive.get("attributes").into_iter();
        let targets = list(&primitive, "targets").unwrap_or_default();
        attributes.chain(&targets).filter_map(Value::as_object).flatten().any(|(name, index)| {
            let index = index.as_u64().unwrap_or(u64::MAX) as usize;
            json["accessors"].get(index).is_some_and(|accessor| !is_core(name, accessor))
        })
    })
}

/// Whether core glTF knows an attribute in this form (glTF 2.0 §3.7.2.1 and §3.7.2.2). Signed UVs
/// of a morph target count as not known, which only lists the extension once too often.
fn is_core(name: &str, accessor: &Value) -> bool {
    let component = accessor.get("componentType").and_then(Value::as_u64).unwrap_or(FLOAT);
    let is_normalized = accessor.get("normalized").and_then(Value::as_bool).unwrap_or(false);
    let is_fraction = is_normalized && UNSIGNED.contains(&component);
    match name {
        "POSITION" | "NORMAL" | "TANGENT" => component == FLOAT,
        _ if name.starts_with("TEXCOORD_") => component == FLOAT || is_fraction,
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn is_listed(attributes: &Value, targets: &Value) -> bool {
        let mut json = json!({
            "extensionsUsed": [NAME],
            "accessors": [
                {"componentType": 5126}, {"componentType": 5123},
                {"componentType": 5123, "normalized": true}, {"componentType": 5120, "normalized": true},
            ],
            "meshes": [{"primitives": [{"attributes": attributes, "targets": targets}]}],
        });
        unlist_if_unneeded(&mut json);
        json.get("extensionsUsed").is_some()
    }

    #[test]
    fn it_stays_listed_as_long_as_a_vertex_needs_it() {
        let plain = json!({"POSITION": 0, "TEXCOORD_0": 2, "COLOR_0": 2, "JOINTS_0": 1, "_ID": 1});
        assert!(!is_listed(&plain, &json!([{"POSITION": 0}])));
        assert!(is_listed(&json!({"POSITION": 2}), &json!([])));
        assert!(is_listed(&json!({"POSITION": 0, "TEXCOORD_0": 1}), &json!([])));
        assert!(is_listed(&json!({"POSITION": 0, "NORMAL": 3}), &json!([])));
        assert!(is_listed(&plain, &json!([{"POSITION": 0}, {"POSITION": 3}])));
    }
}
