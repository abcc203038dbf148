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
use crate::image_file::encoded::EncodedImage;
use crate::warning::Warnings;

/// A glTF asset in memory.
#[derive(Clone, Debug, Default)]
pub struct Asset {
    /// The document.
    pub json: Value,
    /// One per buffer of the document: its bytes, which copies of the asset share.
    pub buffers: Vec<Arc<Vec<u8>>>,
    /// One per image of the document.
    pub images: Vec<EncodedImage>,
    /// Warnings of the reader: things left out, guessed or mended.
    pub warnings: Warnings,
}

impl Asset {
    /// Number of objects in a list of the document: `meshes`, `accessors`, …
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

    /// The name of an image, or that of its file, if it has either.
    pub(crate) fn image_name(&self, index: usize) -> Option<&str> {
        let image = self.json.pointer(&format!("/images/{index}"))?;
        let field = |key: &str| image.get(key).and_then(Value::as_str);
        field("name").or_else(|| field("uri").filter(|uri| !uri.starts_with("data:")))
    }

    /// Warns of every image whose file was not there.
    pub(crate) fn warn_of_missing_images(&mut self) {
        let missing = self.images.iter().enumerate().filter(|(_, image)| image.is_missing());
        for (index, _) in missing {
            let at = format!("/images/{index}/uri");
            let uri = self.json.pointer(&at).and_then(Value::as_str).unwrap_or_default();
            let what = format!(
                "{} is not there: it is taken for white, or flat in a normal map; put it there",
                uri.chars().take(200).collect::<String>()
            );
            self.warnings.add(at, what);
        }
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
            buffers: vec![vec![0, 1, 2, 3].into()],
            ..Asset::default()
        };
        assert_eq!(asset.view(0).unwrap().0, [2, 3]);
        for view in 1..4 {
            let error = asset.view(view).unwrap_err().to_string();
            assert!(error.contains(&format!("/bufferViews/{view}")), "{error}");
        }
    }
}
