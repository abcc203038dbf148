//! Files to [`Asset`]: .gltf and .glb here, other formats by their extensions in `format`.

mod builder;
mod check;
mod colors;
mod cutout;
mod data_uri;
mod find;
mod finite;
pub(crate) mod foreign;
mod format;
mod images;
mod libraries;
mod mend;
mod mtl;
mod normals;
mod obj;
mod off;
mod offset;
pub mod options;
mod part;
mod ply;
mod polygon;
mod resources;
mod smooth;
mod smoothing;
mod text;
mod uri;

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::compression;
use crate::document::asset::Asset;
use crate::document::features::number_vertices;
use crate::error::{Error, Result};
use crate::limit::Budget;
use crate::warning::Warnings;
use check::{check_extensions, check_shape, check_version};
use foreign::{begins_as_gltf, refuse_foreign, refuse_report};
use format::Format;
use mend::{mend_views, warn_of_textures};
use normals::mend_normals;
use options::{ReadOptions, folder_of};
use resources::{read_buffer, read_image};
use smooth::add_normals;
use uri::{Resource, UriPolicy};

/// Bytes of a GLB's own header and that of its first chunk.
const GLB_HEADERS: usize = 20;

/// The message about bytes that are neither of a .glb nor of a .gltf.
const NO_GLTF: &str = "no glTF: a .gltf is JSON, and a .glb begins with `glTF`; .obj, .ply and .off are \
                       told by their names";

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
    let bytes = read_file(path)?;
    read_bytes_of(&bytes, path, options)
}

/// As [`read_with`], of a file whose bytes are at hand: `path` says what format they are in, and which
/// folder the files are in that it names.
///
/// # Errors
/// As [`read`].
pub fn read_bytes_of(bytes: &[u8], path: &Path, options: ReadOptions) -> Result<Asset> {
    let Some(format) = Format::of(path) else {
        refuse_foreign(path, bytes)?;
        return read_bytes_with(bytes, folder_of(path), options);
    };
    let mut asset = format.read(bytes, folder_of(path), options)?;
    add_normals(&mut asset, options.smooth_normals)?;
    asset.warn_of_missing_images();
    asset.warnings.refuse_if(options.strict)?;
    Ok(asset)
}

/// The bytes of a model's file.
///
/// # Errors
/// [`Error::Io`] if it can't be read; [`Error::Kind`] if it is a folder.
pub fn read_file(path: &Path) -> Result<Vec<u8>> {
    if path.is_dir() {
        return Err(Error::Kind { what: "a folder: name a file in it".into() });
    }
    std::fs::read(path).map_err(|error| Error::io(path, error))
}

/// Reads an asset without its images, so that they may be missing or of any kind.
///
/// # Errors
/// As [`read`].
pub fn read_geometry(path: &Path, options: ReadOptions) -> Result<Asset> {
    let bytes = read_file(path)?;
    let asset = match Format::of(path) {
        Some(format) => {
            let options = ReadOptions { allow_missing: true, ..options };
            format.read(&bytes, folder_of(path), options)?
        }
        None => {
            refuse_foreign(path, &bytes)?;
            read_document(&bytes, folder_of(path), options)?
        }
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
        let image = read_image(&mut asset, index, folder, options)?;
        let fault = |what| Error::invalid(format!("/images/{index}"), what);
        budget.take("all image files", image.bytes.len() as u64).map_err(fault)?;
        asset.images.push(image);
    }
    add_normals(&mut asset, options.smooth_normals)?;
    asset.warn_of_missing_images();
    asset.warnings.refuse_if(options.strict)?;
    Ok(asset)
}

/// Reads the document and its buffers, and makes plain what is compressed in them.
fn read_document(bytes: &[u8], folder: &Path, options: ReadOptions) -> Result<Asset> {
    let mut warnings = Warnings::default();
    let (json, chunk) = parse(bytes, &mut warnings)?;
    refuse_report(&json)?;
    check_version(&json)?;
    check_shape(&json)?;
    check_extensions(&json, options.allow_unknown, &mut warnings)?;
    let mut asset = Asset { json, warnings, ..Asset::default() };
    let mut budget = Budget::of(options.memory_limit);
    for index in 0..asset.count("buffers") {
        let policy = options.uri_policy(folder);
        let buffer = read_buffer(&mut asset, index, chunk.as_deref(), policy)?;
        let fault = |what| Error::invalid(format!("/buffers/{index}"), what);
        budget.take("all buffers", buffer.len() as u64).map_err(fault)?;
        asset.buffers.push(buffer.into());
    }
    mend_views(&mut asset);
    compression::expand(&mut asset, options.memory_limit)?;
    warn_of_textures(&mut asset);
    mend_normals(&mut asset, options.memory_limit)?;
    number_vertices(&mut asset);
    Ok(asset)
}

