use std::sync::Arc;

use super::*;
use serde_json::json;

/// One triangle over (0,0), (1,0), (0,1) under a node of the given transform.
fn triangle(node: &Value) -> Asset {
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    Asset {
        json: json!({
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"children": [1], "translation": [0, 0, 1]}, node],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3,
                "type": "VEC3"}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
        }),
        buffers: vec![Arc::new(corners.iter().flat_map(|x| x.to_le_bytes()).collect())],
        ..Asset::default()
    }
}

fn scene(node: &Value) -> Result<Scene> {
    load(&triangle(node), &mut TextureCache::default())
}

#[test]
fn nodes_carry_their_parents_transform() {
    let scene = scene(&json!({"mesh": 0, "scale": [2, 2, 2]})).unwrap();
    assert_eq!(scene.positions[1], Vec3::new(2.0, 0.0, 1.0));
    assert_eq!(scene.normals, [Vec3::Z; 3]);
}

#[test]
fn a_mirroring_node_turns_the_winding_back() {
    let scene = scene(&json!({"mesh": 0, "scale": [-1, 1, 1]})).unwrap();
    let [a, b, c] = scene.triangles[0].map(|v| scene.positions[v as usize]);
    assert!((b - a).cross(c - a).dot(scene.normals[0]) > 0.0);
}

#[test]
fn each_instance_of_a_mesh_is_there() {
    let mut asset = triangle(&json!({"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {
        "attributes": {"TRANSLATION": 1, "ROTATION": 2, "SCALE": 1},
    }}}));
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let values = [5.0, 6.0, 7.0, 2.0, 2.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half];
    asset.buffers.push(Arc::new(values.iter().flat_map(|x: &f32| x.to_le_bytes()).collect()));
    for (view, start, length, kind) in [(1, 0, 24, "VEC3"), (2, 24, 32, "VEC4")] {
        let own = json!({"buffer": 1, "byteOffset": start, "byteLength": length});
        asset.json["bufferViews"].as_array_mut().unwrap().push(own);
        let own = json!({"bufferView": view, "componentType": 5126, "count": 2, "type": kind});
        asset.json["accessors"].as_array_mut().unwrap().push(own);
    }
    let scene = load(&asset, &mut TextureCache::default()).unwrap();
    assert_eq!(scene.triangles.len(), 2);
    assert_eq!(scene.positions[1], Vec3::new(10.0, 6.0, 8.0), "scaled by 5, moved by 5");
    let turned = scene.positions[4];
    assert!((turned - Vec3::new(2.0, 4.0, 3.0)).length() < 1e-5, "x becomes y: {turned}");
    asset.json["accessors"][2]["count"] = json!(1);
    assert!(load(&asset, &mut TextureCache::default()).is_err());
}

#[test]
fn assets_of_different_centers_are_in_one_place() {
    let mut near = triangle(&json!({"mesh": 0}));
    near.json["extensions"] = json!({"CESIUM_RTC": {"center": [6.4e6, 0, 0]}});
    let mut far = triangle(&json!({"mesh": 0, "translation": [-0.5, 0, 0]}));
    far.json["extensions"] = json!({"CESIUM_RTC": {"center": [6_400_000.5, 0, 0]}});
    let [near, far] = [near, far].map(|own| load(&own, &mut TextureCache::default()).unwrap());
    assert_eq!(far.counted_from(near.origin).positions, near.positions);
}

#[test]
fn a_specular_glossiness_material_shows_its_diffuse_color() {
    let mut asset = triangle(&json!({"mesh": 0}));
    asset.json["materials"] = json!([
        {"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}, "extensions": {
            "KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0, 0.5, 1, 1]}}},
        {"extensions": {"KHR_materials_pbrSpecularGlossiness": {}}},
    ]);
    let scene = load(&asset, &mut TextureCache::default()).unwrap();
    assert_eq!(scene.materials[0].base_color, Vec4::new(0.0, 0.5, 1.0, 1.0));
    assert_eq!((scene.materials[0].metallic, scene.materials[1].base_color), (0.0, Vec4::ONE));
}

#[test]
fn a_node_below_itself_is_an_error() {
    let error = scene(&json!({"mesh": 0, "children": [0]})).unwrap_err().to_string();
    assert!(error.starts_with("/nodes/0"), "{error}");
}
