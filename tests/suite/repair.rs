//! `seamwise repair` from the outside, on real files.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use exr::prelude::{FlatImage, FlatSamples, read_all_flat_layers_from_file};

/// A real asset; `None`, said aloud, where there are none.
fn asset(name: &str) -> Option<PathBuf> {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/assets")).join(name);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
    }
    path.exists().then_some(path)
}

fn repair(input: &Path, output: &Path, options: &[&str]) -> Result<String, String> {
    let mut command = Command::cargo_bin("seamwise").unwrap();
    command.arg("repair").arg(input).arg("-o").arg(output).args(options);
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    match output.status.code() {
        Some(0) => Ok(text(&output.stdout)),
        Some(2) => Err(text(&output.stderr)),
        code => panic!("{code:?}: {}", text(&output.stderr)),
    }
}

/// The figures of a line of reads: before and after, mip by mip.
fn reads(line: &str) -> [Vec<&str>; 2] {
    let (before, after) = line.split_once(" → ").expect("both");
    let before = before.rsplit_once(": ").expect("a name").1;
    let after = after.split_once("; ").expect("where charts share texels").0;
    [before, after].map(|list| list.split(' ').collect())
}

fn assert_no_invalid_reads_after(table: &str) {
    let lines: Vec<&str> = table.lines().filter(|line| line.contains("charts share")).collect();
    assert!(!lines.is_empty(), "{table}");
    for line in lines {
        let [before, after] = reads(line);
        assert!(before.len() == after.len() && before.len() > 5, "{line}");
        assert!(after.iter().all(|figure| *figure == "0"), "{line}");
    }
}

#[test]
fn a_png_is_repaired_by_its_mask() {
    let folder = tempfile::tempdir().unwrap();
    let [atlas, mask, output] = ["a.png", "m.png", "b.png"].map(|name| folder.path().join(name));
    let chart = |x: u32| (8..20).contains(&x);
    let texel =
        |x| if chart(x) { image::Rgb([90u8, x as u8, 40]) } else { image::Rgb([255, 0, 255]) };
    image::RgbImage::from_fn(32, 16, |x, _| texel(x)).save(&atlas).unwrap();
    let luma = |x| image::Luma([if chart(x) { 255u8 } else { 0 }]);
    image::GrayImage::from_fn(32, 16, |x, _| luma(x)).save(&mask).unwrap();

    let table = repair(&atlas, &output, &["--mask", mask.to_str().unwrap()]).unwrap();
    assert!(table.contains("32×16") && table.contains("192") && table.contains("320"), "{table}");
    let repaired = image::open(&output).unwrap().to_rgb8();
    for (x, _, found) in repaired.enumerate_pixels() {
        assert!(!chart(x) || *found == texel(x));
        assert!(found.0[1] >= 8 && found.0[2] < 50, "{x}: {found:?}");
    }

    let error = repair(&atlas, &atlas, &[]).unwrap_err();
    assert!(error.contains("overwritten"), "{error}");
    let error = repair(&atlas, &output, &["--background", "none"]).unwrap_err();
    assert!(error.contains("a.png") && error.contains("--mesh"), "{error}");
    assert!(repair(&folder.path().join("no.png"), &output, &[]).unwrap_err().contains("no.png"));
}

#[test]
fn an_asset_keeps_all_but_the_texels_around_its_charts() {
    let Some(input) = asset("scan/popcorn.glb") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("popcorn.glb");
    let table = repair(&input, &output, &[]).unwrap();
    assert!(table.contains("2048×2048"), "{table}");
    assert_no_invalid_reads_after(&table);

    let [before, after] = [&input, &output].map(|path| seamwise::import::read(path).unwrap());
    for list in ["nodes", "meshes", "materials", "accessors", "textures", "samplers", "scenes"] {
        assert_eq!(before.json[list], after.json[list], "{list}");
    }
    let texels = |asset: &seamwise::document::asset::Asset| {
        seamwise::image_file::codec::decode(&asset.images[0], "", Default::default())
            .unwrap()
            .to_rgb8()
    };
    let [before, after] = [texels(&before), texels(&after)];
    let changed = before.pixels().zip(after.pixels()).filter(|(a, b)| a != b).count();
    let black = |image: &image::RgbImage| image.pixels().filter(|p| p.0 == [0; 3]).count();
    assert!(changed > 1_000_000, "{changed}");
    assert!(black(&before) > 1_000_000 && black(&after) < 1000, "{}", black(&after));

    // Nothing is left to repair but what the charts do not cover, which is as it was.
    let again = folder.path().join("again.glb");
    repair(&output, &again, &[]).unwrap();
    assert_eq!(std::fs::read(output).unwrap(), std::fs::read(again).unwrap());
}

