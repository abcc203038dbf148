//! What users may ask of the descent, through the real binary and in its outputs.

use std::collections::BTreeSet;
use std::path::Path;

use crate::common::build::Build;
use crate::common::output::{Output, volume6};
use crate::common::shapes;
use assert_cmd::Command;
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
    let build = sphere("_LOCK", |p| if p[1] > 0.5 { 1.0 } else { 0.5 });
    let level = bake(folder.path(), &build, &["--lock-attribute", "_LOCK"]).expect("a level");
    let kept = bits(&level.parts(0)[0].positions);
    let held =
        shapes::sphere(32, 16).positions.into_iter().filter(|p| p[1] > 0.5).collect::<Vec<_>>();
    assert!(bits(&held).is_subset(&kept));
    let said = bake(folder.path(), &build, &["--lock-attribute", "_HOLD"]).err().expect("an error");
    assert!(said.contains("no vertex carries _HOLD; there are _LOCK"), "{said}");
}

/// A sphere whose vertices carry an attribute.
fn sphere(name: &str, value: impl Fn([f32; 3]) -> f32) -> Build {
    let shape = shapes::sphere(32, 16);
    let mut build = Build::new();
    let mut primitive = build.primitive(&shape);
    let values: Vec<[f32; 1]> = shape.positions.iter().map(|p| [value(*p)]).collect();
    primitive["attributes"][name] = json!(build.floats(&values));
    build.mesh(vec![primitive]);
    build
}

/// The share of a level's points above the equator.
fn upper(level: &Output) -> f64 {
    let positions = &level.parts(0)[0].positions;
    positions.iter().filter(|p| p[1] > 0.0).count() as f64 / positions.len() as f64
}

#[test]
fn importance_comes_from_an_attribute_a_map_or_a_view() {
    let folder = tempfile::tempdir().expect("a folder");
    // V runs from pole to pole; which is up does not matter, but that the two halves differ does.
    let picture =
        image::GrayImage::from_fn(1, 2, |_, y| image::Luma([if y == 0 { 255 } else { 0 }]));
    picture.save(folder.path().join("map.png")).expect("a picture");
    let build = sphere("_IMPORTANCE", |p| if p[1] > 0.0 { 30.0 } else { 1.0 });
    let share = |options: &[&str]| {
        let options = [&["--ratios", "0.25"], options].concat();
        upper(&bake(folder.path(), &build, &options).expect("a level"))
    };
    let even = share(&[]);
    assert!((0.4..0.6).contains(&even), "{even}");
    let weighed = share(&["--importance-attribute", "_IMPORTANCE"]);
    assert!(weighed > 0.65, "{weighed}");
    let painted = share(&["--importance-map", "map.png"]);
    assert!((painted - even).abs() > 0.15, "{painted}");
    let seen = share(&["--view-from", "0,9,0", "--view-weight", "30"]);
    assert!(seen > 0.65, "{seen}");
    let seen = share(&["--view-along", "0,2,0", "--view-weight", "30"]);
    assert!(seen < 0.35, "{seen}");
}

#[test]
fn an_importance_below_zero_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let build = sphere("_IMPORTANCE", |p| p[1]);
    let said = bake(folder.path(), &build, &["--importance-attribute", "_IMPORTANCE"]);
    let said = said.err().expect("an error");
    assert!(said.contains("an importance must be 0 or more"), "{said}");
}

#[test]
fn the_error_limit_is_in_the_units_of_the_scene() {
    let folder = tempfile::tempdir().expect("a folder");
    let triangles = |scale: f64, limit: &str| {
        let mut build = Build::of(&shapes::sphere(32, 16));
        build.json["nodes"][0]["scale"] = json!([scale, scale, scale]);
        let options = ["--ratios", "0.01", "--max-error", limit];
        bake(folder.path(), &build, &options).expect("a level").triangle_count()
    };
    let (one, ten) = (triangles(1.0, "0.01"), triangles(10.0, "0.1"));
    assert_eq!(one, ten);
    assert!(triangles(10.0, "0.01") > one);
}

#[test]
fn the_volume_is_kept_on_request_and_ends_are_vertices_of_the_source() {
    let folder = tempfile::tempdir().expect("a folder");
    let shape = shapes::sphere(32, 16);
    let build = Build::of(&shape);
    let level = |options: &[&str]| {
        let options = [&["--ratios", "0.1"], options].concat();
        bake(folder.path(), &build, &options).expect("a level")
    };
    let source = volume6(&Output::from_bytes(&build.glb(), "source").parts(0));
    let off = |level: &Output| (volume6(&level.parts(0)) / source - 1.0).abs();
    let (free, kept) = (off(&level(&[])), off(&level(&["--keep-volume"])));
    assert!(kept < 1e-4 && kept < 0.5 * free, "{kept} of {free}");
    let ends = level(&["--placement", "ends"]);
    assert!(bits(&ends.parts(0)[0].positions).is_subset(&bits(&shape.positions)));
    for cost in ["geometry", "edge-length"] {
        assert!(level(&["--cost", cost, "--placement", "middle"]).triangle_count() > 0);
    }
}