/// The document, and the binary chunk if there is one.
fn parse<'a>(bytes: &'a [u8], warnings: &mut Warnings) -> Result<(Value, Option<Cow<'a, [u8]>>)> {
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
    let at = "the JSON document";
    let mut text = &json[..];
    if let Some(rest) = text.strip_prefix(b"\xef\xbb\xbf") {
        warnings.add(at, "it begins with a byte order mark, which is skipped; save it without one");
        text = rest;
    }
    let end = text.iter().rposition(|&byte| byte != 0 && !byte.is_ascii_whitespace());
    let (own, padding) = text.split_at(end.map_or(0, |last| last + 1));
    if padding.contains(&0) {
        warnings.add(at, "it ends in zeros, which are skipped; fill its chunk with spaces");
        text = own;
    }
    let json = serde_json::from_slice(text).map_err(|error| match begins_as_gltf(bytes) {
        true => Error::invalid(at, error.to_string()),
        false => Error::Kind { what: NO_GLTF.into() },
    })?;
    Ok((json, chunk))
}

/// The other files that an asset's file names and may, as far as it can be read; `bytes` are its own.
pub(crate) fn named_files(path: &Path, bytes: &[u8], allow_outside: bool) -> Vec<PathBuf> {
    let uri_policy = UriPolicy { folder: folder_of(path), allow_outside };
    if let Some(format) = Format::of(path) {
        return format.named_files(bytes, uri_policy);
    }
    let parsed = parse(bytes, &mut Warnings::default());
    parsed.map_or(Vec::new(), |(json, _)| document_files(&json, uri_policy))
}

/// The files that a document names and may.
pub(crate) fn document_files(json: &Value, uri_policy: UriPolicy<'_>) -> Vec<PathBuf> {
    let list = |name: &str| json.get(name).and_then(Value::as_array).into_iter().flatten();
    let uris = list("buffers").chain(list("images")).filter_map(|object| object["uri"].as_str());
    let file = |uri| match Resource::of(uri, "", uri_policy, &mut Warnings::default()) {
        Ok(Resource::File(path)) => Some(path),
        _ => None,
    };
    uris.filter(|uri| !uri.starts_with("data:")).filter_map(file).collect()
}

