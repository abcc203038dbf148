//! The evaluator from the outside: known differences give known figures.

use std::path::Path;

use crate::common::assets::{self, picture, textured};
use crate::common::build::Build;
use crate::common::shapes::Shape;
use crate::common::{Baked, measured, shapes};
use glam::{DVec3, EulerRot, Quat};
use image::{Rgba, RgbaImage};
use seamwise::evaluate::camera::Rig;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::scene::{Mode, Scene};
use seamwise::evaluate::{Metrics, Options, Reference};
use serde_json::json;

const OPTIONS: Options =
    Options { views: 3, resolution: 96, samples: 20_000, pixel_tolerance: 1.0, screen_height: 128 };

fn scene(build: &Build) -> Scene {
    let asset = seamwise::import::read_bytes(&build.glb(), Path::new("")).expect("an asset");
    load(&asset, &mut TextureCache::default()).expect("a scene")
}

/// The figures of `candidate` against `reference`, and the reference's diagonal.
fn compare(reference: &Build, candidate: &Build) -> (Metrics, f64) {
    let source = scene(reference);
    let reference = Reference::new(&source, OPTIONS).expect("a surface");
    (reference.compare(&scene(candidate)).expect("a comparison"), reference.diagonal())
}

fn assert_near(what: &str, value: f64, expected: f64, relative: f64) {
    let off = (value - expected).abs();
    assert!(off <= relative * expected.abs(), "{what} is {value}, not {expected}");
}

#[test]
fn a_thing_is_nothing_away_from_itself() {
    for (name, build) in assets::all() {
        let (m, _) = compare(&build, &build);
        let differences = [
            m.rms_luminance,
            m.rms_luminance_srgb,
            m.rms_luminance_covered,
            m.rms_luminance_srgb_covered,
            m.distance_rms,
            m.distance_mean,
            m.distance_max,
            m.forward.distance_rms,
            m.forward.distance_max,
            m.backward.distance_rms,
            m.backward.distance_max,
            m.color_rms,
            m.normal_degrees_rms,
        ];
        assert_eq!(differences, [0.0; 13], "{name}");
        assert_eq!((m.silhouette_iou, m.ssim, m.area_ratio), (1.0, 1.0, 1.0), "{name}");
        assert!(m.volume_ratio.is_none_or(|ratio| ratio == 1.0), "{name}");
        let seen = m.at_switch;
        assert_eq!(
            (seen.rms_luminance, seen.rms_luminance_srgb, seen.ssim),
            (0.0, 0.0, 1.0),
            "{name}"
        );
        assert_eq!(seen.resolution, OPTIONS.resolution, "{name}: no error, no limit to its size");
        assert_eq!((m.border_edges_gained, m.non_manifold_edges_gained), (0, 0), "{name}");
    }
}

#[test]
fn a_solid_has_a_volume_and_a_sheet_has_none() {
    let itself = |build: &Build| compare(build, build).0.volume_ratio;
    assert_eq!(itself(&Build::of(&shapes::torus(24, 12))), Some(1.0));
    let mut flat = shapes::patch(4);
    flat.positions.iter_mut().for_each(|p| p[1] = 0.0);
    assert_eq!(itself(&Build::of(&flat)), None);
}

#[test]
fn a_sphere_one_percent_larger_is_one_percent_away() {
    let sphere = || shapes::sphere(128, 64);
    let (m, diagonal) = compare(&Build::of(&sphere()), &Build::of(&sphere().scaled(1.01)));
    assert_near("the diagonal", diagonal, 2.0 * 3f64.sqrt(), 1e-3);
    for (way, of) in [("forward", m.forward), ("backward", m.backward)] {
        assert_near(&format!("{way} RMS"), of.distance_rms * diagonal, 0.01, 0.01);
        assert_near(&format!("{way} mean"), of.distance_mean * diagonal, 0.01, 0.01);
        assert_near(&format!("{way} max"), of.distance_max * diagonal, 0.01, 0.01);
    }
    assert_near("RMS", m.distance_rms * diagonal, 0.01, 0.01);
    assert_near("volume", m.volume_ratio.expect("a volume"), 1.01f64.powi(3), 1e-5);
    assert_near("area", m.area_ratio, 1.01f64.powi(2), 1e-5);
    assert!(m.silhouette_iou < 0.99 && m.silhouette_iou > 0.95, "{}", m.silhouette_iou);
    assert!(m.normal_degrees_rms < 0.1, "{}", m.normal_degrees_rms);
}

#[test]
fn the_larger_of_two_unlike_directions_counts() {
    let sphere = shapes::sphere(32, 16);
    let mut two = Build::new();
    let primitives = [sphere.clone(), sphere.clone().moved([10.0, 0.0, 0.0])];
    let primitives = primitives.map(|shape| two.primitive(&shape)).to_vec();
    two.mesh(primitives);
    let one = Build::of(&sphere);
    // What is left of the two lies on both, so only one way is far.
    let (m, diagonal) = compare(&two, &one);
    assert_eq!(m.backward.distance_max, 0.0);
    assert_near("max", m.forward.distance_max * diagonal, 10.0, 0.01);
    assert_eq!(m.distance_max, m.forward.distance_max);
    let (m, _) = compare(&one, &two);
    assert_eq!((m.forward.distance_max, m.distance_rms), (0.0, m.backward.distance_rms));
}

