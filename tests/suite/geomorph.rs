//! Levels that change to the next without a jump: at the end of its way each is the next, to the bit.

use std::collections::BTreeMap;
use std::path::Path;

use seamwise::bake::options::{BudgetPer, Targets, Textures};
use seamwise::document::accessor::{Elements, read as read_accessor};
use seamwise::document::asset::Asset;
use seamwise::document::primitive::Primitive;
use seamwise::export::files::{Geomorph, Layout, OutputOptions};
use seamwise::import::read_bytes;
use seamwise::{BakeOptions, bake_bytes};

use crate::common::{assets, shared_assets, unmeasured};

fn morphing(geomorph: Geomorph) -> BakeOptions {
    let output = OutputOptions { geomorph, layout: Layout::MsftLod, ..OutputOptions::default() };
    let targets = Targets::Ratios(vec![0.6, 0.3, 0.15]);
    BakeOptions { output, targets, textures: Textures::Keep, ..unmeasured() }
}

/// The levels alone, the finest first, and then the document of all.
fn documents(name: &str, bytes: &[u8], options: &BakeOptions) -> Vec<Asset> {
    let baked = bake_bytes(bytes, name, options).unwrap_or_else(|e| panic!("{name}: {e}"));
    let files = baked.files.iter().filter(|file| file.name.ends_with(".glb"));
    files.map(|file| read_bytes(&file.bytes, Path::new("")).expect("a document")).collect()
}

/// The way that is gone.
#[derive(Clone, Copy, PartialEq)]
enum Time {
    Start,
    End,
}

const NAMES: [&str; 5] = ["POSITION", "NORMAL", "TEXCOORD_0", "TEXCOORD_1", "COLOR_0"];

/// Triangles with an area by their materials, and how often each is there.
fn drawn(asset: &Asset, meshes: &[usize], time: Time) -> BTreeMap<(usize, Vec<u32>), usize> {
    let mut all = BTreeMap::new();
    for own in meshes.iter().flat_map(|&mesh| Primitive::of_mesh(asset, mesh).expect("primitives"))
    {
        if !own.is_surface() {
            continue;
        }
        let count = own.positions(asset).expect("positions").len();
        let elements = |name: &str| -> Option<Elements> {
            let morphed = own.accessor(&format!("_GEOMORPH_{name}")).filter(|_| time == Time::End);
            let accessor = morphed.or_else(|| own.accessor(name))?;
            Some(read_accessor(asset, accessor, name).expect("elements"))
        };
        let elements: Vec<Elements> = NAMES.iter().filter_map(|name| elements(name)).collect();
        let corner = |vertex: u32| -> Vec<u32> {
            let rows = elements.iter().flat_map(|own| own.row(vertex as usize));
            rows.map(|x| (x + 0.0).to_bits()).collect()
        };
        let at = format!("/meshes/{}/primitives/{}/material", own.mesh, own.index);
        let material =
            asset.json.pointer(&at).and_then(serde_json::Value::as_u64).unwrap_or(99) as usize;
        for triangle in own.triangles(asset, count).expect("triangles") {
            let mut corners = triangle.map(corner);
            let [a, b, c] = [0, 1, 2].map(|at| &corners[at][..3]);
            if a == b || b == c || c == a {
                continue;
            }
            let first = (0..3).min_by_key(|&at| &corners[at]).expect("three");
            corners.rotate_left(first);
            *all.entry((material, corners.concat())).or_default() += 1;
        }
    }
    all
}

fn all_meshes(asset: &Asset) -> Vec<usize> {
    (0..asset.json["meshes"].as_array().map_or(0, Vec::len)).collect()
}

