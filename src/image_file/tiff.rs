//! TIFF files to texels and back, with what their tags say.
//!
//! Kept: the kind of texels, gray floats too; compression where it is lossless and we have it
//! (none, LZW, Deflate, PackBits; everything else becomes Deflate, which is said); alpha's meaning;
//! resolution, ICC profile, XMP, IPTC, EXIF, GPS, georeference and texts. Tiles become strips, and
//! a predictor of floats is left out. Refused: several pages, CMYK, and what the image crate does
//! not decode, palettes for one. Previews of the page are left out, which is said.
//!
//! Reference: TIFF Revision 6.0, Adobe, 1992.

use std::io::Cursor;

use image::{DynamicImage, GrayAlphaImage, ImageBuffer, ImageFormat, Rgb32FImage};
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::encoder::colortype::{self, ColorType};
use tiff::encoder::compression::DeflateLevel;
use tiff::encoder::{Compression, Predictor, TiffEncoder, TiffKind, TiffValue};
use tiff::tags::{ExtraSamples, IfdPointer, Tag, Type, ValueBuffer};
use tiff::{TiffError, TiffResult};

use super::codec::open;
use crate::error::{Error, Result};
use crate::limit::MemoryLimit;

/// Tags that stay true whatever becomes of the texels: make, model, orientation, description,
/// resolution, page name, software, date, artist, host, white point, primaries, alpha, XMP, IPTC,
/// copyright, Photoshop's, ICC profile, GeoTIFF's and GDAL's.
const CARRIED: [u16; 29] = [
    269, 270, 271, 272, 274, 282, 283, 285, 296, 305, 306, 315, 316, 318, 319, 338, 700, 33_432,
    33_550, 33_723, 33_922, 34_264, 34_377, 34_675, 34_735, 34_736, 34_737, 42_112, 42_113,
];
/// Directories of their own: EXIF and GPS.
const FOLDERS: [u16; 2] = [34_665, 34_853];
/// A directory within EXIF's, which is not copied.
const INTEROPERABILITY: u16 = 40_965;
/// Most bytes of texels in a file whose offsets have 32 bits; the rest is for tags.
const MOST_CLASSIC: usize = 0xf000_0000;

type Entry = (Tag, ValueBuffer);

/// The tags of a TIFF about its texels.
pub(super) struct Frame {
    compression: Compression,
    /// Whether the texels are gray floats, which the image crate has only as RGB.
    gray_floats: bool,
    tags: Vec<Entry>,
    /// The entries of each of [`FOLDERS`].
    folders: [Vec<Entry>; 2],
    /// Messages about what changes in the file that is written.
    pub(super) notes: Vec<String>,
}

impl Default for Frame {
    fn default() -> Self {
        let compression = Compression::Deflate(DeflateLevel::Balanced);
        Self {
            compression,
            gray_floats: false,
            tags: Vec::new(),
            folders: Default::default(),
            notes: Vec::new(),
        }
    }
}

impl Frame {
    /// A frame for texels of another file.
    pub(super) fn with_icc(icc: Option<&[u8]>) -> Self {
        let tags = icc.map(|icc| (Tag::IccProfile, ValueBuffer::from_value(&icc)));
        Self { tags: tags.into_iter().collect(), ..Self::default() }
    }

    /// The ICC profile.
    pub(super) fn icc(&self) -> Option<Vec<u8>> {
        let entry = self.tags.iter().find(|(tag, _)| *tag == Tag::IccProfile);
        entry.map(|(_, value)| value.as_bytes().to_vec())
    }

    /// The compression of the file that is written, in words.
    pub(super) fn compression_name(&self) -> &'static str {
        match self.compression {
            Compression::Uncompressed => "without compression",
            Compression::Lzw => "with LZW",
            Compression::Deflate(_) => "with Deflate",
            Compression::Packbits => "with PackBits",
        }
    }
}

/// Reads a file.
pub(super) fn decode(bytes: &[u8], limit: MemoryLimit) -> Result<(DynamicImage, Frame)> {
    let at = "the TIFF data";
    let fault = |error: TiffError| match error {
        TiffError::UnsupportedError(what) => {
            Error::Unsupported { what: format!("a TIFF of this kind ({what})") }
        }
        TiffError::LimitsExceeded => Error::invalid(at, format!("it takes {}", limit.exceeded())),
        other => Error::invalid(at, other.to_string()),
    };
    let most = usize::try_from(limit.bytes()).unwrap_or(usize::MAX);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = most;
    limits.intermediate_buffer_size = most;
    limits.ifd_value_size = most.min(bytes.len());
    let start = || Decoder::new(Cursor::new(bytes)).map(|d| d.with_limits(limits.clone()));
    let mut decoder = start().map_err(fault)?;
    let mut frame = read_frame(&mut decoder).map_err(fault)?;
    check_pages(&mut start().map_err(fault)?, &mut frame.notes)?;
    if let tiff::ColorType::CMYK(_) | tiff::ColorType::CMYKA(_) =
        decoder.colortype().map_err(fault)?
    {
        let what = "a CMYK TIFF (convert it to RGB by its color profile first)";
        return Err(Error::Unsupported { what: what.to_owned() });
    }
    let refused = |what: String| Error::invalid(at, what);
    if let Some(image) = read_beyond_rgb(&mut decoder, limit).map_err(refused)? {
        return Ok((image, frame));
    }
    let format = ImageFormat::Tiff;
    let image = open(bytes, format, limit)
        .map_err(|error| limit.explain(&error))
        .and_then(|decoder| limit.decode(decoder, format));
    Ok((image.map_err(refused)?, frame))
}

