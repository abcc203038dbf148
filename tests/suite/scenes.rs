//! Several meshes with one budget: who keeps the triangles?

use crate::common::build::Build;
use crate::common::shapes::{Shape, patch, sphere};
use crate::common::{Baked, measured, unmeasured};
use seamwise::bake::options::{BakeOptions, BudgetPer, Targets};
use serde_json::json;

/// A ball with dents.
fn dented() -> Shape {
    let mut ball = sphere(48, 32);
    for p in &mut ball.positions {
        let bump = 1.0 + 0.08 * (9.0 * p[0]).sin() * (7.0 * p[1]).cos() * (8.0 * p[2]).sin();
        *p = p.map(|x| x * bump);
    }
    ball
}

/// A flat sheet.
fn flat() -> Shape {
    let mut sheet = patch(40);
    sheet.positions.iter_mut().for_each(|p| p[1] = -2.0);
    sheet.normals.iter_mut().for_each(|n| *n = [0.0, 1.0, 0.0]);
    sheet
}

/// A mesh and a node for each shape.
fn scene(shapes: &[Shape]) -> Build {
    let mut build = Build::new();
    for shape in shapes {
        let primitive = build.primitive(shape);
        build.mesh(vec![primitive]);
    }
    build
}

fn options(budget_per: BudgetPer, ratios: &[f64], base: BakeOptions) -> BakeOptions {
    let targets = Targets::ratios(ratios.to_vec()).expect("ratios");
    BakeOptions { targets, budget_per, ..base }
}

/// Triangles of each mesh in the one level of a fifth.
fn fifth(build: &Build) -> Vec<usize> {
    let baked =
        Baked::bytes("scene", &build.glb(), &options(BudgetPer::Scene, &[0.2], unmeasured()));
    baked.report.meshes.iter().map(|mesh| mesh.levels[0]).collect()
}

#[test]
fn a_flat_sheet_gives_its_triangles_to_a_dented_ball() {
    let glb = scene(&[flat(), dented()]).glb();
    let ratios = [0.5, 0.2, 0.05];
    let bake = |per| Baked::bytes("scene", &glb, &options(per, &ratios, measured()));
    let (mesh, scene) = (bake(BudgetPer::Mesh), bake(BudgetPer::Scene));
    for (level, (mesh, own)) in mesh.report.levels.iter().zip(&scene.report.levels).enumerate() {
        assert!(own.reached && mesh.reached);
        assert!(own.triangles <= own.target && own.triangles + 2 > own.target);
        assert!(own.triangles.abs_diff(mesh.triangles) <= 3);
        assert_eq!(scene.level(level + 1).triangle_count(), own.triangles);
        let counts = scene.report.meshes.iter().map(|mesh| mesh.levels[level]);
        assert_eq!(counts.sum::<usize>(), own.triangles);
        let far = |report: &seamwise::report::LevelReport| report.metrics.expect("metrics");
        let ratio = far(own).distance_rms / far(mesh).distance_rms;
        assert!(ratio < 0.7, "level {level}: {ratio}");
    }
    let [sheet, ball] = &scene.report.meshes[..] else { panic!("two meshes") };
    assert!(sheet.levels[1] < 20 && sheet.levels[2] >= 1, "{sheet:?}");
    assert!(ball.levels[1] > 30 * sheet.levels[1], "{ball:?}");
    assert!(scene.report.to_text(100).contains("triangles of mesh"));
}

#[test]
fn the_files_are_the_same_on_one_thread_and_on_three() {
    let glb = scene(&[flat(), dented(), dented().scaled(0.3).moved([2.0, 0.0, 0.0])]).glb();
    let options = options(BudgetPer::Scene, &[0.5, 0.1], unmeasured());
    let files = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let mut files = pool.install(|| Baked::bytes("scene", &glb, &options)).files();
        files.retain(|(name, _)| name.ends_with(".glb"));
        files
    };
    assert!(files(1) == files(3));
}

#[test]
fn what_the_scene_shows_larger_or_more_often_keeps_more() {
    let mut build = scene(&[dented(), dented().moved([4.0, 0.0, 0.0])]);
    let alike = fifth(&build);
    assert!(alike[0].abs_diff(alike[1]) * 20 < alike[0], "{alike:?}");
    build.json["nodes"][1]["scale"] = json!([3.0, 3.0, 3.0]);
    let large = fifth(&build);
    assert!(2 * large[1] > 3 * large[0], "{large:?}");
    build.json["nodes"][1]["scale"] = json!([1.0, 1.0, 1.0]);
    let places: Vec<[f32; 3]> = (0..81).map(|at| [at as f32 * 3.0, 0.0, 0.0]).collect();
    let places = build.floats(&places);
    build.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    build.json["nodes"][1]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    assert_eq!(fifth(&build), large, "81 times, which is 3 to the fourth");
}

#[test]
fn one_mesh_is_the_same_either_way() {
    let glb = scene(&[dented()]).glb();
    let level = |per| {
        let baked = Baked::bytes("scene", &glb, &options(per, &[0.3, 0.1], unmeasured()));
        assert!(baked.report.meshes.is_empty());
        baked.files().into_iter().filter(|(name, _)| name.ends_with(".glb")).collect::<Vec<_>>()
    };
    assert!(level(BudgetPer::Mesh) == level(BudgetPer::Scene));
}
