//! Image files in memory to texels and back.

use std::io::Cursor;

use image::codecs::jpeg::{JpegDecoder, JpegEncoder};
use image::codecs::png::{CompressionType, FilterType, PngDecoder, PngEncoder};
use image::{DynamicImage, ImageDecoder, Limits};

use crate::asset::{EncodedImage, ImageFormat};
use crate::error::{Error, Result};

/// Most bytes that decoding one image may take: 16,384² texels of four bytes.
pub(crate) const MOST_BYTES: u64 = 1 << 30;
/// Quality of the JPEGs we write; at 95 a second generation is hard to tell from the first.
pub(crate) const JPEG_QUALITY: u8 = 95;

/// Decodes an image; `at` names it in errors.
///
/// # Errors
/// [`Error::Invalid`] if it is damaged or larger than 1 GiB decoded.
pub fn decode(image: &EncodedImage, at: &str) -> Result<DynamicImage> {
    let invalid = |error: image::ImageError| Error::invalid(at, error.to_string());
    let bytes = Cursor::new(image.bytes.as_slice());
    match image.format {
        ImageFormat::Png => {
            let decoder = PngDecoder::with_limits(bytes, limits()).map_err(invalid)?;
            decode_limited(decoder).map_err(invalid)
        }
        ImageFormat::Jpeg => {
            decode_limited(JpegDecoder::new(bytes).map_err(invalid)?).map_err(invalid)
        }
    }
}

/// The limit for decoders, so that a hostile file can't claim all memory.
pub(crate) fn limits() -> Limits {
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MOST_BYTES);
    limits
}

fn decode_limited(mut decoder: impl ImageDecoder) -> image::ImageResult<DynamicImage> {
    let mut limits = limits();
    limits.reserve(decoder.total_bytes())?;
    decoder.set_limits(limits)?;
    DynamicImage::from_decoder(decoder)
}

/// Encodes an image: losslessly as PNG, or as JPEG of quality 95.
///
/// # Errors
/// [`Error::Internal`] if the encoder can't take such texels.
pub fn encode(image: &DynamicImage, format: ImageFormat) -> Result<EncodedImage> {
    let mut bytes = Vec::new();
    let written = match format {
        ImageFormat::Png => image.write_with_encoder(PngEncoder::new_with_quality(
            &mut bytes,
            CompressionType::Default,
            FilterType::Adaptive,
        )),
        ImageFormat::Jpeg => {
            image.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY))
        }
    };
    written.map_err(|error| Error::Internal { what: error.to_string() })?;
    Ok(EncodedImage { bytes: bytes.into(), format })
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
    fn a_png_comes_back_as_it_was_and_a_jpeg_nearly() {
        let png = encode(&picture(), ImageFormat::Png).unwrap();
        assert_eq!(decode(&png, "").unwrap(), picture());
        let jpeg = encode(&picture(), ImageFormat::Jpeg).unwrap();
        assert_eq!(decode(&jpeg, "").unwrap().width(), 9);
    }

    #[test]
    fn a_damaged_or_huge_image_is_an_error() {
        let png = encode(&picture(), ImageFormat::Png).unwrap();
        let of = |bytes: Vec<u8>| EncodedImage { bytes: bytes.into(), format: ImageFormat::Png };
        let cut = of(png.bytes[..60].to_vec());
        assert!(decode(&cut, "/images/3").unwrap_err().to_string().starts_with("/images/3"));
        // Width and height of the header, with its checksum made right again.
        let mut huge = png.bytes.to_vec();
        huge[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
        let sum = crc(&huge[12..29]).to_be_bytes();
        huge[29..33].copy_from_slice(&sum);
        assert!(decode(&of(huge), "").is_err());
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
