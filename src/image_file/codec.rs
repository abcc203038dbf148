//! Image files in memory to texels and back.

use std::io::Cursor;

use image::codecs::hdr::HdrEncoder;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::error::{DecodingError, EncodingError, UnsupportedError, UnsupportedErrorKind};
use image::{ColorType, DynamicImage, ImageDecoder, ImageEncoder, ImageError, ImageReader};

use super::encoded::{EncodedImage, ImageFormat};
use super::ktx2::{container, decode as ktx2};
use super::metadata::{Metadata, is_animated, jpeg_ends};
use super::palette::{has_palette, write_indexed};
use crate::error::{Error, Result};
use crate::limit::MemoryLimit;

/// The signature of some Radiance HDR files, which the image crate knows only by another.
pub(crate) const RGBE: &[u8] = b"#?RGBE";

/// Effort for PNGs. Level 6 of zlib-rs takes twice the time of 5 for 2 to 4 % fewer bytes (a scan's color of
/// 2048²: 0.64 s and 3.36 MB, 0.32 s and 3.44 MB; 4 0.24 s and 3.49 MB).
const DEFLATE: CompressionType = CompressionType::Level(5);

/// Options of encoding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncodeOptions {
    /// Quality of JPEGs, 1…100.
    pub quality: u8,
    /// Whether JPEGs become PNGs, and so lose nothing more.
    pub png: bool,
}

impl Default for EncodeOptions {
    /// JPEGs of quality 95, where a second generation is hard to tell from the first.
    fn default() -> Self {
        Self { quality: 95, png: false }
    }
}

/// Decodes an image; `at` names it in errors.
///
/// # Errors
/// [`Error::Invalid`] if it is damaged or takes more memory than the limit;
/// [`Error::Unsupported`] if it is an animation, of which only a frame would be left.
pub fn decode(image: &EncodedImage, at: &str, limit: MemoryLimit) -> Result<DynamicImage> {
    let Some(format) = image.format.codec() else {
        return ktx2::decode(&image.bytes, limit).map_err(|what| Error::invalid(at, what));
    };
    if is_animated(&image.bytes, format) {
        return Err(Error::Unsupported { what: format!("{at}: an animation") });
    }
    open(&image.bytes, format, limit)
        .map_err(|error| limit.explain(&error))
        .and_then(|decoder| limit.decode(decoder, format))
        .map_err(|what| Error::invalid(at, what))
}

/// Width and height of an image, from its header where that has them.
///
/// # Errors
/// As [`decode`].
pub(crate) fn dimensions(image: &EncodedImage, at: &str, limit: MemoryLimit) -> Result<[usize; 2]> {
    let (width, height) = match image.format.codec() {
        Some(codec) => open(&image.bytes, codec, limit)
            .map_err(|error| Error::invalid(at, error.to_string()))?
            .dimensions(),
        None => container::size(&image.bytes)
            .map(|[width, height]| (width, height))
            .ok_or_else(|| Error::invalid(at, "it ends within its header"))?,
    };
    Ok([width as usize, height as usize])
}

