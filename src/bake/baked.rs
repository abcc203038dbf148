//! The files of a bake, and how they take the place of those of an earlier one.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use serde_json::Value;

use super::options::BakeOptions;
use crate::error::{Error, Result};
use crate::export::disk::{refuse_overwriting, write_files, write_recorded};
use crate::export::files::Format;
use crate::report::BakeReport;

/// The files of a bake, and the report on it.
#[derive(Debug)]
pub struct Baked {
    /// The levels, the finest first, then all of them in one and images beside them, as the options ask for
    /// it.
    pub files: Vec<BakedFile>,
    /// The page of the report, if there is to be one.
    pub page: Option<BakedFile>,
    /// The report.
    pub report: BakeReport,
    /// The beginning of the files' names.
    pub(super) stem: String,
    /// The input's own file and those that it names.
    pub(super) sources: Vec<PathBuf>,
}

/// A file of a bake.
#[derive(Clone, PartialEq, Eq)]
pub struct BakedFile {
    /// Its name, which may lead into a folder.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

impl std::fmt::Debug for BakedFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({} bytes)", self.name, self.bytes.len())
    }
}

impl Baked {
    /// Enters into the report which files lie beside it.
    pub(super) fn list_files(&mut self, options: &BakeOptions) {
        let page = self.page.iter().filter(|_| options.report.is_some_and(|page| !page.apart));
        let files = || self.files.iter().chain(page.clone());
        self.report.files = files().map(|file| file.name.clone()).collect();
        self.report.file_bytes = files().map(|file| file.bytes.len() as u64).collect();
        let of_level = if options.output.format == Format::Gltf { 2 } else { 1 };
        for (level, files) in self.report.levels.iter_mut().zip(self.files.chunks(of_level)) {
            let beside = if of_level == 1 { 0 } else { level.texture_bytes };
            level.bytes =
                (files.iter().map(|file| file.bytes.len()).sum::<usize>() + beside) as u64;
        }
    }

    /// Writes all files into `folder`, which is made if it is not there, with the report as
    /// `<stem>.json`: either all of them or none. Files that the report there lists, of an earlier bake,
    /// and this one does not, are removed; their names are returned. Those that this bake was made from
    /// stay.
    ///
    /// # Errors
    /// [`Error::Io`](crate::error::Error::Io) with the file that can't be written or removed;
    /// [`Error::Options`](crate::error::Error::Options) if it is one that the input consists of.
    pub fn write(&self, folder: &Path) -> Result<Vec<String>> {
        let listed: BTreeSet<&str> = self.report.files.iter().map(String::as_str).collect();
        let page = self.page.iter().filter(|page| listed.contains(page.name.as_str()));
        let files: Vec<(PathBuf, &[u8])> = self
            .files
            .iter()
            .chain(page)
            .map(|file| (folder.join(&file.name), &file.bytes[..]))
            .collect();
        let paths: Vec<PathBuf> = files.iter().map(|(path, _)| path.clone()).collect();
        self.sources.iter().try_for_each(|source| refuse_overwriting(source, &paths))?;
        let json = self.report.to_json()?;
        let record = folder.join(format!("{}.json", self.stem));
        let stale = self.stale(folder, &record);
        let gone: Vec<PathBuf> = stale.iter().map(|name| folder.join(name)).collect();
        write_recorded(&files, &(record, json.as_bytes()), &gone)?;
        for parent in gone.iter().filter_map(|path| path.parent()).filter(|own| *own != folder) {
            // One with anything else in it stays.
            let _ = std::fs::remove_dir(parent);
        }
        Ok(stale)
    }

    /// Writes the one level to a file of any name.
    ///
    /// # Errors
    /// As [`Baked::write`].
    pub fn write_level(&self, path: &Path) -> Result<()> {
        let outputs = [path.to_owned()];
        self.sources.iter().try_for_each(|source| refuse_overwriting(source, &outputs))?;
        write_files(&[(path.to_owned(), self.level()?)])
    }

    /// The bytes of the one level.
    ///
    /// # Errors
    /// [`Error::Options`] if there are several files.
    pub fn level(&self) -> Result<&[u8]> {
        match &self.files[..] {
            [level] => Ok(&level.bytes),
            files => {
                let what = format!("one file can't take {}: bake into a folder", files.len());
                Err(Error::Options { what })
            }
        }
    }

    /// Files of an earlier bake into `folder` that this one has no successor for.
    fn stale(&self, folder: &Path, record: &Path) -> Vec<String> {
        let Some(old) = Record::read(record) else { return Vec::new() };
        let there = |path: &Path| path.canonicalize().ok();
        let sources: BTreeSet<PathBuf> =
            self.sources.iter().filter_map(|path| there(path)).collect();
        let is_stale = |name: &String| {
            let path = folder.join(name);
            let is_ours = name.starts_with(&self.stem)
                && Path::new(name).components().all(|part| matches!(part, Component::Normal(_)));
            let is_source = there(&path).is_none_or(|path| sources.contains(&path));
            is_ours && !self.report.files.contains(name) && path.is_file() && !is_source
        };
        old.files.into_iter().filter(is_stale).collect()
    }
}

/// The part of a report by which a later bake knows what is there.
pub(crate) struct Record {
    /// The hash of all that the files follow from.
    pub(crate) digest: String,
    /// The files beside it.
    pub(crate) files: Vec<String>,
    /// How large each of them is; none if the report does not say.
    pub(crate) bytes: Vec<u64>,
}

impl Record {
    /// Reads a report, if it is one.
    pub(crate) fn read(report: &Path) -> Option<Self> {
        let report: Value = serde_json::from_slice(&std::fs::read(report).ok()?).ok()?;
        let list = |key: &str| report[key].as_array().map(Vec::as_slice);
        let files = list("files")?.iter().map(|file| file.as_str().map(str::to_owned));
        Some(Self {
            digest: report["digest"].as_str()?.to_owned(),
            files: files.collect::<Option<_>>()?,
            bytes: list("file_bytes")
                .unwrap_or_default()
                .iter()
                .filter_map(Value::as_u64)
                .collect(),
        })
    }

    /// Whether all files are in `folder`, as large as they were made.
    pub(crate) fn is_whole(&self, folder: &Path) -> bool {
        let bytes = self.bytes.iter().map(Some).chain(std::iter::repeat(None));
        self.files.iter().zip(bytes).all(|(file, bytes)| {
            std::fs::metadata(folder.join(file))
                .is_ok_and(|own| own.is_file() && bytes.is_none_or(|bytes| own.len() == *bytes))
        })
    }
}
