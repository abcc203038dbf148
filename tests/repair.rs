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
    assert!(table.contains("2048×2048") && table.trim_end().ends_with("→ 0"), "{table}");

    let [before, after] = [&input, &output].map(|path| seamwise::read::read(path).unwrap());
    for list in ["nodes", "meshes", "materials", "accessors", "textures", "samplers", "scenes"] {
        assert_eq!(before.json[list], after.json[list], "{list}");
    }
    let texels = |asset: &seamwise::asset::Asset| {
        seamwise::images::decode(&asset.images[0], "", Default::default()).unwrap().to_rgb8()
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
        assert!(table.trim_end().ends_with("→ 0"), "{table}");
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
        let asset = seamwise::read::read(path).unwrap();
        seamwise::images::decode(&asset.images[0], "", Default::default()).unwrap().to_rgba8()
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
