//! The whole pipeline from the outside: what comes out of a bake, read by another reader.

use std::path::{Path, PathBuf};

use crate::common;
use crate::common::assets::{self, in_chart};
use crate::common::build::Build;
use crate::common::output::{Output, border, half_edges, volume6};
use crate::common::{Baked, measured, shapes, shared_assets, unmeasured};
use seamwise::bake::Input;
use seamwise::bake::options::{BakeOptions, Targets, Textures};
use seamwise::bake::steering::Steering;
use seamwise::document::asset::Asset;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::{Metrics, Options, Reference};
use seamwise::import::options::ReadOptions;
use seamwise::progress::Progress;
use seamwise::report::BakeReport;
use serde_json::{Value, json};

/// Fails unless each level is within 2 % of its target, or says why it is not.
fn assert_targets_met(name: &str, report: &BakeReport) {
    for (index, level) in report.levels.iter().enumerate() {
        let missed = level.target.saturating_sub(level.triangles) as f64;
        let said = level.why.as_ref().is_some_and(|why| !why.trim().is_empty());
        if level.reached {
            // The last step may have taken a small shell.
            assert!(
                level.triangles <= level.target && missed <= (0.02 * level.target as f64).max(15.0),
                "{name}, level {}: {level:?}",
                index + 1
            );
            assert_eq!(level.why, None, "{name}, level {}", index + 1);
        } else {
            assert!(said, "{name}, level {} does not say why: {level:?}", index + 1);
        }
    }
}

#[test]
fn four_levels_meet_their_targets_or_say_why() {
    for (name, build) in assets::all() {
        let baked = Baked::bytes(name, &build.glb(), &unmeasured());
        assert_eq!(baked.report.levels.len(), 4, "{name}");
        assert_targets_met(name, &baked.report);
        for (level, (report, output)) in baked.report.levels.iter().zip(baked.levels()).enumerate()
        {
            assert_eq!(report.ratio, 0.5f64.powi(level as i32 + 1), "{name}");
            let target = (report.ratio * baked.report.input.triangles as f64).round();
            assert!(report.target.abs_diff(target as usize) <= baked.report.input.meshes, "{name}");
            assert_eq!(output.triangle_count(), report.triangles, "{name}, level {}", level + 1);
        }
    }
}

#[test]
fn nothing_but_its_shape_keeps_a_sound_surface_from_its_targets() {
    let steering = Steering { max_deviation: None, ..Steering::default() };
    let options = BakeOptions { steering, ..unmeasured() };
    for (name, build) in assets::all() {
        let is_sound =
            ["sphere", "torus", "seam_cube", "patch", "two_materials", "rigged", "mixed"];
        if is_sound.contains(&name) {
            let baked = Baked::bytes(name, &build.glb(), &options);
            let missed: Vec<_> = baked.report.levels.iter().filter(|l| !l.reached).collect();
            assert!(missed.is_empty(), "{name}: {missed:?}");
        }
    }
}

#[test]
fn triangle_counts_can_be_asked_for() {
    let glb = Build::of(&shapes::sphere(48, 24)).glb();
    let targets = Targets::triangles(vec![1500, 400, 90]).unwrap();
    let baked = Baked::bytes("sphere", &glb, &BakeOptions { targets, ..unmeasured() });
    let got: Vec<usize> = baked.report.levels.iter().map(|level| level.triangles).collect();
    assert_eq!(got.len(), 3);
    for (got, asked) in got.iter().zip([1500, 400, 90]) {
        assert!(got.abs_diff(asked) as f64 <= (0.02 * asked as f64).max(1.0), "{got} for {asked}");
    }
}

#[test]
fn an_error_bound_is_kept_and_named_as_the_reason() {
    let glb = Build::of(&shapes::patch(24)).glb();
    let free = Baked::bytes("patch", &glb, &unmeasured());
    let bound = free.report.levels[1].error;
    let steering = Steering { max_error: Some(bound), ..Steering::default() };
    let held = Baked::bytes("patch", &glb, &BakeOptions { steering, ..unmeasured() });
    let last = &held.report.levels[3];
    assert!(last.error <= bound, "{last:?}");
    assert!(!last.reached && last.why.is_some(), "{last:?}");
}

