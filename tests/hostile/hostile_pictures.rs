//! Damaged and hostile picture files: an error that names the file, soon, within the memory limit,
//! and nothing written.

use std::io::Cursor;
use std::path::Path;

use crate::common;
use crate::common::{crc, files, tiffs, within};
use exr::math::RoundingMode;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, FlatSamples, Image, Layer, Levels, Vec2,
    WritableImage, f16,
};
use image::ImageFormat;
use seamwise::import::options::ReadOptions;
use seamwise::limit::MemoryLimit;
use seamwise::repair::options::{Background, RepairOptions};
use seamwise::repair::{repair_bytes, repair_file};
use seamwise::report::peak_memory;

/// Most memory that any of these may take beside what they decode to.
const MOST_BYTES: u64 = 1 << 30;

fn within_bytes(limit: u64) -> ReadOptions {
    ReadOptions { memory_limit: MemoryLimit::of_bytes(limit), ..ReadOptions::default() }
}

fn options() -> RepairOptions {
    RepairOptions {
        background: Background::Colors(vec![[0.987; 4]]),
        reading: within_bytes(64 << 20),
        ..RepairOptions::default()
    }
}

fn rewrite(bytes: &[u8], extension: &str) -> Result<Vec<u8>, String> {
    let output = format!("out.{extension}");
    let repaired = repair_bytes(bytes, Path::new("in.file"), Path::new(&output), &options());
    match repaired {
        Ok((file, _)) => Ok(file),
        Err(error) => {
            let error = error.to_string();
            assert!(error.contains("in.file"), "{error}");
            assert!(!error.contains("internal"), "{error}");
            Err(error)
        }
    }
}

#[test]
fn a_picture_cut_short_is_an_error_unless_all_its_texels_are_there() {
    within(200, "truncations", || {
        for (extension, whole) in files::all() {
            // As a PNG, which holds no more than the texels of what was read.
            let target = if extension == "exr" { "exr" } else { "png" };
            let target = if extension == "hdr" { "hdr" } else { target };
            let target = if extension == "tif" { "tif" } else { target };
            let complete = rewrite(&whole, target).expect("a sound file");
            let mut well = 0;
            for length in 0..whole.len() {
                if let Ok(file) = rewrite(&whole[..length], target) {
                    well += 1;
                    if target == "png" {
                        let texels = |bytes: &[u8]| image::load_from_memory(bytes).expect("a PNG");
                        assert_eq!(texels(&file), texels(&complete), "{extension} {length}");
                    } else {
                        assert_eq!(file, complete, "{extension} {length}");
                    }
                }
            }
            println!("{extension}: {well} of {} lengths have all texels", whole.len());
            assert!(well <= 60, "{extension}: {well}");
        }
    });
}

#[test]
fn bytes_changed_do_no_harm() {
    within(200, "byte flips", || {
        let mut random = common::Random(7);
        for (extension, whole) in files::all() {
            let (mut well, mut errors) = (0, 0);
            for case in 0..400 {
                let mut bytes = whole.clone();
                let limit = if case % 2 == 0 { bytes.len() } else { bytes.len().min(200) };
                for _ in 0..1 + random.below(3) {
                    bytes[random.below(limit)] = random.next() as u8;
                }
                match rewrite(&bytes, if extension == "exr" { "exr" } else { "tif" }) {
                    Ok(_) => well += 1,
                    Err(_) => errors += 1,
                }
            }
            println!("{extension}: {well} well, {errors} refused");
            assert!(errors > 0, "{extension}");
        }
        assert!(peak_memory().is_none_or(|bytes| bytes < MOST_BYTES));
    });
}

/// A PNG that claims to be so large.
fn lying_png(side: u32) -> Vec<u8> {
    let mut png = files::encoded(&files::texels(), ImageFormat::Png);
    png[16..20].copy_from_slice(&side.to_be_bytes());
    png[20..24].copy_from_slice(&side.to_be_bytes());
    let sum = crc(&png[12..29]).to_be_bytes();
    png[29..33].copy_from_slice(&sum);
    png
}

/// A JPEG that claims to be so large.
fn lying_jpeg(side: u16) -> Vec<u8> {
    let mut jpeg = files::jpeg();
    let frame = jpeg.windows(2).position(|pair| pair == [0xff, 0xc0]).expect("a frame");
    jpeg[frame + 5..frame + 7].copy_from_slice(&side.to_be_bytes());
    jpeg[frame + 7..frame + 9].copy_from_slice(&side.to_be_bytes());
    jpeg
}

