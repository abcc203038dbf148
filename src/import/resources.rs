//! The bytes of a document's buffers and images, and which of them it needs.

use std::collections::BTreeSet;
use std::path::Path;

use gltf::json;
use image::DynamicImage;
use serde_json::Value;

use super::options::ReadOptions;
use super::uri::{Resource, UriPolicy};
use crate::compression;
use crate::document::asset::Asset;
use crate::document::known_extensions::known;
use crate::document::references::used_views;
use crate::error::{Error, Result};
use crate::image_file::codec::encode;
use crate::image_file::encoded::{EncodedImage, ImageFormat};

/// Reads a buffer. One that can't be read is empty, and one that is short stays so, with a warning, if
/// no view reads what is missing.
///
/// # Errors
/// [`Error::Invalid`] or [`Error::Unsupported`] with its place.
pub(super) fn read_buffer(
    asset: &mut Asset,
    index: usize,
    chunk: Option<&[u8]>,
    policy: UriPolicy<'_>,
) -> Result<Vec<u8>> {
    let at = format!("/buffers/{index}");
    let buffer: json::Buffer = asset.parse(&at)?;
    let mut bytes = match (&buffer.uri, chunk) {
        (Some(uri), _) => Resource::of(uri, &at, policy, &mut asset.warnings)
            .and_then(|resource| resource.read(&at)),
        (None, Some(chunk)) if index == 0 => Ok(chunk.to_vec()),
        (None, _) if compression::is_fallback(&asset.json, index) => return Ok(Vec::new()),
        _ => Err(Error::invalid(&at, "it has neither a URI nor the binary chunk")),
    };
    let needed = needed_bytes(&asset.json, index);
    let length = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
    match &bytes {
        Err(_) if needed == 0 => {
            let what =
                "it can't be read, and nothing is in it: left out; take it from the document";
            asset.warnings.add(at, what);
            bytes = Ok(Vec::new());
        }
        Ok(bytes) if bytes.len() < length && needed <= bytes.len() => {
            let what =
                "it has fewer bytes than announced, and no view reads those; announce as many";
            asset.warnings.add(at, what);
        }
        Ok(bytes) if bytes.len() < length => {
            let what = format!("{length} bytes announced, {} there", bytes.len());
            return Err(Error::invalid(at, what));
        }
        _ => {}
    }
    let mut bytes = bytes?;
    bytes.truncate(length);
    Ok(bytes)
}

/// How many bytes of a buffer the views read that the document uses.
fn needed_bytes(json: &Value, buffer: usize) -> usize {
    let number = |object: &Value, key: &str| object.get(key).and_then(Value::as_u64);
    let end = |object: &Value| {
        let start = number(object, "byteOffset").unwrap_or(0);
        start.saturating_add(number(object, "byteLength").unwrap_or(0))
    };
    let used = used_views(json);
    let views = json.get("bufferViews").and_then(Value::as_array).into_iter().flatten();
    let views = views.enumerate().filter(|(index, _)| used.contains(index));
    let all = views.flat_map(|(_, view)| {
        let extensions = view.get("extensions").and_then(Value::as_object);
        extensions.into_iter().flat_map(|own| own.values()).chain([view])
    });
    let own = all.filter(|object| number(object, "buffer") == Some(buffer as u64));
    own.map(end).max().map_or(0, |end| usize::try_from(end).unwrap_or(usize::MAX))
}

/// Reads an image. One that can't be read and that no texture uses is a texel, with a warning.
///
/// # Errors
/// [`Error::Invalid`] or [`Error::Unsupported`] with its place.
pub(super) fn read_image(
    asset: &mut Asset,
    index: usize,
    folder: &Path,
    options: ReadOptions,
) -> Result<EncodedImage> {
    let read = encoded_image(asset, index, folder, options);
    if read.is_ok() || used_images(&asset.json).is_none_or(|used| used.contains(&index)) {
        return read;
    }
    let what = "it can't be read, and no material uses it: one texel stands for it; take it from the \
                document";
    asset.warnings.add(format_args!("/images/{index}"), what);
    encode(&DynamicImage::new_rgb8(1, 1), ImageFormat::Png)
}

fn encoded_image(
    asset: &mut Asset,
    index: usize,
    folder: &Path,
    options: ReadOptions,
) -> Result<EncodedImage> {
    let at = format!("/images/{index}");
    let uri = asset.json.pointer(&format!("{at}/uri")).and_then(Value::as_str).map(str::to_owned);
    let bytes = match (uri, asset.reference(&at, "bufferView", "bufferViews")?) {
        (Some(uri), _) => {
            let resource =
                Resource::of(&uri, &at, options.uri_policy(folder), &mut asset.warnings)?;
            if options.allow_missing && resource.is_missing() {
                return Ok(EncodedImage::missing());
            }
            resource.read(&at)?
        }
        (None, Some(view)) => asset.view(view)?.0.to_vec(),
        (None, None) => {
            return Err(Error::invalid(at, "it has neither a URI nor a buffer view"));
        }
    };
    let format = ImageFormat::detect(&bytes).ok_or_else(|| Error::Unsupported {
        what: format!("{at}: an image that is no PNG, JPEG, WebP or KTX2"),
    })?;
    Ok(EncodedImage { bytes: bytes.into(), format })
}

/// The images of textures that something refers to; none if an extension might refer to one otherwise.
fn used_images(json: &Value) -> Option<BTreeSet<usize>> {
    let names = json.get("extensionsUsed").and_then(Value::as_array).into_iter().flatten();
    let is_followed = |name: &str| {
        matches!(name, "EXT_mesh_features" | "EXT_structural_metadata" | "KHR_animation_pointer")
            || known(name).is_some_and(|known| !known.holds_indices)
    };
    if !names.filter_map(Value::as_str).all(is_followed) {
        return None;
    }
    let mut textures = BTreeSet::new();
    for list in ["materials", "meshes", "extensions"] {
        numbers_under(&json[list], "index", &mut textures);
    }
    let mut images = BTreeSet::new();
    let all = json.get("textures").and_then(Value::as_array).into_iter().flatten().enumerate();
    for (_, texture) in all.filter(|(index, _)| textures.contains(index)) {
        numbers_under(texture, "source", &mut images);
    }
    Some(images)
}

/// Every number under a key, however deep.
fn numbers_under(json: &Value, key: &str, found: &mut BTreeSet<usize>) {
    match json {
        Value::Object(object) => {
            let own = object.get(key).and_then(Value::as_u64);
            found.extend(own.and_then(|number| usize::try_from(number).ok()));
            object.values().for_each(|value| numbers_under(value, key, found));
        }
        Value::Array(list) => list.iter().for_each(|value| numbers_under(value, key, found)),
        _ => {}
    }
}
