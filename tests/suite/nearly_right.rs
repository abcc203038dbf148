//! Documents that are nearly right, and those in which there is nothing to simplify: each is read with a
//! line that says what was made of it, and refused with the same line by `--strict`.

use std::path::Path;
use std::process::{Command, Output};

use base64::Engine;
use serde_json::{Value, json};

use crate::common::Baked;
use crate::common::assets::{picture, textured};
use crate::common::build::{Build, glb, png};
use crate::common::shapes::{Shape, patch, seam_cube};
use crate::common::unmeasured;
use seamwise::bake::options::BakeOptions;

fn bake(folder: &Path, inputs: &[&str], more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_seamwise"));
    command.current_dir(folder).arg("bake").args(inputs).args(["-o", "out", "--no-evaluate"]);
    command.args(["--levels", "1"]).args(more).output().expect("it runs")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A textured sheet whose image and buffer are in the document or beside it.
fn sheet() -> Build {
    textured(&patch(6), &picture(8))
}

/// A sheet as a .gltf in text, after a change.
fn document(change: impl FnOnce(&mut Value)) -> Vec<u8> {
    let mut build = sheet();
    let base64 = base64::engine::general_purpose::STANDARD.encode(&build.bin);
    build.json["buffers"] = json!([{
        "byteLength": build.bin.len(), "uri": format!("data:application/octet-stream;base64,{base64}"),
    }]);
    change(&mut build.json);
    build.json.to_string().into_bytes()
}

fn unpadded(json: &mut Value) {
    let uri = json["buffers"][0]["uri"].as_str().expect("a URI");
    let own = uri.trim_end_matches('=').replace('+', "-").replace('/', "_");
    // Those of the media type were no digits.
    json["buffers"][0]["uri"] = json!(own.replacen("application_octet-stream", "a/b", 1));
}

fn backslashes(json: &mut Value) {
    json["images"][0] = json!({"uri": "maps\\a.png"});
}

/// Normals of four bits a component.
fn of_few_bits() -> Vec<u8> {
    let shape = patch(6);
    let mut build = Build::new();
    let mut primitive = build.primitive(&shape);
    let few = |x: f32| ((x * 7.0).round() / 7.0 * 127.0).round() as i8 as u8;
    let rows = shape.normals.iter().flat_map(|n| [few(n[0]), few(n[1]), few(n[2]), 0]);
    let view = build.view(&rows.collect::<Vec<u8>>());
    build.json["bufferViews"][view]["byteStride"] = json!(4);
    let accessor = json!({"bufferView": view, "componentType": 5120, "normalized": true,
        "count": shape.normals.len(), "type": "VEC3"});
    primitive["attributes"]["NORMAL"] = json!(build.add("accessors", accessor));
    build.mesh(vec![primitive]);
    build.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    build.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    build.glb()
}

/// Each kind: a file, the place that is named, and a part of what is said.
fn kinds() -> Vec<(&'static str, Vec<u8>, &'static str, &'static str)> {
    let marked = [b"\xef\xbb\xbf".as_slice(), &document(|_| {})].concat();
    let mut padded = sheet();
    padded.json["buffers"] = json!([{"byteLength": padded.bin.len()}]);
    let zeros = [padded.json.to_string().as_bytes(), &[0; 5]].concat();
    vec![
        ("mark.gltf", marked, "the JSON document", "byte order mark"),
        ("zeros.glb", glb(&zeros, &padded.bin), "the JSON document", "zeros"),
        ("base64.gltf", document(unpadded), "/buffers/0/uri", "base64"),
        ("slashes.gltf", document(backslashes), "/images/0/uri", "backslashes"),
        (
            "nosource.gltf",
            document(|json| json["textures"][0] = json!({})),
            "/textures/0",
            "give it a source",
        ),
        (
            "unused.gltf",
            document(|json| push(json, "images", json!({"uri": "gone.png"}))),
            "/images/1",
            "no material uses it",
        ),
        (
            "view.gltf",
            document(|json| {
                push(
                    json,
                    "bufferViews",
                    json!({"buffer": 0, "byteOffset": 9, "byteLength": 1 << 30}),
                );
            }),
            "/bufferViews/",
            "nothing uses it",
        ),
        (
            "buffer.gltf",
            document(|json| {
                push(json, "buffers", json!({"byteLength": 9, "uri": "gone.bin"}));
            }),
            "/buffers/1",
            "nothing is in it",
        ),
        ("bits.glb", of_few_bits(), "/accessors/4", "unit length"),
        ("points.glb", points(), "/meshes", "not a single triangle"),
        ("triangle.glb", triangle(), "level 1", "nothing is simplified"),
    ]
}

fn push(json: &mut Value, list: &str, object: Value) {
    json[list].as_array_mut().expect("a list").push(object);
}

/// Points alone.
fn points() -> Vec<u8> {
    let mut build = Build::new();
    let positions = build.floats(&[[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]);
    build.mesh(vec![json!({"attributes": {"POSITION": positions}, "mode": 0})]);
    build.glb()
}

/// One triangle.
fn triangle() -> Vec<u8> {
    let whole = patch(1);
    Build::of(&Shape { triangles: vec![whole.triangles[0]], ..whole }.unindexed()).glb()
}

#[test]
fn each_kind_is_baked_with_a_line_and_refused_by_strict_with_the_same() {
    let stage = tempfile::tempdir().expect("a folder");
    let folder = stage.path();
    std::fs::create_dir(folder.join("maps")).expect("a folder");
    std::fs::write(folder.join("maps/a.png"), png(&picture(8))).expect("a file");
    for (name, bytes, place, what) in kinds() {
        std::fs::write(folder.join(name), bytes).expect("a file");
        let strict = bake(folder, &[name], &["--strict"]);
        let said = stderr(&strict);
        assert!(!strict.status.success() && !folder.join("out").exists(), "{name}: {said}");
        let line = said.lines().next().unwrap_or_default();
        for part in [name, place, what, "--strict"] {
            assert!(line.contains(part), "{name}: no {part} in {said}");
        }
        let baked = bake(folder, &[name], &[]);
        let said = stderr(&baked);
        assert!(baked.status.success(), "{name}: {said}");
        assert_eq!(said.lines().count(), 1, "{name}: {said}");
        for part in ["warning", name, place, what] {
            assert!(said.contains(part), "{name}: no {part} in {said}");
        }
        let level = folder.join("out").join(name).with_extension("").display().to_string();
        let level = crate::common::output::Output::read(Path::new(&format!("{level}_lod1.glb")));
        let points = level.json["meshes"][0]["primitives"][0]["mode"] == 0;
        assert!(points || level.triangle_count() > 0, "{name}");
        std::fs::remove_dir_all(folder.join("out")).expect("outputs");
    }
}

#[test]
fn normals_of_few_bits_come_out_as_unit_vectors_at_every_level() {
    let baked = Baked::bytes("bits", &of_few_bits(), &unmeasured());
    for output in baked.levels().iter().chain([&baked.chain()]) {
        for part in (0..output.gltf.meshes().len()).flat_map(|mesh| output.parts(mesh)) {
            for n in &part.normals {
                let length = n.iter().map(|x| x * x).sum::<f32>().sqrt();
                assert!((length - 1.0).abs() < 1e-3, "{length}");
            }
        }
    }
}

#[test]
fn parts_without_triangles_or_vertices_are_left_as_they_are_beside_others() {
    let mut build = sheet();
    let empty = json!({"componentType": 5126, "count": 0, "type": "VEC3"});
    let empty = build.add("accessors", empty);
    let none = json!({"componentType": 5123, "count": 0, "type": "SCALAR"});
    let none = build.add("accessors", none);
    let mut primitives = build.json["meshes"][0]["primitives"].clone();
    let positions = primitives[0]["attributes"]["POSITION"].clone();
    for own in [
        json!({"attributes": {"POSITION": empty}}),
        json!({"attributes": {"POSITION": positions}, "indices": none}),
        json!({"attributes": {}}),
    ] {
        primitives.as_array_mut().expect("a list").push(own);
    }
    build.json["meshes"][0]["primitives"] = primitives;
    let bytes = build.glb();
    let options = BakeOptions { allow_empty: false, ..unmeasured() };
    let folder = tempfile::tempdir().expect("a folder");
    let input = seamwise::bake::Input::Bytes(&bytes, "empty");
    let progress = seamwise::progress::Progress::hidden();
    let report = seamwise::bake::bake(input, folder.path(), &options, &progress).expect("a bake");
    assert_eq!(report.levels[0].triangles, 36);
}

#[test]
fn one_stem_in_a_folder_is_named_apart_and_what_is_empty_is_refused_alone_only() {
    let stage = tempfile::tempdir().expect("a folder");
    let folder = stage.path();
    let build = Build::of(&seam_cube(2));
    std::fs::create_dir(folder.join("in")).expect("a folder");
    std::fs::write(folder.join("in/a.glb"), build.glb()).expect("a file");
    build.write_gltf(&folder.join("in"), "a");
    let nothing = glb(Build::new().json.to_string().as_bytes(), b"");
    std::fs::write(folder.join("in/none.glb"), &nothing).expect("a file");
    let baked = bake(folder, &["in"], &[]);
    let said = stderr(&baked);
    assert!(baked.status.success(), "{said}");
    assert_eq!(said.lines().count(), 2, "{said}");
    assert!(said.contains("a.gltf: its name: another input has the stem `a` too"), "{said}");
    assert!(said.contains("none.glb: /meshes: there is not a single triangle"), "{said}");
    for name in ["a_lod1.glb", "a.json", "a.gltf_lod1.glb", "a.gltf.json"] {
        assert!(folder.join("out").join(name).exists(), "{name}");
    }
    assert!(folder.join("out/none_lod1.glb").exists());
    let again = bake(folder, &["in"], &["--resume"]);
    assert!(String::from_utf8_lossy(&again.stdout).contains("0 baked, 3 skipped"), "{again:?}");
    let alone = bake(folder, &["in/none.glb"], &[]);
    assert!(!alone.status.success() && stderr(&alone).contains("nothing in them to bake"));
}
