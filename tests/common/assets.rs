//! Whole assets in memory, each for one thing that a pipeline may get wrong.

use image::{Rgba, RgbaImage};
use serde_json::{Value, json};

use super::build::{Build, FLOAT};
use super::shapes::{ATLAS, CELL, MARGIN, Shape, book, patch, seam_cube, sphere, torus};

/// What no chart may show.
pub(crate) const MAGENTA: Rgba<u8> = Rgba([255, 0, 255, 255]);

/// Whether a texel of the seam cube's atlas lies in a chart.
pub(crate) fn in_chart(x: u32, y: u32) -> bool {
    [x, y].iter().all(|at| (MARGIN..CELL - MARGIN).contains(&(at % CELL)))
}

/// The seam cube's atlas: a muted color for each chart, with a pattern, and magenta between.
pub(crate) fn cube_atlas() -> RgbaImage {
    RgbaImage::from_fn(ATLAS[0], ATLAS[1], |x, y| {
        if !in_chart(x, y) {
            return MAGENTA;
        }
        let side = (x / CELL + 3 * (y / CELL)) as u8;
        let pattern = ((x * 7 + y * 5) % 11) as u8;
        Rgba([30 + 15 * side + pattern, 110 - 10 * side, 60 + 3 * pattern, 255])
    })
}

/// A smooth picture that tells left from right and top from bottom.
pub(crate) fn picture(size: u32) -> RgbaImage {
    RgbaImage::from_fn(size, size, |x, y| {
        let [u, v] = [x, y].map(|at| (at * 200 / size) as u8);
        let check = if (8 * x / size + 8 * y / size).is_multiple_of(2) { 40 } else { 0 };
        Rgba([20 + u, 20 + v, 60 + check, 255])
    })
}

/// A shape that uses `picture`.
pub(crate) fn textured(shape: &Shape, picture: &RgbaImage) -> Build {
    let mut build = Build::new();
    let material = build.textured(picture);
    let mut primitive = build.primitive(shape);
    primitive["material"] = json!(material);
    build.mesh(vec![primitive]);
    build
}

/// The seam cube with its atlas.
pub(crate) fn cube(n: u32) -> Build {
    textured(&seam_cube(n), &cube_atlas())
}

/// A waved sheet, its left half of one material and its right of another, with no vertex shared.
pub(crate) fn two_materials(n: u32) -> Build {
    let whole = patch(n);
    let is_left = |t: &&[u32; 3]| t.iter().all(|&v| whole.positions[v as usize][0] <= 1e-6);
    let (left, right): (Vec<[u32; 3]>, Vec<[u32; 3]>) =
        whole.triangles.iter().partition(|triangle| is_left(triangle));
    let mut build = Build::new();
    let primitives = [left, right]
        .into_iter()
        .enumerate()
        .map(|(side, triangles)| {
            let color = [0.8, 0.2, 0.1, 1.0].map(|x: f32| (x - side as f32).abs());
            let metallic = json!({"baseColorFactor": [color[0], color[1], color[2], 1.0]});
            let material = build.add("materials", json!({"pbrMetallicRoughness": metallic}));
            let mut primitive = build.primitive(&Shape { triangles, ..whole.clone() }.unindexed());
            primitive["material"] = json!(material);
            primitive
        })
        .collect();
    build.mesh(primitives);
    build
}

/// A strip that bends by a skin of two joints and swells by a morph target, both animated, with
/// extras on everything.
pub(crate) fn rigged() -> Build {
    let shape = patch(16);
    let mut build = Build::new();
    let material = build.textured(&picture(32));
    let mut primitive = build.primitive(&shape);
    let count = shape.positions.len();
    let joints: Vec<u8> = (0..count).flat_map(|_| [0, 1, 0, 0]).collect();
    let weights: Vec<[f32; 4]> =
        shape.positions.iter().map(|p| [0.5 - 0.5 * p[0], 0.5 + 0.5 * p[0], 0.0, 0.0]).collect();
    primitive["attributes"]["JOINTS_0"] = json!(build.raw(&joints, count, 5121, "VEC4"));
    primitive["attributes"]["WEIGHTS_0"] = json!(build.floats(&weights));
    let swell: Vec<[f32; 3]> =
        shape.positions.iter().map(|p| [0.0, 0.5 - 0.5 * p[0], 0.0]).collect();
    primitive["targets"] = json!([{"POSITION": build.floats(&swell)}]);
    primitive["material"] = json!(material);
    primitive["extras"] = json!({"primitive": [1, 2, 3]});
    let node = build.mesh(vec![primitive]);
    build.json["meshes"][0]["weights"] = json!([0.25]);
    build.json["meshes"][0]["extras"] = json!({"targetNames": ["swell"]});
    let mut identity = [0.0; 16];
    (0..4).for_each(|k| identity[5 * k] = 1.0);
    let binds = build.matrices(&[identity, identity]);
    let [root, tip] = ["root", "tip"].map(|name| build.add("nodes", json!({"name": name})));
    build.json["nodes"][root]["children"] = json!([tip]);
    build.json["nodes"][root]["extras"] = json!({"bone": true});
    build.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(root));
    let skin = json!({"joints": [root, tip], "inverseBindMatrices": binds, "extras": "skin"});
    build.json["nodes"][node]["skin"] = json!(build.add("skins", skin));
    let times = build.floats(&[[0.0], [1.0]]);
    let turns = build.floats(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.6, 0.8]]);
    let swells = build.floats(&[[0.0], [1.0]]);
    build.add(
        "animations",
        json!({
            "name": "wave", "extras": {"loop": true},
            "samplers": [{"input": times, "output": turns}, {"input": times, "output": swells}],
            "channels": [
                {"sampler": 0, "target": {"node": tip, "path": "rotation"}},
                {"sampler": 1, "target": {"node": node, "path": "weights"}},
            ],
        }),
    );
    build
        .add("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}));
    build.json["materials"][0]["extras"] = json!({"paint": "matt"});
    build.json["extras"] = json!({"project": "tests"});
    build
}

