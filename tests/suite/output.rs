//! In which files a bake is written: compressed, as .gltf, with levels by name.

use std::collections::BTreeSet;
use std::path::Path;

use crate::common::build::Build;
use crate::common::output::Output;
use crate::common::rigs::{Kind, bent_bar};
use crate::common::{
    Baked, assets, chained, folder_files, measured, shapes, shared_assets, unmeasured,
};
use gltf::Semantic;
use seamwise::bake::Input;
use seamwise::bake::options::{BakeOptions, Targets};
use seamwise::bake::steering::Steering;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::scene::Scene;
use seamwise::export::files::{Format, Layout, OutputOptions};
use seamwise::import::read;
use seamwise_attr::Placement;
use serde_json::{Value, json};

fn options(output: OutputOptions) -> BakeOptions {
    BakeOptions { targets: Targets::halves(2), output, ..unmeasured() }
}

fn compressed() -> OutputOptions {
    OutputOptions { compress: true, ..chained().output }
}

fn scene(path: &Path) -> Scene {
    load(&read(path).expect("an asset"), &mut TextureCache::default()).expect("a scene")
}

/// The largest distance between vertices of two scenes of the same triangles, turned at most.
fn farthest(a: &Scene, b: &Scene) -> f32 {
    assert_eq!(a.triangles.len(), b.triangles.len());
    for (own, other) in a.triangles.iter().zip(&b.triangles) {
        let turns = [0, 1, 2].map(|turn| [0, 1, 2].map(|corner| other[(corner + turn) % 3]));
        assert!(turns.contains(own), "{own:?} and {other:?}");
    }
    a.positions.iter().zip(&b.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

#[test]
fn compressed_levels_lie_where_plain_ones_do_and_are_smaller() {
    let mut build = assets::textured(&shapes::sphere(64, 32), &assets::picture(16));
    build.json["nodes"][0]["scale"] = json!([2.0, 2.0, 2.0]);
    build.json["nodes"][0]["name"] = json!("ball");
    let glb = build.glb();
    let plain = Baked::bytes("ball", &glb, &options(chained().output));
    let small = Baked::bytes("ball", &glb, &options(compressed()));
    for level in [1, 2] {
        let [own, other] = [&plain, &small].map(|baked| scene(&baked.level_path(level)));
        // A cube of 4 in the world around the sphere, in 65,535 steps.
        let off = farthest(&own, &other);
        assert!(off > 0.0 && off <= 4.0 / 65535.0 * 0.75f32.sqrt() * 1.01, "{off}");
        let size =
            |baked: &Baked| std::fs::metadata(baked.level_path(level)).expect("a file").len();
        assert!(size(&small) * 2 < size(&plain), "{} and {}", size(&small), size(&plain));
    }
    let document = read_json(&small.level_path(1));
    let required = ["KHR_mesh_quantization", "EXT_meshopt_compression"];
    assert_eq!(document["extensionsRequired"], json!(required));
    assert_eq!(document["nodes"][0]["children"], json!([1]), "its own scale stays its own");
    assert_eq!(scene(&small.chain_path()).triangles.len(), 2 * 64 * 31, "the source itself");
    assert_eq!(farthest(&scene(&small.chain_path()), &scene(&plain.chain_path())), 0.0);
}

fn read_json(path: &Path) -> Value {
    let glb = std::fs::read(path).expect("a file");
    let glb = gltf::Glb::from_slice(&glb).expect("a container");
    serde_json::from_slice(&glb.json).expect("a document")
}

#[test]
fn what_is_measured_of_a_compressed_level_is_what_is_written() {
    let glb = assets::textured(&shapes::sphere(48, 24), &assets::picture(16)).glb();
    let output = compressed();
    let targets = Targets::halves(1);
    let baked = Baked::bytes("ball", &glb, &BakeOptions { output, targets, ..measured() });
    let metrics = baked.report.levels[0].metrics.expect("figures");
    let reader = seamwise::import::read_bytes(&glb, Path::new("")).expect("an asset");
    let source = load(&reader, &mut TextureCache::default()).expect("a scene");
    let options = measured().evaluation().expect("figures");
    let reference = seamwise::evaluate::Reference::new(&source, options).expect("a reference");
    let again = reference.compare(&scene(&baked.level_path(1))).expect("figures");
    // Triangles come back turned, and so their samples elsewhere.
    let off = (again.distance_rms - metrics.distance_rms).abs();
    assert!(metrics.distance_rms > 0.0 && off < 0.02 * metrics.distance_rms, "{off}");
}

#[test]
fn under_a_skin_positions_stay_floats_and_weights_become_bytes() {
    let glb = bent_bar(Kind::F32).glb();
    let targets = Targets::ratios(vec![0.02]).expect("a ratio");
    let options = BakeOptions { targets, ..options(compressed()) };
    let baked = Baked::bytes("bar", &glb, &options);
    let level = read_json(&baked.level_path(1));
    let attributes = &level["meshes"][0]["primitives"][0]["attributes"];
    let accessor = |name: &str| {
        let index = attributes[name].as_u64().expect("an accessor") as usize;
        let own = &level["accessors"][index];
        (own["componentType"].as_u64().expect("a type"), own["normalized"] == json!(true))
    };
    assert_eq!(accessor("POSITION"), (5126, false));
    assert_eq!(accessor("NORMAL"), (5120, true));
    assert_eq!(accessor("JOINTS_0"), (5121, false));
    assert_eq!(accessor("WEIGHTS_0"), (5121, true));
    assert_eq!(level["nodes"], bent_bar(Kind::F32).json["nodes"], "no node is changed");
}

#[test]
fn names_group_the_source_and_its_levels_under_the_node() {
    let layout = Layout::Names;
    let mut build = Build::of(&shapes::sphere(32, 16));
    build.json["nodes"][0]["name"] = json!("ball");
    build.json["nodes"][0]["translation"] = json!([1.0, 0.0, 0.0]);
    let output = OutputOptions { layout, ..chained().output };
    let chain = Baked::bytes("ball", &build.glb(), &options(output)).chain();
    let names: Vec<&str> = chain.gltf.nodes().filter_map(|node| node.name()).collect();
    assert_eq!(names, ["ball", "ball_LOD0", "ball_LOD1", "ball_LOD2"]);
    let group = chain.gltf.nodes().next().expect("a node");
    assert!(group.mesh().is_none());
    let triangles: Vec<usize> = group
        .children()
        .map(|child| chain.parts(child.mesh().expect("a mesh").index())[0].triangles.len())
        .collect();
    assert_eq!(triangles, [960, 480, 240]);
    assert_eq!(chain.json.get("extensionsUsed"), None);
}

#[test]
fn without_a_layout_there_is_a_file_for_each_level_alone() {
    let output = OutputOptions { layout: Layout::None, ..chained().output };
    let baked = Baked::bytes("cube", &assets::cube(8).glb(), &options(output));
    let names: Vec<String> = baked.files().into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["cube.json", "cube_lod1.glb", "cube_lod2.glb"]);
}

/// The files of a folder and of those in it, as paths in it.
fn all_files(folder: &Path) -> Vec<String> {
    let entries =
        std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("one").path());
    let mut names: Vec<String> = Vec::new();
    for path in entries {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        match path.is_dir() {
            true => names.extend(all_files(&path).iter().map(|own| format!("{name}/{own}"))),
            false => names.push(name),
        }
    }
    names.sort();
    names
}

