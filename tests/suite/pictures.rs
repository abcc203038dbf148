//! `repair` on picture files of every format: what they hold comes out as it went in, and what
//! would not is refused or said.

use std::io::Cursor;
use std::path::Path;

use crate::common;
use crate::common::files::{self, SIDE, encoded, exr, exr_file, texels};
use crate::common::tiffs;
use exr::prelude::{Compression, FlatImage, LineOrder, ReadChannels, ReadLayers};
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat};
use png::BitDepth;
use seamwise::image_file::codec::EncodeOptions;
use seamwise::image_file::encoded;
use seamwise::repair::options::{Background, RepairOptions};
use seamwise::repair::repair_bytes;
use serde_json::json;
use tiff::decoder::Decoder;
use tiff::tags::Tag;

/// Options by which all texels are valid, as none has this color.
fn all_valid() -> RepairOptions {
    RepairOptions { background: Background::Colors(vec![[0.987; 4]]), ..RepairOptions::default() }
}

/// Repairs what has nothing to repair; the file, and what is said.
fn rewrite(bytes: &[u8], extension: &str) -> Result<(Vec<u8>, String), String> {
    rewrite_with(bytes, extension, &all_valid())
}

fn rewrite_with(
    bytes: &[u8],
    extension: &str,
    options: &RepairOptions,
) -> Result<(Vec<u8>, String), String> {
    let output = format!("out.{extension}");
    let repaired = repair_bytes(bytes, Path::new("in.file"), Path::new(&output), options);
    let (file, report) = repaired.map_err(|error| error.to_string())?;
    Ok((file, report.to_table()))
}

fn decoded(bytes: &[u8]) -> DynamicImage {
    image::load_from_memory(bytes).expect("a picture")
}

#[test]
fn pngs_of_every_kind_keep_their_texels() {
    let (lossless, wide) = (texels(), DynamicImage::from(texels().to_rgba16()));
    for image in [
        DynamicImage::from(lossless.to_luma8()),
        lossless.to_luma_alpha8().into(),
        lossless.to_rgba8().into(),
        lossless.to_luma16().into(),
        lossless.to_luma_alpha16().into(),
        lossless.to_rgb16().into(),
        lossless,
        wide,
    ] {
        let (file, said) = rewrite(&encoded(&image, ImageFormat::Png), "png").unwrap();
        assert_eq!(decoded(&file), image);
        assert!(!said.contains("widened"), "{said}");
    }
}

#[test]
fn a_palette_is_widened_without_loss_and_said() {
    for (file, kind, word) in [
        (files::palette_png(false), ColorType::Rgb8, "palette is widened to RGB"),
        (files::palette_png(true), ColorType::Rgba8, "palette is widened to RGBA"),
        (gray_png(BitDepth::One), ColorType::L8, "1 bit"),
        (gray_png(BitDepth::Two), ColorType::L8, "2 bit"),
        (gray_png(BitDepth::Four), ColorType::L8, "4 bit"),
        (keyed_png(), ColorType::Rgba8, "alpha channel"),
    ] {
        let (after, said) = rewrite(&file, "png").unwrap();
        assert!(said.contains(word), "{word}: {said}");
        let after = decoded(&after);
        assert_eq!(after.color(), kind, "{word}");
        assert_eq!(after, decoded(&file), "{word}");
    }
}

fn gray_png(depth: BitDepth) -> Vec<u8> {
    let rows: Vec<u8> = (0..SIDE * (SIDE * depth as u32).div_ceil(8)).map(|at| at as u8).collect();
    files::png(png::ColorType::Grayscale, depth, &rows, |_| {})
}

/// Texels of the first one's color are transparent.
fn keyed_png() -> Vec<u8> {
    let rows = texels().into_rgb8().into_raw();
    let key = rows[..3].iter().flat_map(|&byte| [0, byte]).collect::<Vec<u8>>();
    files::png(png::ColorType::Rgb, BitDepth::Eight, &rows, |encoder| encoder.set_trns(key))
}

