//! Documents that ask for far more than they hold, and what bounds each.
//!
//! | what may be without bound | what bounds it | where it is tested |
//! |---|---|---|
//! | depth of the JSON | the parser's 128 levels, so every walk over it may recurse | robust.rs |
//! | nodes: depth, cycles, paths | no recursion; each node is reached once | robust.rs |
//! | chunks of a GLB | the file's length | robust.rs |
//! | counts, offsets, strides of accessors | the view's bytes, before anything is copied | robust.rs, here |
//! | accessors without a view | four bytes for each of the buffers | robust.rs |
//! | sparse indices and counts | as accessors; each index against the count | here |
//! | buffers and images that share bytes | `--memory-limit` for their sum | here |
//! | primitives and targets that share accessors | `--memory-limit` for their sum | here |
//! | nodes and instances that share meshes | `--memory-limit` for the scene | here |
//! | sizes of images | `--memory-limit` for each, before it is decoded | robust.rs, hostile_pictures.rs |
//! | streams of codecs | the stream's length, and `--memory-limit` for their sum | src/compression |
//! | counts and polygons of OBJ, PLY, OFF | what the file holds | here, formats.rs |
//! | names of files | the asset's folder, unless `--allow-outside` | outside.rs |
//! | time | `--time-limit`, between steps | here |

use std::path::Path;
use std::time::Duration;

use crate::common;
use crate::common::assets::textured;
use crate::common::build::Build;
use crate::common::{shapes, unmeasured, within};
use assert_cmd::Command;
use seamwise::bake::options::BakeOptions;
use seamwise::bake::{Input, bake};
use seamwise::error::Error;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::import::options::ReadOptions;
use seamwise::import::{read_bytes, read_bytes_of, read_bytes_with, read_with};
use seamwise::limit::MemoryLimit;
use seamwise::progress::Progress;
use seamwise::repair::options::RepairOptions;
use seamwise::repair::repair_bytes;
use seamwise::report::peak_memory;
use seamwise::surface::group::weld_all;
use serde_json::{Value, json};

/// What each of the documents is refused beyond.
const LIMIT: MemoryLimit = MemoryLimit::of_bytes(16 << 20);
/// Most memory that all tests here may take, each file with what it is read into.
const MOST_BYTES: u64 = 1 << 30;

fn options() -> ReadOptions {
    ReadOptions { memory_limit: LIMIT, ..ReadOptions::default() }
}

/// Makes sure that it was refused at a place, for the limit.
fn assert_refused<T>(result: seamwise::error::Result<T>, place: &str, things: &str) {
    let error = result.err().expect("it is refused").to_string();
    assert!(error.starts_with(place) && error.contains(things), "{error}");
    assert!(error.contains("limit of 16MiB") && error.contains("--memory-limit"), "{error}");
    assert!(peak_memory().is_none_or(|bytes| bytes < MOST_BYTES));
}

fn read(build: &Build) -> seamwise::document::asset::Asset {
    read_bytes_with(&build.glb(), Path::new("/nowhere"), options()).expect("an asset")
}

#[test]
fn buffers_of_one_file_count_each_time() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.bin"), vec![0; 1 << 20]).expect("a file");
    let buffer = json!({"byteLength": 1 << 20, "uri": "a.bin"});
    let json = json!({"asset": {"version": "2.0"}, "buffers": vec![buffer; 100_000]});
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, json.to_string()).expect("a file");
    let result = within(60, "buffers", move || read_with(&path, options()));
    assert_refused(result, "/buffers/16: ", "all buffers");
}

#[test]
fn images_in_views_that_overlap_count_each_time() {
    let mut build = Build::new();
    let mut file = b"\x89PNG\r\n\x1a\n".repeat(1 << 16);
    file.truncate(1 << 19);
    build.view(&file);
    let views = (0..1000).map(|i| json!({"buffer": 0, "byteOffset": 8 * i, "byteLength": 1 << 18}));
    build.json["bufferViews"] = views.collect();
    build.json["images"] = (0..1000).map(|view| json!({"bufferView": view})).collect();
    let glb = build.glb();
    let result =
        within(60, "images", move || read_bytes_with(&glb, Path::new("/nowhere"), options()));
    assert_refused(result, "/images/64: ", "all image files");
}

