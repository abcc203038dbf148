//! Levels as files that a page fetches one by one: the coarsest inside, finer ones and textures beside it.

use std::collections::BTreeMap;
use std::path::Path;

use seamwise::bake::options::{Targets, Textures};
use seamwise::document::asset::Asset;
use seamwise::document::primitive::Primitive;
use seamwise::export::files::{Format, Geomorph, Layout, OutputOptions};
use seamwise::image_file::codec::decode;
use seamwise::import::options::ReadOptions;
use seamwise::import::read_bytes;
use seamwise::limit::MemoryLimit;
use seamwise::{BakeOptions, bake_bytes};
use serde_json::{Value, json};

use crate::common::rigs::{Kind, bent_bar};
use crate::common::{assets, measured, shapes, unmeasured};

const NAME: &str = "NEEDLE_progressive";

fn needle(options: BakeOptions) -> BakeOptions {
    let output = OutputOptions { layout: Layout::Needle, ..OutputOptions::default() };
    let targets = Targets::Ratios(vec![0.5, 0.2]);
    BakeOptions { output, targets, textures: Textures::Keep, ..options }
}

/// The documents of a bake by the names of their files.
fn documents(name: &str, bytes: &[u8], options: &BakeOptions) -> BTreeMap<String, Asset> {
    let baked = bake_bytes(bytes, name, options).unwrap_or_else(|e| panic!("{name}: {e}"));
    let files = baked.files.iter().filter(|file| file.name.ends_with(".glb"));
    let read = |bytes: &[u8]| read_bytes(bytes, Path::new("")).expect("a document");
    files.map(|file| (file.name.clone(), read(&file.bytes))).collect()
}

/// The triangles of each primitive of a mesh, each corner with its position.
fn triangles(asset: &Asset, mesh: usize) -> Vec<Vec<[[f32; 3]; 3]>> {
    let own = Primitive::of_mesh(asset, mesh).expect("primitives");
    let of = |own: &Primitive| {
        let positions = own.positions(asset).expect("positions");
        let triangles = own.triangles(asset, positions.len()).expect("triangles");
        triangles.iter().map(|t| t.map(|v| positions[v as usize].to_array())).collect()
    };
    own.iter().map(of).collect()
}

/// The object of a list that has a number.
fn place(asset: &Asset, list: &str, guid: &Value) -> usize {
    let all = asset.json[list].as_array().expect("a list");
    let own = all.iter().position(|own| own["extensions"][NAME]["guid"] == *guid);
    own.unwrap_or_else(|| panic!("no number {guid} in {list}"))
}

#[test]
fn each_level_of_a_mesh_is_where_the_coarsest_says() {
    for (name, build) in assets::all() {
        let bytes = build.glb();
        let source = read_bytes(&bytes, Path::new("")).expect("the source");
        let files = documents(name, &bytes, &needle(unmeasured()));
        let main = &files[&format!("{name}.glb")];
        let mut meshes = 0;
        for (mesh, own) in main.json["meshes"].as_array().expect("meshes").iter().enumerate() {
            let lods = &own["extensions"][NAME];
            if lods.is_null() {
                continue;
            }
            meshes += 1;
            let primitives = source.json["meshes"][mesh]["primitives"].as_array().map(Vec::len);
            let mut counts = vec![triangles(main, mesh).concat().len()];
            for (level, lod) in lods["lods"].as_array().expect("levels").iter().enumerate().rev() {
                let file = &files[lod["path"].as_str().expect("a path")];
                let there = triangles(file, place(file, "meshes", &lods["guid"]));
                assert_eq!(Some(there.len()), primitives, "{name}: primitives keep their places");
                assert_eq!(lod["densities"].as_array().map(Vec::len), primitives);
                counts.push(there.concat().len());
                if level == 0 {
                    assert_eq!(there, triangles(&source, mesh), "{name}: the finest is the source");
                }
            }
            assert!(counts.is_sorted_by(|a, b| a < b), "{name}: {counts:?}");
            assert!(main.json["extensionsUsed"].as_array().expect("some").contains(&json!(NAME)));
        }
        assert!(meshes > 0, "{name}: no mesh has levels");
    }
}

#[test]
fn densities_fall_with_the_certificates() {
    let bytes = assets::textured(&shapes::sphere(48, 24), &assets::picture(64)).glb();
    let options = needle(measured());
    let baked = bake_bytes(&bytes, "ball", &options).expect("a bake");
    let sizes = baked.report.levels.iter().map(|own| own.largest_size_pixels.expect("a size"));
    let files = documents("ball", &bytes, &options);
    let lods = &files["ball.glb"].json["meshes"][0]["extensions"][NAME]["lods"];
    let height = f64::from(options.screen.height) * 3.0f64.sqrt();
    for (lod, size) in lods.as_array().expect("levels").iter().zip(sizes) {
        // The only mesh is as large as the asset.
        let expected = 200_000.0 * size / height;
        let density = lod["densities"][0].as_f64().expect("a density");
        assert!((density / expected - 1.0).abs() < 1e-6, "{density} and {expected}");
    }
    assert_eq!(lods.as_array().map(Vec::len), Some(2));
    let unmeasured = documents("ball", &bytes, &needle(unmeasured()));
    let lods = &unmeasured["ball.glb"].json["meshes"][0]["extensions"][NAME]["lods"];
    assert_eq!(lods[0]["densities"], json!([(2 * 48 * 23) as f64]), "triangles");
}

