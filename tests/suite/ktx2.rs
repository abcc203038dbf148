//! Textures in KTX2, from the outside: read by the transcoder, which is other people's code.

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use image::{DynamicImage, RgbaImage};
use seamwise::bake::Input;
use seamwise::bake::options::{BakeOptions, Targets, TextureFiles, Textures};
use seamwise::export::files::{Layout, OutputOptions};
use seamwise::transfer::{BakeNormals, Sizes, TransferOptions};
use serde_json::{Value, json};

use crate::common::build::Build;
use crate::common::output::Output;
use crate::common::shapes;
use crate::common::textured::Pictures;
use crate::common::{Baked, assets, shared_assets, transferred, unmeasured};

/// The same options with textures in KTX2.
fn in_ktx2(options: BakeOptions) -> BakeOptions {
    BakeOptions { texture_files: TextureFiles { ktx2: true, ..TextureFiles::default() }, ..options }
}

/// Options of one level of an asset whose textures are shared.
fn shared() -> BakeOptions {
    let output = OutputOptions { layout: Layout::None, ..OutputOptions::default() };
    BakeOptions { targets: Targets::halves(1), textures: Textures::Repair, output, ..unmeasured() }
}

/// A torus whose material has a picture of this many texels a side in every role.
fn torus(pictures: &Pictures) -> Build {
    let mut build = Build::new();
    let material = build.textured_material(pictures, &json!({}), &json!({}));
    build.add_shape(&shapes::torus(40, 20), material);
    build
}

/// All mip maps of an image of an output.
fn levels(output: &Output, image: usize) -> Vec<RgbaImage> {
    let file = output.image_bytes(image);
    let transcoder = Transcoder::new(file).expect("a KTX2");
    let level = |level: u32| {
        let info = transcoder.image_level_info(level).expect("a level");
        let texels = transcoder.transcode(level, TargetFormat::Rgba32, DecodeFlags::NONE);
        RgbaImage::from_raw(info.width, info.height, texels.expect("texels")).expect("an image")
    };
    (0..transcoder.level_count()).map(level).collect()
}

/// Peak signal to noise ratio of colors, in dB.
fn psnr(a: &DynamicImage, b: &DynamicImage) -> f64 {
    let [a, b] = [a, b].map(DynamicImage::to_rgb8);
    assert_eq!(a.dimensions(), b.dimensions());
    let squares: f64 = a.iter().zip(b.iter()).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
    20.0 * 255f64.log10() - 10.0 * (squares / a.len() as f64).log10()
}

#[test]
fn every_texture_names_a_file_of_its_own_role_with_all_mip_maps() {
    let pictures = Pictures::noise(64);
    let baked = Baked::bytes("ktx2", &torus(&pictures).glb(), &in_ktx2(shared()));
    assert_eq!(baked.report.warnings.iter().count(), 0);
    let output = baked.level(1);
    assert_eq!(output.json["extensionsRequired"], json!(["KHR_texture_basisu"]));
    for texture in output.json["textures"].as_array().expect("textures") {
        assert!(texture.get("source").is_none());
    }
    let material = &output.json["materials"][0];
    let image_of = |place: &str| {
        let texture = material.pointer(&format!("{place}/index")).and_then(Value::as_u64);
        let texture = &output.json["textures"][texture.expect("a texture") as usize];
        texture["extensions"]["KHR_texture_basisu"]["source"].as_u64().expect("an image") as usize
    };
    // Of the format's descriptor: primaries of BT.709 and sRGB for colors, none and linear for other data.
    let places = [
        ("/pbrMetallicRoughness/baseColorTexture", [1, 2]),
        ("/emissiveTexture", [1, 2]),
        ("/normalTexture", [0, 1]),
        ("/pbrMetallicRoughness/metallicRoughnessTexture", [0, 1]),
    ];
    for (place, space) in places {
        let image = image_of(place);
        assert_eq!(output.json["images"][image]["mimeType"], "image/ktx2");
        let file = output.image_bytes(image);
        let at = u32::from_le_bytes(file[48..52].try_into().expect("four bytes")) as usize;
        assert_eq!(file[at + 13..at + 15], space, "{place}");
        let sizes: Vec<u32> = levels(&output, image).iter().map(RgbaImage::width).collect();
        assert_eq!(sizes, [64, 32, 16, 8, 4, 2, 1], "{place}");
    }
}

#[test]
fn no_mip_map_shows_what_lies_between_charts() {
    let baked = Baked::bytes("cube", &assets::cube(8).glb(), &in_ktx2(shared()));
    let is_magenta = |texel: &image::Rgba<u8>| texel.0[0] > 200 && texel.0[2] > 200;
    let of = |levels: &[RgbaImage]| -> usize {
        levels.iter().map(|level| level.pixels().filter(|own| is_magenta(own)).count()).sum()
    };
    let filled = levels(&baked.level(1), 0);
    assert_eq!((filled.len(), of(&filled)), (assets::cube_atlas().width().ilog2() as usize + 1, 0));
    let kept = in_ktx2(BakeOptions { textures: Textures::Keep, ..shared() });
    let kept = Baked::bytes("cube", &assets::cube(8).glb(), &kept);
    assert!(of(&levels(&kept.level(1), 0)) > 100, "the test would see it");
}

