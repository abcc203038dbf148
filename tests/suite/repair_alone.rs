//! `seamwise repair` where no mesh tells: by alpha, by what is around the charts, in sets and folders.

use std::path::{Path, PathBuf};
use std::process::Output as Ended;

use assert_cmd::Command;
use image::{DynamicImage, Rgb, RgbImage, Rgba, RgbaImage};
use seamwise::bake::options::{BakeOptions, Textures};
use seamwise::document::asset::Asset;
use seamwise::image_file::codec::decode;
use seamwise::repair::options::RepairOptions;
use seamwise::repair::repair_bytes;
use seamwise::transfer::{BakeNormals, TransferOptions};
use serde_json::{Value, json};

use crate::common::assets::textured;
use crate::common::build::Build;
use crate::common::shapes::{self, Shape};
use crate::common::{Baked, transferred};

/// A folder for what a test reads and writes.
struct Stage {
    folder: tempfile::TempDir,
}

impl Stage {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn save(&self, name: &str, picture: impl Into<DynamicImage>) -> PathBuf {
        let path = self.at(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        picture.into().save(&path).unwrap();
        path
    }

    fn open(&self, name: &str) -> RgbaImage {
        image::open(self.at(name)).unwrap_or_else(|error| panic!("{name}: {error}")).to_rgba8()
    }

    /// Runs `seamwise repair` with words, in the folder.
    fn run(&self, words: &str) -> Ended {
        let mut command = Command::cargo_bin("seamwise").unwrap();
        command.current_dir(self.folder.path()).arg("repair").args(words.split(' '));
        command.output().unwrap()
    }