#[test]
fn a_shifted_texture_gives_the_color_error_of_its_shift() {
    let ramp = RgbaImage::from_fn(128, 4, |x, _| {
        let level = (2 * x).min(255) as u8;
        Rgba([level, level, level, 255])
    });
    // Away from the rims of the image and from the darkest texels.
    let mut inner = shapes::patch(8);
    inner.uvs.iter_mut().for_each(|uv| uv[0] = 0.3 + 0.4 * uv[0]);
    for texels in [1.0f32, 4.0, 16.0] {
        let moved = inner.clone().uv_moved([texels / 128.0, 0.0]);
        let (m, _) = compare(&textured(&inner, &ramp), &textured(&moved, &ramp));
        assert_near("color", m.color_rms, 2.0 * f64::from(texels) / 255.0, 0.02);
        assert_eq!(m.distance_max, 0.0);
        assert_eq!(m.normal_degrees_rms, 0.0);
        assert!(m.rms_luminance > 0.0 && m.rms_luminance_srgb > 0.0);
    }
}

#[test]
fn half_a_texel_off_gives_the_luminance_error_of_the_ramp() {
    // Two levels a texel: half a texel is one level, wherever it is looked at from.
    let ramp = RgbaImage::from_fn(128, 4, |x, _| {
        let level = (2 * x).min(255) as u8;
        Rgba([level, level, level, 255])
    });
    let mut quad = shapes::patch(1);
    quad.positions.iter_mut().for_each(|p| p[1] = 0.0);
    quad.uvs.iter_mut().for_each(|uv| uv[0] = 0.3 + 0.4 * uv[0]);
    let moved = quad.clone().uv_moved([0.5 / 128.0, 0.0]);
    let [quad, moved] = [quad, moved].map(|shape| scene(&textured(&shape, &ramp)));
    let options = Options { views: 3, resolution: 512, ..OPTIONS };
    let reference = Reference::with_mode(&quad, options, Mode::Unlit).expect("a surface");
    let m = reference.compare(&moved).expect("figures");
    assert_near("sRGB luminance", m.rms_luminance_srgb_covered, 1.0 / 255.0, 0.02);
    assert_eq!((m.distance_max, m.silhouette_iou), (0.0, 1.0));
}

/// Turns a scene about the origin: what a node above it would do.
fn turn(scene: &mut Scene, rotation: Quat) {
    for vector in scene.positions.iter_mut().chain(&mut scene.normals) {
        *vector = rotation * *vector;
    }
    for tangent in scene.tangents.as_flattened_mut() {
        *tangent = (rotation * tangent.truncate()).extend(tangent.w);
    }
}

/// The figures that must not change when all turns; distances in world units, since they are over
/// the bounding box, which is another when turned.
fn turned_figures([reference, candidate]: &[Scene; 2], rig: Rig) -> [f64; 13] {
    let reference = Reference::with_rig(reference, OPTIONS, Mode::Lit, rig).expect("a surface");
    let (m, diagonal) = (reference.compare(candidate).expect("figures"), reference.diagonal());
    [
        m.rms_luminance,
        m.rms_luminance_srgb,
        m.rms_luminance_covered,
        m.rms_luminance_srgb_covered,
        m.rms_luminance_seams,
        m.silhouette_iou,
        m.ssim,
        m.distance_rms * diagonal,
        m.distance_mean * diagonal,
        m.area_ratio,
        m.volume_ratio.unwrap_or(1.0),
        m.color_rms,
        m.normal_degrees_rms,
    ]
}

#[test]
fn turning_model_and_rig_together_changes_nothing() {
    // Where the nearest point lies on a seam, it has the colors and normals of both sides, and
    // rounding decides: only of the sheet, which has no seam, are they compared.
    for (shape, count) in
        [(shapes::torus as fn(u32, u32) -> Shape, 11), (|n, _| shapes::patch(n), 13)]
    {
        let mut scenes = [32, 20].map(|n| {
            let mut build = textured(&shape(n, n / 2), &picture(64));
            build.json["materials"][0]["normalTexture"] = json!({"index": 0, "scale": 0.3});
            scene(&build)
        });
        let rig = Rig::around(&scenes[0], 8, 128);
        let before = turned_figures(&scenes, rig.clone());
        assert!(before[0] > 5e-4 && before[12] > 0.1, "{before:?}");
        let rotation = Quat::from_euler(EulerRot::XYZ, 0.7, -1.1, 0.4);
        scenes.iter_mut().for_each(|scene| turn(scene, rotation));
        let mut turned = rig.turned(rotation.as_dquat());
        let after = turned_figures(&scenes, turned.clone());
        for (figure, (before, after)) in before.iter().zip(&after).enumerate().take(count) {
            assert!((before - after).abs() < 1e-6, "{figure}: {before} {after}");
        }
        // The same cameras under a sky that stays see another picture.
        turned.cameras.iter_mut().for_each(|camera| camera.zenith = DVec3::Y);
        let skewed = turned_figures(&scenes, turned);
        assert!((skewed[0] - before[0]).abs() > 1e-6, "{skewed:?}");
    }
}

