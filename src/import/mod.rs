//! Files to [`Asset`]: .gltf and .glb here, other formats by their extensions in `format`.

mod builder;
mod format;
mod images;
mod mtl;
mod obj;
mod off;
pub mod options;
mod ply;
mod polygon;
mod text;
mod uri;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use gltf::json;
use serde_json::Value;

use crate::compression;
use crate::document::asset::Asset;
use crate::error::{Error, Result};
use crate::image_file::encoded::{EncodedImage, ImageFormat};
use crate::limit::Budget;
use format::Format;
use options::{ReadOptions, folder_of};
use uri::{Resource, UriPolicy};

/// Required extensions that leave geometry and textures as core glTF has them, that the accessor
/// layer reads, or that are made plain at reading.
const SUPPORTED: &[&str] = &[
    "EXT_mesh_features",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    #[cfg(feature = "draco")]
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "MSFT_lod",
];

/// Bytes of a GLB's own header and that of its first chunk.
const GLB_HEADERS: usize = 20;

/// Reads an asset with all its buffers and images.
///
/// # Errors
/// [`Error::Io`] if a file can't be read; [`Error::Invalid`] if one is not what it should be;
/// [`Error::Unsupported`] if the document requires an extension that this version lacks.
pub fn read(path: &Path) -> Result<Asset> {
    read_with(path, ReadOptions::default())
}

/// As [`read`], with options.
///
/// # Errors
/// As [`read`].
pub fn read_with(path: &Path, options: ReadOptions) -> Result<Asset> {
    let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
    read_bytes_of(&bytes, path, options)
}

/// As [`read_with`], of a file whose bytes are at hand: `path` says what format they are in, and which
/// folder the files are in that it names.
///
/// # Errors
/// As [`read`].
pub fn read_bytes_of(bytes: &[u8], path: &Path, options: ReadOptions) -> Result<Asset> {
    let Some(format) = Format::of(path) else {
        return read_bytes_with(bytes, folder_of(path), options);
    };
    let mut asset = format.read(bytes, folder_of(path), options)?;
    asset.warn_of_missing_images();
    asset.warnings.refuse_if(options.strict)?;
    Ok(asset)
}

/// Reads an asset without its images, so that they may be missing or of any kind.
///
/// # Errors
/// As [`read`].
pub fn read_geometry(path: &Path, options: ReadOptions) -> Result<Asset> {
    let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
    let asset = match Format::of(path) {
        Some(format) => {
            let options = ReadOptions { allow_missing: true, ..options };
            format.read(&bytes, folder_of(path), options)?
        }
        None => read_document(&bytes, folder_of(path), options)?,
    };
    asset.warnings.refuse_if(options.strict)?;
    Ok(asset)
}

/// Reads an asset from the bytes of a .gltf or .glb; `folder` is where its other files are.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(bytes: &[u8], folder: &Path) -> Result<Asset> {
    read_bytes_with(bytes, folder, ReadOptions::default())
}

/// As [`read_bytes`], with options.
///
/// # Errors
/// As [`read`].
pub fn read_bytes_with(bytes: &[u8], folder: &Path, options: ReadOptions) -> Result<Asset> {
    let mut asset = read_document(bytes, folder, options)?;
    let mut budget = Budget::of(options.memory_limit);
    for index in 0..asset.count("images") {
        let image = read_image(&asset, index, folder, options)?;
        let fault = |what| Error::invalid(format!("/images/{index}"), what);
        budget.take("all image files", image.bytes.len() as u64).map_err(fault)?;
        asset.images.push(image);
    }
    asset.warn_of_missing_images();
    asset.warnings.refuse_if(options.strict)?;
    Ok(asset)
}

/// Reads the document and its buffers, and makes plain what is compressed in them.
fn read_document(bytes: &[u8], folder: &Path, options: ReadOptions) -> Result<Asset> {
    let (json, chunk) = parse(bytes)?;
    check_version(&json)?;
    check_shape(&json)?;
    check_extensions(&json)?;
    let mut asset = Asset { json, ..Asset::default() };
    let mut budget = Budget::of(options.memory_limit);
    for index in 0..asset.count("buffers") {
        let buffer = read_buffer(&asset, index, chunk.as_deref(), options.uri_policy(folder))?;
        let fault = |what| Error::invalid(format!("/buffers/{index}"), what);
        budget.take("all buffers", buffer.len() as u64).map_err(fault)?;
        asset.buffers.push(buffer);
    }
    compression::expand(&mut asset, options.memory_limit)?;
    Ok(asset)
}