    /// The same where all is well: what is said.
    fn repair(&self, words: &str) -> String {
        let ended = self.run(words);
        let [stdout, stderr] = texts(&ended);
        assert!(ended.status.success(), "{words}: {stderr}");
        stdout + &stderr
    }
}

fn texts(ended: &Ended) -> [String; 2] {
    [&ended.stdout, &ended.stderr].map(|bytes| String::from_utf8(bytes.clone()).unwrap())
}

/// A round leaf, white around it under alpha 0, its rim half there.
fn leaf(size: u32) -> RgbaImage {
    RgbaImage::from_fn(size, size, |x, y| {
        let middle = f64::from(size) / 2.0 - 0.5;
        let far = (f64::from(x) - middle).hypot(f64::from(y) - middle);
        match far / f64::from(size) {
            share if share < 0.30 => Rgba([20 + (x % 8) as u8, 120, 20 + (y % 8) as u8, 255]),
            share if share < 0.33 => Rgba([24, 120, 24, 120]),
            _ => Rgba([255, 255, 255, 0]),
        }
    })
}

/// Asserts that alpha is the same to the bit, as is the color of what is seen, and that under alpha 0
/// there are colors of the leaf.
fn assert_spread(before: &RgbaImage, after: &RgbaImage) {
    for ((x, y, before), after) in before.enumerate_pixels().zip(after.pixels()) {
        assert_eq!(before.0[3], after.0[3], "{x} {y}");
        assert!(before.0[3] == 0 || before == after, "{x} {y}");
        let [r, g, b, _] = after.0;
        assert!(r < 40 && (110..130).contains(&g) && b < 40, "{x} {y}: {after:?}");
    }
}

#[test]
fn a_cutout_keeps_its_alpha_and_its_color_spreads_under_what_is_not_there() {
    let stage = Stage::new();
    let leaf = leaf(64);
    stage.save("leaf.png", leaf.clone());
    let said = stage.repair("leaf.png -o out.png --diff diff.png --json report.json");
    assert!(said.contains("background: alpha 0"), "{said}");
    assert_spread(&leaf, &stage.open("out.png"));
    let kept = stage.open("diff.png");
    let is_gray = |x, y| kept.get_pixel(x, y).0[0] == kept.get_pixel(x, y).0[2];
    assert!(is_gray(32, 32) && !is_gray(1, 1), "what was filled is drawn");
    let report: Value =
        serde_json::from_slice(&std::fs::read(stage.at("report.json")).unwrap()).unwrap();
    let hidden = leaf.pixels().filter(|texel| texel.0[3] == 0).count();
    assert_eq!(report["images"][0]["hidden"], json!(hidden));
    // Named by hand it is the same, and so it is with alpha of 16 bits.
    for background in ["alpha", "#ffffff00"] {
        stage.repair(&format!("leaf.png -o named.png --background {background}"));
        assert_eq!(stage.open("named.png"), stage.open("out.png"));
    }
    stage.save("deep.png", DynamicImage::ImageRgba8(leaf.clone()).to_rgba16());
    stage.repair("deep.png -o deep_out.png");
    assert_spread(&leaf, &stage.open("deep_out.png"));
    // A mask tells of alpha too, as before.
    stage.save("mask.png", image::GrayImage::from_pixel(64, 64, image::Luma([255])));
    stage.repair("leaf.png -o masked.png --mask mask.png");
    assert_eq!(stage.open("masked.png"), leaf);
    let [_, error] = texts(&stage.run("mask.png -o x.png --background alpha"));
    assert!(error.contains("mask.png") && error.contains("alpha 0"), "{error}");
}

/// A card that shows all of a picture, and one beside it that shows its left half.
fn cards(picture: &RgbaImage, mode: &str) -> Build {
    let quad = |right: f32| Shape {
        positions: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
            .map(|[x, y]| [x, y, 0.0])
            .to_vec(),
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uvs: vec![[0.0, 1.0], [right, 1.0], [right, 0.0], [0.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let mut build = Build::new();
    let material = build.textured(picture);
    build.json["materials"][material]["alphaMode"] = json!(mode);
    let mut primitive = build.primitive(&quad(if mode == "BLEND" { 0.5 } else { 1.0 }));
    primitive["material"] = json!(material);
    build.mesh(vec![primitive]);
    build
}

fn texels(asset: &Asset, image: usize) -> RgbaImage {
    decode(&asset.images[image], "", Default::default()).unwrap().to_rgba8()
}

#[test]
fn cutouts_of_an_asset_have_no_halo_and_opaque_materials_keep_what_they_show() {
    let stage = Stage::new();
    let leaf = leaf(64);
    for mode in ["MASK", "BLEND", "OPAQUE"] {
        std::fs::write(stage.at("card.glb"), cards(&leaf, mode).glb()).unwrap();
        let said = stage.repair("card.glb -o out.glb");
        let after = texels(&seamwise::import::read(&stage.at("out.glb")).unwrap(), 0);
        match mode {
            "MASK" => assert_spread(&leaf, &after),
            "OPAQUE" => assert!(said.contains("charts cover all of it") && after == leaf, "{said}"),
            _ => {
                // Beyond the chart alpha goes on as it does inside, and is not all opaque.
                let half =
                    |image: &RgbaImage| image::imageops::crop_imm(image, 0, 0, 32, 64).to_image();
                assert_spread(&half(&leaf), &half(&after));
                let alphas = [1, 62].map(|y| after.get_pixel(40, y).0[3]);
                assert!(alphas.iter().all(|alpha| *alpha < 128), "{alphas:?}");
                assert!(after.get_pixel(33, 32).0[3] > 128, "next to the leaf");
            }
        }
        // A bake's repair is the same.
        let bake = ["--ratios", "1", "--no-evaluate", "--quiet"];
        let mut command = Command::cargo_bin("seamwise").unwrap();
        command.args(["bake"]).arg(stage.at("card.glb")).arg("-o").arg(stage.at("baked"));
        assert!(command.args(bake).output().unwrap().status.success());
        let level = seamwise::import::read(&stage.at("baked/card_lod1.glb")).unwrap();
        assert_eq!(texels(&level, 0), after, "{mode}");
    }
}

/// Blades of grass two texels wide, closer to the right.
fn grass() -> RgbaImage {
    RgbaImage::from_fn(128, 128, |x, y| {
        let is_blade = (3 * x + 2 * y) % (14 - x / 14) < 2;
        Rgba([30, 120, 40, if is_blade { 255 } else { 0 }])
    })
}

/// The share of texels whose alpha is so much or more.
fn share(image: &RgbaImage, cutoff: u8) -> f64 {
    let passing = image.pixels().filter(|texel| texel.0[3] >= cutoff).count();
    passing as f64 / f64::from(image.width() * image.height())
}

#[test]
fn leaves_do_not_thin_out_as_they_are_scaled_on_request() {
    let stage = Stage::new();
    let grass = grass();
    stage.save("grass.png", grass.clone());
    let before = share(&grass, 128);
    stage.repair("grass.png -o plain.png --scale 1/8");
    let said = stage.repair("grass.png -o kept.png --scale 1/8 --keep-coverage");
    assert!(said.contains("alpha is scaled"), "{said}");
    let [plain, kept] = ["plain.png", "kept.png"].map(|name| share(&stage.open(name), 128));
    assert!(plain < 0.5 * before && (kept - before).abs() < 0.06, "{before} {plain} {kept}");
    // In an asset by the material's own cutoff; one without a cutoff is scaled as ever.
    for (mode, is_kept) in [("MASK", true), ("OPAQUE", false)] {
        let mut cards = cards(&grass, mode);
        cards.json["materials"][0]["alphaCutoff"] = json!(0.3);
        std::fs::write(stage.at("grass.glb"), cards.glb()).unwrap();
        stage.repair("grass.glb -o grass_out.glb --scale 1/8 --keep-coverage");
        let after = texels(&seamwise::import::read(&stage.at("grass_out.glb")).unwrap(), 0);
        let own = share(&after, 77);
        assert_eq!((own - before).abs() < 0.06, is_kept, "{mode}: {before} {own}");
    }
    for words in
        ["--keep-coverage", "--scale 1/2 --keep-coverage=0", "--scale 1/2 --keep-coverage=x"]
    {
        let ended = stage.run(&format!("grass.png -o x.png {words}"));
        assert_eq!(ended.status.code(), Some(2), "{words}");
    }
}

#[test]
fn textures_of_levels_keep_the_coverage_of_a_cutout_on_request() {
    let grass = grass();
    let mut build = textured(&shapes::patch(9), &grass);
    build.json["materials"][0]["alphaMode"] = json!("MASK");
    let bake = |keep_coverage: bool| {
        let options = transferred(&[0.5], 0.125, BakeNormals::Off);
        let Textures::Transfer(transfer) = options.textures else { panic!("a transfer") };
        let textures = Textures::Transfer(TransferOptions { keep_coverage, ..transfer });
        let baked = Baked::bytes("grass", &build.glb(), &BakeOptions { textures, ..options });
        let level = baked.level(1).picture(0).to_rgba8();
        assert_eq!(level.dimensions(), (16, 16));
        share(&level, 128)
    };
    let before = share(&grass, 128);
    let [plain, kept] = [false, true].map(bake);
    assert!(plain < 0.5 * before && (kept - before).abs() < 0.08, "{before} {plain} {kept}");
}

/// How far each texel is from the valid ones, up to 8; rows, columns and diagonals count alike.
fn distances(valid: &[bool], width: usize) -> Vec<usize> {
    let mut far: Vec<usize> = valid.iter().map(|&valid| if valid { 0 } else { 99 }).collect();
    for ring in 1..=8 {
        let reached: Vec<usize> = (0..far.len())
            .filter(|&texel| {
                let (x, y) = (texel % width, texel / width);
                let near = |at: usize| at.saturating_sub(1)..(at + 2).min(width);
                far[texel] == 99 && near(y).any(|y| near(x).any(|x| far[y * width + x] == ring - 1))
            })
            .collect();
        reached.into_iter().for_each(|texel| far[texel] = ring);
    }
    far
}

#[test]
fn the_samples_atlas_alone_comes_out_as_it_does_with_its_mesh() {
    let sample: &[u8] = include_bytes!("../../data/sample.glb");
    let asset = seamwise::import::read_bytes(sample, Path::new("")).unwrap();
    let repairs = seamwise::atlas::repair_all(&asset, Default::default()).unwrap();
    // Base color on a checkerboard, normals on black.
    for (image, role) in [(0, "color"), (1, "normal")] {
        let repaired = repairs[image].result.as_ref().unwrap();
        let (by_mesh, valid) = (repaired.texels.to_rgb8(), repaired.validity.flags());
        let file = &asset.images[image].bytes;
        let options = RepairOptions::default();
        let (alone, report) =
            repair_bytes(file, Path::new("a.png"), Path::new("b.png"), &options).unwrap();
        let table = report.to_table();
        assert!(table.contains("background: #") && table.contains(role), "{table}");
        assert!(report.warnings.is_empty());
        let alone = image::load_from_memory(&alone).unwrap().to_rgb8();
        let before = image::load_from_memory(file).unwrap().to_rgb8();
        let far = distances(valid, before.width() as usize);
        let (mut sum, mut count) = (0.0, 0);
        for (texel, (alone, by_mesh)) in alone.pixels().zip(by_mesh.pixels()).enumerate() {
            let is_garish = [[0, 255, 0], [255, 0, 255], [0; 3]].contains(&alone.0);
            assert!(!is_garish, "{role}: background is left at {texel}");
            if valid[texel] {
                assert_eq!(alone, by_mesh, "{role}: a valid texel, {texel}");
            } else if far[texel] <= 8 {
                let off = alone.0.iter().zip(by_mesh.0).map(|(a, b)| f64::from(a.abs_diff(b)));
                sum += off.sum::<f64>();
                count += 3;
            }
        }
        let mean = sum / f64::from(count);
        println!("{role}: {mean:.2}/255 within 8 texels of the charts");
        assert!(mean < 6.0, "{role}: {mean}");
    }
}

#[test]
fn a_picture_without_a_background_is_refused_with_advice_and_an_odd_one_is_doubted() {
    let stage = Stage::new();
    let hills = |x: u32, y: u32| {
        let wave = |k: f32| (x as f32 * 0.05 * k + y as f32 * 0.03 * k * k).sin() / k;
        128.0 + 60.0 * (wave(1.0) + wave(2.3))
    };
    // A photograph below a sky that is white.
    let photo = RgbImage::from_fn(96, 96, |x, y| {
        let sky = y < 40 + (hills(x, 0) / 16.0) as u32;
        if sky { Rgb([255; 3]) } else { Rgb([hills(x, y) as u8, hills(y, x) as u8, 60]) }
    });
    let full = RgbImage::from_fn(96, 96, |x, y| Rgb([hills(x, y) as u8, 90, hills(y, x) as u8]));
    for (name, picture) in [("photo.png", photo), ("full.png", full)] {
        stage.save(name, picture);
        let ended = stage.run(&format!("{name} -o out.png"));
        let [_, error] = texts(&ended);
        assert_eq!(ended.status.code(), Some(2));
        for word in [name, "background", "--mesh", "--mask", "--background"] {
            assert!(error.contains(word), "{error}");
        }
        assert!(!stage.at("out.png").exists());
    }
    // A chart of 4 % is hardly an atlas.
    let lost = RgbImage::from_fn(100, 100, |x, y| {
        let is_chart = (40..60).contains(&x) && (40..60).contains(&y);
        if is_chart { Rgb([x as u8, y as u8, 77]) } else { Rgb([0; 3]) }
    });
    stage.save("lost.png", lost);
    let said = stage.repair("lost.png -o out.png");
    assert!(said.contains("warning: lost.png: its background: #000000 is taken"), "{said}");
    let ended = stage.run("lost.png -o strict.png --strict");
    assert_eq!(ended.status.code(), Some(2));
    assert!(
        texts(&ended)[1].contains("96 % of the picture") || texts(&ended)[1].contains("96.0 %")
    );
    assert!(!stage.at("strict.png").exists());
    // What is given is not doubted; several colors may be.
    let said = stage.repair("lost.png -o out.png --background #000000,#ff00ff");
    assert!(!said.contains("warning"), "{said}");
}

#[test]
fn a_normal_map_is_known_by_its_texels_unless_its_role_is_given() {
    let stage = Stage::new();
    let bumps = RgbImage::from_fn(64, 64, |x, y| {
        if !(8..56).contains(&x) || !(8..56).contains(&y) {
            return Rgb([0; 3]);
        }
        let [a, b] = [x, y].map(|v| 0.7 * (0.4 * v as f32).sin());
        let length = (a * a + b * b + 1.0).sqrt();
        Rgb([a, b, 1.0].map(|v| (127.5 * v / length + 127.5).round() as u8))
    });
    stage.save("bumps.png", bumps.clone());
    let said = stage.repair("bumps.png -o out.png");
    assert!(said.contains("filled as a normal map") && said.contains(" normal "), "{said}");
    for texel in stage.open("out.png").pixels() {
        let length =
            (0..3).map(|k| (f32::from(texel.0[k]) / 127.5 - 1.0).powi(2)).sum::<f32>().sqrt();
        assert!((length - 1.0).abs() < 0.02, "{texel:?}");
    }
    let said = stage.repair("bumps.png -o color.png --role color");
    assert!(!said.contains("normal map") && said.contains(" color "), "{said}");
}

/// Maps of one set of 64² or `size`²: two charts, one of them with what each map has for background.
fn maps(size: u32) -> [RgbImage; 3] {
    let at = |v: u32| v * 64 / size;
    let chart = move |x, y| {
        (6..58).contains(&at(y)) && ((6..28).contains(&at(x)) || (34..58).contains(&at(x)))
    };
    let draw = |around: [u8; 3], content: fn(u32, u32) -> [u8; 3]| {
        RgbImage::from_fn(size, size, |x, y| {
            Rgb(if chart(x, y) { content(at(x), at(y)) } else { around })
        })
    };
    let is_plain = |y: u32| y > 30;
    assert!(is_plain(31));
    [
        draw([0; 3], |x, y| [60 + 2 * x as u8, 60 + 2 * y as u8, 90]),
        draw([128, 128, 255], |x, y| {
            if y > 30 { [128, 128, 255] } else { [if x % 8 < 4 { 150 } else { 106 }, 128, 253] }
        }),
        draw([0; 3], |x, y| if x > 30 { [0; 3] } else { [255, 100 + y as u8, 0] }),
    ]
}

#[test]
fn maps_of_a_set_share_their_validity_and_keep_their_names() {
    let stage = Stage::new();
    let names = ["a_color.png", "a_normal.png", "a_orm.png"];
    let before = [maps(64)[0].clone(), maps(32)[1].clone(), maps(64)[2].clone()];
    for (name, map) in names.iter().zip(&before) {
        stage.save(name, map.clone());
    }
    let said = stage.repair(&format!("{} -o out --json report.json", names.join(" ")));
    assert!(said.contains("one set: a_color.png, a_normal.png, a_orm.png"), "{said}");
    // The normal map is half as large, and has the coarser outlines.
    assert!(said.contains("as told by a_color.png, a_orm.png"), "{said}");
    let [color, _, orm] = &before;
    let is_chart = |x: u32, y: u32| color.get_pixel(x, y).0 != [0; 3];
    let after = stage.open("out/a_orm.png");
    for (x, y, texel) in after.enumerate_pixels() {
        // Metalness is 0 in all of the second chart; alone it would be lost.
        let own = orm.get_pixel(x, y).0;
        assert!(!is_chart(x, y) || texel.0[..3] == own, "{x} {y}");
    }
    assert!(after.get_pixel(2, 30).0[0] > 150, "around the first chart it is filled");
    assert!(stage.open("out/a_color.png").pixels().all(|texel| texel.0[2] > 80));
    assert!(stage.open("out/a_normal.png").pixels().all(|texel| texel.0[2] > 240));
    assert_eq!(stage.open("out/a_normal.png").dimensions(), (32, 32));
    let report: Value =
        serde_json::from_slice(&std::fs::read(stage.at("report.json")).unwrap()).unwrap();
    assert_eq!(report["repaired"], 3);
    assert_eq!(report["inputs"][1]["set"].as_array().map(Vec::len), Some(3));
    assert_eq!(report["inputs"][1]["images"][0]["role"], "normal");
    // Other names are pictures apart, unless they are said to be one set.
    for (name, map) in ["one.png", "two.png", "three.png"].iter().zip(&before) {
        stage.save(name, map.clone());
    }
    let said = stage.repair("one.png two.png three.png -o apart");
    assert!(!said.contains("one set"), "{said}");
    stage.repair("one.png two.png three.png -o together --one-set");
    assert_eq!(stage.open("together/three.png"), after);
    // A map of another shape is named, and the others go on.
    stage.save("a_height.png", RgbImage::from_pixel(64, 32, Rgb([9; 3])));
    let ended = stage.run("a_color.png a_height.png a_orm.png -o more");
    let [_, error] = texts(&ended);
    assert_eq!(ended.status.code(), Some(1), "{error}");
    assert!(error.contains("a_height.png") && error.contains("64×32"), "{error}");
    assert!(stage.at("more/a_orm.png").exists() && !stage.at("more/a_height.png").exists());
}

#[test]
fn a_folder_is_repaired_file_by_file_and_what_fails_is_named() {
    let stage = Stage::new();
    let leaf = leaf(32);
    for (name, map) in
        ["in/b/wood_color.png", "in/b/wood_normal.png", "in/b/wood_ao.png"].iter().zip(maps(32))
    {
        stage.save(name, map);
    }
    stage.save("in/leaf.png", leaf.clone());
    std::fs::write(stage.at("in/bad.png"), b"\x89PNG\r\n\x1a\nnothing").unwrap();
    std::fs::write(stage.at("in/notes.txt"), b"of no concern").unwrap();
    std::fs::write(stage.at("in/card.glb"), cards(&leaf, "MASK").glb()).unwrap();
    let ended = stage.run("in -o out --json report.json");
    let [said, error] = texts(&ended);
    assert_eq!(ended.status.code(), Some(1), "{error}");
    assert!(error.contains("1 of 6 inputs failed") && error.contains("in/bad.png"), "{error}");
    assert!(said.contains("5 repaired, 1 failed") && said.contains("one set: "), "{said}");
    assert_spread(&leaf, &stage.open("out/leaf.png"));
    let card = seamwise::import::read(&stage.at("out/card.glb")).unwrap();
    assert_spread(&leaf, &texels(&card, 0));
    for name in ["wood_color.png", "wood_normal.png", "wood_ao.png"] {
        assert!(stage.at("out/b").join(name).exists(), "{name}");
    }
    assert!(!stage.at("out/bad.png").exists());
    let report: Value =
        serde_json::from_slice(&std::fs::read(stage.at("report.json")).unwrap()).unwrap();
    assert_eq!((&report["repaired"], &report["failed"]), (&json!(5), &json!(1)));
    let failed = report["inputs"].as_array().unwrap().iter().find(|own| own["outcome"] == "failed");
    assert!(failed.unwrap()["reason"].as_str().unwrap().contains("bad.png"));

    // One input that goes to a folder keeps its name; nothing repaired is a failure of all.
    stage.repair("in/leaf.png -o out2/");
    assert_spread(&leaf, &stage.open("out2/leaf.png"));
    assert_eq!(stage.run("in/bad.png in/none.png -o out3").status.code(), Some(2));
    // Outputs never overwrite inputs or each other.
    for (words, word) in [
        ("in -o in", "among"),
        ("in/leaf.png in/bad.png -o in", "overwritten"),
        ("in/leaf.png out/leaf.png -o out3", "both write"),
        ("in -o out3 --diff d.png", "--diff"),
    ] {
        let ended = stage.run(words);
        assert_eq!(ended.status.code(), Some(2), "{words}");
        assert!(texts(&ended)[1].contains(word), "{words}: {}", texts(&ended)[1]);
    }
}

#[test]
fn pictures_of_a_gltf_in_a_folder_are_repaired_with_it() {
    let stage = Stage::new();
    std::fs::create_dir_all(stage.at("in")).unwrap();
    let mut build = cards(&leaf(32), "MASK");
    leaf(32).save(stage.at("in/skin a.png")).unwrap();
    build.json["images"][0] = json!({"uri": "skin%20a.png"});
    build.write_gltf(&stage.at("in"), "card");
    let said = stage.repair("in -o out");
    assert!(said.contains("1 repaired, 1 pictures with the .gltf"), "{said}");
    let files: Vec<_> =
        std::fs::read_dir(stage.at("out")).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(files, ["card.glb"]);
}
