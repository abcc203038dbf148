//! What counts beside the surface at rest: how it moves, which way it faces, and the crowd it is of.

use glam::Vec3;
use serde_json::json;

use crate::common::build::Build;
use crate::common::output::Output;
use crate::common::pose::{Pose, deform};
use crate::common::shapes::{Shape, bar, patch, sphere};
use crate::common::{Baked, unmeasured};
use seamwise::bake::options::{BakeOptions, Targets};
use seamwise::bake::steering::{GrowCards, Steering};

/// A tapered limb along x over −1…1 that `joints` turn, each by `turn` about y. Every joint's weight falls off
/// smoothly around its place.
fn limb(joints: usize, turn: f32) -> Build {
    let mut shape = bar(72, 14);
    for p in &mut shape.positions {
        let thin = 1.0 - 0.35 * (p[0] + 1.0) / 2.0;
        (p[1], p[2]) = (p[1] * thin, p[2] * thin);
    }
    let place = |joint: usize| -1.0 + 2.0 * joint as f32 / joints as f32;
    let mut build = Build::new();
    let mut primitive = build.primitive(&shape);
    let weights: Vec<[f32; 4]> = shape
        .positions
        .iter()
        .map(|p| {
            let mut row: [f32; 4] = std::array::from_fn(|joint| {
                let off = (p[0] - place(joint) - 1.0 / joints as f32) * joints as f32;
                if joint < joints { (-1.2 * off * off).exp() } else { 0.0 }
            });
            let sum: f32 = row.iter().sum();
            row.iter_mut().for_each(|weight| *weight /= sum);
            row
        })
        .collect();
    let numbers: Vec<u8> = shape.positions.iter().flat_map(|_| [0, 1, 2, 3]).collect();
    primitive["attributes"]["WEIGHTS_0"] = json!(build.floats(&weights));
    let numbers = build.raw(&numbers, shape.positions.len(), 5121, "VEC4");
    primitive["attributes"]["JOINTS_0"] = json!(numbers);
    let node = build.mesh(vec![primitive]);
    let rotation = [0.0, (turn / 2.0).sin(), 0.0, (turn / 2.0).cos()];
    let mut chain = Vec::new();
    for joint in 0..4 {
        let step = if joint == 0 { -1.0 } else { 2.0 / joints as f32 };
        chain.push(build.add(
            "nodes",
            json!({"name": format!("joint {joint}"), "translation": [step, 0, 0], "rotation": rotation}),
        ));
    }
    for pair in chain.windows(2) {
        build.json["nodes"][pair[0]]["children"] = json!([pair[1]]);
    }
    build.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(json!(chain[0]));
    let binds: Vec<[f32; 16]> = (0..4)
        .map(|joint| glam::Mat4::from_translation(Vec3::X * -place(joint)).to_cols_array())
        .collect();
    let binds = build.matrices(&binds);
    let skin = build.add("skins", json!({"joints": chain, "inverseBindMatrices": binds}));
    build.json["nodes"][node]["skin"] = json!(skin);
    build
}

#[test]
fn a_straight_limb_keeps_the_points_that_it_bends_at() {
    for (joints, turn) in [(4, 0.45), (3, -0.6)] {
        let glb = limb(joints, turn).glb();
        let source = Output::from_bytes(&glb, "limb");
        let baked = Baked::bytes("limb", &glb, &unmeasured());
        let pose = |output: &Output| deform(output, 0, None, Some(&Pose::rest(output)));
        for (level, limit) in baked.levels().iter().zip([0.0005, 0.001, 0.002, 0.004]) {
            let rms = pose(&source).distances(&pose(level), 8000).rms;
            assert!(rms < limit, "{joints} joints: {rms} of {limit}");
        }
    }
}

/// A flat sheet over −1…1 squared with a morph target for each bump: its place, its width and its height.
fn bumps(all: &[([f32; 2], f32, f32)]) -> Build {
    let mut shape = patch(56);
    shape.positions.iter_mut().for_each(|p| p[1] = 0.0);
    shape.normals.fill([0.0, 1.0, 0.0]);
    let mut build = Build::new();
    let mut primitive = build.primitive(&shape);
    let target = |&([x, z], width, height): &([f32; 2], f32, f32)| {
        let delta = |p: &[f32; 3]| {
            let square = ((p[0] - x).powi(2) + (p[2] - z).powi(2)) / (width * width);
            [0.0, if square < 9.0 { height * (-square).exp() } else { 0.0 }, 0.0]
        };
        json!({"POSITION": build.floats(&shape.positions.iter().map(delta).collect::<Vec<_>>())})
    };
    let targets: Vec<_> = all.iter().map(target).collect();
    primitive["targets"] = json!(targets);
    build.mesh(vec![primitive]);
    build.json["meshes"][0]["weights"] = json!(vec![0.0; all.len()]);
    build
}

#[test]
fn a_flat_sheet_keeps_the_bumps_of_its_targets() {
    let all = [([-0.55, 0.3], 0.12, 0.3), ([0.6, 0.62], 0.2, 0.15), ([0.1, -0.7], 0.15, -0.4)];
    let baked = Baked::bytes("sheet", &bumps(&all).glb(), &unmeasured());
    for (level, least) in baked.levels().iter().zip([0.95, 0.95, 0.9, 0.85]) {
        let mesh = level.gltf.meshes().next().expect("a mesh");
        let primitive = mesh.primitives().next().expect("a primitive");
        for ((_, _, height), target) in all.iter().zip(primitive.morph_targets()) {
            let deltas = level.rows(&target.positions().expect("deltas"));
            let peak = deltas.iter().map(|delta| delta[1] / height).fold(0.0, f32::max);
            assert!(peak >= least, "{peak} of a bump of {height} where {least} are to be left");
        }
    }
}

