//! Coordinates that floats cannot hold: a survey's, in meters from far away.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use super::formats::Stage;
use crate::common::output::Output;
use crate::common::unmeasured;
use glam::DVec3;
use seamwise::bake::options::{BakeOptions, Targets};
use seamwise::bake::{Input, bake};
use seamwise::document::asset::Asset;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::{Options, Reference};
use seamwise::export::glb::to_glb;
use seamwise::import::read;
use seamwise::progress::Progress;

const ROWS: usize = 101;
const COLUMNS: usize = 21;
/// Where a patch of ten meters lies in UTM.
const CORNER: [f64; 3] = [458_213.37, 4_512_345.21, 212.8];

/// A wavy grid of 0.1 m that begins at a corner.
fn grid(corner: [f64; 3]) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let place = |at: usize| {
        let [column, row] = [at % COLUMNS, at / COLUMNS].map(|at| at as f64 * 0.1);
        let height = 0.3 * (0.9 * row).sin() * (1.3 * column).cos();
        [corner[0] + column, corner[1] + row, corner[2] + height]
    };
    let square = |at: usize| {
        let [a, b] = [at, at + COLUMNS];
        [[a, a + 1, b + 1], [a, b + 1, b]]
    };
    let squares = (0..COLUMNS * (ROWS - 1)).filter(|at| at % COLUMNS < COLUMNS - 1);
    ((0..COLUMNS * ROWS).map(place).collect(), squares.flat_map(square).collect())
}

fn rows(positions: &[[f64; 3]], begin: &str) -> String {
    let row = |text: &mut String, [x, y, z]: &[f64; 3]| {
        writeln!(text, "{begin}{x:.4} {y:.4} {z:.4}").expect("a text");
    };
    positions.iter().fold(String::new(), |mut text, position| {
        row(&mut text, position);
        text
    })
}

fn faces(triangles: &[[usize; 3]], begin: &str, first: usize) -> String {
    let row =
        |[a, b, c]: &[usize; 3]| format!("{begin}{} {} {}\n", a + first, b + first, c + first);
    triangles.iter().map(row).collect()
}

fn obj(corner: [f64; 3]) -> String {
    let (positions, triangles) = grid(corner);
    rows(&positions, "v ") + &faces(&triangles, "f ", 1)
}

/// The positions of all nodes in the world, by an independent reader.
fn world(asset: &Asset) -> Vec<[f64; 3]> {
    let output = Output::from_bytes(&to_glb(asset).expect("a .glb"), "asset");
    let node = output.gltf.nodes().next().expect("a node");
    let translation = node.transform().decomposed().0.map(f64::from);
    let primitive = node.mesh().expect("a mesh").primitives().next().expect("a primitive");
    let accessor = primitive.get(&gltf::Semantic::Positions).expect("positions");
    let place =
        |row: Vec<f32>| std::array::from_fn(|axis| translation[axis] + f64::from(row[axis]));
    output.rows(&accessor).into_iter().map(place).collect()
}

/// Positions row by row.
fn in_order(positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut sorted = positions.to_vec();
    sorted.sort_by_key(|&[x, y, _]| [y, x].map(|x| (x * 100.0).round() as i64));
    sorted
}

/// Where positions are along an axis, in the file's steps.
fn steps(positions: &[[f64; 3]], axis: usize) -> usize {
    let step = |position: &[f64; 3]| (position[axis] * 1000.0).round() as i64;
    positions.iter().map(step).collect::<BTreeSet<_>>().len()
}

