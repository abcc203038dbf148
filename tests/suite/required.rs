//! Extensions that a document requires and that say nothing of what a bake changes: they come through.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::common::assets::{picture, textured};
use crate::common::build::Build;
use crate::common::output::Output;
use crate::common::shapes::{Shape, patch, sphere};
use crate::common::{Baked, measured, unmeasured};
use seamwise::bake::options::{BakeOptions, Targets};
use seamwise::import::options::ReadOptions;

/// A textured ball that requires an extension.
fn requiring(name: &str) -> Build {
    let mut build = textured(&sphere(24, 16), &picture(16));
    build.json["extensionsUsed"] = json!([name]);
    build.json["extensionsRequired"] = json!([name]);
    build
}

fn options(ratio: f64) -> BakeOptions {
    BakeOptions { targets: Targets::ratios(vec![ratio]).expect("a ratio"), ..unmeasured() }
}

#[test]
fn what_does_not_touch_geometry_comes_through_as_it_is() {
    for (name, pointer, own) in [
        ("KHR_node_visibility", "/nodes/0/extensions", json!({"visible": false})),
        ("CESIUM_RTC", "/extensions", json!({"center": [6_378_137.25, -4.5, 1.0e6]})),
        ("KHR_xmp_json_ld", "/extensions", json!({"packets": [{"dc:title": "ball"}]})),
        ("KHR_lights_punctual", "/extensions", json!({"lights": [{"type": "point"}]})),
        ("KHR_materials_clearcoat", "/materials/0/extensions", json!({"clearcoatFactor": 1.0})),
    ] {
        let mut build = requiring(name);
        let (parent, key) = pointer.rsplit_once('/').expect("a key");
        let parent = build.json.pointer_mut(parent).expect("an object");
        parent[key] = json!({name: own});
        let baked = Baked::bytes(name, &build.glb(), &options(0.25));
        assert!(baked.report.warnings.is_empty(), "{name}");
        for output in [baked.level(1), baked.chain()] {
            let kept = output.json.pointer(pointer).and_then(|kept| kept.get(name));
            assert_eq!(kept, Some(&own), "{name}");
            let required = output.json["extensionsRequired"].as_array().expect("a list");
            assert!(required.contains(&json!(name)), "{name}");
        }
    }
}

#[test]
fn distances_around_a_far_center_are_those_of_the_same_ball_at_the_origin() {
    let mut far = requiring("CESIUM_RTC");
    far.json["extensions"] = json!({"CESIUM_RTC": {"center": [6_378_137.25, -4.5, 1.0e6]}});
    let near = textured(&sphere(24, 16), &picture(16));
    let metrics = |build: &Build| {
        let targets = Targets::ratios(vec![0.25]).expect("a ratio");
        let baked = Baked::bytes("ball", &build.glb(), &BakeOptions { targets, ..measured() });
        baked.report.levels[0].metrics.expect("metrics")
    };
    let [far, near] = [metrics(&far), metrics(&near)];
    assert!((far.distance_max_at[0] - near.distance_max_at[0] - 6_378_137.25).abs() < 1e-6);
    let distance_max_at = near.distance_max_at;
    assert_eq!(seamwise::evaluate::Metrics { distance_max_at, ..far }, near);
}

#[test]
fn an_unknown_one_passes_only_where_it_is_allowed_and_is_told() {
    let build = requiring("EXT_of_tomorrow");
    let read = |allow_unknown| {
        let reading = ReadOptions { allow_unknown, ..ReadOptions::default() };
        let input = seamwise::bake::Input::Bytes(&build.glb(), "ball").stem();
        assert_eq!(input, "ball");
        let glb = build.glb();
        let input = seamwise::bake::Input::Bytes(&glb, "ball");
        Baked::input(input, &BakeOptions { reading, ..options(0.25) })
    };
    let error = read(false).err().expect("an error").to_string();
    assert!(error.contains("EXT_of_tomorrow") && error.contains("--allow-unknown"), "{error}");
    let baked = read(true).expect("a bake");
    let warning = baked.report.warnings.iter().next().expect("a warning");
    assert!(warning.what.contains("EXT_of_tomorrow") && warning.at == "/extensionsRequired");
    assert_eq!(baked.level(1).json["extensionsRequired"], json!(["EXT_of_tomorrow"]));
}

#[test]
fn what_describes_triangles_is_kept_on_the_source_alone() {
    let mut build = textured(&sphere(24, 16), &picture(16));
    let outline = json!({"CESIUM_primitive_outline": {"indices": 3}});
    build.json["meshes"][0]["primitives"][0]["extensions"] = outline.clone();
    build.json["extensionsUsed"] = json!(["CESIUM_primitive_outline"]);
    let baked = Baked::bytes("ball", &build.glb(), &options(0.25));
    assert!(baked.report.warnings.iter().any(|own| own.what.contains("CESIUM_primitive_outline")));
    let (level, chain) = (baked.level(1), baked.chain());
    assert_eq!(level.json.get("extensionsUsed"), None);
    let own = |output: &Output, mesh: usize| {
        output.json["meshes"][mesh]["primitives"][0].get("extensions").cloned()
    };
    assert_eq!((own(&level, 0), own(&chain, 1)), (None, None));
    assert_eq!(own(&chain, 0), Some(outline));
}

