//! Small TIFF files of kinds that the image crate does not write.

use std::io::Cursor;

use tiff::encoder::colortype::{CMYK8, Gray8, Gray32Float, RGB8, RGBA8};
use tiff::encoder::compression::DeflateLevel;
use tiff::encoder::{Compression, Rational, TiffEncoder};
use tiff::tags::{ExtraSamples, ResolutionUnit, Tag};

use super::files::{SIDE, texels};

type Encoder<'a> = TiffEncoder<&'a mut Cursor<Vec<u8>>>;

fn file(write: impl FnOnce(Encoder<'_>)) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    write(TiffEncoder::new(&mut bytes).expect("a header"));
    bytes.into_inner()
}

/// RGB with Deflate, 300 dots per inch, a description, an ICC profile and an EXIF directory.
pub(crate) fn deflated() -> Vec<u8> {
    file(|mut file| {
        let mut exif = file.extra_directory().expect("a directory");
        exif.write_tag(Tag::from_u16_exhaustive(0x8827), 400u16).expect("a tag");
        let exif = exif.finish_with_offsets().expect("an offset").offset;
        let mut file = file.with_compression(Compression::Deflate(DeflateLevel::Best));
        let mut page = file.new_image::<RGB8>(SIDE, SIDE).expect("a page");
        page.resolution(ResolutionUnit::Inch, Rational { n: 300, d: 1 });
        let tags = page.encoder();
        tags.write_tag(Tag::ImageDescription, "a jar").expect("a tag");
        tags.write_tag(Tag::IccProfile, &b"a profile"[..]).expect("a tag");
        tags.write_tag(Tag::ExifDirectory, exif).expect("a tag");
        page.write_data(texels().as_bytes()).expect("texels");
    })
}

/// Gray floats, which image editors write for heights and light.
pub(crate) fn gray_floats() -> Vec<u8> {
    let samples: Vec<f32> = (0..SIDE * SIDE).map(|at| at as f32 / 7.0).collect();
    file(|mut file| file.write_image::<Gray32Float>(SIDE, SIDE, &samples).expect("texels"))
}

/// Gray and RGB with alpha, straight and multiplied in.
pub(crate) fn with_alpha() -> [Vec<u8>; 2] {
    let [gray, color] = [texels().into_luma_alpha8().into_raw(), texels().into_rgba8().into_raw()];
    let gray = file(|mut file| {
        let mut page = file.new_image::<Gray8>(SIDE, SIDE).expect("a page");
        page.extra_samples(&[ExtraSamples::UnassociatedAlpha]).expect("alpha");
        page.write_data(&gray).expect("texels");
    });
    let color = file(|mut file| {
        let mut page = file.new_image::<RGBA8>(SIDE, SIDE).expect("a page");
        let alpha = [ExtraSamples::AssociatedAlpha];
        page.encoder().write_tag(Tag::ExtraSamples, &alpha[..]).expect("a tag");
        page.write_data(&color).expect("texels");
    });
    [gray, color]
}

/// What is refused: ink, and two pages.
pub(crate) fn cmyk() -> Vec<u8> {
    let ink = vec![9; (4 * SIDE * SIDE) as usize];
    file(|mut file| file.write_image::<CMYK8>(SIDE, SIDE, &ink).expect("texels"))
}

pub(crate) fn two_pages() -> Vec<u8> {
    file(|mut file| {
        for _ in 0..2 {
            file.write_image::<RGB8>(SIDE, SIDE, texels().as_bytes()).expect("texels");
        }
    })
}

/// A large file's header, with offsets of 64 bits.
pub(crate) fn big() -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let file = TiffEncoder::new_big(&mut bytes);
    let page = texels().into_rgb8();
    file.and_then(|mut file| file.write_image::<RGB8>(SIDE, SIDE, &page)).expect("texels");
    bytes.into_inner()
}
