//! An image as its file holds it, and the formats of such files in glTF.

use std::sync::Arc;

/// An image as its file holds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedImage {
    /// The file's bytes, shared between the assets that hold it.
    pub bytes: Arc<Vec<u8>>,
    /// Their format.
    pub format: ImageFormat,
}

impl EncodedImage {
    /// Stands for an image whose file is not there: it is drawn as if it changed nothing, and the
    /// document goes on naming the file.
    pub fn missing() -> Self {
        Self { bytes: Arc::default(), format: ImageFormat::Png }
    }

    /// Whether its file is not there.
    pub fn is_missing(&self) -> bool {
        self.bytes.is_empty()
    }
}

/// Formats of images in a glTF document.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageFormat {
    /// Lossless.
    Png,
    /// Lossy.
    Jpeg,
    /// Either; a texture names it in `EXT_texture_webp`. Written losslessly.
    WebP,
    /// Lossy, for graphics processors; a texture names it in `KHR_texture_basisu`. A changed one becomes a
    /// PNG, unless all textures are to be KTX2.
    Ktx2,
}

impl ImageFormat {
    /// The format that a file's first bytes announce.
    pub fn detect(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x89, b'P', b'N', b'G', ..] => Some(Self::Png),
            [0xff, 0xd8, 0xff, ..] => Some(Self::Jpeg),
            [0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb, b'\r', b'\n', 0x1a, b'\n', ..] => {
                Some(Self::Ktx2)
            }
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => Some(Self::WebP),
            _ => None,
        }
    }

    /// Its media type.
    pub const fn mime(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
            Self::WebP => "image/webp",
            Self::Ktx2 => "image/ktx2",
        }
    }

    /// The extension of its files.
    pub(crate) const fn ending(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpg",
            Self::WebP => "webp",
            Self::Ktx2 => "ktx2",
        }
    }

    /// The extension by which a texture names an image of this format, if core glTF has none.
    pub const fn extension(self) -> Option<&'static str> {
        match self {
            Self::Png | Self::Jpeg => None,
            Self::WebP => Some("EXT_texture_webp"),
            Self::Ktx2 => Some("KHR_texture_basisu"),
        }
    }

    /// The format as the image crate knows it, if it does.
    pub(crate) const fn codec(self) -> Option<image::ImageFormat> {
        match self {
            Self::Png => Some(image::ImageFormat::Png),
            Self::Jpeg => Some(image::ImageFormat::Jpeg),
            Self::WebP => Some(image::ImageFormat::WebP),
            Self::Ktx2 => None,
        }
    }
}
