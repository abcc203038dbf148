//! A surface that comes cut into meshes: do its levels stay closed?

use crate::common::build::Build;
use crate::common::output::{Output, border};
use crate::common::shapes::Shape;
use crate::common::{Baked, unmeasured};
use seamwise::bake::options::{BakeOptions, Targets};
use seamwise::bake::steering::Steering;

const ROWS: u32 = 24;

/// A strip of a wavy sheet over 0…1 × 0…1, from one column line to the next of `lines`.
fn strip(lines: &[f32]) -> Shape {
    let mut shape = Shape::default();
    for row in 0..=ROWS {
        for &x in lines {
            let y = row as f32 / ROWS as f32;
            shape.positions.push([x, y, 0.05 * (9.0 * x).sin() * (7.0 * y).cos()]);
            shape.normals.push([0.0, 0.0, 1.0]);
            shape.uvs.push([x, y]);
        }
    }
    let columns = lines.len() as u32;
    for row in 0..ROWS {
        for column in 0..columns - 1 {
            let a = row * columns + column;
            let [b, c, d] = [a + 1, a + columns, a + columns + 1];
            shape.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    shape
}

/// A mesh for each strip between these places along x.
fn sheet(cuts: &[f32]) -> Build {
    let mut build = Build::new();
    for pair in cuts.windows(2) {
        let lines: Vec<f32> =
            (0..=6).map(|k| pair[0] + (pair[1] - pair[0]) * k as f32 / 6.0).collect();
        let primitive = build.primitive(&strip(&lines));
        build.mesh(vec![primitive]);
    }
    build
}

fn bake(build: &Build, triangles: Vec<usize>) -> Baked {
    let targets = Targets::triangles(triangles).expect("targets");
    // However far that takes the sheet.
    let steering = Steering { max_deviation: None, ..Steering::default() };
    Baked::bytes("tiles", &build.glb(), &BakeOptions { targets, steering, ..unmeasured() })
}

/// The borders of what the nodes of the scene show, all meshes together.
fn shown_border(output: &Output) -> Vec<[[f32; 3]; 2]> {
    let meshes = output.gltf.nodes().filter_map(|node| node.mesh());
    border(&meshes.flat_map(|mesh| output.parts(mesh.index())).collect::<Vec<_>>())
}

#[test]
fn tiles_do_not_come_apart() {
    let build = sheet(&[0.0, 0.25, 0.5, 0.75, 1.0]);
    let baked = bake(&build, vec![576, 144, 40]);
    for (level, target) in baked.levels().iter().zip([576, 144, 40]) {
        let triangles = level.triangle_count();
        assert!(triangles <= target && triangles + 2 > target, "{triangles} of {target}");
        for [a, b] in shown_border(level) {
            let along = |axis: usize, at: f32| [a, b].iter().all(|p| (p[axis] - at).abs() < 0.02);
            let is_outer = (0..2).any(|axis| along(axis, 0.0) || along(axis, 1.0));
            assert!(is_outer, "a crack from {a:?} to {b:?} at {target} triangles");
        }
    }
    assert_eq!(baked.report.input.meshes, 4);
    assert_eq!(baked.chain().gltf.meshes().len(), 4 + 3 * 4);
}

#[test]
fn a_tile_without_triangles_is_not_shown() {
    let baked = bake(&sheet(&[0.0, 0.5, 0.501, 1.0]), vec![6]);
    let level = baked.level(1);
    let shown = |output: &Output| output.gltf.nodes().filter(|node| node.mesh().is_some()).count();
    assert_eq!((level.gltf.nodes().len(), level.gltf.meshes().len(), shown(&level)), (3, 3, 2));
    let meshes = level.gltf.nodes().filter_map(|node| node.mesh());
    let parts: Vec<_> = meshes.flat_map(|mesh| level.parts(mesh.index())).collect();
    assert!(parts.iter().map(|part| part.triangles.len()).sum::<usize>() <= 6);
    let chain = baked.chain();
    assert_eq!((chain.gltf.nodes().len(), shown(&chain)), (6, 5), "an empty node stands for it");
}