/// A sphere, and in the same mesh points and lines around it.
pub(crate) fn mixed() -> Build {
    let mut build = Build::new();
    let surface = build.primitive(&sphere(24, 12));
    let stars: Vec<[f32; 3]> = (0..9).map(|i| [2.0, i as f32 * 0.1, -1.0]).collect();
    let points = json!({"mode": 0, "attributes": {"POSITION": build.floats(&stars)}});
    let ends = build.floats(&[[0.0, 2.0, 0.0], [0.0, 3.0, 0.0], [1.0, 3.0, 0.0]]);
    let lines = json!({"mode": 1, "attributes": {"POSITION": ends}, "indices": build.indices([0, 1, 1, 2])});
    let band = build.floats(&[[0.0, -2.0, 0.0], [0.0, -3.0, 0.0], [1.0, -3.0, 0.0]]);
    let strip = json!({"mode": 3, "attributes": {"POSITION": band}});
    build.mesh(vec![points, surface, lines, strip]);
    build
}

/// The waved sheet with each kind of accessor that glTF knows: positions normalized to 16 bits
/// with a stride, 8-bit normals, 16-bit normalized UVs, and some positions put right by a sparse
/// accessor.
pub(crate) fn quantized(n: u32) -> Build {
    let shape = patch(n);
    let count = shape.positions.len();
    let mut build = Build::new();
    let short = |x: f32| (x * 32767.0).round() as i16;
    // Every seventh position is wrong until the sparse accessor mends it.
    let row = |(i, p): (usize, &[f32; 3])| {
        let p = if i % 7 == 0 { [0.0; 3] } else { p.map(short).map(f32::from) };
        p.iter().map(|&x| x as i16).chain([0x55]).flat_map(i16::to_le_bytes).collect::<Vec<u8>>()
    };
    let positions: Vec<u8> = shape.positions.iter().enumerate().flat_map(row).collect();
    let positions = build.raw(&positions, count, 5122, "VEC3");
    build.json["bufferViews"].as_array_mut().expect("a list").last_mut().expect("a view")["byteStride"] =
        json!(8);
    let mended: Vec<u16> = (0..count as u16).step_by(7).collect();
    let indices: Vec<u8> = mended.iter().flat_map(|i| i.to_le_bytes()).collect();
    let values: Vec<u8> = mended
        .iter()
        .flat_map(|&i| shape.positions[i as usize].map(short))
        .flat_map(i16::to_le_bytes)
        .collect();
    let (indices, values) = (build.view(&indices), build.view(&values));
    let accessor = &mut build.json["accessors"][positions];
    accessor["normalized"] = json!(true);
    // Least and greatest once mended.
    let bound = |pick: fn(i16, i16) -> i16| -> Vec<i16> {
        (0..3).filter_map(|k| shape.positions.iter().map(|p| short(p[k])).reduce(pick)).collect()
    };
    accessor["min"] = json!(bound(i16::min));
    accessor["max"] = json!(bound(i16::max));
    accessor["sparse"] = json!({
        "count": mended.len(), "indices": {"bufferView": indices, "componentType": 5123},
        "values": {"bufferView": values},
    });
    let byte = |x: f32| (x * 127.0).round() as i8 as u8;
    let normals: Vec<u8> =
        shape.normals.iter().flat_map(|n| [byte(n[0]), byte(n[1]), byte(n[2]), 0]).collect();
    let normals = build.raw(&normals, count, 5120, "VEC3");
    let uvs: Vec<u8> = shape
        .uvs
        .iter()
        .flatten()
        .flat_map(|x| ((x * 65535.0).round() as u16).to_le_bytes())
        .collect();
    let uvs = build.raw(&uvs, count, 5123, "VEC2");
    let view = build.json["accessors"][normals]["bufferView"].as_u64().expect("a view") as usize;
    build.json["bufferViews"][view]["byteStride"] = json!(4);
    for accessor in [normals, uvs] {
        build.json["accessors"][accessor]["normalized"] = json!(true);
    }
    let indices = build.indices(shape.triangles.iter().flatten().copied());
    let attributes = json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs});
    build.mesh(vec![json!({"attributes": attributes, "indices": indices})]);
    build.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    build.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    build
}

