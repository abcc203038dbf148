//! Metadata of an image file, carried from the file that was read to the one that is written.
//!
//! Within a container, parts go over as they are, byte for byte:
//!
//! - PNG: the chunks that say how colors are meant (iCCP, sRGB, gAMA, cHRM, cICP, mDCV, cLLI), and
//!   all that their own names call safe to copy whatever becomes of the texels: pHYs, texts, eXIf,
//!   private ones (ISO/IEC 15948:2004, §5.4). tIME is not, which is right: it is the last change.
//! - JPEG: density (JFIF), EXIF, XMP, ICC profile, Photoshop's resources with IPTC, comments. Not
//!   Adobe's APP14, which describes the encoding, nor a preview or signature of the old texels.
//! - Radiance HDR: the lines of the header: exposure, primaries, comments.
//! - WebP: ICC profile, EXIF, XMP.
//!
//! TIFF has tags instead, see `tiff`. From one container to another go the ICC profile
//! and EXIF, where the other has a place for them.

use std::io::Cursor;

use image::error::DecodingError;
use image::{ImageDecoder, ImageError, ImageFormat, ImageResult};

/// Chunks that tell colors, which hold as long as texels keep their color space.
const COLOR_CHUNKS: [&[u8; 4]; 7] = [b"iCCP", b"sRGB", b"gAMA", b"cHRM", b"cICP", b"mDCV", b"cLLI"];
/// Offsets of the first chunk in a PNG, and of the first behind its header.
const PNG_START: usize = 8;
const PNG_AFTER_HEADER: usize = 33;
/// JPEG markers.
const SCAN: u8 = 0xda;
const END: u8 = 0xd9;
/// A JFIF segment without a preview.
const JFIF_LENGTH: usize = 18;

/// The metadata of a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Metadata {
    /// The container that `parts` are of.
    container: Option<ImageFormat>,
    /// PNG chunks, JPEG segments or lines of a Radiance header, one after another.
    parts: Vec<u8>,
    pub(crate) icc: Option<Vec<u8>>,
    pub(crate) exif: Option<Vec<u8>>,
    pub(crate) xmp: Option<Vec<u8>>,
}

impl Metadata {
    /// No metadata, from a file of this format.
    pub(crate) fn of_container(format: ImageFormat) -> Self {
        Self { container: Some(format), ..Self::default() }
    }

    /// Reads the metadata of a file; `decoder` has read its header.
    pub(crate) fn read(
        bytes: &[u8],
        format: ImageFormat,
        decoder: &mut impl ImageDecoder,
    ) -> ImageResult<Self> {
        if format == ImageFormat::WebP {
            return Self::read_webp(bytes)
                .map_err(|error| ImageError::Decoding(DecodingError::new(format.into(), error)));
        }
        let parts = match format {
            ImageFormat::Png => png_parts(bytes),
            ImageFormat::Jpeg => jpeg_parts(bytes),
            ImageFormat::Hdr => hdr_parts(bytes),
            _ => Vec::new(),
        };
        let (icc, exif) = (decoder.icc_profile()?, decoder.exif_metadata()?);
        let exif = exif.or_else(|| if format == ImageFormat::Png { png_exif(bytes) } else { None });
        Ok(Self { parts, icc, exif, ..Self::of_container(format) })
    }

    /// Reads the metadata of a WebP. The image crate believes the lengths of its chunks, up to 4
    /// GiB.
    fn read_webp(bytes: &[u8]) -> std::result::Result<Self, image_webp::DecodingError> {
        let mut decoder = image_webp::WebPDecoder::new(Cursor::new(bytes))?;
        decoder.set_memory_limit(bytes.len());
        Ok(Self {
            icc: decoder.icc_profile()?,
            exif: decoder.exif_metadata()?,
            xmp: decoder.xmp_metadata()?,
            ..Self::of_container(ImageFormat::WebP)
        })
    }

    /// Whether a file of this format gets `parts`, and so all there is.
    pub(crate) fn is_of(&self, format: ImageFormat) -> bool {
        self.container == Some(format) && !self.parts.is_empty()
    }