#[test]
fn primitives_of_the_same_vertices_count_each_time() {
    let mut build = Build::new();
    let positions = build.floats(&vec![[0.0; 3]; 10_000]);
    build.mesh(vec![json!({"attributes": {"POSITION": positions}}); 50_000]);
    let (asset, glb) = (read(&build), build.glb());
    let result = within(60, "primitives", move || weld_all(&asset, LIMIT));
    assert_refused(result, "/meshes/0/primitives/38: ", "all vertices");
    // A repair has no surface, but charts of the same triangles.
    let [input, output] = ["in.glb", "out.glb"].map(Path::new);
    let options = RepairOptions { reading: options(), ..RepairOptions::default() };
    let result = within(60, "charts", move || repair_bytes(&glb, input, output, &options));
    assert_refused(result, "in.glb: /meshes/0/primitives/38: ", "all vertices");
}

#[test]
fn primitives_of_the_same_indices_count_each_time() {
    let mut build = Build::of(&shapes::patch(2));
    let indices = build.indices((0..300_000).map(|corner| corner % 9));
    let mut primitive = build.json["meshes"][0]["primitives"][0].clone();
    primitive["indices"] = json!(indices);
    build.json["meshes"][0]["primitives"] = vec![primitive; 1000].into();
    let asset = read(&build);
    let result = within(60, "indices", move || weld_all(&asset, LIMIT));
    assert_refused(result, "/meshes/0/primitives/6: ", "all vertices");
}

#[test]
fn targets_of_the_same_vertices_count_each_time() {
    let mut build = Build::of(&shapes::patch(64));
    let position = build.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"].clone();
    let targets = vec![json!({"POSITION": position}); 50_000];
    build.json["meshes"][0]["primitives"][0]["targets"] = targets.into();
    let asset = read(&build);
    let result = within(60, "targets", move || weld_all(&asset, LIMIT));
    assert_refused(result, "/meshes/0/primitives/0: ", "all vertices");
}

#[test]
fn a_scene_counts_each_instance_and_each_node() {
    let mut build = Build::of(&shapes::patch(16));
    let moves = build.floats(&vec![[1.0, 0.0, 0.0]; 20_000]);
    let instances = json!({"attributes": {"TRANSLATION": moves}});
    build.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": instances});
    let asset = read(&build);
    let load = |asset| load(&asset, &mut TextureCache::with_limit(LIMIT));
    let result = within(60, "instances", move || load(asset));
    assert_refused(result, "/nodes/0: ", "the scene with all its instances");
    let mut build = Build::of(&shapes::patch(16));
    build.json["nodes"] = vec![json!({"mesh": 0}); 20_000].into();
    build.json["scenes"][0]["nodes"] = (0..20_000).collect();
    let asset = read(&build);
    let result = within(60, "nodes", move || load(asset));
    assert_refused(result, "/nodes/", "the scene with all its instances");
    // A mesh without a triangle is no less of a step.
    build.json["accessors"][3]["count"] = json!(0);
    let asset = read(&build);
    let result = within(60, "nodes", move || load(asset));
    assert_refused(result, "/nodes/", "the scene with all its instances");
}

#[test]
fn sparse_values_are_held_against_their_views_and_their_accessor() {
    let sparse = |count: Value, [indices, values]: [u64; 2]| {
        let mut build = Build::of(&shapes::patch(4));
        build.json["accessors"][0]["sparse"] = json!({
            "count": count,
            "indices": {"bufferView": 3, "componentType": 5125, "byteOffset": indices},
            "values": {"bufferView": 0, "byteOffset": values},
        });
        weld_all(&read(&build), LIMIT)
    };
    assert!(sparse(json!(2), [0, 0]).is_ok());
    for count in [json!(1_000), json!(1u64 << 32), json!(u64::MAX), json!(u64::MAX / 4 + 1)] {
        let error = sparse(count.clone(), [0, 0]).expect_err("an error").to_string();
        assert!(error.starts_with("/accessors/0/sparse: "), "{count}: {error}");
    }
    for offsets in [[u64::MAX, 0], [0, u64::MAX], [1 << 32, 0], [u64::MAX - 3, u64::MAX - 3]] {
        let error = sparse(json!(1), offsets).expect_err("an error").to_string();
        assert!(error.starts_with("/accessors/0/sparse: "), "{offsets:?}: {error}");
    }
}

