//! A document and all of its bytes as one .glb.

use std::borrow::Cow;

use percent_encoding::percent_decode_str;
use serde_json::{Value, json};

use crate::document::asset::Asset;
use crate::document::edit::put;
use crate::document::material::match_formats;
use crate::document::references::property_views;
use crate::error::{Error, Result};

/// An asset as one self-contained .glb.
///
/// # Errors
/// [`Error::Invalid`] if the asset's views and buffers do not fit together;
/// [`Error::Unsupported`] if it is larger than the 4 GiB that the container can hold.
pub fn to_glb(asset: &Asset) -> Result<Vec<u8>> {
    container(join_buffers(asset, None)?)
}

/// The JSON of a document.
pub(crate) fn json_bytes(asset: &Asset) -> Result<Vec<u8>> {
    serde_json::to_vec(&asset.json).map_err(Error::internal)
}

/// A document and its first buffer as a .glb.
pub(crate) fn container(joined: Asset) -> Result<Vec<u8>> {
    let json = json_bytes(&joined)?;
    let bin = joined.buffers.into_iter().next();
    let length = 12 + 8 + json.len() + 3 + bin.as_ref().map_or(0, |bin| 8 + bin.len() + 3);
    let Ok(length) = u32::try_from(length) else {
        return Err(Error::Unsupported { what: "a .glb of more than 4 GiB".into() });
    };
    let glb = gltf::Glb {
        header: gltf::binary::Header { magic: *b"glTF", version: 2, length },
        json: Cow::Owned(json),
        bin: bin.map(Cow::Owned),
    };
    glb.to_vec().map_err(Error::internal)
}

/// The name of the file that a URI leads to, without its folder and extension; none of a data URI.
pub(super) fn uri_stem(uri: &str) -> Option<String> {
    if uri.starts_with("data:") {
        return None;
    }
    let path = percent_decode_str(uri).decode_utf8_lossy().into_owned();
    let file = path.rsplit(['/', '\\']).next().unwrap_or_default();
    let stem = file.rsplit_once('.').map_or(file, |(stem, _)| stem);
    (!stem.is_empty()).then(|| stem.to_owned())
}

/// Brings all bytes that the document refers to into one buffer, images among them unless each has a
/// URI `beside` the document; what the document says of its images is said anew.
///
/// # Errors
/// [`Error::Invalid`] if a view runs past its buffer.
pub(crate) fn join_buffers(asset: &Asset, beside: Option<&[String]>) -> Result<Asset> {
    let mut json = asset.json.clone();
    let mut bytes = Vec::new();
    let properties = property_views(&asset.json);
    let mut append = |data: &[u8], alignment: usize| {
        bytes.resize(usize::next_multiple_of(bytes.len(), alignment), 0);
        let start = bytes.len();
        bytes.extend_from_slice(data);
        start
    };
    let image_views: Vec<Option<usize>> = (0..asset.images.len())
        .map(|index| asset.reference(&format!("/images/{index}"), "bufferView", "bufferViews"))
        .collect::<Result<_>>()?;
    for index in 0..asset.count("bufferViews") {
        let image = image_views.iter().position(|&view| view == Some(index));
        let data = match (image, beside) {
            (Some(_), Some(_)) => &[0; 4],
            (Some(image), None) => asset.images[image].bytes.as_slice(),
            (None, _) => asset.view(index)?.0,
        };
        // No view may be empty; one that is holds nothing that is used.
        let data = if data.is_empty() { &[0; 4] } else { data };
        let view = &mut json["bufferViews"][index];
        view["buffer"] = json!(0);
        let alignment = if properties.contains(&index) { 8 } else { 4 };
        view["byteOffset"] = json!(append(data, alignment));
        view["byteLength"] = json!(data.len());
    }
    // What is missing stays what its URI names.
    for (index, image) in asset.images.iter().enumerate().filter(|(_, own)| !own.is_missing()) {
        let view = match (image_views[index], beside) {
            (_, Some(_)) => Value::Null,
            (Some(view), None) => json!(view),
            (None, None) => {
                let view = json!({"buffer": 0, "byteOffset": append(&image.bytes, 4),
                    "byteLength": image.bytes.len()});
                json!(put(&mut json, "bufferViews", None, view))
            }
        };
        let own = json["images"][index]
            .as_object_mut()
            .ok_or_else(|| Error::invalid(format!("/images/{index}"), "not an object"))?;
        let named = own.shift_remove("uri");
        own.shift_remove("bufferView");
        match beside {
            Some(uris) => own.insert("uri".into(), json!(uris[index])),
            None => own.insert("bufferView".into(), view),
        };
        // Inside a file it has no file's name any more, by which people know it.
        let stem = named.as_ref().and_then(Value::as_str).and_then(uri_stem);
        if let (Some(stem), None) = (stem, beside) {
            own.entry("name").or_insert(json!(stem));
        }
        own.insert("mimeType".into(), json!(image.format.mime()));
    }
    match_formats(&mut json, &asset.images);
    if bytes.is_empty() {
        json.as_object_mut().map(|document| document.shift_remove("buffers"));
        return Ok(Asset { json, images: asset.images.clone(), ..Asset::default() });
    }
    json["buffers"] = json!([{"byteLength": bytes.len()}]);
    let images = asset.images.clone();
    Ok(Asset { json, buffers: vec![bytes], images, ..Asset::default() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn an_image_keeps_the_name_of_its_file_unless_it_has_one_of_its_own() {
        use crate::image_file::encoded::{EncodedImage, ImageFormat};
        let image = EncodedImage { bytes: b"texels".to_vec().into(), format: ImageFormat::Png };
        let asset = Asset {
            json: json!({"images": [
                {"uri": "../maps/base%20color.v2.png"},
                {"uri": "a.png", "name": "Cloth"},
                {"uri": "data:image/png;base64,AA=="},
            ]}),
            images: vec![image; 3],
            ..Asset::default()
        };
        let names = |joined: Asset| {
            let images = joined.json["images"].as_array().cloned().unwrap_or_default();
            images.iter().map(|image| image["name"].clone()).collect::<Vec<_>>()
        };
        let inside = names(join_buffers(&asset, None).unwrap());
        assert_eq!(inside, [json!("base color.v2"), json!("Cloth"), Value::Null]);
        let uris = ["1", "2", "3"].map(String::from);
        assert_eq!(names(join_buffers(&asset, Some(&uris)).unwrap())[0], Value::Null);
    }

    #[test]
    fn a_glb_is_read_back_as_it_was() {
        let json = serde_json::json!({
            "asset": {"version": "2.0", "extras": {"left": "alone"}},
            "buffers": [{"byteLength": 5}],
            "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 5}],
        });
        let asset =
            Asset { json: json.clone(), buffers: vec![vec![1, 2, 3, 4, 5]], ..Asset::default() };
        let glb = to_glb(&asset).unwrap();
        assert_eq!(glb.len() as u32, u32::from_le_bytes(glb[8..12].try_into().unwrap()));
        let back = crate::import::read_bytes(&glb, Path::new("")).unwrap();
        assert_eq!((back.json, back.buffers), (json, asset.buffers));
    }
}