/// The length that a GLB's header announces.
fn length_of(glb: &[u8]) -> usize {
    u32::from_le_bytes([glb[8], glb[9], glb[10], glb[11]]) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A material whose texture has the first image.
    const TEXTURED: &str =
        r#""materials": [{"normalTexture": {"index": 0}}], "textures": [{"source": 0}]"#;

    fn error(json: &str) -> String {
        read_bytes(json.as_bytes(), Path::new("")).unwrap_err().to_string()
    }

    #[test]
    fn an_embedded_buffer_is_read() {
        let json = r#"{"asset": {"version": "2.0"},
            "buffers": [{"byteLength": 2, "uri": "data:application/octet-stream;base64,AQID"}]}"#;
        assert_eq!(*read_bytes(json.as_bytes(), Path::new("")).unwrap().buffers[0], [1, 2]);
    }

    #[test]
    fn a_missing_image_is_put_up_with_if_that_is_asked_for_and_a_missing_buffer_never() {
        let options = ReadOptions { allow_missing: true, ..ReadOptions::default() };
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, {TEXTURED}, "images": [{{"uri": "not%20there.png"}}]}}"#
        );
        let asset = read_bytes_with(json.as_bytes(), Path::new(""), options).unwrap();
        let said: Vec<String> = asset.warnings.iter().map(ToString::to_string).collect();
        assert!(said[0].starts_with("/images/0/uri: not%20there.png is not there"), "{said:?}");
        let strict = ReadOptions { strict: true, ..options };
        let error = read_bytes_with(json.as_bytes(), Path::new(""), strict).unwrap_err();
        assert!(error.to_string().contains("--strict"), "{error}");
        let json = r#"{"asset": {"version": "2.0"}, "accessors": [{"bufferView": 0}],
            "bufferViews": [{"buffer": 0, "byteLength": 1}],
            "buffers": [{"byteLength": 1, "uri": "not%20there.bin"}]}"#;
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
        let view =
            r#""accessors": [{"bufferView": 0}], "bufferViews": [{"buffer": 0, "byteLength": 9}]"#;
        assert!(
            with(&format!(r#"{view}, "buffers": [{{"byteLength": 9}}]"#)).starts_with("/buffers/0")
        );
        let short = r#""buffers": [{"byteLength": 9, "uri": "data:;base64,AQID"}]"#;
        assert!(with(&format!("{view}, {short}")).contains("9 bytes announced, 3 there"));
        let with = |rest: &str| with(&format!("{TEXTURED}, {rest}"));
        let missing = with(r#""images": [{"uri": "not%20there.png"}]"#);
        assert!(missing.starts_with("/images/0/uri") && missing.contains("not there.png"));
        let empty = "/images/0: an image that is no PNG";
        assert!(with(r#""images": [{"uri": "data:;base64,"}]"#).contains(empty));
        assert!(with(r#""images": [{"bufferView": 4}]"#).starts_with("/images/0/bufferView"));
    }

    fn warned(json: &str) -> (Asset, Vec<String>) {
        let asset = read_bytes(json.as_bytes(), Path::new("")).unwrap();
        let said = asset.warnings.iter().map(ToString::to_string).collect();
        (asset, said)
    }

    #[test]
    fn what_is_broken_and_unused_or_means_one_thing_alone_is_a_warning() {
        for (rest, place) in [
            (r#""buffers": [{"byteLength": 9}]"#, "/buffers/0: "),
            (r#""buffers": [{"byteLength": 9, "uri": "not_there.bin"}]"#, "/buffers/0: "),
            (r#""buffers": [{"byteLength": 9, "uri": "data:;base64,AQID"}]"#, "/buffers/0: "),
            (r#""buffers": [{"byteLength": 2, "uri": "data:;base64,AQI"}]"#, "/buffers/0/uri: "),
            (r#""bufferViews": [{"buffer": 3, "byteLength": 1}]"#, "/bufferViews/0: "),
            (r#""images": [{"uri": "not_there.png"}]"#, "/images/0: "),
            (r#""images": [{"uri": "data:,no"}], "textures": [{"source": 0}]"#, "/images/0: "),
            (r#""textures": [{}]"#, "/textures/0: "),
        ] {
            let (asset, said) = warned(&format!(r#"{{"asset": {{"version": "2.0"}}, {rest}}}"#));
            assert!(said.len() == 1 && said[0].starts_with(place), "{rest}: {said:?}");
            let glb = crate::export::glb::to_glb(&asset).unwrap();
            assert!(read_bytes(&glb, Path::new("")).is_ok(), "{rest}");
        }
        let mark = "\u{feff}{\"asset\": {\"version\": \"2.0\"}}";
        assert!(
            warned(mark).1[0].starts_with("the JSON document: it begins with a byte order mark")
        );
        let (asset, said) = warned(
            r#"{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 2, "uri": "data:,ab"}]}"#,
        );
        assert_eq!((&asset.buffers[0][..], said.is_empty()), (&b"ab"[..], true));
    }

    #[test]
    fn backslashes_lead_to_the_file_that_slashes_do_unless_there_is_one_of_that_name() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("a")).unwrap();
        std::fs::write(folder.path().join("a/b.bin"), b"12").unwrap();
        let read = || {
            let json = r#"{"asset": {"version": "2.0"},
                "buffers": [{"byteLength": 2, "uri": "a%5Cb.bin"}]}"#;
            read_bytes(json.as_bytes(), folder.path()).unwrap()
        };
        assert_eq!((&read().buffers[0][..], read().warnings.iter().count()), (&b"12"[..], 1));
        std::fs::write(folder.path().join("a\\b.bin"), b"34").unwrap();
        assert_eq!((&read().buffers[0][..], read().warnings.is_empty()), (&b"34"[..], true));
    }

    #[test]
    fn what_is_required_passes_if_it_does_not_touch_what_changes_or_is_allowed() {
        let read = |name: &str, allow_unknown: bool| {
            let json = format!(
                r#"{{"asset": {{"version": "2.0"}}, "extensionsUsed": ["{name}"],
                    "extensionsRequired": ["{name}"]}}"#
            );
            let options = ReadOptions { allow_unknown, ..ReadOptions::default() };
            read_bytes_with(json.as_bytes(), Path::new(""), options)
        };
        for name in ["KHR_node_visibility", "CESIUM_RTC", "KHR_materials_of_tomorrow"] {
            let asset = read(name, false).unwrap();
            assert_eq!(asset.json["extensionsRequired"][0], name);
            assert!(asset.warnings.is_empty());
        }
        for name in ["EXT_of_tomorrow", "CESIUM_primitive_outline", "MSFT_texture_dds"] {
            let error = read(name, false).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains("--allow-unknown"), "{error}");
            let warnings = read(name, true).unwrap().warnings;
            assert!(warnings.iter().any(|warning| warning.what.contains(name)), "{warnings:?}");
        }
    }
}
