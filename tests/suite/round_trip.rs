//! A level with all triangles and the textures kept is the source: every accessor, image and object of
//! the document comes back, in whatever form it is written.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::common;
use crate::common::build::Build;
use crate::common::{Baked, assets, chained, shapes, shared_assets, unmeasured};
use seamwise::bake::Input;
use seamwise::bake::options::{BakeOptions, Targets, Textures};
use seamwise::document::accessor;
use seamwise::document::asset::Asset;
use seamwise::export::files::{Format, Layout, OutputOptions};
use seamwise::import::options::ReadOptions;
use seamwise::import::read_with;
use serde_json::{Value, json};

/// All that a level keeps.
fn whole(output: OutputOptions) -> BakeOptions {
    BakeOptions {
        targets: Targets::ratios(vec![1.0]).expect("a ratio"),
        textures: Textures::Keep,
        polish: None,
        reading: ReadOptions { allow_missing: true, ..ReadOptions::default() },
        output,
        ..unmeasured()
    }
}

fn read(path: &Path) -> Asset {
    let options = ReadOptions { allow_missing: true, ..ReadOptions::default() };
    read_with(path, options).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The .glb and .gltf files of a folder and those in it.
fn documents(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    let found = |path: &PathBuf| match path.extension().and_then(|ending| ending.to_str()) {
        Some("glb" | "gltf") => vec![path.clone()],
        _ if path.is_dir() => documents(path),
        _ => Vec::new(),
    };
    paths.iter().flat_map(found).collect()
}

/// The elements of an accessor; a matrix as its columns.
fn elements(asset: &Asset, index: usize) -> accessor::Elements {
    // A character has thousands of accessors: no copy of all for each.
    if asset.json["accessors"][index]["type"] != "MAT4" {
        return accessor::read(asset, index, "").expect("an accessor");
    }
    let mut asset = asset.clone();
    let own = &mut asset.json["accessors"][index];
    if own["type"] == "MAT4" {
        own["type"] = json!("VEC4");
        own["count"] = json!(4 * own["count"].as_u64().expect("a count"));
    }
    accessor::read(&asset, index, "").expect("an accessor")
}

/// The accessors that index triangle lists, whose corners may come back turned.
fn triangle_indices(asset: &Asset) -> BTreeSet<usize> {
    let list = |json: &Value, key: &str| json[key].as_array().cloned().unwrap_or_default();
    let primitives =
        list(&asset.json, "meshes").into_iter().flat_map(|mesh| list(&mesh, "primitives"));
    let lists = primitives.filter(|own| own.get("mode").is_none_or(|mode| mode == 4));
    lists.filter_map(|own| own.get("indices")?.as_u64().map(|index| index as usize)).collect()
}

/// Triangles, each from its least corner on.
fn turned(indices: &[u32]) -> Vec<[u32; 3]> {
    let turn = |triangle: &[u32; 3]| {
        let mut triangle = *triangle;
        let least = (0..3).min_by_key(|&corner| triangle[corner]).expect("three");
        triangle.rotate_left(least);
        triangle
    };
    indices.as_chunks().0.iter().map(turn).collect()
}

/// Fails unless the document says the same, but for where bytes lie.
fn assert_same(name: &str, before: &Asset, after: &Asset) {
    let keys = |json: &Value| -> BTreeSet<String> {
        json.as_object().expect("a document").keys().cloned().collect()
    };
    let bytes = ["buffers", "bufferViews"].map(str::to_owned).into();
    let [told, found] = [before, after].map(|asset| &keys(&asset.json) - &bytes);
    assert_eq!(told, found, "{name}");
    for key in told.iter().filter(|key| !["accessors", "images"].contains(&key.as_str())) {
        assert!(before.json[key] == after.json[key], "{name}: {key}");
    }
    let stripped = |asset: &Asset, list: &str, gone: &[&str]| -> Vec<Value> {
        let mut list = asset.json[list].as_array().cloned().unwrap_or_default();
        for object in list.iter_mut().filter_map(Value::as_object_mut) {
            gone.iter().for_each(|key| drop(object.shift_remove(*key)));
        }
        list
    };
    let places = ["bufferView", "byteOffset", "sparse"];
    assert_eq!(
        stripped(before, "accessors", &places),
        stripped(after, "accessors", &places),
        "{name}"
    );
    let places = ["bufferView", "uri", "mimeType"];
    let mut images = stripped(after, "images", &places);
    for (image, told) in
        images.iter_mut().zip(before.json["images"].as_array().into_iter().flatten())
    {
        // In a .glb an image that had a file is called after it.
        if told.get("uri").is_some() && told.get("name").is_none() {
            drop(image.as_object_mut().and_then(|own| own.shift_remove("name")));
        }
    }
    assert_eq!(stripped(before, "images", &places), images, "{name}");
    assert!(before.images == after.images, "{name}: images");
    let triangles = triangle_indices(before);
    for index in 0..before.count("accessors") {
        let [told, found] = [before, after].map(|asset| elements(asset, index));
        if triangles.contains(&index) {
            let [told, found] = [told, found].map(|own| turned(&own.indices("").expect("indices")));
            assert!(told == found, "{name}: triangles of accessor {index}");
        } else {
            assert!(told == found, "{name}: accessor {index}");
        }
    }
}

/// Bakes whole and compares, in a form.
fn assert_comes_back(path: &Path, output: OutputOptions) {
    let name = path.file_name().expect("a name").to_string_lossy();
    let baked = Baked::input(Input::File(path), &whole(output));
    let baked = baked.unwrap_or_else(|error| panic!("{name}: {error}"));
    let mut level = baked.level_path(1);
    if output.format == Format::Gltf {
        level.set_extension("gltf");
    }
    assert_same(&name, &read(path), &read(&level));
}

#[test]
fn every_real_asset_comes_back_whole() {
    let Some(folder) = shared_assets() else { return };
    let all = documents(&folder);
    assert!(all.len() >= 16, "{all:?}");
    for path in all {
        assert_comes_back(&path, OutputOptions { layout: Layout::None, ..chained().output });
    }
}

#[test]
fn compressed_and_beside_their_images_real_assets_come_back_whole_too() {
    let Some(folder) = shared_assets() else { return };
    let layout = Layout::None;
    for name in ["rigged/Fox.glb", "rigged/bitmoji.glb", "nasty/points_lines_strips.glb"] {
        let output = OutputOptions { compress: true, layout, ..chained().output };
        assert_comes_back(&folder.join(name), output);
    }
    for name in [
        "compressed/cat_webp.glb",
        "compressed/mustard_bottle_ktx2/006_mustard_bottle_textured.gltf",
        "nasty/living_room_png16/living_room.gltf",
    ] {
        let output =
            OutputOptions { compress: true, format: Format::Gltf, layout, ..chained().output };
        assert_comes_back(&folder.join(name), output);
    }
}

#[test]
fn built_assets_come_back_whole_in_every_form() {
    for (name, build) in assets::all() {
        for (compress, format) in [(false, Format::Glb), (true, Format::Glb), (true, Format::Gltf)]
        {
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join(format!("{name}.glb"));
            std::fs::write(&path, build.glb()).expect("a file");
            assert_comes_back(&path, OutputOptions { compress, format, ..chained().output });
        }
    }
}

/// A sphere whose tangents are not what would be computed.
fn with_tangents() -> Build {
    let shape = shapes::sphere(24, 12);
    let mut build = Build::of(&shape);
    let tangents: Vec<[f32; 4]> = shape.positions.iter().map(|_| [0.6, 0.0, 0.8, -1.0]).collect();
    let tangents = build.floats(&tangents);
    build.json["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = json!(tangents);
    build
}

#[test]
fn tangents_of_the_source_survive_where_nothing_moved() {
    let glb = with_tangents().glb();
    let level = Baked::bytes("tangents", &glb, &whole(chained().output)).level(1);
    let rows = |output: &common::output::Output| {
        let mut meshes = output.gltf.meshes();
        let primitive = meshes.next().and_then(|mesh| mesh.primitives().next()).expect("one");
        output.rows(&primitive.get(&gltf::Semantic::Tangents).expect("tangents"))
    };
    assert!(rows(&level).iter().all(|row| *row == [0.6, 0.0, 0.8, -1.0]));
    let half = BakeOptions { targets: Targets::halves(1), ..whole(chained().output) };
    let half = Baked::bytes("tangents", &glb, &half).level(1);
    assert!(rows(&half).iter().all(|row| row[0] != 0.6), "computed anew");
}
