//! Pictures that a material names, as textures of a document.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use image::DynamicImage;
use rustc_hash::FxHashMap;
use serde_json::{Value, json};

use super::builder::Document;
use super::cutout::{Cutout, cut_out};
use super::find::{Found, Named, relative};
use super::options::ReadOptions;
use super::uri::UriPolicy;
use crate::error::{Error, Result};
use crate::image_file::codec::{decode, detect_format, encode, open};
use crate::image_file::encoded::{EncodedImage, ImageFormat};

/// glTF's number for texture reads that stop at the picture's edge.
const CLAMP_TO_EDGE: u32 = 33071;

/// The files of a color and its alpha, and whether reads stop at their edges.
type CutoutKey = (Option<PathBuf>, PathBuf, bool);

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
    cutouts: FxHashMap<CutoutKey, Option<(usize, Cutout)>>,
}

impl<'a> Pictures<'a> {
    pub(super) fn new(folder: &'a Path, options: ReadOptions) -> Self {
        Self {
            uri_policy: options.uri_policy(folder),
            options,
            textures: FxHashMap::default(),
            images: FxHashMap::default(),
            grays: FxHashMap::default(),
            cutouts: FxHashMap::default(),
        }
    }

    /// The texture that shows a picture, which is read if it is a new one.
    ///
    /// # Errors
    /// [`Error::Invalid`] if it is not there or damaged; [`Error::Unsupported`] if it is of a kind
    /// that this version lacks.
    pub(super) fn texture(
        &mut self,
        document: &mut Document,
        named: &Named,
        clamp: bool,
    ) -> Result<usize> {
        let path = self.find(named, document)?;
        if let Some(texture) = self.textures.get(&(path.clone(), clamp)) {
            return Ok(*texture);
        }
        let (image, format) = match self.images.get(&path) {
            Some(known) => *known,
            None => {
                let image = self.read(&path, named)?;
                let format = image.format;
                let known = (document.add_image(&self.name(&path, named), image), format);
                self.images.insert(path.clone(), known);
                known
            }
        };
        let mut texture = json!({"source": image});
        if let Some(extension) = format.extension() {
            texture = json!({"extensions": {extension: {"source": image}}});
            document.use_extension(extension, true);
        }
        let texture = add_texture(document, texture, clamp);
        self.textures.insert((path, clamp), texture);
        Ok(texture)
    }

    /// The texture of a color, white if there is none, with a picture of its alpha, and what the alpha is
    /// like; none if it is opaque, or a file is missing and may be.
    ///
    /// # Errors
    /// As [`Pictures::texture`].
    pub(super) fn cutout(
        &mut self,
        document: &mut Document,
        color: Option<&Named>,
        alpha: &Named,
        clamp: bool,
    ) -> Result<Option<(usize, Cutout)>> {
        let color_path = color.map(|color| self.find(color, document)).transpose()?;
        let alpha_path = self.find(alpha, document)?;
        let key = (color_path, alpha_path, clamp);
        if let Some(known) = self.cutouts.get(&key) {
            return Ok(*known);
        }
        let texels = |named: &Named, path: &Path| {
            let image = self.read(path, named)?;
            let is_missing = image.is_missing();
            let limit = self.options.memory_limit;
            Ok::<_, Error>(if is_missing { None } else { Some(decode(&image, &named.at, limit)?) })
        };
        let color_texels = match (color, &key.0) {
            (Some(color), Some(path)) => texels(color, path)?.map(Some),
            _ => Some(None),
        };
        let alpha_texels = texels(alpha, &key.1)?;
        if alpha_texels.is_none() {
            let what = format!("{} is not there: all is opaque; put it there", alpha.file);
            document.warnings.add(&alpha.at, what);
        }
        let cut = match (color_texels, alpha_texels) {
            (Some(color), Some(texels)) => cut_out(color, &texels, self.options.memory_limit)
                .map_err(|what| Error::invalid(&alpha.at, what))?,
            _ => None,
        };
        let made = match cut {
            None => None,
            Some((texels, kind)) => {
                let name = self.name(&key.1, alpha);
                let color = color.zip(key.0.as_deref()).map(|(own, path)| self.name(path, own));
                let name = color.map_or(name.clone(), |color| format!("{color} with {name}"));
                let image = encode(&texels.into(), ImageFormat::Png)?;
                let image = document.add_image(&name, image);
                Some((add_texture(document, json!({"source": image}), clamp), kind))
            }
        };
        self.cutouts.insert(key, made);
        Ok(made)
    }

    /// Whether a picture is of one gray value at each texel, as a map of heights is. One that can't
    /// be read is taken for colored: the error comes where it is used.
    pub(super) fn is_gray(&mut self, named: &Named) -> bool {
        let Ok(Found { path, .. }) = named.find(self.uri_policy) else { return false };
        if let Some(known) = self.grays.get(&path) {
            return *known;
        }
        let read =
            self.read(&path, named).and_then(|image| decode(&image, "", self.options.memory_limit));
        let is_gray = read.is_ok_and(|image| {
            let is_gray = |pixel: &image::Rgb<u8>| pixel[0] == pixel[1] && pixel[1] == pixel[2];
            !image.color().has_color() || image.to_rgb8().pixels().all(is_gray)
        });
        self.grays.insert(path, is_gray);
        is_gray
    }

    /// Where a picture is, which may be not there.
    fn find(&self, named: &Named, document: &mut Document) -> Result<PathBuf> {
        let found = named.find(self.uri_policy).map_err(|what| Error::invalid(&named.at, what))?;
        if found.is_guess {
            let what = format!(
                "{} is not there: {} is taken; name it so",
                named.file,
                self.name(&found.path, named)
            );
            document.warnings.add(&named.at, what);
        }
        Ok(found.path)
    }

    /// The name of a picture in the document: its path from the model.
    fn name(&self, path: &Path, named: &Named) -> String {
        relative(path, self.uri_policy.folder).unwrap_or_else(|| named.file.clone())
    }

    /// A picture as glTF takes it: as it came, or as a PNG.
    fn read(&self, path: &Path, named: &Named) -> Result<EncodedImage> {
        let Named { file: name, at, .. } = named;
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

fn add_texture(document: &mut Document, mut texture: Value, clamp: bool) -> usize {
    if clamp {
        let sampler = json!({"wrapS": CLAMP_TO_EDGE, "wrapT": CLAMP_TO_EDGE});
        texture["sampler"] = json!(document.add("samplers", sampler));
    }
    document.add("textures", texture)
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