/// The samples of all channels: their bits, and whether they are finite.
fn samples(image: &FlatImage) -> Vec<Vec<(u16, bool)>> {
    let channels = image.layer_data[0].channel_data.list.iter();
    let halves = |samples: &FlatSamples| match samples {
        FlatSamples::F16(samples) => samples.iter().map(|s| (s.to_bits(), s.is_finite())).collect(),
        other => panic!("{other:?}"),
    };
    channels.map(|channel| halves(&channel.sample_data)).collect()
}

#[test]
fn lightmaps_lose_their_nans_and_keep_what_is_valid_to_the_bit() {
    let Some(mesh) = asset("hdr/CornellBox/CornellBox.glb") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    for (file, name) in [("Box", "cornell_box"), ("Large", "large_box"), ("Small", "small.box")] {
        let input = mesh.with_file_name(format!("CornellBox-{file}.exr"));
        let output = folder.path().join(format!("{file}.exr"));
        let mesh = mesh.to_str().unwrap();
        let options = ["--mesh", mesh, "--uv-set", "1", "--mesh-name", name];
        let table = repair(&input, &output, &options).unwrap();
        assert_no_invalid_reads_after(&table);
        let [before, after] =
            [&input, &output].map(|path| read_all_flat_layers_from_file(path).unwrap());
        assert_eq!(before.attributes, after.attributes);
        assert_eq!(before.layer_data[0].attributes, after.layer_data[0].attributes);
        assert_eq!(before.layer_data[0].encoding, after.layer_data[0].encoding);
        let [before, after] = [samples(&before), samples(&after)];
        let lost = before.iter().flatten().filter(|(_, finite)| !finite).count();
        assert!(lost > 0 && after.iter().flatten().all(|(_, finite)| *finite));
        let texels = before[0].len();
        let same = |texel: &usize| before.iter().zip(&after).all(|(a, b)| a[*texel] == b[*texel]);
        let kept = (0..texels).filter(same).count();
        let covered: usize =
            table.lines().nth(1).unwrap().split_whitespace().nth(3).unwrap().parse().unwrap();
        assert!(kept >= covered && covered > texels / 2, "{kept} {covered} of {texels}");
    }
    let error = repair(
        &mesh.with_file_name("CornellBox-Box.exr"),
        &folder.path().join("b.exr"),
        &["--mesh", mesh.to_str().unwrap(), "--mesh-name", "sphere"],
    );
    assert!(error.unwrap_err().contains("large_box"));
}

#[test]
fn good_padding_is_kept_on_request_and_garbage_never() {
    let folder = tempfile::tempdir().unwrap();
    let [atlas, mask, output] = ["a.png", "m.png", "b.png"].map(|name| folder.path().join(name));
    // Two charts, at columns 8…16 and 40…48; the first has padding of its color, the other noise.
    let chart = |x: u32, y: u32| (8..16).contains(&(x % 32)) && (8..16).contains(&y);
    let texel = |x: u32, y: u32| match (chart(x, y), x < 32) {
        (true, false) => image::Rgb([20u8, 120, 60]),
        (_, true) => image::Rgb([180, 90, 40]),
        _ => image::Rgb([(x * 97 + y * 57) as u8 | 128, 10, (x * 31 + y * 83) as u8]),
    };
    image::RgbImage::from_fn(64, 24, texel).save(&atlas).unwrap();
    let luma = |x, y| image::Luma([if chart(x, y) { 255u8 } else { 0 }]);
    image::GrayImage::from_fn(64, 24, luma).save(&mask).unwrap();

    let mask = ["--mask", mask.to_str().unwrap()];
    let table = repair(&atlas, &output, &mask).unwrap();
    assert!(!table.contains("padding"), "{table}");
    let table = repair(&atlas, &output, &[&mask[..], &["--keep-padding", "4"]].concat()).unwrap();
    // A ring of four texels around the first chart.
    assert!(table.contains(&format!("{} texels of its padding", 16 * 16 - 8 * 8)), "{table}");
    for (x, y, found) in image::open(&output).unwrap().to_rgb8().enumerate_pixels() {
        let kept = chart(x, y) || (4..20).contains(&x) && (4..20).contains(&y);
        assert!(!kept || *found == texel(x, y), "{x} {y}");
        assert!(found.0[1] >= 80, "noise is gone: {x} {y} {found:?}");
    }
}