#[test]
fn a_png_keeps_its_chunks() {
    let rows = texels().into_rgb8().into_raw();
    let before = files::png(png::ColorType::Rgb, BitDepth::Eight, &rows, |encoder| {
        encoder.set_source_gamma(png::ScaledFloat::new(0.5));
        encoder.set_pixel_dims(Some(png::PixelDimensions {
            xppu: 11_811,
            yppu: 11_811,
            unit: png::Unit::Meter,
        }));
        encoder.add_text_chunk("Title".into(), "a jar".into()).expect("a text");
        encoder.add_ztxt_chunk("Comment".into(), "long".repeat(50)).expect("a text");
        encoder.add_itxt_chunk("Author".into(), "Wölfli".into()).expect("a text");
    });
    // An encoder that has a profile writes no gamma; a file may hold both.
    let exif = encoded_with_exif(&before);
    let (after, said) = rewrite(&exif, "png").unwrap();
    let info = |bytes: &[u8]| {
        let reader = png::Decoder::new(Cursor::new(bytes)).read_info().expect("a header");
        let info = reader.info();
        let texts = (
            info.uncompressed_latin1_text.clone(),
            info.compressed_latin1_text.clone(),
            info.utf8_text.clone(),
        );
        (info.gama_chunk, info.pixel_dims.map(|dims| dims.xppu), format!("{texts:?}"))
    };
    assert_eq!(info(&exif), info(&after));
    assert!(info(&after).0.is_some() && info(&after).1.is_some());
    assert_eq!(exif_of(&after), Some(files::exif()));
    assert!(!said.contains("beside"), "{said}");
    let (jpeg, said) = rewrite(&exif, "jpg").unwrap();
    assert!(said.contains("EXIF") && said.contains("quality 95"), "{said}");
    assert_eq!(exif_of(&jpeg), Some(files::exif()));
}

/// The same with an eXIf chunk behind its texels.
fn encoded_with_exif(png: &[u8]) -> Vec<u8> {
    let chunk = [&b"eXIf"[..], &files::exif()].concat();
    let length = (files::exif().len() as u32).to_be_bytes();
    let end = png.len() - 12;
    let sum = common::crc(&chunk).to_be_bytes();
    [&png[..end], &length, &chunk, &sum, &png[end..]].concat()
}

fn decoder(bytes: &[u8]) -> impl ImageDecoder {
    let reader = image::ImageReader::new(Cursor::new(bytes)).with_guessed_format().expect("bytes");
    reader.into_decoder().expect("a header")
}

fn exif_of(bytes: &[u8]) -> Option<Vec<u8>> {
    decoder(bytes).exif_metadata().expect("EXIF")
}

fn icc_of(bytes: &[u8]) -> Option<Vec<u8>> {
    decoder(bytes).icc_profile().expect("a profile")
}

#[test]
fn a_jpeg_keeps_its_segments_and_its_grays() {
    let before = files::jpeg();
    let quality = |quality| {
        let encoding = EncodeOptions { quality, ..EncodeOptions::default() };
        rewrite_with(&before, "jpg", &RepairOptions { encoding, ..all_valid() }).unwrap().0
    };
    let after = quality(95);
    assert_eq!(after[..20], before[..20], "the density");
    assert!(after.windows(9).any(|bytes| bytes == b"\xff\xfe\0\x07hello"));
    assert_eq!([exif_of(&after), icc_of(&after)], [exif_of(&before), icc_of(&before)]);
    assert_eq!(icc_of(&after).as_deref(), Some(&b"a profile"[..]));
    assert!(quality(30).len() < after.len());
    let gray = encoded(&texels().to_luma8().into(), ImageFormat::Jpeg);
    assert_eq!(decoded(&rewrite(&gray, "jpg").unwrap().0).color(), ColorType::L8);
    // Losslessly, with all that a PNG has a place for.
    let (png, said) = rewrite(&before, "png").unwrap();
    assert_eq!(decoded(&png), decoded(&before));
    assert_eq!([exif_of(&png), icc_of(&png)], [exif_of(&before), icc_of(&before)]);
    assert!(said.contains("ICC profile and EXIF"), "{said}");
    let only_png = RepairOptions {
        encoding: EncodeOptions { png: true, ..EncodeOptions::default() },
        ..all_valid()
    };
    assert!(rewrite_with(&before, "jpg", &only_png).unwrap_err().contains("--png"));
}

