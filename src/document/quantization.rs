//! The listing of `KHR_mesh_quantization`, if vertices are stored in ways that only it allows.
//!
//! A level's positions, normals and UVs are floats unless it is compressed, so it needs the extension no
//! more, unless its morph targets or a mesh that stayed do.

use serde_json::Value;

use super::extensions::{require_extension, unlist_extension};

/// The extension.
const NAME: &str = "KHR_mesh_quantization";

/// glTF's numbers of component types.
const UNSIGNED: [u64; 2] = [5121, 5123];
const UNSIGNED_AND_SIGNED: [u64; 4] = [5120, 5121, 5122, 5123];
const FLOAT: u64 = 5126;

/// Requires the extension if a vertex needs it, and takes it from the document's lists if none does.
pub(crate) fn list_if_needed(json: &mut Value) {
    if is_needed(json) {
        require_extension(json, NAME);
    } else {
        unlist_extension(json, NAME);
    }
}

fn is_needed(json: &Value) -> bool {
    let list = |json: &Value, key: &str| json.get(key).and_then(Value::as_array).cloned();
    let meshes = list(json, "meshes").unwrap_or_default();
    let primitives = meshes.iter().filter_map(|mesh| list(mesh, "primitives")).flatten();
    primitives.into_iter().any(|primitive| {
        let targets = list(&primitive, "targets").unwrap_or_default();
        let targets = targets.iter().map(|target| (target, UNSIGNED_AND_SIGNED.as_slice()));
        let attributes = primitive.get("attributes").map(|own| (own, UNSIGNED.as_slice()));
        attributes.into_iter().chain(targets).any(|(attributes, uvs)| {
            attributes.as_object().into_iter().flatten().any(|(name, index)| {
                let index = index.as_u64().unwrap_or(u64::MAX) as usize;
                json["accessors"].get(index).is_some_and(|own| !is_core(name, own, uvs))
            })
        })
    })
}

/// Whether core glTF knows an attribute in this form (glTF 2.0 §3.7.2.1 and §3.7.2.2). `uvs` are the
/// types of normalized integers that UVs may be: also signed ones in a morph target.
fn is_core(name: &str, accessor: &Value, uvs: &[u64]) -> bool {
    let component = accessor.get("componentType").and_then(Value::as_u64).unwrap_or(FLOAT);
    let is_normalized = accessor.get("normalized").and_then(Value::as_bool).unwrap_or(false);
    let is_fraction = is_normalized && uvs.contains(&component);
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
        list_if_needed(&mut json);
        let is_listed = json.get("extensionsUsed").is_some();
        assert_eq!(is_listed, json.get("extensionsRequired").is_some());
        is_listed
    }

    #[test]
    fn it_stays_listed_as_long_as_a_vertex_needs_it() {
        let plain = json!({"POSITION": 0, "TEXCOORD_0": 2, "COLOR_0": 2, "JOINTS_0": 1, "_ID": 1});
        assert!(!is_listed(&plain, &json!([{"POSITION": 0}])));
        assert!(is_listed(&json!({"POSITION": 2}), &json!([])));
        assert!(is_listed(&json!({"POSITION": 0, "TEXCOORD_0": 1}), &json!([])));
        assert!(is_listed(&json!({"POSITION": 0, "NORMAL": 3}), &json!([])));
        assert!(is_listed(&plain, &json!([{"POSITION": 0}, {"POSITION": 3}])));
        assert!(is_listed(&json!({"POSITION": 0, "TEXCOORD_0": 3}), &json!([])));
        assert!(!is_listed(&plain, &json!([{"TEXCOORD_0": 3}])), "moves may be signed");
    }
}
