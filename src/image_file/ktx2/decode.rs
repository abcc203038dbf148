//! KTX2 files with Basis Universal textures to texels, as `KHR_texture_basisu` has them: one image,
//! in ETC1S or UASTC, its levels plain or compressed by Zstandard.
//!
//! The transcoder is in safe Rust for what it reads from a file, and believes one figure in it: how
//! long a level is when it is decompressed. That is compared with what a level of this size must
//! have, and the size with the limit, before it sees the file.

use image::DynamicImage;

use super::container::{LENGTH, SCHEME, ZSTANDARD, number, size};
use crate::limit::MemoryLimit;

/// Bytes that decoding takes for each texel: RGBA, once more as it is returned.
const BYTES_PER_TEXEL: u64 = 8;

/// Decodes the first level of a file; says what is wrong with it otherwise.
pub(crate) fn decode(file: &[u8], limit: MemoryLimit) -> Result<DynamicImage, String> {
    let Some([width, height]) = size(file) else {
        return Err("it ends within its header".to_owned());
    };
    let size = [width, height].map(u64::from);
    let texels = size[0].saturating_mul(size[1]);
    if let Some(what) = limit.check(size, texels.saturating_mul(BYTES_PER_TEXEL)) {
        return Err(what);
    }
    // A block of 4 × 4 texels has 16 bytes.
    let length = size.iter().map(|side| side.div_ceil(4) * 4).product::<u64>();
    let stated = file.get(LENGTH..).and_then(|rest| rest.first_chunk()).copied();
    if number(file, SCHEME) == Some(ZSTANDARD) && stated.map(u64::from_le_bytes) != Some(length) {
        return Err("its first level is of another length than its size".to_owned());
    }
    transcode(file, width, height)
}

#[cfg(feature = "basisu")]
fn transcode(file: &[u8], width: u32, height: u32) -> Result<DynamicImage, String> {
    use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};
    use image::RgbaImage;

    let fault = |error: basisu::Error| format!("it is damaged or of another kind ({error:?})");
    let transcoder = Transcoder::new(file).map_err(fault)?;
    let is_known =
        matches!(transcoder.source_format(), SourceFormat::Etc1s | SourceFormat::UastcLdr);
    if !is_known || transcoder.face_count() != 1 || transcoder.layer_count() > 1 {
        return Err("it is not one image in ETC1S or UASTC".to_owned());
    }
    let texels = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE);
    let texels = texels.map_err(fault)?;
    let image = RgbaImage::from_raw(width, height, texels).ok_or("it has too few texels")?;
    let image = DynamicImage::ImageRgba8(image);
    Ok(if transcoder.has_alpha() { image } else { image.into_rgb8().into() })
}

#[cfg(not(feature = "basisu"))]
fn transcode(_: &[u8], _: u32, _: u32) -> Result<DynamicImage, String> {
    Err("KTX2 is not read by a build without the feature basisu".to_owned())
}

#[cfg(all(test, feature = "basisu"))]
mod tests {
    use image::RgbaImage;

    use super::super::container::{HEIGHT, WIDTH};
    use super::*;

    const FILES: [&[u8]; 3] = [
        include_bytes!("../../../tests/encoded/etc1s.ktx2"),
        include_bytes!("../../../tests/encoded/uastc.ktx2"),
        include_bytes!("../../../tests/encoded/uastc_zstd.ktx2"),
    ];

    /// The picture that all of them were made from.
    fn picture() -> RgbaImage {
        RgbaImage::from_fn(16, 12, |x, y| {
            let blue = if (x / 2 + y * 2 / 3).is_multiple_of(2) { 100 } else { 60 };
            let alpha = if x < 8 { 255 } else { 128 };
            image::Rgba([(20 + x * 200 / 16) as u8, (20 + y * 200 / 12) as u8, blue, alpha])
        })
    }

    #[test]
    fn both_codecs_give_the_picture_nearly() {
        let picture = picture();
        for (file, within) in FILES.into_iter().zip([30.0, 8.0, 8.0]) {
            let texels = decode(file, MemoryLimit::default()).unwrap().into_rgba8();
            assert_eq!(texels.dimensions(), (16, 12));
            let squares =
                texels.iter().zip(picture.iter()).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
            let rms = (squares.sum::<f64>() / texels.len() as f64).sqrt();
            assert!(rms < within, "{rms}");
        }
    }

    #[test]
    fn a_file_that_ends_early_is_an_error() {
        for file in FILES {
            for length in 0..file.len() {
                assert!(decode(&file[..length], MemoryLimit::default()).is_err(), "{length}");
            }
        }
    }

    #[test]
    fn damage_is_an_error_or_other_texels_but_no_panic() {
        let limit = MemoryLimit::of_bytes(1 << 24);
        for file in FILES {
            for at in 0..file.len() {
                for bits in [0x01, 0x80, 0xff] {
                    let mut bent = file.to_vec();
                    bent[at] ^= bits;
                    let _ = decode(&bent, limit);
                }
            }
        }
    }

    #[test]
    fn sizes_that_are_too_large_are_refused_before_they_are_memory() {
        let mut wide = FILES[1].to_vec();
        wide[WIDTH..HEIGHT + 4].copy_from_slice(&[0, 0, 1, 0, 0, 0, 1, 0]);
        let error = decode(&wide, MemoryLimit::default()).unwrap_err();
        assert!(error.contains("65536×65536") && error.contains("--memory-limit"), "{error}");
        let mut long = FILES[2].to_vec();
        long[LENGTH + 6] = 0x60;
        assert!(decode(&long, MemoryLimit::default()).unwrap_err().contains("length"));
    }
}