#[test]
fn a_webp_keeps_its_chunks_and_is_written_losslessly() {
    let before = files::webp();
    let (after, said) = rewrite(&before, "webp").unwrap();
    assert_eq!(decoded(&after), texels());
    let chunks = |bytes: &[u8]| {
        let mut decoder = decoder(bytes);
        (decoder.xmp_metadata().unwrap(), decoder.exif_metadata().unwrap(), icc_of(bytes))
    };
    assert_eq!(chunks(&after), chunks(&before));
    assert!(chunks(&after).0.is_some() && said.contains("losslessly"), "{said}");
}

#[test]
fn a_tiff_keeps_its_tags_its_compression_and_its_alpha() {
    let (after, said) = rewrite(&tiffs::deflated(), "tif").unwrap();
    assert_eq!(decoded(&after), texels());
    assert!(said.contains("with Deflate"), "{said}");
    let mut decoder = Decoder::new(Cursor::new(&after)).unwrap();
    assert_eq!(decoder.get_tag_ascii_string(Tag::ImageDescription).unwrap(), "a jar");
    assert_eq!(decoder.get_tag_u8_vec(Tag::IccProfile).unwrap(), b"a profile");
    assert_eq!(decoder.get_tag_unsigned::<u16>(Tag::ResolutionUnit).unwrap(), 2);
    assert_eq!(decoder.get_tag_unsigned::<u16>(Tag::Compression).unwrap(), 8);
    let density = decoder.get_tag(Tag::XResolution).unwrap();
    assert_eq!(density, tiff::decoder::ifd::Value::Rational(300, 1));
    let exif = decoder.get_tag(Tag::ExifDirectory).unwrap().into_ifd_pointer().unwrap();
    let exif = decoder.read_directory(exif).unwrap();
    let speed = Tag::from_u16_exhaustive(0x8827);
    assert_eq!(decoder.read_directory_tags(&exif).get_tag_u32(speed).unwrap(), 400);

    let plain = encoded(&texels().to_rgb16().into(), ImageFormat::Tiff);
    let (after, said) = rewrite(&plain, "tif").unwrap();
    assert_eq!(decoded(&after), decoded(&plain));
    assert!(said.contains("without compression"), "{said}");
    let floats = encoded(&texels().to_rgba32f().into(), ImageFormat::Tiff);
    assert_eq!(decoded(&rewrite(&floats, "tif").unwrap().0), decoded(&floats));
    for (before, alpha) in tiffs::with_alpha().iter().zip([2, 1]) {
        let (after, _) = rewrite(before, "tif").unwrap();
        // The image crate does not read gray with alpha.
        let texels = |tiff: &[u8]| decoded(&rewrite(tiff, "png").unwrap().0);
        assert_eq!(texels(&after), texels(before));
        assert!(texels(&after).color().has_alpha());
        let mut decoder = Decoder::new(Cursor::new(&after)).unwrap();
        assert_eq!(decoder.get_tag_u16_vec(Tag::ExtraSamples).unwrap(), [alpha]);
    }
    assert_eq!(decoded(&rewrite(&tiffs::big(), "tif").unwrap().0), texels());
}

#[test]
fn gray_floats_stay_gray_to_the_bit() {
    let before = tiffs::gray_floats();
    let samples = |bytes: &[u8]| match Decoder::new(Cursor::new(bytes)).unwrap().read_image() {
        Ok(tiff::decoder::DecodingResult::F32(samples)) => samples,
        _ => panic!("no floats"),
    };
    assert_eq!(samples(&rewrite(&before, "tif").unwrap().0), samples(&before));
}

#[test]
fn a_radiance_file_keeps_its_header_under_either_name() {
    for name in ["RADIANCE", "RGBE"] {
        let (after, _) = rewrite(&files::hdr(name), "hdr").unwrap();
        let header = &after[..after.windows(2).position(|pair| pair == b"\n\n").unwrap()];
        let header = std::str::from_utf8(header).unwrap();
        assert!(header.starts_with("#?RADIANCE\n# taken at noon\nEXPOSURE=2.0\n"), "{header}");
        assert_eq!(header.matches("FORMAT=").count(), 1, "{header}");
        assert_eq!(decoded(&after), decoded(&files::hdr("RADIANCE")));
    }
}

#[test]
fn what_would_lose_something_without_a_word_is_refused() {
    for (file, word) in [
        (tiffs::cmyk(), "CMYK"),
        (tiffs::two_pages(), "several pages"),
        (animated_png(), "animation"),
        (cmyk_jpeg(), "CMYK"),
    ] {
        let error = rewrite(&file, "png").unwrap_err();
        assert!(error.contains("in.file") && error.contains(word), "{error}");
        assert!(error.ends_with("not supported"), "{error}");
    }
}