#[test]
fn what_is_lost_is_told() {
    let told = |pictures: &Pictures| {
        let options = BakeOptions { targets: Targets::halves(1), ..in_ktx2(shared()) };
        let baked = Baked::bytes("lost", &torus(pictures).glb(), &options);
        let told: Vec<String> = baked.report.warnings.iter().map(ToString::to_string).collect();
        (baked, told)
    };
    let (baked, odd) = told(&Pictures::noise(30));
    assert!(
        odd.len() == 1 && odd[0].contains("30 × 30 texels are stretched to 32 × 32"),
        "{odd:?}"
    );
    assert_eq!(baked.report.levels[0].textures[0].size, [32, 32]);
    let (_, deep) = told(&Pictures::noise(32).in_16_bits());
    assert!(deep.len() == 1 && deep[0].contains("16 bits a channel"), "{deep:?}");
}

#[test]
fn an_image_of_two_meanings_stays_as_it_is() {
    let pictures = Pictures::noise(32);
    let mut build = torus(&pictures);
    let base = build.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"].clone();
    build.json["materials"][0]["occlusionTexture"] = base;
    let baked = Baked::bytes("both", &build.glb(), &in_ktx2(shared()));
    let told: Vec<String> = baked.report.warnings.iter().map(ToString::to_string).collect();
    assert!(told.len() == 1 && told[0].contains("both as color and as other data"), "{told:?}");
    let formats: Vec<_> = baked.report.levels[0].textures.iter().map(|own| own.format).collect();
    assert_eq!(formats.iter().filter(|own| **own == "image/png").count(), 1, "{formats:?}");
    assert!(formats.contains(&"image/ktx2"));
}

#[test]
fn levels_own_textures_have_sides_of_whole_blocks_and_count_by_their_bytes_on_the_gpu() {
    let pictures = Pictures::noise(100);
    let options = in_ktx2(transferred(&[0.5, 0.25], 0.3, BakeNormals::On));
    let baked = Baked::bytes("own", &torus(&pictures).glb(), &options);
    assert_eq!(baked.report.warnings.iter().count(), 0);
    for (level, side) in baked.report.levels.iter().zip([32, 12]) {
        for texture in &level.textures {
            assert_eq!((texture.size, texture.format), ([side; 2], "image/ktx2"));
        }
        let all: u64 = level.textures.iter().map(|own| own.gpu_bytes).sum();
        assert_eq!(all, level.texture_gpu_bytes);
    }
    // 64, 16, 4, 1, 1 and 1 blocks of 16 bytes.
    assert_eq!(baked.report.levels[0].textures[0].gpu_bytes, 87 * 16);
    // 100², 50², 25², 12², 6², 3² and 1 texels of four bytes, four times, and the one that is used twice.
    let source = 4 * (100 * 100 + 50 * 50 + 25 * 25 + 12 * 12 + 6 * 6 + 3 * 3 + 1);
    let images = torus(&pictures).json["images"].as_array().expect("images").len() as u64;
    assert_eq!(baked.report.input.texture_gpu_bytes, source * images);
}

#[test]
fn bytes_are_the_same_at_any_number_of_threads() {
    let glb = torus(&Pictures::noise(96)).glb();
    let transfer =
        Textures::Transfer(TransferOptions { chooses: true, ..TransferOptions::default() });
    let options = in_ktx2(BakeOptions { textures: transfer, ..unmeasured() });
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let baked = pool.install(|| seamwise::bake_bytes(&glb, "torus", &options));
        baked.expect("a bake").files.into_iter().map(|file| file.bytes).collect::<Vec<_>>()
    };
    assert!(run(1) == run(3));
}

#[test]
fn colors_of_a_scan_come_back_within_what_nobody_sees() {
    let Some(folder) = shared_assets() else { return };
    let path = folder.join("scan/popcorn.glb");
    let transfer = Textures::Transfer(TransferOptions {
        format: seamwise::transfer::TextureFormat::Png,
        sizes: Sizes::Scale(0.5),
        ..TransferOptions::default()
    });
    let targets = Targets::ratios(vec![0.1]).expect("a share");
    let options = BakeOptions { textures: transfer, targets, polish: None, ..shared() };
    let [plain, packed] = [options.clone(), in_ktx2(options)]
        .map(|options| Baked::input(Input::File(&path), &options).expect("a bake").level(1));
    for image in 0..plain.json["images"].as_array().expect("images").len() {
        let own = DynamicImage::ImageRgba8(levels(&packed, image).swap_remove(0));
        let psnr = psnr(&plain.picture(image), &own);
        println!("popcorn, image {image}: {psnr:.1} dB");
        assert!(psnr > 38.0, "{psnr}");
    }
}

#[test]
fn the_smallest_pngs_hold_the_same_texels_in_fewer_bytes() {
    let glb = assets::textured(&shapes::torus(40, 20), &assets::picture(96)).glb();
    let of = |smallest_png| {
        let texture_files = TextureFiles { smallest_png, ..TextureFiles::default() };
        Baked::bytes("small", &glb, &BakeOptions { texture_files, ..shared() })
    };
    let [fast, small] = [of(false), of(true)];
    let bytes = |baked: &Baked| baked.report.levels[0].texture_bytes;
    assert!(bytes(&small) < bytes(&fast), "{} {}", bytes(&small), bytes(&fast));
    let [fast, small] = [fast.level(1), small.level(1)];
    for image in 0..fast.gltf.images().len() {
        let texels = [&fast, &small].map(|output| output.picture(image).to_rgba16());
        assert!(texels[0] == texels[1], "image {image}");
    }
}