#[test]
fn what_an_accessor_claims_is_held_against_its_view_at_the_edges() {
    let with = |member: &str, value: Value| {
        let mut build = Build::of(&shapes::patch(4));
        build.json["buffers"] = json!([{"byteLength": build.bin.len()}]);
        let (parent, key) = member.rsplit_once('/').expect("a member");
        build.json.pointer_mut(parent).expect("a place")[key] = value;
        let asset = read_bytes(&build.glb(), Path::new("/nowhere"));
        asset.and_then(|asset| weld_all(&asset, LIMIT))
    };
    // 25 vertices of 12 bytes: 26 run past, and 25 do wherever they begin later or lie wider.
    assert!(with("/accessors/0/count", json!(26)).is_err());
    assert!(with("/accessors/0/byteOffset", json!(1)).is_err());
    assert!(with("/bufferViews/0/byteStride", json!(13)).is_err());
    assert!(with("/bufferViews/0/byteStride", json!(12)).is_ok());
    for stride in [json!(0), json!(11), json!(u64::MAX)] {
        assert!(with("/bufferViews/0/byteStride", stride.clone()).is_err(), "{stride}");
    }
    for count in [1u64 << 32, (1 << 32) + 25, u64::MAX, u64::MAX / 12 + 1, u64::MAX / 12 + 26] {
        assert!(with("/accessors/0/count", json!(count)).is_err(), "{count}");
        assert!(with("/accessors/3/count", json!(count)).is_err(), "{count}");
    }
    for length in [u64::MAX, u64::MAX - 299, 1 << 63] {
        assert!(with("/bufferViews/0/byteLength", json!(length)).is_err(), "{length}");
        assert!(with("/bufferViews/0/byteOffset", json!(length)).is_err(), "{length}");
    }
}

#[test]
fn other_formats_hold_no_more_than_their_bytes() {
    let read = |name: &str, text: String| {
        let path = Path::new("/nowhere").join(name);
        within(60, "a model", move || read_bytes_of(text.as_bytes(), &path, options()))
    };
    let many = u64::MAX;
    for (name, text) in [
        ("a.off", format!("OFF\n{many} {many} 0\n0 0 0\n")),
        ("a.off", format!("OFF\n1 1 0\n0 0 0\n{many} 0 0 0\n")),
        ("a.ply", format!("ply\nformat ascii 1.0\nelement vertex {many}\nend_header\n")),
        (
            "a.ply",
            "ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\n\
            property float y\nproperty float z\nelement face 1\n\
            property list uint int vertex_indices\nend_header\n\u{7f}\u{7f}\u{7f}\u{7f}"
                .into(),
        ),
        ("a.obj", "v 0 0 0\nf 9223372036854775807 1 1\n".into()),
        ("a.obj", "v 0 0 0\nf -9223372036854775808 1 1\n".into()),
    ] {
        assert!(read(name, text.clone()).is_err(), "{text}");
    }
    // One polygon of a million corners: as many triangles less two, and soon.
    let polygon = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf{}\n", " 1 2 3".repeat(333_334));
    let asset = read("a.obj", polygon).expect("an asset");
    assert_eq!(asset.json["accessors"][1]["count"], json!(3 * (1_000_002 - 2)));
}

#[test]
fn a_bake_whose_time_is_over_writes_nothing_and_says_where_it_stopped() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let glb = textured(&shapes::patch(8), &common::assets::picture(8)).glb();
    let run = |seconds: u64, nanoseconds| {
        let time_limit = Some(Duration::new(seconds, nanoseconds));
        let options = BakeOptions { time_limit, ..unmeasured() };
        bake(Input::Bytes(&glb, "patch"), &out, &options, &Progress::hidden())
    };
    let error = run(0, 1).expect_err("no time at all");
    assert!(matches!(&error, Error::Time { stage, .. } if stage == "read"), "{error}");
    assert!(!out.exists());
    assert!(run(100_000, 0).is_ok());
    assert_eq!(common::folder_files(&out).len(), 6);
}

#[test]
fn each_input_of_a_batch_has_a_time_of_its_own() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["a.glb", "b.glb"] {
        let glb = textured(&shapes::patch(8), &common::assets::picture(8)).glb();
        std::fs::write(folder.path().join(name), glb).expect("a file");
    }
    let run = |limit: &str| {
        let mut command = Command::cargo_bin("seamwise").expect("the binary");
        command.current_dir(folder.path()).args(["bake", "a.glb", "b.glb", "-o", "out"]);
        command.args(["--no-evaluate", "--textures", "keep", &format!("--time-limit={limit}")]);
        let output = command.output().expect("a run");
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, said) = run("1e-9");
    assert_eq!(code, Some(2), "{said}");
    for part in ["a.glb", "b.glb", "`read`", "--time-limit", "2 of 2 inputs failed"] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert!(!folder.path().join("out").exists());
    assert_eq!(run("86400").0, Some(0));
    for wrong in ["0", "-1", "x", "inf", "NaN", "1e300"] {
        assert!(run(wrong).1.contains("number of seconds"), "{wrong}");
    }
}