/// A TIFF whose first two tags, width and height, are so large.
fn lying_tiff(mut tiff: Vec<u8>, side: u32) -> Vec<u8> {
    let directory = u32::from_le_bytes(*tiff[4..].first_chunk().expect("a header")) as usize;
    for entry in 0..2 {
        let value = directory + 2 + 12 * entry + 8;
        tiff[value..value + 4].copy_from_slice(&side.to_le_bytes());
    }
    tiff
}

/// An EXR whose data windows end so far away.
fn lying_exr(side: i32) -> Vec<u8> {
    let mut exr = files::exr_file(&files::exr(Compression::ZIP16));
    let name = b"dataWindow\0box2i\0";
    for at in 0..exr.len() - name.len() {
        if exr[at..].starts_with(name) {
            let end = at + name.len() + 4 + 8;
            exr[end..end + 4].copy_from_slice(&side.to_le_bytes());
            exr[end + 4..end + 8].copy_from_slice(&side.to_le_bytes());
        }
    }
    exr
}

#[test]
fn huge_claims_are_refused_with_their_size_and_nothing_is_written() {
    within(100, "lies", || {
        let radiance = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n".to_vec();
        let mut webp = files::webp();
        let frame = webp.windows(4).position(|name| name == b"VP8L").expect("a frame");
        webp[frame + 9..frame + 12].fill(0xff);
        // A chunk that claims 4 GiB.
        let mut chunk = files::webp();
        let xmp = chunk.windows(4).position(|name| name == b"XMP ").expect("a chunk");
        chunk[xmp + 4..xmp + 8].copy_from_slice(&(u32::MAX - 9).to_le_bytes());
        chunk[4..8].fill(0xff);
        for (name, bytes, over_limit) in [
            ("a.png", lying_png(60_000), true),
            ("a.jpg", lying_jpeg(65_500), true),
            ("a.tif", lying_tiff(tiffs::deflated(), 60_000), false),
            ("b.tif", lying_tiff(tiffs::gray_floats(), 60_000), false),
            ("a.hdr", radiance, true),
            ("a.exr", lying_exr(60_000), true),
            ("a.webp", webp, false),
            ("b.webp", chunk, false),
            ("b.png", lying_png(0), false),
            ("c.png", lying_png(u32::MAX), true),
            ("b.exr", lying_exr(i32::MAX), false),
            ("c.exr", lying_exr(-50), false),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let input = folder.path().join(name);
            let output = folder.path().join(format!("out-{name}"));
            std::fs::write(&input, bytes).unwrap();
            let error = repair_file(&input, &output, &options()).unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
            assert_eq!(error.contains("--memory-limit"), over_limit, "{name}: {error}");
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "{name}");
        }
        assert!(peak_memory().is_none_or(|bytes| bytes < MOST_BYTES));
    });
}

#[test]
fn a_bomb_goes_off_only_within_the_limit() {
    within(100, "a bomb", || {
        // 36 million texels in some ten kilobytes.
        let black = image::GrayImage::new(6000, 6000);
        let png = files::encoded(&black.into(), ImageFormat::Png);
        assert!(png.len() < 200_000, "{}", png.len());
        let [input, output] = [Path::new("in.png"), Path::new("out.png")];
        let small = RepairOptions { reading: within_bytes(30 << 20), ..options() };
        let error = repair_bytes(&png, input, output, &small).unwrap_err().to_string();
        assert!(error.contains("6000×6000") && error.contains("30MiB"), "{error}");
        // A profile that unpacks to 100 MB.
        let mut info = png::Info::with_size(files::SIDE, files::SIDE);
        info.icc_profile = Some(vec![0; 100 << 20].into());
        let mut profile = Vec::new();
        let encoder = png::Encoder::with_info(&mut profile, info).expect("an encoder");
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&[0; 144]).expect("texels");
        drop(writer);
        let _ = repair_bytes(&profile, input, output, &small);
        assert!(peak_memory().is_none_or(|bytes| bytes < MOST_BYTES));
    });
}