#[test]
fn no_triangle_of_a_rough_height_field_turns_its_back() {
    let rough = |x: f32, z: f32, seed: f32| {
        let grain = (x * 157.3 + z * 311.7 + seed).sin() * 43_758.547;
        0.22 * (grain - grain.floor())
    };
    for seed in 0..6u8 {
        let mut shape = patch(5 + u32::from(seed));
        for p in &mut shape.positions {
            p[1] = rough(p[0], p[2], f32::from(seed));
        }
        let baked = Baked::bytes("field", &Build::of(&shape).glb(), &unmeasured());
        for (index, level) in baked.levels().iter().enumerate() {
            for part in level.parts(0) {
                for triangle in &part.triangles {
                    let [a, b, c] = triangle.map(|v| Vec3::from_array(part.positions[v as usize]));
                    let up = (b - a).cross(c - a).y;
                    assert!(up > 0.0, "seed {seed}, level {}: {up}", index + 1);
                }
            }
        }
    }
}

/// Squares that lie all over a ball, each of its own size and turn.
fn leaves(count: u32) -> Shape {
    let mut leaves = Shape::default();
    for at in 0..count {
        let [a, b, c] = [0.61, 2.39, 1.7].map(|step| step * at as f32);
        let middle = Vec3::new(a.sin() * b.cos(), (1.3 * b).sin(), (0.7 * c).cos());
        let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, a, b, c);
        let size = 0.06 + 0.03 * (3.0 * a).sin();
        let first = leaves.positions.len() as u32;
        for uv in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
            let corner = Vec3::new(uv[0] - 0.5, 0.5 - uv[1], 0.0) * size;
            leaves.positions.push((middle + turn * corner).to_array());
            leaves.normals.push((turn * Vec3::Z).to_array());
            leaves.uvs.push(uv);
        }
        leaves.triangles.extend([[0, 2, 1], [0, 3, 2]].map(|t: [u32; 3]| t.map(|v| v + first)));
    }
    leaves
}

fn area(output: &Output) -> f32 {
    let parts = output.parts(0);
    let areas = parts.iter().flat_map(|part| {
        part.triangles.iter().map(|triangle| {
            let [a, b, c] = triangle.map(|v| Vec3::from_array(part.positions[v as usize]));
            (b - a).cross(c - a).length() / 2.0
        })
    });
    areas.sum()
}

#[test]
fn leaves_that_stay_grow_if_they_are_cut_out_or_it_is_asked_for() {
    let build = |mode: &str| {
        let mut build = Build::of(&leaves(240));
        let material = build.add("materials", json!({"alphaMode": mode, "doubleSided": true}));
        build.json["meshes"][0]["primitives"][0]["material"] = json!(material);
        build.glb()
    };
    let bake = |mode: &str, grow_cards| {
        let steering = Steering { grow_cards, ..Steering::default() };
        let targets = Targets::ratios(vec![0.5, 0.125]).expect("ratios");
        let options = BakeOptions { steering, targets, ..unmeasured() };
        let glb = build(mode);
        let (baked, whole) =
            (Baked::bytes("tree", &glb, &options), area(&Output::from_bytes(&glb, "tree")));
        [1, 2].map(|level| {
            let level = baked.level(level);
            (level.triangle_count(), area(&level) / whole)
        })
    };
    for (mode, grow) in [("MASK", GrowCards::Masked), ("OPAQUE", GrowCards::All)] {
        let [half, eighth] = bake(mode, grow);
        assert!(half.0 <= 240 && (0.95..1.05).contains(&half.1), "{mode}: {half:?}");
        assert!(eighth.0 <= 60 && (0.8..1.05).contains(&eighth.1), "{mode}: {eighth:?}");
    }
    for (mode, grow) in [("OPAQUE", GrowCards::Masked), ("MASK", GrowCards::None)] {
        let [_, eighth] = bake(mode, grow);
        assert!(eighth.0 > 100, "{mode}: held by the limits, and {eighth:?}");
    }
}

#[test]
fn a_texture_in_shards_is_told_with_a_way_out() {
    let shards = |mut shape: Shape| {
        shape = shape.unindexed();
        let side = (shape.triangles.len() as f32).sqrt().ceil();
        for (triangle, corners) in shape.triangles.iter().enumerate() {
            let [u, v] = [triangle as f32 % side, (triangle as f32 / side).floor()];
            for (slot, &corner) in corners.iter().enumerate() {
                let at = [[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]][slot];
                shape.uvs[corner as usize] = [(u + at[0]) / side, (v + at[1]) / side];
            }
        }
        shape
    };
    let warned = |shape: &Shape| {
        let mut build = Build::of(shape);
        let picture = image::RgbaImage::from_pixel(64, 64, image::Rgba([200, 90, 30, 255]));
        let material = build.textured(&picture);
        build.json["meshes"][0]["primitives"][0]["material"] = json!(material);
        let report = Baked::bytes("shards", &build.glb(), &unmeasured()).report;
        report.warnings.iter().any(|warning| warning.what.contains("--textures transfer"))
    };
    assert!(warned(&shards(sphere(16, 12))));
    assert!(!warned(&sphere(16, 12)));
    assert!(!warned(&leaves(240)), "charts that are whole leaves");
}