/// Checks what every written file must hold to, whatever the asset.
fn assert_sound(name: &str, output: &Output) {
    for mesh in 0..output.gltf.meshes().len() {
        for part in output.parts(mesh) {
            let count = part.positions.len();
            assert!(
                part.triangles.iter().flatten().all(|&v| (v as usize) < count),
                "{name}: index"
            );
            let finite = part.positions.iter().flatten().chain(part.uvs.iter().flatten());
            assert!(finite.into_iter().all(|x| x.is_finite()), "{name}: not finite");
            for attribute in [&part.normals, &part.uvs] {
                assert!(attribute.is_empty() || attribute.len() == count, "{name}: lengths differ");
            }
            for normal in &part.normals {
                let length = normal.iter().map(|x| x * x).sum::<f32>().sqrt();
                assert!((length - 1.0).abs() < 0.01, "{name}: normal of length {length}");
            }
            if count < 65_535 && name.contains("_lod") {
                // Where the level is the source they are the source's: bytes, or none at all.
                let bits = part.index_bits;
                assert!([0, 8, 16].contains(&bits), "{name}: {count} vertices, {bits} bits");
            }
        }
    }
    for primitive in output.gltf.meshes().flat_map(|mesh| mesh.primitives()) {
        let positions = primitive.get(&gltf::Semantic::Positions).expect("positions");
        let raw = output.json.pointer(&format!("/accessors/{}", positions.index())).unwrap();
        let is_normalized = raw["normalized"] == json!(true);
        for (key, pick) in [("min", f32::min as fn(f32, f32) -> f32), ("max", f32::max)] {
            for axis in 0..3 {
                let told = raw[key][axis].as_f64().expect("a bound") as f32;
                let told = if is_normalized { (told / 32767.0).max(-1.0) } else { told };
                let rows = output.rows(&positions);
                let found = rows.iter().map(|row| row[axis]).reduce(pick).expect("positions");
                assert_eq!(told, found, "{name}: {key} of axis {axis}");
            }
        }
    }
}

