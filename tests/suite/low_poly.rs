//! Low-poly props: that they are what they are meant to be, and what their levels keep of them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use crate::common::Baked;
use crate::common::low_poly::prop::color_areas;
use crate::common::low_poly::{MODELS, Model, extent_kept};
use crate::common::output::{Output, half_edges, volume6};
use rayon::prelude::*;
use seamwise::bake::options::BakeOptions;
use seamwise::evaluate;

fn source(model: &Model) -> Output {
    Output::from_bytes(&model.build().glb(), model.name)
}

/// A level, and what it keeps of its source.
struct Kept {
    level: usize,
    reached: bool,
    why: Option<String>,
    target: usize,
    triangles: usize,
    /// Over the diagonal.
    greatest: f64,
    /// Over the source's.
    area: f64,
    extent: f32,
    /// The least that is left of the area of any one color.
    color: f32,
    /// The area of the first mesh over its source's.
    first_mesh: f32,
}

/// What a level is off by at most over the diagonal: 2.5 % at the samples of the descent, and what lies
/// between them and the polish add.
const GREATEST: f64 = 0.04;

/// The prop whose leaves go whole while others grow in their place: how far that is off says little, its area all.
const CROWD: &str = "foliage";

/// The levels of every prop with default options, baked once for all tests.
static LEVELS: LazyLock<Vec<(Model, Vec<Kept>)>> =
    LazyLock::new(|| MODELS.par_iter().map(|model| (*model, levels(model))).collect());

fn levels(model: &Model) -> Vec<Kept> {
    // The figures sought need no pictures.
    let evaluate = evaluate::Options {
        views: 1,
        resolution: 16,
        samples: 10_000,
        pixel_tolerance: 1.0,
        screen_height: 128,
    };
    let options = BakeOptions { evaluate: Some(evaluate), ..BakeOptions::default() };
    let baked = Baked::bytes(model.name, &model.build().glb(), &options);
    let source = source(model);
    let colors = color_areas(&source);
    let kept = |level: usize| {
        let report = &baked.report.levels[level - 1];
        let metrics = report.metrics.expect("a level that was measured");
        let output = baked.level(level);
        let left = color_areas(&output);
        let left = colors.iter().map(|(color, area)| left.get(color).unwrap_or(&0.0) / area);
        Kept {
            level,
            reached: report.reached,
            why: report.why.clone(),
            target: report.target,
            triangles: report.triangles,
            greatest: metrics.distance_max,
            area: metrics.area_ratio,
            extent: extent_kept(&source, &output),
            color: left.fold(f32::INFINITY, f32::min),
            first_mesh: first_mesh_area(&output) / first_mesh_area(&source),
        }
    };
    (1..=baked.report.levels.len()).map(kept).collect()
}

fn first_mesh_area(output: &Output) -> f32 {
    let parts = output.parts(0);
    let area = |part: &crate::common::output::Part, triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| glam::Vec3::from_array(part.positions[v as usize]));
        (b - a).cross(c - a).length() / 2.0
    };
    parts.iter().flat_map(|part| part.triangles.iter().map(move |t| area(part, t))).sum()
}

/// The levels of one prop.
fn levels_of(name: &str) -> &'static [Kept] {
    &LEVELS.iter().find(|(model, _)| model.name == name).expect("a prop of that name").1
}

