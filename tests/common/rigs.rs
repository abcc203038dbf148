//! Surfaces bound to two joints by weights that are linear along x, stored in every way there is.

use serde_json::{Value, json};

use super::build::{Build, FLOAT};
use super::shapes::{Shape, bar, patch};

/// How integers or floats stand for weights.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Kind {
    U8,
    U16,
    F32,
}

impl Kind {
    /// What an accessor's component may be off by.
    pub(crate) fn step(self) -> f32 {
        match self {
            Self::U8 => 1.0 / 255.0,
            Self::U16 => 1.0 / 65535.0,
            Self::F32 => 1e-6,
        }
    }
}

/// The share of the second joint where x is so much.
pub(crate) fn second_share(x: f32) -> f32 {
    (0.5 + 0.5 * x).clamp(0.0, 1.0)
}

/// Accessors of joints and weights for the vertices of a shape.
fn bind(build: &mut Build, shape: &Shape, kind: Kind) -> [usize; 2] {
    let count = shape.positions.len();
    let joints: Vec<u8> = (0..count).flat_map(|_| [0, 1, 0, 0]).collect();
    let joints = build.raw(&joints, count, 5121, "VEC4");
    let whole = match kind {
        Kind::U8 => 255.0,
        Kind::U16 => 65535.0,
        Kind::F32 => 1.0,
    };
    let rows = shape.positions.iter().map(|p| second_share(p[0]) * whole);
    let weights = match kind {
        Kind::U8 => {
            let row = |w: f32| [255 - w.round() as u8, w.round() as u8, 0, 0];
            build.raw(&rows.flat_map(row).collect::<Vec<u8>>(), count, 5121, "VEC4")
        }
        Kind::U16 => {
            let row = |w: f32| [65535 - w.round() as u16, w.round() as u16, 0, 0];
            let bytes: Vec<u8> = rows.flat_map(row).flat_map(u16::to_le_bytes).collect();
            build.raw(&bytes, count, 5123, "VEC4")
        }
        Kind::F32 => build.floats(&rows.map(|w| [1.0 - w, w, 0.0, 0.0]).collect::<Vec<_>>()),
    };
    if !matches!(kind, Kind::F32) {
        build.json["accessors"][weights]["normalized"] = json!(true);
    }
    [joints, weights]
}

/// A primitive of a shape, bound to both joints.
fn bound(build: &mut Build, shape: &Shape, kind: Kind) -> Value {
    let mut primitive = build.primitive(shape);
    let [joints, weights] = bind(build, shape, kind);
    primitive["attributes"]["JOINTS_0"] = json!(joints);
    primitive["attributes"]["WEIGHTS_0"] = json!(weights);
    primitive
}

/// A mesh under a skin of two joints, the second at the origin.
fn skinned(mut build: Build, primitives: Vec<Value>) -> Build {
    let node = build.mesh(primitives);
    let root = build.add("nodes", json!({"name": "root"}));
    let tip = build.add("nodes", json!({"name": "tip"}));
    build.json["nodes"][root]["children"] = json!([tip]);
    build.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(root));
    let skin = build.add("skins", json!({"joints": [root, tip]}));
    build.json["nodes"][node]["skin"] = json!(skin);
    build
}

/// A bar that two joints bend and a morph target stretches to twice its length, by deltas of floats or
/// 16-bit integers. Its normals turn by x.
pub(crate) fn bent_bar(kind: Kind) -> Build {
    let shape = bar(48, 16);
    let mut build = Build::new();
    let mut primitive = bound(&mut build, &shape, kind);
    let deltas: Vec<[f32; 3]> = shape.positions.iter().map(|p| [p[0], 0.0, 0.0]).collect();
    let deltas = match kind {
        Kind::F32 => build.floats(&deltas),
        _ => {
            let short = |x: &f32| ((x * 32767.0).round() as i16).to_le_bytes();
            let rows = deltas
                .iter()
                .flat_map(|row| row.iter().flat_map(short).chain([0, 0]).collect::<Vec<u8>>());
            let accessor =
                build.raw(&rows.collect::<Vec<u8>>(), shape.positions.len(), 5122, "VEC3");
            build.json["bufferViews"].as_array_mut().expect("a list").last_mut().expect("a view")
                ["byteStride"] = json!(8);
            let bounds = [("min", [-32767, 0, 0]), ("max", [32767, 0, 0])];
            for (name, bound) in bounds {
                build.json["accessors"][accessor][name] = json!(bound);
            }
            build.json["accessors"][accessor]["normalized"] = json!(true);
            build.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
            build.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
            accessor
        }
    };
    let turns: Vec<[f32; 3]> = shape.positions.iter().map(|p| [0.0, 0.0, p[0]]).collect();
    primitive["targets"] = json!([{"POSITION": deltas, "NORMAL": build.floats(&turns)}]);
    skinned(build, vec![primitive])
}

/// A bound sheet whose left and right halves are two primitives that share no vertex. `edit` gets the
/// right one and the document.
pub(crate) fn halves(edit: impl Fn(&mut Build, &mut Value)) -> Build {
    let whole = patch(24);
    let is_left = |t: &&[u32; 3]| t.iter().all(|&v| whole.positions[v as usize][0] <= 1e-6);
    let (left, right): (Vec<[u32; 3]>, Vec<[u32; 3]>) =
        whole.triangles.iter().partition(|triangle| is_left(triangle));
    let mut build = Build::new();
    let [left, mut right] = [left, right].map(|triangles| {
        bound(&mut build, &Shape { triangles, ..whole.clone() }.unindexed(), Kind::F32)
    });
    edit(&mut build, &mut right);
    skinned(build, vec![left, right])
}

/// An accessor of zeros in place of an attribute of floats.
pub(crate) fn zeros(build: &mut Build, like: &Value) -> Value {
    let accessor = &build.json["accessors"][like.as_u64().expect("an index") as usize];
    let count = accessor["count"].clone();
    json!(build.add("accessors", json!({"componentType": FLOAT, "count": count, "type": "VEC4"})))
}