/// A sheet whose vertices carry ids of two regions with a wavy border, on which vertices are doubled.
fn with_ids(n: u32) -> Build {
    let mut shape = patch(n);
    for (p, normal) in shape.positions.iter_mut().zip(&mut shape.normals) {
        (p[1], *normal) = (0.0, [0.0, 1.0, 0.0]);
    }
    let region = |t: &[u32; 3]| {
        let [x, z] = [0, 2]
            .map(|axis| t.iter().map(|&v| shape.positions[v as usize][axis]).sum::<f32>() / 3.0);
        usize::from(x > 0.3 * (4.0 * z).sin())
    };
    let mut doubled = Shape::default();
    let mut ids = Vec::new();
    let mut known = BTreeMap::new();
    for triangle in &shape.triangles {
        let id = region(triangle);
        let corners = triangle.map(|vertex| {
            *known.entry((vertex, id)).or_insert_with(|| {
                doubled.positions.push(shape.positions[vertex as usize]);
                doubled.normals.push(shape.normals[vertex as usize]);
                doubled.uvs.push(shape.uvs[vertex as usize]);
                ids.push([[7.0, 40.0][id]]);
                ids.len() as u32 - 1
            })
        });
        doubled.triangles.push(corners);
    }
    let mut build = Build::new();
    let mut primitive = build.primitive(&doubled);
    primitive["attributes"]["_FEATURE_ID_0"] = json!(build.floats(&ids));
    let features = json!([{"featureCount": 2, "attribute": 0, "propertyTable": 0}]);
    primitive["extensions"] = json!({"EXT_mesh_features": {"featureIds": features}});
    build.mesh(vec![primitive]);
    let values: Vec<u8> = [1.5f64, 2.5].iter().flat_map(|x| x.to_le_bytes()).collect();
    build.bin.resize(build.bin.len().next_multiple_of(8), 0);
    let view = build.view(&values);
    build.json["extensions"] = json!({"EXT_structural_metadata": {
        "schema": {"id": "s", "classes": {"tree": {"properties": {
            "height": {"type": "SCALAR", "componentType": "FLOAT64"}}}}},
        "propertyTables": [{"class": "tree", "count": 2, "properties": {
            "height": {"values": view}}}],
    }});
    build.json["extensionsUsed"] = json!(["EXT_mesh_features", "EXT_structural_metadata"]);
    build.json["extensionsRequired"] = build.json["extensionsUsed"].clone();
    build
}

/// The area of each id, all corners of a triangle having the same.
fn areas(output: &Output) -> BTreeMap<u32, f32> {
    let mesh = output.gltf.meshes().next().expect("a mesh");
    let primitive = mesh.primitives().next().expect("a primitive");
    let ids = primitive.get(&gltf::Semantic::Extras("FEATURE_ID_0".into())).expect("ids");
    let ids = output.rows(&ids);
    let part = &output.parts(0)[0];
    let mut areas = BTreeMap::new();
    for triangle in &part.triangles {
        let own = triangle.map(|vertex| ids[vertex as usize][0] as u32);
        assert!(own[0] == own[1] && own[1] == own[2], "a triangle of several ids: {own:?}");
        let [a, b, c] = triangle.map(|vertex| glam::Vec3::from(part.positions[vertex as usize]));
        *areas.entry(own[0]).or_insert(0.0) += (b - a).cross(c - a).length() / 2.0;
    }
    areas
}

#[test]
fn ids_are_taken_from_the_source_and_their_border_stays() {
    let build = with_ids(32);
    let source = areas(&Output::from_bytes(&build.glb(), "source"));
    let baked = Baked::bytes("ids", &build.glb(), &options(0.05));
    let level = baked.level(1);
    let own = areas(&level);
    assert_eq!(own.keys().collect::<Vec<_>>(), [&7, &40]);
    for (id, area) in source {
        assert!((own[&id] / area - 1.0).abs() < 0.02, "id {id}: {area} became {}", own[&id]);
    }
    let properties =
        "/extensions/EXT_structural_metadata/propertyTables/0/properties/height/values";
    for output in [level, baked.chain()] {
        let view =
            output.json.pointer(properties).and_then(Value::as_u64).expect("a view") as usize;
        let view = output.gltf.views().nth(view).expect("a view");
        assert_eq!((view.offset() % 8, view.length()), (0, 16));
        let features =
            &output.json["meshes"][0]["primitives"][0]["extensions"]["EXT_mesh_features"];
        assert_eq!(features["featureIds"][0]["attribute"], 0);
    }
}

#[test]
fn an_animation_by_pointers_moves_the_levels_too() {
    let mut build = requiring("KHR_animation_pointer");
    let times = build.floats(&[[0.0], [1.0]]);
    let moves = build.floats(&[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let target = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {
        "pointer": "/nodes/0/translation"}}});
    build.json["animations"] = json!([{
        "samplers": [{"input": times, "output": moves}],
        "channels": [{"sampler": 0, "target": target}],
    }]);
    let baked = Baked::bytes("moved", &build.glb(), &options(0.25));
    let chain = std::fs::read(baked.chain_path()).expect("a file");
    let chain = gltf::Glb::from_slice(&chain).expect("a container");
    let json: Value = serde_json::from_slice(&chain.json).expect("a document");
    assert_eq!(json["animations"], build.json["animations"]);
    assert!(json["nodes"][0].get("mesh").is_none(), "what moves holds what it moves");
    let child = json["nodes"][0]["children"][0].as_u64().expect("a child") as usize;
    assert!(json["nodes"][child]["extensions"].get("MSFT_lod").is_some());
}