/// Texels of the kinds that the image crate does not read: gray floats, as RGB, and gray with
/// alpha.
fn read_beyond_rgb(
    decoder: &mut Decoder<Cursor<&[u8]>>,
    limit: MemoryLimit,
) -> std::result::Result<Option<DynamicImage>, String> {
    let said = |error: TiffError| error.to_string();
    let samples = match decoder.colortype().map_err(said)? {
        tiff::ColorType::Gray(32) => 1,
        tiff::ColorType::Multiband { num_samples: 2, bit_depth: 8 | 16 } => 2,
        _ => return Ok(None),
    };
    let (width, height) = decoder.dimensions().map_err(said)?;
    // In four bytes at most, and what they become.
    let bytes = u64::from(width) * u64::from(height) * 4 * if samples == 1 { 4 } else { 2 };
    if let Some(what) = limit.check([width.into(), height.into()], bytes) {
        return Err(what);
    }
    let planes = decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).map_err(said)?;
    if samples > 1 && planes.is_some_and(|kind| kind != 1) {
        return Err("gray and alpha in two planes".to_owned());
    }
    let image = match (samples, decoder.read_image().map_err(said)?) {
        (1, DecodingResult::F32(gray)) => {
            let color = gray.into_iter().flat_map(|sample| [sample; 3]).collect();
            Rgb32FImage::from_raw(width, height, color).map(DynamicImage::from)
        }
        (2, DecodingResult::U8(raw)) => {
            GrayAlphaImage::from_raw(width, height, raw).map(DynamicImage::from)
        }
        (2, DecodingResult::U16(raw)) => {
            ImageBuffer::from_raw(width, height, raw).map(DynamicImage::ImageLumaA16)
        }
        _ => return Err("its samples are of a kind that is not read".to_owned()),
    };
    image.map(Some).ok_or_else(|| "samples are missing".to_owned())
}

fn read_frame(decoder: &mut Decoder<Cursor<&[u8]>>) -> TiffResult<Frame> {
    let compression = decoder.find_tag_unsigned::<u16>(Tag::Compression)?.unwrap_or(1);
    let mut frame = Frame::default();
    match compression {
        1 => frame.compression = Compression::Uncompressed,
        5 => frame.compression = Compression::Lzw,
        32_773 => frame.compression = Compression::Packbits,
        8 | 32_946 => {}
        other => frame.notes.push(format!("compression {other} becomes Deflate")),
    }
    let formats = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat)?;
    let floats = formats.is_some_and(|formats| formats.iter().all(|&format| format == 3));
    frame.gray_floats = floats && decoder.colortype()? == tiff::ColorType::Gray(32);
    if decoder.colortype()? == tiff::ColorType::Gray(1) {
        frame.notes.push("gray of 1 bit is widened to 8 bit".to_owned());
    }
    frame.tags = entries(decoder, None, CARRIED.iter().copied())?;
    for (tag, folder) in FOLDERS.into_iter().zip(&mut frame.folders) {
        let Some(offset) = decoder.find_tag_unsigned::<u64>(Tag::from_u16_exhaustive(tag))? else {
            continue;
        };
        *folder = entries(decoder, Some(IfdPointer(offset)), [])?;
    }
    Ok(frame)
}

/// The entries of these tags in the page's directory, or all of another.
fn entries(
    decoder: &mut Decoder<Cursor<&[u8]>>,
    folder: Option<IfdPointer>,
    tags: impl IntoIterator<Item = u16>,
) -> TiffResult<Vec<Entry>> {
    let directory = folder.map(|at| decoder.read_directory(at)).transpose()?;
    let mut tags: Vec<Tag> = tags.into_iter().map(Tag::from_u16_exhaustive).collect();
    if let Some(directory) = &directory {
        let known = directory.iter().map(|(tag, _)| tag);
        tags.extend(known.filter(|tag| tag.to_u16() != INTEROPERABILITY));
    }
    let mut ifd = match &directory {
        Some(directory) => decoder.read_directory_tags(directory),
        None => decoder.image_ifd(),
    };
    let mut entries = Vec::new();
    for tag in tags {
        let mut value = ValueBuffer::empty(Type::BYTE);
        if ifd.find_tag_buf(tag, &mut value)?.is_some() {
            value.set_byte_order(tiff::tags::ByteOrder::native());
            entries.push((tag, value));
        }
    }
    Ok(entries)
}

