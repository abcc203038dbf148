//! OBJ, PLY and OFF, made into a glTF document right after reading: no later stage knows of them.
//!
//! Positions, normals, UVs and colors come over as they are, with UVs turned from counting upward
//! to counting downward and colors from their sRGB encoding to linear light, as glTF has them.
//! Polygons become triangles. What these formats leave open is filled in plainly: a surface without
//! a material is matte and white, one without normals has none, which glTF shows flat.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use super::options::ReadOptions;
use super::uri::UriPolicy;
use super::{obj, off, ply};
use crate::document::asset::Asset;
use crate::error::Result;

/// Formats other than glTF, known by their extensions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Wavefront OBJ, with its materials in MTL files.
    Obj,
    /// Geomview's Object File Format.
    Off,
    /// The Stanford Polygon File Format.
    Ply,
}

impl Format {
    /// The format of a file by its name; `None` for glTF and anything unknown.
    pub(crate) fn of(path: &Path) -> Option<Self> {
        let extension = path.extension().and_then(OsStr::to_str)?.to_ascii_lowercase();
        match extension.as_str() {
            "obj" => Some(Self::Obj),
            "off" => Some(Self::Off),
            "ply" => Some(Self::Ply),
            _ => None,
        }
    }

    /// Reads a file of this format; `folder` is where the files are that it names.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) with the line, or the byte in a binary file;
    /// [`Error::Unsupported`](crate::error::Error::Unsupported) if it is no surface, or a picture is
    /// of a kind that this version lacks.
    pub(crate) fn read(self, bytes: &[u8], folder: &Path, options: ReadOptions) -> Result<Asset> {
        match self {
            Self::Obj => obj::read(bytes, folder, options),
            Self::Off => off::read(bytes),
            Self::Ply => ply::read(bytes, folder, options),
        }
    }

    /// The other files that a file of this format names and may, as far as it can be read.
    pub(crate) fn named_files(self, bytes: &[u8], uri_policy: UriPolicy<'_>) -> Vec<PathBuf> {
        match self {
            Self::Obj => obj::named_files(bytes, uri_policy),
            Self::Off => Vec::new(),
            Self::Ply => ply::named_files(bytes, uri_policy),
        }
    }
}