#[test]
fn an_exr_with_a_bad_table_or_of_a_kind_we_lack_is_refused() {
    let image = files::exr(Compression::ZIP16);
    let whole = files::exr_file(&image);
    let channel = whole.windows(2).position(|pair| pair == b"B\0").expect("a channel");
    let mut subsampled = whole.clone();
    // Its type, a byte and three of padding, then the steps of its samples.
    subsampled[channel + 2 + 8] = 2;
    subsampled[channel + 2 + 12] = 2;
    let error = rewrite(&subsampled, "exr").unwrap_err();
    assert!(error.contains("subsampled"), "{error}");
    let error = rewrite(&of_type(&whole, b"deepscanline"), "exr").unwrap_err();
    assert!(error.contains("deep"), "{error}");
    // The table stands before the blocks, 8 bytes for each of them.
    for at in 0..16 {
        let mut bad = whole.clone();
        let table = table_of(&whole);
        bad[table + at] ^= 0xff;
        if let Ok(file) = rewrite(&bad, "exr") {
            assert_eq!(file, rewrite(&whole, "exr").unwrap(), "a table that is not needed");
        }
    }
}

#[test]
fn an_exr_of_tiles_stays_one_and_one_with_mip_levels_is_refused() {
    let mut image = files::exr(Compression::ZIP16);
    image.layer_data.truncate(1);
    let layer = &mut image.layer_data[0];
    layer.encoding.blocks = Blocks::Tiles(Vec2(5, 7));
    let whole = files::exr_file(&image);
    let file = rewrite(&whole, "exr").unwrap();
    let blocks = |bytes: &[u8]| {
        let meta = exr::meta::MetaData::read_from_buffered(bytes, false).expect("a header");
        meta.headers[0].blocks
    };
    assert_eq!(blocks(&file), blocks(&whole));
    let layer = &image.layer_data[0];
    let half = |samples: usize| FlatSamples::F16(vec![f16::ONE; samples]);
    let side = files::SIDE as usize;
    let mips = |channel: &AnyChannel<FlatSamples>| {
        let levels = [side, side / 2, side / 4, 1].map(|side| half(side * side));
        let sample_data =
            Levels::Mip { rounding_mode: RoundingMode::Down, level_data: levels.into() };
        AnyChannel {
            name: channel.name.clone(),
            sample_data,
            quantize_linearly: channel.quantize_linearly,
            sampling: channel.sampling,
        }
    };
    let channels = AnyChannels::sort(layer.channel_data.list.iter().map(mips).collect());
    let layer = Layer::new(layer.size, layer.attributes.clone(), layer.encoding, channels);
    let mut file = Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut file).expect("an EXR");
    let error = rewrite(&file.into_inner(), "exr").unwrap_err();
    assert!(error.contains("mip levels"), "{error}");
}

/// An EXR that says its layers are of another type.
fn of_type(exr: &[u8], name: &[u8]) -> Vec<u8> {
    let own = b"scanlineimage";
    let mut bytes = Vec::new();
    let mut rest = exr;
    while let Some(at) = rest.windows(own.len()).position(|text| text == own) {
        // The length stands before.
        bytes.extend([&rest[..at - 4], &(name.len() as u32).to_le_bytes(), name].concat());
        rest = &rest[at + own.len()..];
    }
    [&bytes, rest].concat()
}

#[test]
fn the_limit_holds_for_every_format() {
    for (extension, whole) in files::all() {
        let limited = RepairOptions { reading: within_bytes(100), ..options() };
        let output = format!("out.{extension}");
        let repaired = repair_bytes(&whole, Path::new("in.file"), Path::new(&output), &limited);
        let error = repaired.unwrap_err().to_string();
        assert!(error.contains("in.file") && error.contains("limit of 100B"), "{error}");
    }
}

/// Where the offset table of an EXR of two layers begins: behind two 0 that end the headers.
fn table_of(exr: &[u8]) -> usize {
    let meta = exr::meta::MetaData::read_from_buffered(exr, false).expect("a header");
    let blocks: usize = meta.headers.iter().map(|header| header.chunk_count).sum();
    let first = (0..exr.len() - 8).find(|&at| {
        let offset = u64::from_le_bytes(*exr[at..].first_chunk().expect("8 bytes"));
        offset == (at + 8 * blocks) as u64
    });
    first.expect("a table")
}

/// Writes the small files where the fuzzer starts from, if the environment says where.
#[test]
fn seeds() {
    let Some(folder) = std::env::var_os("SEAMWISE_CORPUS") else { return };
    std::fs::create_dir_all(&folder).unwrap();
    let more = [tiffs::cmyk(), tiffs::two_pages(), tiffs::big()];
    let all = files::all().into_iter().map(|(_, file)| file).chain(more).chain(tiffs::with_alpha());
    for (index, file) in all.enumerate() {
        std::fs::write(Path::new(&folder).join(format!("seed{index}")), file).unwrap();
    }
}