#[test]
fn black_against_white_is_a_color_error_of_one() {
    let plain = |level: u8| {
        let picture = RgbaImage::from_pixel(2, 2, Rgba([level, level, level, 255]));
        textured(&shapes::patch(4), &picture)
    };
    let (m, _) = compare(&plain(0), &plain(255));
    assert!((m.color_rms - 1.0).abs() < 1e-6, "{}", m.color_rms);
}

#[test]
fn turned_normals_give_their_angle() {
    let flat = |normal: [f32; 3]| {
        let mut shape = shapes::patch(4);
        shape.positions.iter_mut().for_each(|p| p[1] = 0.0);
        shape.normals.iter_mut().for_each(|n| *n = normal);
        Build::of(&shape)
    };
    let (sin, cos) = 20f32.to_radians().sin_cos();
    let (m, _) = compare(&flat([0.0, 1.0, 0.0]), &flat([sin, cos, 0.0]));
    assert_near("angle", m.normal_degrees_rms, 20.0, 1e-4);
}

#[test]
fn a_node_places_what_it_holds() {
    let plain = Build::of(&shapes::torus(32, 16));
    let mut doubled = Build::of(&shapes::torus(32, 16).scaled(0.5));
    doubled.json["nodes"][0]["scale"] = json!([2.0, 2.0, 2.0]);
    let (m, _) = compare(&plain, &doubled);
    assert!(m.distance_max < 1e-7, "{m:?}");
    let mut mirrored = Build::of(&shapes::torus(32, 16));
    mirrored.json["nodes"][0]["scale"] = json!([-1.0, 1.0, 1.0]);
    // A torus is its own mirror image, and a mirrored one still faces outward.
    let (m, _) = compare(&plain, &mirrored);
    // Its squares are split along the other diagonal.
    assert!(m.distance_max < 1e-6 && m.normal_degrees_rms < 1.0, "{m:?}");
    assert_near("volume", m.volume_ratio.expect("a volume"), 1.0, 1e-5);
    assert!(m.rms_luminance < 1e-3, "{m:?}");
}

#[test]
fn figures_grow_along_the_levels() {
    for (name, build) in [
        ("sphere", textured(&shapes::sphere(64, 32), &picture(64))),
        ("torus", textured(&shapes::torus(64, 32), &picture(64))),
        ("patch", textured(&shapes::patch(32), &picture(64))),
    ] {
        let report = Baked::bytes(name, &build.glb(), &measured()).report;
        let metrics: Vec<Metrics> = report.levels.iter().filter_map(|l| l.metrics).collect();
        assert_eq!(metrics.len(), 4, "{name}");
        for (figure, of) in [
            ("distance_rms", (|m: &Metrics| m.distance_rms) as fn(&Metrics) -> f64),
            ("distance_mean", |m| m.distance_mean),
            ("distance_max", |m| m.distance_max),
            ("rms_luminance", |m| m.rms_luminance),
            ("1 − silhouette_iou", |m| 1.0 - m.silhouette_iou),
            ("1 − ssim", |m| 1.0 - m.ssim),
        ] {
            let values: Vec<f64> = metrics.iter().map(of).collect();
            assert!(values[0] > 0.0, "{name}: {figure} {values:?}");
            assert!(values.is_sorted(), "{name}: {figure} {values:?}");
        }
        let errors: Vec<f64> = report.levels.iter().map(|level| level.error).collect();
        assert!(errors[0] > 0.0 && errors.is_sorted(), "{name}: {errors:?}");
        // A quarter of the triangles leaves these smooth things near to what they were.
        assert!(metrics[1].distance_rms < 5e-3, "{name}: {}", metrics[1].distance_rms);
    }
}

#[test]
fn the_figures_do_not_depend_on_the_number_of_threads() {
    let reference = textured(&shapes::torus(48, 24), &picture(64));
    let candidate = textured(&shapes::torus(30, 16), &picture(64));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| compare(&reference, &candidate).0)
    };
    let one = with(1);
    assert!(one.distance_rms > 0.0);
    for threads in [2, 3, 7] {
        assert_eq!(with(threads), one, "{threads} threads");
    }
}

#[test]
fn a_reference_or_a_candidate_without_a_surface_is_an_error() {
    let mut empty = Build::new();
    let positions = empty.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    empty.mesh(vec![json!({"mode": 1, "attributes": {"POSITION": positions}})]);
    let flat = Build::of(&shapes::patch(4).scaled(0.0));
    let sphere = Build::of(&shapes::sphere(16, 8));
    for nothing in [&empty, &flat] {
        let nothing = scene(nothing);
        assert!(Reference::new(&nothing, OPTIONS).is_err());
        let source = scene(&sphere);
        assert!(Reference::new(&source, OPTIONS).unwrap().compare(&nothing).is_err());
    }
}