/// The document, and the binary chunk if there is one.
fn parse(bytes: &[u8]) -> Result<(Value, Option<Cow<'_, [u8]>>)> {
    let (json, chunk) = if bytes.starts_with(b"glTF") {
        let invalid = |what: String| Error::invalid("the GLB container", what);
        if bytes.len() < GLB_HEADERS || length_of(bytes) < GLB_HEADERS {
            return Err(invalid("it ends before its first chunk".into()));
        }
        // What follows the announced end is none of the file's.
        let bytes = &bytes[..bytes.len().min(length_of(bytes))];
        let glb = gltf::Glb::from_slice(bytes).map_err(|error| invalid(error.to_string()))?;
        (glb.json, glb.bin)
    } else {
        (bytes.into(), None)
    };
    let json = serde_json::from_slice(&json)
        .map_err(|error| Error::invalid("the JSON document", error.to_string()))?;
    Ok((json, chunk))
}

/// The other files that an asset's file names and may, as far as it can be read; `bytes` are its own.
pub(crate) fn named_files(path: &Path, bytes: &[u8], allow_outside: bool) -> Vec<PathBuf> {
    let uri_policy = UriPolicy { folder: folder_of(path), allow_outside };
    if let Some(format) = Format::of(path) {
        return format.named_files(bytes, uri_policy);
    }
    parse(bytes).map_or(Vec::new(), |(json, _)| document_files(&json, uri_policy))
}

/// The files that a document names and may.
pub(crate) fn document_files(json: &Value, uri_policy: UriPolicy<'_>) -> Vec<PathBuf> {
    let list = |name: &str| json.get(name).and_then(Value::as_array).into_iter().flatten();
    let uris = list("buffers").chain(list("images")).filter_map(|object| object["uri"].as_str());
    let file = |uri| match Resource::of(uri, "", uri_policy) {
        Ok(Resource::File(path)) => Some(path),
        _ => None,
    };
    uris.filter(|uri| !uri.starts_with("data:")).filter_map(file).collect()
}

/// The length that a GLB's header announces.
fn length_of(glb: &[u8]) -> usize {
    u32::from_le_bytes([glb[8], glb[9], glb[10], glb[11]]) as usize
}

fn check_version(json: &Value) -> Result<()> {
    match json.pointer("/asset/version").and_then(Value::as_str) {
        Some(version) if version.starts_with("2.") => Ok(()),
        Some(version) => Err(Error::Unsupported { what: format!("glTF version {version}") }),
        None => Err(Error::invalid("/asset/version", "there is none: not a glTF document")),
    }
}

/// Checks that lists are lists and objects are objects wherever a later stage changes them.
fn check_shape(json: &Value) -> Result<()> {
    let lists = [
        "accessors",
        "animations",
        "bufferViews",
        "buffers",
        "images",
        "materials",
        "meshes",
        "nodes",
        "samplers",
        "scenes",
        "skins",
        "textures",
    ];
    for list in lists {
        check_objects(json, list, "")?;
    }
    for key in ["extensionsUsed", "extensionsRequired"] {
        if json.get(key).is_some_and(|names| !names.is_array()) {
            return Err(Error::invalid(format!("/{key}"), "not a list"));
        }
    }
    for (index, mesh) in json["meshes"].as_array().into_iter().flatten().enumerate() {
        let at = format!("/meshes/{index}");
        check_objects(mesh, "primitives", &at)?;
        for (part, primitive) in mesh["primitives"].as_array().into_iter().flatten().enumerate() {
            check_objects(primitive, "targets", &format!("{at}/primitives/{part}"))?;
        }
    }
    for (index, node) in json["nodes"].as_array().into_iter().flatten().enumerate() {
        if node.get("children").is_some_and(|children| !children.is_array()) {
            return Err(Error::invalid(format!("/nodes/{index}/children"), "not a list"));
        }
    }
    Ok(())
}

/// Checks that what stands under `key`, if anything, is a list of objects, and that their
/// extensions are objects.
fn check_objects(parent: &Value, key: &str, at: &str) -> Result<()> {
    let Some(list) = parent.get(key) else {
        return Ok(());
    };
    let at = format!("{at}/{key}");
    let list = list.as_array().ok_or_else(|| Error::invalid(&at, "not a list"))?;
    for (index, object) in list.iter().enumerate() {
        if !object.is_object() {
            return Err(Error::invalid(format!("{at}/{index}"), "not an object"));
        }
        if object.get("extensions").is_some_and(|extensions| !extensions.is_object()) {
            return Err(Error::invalid(format!("{at}/{index}/extensions"), "not an object"));
        }
    }
    Ok(())
}

fn check_extensions(json: &Value) -> Result<()> {
    let required = json.get("extensionsRequired").and_then(Value::as_array);
    for name in required.into_iter().flatten() {
        let name = name
            .as_str()
            .ok_or_else(|| Error::invalid("/extensionsRequired", "names must be strings"))?;
        if !SUPPORTED.contains(&name) && !name.starts_with("KHR_materials_") {
            return Err(Error::Unsupported { what: format!("the required extension {name}") });
        }
    }
    Ok(())
}