/// The waved sheet without indices.
pub(crate) fn unindexed(n: u32) -> Build {
    let mut build = Build::new();
    let attributes = build.attributes(&patch(n).unindexed());
    build.mesh(vec![json!({"attributes": attributes})]);
    build
}

/// The waved sheet as one triangle strip for each of its rows.
pub(crate) fn strips(n: u32) -> Build {
    let shape = patch(n);
    let mut build = Build::new();
    let attributes = build.attributes(&shape);
    let mut primitives = Vec::new();
    for row in 0..n {
        let strip = (0..=n).flat_map(|column| {
            let top = row * (n + 1) + column;
            [top + n + 1, top]
        });
        let indices = build.indices(strip);
        primitives.push(json!({"mode": 5, "attributes": attributes, "indices": indices}));
    }
    build.mesh(primitives);
    build
}

/// A disc as one triangle fan of `n` triangles.
pub(crate) fn fan(n: u32) -> Build {
    let mut build = Build::new();
    let rim = |i: u32| ((i % n) as f32 / n as f32 * std::f32::consts::TAU).sin_cos();
    let center = std::iter::once([0.0, 0.0, 0.0]);
    let positions: Vec<[f32; 3]> =
        center.chain((0..=n).map(rim).map(|(sin, cos)| [cos, sin, 0.0])).collect();
    let positions = build.floats(&positions);
    build.mesh(vec![json!({"mode": 6, "attributes": {"POSITION": positions}})]);
    build
}

/// A torus under a node that mirrors it, under another that moves it.
pub(crate) fn mirrored() -> Build {
    let mut build = textured(&torus(32, 16), &picture(32));
    build.json["nodes"][0]["scale"] = json!([-1.0, 1.0, 1.0]);
    let turned = json!({"name": "parent", "translation": [0.0, 5.0, 0.0], "children": [0]});
    let parent = build.add("nodes", turned);
    build.json["scenes"][0]["nodes"] = json!([parent]);
    build
}

/// Every asset of this file by name.
pub(crate) fn all() -> Vec<(&'static str, Build)> {
    vec![
        ("sphere", textured(&sphere(48, 24), &picture(64))),
        ("torus", textured(&torus(48, 24), &picture(64))),
        ("seam_cube", cube(12)),
        ("patch", textured(&patch(24), &picture(64))),
        ("book", Build::of(&book(5, 12))),
        ("two_materials", two_materials(24)),
        ("rigged", rigged()),
        ("mixed", mixed()),
        ("quantized", quantized(24)),
        ("unindexed", unindexed(24)),
        ("strips", strips(24)),
        ("fan", fan(64)),
        ("mirrored", mirrored()),
    ]
}

/// A small document with something of everything, to be damaged.
pub(crate) fn victim() -> Build {
    let mut build = rigged();
    build.json["textures"][0]["extensions"] = json!({"EXT_unknown": {"a": [1]}});
    let info = &mut build.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["extensions"] = json!({"KHR_texture_transform": {"offset": [0.1, 0.0], "rotation": 0.1, "scale": [1.0, 1.0]}});
    info["texCoord"] = json!(0);
    build.json["materials"][0]["normalTexture"] = json!({"index": 0, "scale": 0.5});
    build.json["materials"][0]["occlusionTexture"] = json!({"index": 0, "strength": 0.5});
    build.json["materials"][0]["alphaMode"] = json!("MASK");
    build.json["materials"][0]["alphaCutoff"] = json!(0.5);
    build.json["materials"][0]["extensions"] = json!({"KHR_materials_unlit": {}});
    build.json["nodes"][0]["translation"] = json!([0.0, 1.0, 0.0]);
    build.json["extensionsUsed"] =
        json!(["KHR_texture_transform", "KHR_materials_unlit", "EXT_unknown"]);
    let (bytes, count) = (vec![7u8; 4 * 289], 289);
    let colors = build.raw(&bytes, count, 5121, "VEC4");
    build.json["accessors"][colors]["normalized"] = json!(true);
    build.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
    let zeros = json!({
        "componentType": FLOAT, "count": count, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0],
        "sparse": {"count": 1, "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0}},
    });
    let zeros = build.add("accessors", zeros);
    let targets = &mut build.json["meshes"][0]["primitives"][0]["targets"];
    targets.as_array_mut().expect("a list").push(json!({"POSITION": zeros}));
    build.json["meshes"][0]["weights"] = json!([0.25, 0.0]);
    build
}

/// Where a document stands with every pointer into it, leaves and branches.
pub(crate) fn pointers(json: &Value) -> Vec<String> {
    fn collect(json: &Value, at: &str, found: &mut Vec<String>) {
        found.push(at.to_owned());
        match json {
            Value::Object(object) => {
                object
                    .iter()
                    .for_each(|(key, value)| collect(value, &format!("{at}/{key}"), found));
            }
            Value::Array(list) => {
                let list = list.iter().enumerate();
                list.for_each(|(key, value)| collect(value, &format!("{at}/{key}"), found));
            }
            _ => {}
        }
    }
    let mut found = Vec::new();
    collect(json, "", &mut found);
    found
}
