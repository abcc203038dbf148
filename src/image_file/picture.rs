//! Picture files to texels and back: PNG, JPEG, WebP, TIFF, Radiance HDR, each whole.
//!
//! Guaranteed: texels come out in the kind they came in, or in a wider one that holds the same
//! values, which is said. What would lose something without a word is refused: animations, several
//! pages, CMYK.

use std::borrow::Cow;
use std::path::Path;

use image::{DynamicImage, ImageError, ImageFormat};

use super::codec::{RGBE, detect_format, open, write};
use super::metadata::{Metadata, is_animated, jpeg_components, png_widening};
use super::tiff::{self, Frame};
use crate::error::{Error, Result};
use crate::limit::MemoryLimit;

/// A picture as its file holds it.
pub(crate) struct Picture {
    /// Its texels.
    pub(crate) texels: DynamicImage,
    /// Messages about reading them.
    pub(crate) notes: Vec<String>,
    /// The file's metadata.
    metadata: Metadata,
    /// The tags and compression of a TIFF.
    frame: Option<Frame>,
}

impl Picture {
    /// Reads a picture of any format that its first bytes tell.
    pub(crate) fn read(path: &Path, limit: MemoryLimit) -> Result<Self> {
        let bytes = limit.read_file(path)?;
        let Some(format) = detect_format(&bytes) else {
            return Err(Error::Unsupported { what: format!("{}: such a file", path.display()) });
        };
        Self::decode(&bytes, format, limit).map_err(|error| error.in_file(path))
    }

    /// Reads a picture; errors do not name the file.
    pub(crate) fn decode(bytes: &[u8], format: ImageFormat, limit: MemoryLimit) -> Result<Self> {
        refuse(bytes, format)?;
        let bytes = match bytes.strip_prefix(RGBE) {
            Some(rest) => Cow::Owned([b"#?RADIANCE", rest].concat()),
            None => Cow::Borrowed(bytes),
        };
        let invalid = |what: String| {
            Error::invalid(format!("the {} data", format.extensions_str()[0].to_uppercase()), what)
        };
        let explain = |error: &ImageError| invalid(limit.explain(error));
        if format == ImageFormat::Tiff {
            let (texels, frame) = tiff::decode(&bytes, limit)?;
            let (icc, notes) = (frame.icc(), frame.notes.clone());
            let mut metadata = Metadata::of_container(format);
            metadata.icc = icc;
            return Ok(Self { texels, notes, metadata, frame: Some(frame) });
        }
        let mut decoder = open(&bytes, format, limit).map_err(|error| explain(&error))?;
        let metadata = Metadata::read(&bytes, format, &mut decoder).map_err(|e| explain(&e))?;
        let texels = limit.decode(decoder, format).map_err(invalid)?;
        let widened = if format == ImageFormat::Png { png_widening(&bytes) } else { None };
        Ok(Self { texels, notes: widened.into_iter().collect(), metadata, frame: None })
    }

    /// The picture as a file of this format, and what is to be said about that.
    ///
    /// # Errors
    /// A sentence if the format has no place for such texels.
    pub(crate) fn encode(
        &self,
        format: ImageFormat,
        quality: u8,
    ) -> std::result::Result<(Vec<u8>, Vec<String>), String> {
        let mut notes: Vec<String> = self.metadata.lost_in(format).into_iter().collect();
        match format {
            ImageFormat::Tiff => {
                let other = Frame::with_icc(self.metadata.icc.as_deref());
                let frame = self.frame.as_ref().unwrap_or(&other);
                notes.push(format!("it is written {}", frame.compression_name()));
                let file = tiff::encode(&self.texels, frame);
                return file.map(|file| (file, notes)).map_err(|error| error.to_string());
            }
            ImageFormat::Jpeg => notes.push(reencoded(quality)),
            ImageFormat::WebP => notes.push(LOSSLESSLY.to_owned()),
            _ => {}
        }
        let file = write(&self.texels, &self.metadata, format, quality);
        file.map(|file| (file, notes)).map_err(|error| error.to_string())
    }
}

/// Refuses what would come out with something missing or wrong.
fn refuse(bytes: &[u8], format: ImageFormat) -> Result<()> {
    let what = if is_animated(bytes, format) {
        "an animation"
    } else if format == ImageFormat::Jpeg && jpeg_components(bytes) == Some(4) {
        "a CMYK JPEG (convert it to RGB by its color profile first)"
    } else {
        return Ok(());
    };
    Err(Error::Unsupported { what: what.to_owned() })
}

/// The note on a WebP.
pub(crate) const LOSSLESSLY: &str = "it is written losslessly";

/// The note on a JPEG.
pub(crate) fn reencoded(quality: u8) -> String {
    format!("it is encoded anew at quality {quality}")
}