/// The decoder of an image file, which takes no more memory for anything but texels than the
/// limit. A JPEG that ends early is refused: the decoder would take what is missing for gray.
pub(crate) fn open(
    bytes: &[u8],
    format: image::ImageFormat,
    limit: MemoryLimit,
) -> image::ImageResult<impl ImageDecoder> {
    if format == image::ImageFormat::Jpeg && !jpeg_ends(bytes) {
        let error = DecodingError::new(format.into(), "its data ends early");
        return Err(ImageError::Decoding(error));
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(limit.to_limits());
    reader.into_decoder()
}

/// The format that a file's first bytes announce, if this tool reads it.
pub fn detect_format(bytes: &[u8]) -> Option<image::ImageFormat> {
    // What the image crate reads, and does not know by these.
    if bytes.starts_with(b"II\x2b\0") || bytes.starts_with(b"MM\0\x2b") {
        return Some(image::ImageFormat::Tiff);
    }
    if bytes.starts_with(RGBE) {
        return Some(image::ImageFormat::Hdr);
    }
    // BMP is read for the materials of an OBJ alone, and never written.
    let is_read = |format: &image::ImageFormat| {
        format.reading_enabled() && *format != image::ImageFormat::Bmp
    };
    image::guess_format(bytes).ok().filter(is_read)
}

/// Encodes an image: losslessly as PNG or WebP, or as JPEG of quality 95. Instead of KTX2 it becomes
/// a PNG.
///
/// # Errors
/// [`Error::Internal`] if the encoder can't take such texels.
pub fn encode(image: &DynamicImage, format: ImageFormat) -> Result<EncodedImage> {
    encode_with(image, &Metadata::default(), format, EncodeOptions::default())
}

/// Encodes a changed image with the metadata of its file. A PNG with a palette has one again if the
/// colors are few enough.
///
/// # Errors
/// [`Error::Internal`] if the encoder can't take such texels, or the file is damaged.
pub(crate) fn encode_anew(
    image: &DynamicImage,
    original: &EncodedImage,
    encoding: EncodeOptions,
) -> Result<EncodedImage> {
    let metadata = match original.format.codec() {
        None => Metadata::default(),
        // It has been decoded before, within a limit.
        Some(before) => open(&original.bytes, before, MemoryLimit::default())
            .and_then(|mut decoder| Metadata::read(&original.bytes, before, &mut decoder))
            .map_err(Error::internal)?,
    };
    let format = if encoding.png { ImageFormat::Png } else { original.format };
    if format == ImageFormat::Png
        && has_palette(&original.bytes)
        && let Some(file) = write_indexed(image)
    {
        let bytes = with_parts(file, &metadata, image::ImageFormat::Png);
        return Ok(EncodedImage { bytes: bytes.into(), format });
    }
    encode_with(image, &metadata, format, encoding)
}

/// Encodes an image with its metadata.
///
/// # Errors
/// [`Error::Internal`] if the encoder can't take such texels.
pub(crate) fn encode_with(
    image: &DynamicImage,
    metadata: &Metadata,
    format: ImageFormat,
    encoding: EncodeOptions,
) -> Result<EncodedImage> {
    let (format, codec) = match format.codec() {
        Some(codec) => (format, codec),
        None => (ImageFormat::Png, image::ImageFormat::Png),
    };
    let bytes = write(image, metadata, codec, encoding.quality).map_err(Error::internal)?;
    Ok(EncodedImage { bytes: bytes.into(), format })
}

/// An image as a file of PNG, JPEG, WebP or Radiance HDR: in the bits it has, never in fewer.
pub(crate) fn write(
    image: &DynamicImage,
    metadata: &Metadata,
    format: image::ImageFormat,
    quality: u8,
) -> image::ImageResult<Vec<u8>> {
    let mut bytes = Vec::new();
    let out = &mut bytes;
    match format {
        image::ImageFormat::Jpeg => {
            let encoder = JpegEncoder::new_with_quality(out, quality);
            write_with(encoder, image, metadata, format)
        }
        image::ImageFormat::WebP => write_webp(out, image, metadata),
        image::ImageFormat::Hdr => write_with(HdrEncoder::new(out), image, metadata, format),
        _ => {
            let (deflate, filter) = (DEFLATE, FilterType::Adaptive);
            let encoder = PngEncoder::new_with_quality(out, deflate, filter);
            write_with(encoder, image, metadata, format)
        }
    }?;
    Ok(with_parts(bytes, metadata, format))
}

/// A file that an encoder wrote, with what else it is to hold.
fn with_parts(file: Vec<u8>, metadata: &Metadata, format: image::ImageFormat) -> Vec<u8> {
    if metadata.is_of(format) { metadata.splice(&file, format) } else { file }
}

fn write_with(
    mut encoder: impl ImageEncoder,
    image: &DynamicImage,
    metadata: &Metadata,
    format: image::ImageFormat,
) -> image::ImageResult<()> {
    if !metadata.is_of(format) {
        // A format that has no place for one goes without.
        let _ = metadata.icc.clone().map(|icc| encoder.set_icc_profile(icc));
        let _ = metadata.exif.clone().map(|exif| encoder.set_exif_metadata(exif));
    }
    encoder.write_image(image.as_bytes(), image.width(), image.height(), image.color().into())
}

/// Writes a WebP, losslessly. The image crate's encoder has no place for XMP.
fn write_webp(
    out: &mut Vec<u8>,
    image: &DynamicImage,
    metadata: &Metadata,
) -> image::ImageResult<()> {
    let color = match image.color() {
        ColorType::L8 => image_webp::ColorType::L8,
        ColorType::La8 => image_webp::ColorType::La8,
        ColorType::Rgb8 => image_webp::ColorType::Rgb8,
        ColorType::Rgba8 => image_webp::ColorType::Rgba8,
        other => {
            let kind = UnsupportedErrorKind::Color(other.into());
            let hint = image::ImageFormat::WebP.into();
            let error = UnsupportedError::from_format_and_kind(hint, kind);
            return Err(ImageError::Unsupported(error));
        }
    };
    let mut encoder = image_webp::WebPEncoder::new(out);
    encoder.set_icc_profile(metadata.icc.clone().unwrap_or_default());
    encoder.set_exif_metadata(metadata.exif.clone().unwrap_or_default());
    encoder.set_xmp_metadata(metadata.xmp.clone().unwrap_or_default());
    let [width, height] = [image.width(), image.height()];
    encoder.encode(image.as_bytes(), width, height, color).map_err(|error| {
        ImageError::Encoding(EncodingError::new(image::ImageFormat::WebP.into(), error))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> DynamicImage {
        DynamicImage::ImageRgb8(image::RgbImage::from_fn(9, 5, |x, y| {
            image::Rgb([(x * 20) as u8, (y * 50) as u8, 7])
        }))
    }

    #[test]
    fn what_is_lossless_comes_back_as_it_was_and_a_jpeg_nearly() {
        for format in [ImageFormat::Png, ImageFormat::WebP] {
            let lossless = encode(&picture(), format).unwrap();
            assert_eq!(ImageFormat::detect(&lossless.bytes), Some(format));
            assert_eq!(decode(&lossless, "", MemoryLimit::default()).unwrap(), picture());
        }
        let jpeg = encode(&picture(), ImageFormat::Jpeg).unwrap();
        assert_eq!(decode(&jpeg, "", MemoryLimit::default()).unwrap().width(), 9);
    }

    #[test]
    fn a_damaged_or_huge_image_is_an_error() {
        let png = encode(&picture(), ImageFormat::Png).unwrap();
        let of = |bytes: Vec<u8>| EncodedImage { bytes: bytes.into(), format: ImageFormat::Png };
        let decode = |image| decode(image, "/images/3", MemoryLimit::default());
        let cut = of(png.bytes[..60].to_vec());
        assert!(decode(&cut).unwrap_err().to_string().starts_with("/images/3"));
        // Width and height of the header, with its checksum made right again.
        let mut huge = png.bytes.to_vec();
        huge[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
        let sum = crc(&huge[12..29]).to_be_bytes();
        huge[29..33].copy_from_slice(&sum);
        let error = decode(&of(huge)).unwrap_err().to_string();
        assert!(error.contains("60000×60000") && error.contains("4GiB"), "{error}");
    }

    /// The checksum of a PNG chunk (ISO 3309).
    fn crc(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(!0u32, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), |crc, _| {
                if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 }
            })
        })
    }
}
