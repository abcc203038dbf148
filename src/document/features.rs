//! Ids of features on vertices and in textures (`EXT_mesh_features`, `EXT_structural_metadata`).
//!
//! Ids in an attribute are carried like any that the metric does not see: a level's vertex has that of
//! its source vertex, and none is ever blended. Ids that are the numbers of vertices would be lost where
//! these change, so they are made an attribute at reading. Ids in a texture are read by the UVs that the
//! source has, so these must stay.

use gltf::json::accessor::ComponentType;
use serde_json::{Value, json};

use super::asset::Asset;
use super::edit::put;
use super::primitive::Primitive;

/// Name of an attribute of feature ids, before its number.
const ATTRIBUTE: &str = "_FEATURE_ID_";

/// Where a primitive's ids stand among its extensions.
const IDS: &str = "EXT_mesh_features/featureIds";

/// Whether a primitive has ids or properties in textures.
pub(crate) fn has_textures(asset: &Asset, primitive: &Primitive) -> bool {
    let list = |path: &str| {
        let list = asset.json.pointer(&format!("{}/extensions/{path}", primitive.at));
        list.and_then(Value::as_array).into_iter().flatten()
    };
    list(IDS).any(|ids| ids.get("texture").is_some())
        || list("EXT_structural_metadata/propertyTextures").next().is_some()
}

/// Gives triangle primitives whose ids are the numbers of their vertices an attribute that says so. What
/// is malformed is an error where it is used.
pub(crate) fn number_vertices(asset: &mut Asset) {
    let mut numbered: Vec<Numbered> = Vec::new();
    for mesh in 0..asset.count("meshes") {
        let primitives = Primitive::of_mesh(asset, mesh).unwrap_or_default();
        numbered.extend(primitives.iter().filter_map(|own| Numbered::find(asset, own)));
    }
    let Some(most) = numbered.iter().map(|own| own.count).max() else { return };
    let view = add_numbers(asset, most);
    numbered.into_iter().for_each(|own| own.number(&mut asset.json, view));
}

/// A primitive whose ids are the numbers of its vertices.
struct Numbered {
    /// Its JSON pointer.
    at: String,
    /// Places in its list of ids.
    places: Vec<usize>,
    /// The number of the attribute that it gets.
    attribute: usize,
    /// Number of its vertices.
    count: usize,
}

impl Numbered {
    fn find(asset: &Asset, primitive: &Primitive) -> Option<Self> {
        let list = asset.json.pointer(&format!("{}/extensions/{IDS}", primitive.at))?.as_array()?;
        let is_implicit = |own: &Value| {
            own.is_object() && own.get("attribute").is_none() && own.get("texture").is_none()
        };
        let places: Vec<usize> =
            (0..list.len()).filter(|&place| is_implicit(&list[place])).collect();
        let positions = format!("/accessors/{}/count", primitive.accessor("POSITION")?);
        let count = usize::try_from(asset.json.pointer(&positions)?.as_u64()?).ok()?;
        // More vertices than bytes are malformed; beyond 2^24 a float is no whole number.
        let bytes: usize = asset.buffers.iter().map(|own| own.len()).sum();
        let is_sound = primitive.is_surface() && count <= bytes.min(1 << 24);
        let numbers =
            primitive.attributes.iter().filter_map(|(name, _)| name.strip_prefix(ATTRIBUTE));
        let taken = numbers.filter_map(|own| own.parse::<usize>().ok()).max();
        let attribute = taken.map_or(0, |own| own.saturating_add(1));
        let at = primitive.at.clone();
        (is_sound && !places.is_empty()).then_some(Self { at, places, attribute, count })
    }

    fn number(self, json: &mut Value, view: usize) {
        let accessor = json!({
            "bufferView": view, "componentType": ComponentType::F32.as_gl_enum(),
            "count": self.count, "type": "SCALAR",
        });
        let accessor = put(json, "accessors", None, accessor);
        let Some(primitive) = json.pointer_mut(&self.at) else { return };
        primitive["attributes"][format!("{ATTRIBUTE}{}", self.attribute)] = json!(accessor);
        for place in self.places {
            if let Some(own) = primitive.pointer_mut(&format!("/extensions/{IDS}/{place}")) {
                own["attribute"] = json!(self.attribute);
            }
        }
    }
}

/// Adds a view of the numbers from 0, in a buffer of its own.
fn add_numbers(asset: &mut Asset, count: usize) -> usize {
    let bytes: Vec<u8> = (0..count).flat_map(|number| (number as f32).to_le_bytes()).collect();
    let buffer = asset.buffers.len();
    put(&mut asset.json, "buffers", None, json!({"byteLength": bytes.len()}));
    asset.buffers.push(bytes.into());
    let view = json!({"buffer": buffer, "byteLength": 4 * count, "target": 34962});
    put(&mut asset.json, "bufferViews", None, view)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::accessor;

    #[test]
    fn ids_that_are_numbers_of_vertices_become_an_attribute() {
        let ids = json!([{"featureCount": 2, "attribute": 0}, {"featureCount": 3}]);
        let mut asset = Asset {
            json: json!({
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
                "bufferViews": [{"buffer": 0, "byteLength": 36}],
                "buffers": [{"byteLength": 36}],
                "meshes": [{"primitives": [{
                    "attributes": {"POSITION": 0, "_FEATURE_ID_0": 0},
                    "extensions": {"EXT_mesh_features": {"featureIds": ids}},
                }]}],
            }),
            buffers: vec![vec![0; 36].into()],
            ..Asset::default()
        };
        number_vertices(&mut asset);
        let primitive = &asset.json["meshes"][0]["primitives"][0];
        assert_eq!(primitive["extensions"]["EXT_mesh_features"]["featureIds"][1]["attribute"], 1);
        let index = primitive["attributes"]["_FEATURE_ID_1"].as_u64().unwrap() as usize;
        assert_eq!(accessor::read(&asset, index, "").unwrap().floats(), [0.0, 1.0, 2.0]);
        let before = asset.json.clone();
        number_vertices(&mut asset);
        assert_eq!(asset.json, before);
    }
}
