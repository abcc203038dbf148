//! Real assets that are compressed, rigged or odd: each is read, baked and written as a valid file.

use crate::common::assets::{picture, textured};
use crate::common::build::Build;
use crate::common::output::Output;
use crate::common::shapes::sphere;
use assert_cmd::Command;
use base64::Engine;
use std::path::Path;

use crate::common::{Baked, measured, shared_assets, unmeasured};
use seamwise::bake::Input;
use seamwise::bake::options::{BakeOptions, Targets, Textures};
use seamwise::document::asset::Asset;
use serde_json::json;

/// Bakes two levels of a real asset; `None` where there is none.
fn bake(name: &str) -> Option<(Asset, Vec<Output>)> {
    let path = shared_assets()?.join(name);
    let source = seamwise::import::read(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
    let options = BakeOptions { targets: Targets::halves(2), ..measured() };
    let baked = Baked::input(Input::File(&path), &options)
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    for level in &baked.report.levels {
        let luminance = level.metrics.expect("metrics").rms_luminance;
        assert!(level.triangles > 0 && luminance < 0.2, "{name}: {luminance}");
    }
    let mut outputs = baked.levels();
    outputs.push(baked.chain());
    Some((source, outputs))
}

#[test]
fn webp_textures_stay_webp() {
    let Some((source, outputs)) = bake("compressed/cat_webp.glb") else {
        return;
    };
    for output in outputs {
        assert_eq!(output.json["textures"], source.json["textures"]);
        assert_eq!(output.json["extensionsRequired"], json!(["EXT_texture_webp"]));
        for image in output.json["images"].as_array().expect("images") {
            assert_eq!(image["mimeType"], "image/webp");
        }
    }
}

#[test]
fn compressed_and_quantized_geometry_becomes_plain() {
    let Some((source, outputs)) = bake("compressed/pirate_meshopt_quant.glb") else {
        return;
    };
    assert_eq!(source.json["extensionsUsed"], json!(["KHR_mesh_quantization"]));
    assert_eq!(source.json["bufferViews"][1].get("extensions"), None);
    let (chain, levels) = outputs.split_last().expect("outputs");
    for level in levels {
        assert_eq!(level.json.get("extensionsUsed"), None, "a level has floats");
        assert_eq!(level.json.get("extensionsRequired"), None);
    }
    assert_eq!(chain.json["extensionsRequired"], json!(["KHR_mesh_quantization"]), "level 0");
}

/// What became of the textures and images of an asset that came with one KTX2.
fn kinds(output: &Output) -> (bool, &str, bool) {
    let is_core = output.json["textures"][0].get("source").is_some();
    let kind = output.json["images"][0]["mimeType"].as_str().expect("a type");
    (is_core, kind, output.json.get("extensionsRequired").is_some())
}

#[test]
fn a_ktx2_texture_stays_as_it_is_or_becomes_a_png() {
    for name in [
        "compressed/mustard_bottle_ktx2/006_mustard_bottle_textured.gltf",
        "nasty/photogrammetry_tile_ktx2.glb",
    ] {
        let Some((_, outputs)) = bake(name) else {
            return;
        };
        for output in &outputs {
            assert_eq!(kinds(output), (true, "image/png", false), "{name}");
        }
    }
}

#[test]
fn a_ktx2_texture_that_nothing_changes_is_written_byte_for_byte() {
    let Some(folder) = shared_assets() else {
        return;
    };
    let path = folder.join("nasty/photogrammetry_tile_ktx2.glb");
    let options =
        BakeOptions { targets: Targets::halves(1), textures: Textures::Keep, ..unmeasured() };
    let baked = Baked::input(Input::File(&path), &options).expect("a bake");
    assert_eq!(kinds(&baked.level(1)), (false, "image/ktx2", true));
    let image = |path: &Path| seamwise::import::read(path).expect("an asset").images.remove(0);
    assert_eq!(image(&baked.level_path(1)), image(&path));
}

#[test]
fn a_draco_mesh_becomes_plain() {
    let mut build = Build::new();
    let view = build.view(include_bytes!("../encoded/patch.drc"));
    let mut accessor = |component: u32, count: usize, shape: &str| {
        let json = json!({"componentType": component, "count": count, "type": shape});
        build.add("accessors", json)
    };
    let [indices, positions, normals, uvs] = [
        accessor(5123, 384, "SCALAR"),
        accessor(5126, 81, "VEC3"),
        accessor(5126, 81, "VEC3"),
        accessor(5126, 81, "VEC2"),
    ];
    for (key, bound) in [("min", -1.0), ("max", 1.0)] {
        build.json["accessors"][positions][key] = json!([bound, bound, bound]);
    }
    let ids = json!({"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2});
    build.mesh(vec![json!({
        "attributes": {"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs},
        "indices": indices,
        "extensions": {"KHR_draco_mesh_compression": {"bufferView": view, "attributes": ids}},
    })]);
    for key in ["extensionsUsed", "extensionsRequired"] {
        build.json[key] = json!(["KHR_draco_mesh_compression"]);
    }
    let options = BakeOptions { targets: Targets::halves(2), ..measured() };
    let baked = Baked::bytes("draco", &build.glb(), &options);
    assert_eq!(baked.report.input.triangles, 128);
    assert_eq!(baked.report.levels[0].triangles, 64);
    for output in baked.levels() {
        assert_eq!(output.json.get("extensionsUsed"), None);
    }
    assert_eq!(baked.chain().json.get("extensionsRequired"), None);
}

#[test]
fn a_missing_texture_is_a_warning_if_that_is_asked_for_and_stays_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut build = textured(&sphere(16, 8), &picture(16));
    build.json["images"][0] = json!({"uri": "gone.jpg"});
    let normal = build.add("images", json!({"uri": "textures/gone too.png"}));
    let texture = build.add("textures", json!({"source": normal}));
    build.json["materials"][0]["normalTexture"] = json!({"index": texture});
    let input = build.write_gltf(folder.path(), "sphere");
    let out = folder.path().join("out");
    let run = |arguments: &[&str]| {
        let mut command = Command::cargo_bin("seamwise").expect("the binary");
        let output = command.args(arguments).output().expect("a run");
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let [input, out] = [&input, &out].map(|path| path.to_str().expect("a name"));
    let bake = ["bake", input, "-o", out, "--levels", "1", "--no-evaluate", "--report"];
    let few = ["--views", "1", "--resolution", "64", "--samples", "1000"];
    let evaluate = [&["evaluate", input, input], &few[..]].concat();
    for job in [&["inspect", input][..], &evaluate, &bake] {
        let (well, said) = run(job);
        assert!(!well && said.contains("gone.jpg") && said.contains("/images/0/uri"), "{said}");
        let (well, said) = run(&[job, &["--allow-missing", "--strict"]].concat());
        assert!(!well && said.contains("gone.jpg") && said.contains("--strict"), "{said}");
        assert!(said.contains("/images/0/uri") && said.contains("sphere.gltf"), "{said}");
        assert!(!Path::new(out).exists(), "nothing is written");
        let (well, said) = run(&[job, &["--allow-missing"]].concat());
        assert!(
            well && said.contains("warning") && said.contains("textures/gone too.png"),
            "{said}"
        );
        assert!(!run(&[job, &["--allow-missing", "--quiet"]].concat()).1.contains("warning"));
    }
    let level = Output::read(&Path::new(out).join("sphere_lod1.glb"));
    assert_eq!(level.json["images"], build.json["images"]);
    let report = std::fs::read_to_string(Path::new(out).join("sphere.json")).expect("a report");
    let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
    let places = |index: usize| report["warnings"][index]["at"].as_str();
    assert_eq!([places(0), places(1)], [Some("/images/0/uri"), Some("/images/1/uri")]);
    let page = std::fs::read_to_string(Path::new(out).join("sphere.html")).expect("a page");
    assert!(page.contains("<strong>Warning</strong> /images/1/uri: textures/gone too.png"));
}

#[test]
fn features_of_vertices_and_buffers_of_any_kind_come_through() {
    let shape = sphere(16, 8);
    let mut build = Build::new();
    let mut primitive = build.primitive(&shape);
    let ids: Vec<[f32; 1]> = (0..shape.positions.len()).map(|i| [(i % 3) as f32]).collect();
    let features = json!({"featureIds": [{"featureCount": 3, "attribute": 0}]});
    primitive["extensions"] = json!({"EXT_mesh_features": features});
    primitive["attributes"]["_FEATURE_ID_0"] = json!(build.floats(&ids));
    build.mesh(vec![primitive]);
    for key in ["extensionsUsed", "extensionsRequired"] {
        build.json[key] = json!(["EXT_mesh_features"]);
    }
    // The indices lie in a buffer of their own, in the document itself.
    let view = build.json["accessors"][3]["bufferView"].as_u64().expect("a view") as usize;
    let own = build.json["bufferViews"][view].clone();
    let [start, length] =
        ["byteOffset", "byteLength"].map(|key| own[key].as_u64().expect("a size") as usize);
    let data = base64::engine::general_purpose::STANDARD.encode(&build.bin[start..][..length]);
    build.bin[start..][..length].fill(0);
    build.json["bufferViews"][view] = json!({"buffer": 1, "byteLength": length});
    let uri = format!("data:application/octet-stream;base64,{data}");
    build.json["buffers"] =
        json!([{"byteLength": build.bin.len()}, {"byteLength": length, "uri": uri}]);
    let options = BakeOptions { targets: Targets::halves(1), ..unmeasured() };
    let level = Baked::bytes("features", &build.glb(), &options).level(1);
    let primitive = &level.json["meshes"][0]["primitives"][0];
    assert_eq!(primitive["extensions"]["EXT_mesh_features"], features);
    let accessor = primitive["attributes"]["_FEATURE_ID_0"].as_u64().expect("ids") as usize;
    let accessor = level.gltf.accessors().nth(accessor).expect("an accessor");
    let ids = level.rows(&accessor);
    assert!(ids.len() > 10 && ids.iter().all(|id| [0.0, 1.0, 2.0].contains(&id[0])));
    assert_eq!(level.json["buffers"].as_array().map(Vec::len), Some(1));
}