#[test]
fn a_gltf_has_its_binary_and_images_beside_it() {
    let mut build = assets::cube(8);
    build.json["images"][0]["name"] = json!("the atlas");
    let output = OutputOptions { format: Format::Gltf, ..chained().output };
    let baked = Baked::bytes("a cube", &build.glb(), &options(output));
    let names = [
        "a cube.bin",
        "a cube.gltf",
        "a cube.json",
        "a cube_lod1.bin",
        "a cube_lod1.gltf",
        "a cube_lod2.bin",
        "a cube_lod2.gltf",
        "a cube_textures/the atlas.png",
    ];
    assert_eq!(all_files(baked.folder.path()), names);
    let glb = Baked::bytes("a cube", &build.glb(), &options(chained().output));
    for level in [1, 2] {
        let path = glb.level_path(level);
        let name = path.with_extension("gltf").file_name().expect("a name").to_owned();
        let [own, other] =
            [path, baked.folder.path().join(name)].map(|path| read(&path).expect("an asset"));
        assert!(own.images == other.images && own.json["meshes"] == other.json["meshes"]);
        assert_eq!(own.json["accessors"], other.json["accessors"]);
    }
}

#[test]
fn the_gltf_crate_imports_what_is_written() {
    let Some(folder) = shared_assets() else { return };
    for (name, format, ending) in [
        ("scan/frypan.glb", Format::Glb, "glb"),
        ("rigged/Fox.glb", Format::Gltf, "gltf"),
        ("pbr/TennisRacquet/TennisRacquet.gltf", Format::Gltf, "gltf"),
    ] {
        let output = OutputOptions { format, ..chained().output };
        let options = BakeOptions { polish: None, ..options(output) };
        let baked = Baked::input(Input::File(&folder.join(name)), &options).expect("a bake");
        for path in [baked.level_path(1), baked.chain_path()] {
            let path = path.with_extension(ending);
            let (document, buffers, images) =
                gltf::import(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            assert_eq!(images.len(), document.images().len());
            let positions = document.meshes().flat_map(|mesh| mesh.primitives()).map(|primitive| {
                let reader = primitive.reader(|buffer| Some(&buffers[buffer.index()]));
                reader.read_positions().map_or(0, Iterator::count)
            });
            assert!(positions.sum::<usize>() > 100, "{}", path.display());
        }
    }
}

#[test]
fn no_file_of_the_source_is_written_over() {
    let folder = tempfile::tempdir().expect("a folder");
    let textures = folder.path().join("cube_textures");
    std::fs::create_dir(&textures).expect("a folder");
    let mut picture = std::io::Cursor::new(Vec::new());
    assets::cube_atlas().write_to(&mut picture, image::ImageFormat::Png).expect("a picture");
    std::fs::write(textures.join("atlas.png"), picture.into_inner()).expect("a file");
    let mut build = assets::cube(8);
    build.json["images"][0] = json!({"uri": "cube_textures/atlas.png"});
    let path = folder.path().join("cube.glb");
    std::fs::write(&path, build.glb()).expect("a file");
    let before = (all_files(folder.path()), folder_files(&textures));
    for layout in [Layout::MsftLod, Layout::None] {
        let output = OutputOptions { format: Format::Gltf, layout, ..chained().output };
        let run = seamwise::bake::bake(
            Input::File(&path),
            folder.path(),
            &options(output),
            &seamwise::progress::Progress::hidden(),
        );
        let error = run.expect_err("the source's own texture").to_string();
        assert!(error.contains("atlas.png would be overwritten"), "{error}");
    }
    assert_eq!((all_files(folder.path()), folder_files(&textures)), before);
}

#[test]
fn levels_follow_what_moves_their_node() {
    let mut build = Build::of(&shapes::sphere(32, 16));
    let times = build.floats(&[[0.0], [1.0]]);
    let moves = build.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    build.json["animations"] = json!([{
        "samplers": [{"input": times, "output": moves}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
    }]);
    let baked = Baked::bytes("ball", &build.glb(), &options(compressed()));
    let chain = read_json(&baked.chain_path());
    let shown = chain["nodes"][0]["children"][0].as_u64().expect("a child") as usize;
    let levels = chain["nodes"][shown]["extensions"]["MSFT_lod"]["ids"].as_array().map(Vec::len);
    assert_eq!(levels, Some(2), "the levels are beside a child of what moves");
    let plain = Baked::bytes("ball", &build.glb(), &options(chained().output));
    assert_eq!(Output::read(&plain.chain_path()).gltf.animations().len(), 1);
}

/// The corners of each triangle of a mesh: positions, UVs, and joints and weights if there are some,
/// by their bits, and the triangles in order.
fn corners(output: &Output, mesh: usize) -> Vec<[Vec<u32>; 3]> {
    let mesh = output.gltf.meshes().nth(mesh).expect("a mesh");
    let mut all = Vec::new();
    for (primitive, part) in mesh.primitives().zip(output.parts(mesh.index())) {
        let names = [Semantic::TexCoords(0), Semantic::Joints(0), Semantic::Weights(0)];
        let targets = primitive.morph_targets().filter_map(|target| target.positions());
        let accessors = names.iter().filter_map(|name| primitive.get(name)).chain(targets);
        let rows: Vec<Vec<Vec<f32>>> = accessors.map(|accessor| output.rows(&accessor)).collect();
        for triangle in &part.triangles {
            let mut own = triangle.map(|vertex| {
                let rest = rows.iter().flat_map(|rows| rows[vertex as usize].iter().copied());
                let all = part.positions[vertex as usize].into_iter().chain(rest);
                all.map(|x| (x + 0.0).to_bits()).collect::<Vec<u32>>()
            });
            let least = (0..3).min_by_key(|&corner| own[corner].clone());
            own.rotate_left(least.unwrap_or_default());
            all.push(own);
        }
    }
    all.sort();
    all
}

/// How many vertices the first primitive of each mesh has, and the view of its positions.
fn pools(output: &Output) -> Vec<(usize, usize)> {
    let first = |mesh: gltf::Mesh<'_>| {
        let primitive = mesh.primitives().next().expect("a primitive");
        let positions = primitive.get(&Semantic::Positions).expect("positions");
        (positions.count(), positions.view().expect("bytes").index())
    };
    output.gltf.meshes().map(first).collect()
}

/// Buffer views without a stride that more than one accessor of vertices reads (glTF 2.0 §3.6.2.4).
fn shared_without_stride(output: &Output) -> Vec<usize> {
    let mut readers = std::collections::BTreeMap::<usize, BTreeSet<usize>>::new();
    for primitive in output.gltf.meshes().flat_map(|mesh| mesh.primitives()) {
        for (_, accessor) in primitive.attributes() {
            let view = accessor.view().expect("bytes").index();
            readers.entry(view).or_default().insert(accessor.index());
        }
    }
    let stride = |view: usize| output.json["bufferViews"][view]["byteStride"].is_null();
    let shared = readers.into_iter().filter(|(_, accessors)| accessors.len() > 1);
    shared.map(|(view, _)| view).filter(|&view| stride(view)).collect()
}

#[test]
fn shared_vertices_are_stored_once_and_each_level_reads_a_prefix() {
    let ball = assets::textured(&shapes::sphere(48, 24), &assets::picture(16)).glb();
    for (name, glb) in [("ball", ball), ("bar", bent_bar(Kind::U8).glb())] {
        for layout in [Layout::MsftLod, Layout::Names] {
            let bake = |share_vertices| {
                let output = OutputOptions { share_vertices, layout, ..chained().output };
                let steering = Steering { placement: Placement::Ends, ..Steering::default() };
                let targets = Targets::ratios(vec![0.5, 0.2]).expect("ratios");
                let options = BakeOptions { steering, targets, polish: None, ..options(output) };
                Baked::bytes(name, &glb, &options)
            };
            let (apart, shared) = (bake(false), bake(true));
            let [own, other] = [&apart, &shared].map(Baked::chain);
            for mesh in 0..3 {
                assert_eq!(corners(&own, mesh), corners(&other, mesh), "{name}: mesh {mesh}");
            }
            let pools = pools(&other);
            assert!(pools[0].0 > pools[1].0 && pools[1].0 > pools[2].0, "{name}: {pools:?}");
            assert!(pools.iter().all(|own| own.1 == pools[0].1), "{name}: {pools:?}");
            let size = |baked: &Baked| std::fs::metadata(baked.chain_path()).expect("it").len();
            assert!(size(&shared) < size(&apart), "{name}");
            let level = |baked: &Baked| std::fs::read(baked.level_path(1)).expect("a level");
            assert!(level(&shared) == level(&apart), "{name}: a level alone is what it was");
            assert_eq!(shared_without_stride(&other), [0; 0], "{name}");
        }
    }
}

#[test]
fn a_file_of_polished_levels_is_what_it_was_and_no_larger() {
    let glb = assets::textured(&shapes::sphere(48, 24), &assets::picture(16)).glb();
    let [apart, shared] = [false, true].map(|share_vertices| {
        let output = OutputOptions { share_vertices, ..chained().output };
        let options = BakeOptions { output, targets: Targets::halves(2), ..unmeasured() };
        Baked::bytes("ball", &glb, &options)
    });
    let [own, other] = [&apart, &shared].map(Baked::chain);
    for mesh in 0..3 {
        assert_eq!(corners(&own, mesh), corners(&other, mesh), "mesh {mesh}");
    }
    let size = |baked: &Baked| std::fs::metadata(baked.chain_path()).expect("a file").len();
    assert!(size(&shared) <= size(&apart), "{} and {}", size(&shared), size(&apart));
}
