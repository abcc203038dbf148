//! References to accessors and buffer views from all over a document.

use std::collections::BTreeSet;

use serde_json::{Map, Value};

use super::asset::Asset;
use super::primitive::Primitive;
use crate::error::{Error, Result};

/// The accessors of primitives that are replaced which nothing else in the document refers to.
///
/// # Errors
/// [`Error::Invalid`] if a primitive is malformed or one of them is not there.
pub(crate) fn replaced_accessors(
    asset: &Asset,
    is_replaced: impl Fn(&Primitive) -> bool,
) -> Result<Vec<usize>> {
    let (mut replaced, mut kept) = (BTreeSet::new(), BTreeSet::new());
    for mesh in 0..asset.count("meshes") {
        for primitive in Primitive::of_mesh(asset, mesh)? {
            let used = if is_replaced(&primitive) { &mut replaced } else { &mut kept };
            used.extend(primitive.indices);
            used.extend(primitive.attributes.iter().map(|&(_, accessor)| accessor));
            used.extend(primitive.targets.iter().flatten().map(|&(_, accessor)| accessor));
        }
    }
    for list in ["animations", "skins", "nodes"] {
        collect_accessors(asset.json.get(list).unwrap_or(&Value::Null), &mut kept);
    }
    let replaced: Vec<usize> = replaced.difference(&kept).copied().collect();
    if let Some(own) = replaced.iter().find(|&&own| own >= asset.count("accessors")) {
        return Err(Error::invalid("/meshes", format!("accessor {own} is not there")));
    }
    Ok(replaced)
}

/// Every accessor named in animations, skins and instanced nodes.
pub(crate) fn collect_accessors(json: &Value, found: &mut BTreeSet<usize>) {
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

/// The buffer views of property tables (`EXT_structural_metadata`), each aligned to eight bytes.
pub(crate) fn property_views(json: &Value) -> BTreeSet<usize> {
    let tables = json.pointer("/extensions/EXT_structural_metadata/propertyTables");
    let tables = tables.and_then(Value::as_array).into_iter().flatten();
    let properties = tables.filter_map(|table| table.get("properties")?.as_object());
    let properties = properties.flat_map(Map::values);
    properties
        .flat_map(|own| ["values", "arrayOffsets", "stringOffsets"].map(|key| own.get(key)))
        .filter_map(|view| Some(view?.as_u64()? as usize))
        .collect()
}

/// Every buffer view that the document refers to, by the key that all references to one have but those
/// of property tables.
pub(crate) fn used_views(json: &Value) -> BTreeSet<usize> {
    fn collect(json: &Value, views: &mut BTreeSet<usize>) {
        match json {
            Value::Object(object) => {
                for (key, value) in object {
                    match value.as_u64() {
                        Some(index) if key == "bufferView" => {
                            views.insert(index as usize);
                        }
                        _ => collect(value, views),
                    }
                }
            }
            Value::Array(list) => list.iter().for_each(|value| collect(value, views)),
            _ => {}
        }
    }
    let mut views = property_views(json);
    collect(json, &mut views);
    views
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn views_of_accessors_images_and_property_tables_are_found() {
        let table = json!({"class": "tree", "count": 2, "properties": {
            "height": {"values": 4}, "name": {"values": 5, "stringOffsets": 6}}});
        let json = json!({
            "accessors": [{"bufferView": 0, "sparse": {"indices": {"bufferView": 1}, "values": {"bufferView": 2}}}],
            "images": [{"bufferView": 3}],
            "extensions": {"EXT_structural_metadata": {"propertyTables": [table]}},
        });
        assert_eq!(used_views(&json).into_iter().collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(property_views(&json).into_iter().collect::<Vec<_>>(), [4, 5, 6]);
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
