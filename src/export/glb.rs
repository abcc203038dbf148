//! A document and all of its bytes as one .glb.

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
    let Joined { json, pieces, length } = Joined::lay_out(asset, None)?;
    write_glb(&json, (length > 0).then_some(length), |bytes| append(bytes, &pieces))
}

/// The JSON of a document.
pub(crate) fn json_bytes(json: &Value) -> Result<Vec<u8>> {
    serde_json::to_vec(json).map_err(Error::internal)
}

/// A document and its first buffer as a .glb.
pub(crate) fn container(joined: &Asset) -> Result<Vec<u8>> {
    let buffer = joined.buffers.first();
    write_glb(&joined.json, buffer.map(|own| own.len()), |bytes| {
        bytes.extend_from_slice(buffer.map_or(&[][..], |own| &own[..]));
    })
}

/// The container (glTF 2.0 §4.4): a header and two chunks, each with its length and its type before it, filled
/// up to four bytes. `write` appends as many bytes as `length` says, if there is a second one.
fn write_glb(
    json: &Value,
    length: Option<usize>,
    write: impl FnOnce(&mut Vec<u8>),
) -> Result<Vec<u8>> {
    let json = json_bytes(json)?;
    let chunks = [Some(json.len()), length].map(|length| length.map(|own| own.next_multiple_of(4)));
    let whole = 12 + chunks.iter().flatten().map(|chunk| 8 + chunk).sum::<usize>();
    let Ok(announced) = u32::try_from(whole) else {
        return Err(Error::Unsupported { what: "a .glb of more than 4 GiB".into() });
    };
    let mut bytes = Vec::with_capacity(whole);
    bytes.extend_from_slice(b"glTF");
    bytes.extend([2, announced].map(u32::to_le_bytes).as_flattened());
    let begin = |bytes: &mut Vec<u8>, chunk: usize, name: &[u8; 4]| {
        bytes.extend((chunk as u32).to_le_bytes());
        bytes.extend_from_slice(name);
    };
    begin(&mut bytes, json.len().next_multiple_of(4), b"JSON");
    bytes.extend_from_slice(&json);
    bytes.resize(bytes.len().next_multiple_of(4), b' ');
    if let Some(chunk) = chunks[1] {
        begin(&mut bytes, chunk, b"BIN\0");
        write(&mut bytes);
        bytes.resize(whole, 0);
    }
    Ok(bytes)
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
    let Joined { json, pieces, length } = Joined::lay_out(asset, beside)?;
    let mut bytes = Vec::with_capacity(length);
    append(&mut bytes, &pieces);
    let buffers = if bytes.is_empty() { Vec::new() } else { vec![bytes.into()] };
    Ok(Asset { json, buffers, images: asset.images.clone(), ..Asset::default() })
}

/// Appends pieces, each at its place behind what is there, which is a multiple of four bytes.
fn append(bytes: &mut Vec<u8>, pieces: &[(usize, &[u8])]) {
    let start = bytes.len();
    for (at, piece) in pieces {
        bytes.resize(start + at, 0);
        bytes.extend_from_slice(piece);
    }
}

/// A document of one buffer, whose bytes are not copied yet.
struct Joined<'a> {
    json: Value,
    /// Places in the buffer that rise, and what lies there.
    pieces: Vec<(usize, &'a [u8])>,
    /// The length of the buffer.
    length: usize,
}

impl<'a> Joined<'a> {
    fn lay_out(asset: &'a Asset, beside: Option<&[String]>) -> Result<Self> {
        let mut own = Self { json: asset.json.clone(), pieces: Vec::new(), length: 0 };
        let properties = property_views(&asset.json);
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
            let alignment = if properties.contains(&index) { 8 } else { 4 };
            let at = own.place(data, alignment);
            let view = &mut own.json["bufferViews"][index];
            view["buffer"] = json!(0);
            view["byteOffset"] = json!(at);
            view["byteLength"] = json!(data.len());
        }
        own.name_images(asset, &image_views, beside)?;
        match_formats(&mut own.json, &asset.images);
        if own.length > 0 {
            own.json["buffers"] = json!([{"byteLength": own.length}]);
        } else {
            own.json.as_object_mut().map(|document| document.shift_remove("buffers"));
        }
        Ok(own)
    }

    /// Finds a place for bytes behind all others.
    fn place(&mut self, data: &'a [u8], alignment: usize) -> usize {
        let at = self.length.next_multiple_of(alignment);
        self.pieces.push((at, data));
        self.length = at + data.len();
        at
    }

    /// Says where each image is. What is missing stays what its URI names.
    fn name_images(
        &mut self,
        asset: &'a Asset,
        views: &[Option<usize>],
        beside: Option<&[String]>,
    ) -> Result<()> {
        for (index, image) in asset.images.iter().enumerate().filter(|(_, own)| !own.is_missing()) {
            let view = match (views[index], beside) {
                (_, Some(_)) => Value::Null,
                (Some(view), None) => json!(view),
                (None, None) => {
                    let at = self.place(&image.bytes, 4);
                    let view =
                        json!({"buffer": 0, "byteOffset": at, "byteLength": image.bytes.len()});
                    json!(put(&mut self.json, "bufferViews", None, view))
                }
            };
            let own = self.json["images"][index]
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
        Ok(())
    }
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
        let asset = Asset {
            json: json.clone(),
            buffers: vec![vec![1, 2, 3, 4, 5].into()],
            ..Asset::default()
        };
        let glb = to_glb(&asset).unwrap();
        assert_eq!(glb.len() as u32, u32::from_le_bytes(glb[8..12].try_into().unwrap()));
        let back = crate::import::read_bytes(&glb, Path::new("")).unwrap();
        assert_eq!((back.json, back.buffers), (json, asset.buffers));
    }
}