    /// Puts the parts into a file of their container, which an encoder wrote without any.
    pub(crate) fn splice(&self, file: &[u8], format: ImageFormat) -> Vec<u8> {
        let (before, after) = match format {
            ImageFormat::Png => (PNG_AFTER_HEADER, PNG_AFTER_HEADER),
            // The encoder's own density goes if there is another.
            ImageFormat::Jpeg if is_jfif(&self.parts) => (2, 2 + JFIF_LENGTH),
            ImageFormat::Jpeg => (2 + JFIF_LENGTH, 2 + JFIF_LENGTH),
            _ => {
                let line = file.iter().position(|&byte| byte == b'\n').map_or(0, |at| at + 1);
                (line, line)
            }
        };
        [&file[..before], &self.parts, &file[after..]].concat()
    }

    /// A message: the metadata that are lost in a file of another format.
    pub(crate) fn lost_in(&self, format: ImageFormat) -> Option<String> {
        if self.container == Some(format) {
            return None;
        }
        let is_tiff = self.container == Some(ImageFormat::Tiff);
        let keeps_exif = matches!(format, ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP);
        let kept = match format {
            ImageFormat::Hdr => "nothing",
            _ if keeps_exif && !is_tiff => "the ICC profile and EXIF",
            _ => "the ICC profile",
        };
        let any = !self.parts.is_empty() || self.icc.is_some() || self.exif.is_some();
        let any = any || self.xmp.is_some() || is_tiff;
        let name = format.extensions_str()[0];
        any.then(|| format!("of what the file held beside texels, a .{name} gets {kept}"))
    }
}

/// A message: how decoding changes the kind of a PNG's texels, none of them in value.
pub(crate) fn png_widening(bytes: &[u8]) -> Option<String> {
    let &[depth, kind] = bytes.get(24..26)?.first_chunk()?;
    let keyed = png_chunks(bytes).any(|(name, _)| name == *b"tRNS");
    match (kind, keyed) {
        (3, true) => Some("its palette is widened to RGBA".to_owned()),
        (3, false) => Some("its palette is widened to RGB".to_owned()),
        (_, true) => Some("its transparent color is widened to an alpha channel".to_owned()),
        (0, _) if depth < 8 => Some(format!("gray of {depth} bit is widened to 8 bit")),
        _ => None,
    }
}

/// Whether a picture is one of several: a repair of the first would lose the others.
pub(crate) fn is_animated(bytes: &[u8], format: ImageFormat) -> bool {
    match format {
        ImageFormat::Png => png_chunks(bytes).any(|(name, chunk)| {
            name == *b"acTL" && chunk.get(8..12).is_some_and(|frames| frames > &[0, 0, 0, 1][..])
        }),
        ImageFormat::WebP => {
            let flags = bytes.get(20).filter(|_| bytes[12..].starts_with(b"VP8X"));
            flags.is_some_and(|flags| flags & 2 != 0)
        }
        _ => false,
    }
}

/// The number of components of a JPEG.
pub(crate) fn jpeg_components(bytes: &[u8]) -> Option<u8> {
    let is_frame =
        |marker: u8| matches!(marker, 0xc0..=0xcf) && ![0xc4, 0xc8, 0xcc].contains(&marker);
    let frame = jpeg_segments(bytes).find(|segment| is_frame(segment[1]))?;
    frame.get(9).copied()
}

/// The chunks of a PNG by their names, each whole.
fn png_chunks(bytes: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    let mut at = PNG_START;
    std::iter::from_fn(move || {
        let length = u32::from_be_bytes(*bytes.get(at..)?.first_chunk()?) as usize;
        let chunk = bytes.get(at..at.checked_add(length)?.checked_add(12)?)?;
        at += chunk.len();
        Some((*chunk[4..].first_chunk()?, chunk))
    })
}

/// EXIF, which may stand behind the texels, where a decoder of the header does not look.
fn png_exif(bytes: &[u8]) -> Option<Vec<u8>> {
    let (_, chunk) = png_chunks(bytes).find(|(name, _)| name == b"eXIf")?;
    Some(chunk[8..chunk.len() - 4].to_vec())
}

fn png_parts(bytes: &[u8]) -> Vec<u8> {
    let is_carried = |name: &[u8; 4]| {
        let [is_ancillary, is_safe] = [name[0], name[3]].map(|byte| byte & 0x20 != 0);
        COLOR_CHUNKS.contains(&name) || (is_ancillary && is_safe)
    };
    let carried = png_chunks(bytes).filter(|(name, _)| is_carried(name));
    carried.flat_map(|(_, chunk)| chunk).copied().collect()
}