fn read_buffer(
    asset: &Asset,
    index: usize,
    chunk: Option<&[u8]>,
    uri_policy: UriPolicy<'_>,
) -> Result<Vec<u8>> {
    let at = format!("/buffers/{index}");
    let buffer: json::Buffer = asset.parse(&at)?;
    let mut bytes = match (&buffer.uri, chunk) {
        (Some(uri), _) => Resource::of(uri, &at, uri_policy)?.read(&at)?,
        (None, Some(chunk)) if index == 0 => chunk.to_vec(),
        (None, _) if compression::is_fallback(&asset.json, index) => {
            return Ok(Vec::new());
        }
        _ => return Err(Error::invalid(at, "it has neither a URI nor the binary chunk")),
    };
    let length = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
    if bytes.len() < length {
        let what = format!("{length} bytes announced, {} there", bytes.len());
        return Err(Error::invalid(at, what));
    }
    bytes.truncate(length);
    Ok(bytes)
}

fn read_image(
    asset: &Asset,
    index: usize,
    folder: &Path,
    options: ReadOptions,
) -> Result<EncodedImage> {
    let at = format!("/images/{index}");
    let uri = asset.json.pointer(&at).and_then(|image| image.get("uri")).and_then(Value::as_str);
    let bytes = match (uri, asset.reference(&at, "bufferView", "bufferViews")?) {
        (Some(uri), _) => {
            let resource = Resource::of(uri, &at, options.uri_policy(folder))?;
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

#[cfg(test)]
mod tests {
    use super::*;

    fn error(json: &str) -> String {
        read_bytes(json.as_bytes(), Path::new("")).unwrap_err().to_string()
    }

    #[test]
    fn an_embedded_buffer_is_read() {
        let json = r#"{"asset": {"version": "2.0"},
            "buffers": [{"byteLength": 2, "uri": "data:application/octet-stream;base64,AQID"}]}"#;
        assert_eq!(read_bytes(json.as_bytes(), Path::new("")).unwrap().buffers, [[1, 2]]);
    }

    #[test]
    fn a_missing_image_is_put_up_with_if_that_is_asked_for_and_a_missing_buffer_never() {
        let options = ReadOptions { allow_missing: true, ..ReadOptions::default() };
        let json = r#"{"asset": {"version": "2.0"}, "images": [{"uri": "not%20there.png"}]}"#;
        let asset = read_bytes_with(json.as_bytes(), Path::new(""), options).unwrap();
        let said: Vec<String> = asset.warnings.iter().map(ToString::to_string).collect();
        assert!(said[0].starts_with("/images/0/uri: not%20there.png is not there"), "{said:?}");
        let strict = ReadOptions { strict: true, ..options };
        let error = read_bytes_with(json.as_bytes(), Path::new(""), strict).unwrap_err();
        assert!(error.to_string().contains("--strict"), "{error}");
        let json =
            json.replace("images", "buffers").replace("\"uri\"", "\"byteLength\": 1, \"uri\"");
        let error = read_bytes_with(json.as_bytes(), Path::new(""), options).unwrap_err();
        assert!(error.to_string().starts_with("/buffers/0/uri"), "{error}");
    }

    #[test]
    fn each_fault_is_named_with_its_place() {
        assert!(error("{").contains("JSON"));
        for length in 0..20 {
            let glb = b"glTF\x02\0\0\0\x03\0\0\0\x09\0\0\0JSON";
            assert!(read_bytes(&glb[..length.max(4)], Path::new("")).is_err());
        }
        assert!(error("{}").contains("/asset/version"));
        assert!(error(r#"{"asset": {"version": "1.0"}}"#).contains("glTF version 1.0"));
        let with = |rest: &str| error(&format!(r#"{{"asset": {{"version": "2.0"}}, {rest}}}"#));
        assert!(with(r#""extensionsRequired": ["EXT_of_tomorrow"]"#).contains("EXT_of_tomorrow"));
        assert!(with(r#""nodes": [{}, {"extensions": 5}]"#).starts_with("/nodes/1/extensions"));
        assert!(with(r#""meshes": [{"primitives": [7]}]"#).starts_with("/meshes/0/primitives/0"));
        assert!(with(r#""buffers": [{"byteLength": 9}]"#).starts_with("/buffers/0"));
        let missing = with(r#""images": [{"uri": "not%20there.png"}]"#);
        assert!(missing.starts_with("/images/0/uri") && missing.contains("not there.png"));
        let empty = "/images/0: an image that is no PNG";
        assert!(with(r#""images": [{"uri": "data:;base64,"}]"#).contains(empty));
        assert!(with(r#""images": [{"bufferView": 4}]"#).starts_with("/images/0/bufferView"));
    }
}