#[test]
fn textures_are_small_inside_and_whole_beside() {
    let picture = assets::picture(600);
    let bytes = assets::textured(&shapes::sphere(24, 12), &picture).glb();
    let files = documents("ball", &bytes, &needle(unmeasured()));
    let main = &files["ball.glb"];
    let size = |asset: &Asset| {
        let own = decode(&asset.images[0], "", MemoryLimit::default()).expect("an image");
        [own.width(), own.height()]
    };
    assert_eq!(size(main), [75, 75]);
    let lods = &main.json["textures"][0]["extensions"][NAME];
    let sides: Vec<u32> = lods["lods"]
        .as_array()
        .expect("sizes")
        .iter()
        .map(|lod| {
            let file = &files[lod["path"].as_str().expect("a path")];
            assert_eq!(place(file, "textures", &lods["guid"]), 0);
            assert_eq!(json!(size(file)), json!([lod["width"], lod["height"]]));
            size(file)[0]
        })
        .collect();
    assert_eq!(sides, [600, 300, 150]);
    let whole = &files[lods["lods"][0]["path"].as_str().expect("a path")];
    let texels = decode(&whole.images[0], "", MemoryLimit::default()).expect("an image");
    assert_eq!(texels.to_rgba8(), picture);
    let small = assets::textured(&shapes::sphere(24, 12), &assets::picture(128)).glb();
    let files = documents("ball", &small, &needle(unmeasured()));
    assert!(files["ball.glb"].json["textures"][0].get("extensions").is_none());
}

#[test]
fn a_file_that_is_baked_again_names_no_files_of_before() {
    let bytes = assets::textured(&shapes::sphere(48, 24), &assets::picture(600)).glb();
    let before = bake_bytes(&bytes, "before", &needle(unmeasured())).expect("a bake");
    let main = before.files.iter().find(|file| file.name == "before.glb").expect("the main file");
    let plain = BakeOptions { output: OutputOptions::default(), ..needle(unmeasured()) };
    for options in [needle(unmeasured()), plain] {
        let after = bake_bytes(&main.bytes, "after", &options).expect("a bake");
        for file in &after.files {
            let text = String::from_utf8_lossy(&file.bytes);
            assert!(!text.contains("before_needle"), "{}", file.name);
        }
        let warning = after.report.warnings.iter().find(|own| own.at.ends_with(NAME));
        assert_eq!(warning.expect("a warning").times, 2, "a mesh and a texture");
    }
    let options = ReadOptions { strict: true, ..needle(unmeasured()).reading };
    let strict = BakeOptions { reading: options, ..needle(unmeasured()) };
    assert!(bake_bytes(&main.bytes, "after", &strict).is_err());
}

#[test]
fn what_a_level_has_lost_stays_to_be_found() {
    // A speck beside a ball, gone in the coarser level.
    let mut build = assets::textured(&shapes::sphere(48, 24), &assets::picture(16));
    let speck = build.primitive(&shapes::sphere(4, 3).scaled(1e-3).moved([0.0, 1.01, 0.0]));
    build.json["meshes"][0]["primitives"].as_array_mut().expect("some").push(speck);
    let bytes = build.glb();
    let options = BakeOptions { targets: Targets::Ratios(vec![0.5, 0.02]), ..needle(unmeasured()) };
    let files = documents("speck", &bytes, &options);
    assert_eq!(triangles(&files["speck_lod2.glb"], 0).len(), 1, "the level itself has lost it");
    let inside = triangles(&files["speck.glb"], 0);
    assert!(inside.len() == 2 && !inside[1].is_empty());
}

#[test]
fn skins_and_morph_targets_come_along() {
    let bytes = bent_bar(Kind::F32).glb();
    for compress in [false, true] {
        let options = needle(unmeasured());
        let output = OutputOptions { compress, ..options.output };
        let files = documents("bar", &bytes, &BakeOptions { output, ..options });
        let lods = &files["bar.glb"].json["meshes"][0]["extensions"][NAME]["lods"];
        for asset in std::iter::once(&files["bar.glb"]).chain(
            lods.as_array()
                .expect("levels")
                .iter()
                .map(|lod| &files[lod["path"].as_str().expect("a path")]),
        ) {
            let own = &Primitive::of_mesh(asset, 0).expect("primitives")[0];
            assert!(own.accessor("WEIGHTS_0").is_some() && own.accessor("JOINTS_0").is_some());
        }
        assert!(files["bar.glb"].json["nodes"].as_array().expect("nodes").len() > 1);
    }
}

#[test]
fn numbers_of_objects_differ_and_follow_from_what_they_hold() {
    let guids = |cells: u32| {
        let files = documents("cube", &assets::cube(cells).glb(), &needle(unmeasured()));
        let own = |list: &str| files["cube.glb"].json[list][0]["extensions"][NAME]["guid"].clone();
        [own("meshes"), own("textures")]
    };
    let [mesh, texture] = guids(8);
    assert_ne!(mesh, texture);
    assert_eq!(guids(8), [mesh.clone(), texture]);
    assert_ne!(guids(9)[0], mesh);
}

#[test]
fn what_it_can_not_go_with_is_refused() {
    let options = needle(unmeasured());
    let own = options.output;
    let outputs = [
        OutputOptions { format: Format::Gltf, ..own },
        OutputOptions { share_vertices: true, ..own },
        OutputOptions { geomorph: Geomorph::Attributes, ..own },
    ];
    let refusals = outputs.map(|output| BakeOptions { output, ..options.clone() });
    let textures = BakeOptions { textures: Textures::default(), ..options };
    for options in refusals.iter().chain([&textures]) {
        let refused = bake_bytes(&assets::cube(4).glb(), "a", options);
        assert!(refused.is_err_and(|error| error.to_string().contains("layout needle")));
    }
}
