//! What users may ask of the descent, through the real binary and in its outputs.

mod common;

use std::collections::BTreeSet;
use std::path::Path;

use assert_cmd::Command;
use common::build::Build;
use common::output::Output;
use common::shapes;
use serde_json::json;

/// Bakes one level of half the triangles and tells its file; or what the tool says against it.
fn bake(folder: &Path, build: &Build, options: &[&str]) -> Result<Output, String> {
    std::fs::write(folder.join("in.glb"), build.glb()).expect("a file is written");
    let mut command = Command::cargo_bin("seamwise").expect("the binary");
    command.current_dir(folder).args(["bake", "in.glb", "-o", "out", "--no-evaluate"]);
    if !options.contains(&"--ratios") {
        command.args(["--ratios", "0.5"]);
    }
    let output = command.args(options).output().expect("it runs");
    if output.status.success() {
        Ok(Output::read(&folder.join("out/in_lod1.glb")))
    } else {
        Err(String::from_utf8(output.stderr).expect("UTF-8"))
    }
}

/// Positions by their bits, with −0 as 0: the weld makes them one.
fn bits(positions: &[[f32; 3]]) -> BTreeSet<[u32; 3]> {
    positions.iter().map(|p| p.map(|x| (x + 0.0).to_bits())).collect()
}

/// A sphere and, beside it, one of a material of its own.
fn two_spheres() -> (Build, BTreeSet<[u32; 3]>) {
    let mut build = Build::new();
    for name in ["skin", "eye"] {
        build.add("materials", json!({"name": name}));
    }
    let eye = shapes::sphere(16, 8).scaled(0.3).moved([1.0, 0.3, 0.1]);
    let mut primitives = vec![build.primitive(&shapes::sphere(32, 16)), build.primitive(&eye)];
    primitives[0]["material"] = json!(0);
    primitives[1]["material"] = json!(1);
    build.mesh(primitives);
    (build, bits(&eye.positions))
}

#[test]
fn a_locked_material_stays_and_an_unknown_one_is_named_beside_those_there_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let (build, eye) = two_spheres();
    let level = bake(folder.path(), &build, &["--lock-material", "eye"]).expect("a level");
    let kept = level.parts(0).into_iter().find(|part| part.material == Some(1)).expect("a part");
    assert_eq!(bits(&kept.positions), eye);
    let free = bake(folder.path(), &build, &[]).expect("a level");
    let moved = free.parts(0).into_iter().find(|part| part.material == Some(1)).expect("a part");
    assert_ne!(bits(&moved.positions), eye);
    let said = bake(folder.path(), &build, &["--lock-material", "nose"]).err().expect("an error");
    assert!(said.contains("no material is named nose; there are eye, skin"), "{said}");
}

#[test]
fn a_vertex_attribute_locks_where_it_is_above_a_half() {
    let folder = tempfile::tempdir().expect("a folder");
    let shape = shapes::sphere(32, 16);
    let mut build = Build::new();
    let mut primitive = build.primitive(&shape);
    let locks: Vec<[f32; 1]> =
        shape.positions.iter().map(|p| [if p[1] > 0.5 { 1.0 } else { 0.5 }]).collect();
    primitive["attributes"]["_LOCK"] = json!(build.floats(&locks));
    build.mesh(vec![primitive]);
    let level = bake(folder.path(), &build, &["--lock-attribute", "_LOCK"]).expect("a level");
    let kept = bits(&level.parts(0)[0].positions);
    let held = shape.positions.iter().filter(|p| p[1] > 0.5).copied().collect::<Vec<_>>();
    assert!(bits(&held).is_subset(&kept));
    let said = bake(folder.path(), &build, &["--lock-attribute", "_HOLD"]).err().expect("an error");
    assert!(said.contains("no vertex carries _HOLD; there are _LOCK"), "{said}");
}