#[test]
fn every_file_is_valid_and_read_back() {
    for (name, build) in assets::all() {
        let baked = Baked::bytes(name, &build.glb(), &unmeasured());
        let levels = (1..=4).map(|level| (format!("{name}_lod{level}"), baked.level_path(level)));
        for (name, path) in levels.chain([(name.to_owned(), baked.chain_path())]) {
            assert_sound(&name, &Output::read(&path));
            let again = seamwise::import::read(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
            load(&again, &mut TextureCache::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        }
    }
}

#[test]
fn what_the_levels_replace_is_gone_from_their_files() {
    for (name, build) in assets::all() {
        let baked = Baked::bytes(name, &build.glb(), &unmeasured());
        for output in baked.levels() {
            let used = output.used_accessors();
            for accessor in output.gltf.accessors().filter(|a| !used.contains(&a.index())) {
                assert!(
                    accessor.view().is_none(),
                    "{name}: unused accessor {} keeps bytes",
                    accessor.index()
                );
            }
        }
        let size = |level| std::fs::metadata(baked.level_path(level)).expect("a file").len();
        assert!((2..=4).all(|level| size(level) <= size(level - 1)), "{name}: levels grow");
    }
}

#[test]
fn what_no_stage_changes_survives() {
    let source = assets::rigged();
    let baked = Baked::bytes("rigged", &source.glb(), &unmeasured());
    let before = Output::from_bytes(&source.glb(), "source");
    let kept = [
        "scene",
        "scenes",
        "materials",
        "textures",
        "samplers",
        "skins",
        "animations",
        "cameras",
        "extras",
        "nodes",
    ];
    for output in baked.levels() {
        for key in kept {
            assert_eq!(output.json[key], source.json[key], "{key}");
        }
        assert_eq!(output.json["meshes"][0]["extras"], source.json["meshes"][0]["extras"]);
        assert_eq!(output.json["meshes"][0]["weights"], source.json["meshes"][0]["weights"]);
        let primitive = |json: &Value| json["meshes"][0]["primitives"][0].clone();
        assert_eq!(primitive(&output.json)["extras"], primitive(&source.json)["extras"]);
        assert_eq!(primitive(&output.json)["material"], primitive(&source.json)["material"]);
        assert_motion_kept(&before, &output);
        assert_weights_sum_to_one(&output);
    }
    let chain = baked.chain();
    for key in kept.into_iter().filter(|key| !["nodes", "animations"].contains(key)) {
        assert_eq!(chain.json[key], source.json[key], "{key}");
    }
    // Of the animations there is more: the levels follow those of the morph weights.
    for (own, other) in source.json["animations"]
        .as_array()
        .expect("a list")
        .iter()
        .zip(chain.json["animations"].as_array().expect("a list"))
    {
        assert_eq!(own["samplers"], other["samplers"]);
        let channels = |json: &Value| json["channels"].as_array().expect("a list").clone();
        assert!(channels(own).iter().all(|channel| channels(other).contains(channel)));
    }
    assert_motion_kept(&before, &chain);
}

/// Fails unless the samplers of the animations and the skins' matrices hold the same bytes.
fn assert_motion_kept(before: &Output, after: &Output) {
    let samplers = |output: &Output| -> Vec<Vec<u8>> {
        let animations = output.gltf.animations();
        let samplers = animations.flat_map(|animation| animation.samplers().collect::<Vec<_>>());
        samplers
            .flat_map(|sampler| [sampler.input(), sampler.output()])
            .chain(output.gltf.skins().filter_map(|skin| skin.inverse_bind_matrices()))
            .map(|accessor| output.element_bytes(&accessor))
            .collect()
    };
    assert_eq!(samplers(before), samplers(after));
    assert_eq!(samplers(before).len(), 5);
}

/// Fails unless every vertex has joints whose weights sum to 1, and both morph rows.
fn assert_weights_sum_to_one(output: &Output) {
    let primitive = output.gltf.meshes().next().and_then(|mesh| mesh.primitives().next()).unwrap();
    let count = primitive.get(&gltf::Semantic::Positions).unwrap().count();
    let joints = output.rows(&primitive.get(&gltf::Semantic::Joints(0)).expect("joints"));
    let weights = output.rows(&primitive.get(&gltf::Semantic::Weights(0)).expect("weights"));
    assert_eq!((joints.len(), weights.len()), (count, count));
    assert!(joints.iter().all(|row| row.iter().all(|&joint| joint == 0.0 || joint == 1.0)));
    assert!(weights.iter().all(|row| (row.iter().sum::<f32>() - 1.0).abs() < 1e-3));
    let target = primitive.morph_targets().next().expect("a morph target");
    let moves = target.positions().expect("its positions");
    assert_eq!(moves.count(), count);
    // The target lifts by 0.5 − 0.5 x: so it does at the points where the level's vertices are.
    let positions = output.rows(&primitive.get(&gltf::Semantic::Positions).unwrap());
    let off = output
        .rows(&moves)
        .iter()
        .zip(&positions)
        .map(|(m, p)| (m[1] - (0.5 - 0.5 * p[0])).abs())
        .fold(0.0, f32::max);
    assert!(off < 0.02, "a morph target is off by {off}");
}

#[test]
fn each_node_names_its_levels_the_finest_first() {
    for (name, build) in assets::all() {
        let baked = Baked::bytes(name, &build.glb(), &unmeasured());
        let chain = baked.chain();
        let used = chain.json["extensionsUsed"].as_array().expect("a list");
        assert!(used.contains(&json!("MSFT_lod")), "{name}");
        let nodes = chain.json["nodes"].as_array().expect("a list");
        let linked: Vec<&Value> =
            nodes.iter().filter(|n| n.pointer("/extensions/MSFT_lod").is_some()).collect();
        assert_eq!(linked.len(), 1, "{name}");
        let ids = linked[0]["extensions"]["MSFT_lod"]["ids"].as_array().expect("ids");
        assert_eq!(ids.len(), 4, "{name}");
        for (id, report) in ids.iter().zip(&baked.report.levels) {
            let level = &nodes[id.as_u64().expect("an index") as usize];
            let mesh = level["mesh"].as_u64().expect("a mesh") as usize;
            let triangles: usize = chain.parts(mesh).iter().map(|part| part.triangles.len()).sum();
            assert_eq!(triangles, report.triangles, "{name}");
            for key in ["translation", "rotation", "scale", "matrix", "skin"] {
                assert_eq!(level.get(key), linked[0].get(key), "{name}: {key}");
            }
        }
        let is_child = |id: &Value| {
            let lists = nodes.iter().filter_map(|node| node.get("children"));
            let lists =
                lists.chain(chain.json["scenes"].as_array().unwrap().iter().map(|s| &s["nodes"]));
            lists.filter_map(Value::as_array).any(|list| list.contains(id))
        };
        assert!(!ids.iter().any(is_child), "{name}: a level stands in the scene by itself");
    }
}

#[test]
fn points_and_lines_are_carried_through() {
    let source = assets::mixed();
    let before = Output::from_bytes(&source.glb(), "source");
    let shapes = |output: &Output| -> Vec<_> {
        let mesh = output.gltf.meshes().next().expect("a mesh");
        let others = mesh.primitives().filter(|p| p.mode() != gltf::mesh::Mode::Triangles);
        others
            .map(|primitive| {
                let positions = output.rows(&primitive.get(&gltf::Semantic::Positions).unwrap());
                let indices = primitive.indices().map(|accessor| output.element_bytes(&accessor));
                (primitive.mode(), positions, indices)
            })
            .collect()
    };
    assert_eq!(shapes(&before).len(), 3);
    let baked = Baked::bytes("mixed", &source.glb(), &unmeasured());
    for output in baked.levels().into_iter().chain([baked.chain()]) {
        assert_eq!(shapes(&output), shapes(&before));
    }
}

#[test]
fn a_seam_keeps_its_two_sides() {
    let baked = Baked::bytes("cube", &assets::cube(12).glb(), &unmeasured());
    for (level, output) in baked.levels().iter().enumerate() {
        for part in output.parts(0) {
            for triangle in &part.triangles {
                let cells = triangle.map(|v| {
                    let uv = &part.uvs[v as usize];
                    ((uv[0] * 3.0).floor() as i32, (uv[1] * 2.0).floor() as i32)
                });
                assert!(
                    cells.iter().all(|cell| *cell == cells[0]),
                    "level {}: {cells:?}",
                    level + 1
                );
            }
        }
    }
    let torus = assets::textured(&shapes::torus(48, 24), &assets::picture(64));
    let baked = Baked::bytes("torus", &torus.glb(), &unmeasured());
    for (level, output) in baked.levels().iter().enumerate() {
        for part in output.parts(0) {
            let extent = |triangle: &[u32; 3], axis: usize| {
                let at = triangle.map(|v| part.uvs[v as usize][axis]);
                at.iter()
                    .fold(0.0f32, |far, a| at.iter().map(|b| (a - b).abs()).fold(far, f32::max))
            };
            let most = part.triangles.iter().flat_map(|t| [extent(t, 0), extent(t, 1)]);
            let most = most.fold(0.0, f32::max);
            assert!(most < 0.6, "level {}: a triangle spans {most} of the atlas", level + 1);
        }
    }
}

#[test]
fn no_crack_opens_between_two_materials() {
    let baked = Baked::bytes("two", &assets::two_materials(24).glb(), &unmeasured());
    for (level, output) in baked.levels().iter().enumerate() {
        let parts = output.parts(0);
        assert_eq!(parts.iter().map(|part| part.material).collect::<Vec<_>>(), [Some(0), Some(1)]);
        for [a, b] in border(&parts) {
            let on_rim = (0..3).step_by(2).any(
                |axis| // A rim may drift a little; the materials meet at x = 0, far from any.
                (a[axis].abs() - 1.0).abs() < 0.02 && (a[axis] - b[axis]).abs() < 0.02,
            );
            assert!(on_rim, "level {}: a crack from {a:?} to {b:?}", level + 1);
        }
    }
}

#[test]
fn what_is_closed_stays_closed_and_faces_outward() {
    for (name, shape) in [
        ("sphere", shapes::sphere(48, 24)),
        ("torus", shapes::torus(48, 24)),
        ("seam_cube", shapes::seam_cube(12)),
    ] {
        let glb = Build::of(&shape).glb();
        let volume = volume6(&Output::from_bytes(&glb, name).parts(0));
        let baked = Baked::bytes(name, &glb, &unmeasured());
        for (level, output) in baked.levels().iter().enumerate() {
            let parts = output.parts(0);
            let edges = half_edges(&parts);
            let odd =
                edges.iter().filter(|(edge, n)| **n != 1 || !edges.contains_key(&(edge.1, edge.0)));
            assert_eq!(odd.count(), 0, "{name}, level {}: open or not manifold", level + 1);
            let ratio = volume6(&parts) / volume;
            assert!((0.8..1.1).contains(&ratio), "{name}, level {}: volume {ratio}", level + 1);
        }
    }
}

#[test]
fn a_flat_cube_loses_no_shape_at_all() {
    // The source's seams bleed, and a repaired atlas would count as a difference.
    let options = BakeOptions { textures: Textures::Keep, reference_as_is: true, ..measured() };
    let baked = Baked::bytes("cube", &assets::cube(12).glb(), &options);
    for level in &baked.report.levels {
        let metrics = level.metrics.expect("metrics");
        assert!(metrics.distance_max < 1e-5, "{metrics:?}");
        assert!(metrics.color_rms < 0.01, "{metrics:?}");
        assert!((metrics.volume_ratio.expect("a volume") - 1.0).abs() < 1e-4, "{metrics:?}");
    }
}

#[test]
fn repair_leaves_valid_texels_and_no_garish_one() {
    let glb = assets::cube(12).glb();
    let baked = Baked::bytes("cube", &glb, &unmeasured());
    let before = assets::cube_atlas();
    for output in baked.levels().into_iter().chain([baked.chain()]) {
        let after = image::load_from_memory(output.image_bytes(0)).expect("an image");
        assert_eq!(after.color(), image::ColorType::Rgb8);
        let after = after.to_rgba8();
        assert_eq!(after.dimensions(), before.dimensions());
        for (x, y, texel) in after.enumerate_pixels() {
            if in_chart(x, y) {
                assert_eq!(texel, before.get_pixel(x, y), "valid texel at {x}, {y}");
            } else {
                // No chart is brighter than 146 in red or 90 in blue.
                assert!(texel[0] < 160 && texel[2] < 105, "garish texel {texel:?} at {x}, {y}");
            }
        }
    }
}

#[test]
fn textures_that_are_kept_are_kept_to_the_byte() {
    let glb = assets::cube(8).glb();
    let before = Output::from_bytes(&glb, "source");
    let baked =
        Baked::bytes("cube", &glb, &BakeOptions { textures: Textures::Keep, ..unmeasured() });
    for output in baked.levels().into_iter().chain([baked.chain()]) {
        assert_eq!(output.image_bytes(0), before.image_bytes(0));
    }
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    for (name, build) in assets::all() {
        let bake = |threads| {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| {
                let baked = Baked::bytes(name, &build.glb(), &measured());
                let mut files = baked.files();
                files.retain(|(name, _)| name.ends_with(".glb"));
                (files, format!("{:?}", baked.report.levels))
            })
        };
        let one = bake(1);
        assert_eq!(one.0.len(), 5, "{name}");
        for threads in [2, 5] {
            assert!(one == bake(threads), "{name}: {threads} threads give something else");
        }
    }
}

/// How far one document's surface is from another's.
fn compare(reference: &Build, candidate: &Build) -> Metrics {
    let scene = |build: &Build| {
        let asset: Asset =
            seamwise::import::read_bytes(&build.glb(), Path::new("")).expect("an asset");
        load(&asset, &mut TextureCache::default()).expect("a scene")
    };
    let options = Options {
        views: 2,
        resolution: 64,
        samples: 5_000,
        pixel_tolerance: 1.0,
        screen_height: 128,
    };
    let reference = scene(reference);
    Reference::new(&reference, options).unwrap().compare(&scene(candidate)).unwrap()
}

#[test]
fn however_a_surface_is_stored_it_is_the_same_surface() {
    let plain = Build::of(&shapes::patch(24));
    let triangles = Baked::bytes("plain", &plain.glb(), &unmeasured()).report.input;
    for (name, build) in [
        ("unindexed", assets::unindexed(24)),
        ("strips", assets::strips(24)),
        ("quantized", assets::quantized(24)),
    ] {
        let report = Baked::bytes(name, &build.glb(), &unmeasured()).report;
        assert_eq!(report.input.triangles, triangles.triangles, "{name}");
        assert_eq!(report.input.points, triangles.points, "{name}");
        let metrics = compare(&plain, &build);
        assert!(metrics.distance_max < 3e-5, "{name}: {metrics:?}");
        assert!(metrics.normal_degrees_rms < 0.6, "{name}: {metrics:?}");
        assert!((metrics.area_ratio - 1.0).abs() < 1e-3, "{name}: {metrics:?}");
    }
}

#[test]
fn a_gltf_with_files_beside_it_bakes_as_a_glb_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let build = assets::cube(8);
    let path = build.write_gltf(folder.path(), "cube");
    let from_gltf = Baked::input(Input::File(&path), &unmeasured()).expect("a bake");
    let from_glb = Baked::bytes("cube", &build.glb(), &unmeasured());
    for (level, (a, b)) in from_gltf.levels().iter().zip(from_glb.levels()).enumerate() {
        let same = a.parts(0).iter().zip(b.parts(0)).all(|(a, b)| {
            a.positions == b.positions && a.triangles == b.triangles && a.uvs == b.uvs
        });
        assert!(same, "level {}", level + 1);
    }
}