/// The segments of a JPEG before its first scan, each whole: 0xff, marker, length, payload.
fn jpeg_segments(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let before_scan = |segment: &&[u8]| segment[1] != SCAN;
    all_jpeg_segments(bytes).take_while(before_scan).filter(|segment| segment.len() > 2)
}

/// All segments of a JPEG, a scan's without the data that follow it, and its end: 0xff, 0xd9.
fn all_jpeg_segments(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut at = 2;
    let mut in_scan = false;
    std::iter::from_fn(move || {
        // Any number of 0xff may stand before a marker; in a scan, 0 and restarts are data.
        let marker = loop {
            let marker = *bytes.get(at + 1)?;
            match (bytes[at], marker) {
                (0xff, 0xff) => at += 1,
                (0xff, 0 | 0xd0..=0xd7) if in_scan => at += 2,
                (0xff, _) => break marker,
                _ if in_scan => at += 1,
                _ => return None,
            }
        };
        let length = match marker {
            END => 0,
            _ => usize::from(u16::from_be_bytes(*bytes.get(at + 2..)?.first_chunk()?)).max(2),
        };
        let segment = bytes.get(at..at + 2 + length)?;
        at = if marker == END { bytes.len() } else { at + segment.len() };
        in_scan = marker == SCAN;
        Some(segment)
    })
}

/// Whether a JPEG has its end.
pub(crate) fn jpeg_ends(bytes: &[u8]) -> bool {
    all_jpeg_segments(bytes).any(|segment| segment[1] == END)
}

fn is_jfif(segments: &[u8]) -> bool {
    segments.starts_with(&[0xff, 0xe0]) && segments.get(4..9) == Some(b"JFIF\0")
}

fn jpeg_parts(bytes: &[u8]) -> Vec<u8> {
    let is_carried = |segment: &&[u8]| {
        let payload = &segment[4..];
        match segment[1] {
            0xe1 | 0xfe => true,
            0xe2 => payload.starts_with(b"ICC_PROFILE\0"),
            0xed => payload.starts_with(b"Photoshop 3.0\0"),
            _ => false,
        }
    };
    let density = jpeg_segments(bytes).find(|segment| is_jfif(segment));
    // Without the preview that may follow; its size is 0 × 0 then.
    let density = density.and_then(|segment| segment.get(..JFIF_LENGTH - 2)).map(|segment| {
        let mut own = segment.to_vec();
        own.extend([0, 0]);
        own[2..4].copy_from_slice(&(JFIF_LENGTH as u16 - 2).to_be_bytes());
        own
    });
    let carried = jpeg_segments(bytes).filter(is_carried).flatten().copied();
    density.unwrap_or_default().into_iter().chain(carried).collect()
}

