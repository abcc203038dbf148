//! Pictures that a material names, as textures of a document.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use image::DynamicImage;
use rustc_hash::FxHashMap;
use serde_json::json;

use super::builder::Document;
use super::options::ReadOptions;
use super::uri::UriPolicy;
use crate::error::{Error, Result};
use crate::image_file::codec::{decode, detect_format, encode, open};
use crate::image_file::encoded::{EncodedImage, ImageFormat};

/// glTF's number for texture reads that stop at the picture's edge.
const CLAMP_TO_EDGE: u32 = 33071;

/// Textures of a document by the pictures that they show.
#[derive(Debug)]
pub(super) struct Pictures<'a> {
    uri_policy: UriPolicy<'a>,
    options: ReadOptions,
    /// Textures by file, and by whether reads stop at its edge.
    textures: FxHashMap<(PathBuf, bool), usize>,
    /// The image of each file, and its format.
    images: FxHashMap<PathBuf, (usize, ImageFormat)>,
    /// Whether each file that was asked for is gray.
    grays: FxHashMap<PathBuf, bool>,
}

impl<'a> Pictures<'a> {
    pub(super) fn new(folder: &'a Path, options: ReadOptions) -> Self {
        Self {
            uri_policy: options.uri_policy(folder),
            options,
            textures: FxHashMap::default(),
            images: FxHashMap::default(),
            grays: FxHashMap::default(),
        }
    }

    /// The texture that shows a picture, which is read if it is a new one. `at` is where it is named.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it is not there or damaged; [`Error::Unsupported`] if it is of a kind
    /// that this version lacks.
    pub(super) fn texture(
        &mut self,
        document: &mut Document,
        name: &str,
        clamp: bool,
        at: &str,
    ) -> Result<usize> {
        let path = find(self.uri_policy, name).map_err(|what| Error::invalid(at, what))?;
        if let Some(texture) = self.textures.get(&(path.clone(), clamp)) {
            return Ok(*texture);
        }
        let (image, format) = match self.images.get(&path) {
            Some(known) => *known,
            None => {
                let image = self.read(&path, name, at)?;
                let format = image.format;
                let known = (document.add_image(name, image), format);
                self.images.insert(path.clone(), known);
                known
            }
        };
        let mut texture = json!({"source": image});
        if let Some(extension) = format.extension() {
            texture = json!({"extensions": {extension: {"source": image}}});
            document.use_extension(extension, true);
        }
        if clamp {
            let sampler = json!({"wrapS": CLAMP_TO_EDGE, "wrapT": CLAMP_TO_EDGE});
            texture["sampler"] = json!(document.add("samplers", sampler));
        }
        let texture = document.add("textures", texture);
        self.textures.insert((path, clamp), texture);
        Ok(texture)
    }

    /// Whether a picture is of one gray value at each texel, as a map of heights is. One that can't
    /// be read is taken for colored: the error comes where it is used.
    pub(super) fn is_gray(&mut self, name: &str) -> bool {
        let Ok(path) = find(self.uri_policy, name) else { return false };
        if let Some(known) = self.grays.get(&path) {
            return *known;
        }
        let read = self
            .read(&path, name, "")
            .and_then(|image| decode(&image, "", self.options.memory_limit));
        let is_gray = read.is_ok_and(|image| {
            let is_gray = |pixel: &image::Rgb<u8>| pixel[0] == pixel[1] && pixel[1] == pixel[2];
            !image.color().has_color() || image.to_rgb8().pixels().all(is_gray)
        });
        self.grays.insert(path, is_gray);
        is_gray
    }

    /// A picture as glTF takes it: as it came, or as a PNG.
    fn read(&self, path: &Path, name: &str, at: &str) -> Result<EncodedImage> {
        let is_missing = path.try_exists().is_ok_and(|exists| !exists);
        if is_missing && self.options.allow_missing {
            return Ok(EncodedImage::missing());
        }
        let fault = |error| Error::invalid(at, format!("{name} can't be read: {error}"));
        let bytes = std::fs::read(path).map_err(fault)?;
        if let Some(format) = ImageFormat::detect(&bytes) {
            return Ok(EncodedImage { bytes: bytes.into(), format });
        }
        let unsupported =
            || Error::Unsupported { what: format!("{at}: {name}, a picture of its kind,") };
        let format = foreign_format(&bytes, path).ok_or_else(unsupported)?;
        let limit = self.options.memory_limit;
        let decoded = open(&bytes, format, limit)
            .map_err(|error| limit.explain(&error))
            .and_then(|decoder| limit.decode(decoder, format))
            .map_err(|what| Error::invalid(at, format!("{name}: {what}")))?;
        match decoded {
            DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => Err(unsupported()),
            decoded => encode(&decoded, ImageFormat::Png),
        }
    }
}

/// The format of a picture that glTF does not take. A TGA is known by its name alone.
fn foreign_format(bytes: &[u8], path: &Path) -> Option<image::ImageFormat> {
    let extension = path.extension().and_then(OsStr::to_str).unwrap_or_default();
    match detect_format(bytes) {
        None if bytes.starts_with(b"BM") => Some(image::ImageFormat::Bmp),
        None if extension.eq_ignore_ascii_case("tga") => Some(image::ImageFormat::Tga),
        format => format,
    }
}

/// The file that a name stands for: in the folder or below, under its last part alone where the
/// whole is of another machine. Says what is wrong with a name that leads outside.
pub(super) fn find(uri_policy: UriPolicy<'_>, name: &str) -> std::result::Result<PathBuf, String> {
    let name = name.replace('\\', "/");
    let path = uri_policy.file(&name);
    let last = name.rsplit('/').next().and_then(|last| uri_policy.file(last).ok());
    match last {
        Some(last) if !path.as_ref().is_ok_and(|path| path.is_file()) && last.is_file() => Ok(last),
        _ => path,
    }
}
