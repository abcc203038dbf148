//! The sense of tangents: a normal map reads the same on the levels as on the source, whichever way the
//! source's tangents turn.

use std::path::Path;

use image::{Rgba, RgbaImage};
use serde_json::json;

use crate::common::build::{Build, png};
use crate::common::output::Output;
use crate::common::shapes::patch;
use crate::common::{Baked, measured};
use seamwise::bake::options::{BakeOptions, Targets};
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::{Metrics, Reference};

/// Slanted grooves, which look the other way where a direction is turned.
fn grooves() -> RgbaImage {
    RgbaImage::from_fn(64, 64, |x, y| {
        let steep = (f64::from((x + 3 * y) % 16) / 16.0 * std::f64::consts::TAU).sin() * 0.6;
        let normal = [steep * 0.32, -steep * 0.95, (1.0 - steep * steep).sqrt()];
        let [r, g, b] = normal.map(|n| ((n * 0.5 + 0.5) * 255.0).round() as u8);
        Rgba([r, g, b, 255])
    })
}

/// A sheet with grooves whose tangents have the sign `w`; 1 is MikkTSpace's.
fn grooved(w: f32) -> Build {
    let shape = patch(24);
    let mut build = Build::new();
    let view = build.view(&png(&grooves()));
    let source = build.add("images", json!({"bufferView": view, "mimeType": "image/png"}));
    let texture = build.add("textures", json!({"source": source}));
    let material = build.add("materials", json!({"normalTexture": {"index": texture}}));
    let mut primitive = build.primitive(&shape);
    // The slope along x follows from the normal.
    let tangents: Vec<[f32; 4]> = shape
        .normals
        .iter()
        .map(|n| {
            let length = n[0].hypot(n[1]);
            [n[1] / length, -n[0] / length, 0.0, w]
        })
        .collect();
    primitive["attributes"]["TANGENT"] = json!(build.floats(&tangents));
    primitive["material"] = json!(material);
    build.mesh(vec![primitive]);
    build
}

fn signs(output: &Output) -> Vec<f32> {
    let mesh = output.gltf.meshes().next().expect("a mesh");
    let primitive = mesh.primitives().next().expect("a primitive");
    let tangents = primitive.get(&gltf::Semantic::Tangents).expect("tangents");
    output.rows(&tangents).iter().map(|row| row[3]).collect()
}

fn bake(w: f32) -> (Output, Metrics) {
    let targets = Targets::halves(1);
    let baked = Baked::bytes("grooved", &grooved(w).glb(), &BakeOptions { targets, ..measured() });
    (baked.level(1), baked.report.levels[0].metrics.expect("metrics"))
}

#[test]
fn a_level_keeps_the_sense_of_flipped_tangents_and_so_its_relief() {
    let (plain, expected) = bake(1.0);
    let (flipped, found) = bake(-1.0);
    assert!(signs(&plain).iter().all(|&w| w == 1.0));
    assert!(signs(&flipped).iter().all(|&w| w == -1.0));
    assert!((found.rms_luminance / expected.rms_luminance - 1.0).abs() < 0.1);
    assert!(found.normal_degrees_rms < 1.1 * expected.normal_degrees_rms);
    // A relief that is turned over is lit from the other side, and that shows.
    let turned = difference(&grooved(-1.0), &grooved(1.0));
    assert!(turned > 4.0 * found.rms_luminance, "{turned} {}", found.rms_luminance);
}

/// RMS luminance between two assets, measured as the levels are.
fn difference(reference: &Build, candidate: &Build) -> f64 {
    let scene = |build: &Build| {
        let asset = seamwise::import::read_bytes(&build.glb(), Path::new("")).expect("an asset");
        load(&asset, &mut TextureCache::default()).expect("a scene")
    };
    let reference = scene(reference);
    let options = measured().evaluate.expect("options");
    let reference = Reference::new(&reference, options).expect("a surface");
    reference.compare(&scene(candidate)).expect("a comparison").rms_luminance
}