/// The lines between the first of a Radiance header and the empty one, but for the format, which an
/// encoder writes.
fn hdr_parts(bytes: &[u8]) -> Vec<u8> {
    let lines = bytes.split_inclusive(|&byte| byte == b'\n').skip(1);
    let header = lines.take_while(|line| line.len() > 1 && line.ends_with(b"\n"));
    header.filter(|line| !line.starts_with(b"FORMAT=")).flatten().copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A PNG chunk, with zeros for its checksum.
    fn chunk(name: &[u8; 4], data: &[u8]) -> Vec<u8> {
        [&(data.len() as u32).to_be_bytes()[..], name, data, &[0; 4]].concat()
    }

    fn png(chunks: &[Vec<u8>]) -> Vec<u8> {
        [b"\x89PNG\r\n\x1a\n".to_vec(), chunks.concat()].concat()
    }

    fn header(depth: u8, kind: u8) -> Vec<u8> {
        chunk(b"IHDR", &[0, 0, 0, 1, 0, 0, 0, 1, depth, kind, 0, 0, 0])
    }

    #[test]
    fn a_png_keeps_what_holds_and_nothing_else() {
        let kept = [chunk(b"gAMA", &[1]), chunk(b"pHYs", &[2]), chunk(b"teSt", &[3])];
        let lost = [chunk(b"tIME", &[4]), chunk(b"bKGD", &[5]), chunk(b"acTL", &[0; 8])];
        let data = chunk(b"IDAT", &[9; 30]);
        let text = chunk(b"tEXt", b"Title\0x");
        let all = [vec![header(8, 2)], kept.to_vec(), lost.to_vec(), vec![data, text.clone()]];
        let parts = png_parts(&png(&all.concat()));
        assert_eq!(parts, [kept.concat(), text].concat());
        let metadata = Metadata { container: Some(ImageFormat::Png), parts, ..Metadata::default() };
        let file = metadata.splice(&png(&[header(8, 2), chunk(b"IEND", &[])]), ImageFormat::Png);
        let names: Vec<[u8; 4]> = png_chunks(&file).map(|(name, _)| name).collect();
        assert_eq!(names, [*b"IHDR", *b"gAMA", *b"pHYs", *b"teSt", *b"tEXt", *b"IEND"]);
        assert!(metadata.lost_in(ImageFormat::Jpeg).unwrap().contains("EXIF"));
        assert_eq!(metadata.lost_in(ImageFormat::Png), None);
    }

    #[test]
    fn what_becomes_of_a_png_is_said() {
        let widening =
            |depth, kind, more: Vec<u8>| png_widening(&png(&[header(depth, kind), more]));
        let key = || chunk(b"tRNS", &[0]);
        assert!(widening(2, 3, Vec::new()).unwrap().ends_with("RGB"));
        assert!(widening(8, 3, key()).unwrap().ends_with("RGBA"));
        assert!(widening(8, 2, key()).unwrap().contains("alpha"));
        assert!(widening(1, 0, Vec::new()).unwrap().contains("1 bit"));
        assert_eq!([widening(8, 0, Vec::new()), widening(16, 6, Vec::new())], [None, None]);
        let frames = |n| png(&[header(8, 2), chunk(b"acTL", &[0, 0, 0, n, 0, 0, 0, 0])]);
        assert!(is_animated(&frames(2), ImageFormat::Png));
        assert!(!is_animated(&frames(1), ImageFormat::Png));
    }

    fn segment(marker: u8, payload: &[u8]) -> Vec<u8> {
        [&[0xff, marker][..], &(payload.len() as u16 + 2).to_be_bytes(), payload].concat()
    }

    #[test]
    fn a_jpeg_keeps_its_density_without_a_preview() {
        let jfif = segment(0xe0, b"JFIF\0\x01\x02\x01\x01\x2c\x01\x2c\x01\x01abc");
        let exif = segment(0xe1, b"Exif\0\0MM");
        let frame = segment(0xc2, &[8, 0, 1, 0, 1, 4]);
        let lost = [segment(0xee, b"Adobe"), segment(0xe2, b"MPF\0"), segment(0xed, b"other")];
        let start = [vec![0xff, 0xd8], jfif, lost.concat(), vec![0xff; 3], exif.clone()];
        let bytes = [start.concat(), frame, segment(0xda, &[0; 9]), segment(0xfe, b"no")].concat();
        let density = segment(0xe0, b"JFIF\0\x01\x02\x01\x01\x2c\x01\x2c\0\0");
        assert_eq!(jpeg_parts(&bytes), [density, exif].concat());
        assert_eq!(jpeg_components(&bytes), Some(4));
        assert!(!jpeg_ends(&bytes));
        let scan = segment(0xda, &[0, 0xff, END]);
        for (data, ends) in [
            (&[1, 0xff, 0, 0xd9, 0xff, 0xd3, 7][..], false),
            (&[1, 0xff, 0, 2, 0xff, 0xff, END, 9], true),
        ] {
            let more = [segment(0xc4, &[0xff, END]), scan.clone(), data.to_vec()].concat();
            assert_eq!(jpeg_ends(&[&bytes[..bytes.len() - 6], &more].concat()), ends);
        }
    }

    #[test]
    fn no_bytes_are_too_few() {
        let png = png(&[header(8, 3), chunk(b"gAMA", &[0, 0, 0, 1])]);
        let jpeg = [vec![0xff, 0xd8], segment(0xe0, b"JFIF\0"), segment(0xc0, &[8])].concat();
        for bytes in [png, jpeg, b"#?RADIANCE\nA=1\nFORMAT=x\n\n-Y".to_vec()] {
            for length in 0..=bytes.len() {
                let bytes = &bytes[..length];
                let _ = (png_parts(bytes), jpeg_parts(bytes), hdr_parts(bytes));
                let _ = (png_widening(bytes), jpeg_components(bytes), jpeg_ends(bytes));
                assert!(!is_animated(bytes, ImageFormat::Png));
                assert!(!is_animated(bytes, ImageFormat::WebP));
            }
        }
        assert_eq!(hdr_parts(b"#?RADIANCE\nA=1\nFORMAT=x\n# c\n\n-Y 1 +X 1\nabc"), b"A=1\n# c\n");
    }
}
