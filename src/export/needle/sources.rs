//! The input of the files.

use super::super::document::Coverage;
use crate::document::asset::Asset;
use crate::image_file::encoded::EncodedImage;
use crate::level::AssetLevel;
use crate::limit::MemoryLimit;

/// All that the files are made from.
pub(in crate::export) struct Sources<'a> {
    pub(in crate::export) asset: &'a Asset,
    /// The finest first.
    pub(in crate::export) levels: &'a [AssetLevel<'a>],
    /// The source's images, which all levels share.
    pub(in crate::export) images: &'a [EncodedImage],
    /// Where levels are to be shown, if they were measured.
    pub(in crate::export) coverage: Option<Coverage<'a>>,
    /// The beginning of all names.
    pub(in crate::export) stem: &'a str,
    pub(in crate::export) limit: MemoryLimit,
}