#[test]
fn what_was_filled_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let [atlas, mask, output, diff] = ["a.png", "m.png", "b.png", "d.png"].map(file);
    image::RgbImage::from_pixel(8, 4, image::Rgb([30, 60, 90])).save(&atlas).unwrap();
    let luma = |x| image::Luma([if x < 4 { 255u8 } else { 0 }]);
    image::GrayImage::from_fn(8, 4, |x, _| luma(x)).save(&mask).unwrap();
    let run = |diff: &Path| {
        let [mask, diff] = [&mask, diff].map(|path| path.to_str().unwrap());
        repair(&atlas, &output, &["--mask", mask, "--diff", diff])
    };
    run(&diff).unwrap();
    for (x, _, texel) in image::open(&diff).unwrap().to_rgb8().enumerate_pixels() {
        let [r, g, b] = texel.0;
        assert_eq!(x < 4, r == g && g == b, "{x}: {texel:?}");
    }
    for (name, word) in [("d.jpg", ".png"), ("a.png", "overwritten"), ("b.png", "both")] {
        let error = run(&file(name)).unwrap_err();
        assert!(error.contains(name) && error.contains(word), "{error}");
    }

    // Of an asset with several images each has its own, by its number.
    let Some(input) = asset("pbr/TennisRacquet/TennisRacquet.gltf") else {
        return;
    };
    let table = repair(&input, &file("t.glb"), &["--diff", diff.to_str().unwrap()]).unwrap();
    let images = seamwise::import::read(&input).unwrap().images.len();
    let drawn = (0..images).filter(|image| file(&format!("d_{image}.png")).exists()).count();
    let rows = table.lines().skip(1).take(images);
    assert_eq!(drawn, rows.filter(|row| !row.contains("left alone")).count(), "{table}");
    assert!(drawn > 1);
}

/// The invalid ones of all texels read, before a repair, mip by mip.
fn invalid_before(table: &str) -> Vec<usize> {
    let line = table.lines().find(|line| line.contains("charts share")).expect("a line of reads");
    let invalid =
        |figure: &&str| figure.split_once('/').expect("a share").0.parse().expect("a number");
    reads(line)[0].iter().map(invalid).collect()
}

#[test]
fn wider_filters_and_blocks_read_more_and_a_repair_leaves_none_of_it() {
    let Some(input) = asset("scan/frypan.glb") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("frypan.glb");
    let run = |options: &[&str]| {
        let table = repair(&input, &output, options).unwrap();
        assert_no_invalid_reads_after(&table);
        assert!(table.contains("charts share texels from mip "), "{table}");
        invalid_before(&table)
    };
    let plain = run(&[]);
    assert_eq!(plain, run(&["--anisotropy", "1"]));
    assert_eq!(plain.len(), 11);
    for options in [&["--blocks"][..], &["--anisotropy", "4"], &["--anisotropy", "16", "--blocks"]]
    {
        let wider = run(options);
        assert!(wider[0] > plain[0] && wider.iter().zip(&plain).all(|(wide, plain)| wide >= plain));
    }

    let inspect = |options: &[&str]| {
        let mut command = Command::cargo_bin("seamwise").unwrap();
        let output = command.arg("inspect").arg(&input).args(options).output().unwrap();
        assert!(output.status.success());
        String::from_utf8(output.stdout).unwrap()
    };
    let list =
        |figures: &[usize]| figures.iter().map(usize::to_string).collect::<Vec<_>>().join(" ");
    let text = inspect(&[]);
    let expected = format!("per mip {}, after a repair {}; charts", list(&plain), list(&[0; 11]));
    assert!(text.contains(&expected), "{text}");
    let blocks = inspect(&["--blocks", "--anisotropy", "4", "--json"]);
    let json: serde_json::Value = serde_json::from_str(&blocks).unwrap();
    let atlas = &json["atlases"][0];
    assert!(atlas["charts_share_from"].is_u64() && atlas["mips"][0]["invalid_after"] == 0);
    assert!(atlas["mips"][0]["invalid"].as_u64().unwrap() > plain[0] as u64);
}