fn assert_ends(name: &str, bytes: &[u8], options: &BakeOptions) {
    let source = read_bytes(bytes, Path::new("")).expect("the source");
    let documents = documents(name, bytes, options);
    let (all, levels) = documents.split_last().expect("documents");
    for (at, pair) in levels.windows(2).enumerate() {
        let end = drawn(&pair[0], &all_meshes(&pair[0]), Time::End);
        let next = drawn(&pair[1], &all_meshes(&pair[1]), Time::Start);
        assert!(end == next, "{name}: level {} does not end in the next", at + 1);
    }
    // Meshes of the source keep their numbers beside those of the levels.
    let own = all_meshes(&source);
    assert!(drawn(all, &own, Time::Start) == drawn(&source, &own, Time::Start), "{name}");
    let end = drawn(all, &own, Time::End);
    let first = drawn(&levels[0], &all_meshes(&levels[0]), Time::Start);
    assert!(end == first, "{name}: the source does not end in level 1");
}

#[test]
fn each_level_ends_in_the_next_to_the_bit() {
    for (name, build) in assets::all() {
        for budget_per in [BudgetPer::Scene, BudgetPer::Mesh] {
            let options = BakeOptions { budget_per, ..morphing(Geomorph::Attributes) };
            assert_ends(name, &build.glb(), &options);
        }
    }
}

#[test]
fn levels_of_real_assets_end_in_the_next() {
    let sample = include_bytes!("../../data/sample.glb");
    let options = BakeOptions { polish: None, ..morphing(Geomorph::Attributes) };
    assert_ends("sample", sample, &options);
    let Some(folder) = shared_assets() else {
        return println!("skipped: no shared assets");
    };
    for own in ["scan/popcorn.glb", "rigged/Fox.glb"] {
        let bytes = std::fs::read(folder.join(own)).expect("an asset");
        assert_ends(own.rsplit('/').next().unwrap_or(own), &bytes, &options);
    }
}

#[test]
fn a_target_leads_as_far_as_the_attributes_do() {
    let mut morphs = 0;
    for document in documents("cube", &assets::cube(12).glb(), &morphing(Geomorph::Target)) {
        for mesh in all_meshes(&document) {
            for own in Primitive::of_mesh(&document, mesh).expect("primitives") {
                let read = |index| read_accessor(&document, index, "").expect("elements");
                let Some(end) = own.accessor("_GEOMORPH_POSITION").map(read) else { continue };
                let target = &own.targets[0];
                let moves = target.iter().find(|(name, _)| name == "POSITION").expect("positions");
                let (start, moves) =
                    (own.accessor("POSITION").map(read).expect("some"), read(moves.1));
                for ((start, by), end) in
                    start.floats().iter().zip(moves.floats()).zip(end.floats())
                {
                    assert!((start + by - end).abs() <= end.abs().max(start.abs()) * f32::EPSILON);
                }
                let at = format!("/meshes/{mesh}/extras/targetNames/0");
                let name = document.json.pointer(&at).and_then(|name| name.as_str());
                assert_eq!(name, Some("geomorph"));
                morphs += 1;
            }
        }
    }
    assert_eq!(morphs, 5, "two levels alone; the source and two beside each other");
}

#[test]
fn textures_of_each_levels_own_leave_uvs_out_with_a_warning() {
    let textures = Textures::Transfer(seamwise::transfer::TransferOptions::default());
    let options = BakeOptions { textures, ..morphing(Geomorph::Attributes) };
    let bytes = assets::cube(12).glb();
    let baked = bake_bytes(&bytes, "cube", &options).expect("a bake");
    assert!(baked.report.warnings.iter().any(|own| own.what.contains("textures of its own")));
    for document in documents("cube", &bytes, &options).iter().take(2) {
        let own = &Primitive::of_mesh(document, 0).expect("primitives")[0];
        assert!(own.accessor("_GEOMORPH_POSITION").is_some());
        assert!(own.accessor("_GEOMORPH_TEXCOORD_0").is_none());
    }
}

#[test]
fn small_integers_and_shared_vertices_are_refused() {
    for (compress, share_vertices) in [(true, false), (false, true)] {
        let options = morphing(Geomorph::Attributes);
        let output = OutputOptions { compress, share_vertices, ..options.output };
        let refused = bake_bytes(&assets::cube(4).glb(), "a", &BakeOptions { output, ..options });
        assert!(refused.is_err_and(|error| error.to_string().contains("geomorph")));
    }
}