/// Fails with all that is wrong at once.
fn assert_none(wrong: &[String]) {
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn props_are_low_poly() {
    for model in MODELS {
        let triangles = source(&model).triangle_count();
        assert!((100..=2000).contains(&triangles), "{}: {triangles} triangles", model.name);
    }
}

#[test]
fn props_are_closed_where_they_are_meant_to_be() {
    for model in MODELS {
        let output = source(&model);
        let parts: Vec<_> =
            (0..output.gltf.meshes().len()).map(|mesh| output.parts(mesh)).collect();
        let closed = parts.iter().all(|parts| {
            let edges = half_edges(parts);
            edges.iter().all(|(&(a, b), count)| edges.get(&(b, a)) == Some(count))
        });
        assert_eq!(closed, model.closed, "{}", model.name);
        if closed && model.name != "doubled_sheet" {
            assert!(parts.iter().all(|parts| volume6(parts) > 0.0), "{}: inside out", model.name);
        }
    }
}

#[test]
fn props_have_hard_edges_and_sound_normals() {
    for model in MODELS {
        let output = source(&model);
        let mut normals: BTreeMap<[u32; 3], BTreeSet<Vec<u32>>> = BTreeMap::new();
        for part in (0..output.gltf.meshes().len()).flat_map(|mesh| output.parts(mesh)) {
            for (position, normal) in part.positions.iter().zip(&part.normals) {
                let length = normal.iter().map(|x| x * x).sum::<f32>().sqrt();
                assert!((length - 1.0).abs() < 1e-4, "{}: a normal of {length}", model.name);
                let normal = normal.iter().map(|x| x.to_bits()).collect();
                normals.entry(position.map(f32::to_bits)).or_default().insert(normal);
            }
            for triangle in &part.triangles {
                let [a, b, c] =
                    triangle.map(|v| glam::Vec3::from_array(part.positions[v as usize]));
                assert!((b - a).cross(c - a).length() > 0.0, "{}: no area", model.name);
            }
        }
        let split = normals.values().filter(|normals| normals.len() > 1).count();
        // Cards have borders instead.
        assert!(split > 0 || !model.closed, "{}: smooth all over", model.name);
    }
}

#[test]
fn props_are_unlike_one_another() {
    let mut known = BTreeSet::new();
    for model in MODELS {
        let output = source(&model);
        let [low, high] = output.scene_box();
        // Ten steps of each side over the longest.
        let shape = ((high - low) / (high - low).max_element() * 10.0).round().as_ivec3();
        let meshes = output.gltf.meshes().len();
        let what = (output.triangle_count() / 50, meshes, shape.to_array());
        assert!(known.insert(what), "{}: as another", model.name);
        assert_eq!(model.build().glb(), model.build().glb(), "{}: not the same twice", model.name);
    }
}

#[test]
fn a_level_misses_its_target_only_if_it_says_so() {
    for (model, levels) in LEVELS.iter() {
        for Kept { level, reached, why, target, triangles, .. } in levels {
            let what = format!("{} level {level}: {triangles} of {target}", model.name);
            // It may also have few enough where one of its meshes has too many.
            assert!(!reached || triangles <= target, "{what}");
            let says_why = why.as_ref().is_some_and(|why| !why.is_empty());
            assert_eq!(says_why, !reached, "{what}");
        }
        let falls = levels.windows(2).all(|pair| pair[0].triangles >= pair[1].triangles);
        assert!(falls, "{}: a coarser level has more triangles", model.name);
    }
}

/// What was reached in good shape before there was a rule to stop: the rule is for the rest.
#[test]
fn stopping_is_for_what_can_not_be_reached() {
    let reached =
        |level: usize| LEVELS.iter().filter(|(_, levels)| levels[level - 1].reached).count();
    let [half, quarter] = [reached(1), reached(2)];
    assert!(half >= 22, "{half} props reach 50 %");
    assert!(quarter >= 9, "{quarter} props reach 25 %");
    for name in ["mushrooms", "traffic_light", "street_lamp", "speaker", "cup"] {
        assert!(levels_of(name)[..2].iter().all(|kept| kept.reached), "{name} stops early");
    }
}

#[test]
fn a_level_that_reaches_its_target_keeps_the_shape() {
    let mut wrong = Vec::new();
    for (model, levels) in LEVELS.iter() {
        for kept in levels.iter().filter(|kept| kept.reached) {
            let Kept { level, greatest, area, extent, .. } = kept;
            let is_far = *greatest > GREATEST && model.name != CROWD;
            if is_far || *area < 0.9 || *extent < 0.9 {
                wrong.push(format!(
                    "{} level {level}: off by {greatest:.3}, area {area:.2}, extent {extent:.2}",
                    model.name
                ));
            }
        }
    }
    assert_none(&wrong);
}

/// A level that stops is emitted before cost explodes, so that it is no wreck either.
#[test]
fn a_level_that_stops_is_no_wreck() {
    let mut wrong = Vec::new();
    for (model, levels) in LEVELS.iter() {
        for Kept { level, greatest, area, extent, .. } in levels.iter().filter(|k| !k.reached) {
            let is_far = *greatest > 0.06 && model.name != CROWD;
            if is_far || *area < 0.75 || *extent < 0.9 {
                wrong.push(format!(
                    "{} level {level}: off by {greatest:.3}, area {area:.2}, extent {extent:.2}",
                    model.name
                ));
            }
        }
    }
    assert_none(&wrong);
}

/// Tyres, rings, holes and lamps can't collapse below a few triangles each; what carries them does
/// not pay for that.
#[test]
fn what_can_not_collapse_does_not_eat_the_rest() {
    let mut wrong = Vec::new();
    for name in ["tugboat", "speaker", "house", "traffic_light", "street_lamp", "radio_mast"] {
        for Kept { level, area, extent, .. } in levels_of(name) {
            if *area < 0.75 || *extent < 0.9 {
                wrong.push(format!("{name} level {level}: area {area:.2}, extent {extent:.2}"));
            }
        }
    }
    assert_none(&wrong);
}

#[test]
fn a_floor_of_two_triangles_stays_whole() {
    for Kept { level, first_mesh, .. } in levels_of("ball_on_floor") {
        assert!((first_mesh - 1.0).abs() < 0.01, "level {level}: {first_mesh:.2} of the floor");
    }
}

/// Eyes, lamps and headlights: small, but seen by their color.
#[test]
fn small_parts_of_a_color_of_their_own_stay() {
    let mut wrong = Vec::new();
    for name in ["mushrooms", "traffic_light", "street_lamp", "radio_mast", "car"] {
        for Kept { level, color, .. } in &levels_of(name)[..2] {
            if *color < 0.3 {
                wrong.push(format!("{name} level {level}: {color:.2} of a color's area"));
            }
        }
    }
    assert_none(&wrong);
}