fn animated_png() -> Vec<u8> {
    let rows = texels().into_rgb8().into_raw();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIDE, SIDE);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_animated(2, 0).expect("frames");
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&rows).expect("a frame");
    writer.write_image_data(&rows).expect("a frame");
    writer.finish().expect("an end");
    bytes
}

/// A JPEG whose frame says four components.
fn cmyk_jpeg() -> Vec<u8> {
    let mut bytes = files::jpeg();
    let frame = bytes.windows(2).position(|pair| pair == [0xff, 0xc0]).expect("a frame");
    bytes[frame + 9] = 4;
    bytes
}

fn read_exr(bytes: &[u8]) -> FlatImage {
    let layers = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    layers.all_layers().all_attributes().from_buffered(Cursor::new(bytes)).unwrap()
}

#[test]
fn an_exr_keeps_windows_attributes_layers_and_lossless_compression() {
    for compression in [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
    ] {
        let mut before = exr(compression);
        for layer in &mut before.layer_data {
            layer.encoding.line_order = LineOrder::Decreasing;
        }
        let before = exr_file(&before);
        let after = read_exr(&rewrite(&before, "exr").unwrap().0);
        // Attributes of the file are told from those of its layers only in a program.
        let before = read_exr(&before);
        assert!(before.layer_data[1].attributes.other.len() == 2);
        assert_eq!(after.attributes, before.attributes);
        assert_eq!(after.layer_data.len(), before.layer_data.len());
        for (after, before) in after.layer_data.iter().zip(&before.layer_data) {
            assert_eq!(after, before);
        }
    }
    // Half floats survive PXR24, floats do not: that layer is compressed otherwise.
    let (file, said) = rewrite(&exr_file(&exr(Compression::PXR24)), "exr").unwrap();
    assert_eq!(said.matches("instead").count(), 1, "{said}");
    let after = read_exr(&file);
    let found = [0, 1].map(|layer| after.layer_data[layer].encoding.compression);
    assert_eq!(found, [Compression::PXR24, Compression::ZIP16]);
}

#[test]
fn an_asset_keeps_the_profiles_of_its_images_and_its_jpegs_may_become_pngs() {
    let mut half = common::shapes::patch(4);
    half.uvs.iter_mut().for_each(|uv| uv[0] *= 0.5);
    for (image, png, format, word) in [
        (files::jpeg(), false, encoded::ImageFormat::Jpeg, "quality 80"),
        (files::jpeg(), true, encoded::ImageFormat::Png, "becomes a PNG"),
        (files::palette_png(false), true, encoded::ImageFormat::Png, "palette is widened"),
        (files::webp(), false, encoded::ImageFormat::WebP, "losslessly"),
        (files::webp(), true, encoded::ImageFormat::Png, "becomes a PNG"),
    ] {
        let mut build = common::assets::textured(&half, &image::RgbaImage::new(2, 2));
        let view = build.view(&image);
        build.json["images"][0]["bufferView"] = json!(view);
        if image == files::webp() {
            build.json["textures"][0] = json!({"extensions": {"EXT_texture_webp": {"source": 0}}});
            build.json["extensionsUsed"] = json!(["EXT_texture_webp"]);
            build.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
        }
        let options = RepairOptions {
            encoding: EncodeOptions { png, quality: 80 },
            ..RepairOptions::default()
        };
        let (glb, said) = rewrite_with(&build.glb(), "glb", &options).unwrap();
        assert!(said.contains(word), "{said}");
        let mut asset = seamwise::import::read_bytes(&glb, Path::new("")).unwrap();
        let is_webp = format == encoded::ImageFormat::WebP;
        assert_eq!(asset.json["textures"][0].get("source").is_none(), is_webp);
        assert_eq!(asset.json.get("extensionsRequired").is_some(), is_webp);
        let after = asset.images.remove(0);
        assert_eq!(after.format, format);
        assert_ne!(decoded(&after.bytes), decoded(&image), "it was repaired");
        assert_eq!(
            [icc_of(&after.bytes), exif_of(&after.bytes)],
            [icc_of(&image), exif_of(&image)]
        );
    }
}