/// Refuses several pages. Smaller versions of the page and masks of it are no pages.
fn check_pages(decoder: &mut Decoder<Cursor<&[u8]>>, notes: &mut Vec<String>) -> Result<()> {
    let mut more = 0;
    while decoder.more_images() {
        let kind =
            decoder.next_image().and_then(|()| decoder.find_tag_unsigned(Tag::NewSubfileType));
        let kind: u32 = match kind {
            Ok(kind) => kind.unwrap_or(0),
            Err(error) => return Err(Error::invalid("the TIFF data", error.to_string())),
        };
        if kind & 0b101 == 0 {
            return Err(Error::Unsupported { what: "a TIFF of several pages".to_owned() });
        }
        more += 1;
    }
    if more > 0 {
        notes.push("previews and masks in further pages are left out".to_owned());
    }
    Ok(())
}

/// Writes a file: no compression loses anything.
pub(super) fn encode(image: &DynamicImage, frame: &Frame) -> TiffResult<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    if image.as_bytes().len() > MOST_CLASSIC {
        write(TiffEncoder::new_big(&mut bytes)?, image, frame)?;
    } else {
        write(TiffEncoder::new(&mut bytes)?, image, frame)?;
    }
    Ok(bytes.into_inner())
}

type Encoder<'a, K> = TiffEncoder<&'a mut Cursor<Vec<u8>>, K>;

fn write<K: TiffKind>(
    mut file: Encoder<'_, K>,
    image: &DynamicImage,
    frame: &Frame,
) -> TiffResult<()> {
    file = file.with_compression(frame.compression);
    let mut folders = Vec::new();
    for (tag, folder) in FOLDERS.into_iter().zip(&frame.folders).filter(|(_, f)| !f.is_empty()) {
        let mut directory = file.extra_directory()?;
        for (tag, value) in folder {
            directory.write_tag_buf(*tag, value)?;
        }
        let offset = directory.finish_with_offsets()?.offset;
        folders.push((Tag::from_u16_exhaustive(tag), ValueBuffer::from_value(&offset)));
    }
    let page = Page { file, image, tags: frame.tags.iter().chain(&folders).collect() };
    match image {
        DynamicImage::ImageLuma8(image) => page.write::<colortype::Gray8>(image, 0),
        DynamicImage::ImageLumaA8(image) => page.write::<colortype::Gray8>(image, 1),
        DynamicImage::ImageRgb8(image) => page.write::<colortype::RGB8>(image, 0),
        DynamicImage::ImageRgba8(image) => page.write::<colortype::RGBA8>(image, 0),
        DynamicImage::ImageLuma16(image) => page.write::<colortype::Gray16>(image, 0),
        DynamicImage::ImageLumaA16(image) => page.write::<colortype::Gray16>(image, 1),
        DynamicImage::ImageRgb16(image) => page.write::<colortype::RGB16>(image, 0),
        DynamicImage::ImageRgba16(image) => page.write::<colortype::RGBA16>(image, 0),
        DynamicImage::ImageRgb32F(image) if frame.gray_floats => {
            let first: Vec<f32> = image.chunks_exact(3).map(|texel| texel[0]).collect();
            page.write::<colortype::Gray32Float>(&first, 0)
        }
        DynamicImage::ImageRgb32F(image) => page.write::<colortype::RGB32Float>(image, 0),
        _ => page.write::<colortype::RGBA32Float>(&image.to_rgba32f(), 0),
    }
}

/// The only page of a file.
struct Page<'a, K: TiffKind> {
    file: Encoder<'a, K>,
    image: &'a DynamicImage,
    tags: Vec<&'a Entry>,
}

impl<K: TiffKind> Page<'_, K> {
    /// Writes the page, with so many channels beyond those of `C`.
    fn write<C: ColorType>(mut self, samples: &[C::Inner], extra: usize) -> TiffResult<()>
    where
        [C::Inner]: TiffValue,
    {
        // The encoder's predictor knows no extra channels, and none for floats.
        let floats = C::SAMPLE_FORMAT[0] == tiff::tags::SampleFormat::IEEEFP;
        if extra == 0 && !floats {
            self.file = self.file.with_predictor(Predictor::Horizontal);
        }
        let [width, height] = [self.image.width(), self.image.height()];
        let mut page = self.file.new_image::<C>(width, height)?;
        let alpha = [ExtraSamples::UnassociatedAlpha];
        if extra > 0 {
            page.extra_samples(&alpha)?;
        } else if self.image.color().has_alpha() {
            page.encoder().write_tag(Tag::ExtraSamples, &alpha[..])?;
        }
        for (tag, value) in self.tags {
            page.encoder().write_tag_buf(*tag, value)?;
        }
        page.write_data(samples)
    }
}
