//! The input of a bake, and the files that it writes.

use std::path::{Path, PathBuf};

use super::options::BakeOptions;
use crate::document::asset::Asset;
use crate::error::Result;
use crate::export::disk::refuse_overwriting;
use crate::export::needle::drop_files_beside;
use crate::import;
use crate::import::options::{ReadOptions, folder_of};
use crate::warning::Warnings;

/// The source of an asset.
#[derive(Clone, Copy, Debug)]
pub enum Input<'a> {
    /// A .gltf, .glb, .obj, .ply or .off file.
    File(&'a Path),
    /// The same, with a name for what is made of it.
    FileAs(&'a Path, &'a str),
    /// The bytes of a self-contained .gltf or .glb, and a name for what is made of it.
    Bytes(&'a [u8], &'a str),
}

impl Input<'_> {
    /// The stem of the outputs' names.
    pub fn stem(&self) -> String {
        match self {
            Self::File(path) => stem(path),
            Self::FileAs(_, name) | Self::Bytes(_, name) => (*name).to_owned(),
        }
    }

    /// The file, if it is one.
    pub(crate) fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) | Self::FileAs(path, _) => Some(path),
            Self::Bytes(..) => None,
        }
    }

    /// The files that a bake writes into `folder`: the levels, the finest first, then all of them
    /// in one if the layout has that, then the progressive file and the page if there is to be one, and last the report. Images,
    /// if they are not in these, go into a folder `<stem>_textures` there, and what the layout needle has beside
    /// its file into `<stem>_needle`.
    pub fn outputs(&self, folder: &Path, options: &BakeOptions) -> Vec<PathBuf> {
        let stem = self.stem();
        let documents = options.output.names(&stem, options.targets.count());
        let page = options.report.filter(|page| !page.apart).map(|_| format!("{stem}.html"));
        let progressive = options.output.progressive_file(&stem);
        let names = options.output.files(&documents).into_iter().chain(progressive).chain(page);
        names.map(|name| folder.join(name)).chain([self.report(folder)]).collect()
    }

    /// The file that a bake writes its report into.
    pub(crate) fn report(&self, folder: &Path) -> PathBuf {
        folder.join(format!("{}.json", self.stem()))
    }

    /// Warns if the outputs are called after another name than the file's stem.
    pub(super) fn warn_of_name(&self, warnings: &mut Warnings) {
        if let Self::FileAs(path, name) = *self
            && name != stem(path)
        {
            let what = format!(
                "another input has the stem `{}` too: the outputs are called after `{name}`; bake them into \
                 two folders to keep it",
                stem(path)
            );
            warnings.add("its name", what);
        }
    }

    /// Makes sure that this input is not among the outputs.
    ///
    /// # Errors
    /// [`Error::Options`](crate::error::Error::Options) if it would be overwritten.
    pub fn refuse_overwriting(&self, outputs: &[PathBuf]) -> Result<()> {
        self.path().map_or(Ok(()), |path| refuse_overwriting(path, outputs))
    }

    /// The input's own file, if it is one, and those that it names.
    pub(super) fn files(&self, asset: &Asset, options: ReadOptions) -> Vec<PathBuf> {
        self.path().map_or(Vec::new(), |path| {
            let policy = options.uri_policy(folder_of(path));
            let named = import::document_files(&asset.json, policy);
            [path.to_owned()].into_iter().chain(named).collect()
        })
    }

    pub(super) fn read(&self, options: ReadOptions) -> Result<Asset> {
        let mut asset = match self {
            Self::File(path) | Self::FileAs(path, _) => import::read_with(path, options),
            Self::Bytes(bytes, _) => import::read_bytes_with(bytes, Path::new(""), options),
        }?;
        drop_files_beside(&mut asset);
        asset.warnings.refuse_if(options.strict)?;
        Ok(asset)
    }
}

/// A file's name without its folder and its extension.
pub(crate) fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
