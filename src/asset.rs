//! The asset that flows through the pipeline.
//!
//! The document stays whole, as the JSON it was read from: what no stage changes is written as it
//! came, known to us or not. Single objects are read as the types of the gltf crate where they are
//! needed, by their JSON pointer, which is also how errors name them.

use std::sync::Arc;

use gltf::json;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::error::{Error, Result};

/// A glTF asset in memory.
#[derive(Clone, Debug)]
pub struct Asset {
    /// The document.
    pub json: Value,
    /// One per buffer of the document: its bytes.
    pub buffers: Vec<Vec<u8>>,
    /// One per image of the document.
    pub images: Vec<EncodedImage>,
}

/// An image as its file holds it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedImage {
    /// The file's bytes, shared between the assets that hold it.
    pub bytes: Arc<Vec<u8>>,
    /// What they are.
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
    /// Lossy, for graphics processors; a texture names it in `KHR_texture_basisu`. There is no
    /// encoder: a changed one becomes a PNG.
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

    /// What its files' names end in.
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

impl Asset {
    /// How many objects a list of the document holds: `meshes`, `accessors`, …
    pub fn count(&self, list: &str) -> usize {
        self.json.get(list).and_then(Value::as_array).map_or(0, Vec::len)
    }

    /// The object at a JSON pointer, as one of the gltf crate's types.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is none or it is not of that type.
    pub fn parse<T: DeserializeOwned>(&self, at: &str) -> Result<T> {
        let value =
            self.json.pointer(at).ok_or_else(|| Error::invalid(at, "there is no such object"))?;
        T::deserialize(value).map_err(|error| Error::invalid(at, error.to_string()))
    }

    /// The `mesh` object at `index`.
    ///
    /// # Errors
    /// As [`Asset::parse`].
    pub fn mesh(&self, index: usize) -> Result<json::Mesh> {
        self.parse(&format!("/meshes/{index}"))
    }

    /// An index that an object at `at` holds under `key`, if it does.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it is not an index into `list`.
    pub fn reference(&self, at: &str, key: &str, list: &str) -> Result<Option<usize>> {
        let at = format!("{at}/{key}");
        let Some(value) = self.json.pointer(&at) else {
            return Ok(None);
        };
        let index = value.as_u64().and_then(|index| usize::try_from(index).ok());
        match index.filter(|&index| index < self.count(list)) {
            Some(index) => Ok(Some(index)),
            None => Err(Error::invalid(at, format!("{value} is not one of the document's {list}"))),
        }
    }

    /// Every image whose file was not there when the asset was read: its place and the file's name.
    pub fn missing_images(&self) -> Vec<String> {
        let missing = self.images.iter().enumerate().filter(|(_, image)| image.is_missing());
        let name = |(index, _)| {
            let at = format!("/images/{index}/uri");
            let uri = self.json.pointer(&at).and_then(Value::as_str).unwrap_or_default();
            format!("{at}: {uri} is not there")
        };
        missing.map(name).collect()
    }

    /// The bytes of a buffer view.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is no such view or it runs past its buffer.
    pub fn view(&self, index: usize) -> Result<(&[u8], json::buffer::View)> {
        let at = format!("/bufferViews/{index}");
        let view: json::buffer::View = self.parse(&at)?;
        let buffer = self
            .buffers
            .get(view.buffer.value())
            .ok_or_else(|| Error::invalid(format!("{at}/buffer"), "there is no such buffer"))?;
        let start = usize::try_from(view.byte_offset.unwrap_or_default().0).unwrap_or(usize::MAX);
        let length = usize::try_from(view.byte_length.0).unwrap_or(usize::MAX);
        let bytes = start.checked_add(length).and_then(|end| buffer.get(start..end));
        let past_end = || {
            let what = format!("{length} bytes at {start} run past its buffer of {}", buffer.len());
            Error::invalid(&at, what)
        };
        Ok((bytes.ok_or_else(past_end)?, view))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_past_its_buffer_is_an_error_with_its_place() {
        let asset = Asset {
            json: serde_json::json!({"bufferViews": [
                {"buffer": 0, "byteOffset": 2, "byteLength": 2},
                {"buffer": 0, "byteOffset": u64::MAX, "byteLength": 2},
                {"buffer": 3, "byteLength": 2},
            ]}),
            buffers: vec![vec![0, 1, 2, 3]],
            images: Vec::new(),
        };
        assert_eq!(asset.view(0).unwrap().0, [2, 3]);
        for view in 1..4 {
            let error = asset.view(view).unwrap_err().to_string();
            assert!(error.contains(&format!("/bufferViews/{view}")), "{error}");
        }
    }
}
