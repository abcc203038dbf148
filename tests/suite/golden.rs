//! Pictures against those under tests/golden.
//!
//! `UPDATE_GOLDEN=1 cargo test --test suite golden` writes them anew. Where a picture differs, what was
//! made and an amplified difference go to target/diff.

use std::path::Path;

use crate::common::assets::{cube, cube_atlas, picture};
use crate::common::build::Build;
use crate::common::{Baked, shapes, unmeasured};
use image::{Rgb, RgbImage};
use seamwise::evaluate::camera::Rig;
use seamwise::evaluate::load::{TextureCache, load};
use seamwise::evaluate::render::render_views;
use seamwise::evaluate::scene::Mode;
use serde_json::json;

/// Most mean absolute difference over all texels and channels, in steps of 8 bits. Another
/// machine's `exp2` and `log2` may round a few channels to the next step; a triangle lost, or a
/// light moved by a degree, gives more than 0.2.
const TOLERANCE: f64 = 0.05;

/// Fails unless `actual` is the picture called `name`, within [`TOLERANCE`].
fn assert_golden(name: &str, actual: &RgbImage) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = root.join("tests/golden").join(format!("{name}.png"));
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder is made");
        actual.save(&path).expect("a picture is written");
        return;
    }
    let expected = image::open(&path)
        .unwrap_or_else(|error| panic!("{}: {error}; UPDATE_GOLDEN=1 writes it", path.display()))
        .into_rgb8();
    let difference = difference(actual, &expected);
    if difference.is_some_and(|difference| difference <= TOLERANCE) {
        return;
    }
    let folder = root.join("target/diff");
    std::fs::create_dir_all(&folder).expect("a folder is made");
    let save = |kind: &str, picture: &RgbImage| {
        picture.save(folder.join(format!("{name}_{kind}.png"))).expect("a picture is written");
    };
    save("actual", actual);
    if difference.is_some() {
        save("difference", &amplified(actual, &expected));
    }
    panic!("{name} differs by {difference:?}, more than {TOLERANCE}: see {}", folder.display());
}

/// Mean absolute difference over all channels; `None` for pictures of two sizes.
fn difference(a: &RgbImage, b: &RgbImage) -> Option<f64> {
    let pairs = a.as_raw().iter().zip(b.as_raw());
    let sum: u64 = pairs.map(|(&a, &b)| u64::from(a.abs_diff(b))).sum();
    (a.dimensions() == b.dimensions()).then(|| sum as f64 / a.as_raw().len() as f64)
}

/// The difference eightfold, on black.
fn amplified(a: &RgbImage, b: &RgbImage) -> RgbImage {
    RgbImage::from_fn(a.width(), a.height(), |x, y| {
        let (a, b) = (a.get_pixel(x, y), b.get_pixel(x, y));
        Rgb([0, 1, 2].map(|k| a[k].abs_diff(b[k]).saturating_mul(8)))
    })
}

/// A shiny torus around a rough cube over a waved sheet, one of them with a normal map.
fn still_life() -> Build {
    let mut build = Build::new();
    let shiny = build.textured(&picture(64));
    let material = &mut build.json["materials"][shiny]["pbrMetallicRoughness"];
    material["roughnessFactor"] = json!(0.3);
    material["metallicFactor"] = json!(0.8);
    let rough = build.textured(&cube_atlas());
    let sheet = build.textured(&picture(32));
    build.json["materials"][sheet]["doubleSided"] = json!(true);
    build.json["materials"][shiny]["normalTexture"] = json!({"index": 0, "scale": 0.3});
    let shapes = [
        (shapes::torus(48, 24), shiny),
        (shapes::seam_cube(4).scaled(0.45), rough),
        (shapes::patch(12).moved([0.0, -0.8, 0.0]), sheet),
    ];
    let primitives = shapes.map(|(shape, material)| {
        let mut primitive = build.primitive(&shape);
        primitive["material"] = json!(material);
        primitive
    });
    build.mesh(primitives.to_vec());
    build
}

#[test]
fn views_of_the_renderer() {
    let asset = seamwise::import::read_bytes(&still_life().glb(), Path::new("")).expect("an asset");
    let scene = load(&asset, &mut TextureCache::default()).expect("a scene");
    let rig = Rig::around(&scene, 2, 96);
    for (mode, name) in [(Mode::Lit, "lit"), (Mode::Unlit, "unlit")] {
        for (view, image) in render_views(&scene, &rig, mode).iter().enumerate() {
            assert_golden(&format!("{name}_{view}"), &image.to_srgb8());
        }
    }
}

#[test]
fn a_repaired_atlas() {
    let baked = Baked::bytes("cube", &cube(8).glb(), &unmeasured());
    let level = baked.level(1);
    let atlas = image::load_from_memory(level.image_bytes(0)).expect("an image");
    assert_golden("repaired_atlas", &atlas.into_rgb8());
}

#[test]
fn a_difference_is_seen() {
    let picture = |level| RgbImage::from_pixel(4, 4, Rgb([level, 100, 100]));
    assert_eq!(difference(&picture(10), &picture(10)), Some(0.0));
    assert_eq!(difference(&picture(10), &picture(13)), Some(1.0));
    assert_eq!(difference(&picture(10), &RgbImage::new(4, 5)), None);
    assert_eq!(amplified(&picture(10), &picture(13)).get_pixel(0, 0), &Rgb([24, 0, 0]));
}
