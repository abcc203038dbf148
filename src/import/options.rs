//! How files are read.

use std::path::Path;

use super::uri::Reach;
use crate::limit::MemoryLimit;

/// What reading may take, and what it puts up with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// Most memory that all buffers may take, all image files, and all geometry that is decompressed.
    pub memory_limit: MemoryLimit,
    /// Whether image files may be missing; see [`Asset::missing_images`].
    ///
    /// [`Asset::missing_images`]: crate::document::asset::Asset::missing_images
    pub allow_missing: bool,
    /// Whether the asset may name files outside its folder. Names are judged as they are written: a
    /// link in the folder is followed wherever it leads.
    pub allow_outside: bool,
}

impl ReadOptions {
    /// What files an asset in `folder` may name.
    pub(crate) fn reach(self, folder: &Path) -> Reach<'_> {
        Reach { folder, allow_outside: self.allow_outside }
    }
}

/// Where the files that a document names are.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().unwrap_or(Path::new(""))
}
