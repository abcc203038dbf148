//! Options of reading.

use std::path::Path;

use super::uri::UriPolicy;
use crate::limit::MemoryLimit;

/// The limits of reading, and what is tolerated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Most memory that all buffers may take, all image files, and all geometry that is decompressed.
    pub memory_limit: MemoryLimit,
    /// Whether image files may be missing, which is then a warning.
    pub allow_missing: bool,
    /// Whether the asset may name files outside its folder. Names are judged as they are written: a
    /// link in the folder is followed wherever it leads.
    pub allow_outside: bool,
    /// Whether the asset may require extensions that are not known: they are kept as they are, with a
    /// warning.
    pub allow_unknown: bool,
    /// Normals for surfaces that have none: smooth but where faces bend by more than so many degrees.
    /// If not given such a surface is flat, as in glTF.
    pub smooth_normals: Option<u8>,
    /// Whether a warning is an error; see [`Warnings::refuse_if`].
    ///
    /// [`Warnings::refuse_if`]: crate::warning::Warnings::refuse_if
    pub strict: bool,
}

impl ReadOptions {
    /// The policy on the files that an asset in `folder` may name.
    pub(crate) fn uri_policy(self, folder: &Path) -> UriPolicy<'_> {
        UriPolicy { folder, allow_outside: self.allow_outside }
    }
}

/// The folder that a document's file names start from.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}