#[test]
fn an_input_is_never_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("cube.glb");
    let glb = assets::cube(4).glb();
    std::fs::write(&path, &glb).expect("a file");
    let progress = seamwise::progress::Progress::hidden();
    let result = seamwise::bake::bake(Input::File(&path), folder.path(), &unmeasured(), &progress);
    assert!(matches!(result, Err(seamwise::error::Error::Options { .. })), "{result:?}");
    assert_eq!(common::folder_files(folder.path()), [("cube.glb".to_owned(), glb)]);
}

/// All .glb and .gltf files under a folder, in order.
fn models(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let entries = std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path());
    for path in entries {
        if path.is_dir() {
            found.extend(models(&path));
        } else if path.extension().is_some_and(|kind| kind == "glb" || kind == "gltf") {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[test]
#[ignore = "long: real models; the gate runs it"]
fn real_assets_bake() {
    let Some(folder) = shared_assets() else {
        return;
    };
    let mut wrong = Vec::new();
    let mut baked_count = 0;
    for path in models(&folder) {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        // Filling the atlases of a real model takes most of a bake; one model stands for it.
        let textures = if name == "popcorn.glb" { Textures::Repair } else { Textures::Keep };
        let start = std::time::Instant::now();
        // One of them lacks a texture.
        let reading = ReadOptions { allow_missing: true, ..ReadOptions::default() };
        let options = BakeOptions { textures, reading, ..unmeasured() };
        let result = Baked::input(Input::File(&path), &options);
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{name}: {seconds:.1} s{}",
            result.as_ref().err().map_or(String::new(), |e| format!(", {e}"))
        );
        match result {
            Ok(baked) => {
                baked_count += 1;
                assert_targets_met(&name, &baked.report);
                for (level, output) in baked.levels().iter().enumerate() {
                    assert_sound(&format!("{name}_lod{}", level + 1), output);
                }
                baked.chain();
            }
            Err(error) => wrong.push(format!("{name}: {error}")),
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(baked_count >= 16, "only {baked_count} assets were found");
}

/// Keeps what it is to show above its bars.
#[derive(Debug, Default)]
struct Notes(std::sync::Mutex<Vec<String>>);

impl seamwise::progress::Display for Notes {
    fn stage(&self, _name: &str, _total: usize) -> Box<dyn seamwise::progress::Bar> {
        Box::new(())
    }

    fn note(&self, text: &str) {
        self.0.lock().expect("notes").push(text.to_owned());
    }
}

#[test]
fn a_first_look_has_about_the_figures_that_follow() {
    let options = BakeOptions { preview: true, textures: Textures::Keep, ..measured() };
    let notes = std::sync::Arc::new(Notes::default());
    let progress = Progress::new(notes.clone());
    let (glb, folder) = (assets::cube(12).glb(), tempfile::tempdir().expect("a folder"));
    let report =
        seamwise::bake::bake(Input::Bytes(&glb, "cube"), folder.path(), &options, &progress);
    let report = report.expect("levels");
    let notes = notes.0.lock().expect("notes");
    let lines: Vec<Vec<&str>> =
        notes[0].lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!((notes.len(), lines.len()), (1, report.levels.len() + 2), "{notes:?}");
    for (line, level) in lines[2..].iter().zip(&report.levels) {
        assert_eq!(line[1].replace(',', ""), level.triangles.to_string());
        let (own, exact) =
            (line[4].parse::<f64>().expect("a distance"), level.metrics.expect("figures"));
        let near = (0.7..1.4).contains(&(own / exact.distance_rms));
        assert!(near || exact.distance_rms < 1e-9, "{own} of {}", exact.distance_rms);
    }
}
