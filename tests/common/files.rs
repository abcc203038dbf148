//! Small picture files of every format, made by the encoders of other crates.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Compression, Encoding, FlatImage, FlatSamples,
    ImageAttributes, IntegerBounds, Layer, LayerAttributes, Text, Vec2, WritableImage, f16,
};
use image::{DynamicImage, ImageEncoder, ImageFormat};
use png::{BitDepth, ColorType};

/// Texels along each side of [`texels`].
pub(crate) const SIDE: u32 = 12;

/// Muted colors that differ from texel to texel.
pub(crate) fn texels() -> DynamicImage {
    let texel = |x, y| image::Rgb([100 + 3 * x as u8, 90 + 5 * y as u8, (x * y) as u8]);
    image::RgbImage::from_fn(SIDE, SIDE, texel).into()
}

/// The texels in a format of the image crate.
pub(crate) fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).expect("a picture");
    bytes.into_inner()
}

/// A PNG of the given kind; `adorn` adds what else it holds.
pub(crate) fn png(
    color: ColorType,
    depth: BitDepth,
    rows: &[u8],
    adorn: impl FnOnce(&mut png::Encoder<'_, &mut Vec<u8>>),
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIDE, SIDE);
    encoder.set_color(color);
    encoder.set_depth(depth);
    adorn(&mut encoder);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(rows).expect("texels");
    writer.finish().expect("an end");
    bytes
}

/// A PNG of four bits into a palette of sixteen colors, of which the first is transparent if asked.
pub(crate) fn palette_png(transparent: bool) -> Vec<u8> {
    let rows: Vec<u8> = (0..SIDE * SIDE / 2).map(|at| (at % 256) as u8).collect();
    png(ColorType::Indexed, BitDepth::Four, &rows, |encoder| {
        encoder.set_palette((0..48).map(|at| 40 + at).collect::<Vec<u8>>());
        if transparent {
            encoder.set_trns(vec![0]);
        }
    })
}

/// A WebP with all that it can hold.
pub(crate) fn webp() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = image_webp::WebPEncoder::new(&mut bytes);
    encoder.set_icc_profile(b"a profile".to_vec());
    encoder.set_exif_metadata(exif());
    encoder.set_xmp_metadata(b"<x:xmpmeta/>".to_vec());
    let texels = texels().into_rgb8();
    encoder.encode(&texels, SIDE, SIDE, image_webp::ColorType::Rgb8).expect("a WebP");
    bytes
}

/// A JPEG with an ICC profile, EXIF, 300 dots per inch and a comment.
pub(crate) fn jpeg() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 90);
    encoder.set_pixel_density(image::codecs::jpeg::PixelDensity::dpi(300));
    encoder.set_icc_profile(b"a profile".to_vec()).expect("a profile");
    encoder.set_exif_metadata(exif()).expect("EXIF");
    encoder.write_image(texels().as_bytes(), SIDE, SIDE, texels().color().into()).expect("a JPEG");
    let comment = [&[0xff, 0xfe, 0, 7][..], b"hello"].concat();
    bytes.splice(2 + 18..2 + 18, comment);
    bytes
}

/// EXIF that says the orientation: as it is.
pub(crate) fn exif() -> Vec<u8> {
    let entry = [&0x112u16.to_be_bytes()[..], &[0, 3, 0, 0, 0, 1, 0, 1, 0, 0]].concat();
    [&b"MM\0\x2a\0\0\0\x08\0\x01"[..], &entry, &[0; 4]].concat()
}

/// A Radiance file with an exposure and a comment, under either of its names.
pub(crate) fn hdr(name: &str) -> Vec<u8> {
    let file = encoded(&texels().into_rgb32f().into(), ImageFormat::Hdr);
    let rest = file.splitn(2, |&byte| byte == b'\n').nth(1).expect("a header");
    [format!("#?{name}\n# taken at noon\nEXPOSURE=2.0\n").as_bytes(), rest].concat()
}

/// An EXR of two layers, half and float, in windows of its own, with attributes of its own.
pub(crate) fn exr(compression: Compression) -> FlatImage {
    let size = Vec2(SIDE as usize, SIDE as usize);
    let channel = |name: &str, sample_data| AnyChannel {
        name: name.into(),
        sample_data,
        quantize_linearly: false,
        sampling: Vec2(1, 1),
    };
    let values = || (0..SIDE * SIDE).map(|at| at as f32 / 7.0);
    let half = || FlatSamples::F16(values().map(f16::from_f32).collect());
    let layer = |name: &str, channels: Vec<AnyChannel<FlatSamples>>| {
        let mut attributes = LayerAttributes::named(name);
        attributes.layer_position = Vec2(-3, 5);
        attributes.owner = Some("us".into());
        let value = AttributeValue::F32(0.25);
        attributes.other.insert(Text::from("exposure bias"), value);
        let encoding = Encoding { compression, ..Encoding::SMALL_LOSSLESS };
        Layer::new(size, attributes, encoding, AnyChannels::sort(channels.into_iter().collect()))
    };
    let mut attributes = ImageAttributes::new(IntegerBounds::new((-10, -20), (64, 48)));
    attributes.pixel_aspect = 1.5;
    attributes.other.insert(Text::from("studio"), AttributeValue::Text(Text::from("ours")));
    let color = ["R", "G", "B"].map(|name| channel(name, half()));
    let depth = vec![channel("Z", FlatSamples::F32(values().collect()))];
    let layers = [layer("light", color.into()), layer("depth", depth)];
    FlatImage { attributes, layer_data: layers.into_iter().collect() }
}

/// An EXR as a file.
pub(crate) fn exr_file(image: &FlatImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).expect("an EXR");
    bytes.into_inner()
}

/// One small file of each format and kind, by the extension that it has.
pub(crate) fn all() -> Vec<(&'static str, Vec<u8>)> {
    let image = texels();
    let rgba16 = image.to_rgba16().into();
    let mut files = vec![
        ("png", encoded(&image, ImageFormat::Png)),
        ("png", encoded(&rgba16, ImageFormat::Png)),
        ("png", palette_png(true)),
        ("jpg", jpeg()),
        ("webp", webp()),
        ("tif", encoded(&rgba16, ImageFormat::Tiff)),
        ("tif", super::tiffs::deflated()),
        ("tif", super::tiffs::gray_floats()),
        ("hdr", hdr("RADIANCE")),
    ];
    for compression in [Compression::ZIP16, Compression::PIZ, Compression::RLE] {
        files.push(("exr", exr_file(&exr(compression))));
    }
    files
}