#[test]
fn a_smaller_atlas_has_nothing_of_its_background() {
    let folder = tempfile::tempdir().unwrap();
    let [atlas, mask, output] = ["a.png", "m.png", "b.png"].map(|name| folder.path().join(name));
    let chart = |x: u32, y: u32| (5..27).contains(&x) && (7..30).contains(&y);
    let texel = |x, y| match (chart(x, y), (x + y) % 2) {
        (false, _) => image::Rgb([255u8, 0, 255]),
        (_, 0) => image::Rgb([0; 3]),
        _ => image::Rgb([255; 3]),
    };
    image::RgbImage::from_fn(32, 40, texel).save(&atlas).unwrap();
    let luma = |x, y| image::Luma([if chart(x, y) { 255u8 } else { 0 }]);
    image::GrayImage::from_fn(32, 40, luma).save(&mask).unwrap();
    let mask = mask.to_str().unwrap();
    for (scale, size) in [("1/2", (16, 20)), ("1/8", (4, 5)), ("1/1024", (1, 1))] {
        let table = repair(&atlas, &output, &["--mask", mask, "--scale", scale]).unwrap();
        assert!(table.contains(&format!("{}×{}", size.0, size.1)), "{table}");
        let smaller = image::open(&output).unwrap().to_rgb8();
        assert_eq!(smaller.dimensions(), size);
        assert!(smaller.pixels().all(|p| p.0[0] == p.0[1] && p.0[1] == p.0[2]), "{scale}");
    }
    for scale in ["2", "1/3", "1/0", "half", "1/99999999999"] {
        let mut command = Command::cargo_bin("seamwise").unwrap();
        command.arg("repair").arg(&atlas).arg("-o").arg(&output).args(["--scale", scale]);
        let stderr = String::from_utf8(command.output().unwrap().stderr).unwrap();
        assert!(stderr.contains("--scale") && stderr.contains("1/2"), "{stderr}");
    }
}

#[test]
fn assets_and_lightmaps_are_scaled_with_all_they_hold() {
    let (Some(input), Some(room)) =
        (asset("scan/gelatin_box.glb"), asset("hdr/CornellBox/CornellBox.glb"))
    else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("half.glb");
    let table = repair(&input, &output, &["--scale", "1/4"]).unwrap();
    assert!(table.contains("256×256"), "{table}");
    assert_no_invalid_reads_after(&table);
    let half = seamwise::import::read(&output).unwrap();
    let texels =
        seamwise::image_file::codec::decode(&half.images[0], "", Default::default()).unwrap();
    assert_eq!((texels.width(), texels.height()), (256, 256));

    let light = room.with_file_name("CornellBox-Box.exr");
    let output = folder.path().join("half.exr");
    let with_mesh =
        ["--mesh", room.to_str().unwrap(), "--uv-set", "1", "--mesh-name", "cornell_box"];
    repair(&light, &output, &[&with_mesh[..], &["--scale", "1/2"]].concat()).unwrap();
    let [before, after] =
        [&light, &output].map(|path| read_all_flat_layers_from_file(path).unwrap());
    let sizes =
        |image: &FlatImage| (image.layer_data[0].size, image.attributes.display_window.size);
    assert_eq!(
        (sizes(&before).0.0 / 2, sizes(&before).1.0 / 2),
        (sizes(&after).0.0, sizes(&after).1.0)
    );
    let most = |image: &FlatImage| {
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        let channels = image.layer_data[0].channel_data.list.iter();
        let values = channels.flat_map(|channel| channel.sample_data.values_as_f32());
        values.map(finite).fold(0.0, f32::max)
    };
    assert!(samples(&after).iter().flatten().all(|(_, finite)| *finite));
    assert!(most(&after) < most(&before), "fireflies lie outside the charts");
}

#[test]
fn seams_are_equalized_and_nothing_else_beside_the_fill() {
    let Some(input) = asset("scan/frypan.glb") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let [filled, equalized, json] =
        ["filled.glb", "equalized.glb", "report.json"].map(|name| folder.path().join(name));
    repair(&input, &filled, &[]).unwrap();
    let options = ["--equalize-seams", "--json", json.to_str().unwrap()];
    let table = repair(&input, &equalized, &options).unwrap();
    assert!(table.contains("RMS step across seams"), "{table}");
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    let seams = &report["images"][0]["seams"];
    let steps = |key: &str, mip: usize| seams[key][mip].as_f64().unwrap();
    for mip in 0..3 {
        assert!(steps("rms_step_after", mip) < 0.3 * steps("rms_step_before", mip), "{seams}");
    }
    let texels = |path: &Path| {
        let asset = seamwise::import::read(path).unwrap();
        seamwise::image_file::codec::decode(&asset.images[0], "", Default::default())
            .unwrap()
            .to_rgba8()
    };
    let [before, after] = [texels(&filled), texels(&equalized)];
    let changed = before.pixels().zip(after.pixels()).filter(|(a, b)| a != b).count();
    assert_eq!(changed as u64, seams["changed_texels"].as_u64().unwrap());
}

#[test]
fn a_picture_has_no_seams_without_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let [atlas, output] = ["a.png", "b.png"].map(|name| folder.path().join(name));
    image::GrayImage::new(8, 8).save(&atlas).unwrap();
    let error = repair(&atlas, &output, &["--equalize-seams"]).unwrap_err();
    assert!(error.contains("a.png") && error.contains("--mesh"), "{error}");
    assert!(!output.exists());
}