#[test]
fn a_grid_far_away_keeps_all_its_rows_in_each_format() {
    let stage = Stage::new();
    let (positions, triangles) = grid(CORNER);
    let counts = [positions.len(), triangles.len()];
    let off = format!("OFF\n{} {} 0\n", counts[0], counts[1]);
    let off = off + &rows(&positions, "") + &faces(&triangles, "3 ", 0);
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty \
         double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        counts[0], counts[1]
    );
    let ply = ply + &rows(&positions, "") + &faces(&triangles, "3 ", 0);
    for (name, text) in [("a.obj", obj(CORNER)), ("a.off", off), ("a.ply", ply)] {
        let asset = stage.read(name, text);
        let own = world(&asset);
        assert_eq!([steps(&own, 0), steps(&own, 1)], [COLUMNS, ROWS], "{name}");
        let [own, other] = [&own, &positions].map(|all| in_order(all));
        let off = own.iter().flatten().zip(other.iter().flatten());
        assert!(off.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-4, "{name}");
        let node = &asset.json["nodes"][0];
        assert_eq!(node["extras"]["offset"], node["translation"]);
        let said: Vec<String> = asset.warnings.iter().map(ToString::to_string).collect();
        assert!(said.len() == 1 && said[0].contains("translation"), "{said:?}");
    }
    let near = stage.read("b.obj", obj([0.0; 3]));
    assert!(near.json["nodes"][0].get("translation").is_none() && near.warnings.is_empty());
}

/// The report of a bake with one level of half the triangles.
fn bake_file(path: &Path, out: &Path) -> seamwise::report::BakeReport {
    let targets = Targets::ratios(vec![0.5]).expect("a target");
    let evaluate =
        Some(Options { views: 2, resolution: 64, samples: 20_000, ..Options::default() });
    let options = BakeOptions { targets, evaluate, ..unmeasured() };
    bake(Input::File(path), out, &options, &Progress::hidden()).expect("a bake")
}

#[test]
fn a_level_far_away_is_as_near_to_its_source_as_one_at_hand() {
    let stage = Stage::new();
    let out = stage.0.path().join("out");
    let near = bake_file(&stage.put("near.obj", obj([0.0; 3])), &out);
    let far = bake_file(&stage.put("far.obj", obj(CORNER)), &out);
    let metrics =
        |report: &seamwise::report::BakeReport| report.levels[0].metrics.expect("figures");
    let [near, far] = [metrics(&near), metrics(&far)];
    let is_near = |own: f64, other: f64| (own - other).abs() < 0.1 * other.max(1e-6);
    assert!(is_near(far.distance_rms, near.distance_rms), "{far:?} {near:?}");
    // As the text has it, not as floats would.
    let place = DVec3::from_array(far.distance_max_at) - DVec3::from_array(CORNER);
    assert!(
        place.cmpge(DVec3::splat(-1.0)).all() && place.cmple(DVec3::splat(11.0)).all(),
        "{place}"
    );
    // Both levels in one place, as an evaluation of two files sees them.
    let mut moved = read(&out.join("far_lod1.glb")).expect("a level");
    let offset =
        |axis: usize| moved.json["nodes"][0]["extras"]["offset"][axis].as_f64().expect("one");
    let shift = DVec3::new(offset(0), offset(1), offset(2)) - DVec3::from_array(CORNER);
    moved.json["nodes"][0]["translation"] = serde_json::json!(shift.to_array());
    let level = read(&out.join("near_lod1.glb")).expect("a level");
    let mut cache = TextureCache::default();
    let scenes = [level, moved].map(|asset| load(&asset, &mut cache).expect("a scene"));
    let options = Options { views: 1, resolution: 16, samples: 20_000, ..Options::default() };
    let reference = Reference::new(&scenes[0], options).expect("a reference");
    let rms = reference.compare(&scenes[1]).expect("figures").distance_rms * reference.diagonal();
    assert!(rms < 0.0005, "{rms} m");
}

#[test]
fn a_source_that_no_view_shows_is_told_of() {
    let stage = Stage::new();
    stage.put("a.mtl", "newmtl glass\nd 0\n");
    let text = format!("mtllib a.mtl\nusemtl glass\n{}", obj([0.0; 3]));
    let report = bake_file(&stage.put("a.obj", text), &stage.0.path().join("out"));
    let said: Vec<String> = report.warnings.iter().map(ToString::to_string).collect();
    assert!(said.len() == 1 && said[0].starts_with("the source: no view shows it"), "{said:?}");
}
