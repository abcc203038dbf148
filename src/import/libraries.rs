//! The material files of an OBJ, and the materials that its faces name.

use std::path::{Path, PathBuf};

use rustc_hash::{FxHashMap, FxHashSet};

use super::builder::Document;
use super::find::{Named, relative, unquote};
use super::images::Pictures;
use super::mtl::{self, Material};
use super::text::{Line, shorten};
use super::uri::UriPolicy;
use crate::error::Result;
use crate::warning::Warnings;

/// Names by which exporters say that faces have no material.
const NO_MATERIAL: [&str; 4] = ["", "(null)", "default", "none"];

/// The materials that were read so far, and the names that were used.
#[derive(Debug, Default)]
pub(super) struct Libraries {
    materials: Vec<Material>,
    /// The number of each by its name; the last of a name counts.
    numbers: FxHashMap<String, usize>,
    files: FxHashSet<PathBuf>,
    is_missing: bool,
    uses: Vec<Use>,
    use_numbers: FxHashMap<(String, Option<usize>), usize>,
}

/// A material as faces name it.
#[derive(Debug)]
struct Use {
    name: String,
    at: String,
    /// The material, if its file was named before.
    material: Option<usize>,
}

impl Libraries {
    /// Takes a `mtllib` line. A file that is not there is a warning.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::error::Error::Invalid) with the line if a name leads outside.
    pub(super) fn take(
        &mut self,
        line: Line<'_>,
        rest: &str,
        uri_policy: UriPolicy<'_>,
        warnings: &mut Warnings,
    ) -> Result<()> {
        for named in library_files(uri_policy, rest) {
            let found = named.find(uri_policy).map_err(|what| line.error(what))?;
            if !self.files.insert(found.path.clone()) {
                continue;
            }
            let name = shorten(&named.file);
            match std::fs::read(&found.path) {
                Ok(bytes) => {
                    if found.is_guess {
                        let path = relative(&found.path, uri_policy.folder);
                        let path = path.unwrap_or_else(|| found.path.display().to_string());
                        let what = format!("{name} is not there: {path} is taken; name it so");
                        warnings.add(line.place(), what);
                    }
                    let base = folder_of(&found.path, uri_policy.folder);
                    for material in mtl::parse(&bytes, &named.file, &base, warnings) {
                        let number = self.materials.len();
                        self.numbers.insert(material.name.clone(), number);
                        self.materials.push(material);
                    }
                }
                Err(error) => {
                    self.is_missing = true;
                    let what = format!(
                        "{name} can't be read ({error}): its materials are plain; put it there"
                    );
                    warnings.add(line.place(), what);
                }
            }
        }
        Ok(())
    }

    /// The number of a use of a material, whose file may be named later.
    pub(super) fn use_of(&mut self, line: Line<'_>, name: &str) -> usize {
        let material = self.numbers.get(name).copied();
        *self.use_numbers.entry((name.to_owned(), material)).or_insert_with(|| {
            self.uses.push(Use { name: name.to_owned(), at: line.place(), material });
            self.uses.len() - 1
        })
    }

    /// The material of each use, put into a document; none where there is none.
    ///
    /// # Errors
    /// As [`Pictures::texture`].
    pub(super) fn add_to(
        &self,
        document: &mut Document,
        pictures: &mut Pictures<'_>,
        is_used: impl Fn(usize) -> bool,
    ) -> Result<Vec<Option<usize>>> {
        let mut added: FxHashMap<usize, usize> = FxHashMap::default();
        let mut materials = vec![None; self.uses.len()];
        for (number, own) in self.uses.iter().enumerate().filter(|(number, _)| is_used(*number)) {
            let Some(material) = own.material.or_else(|| self.numbers.get(&own.name).copied())
            else {
                self.warn_of_undefined(own, &mut document.warnings);
                continue;
            };
            let index = match added.get(&material) {
                Some(index) => *index,
                None => self.materials[material].add_to(document, pictures)?,
            };
            added.insert(material, index);
            materials[number] = Some(index);
        }
        Ok(materials)
    }

    fn warn_of_undefined(&self, own: &Use, warnings: &mut Warnings) {
        let is_none = NO_MATERIAL.iter().any(|none| none.eq_ignore_ascii_case(&own.name));
        // A file that is not there was told of.
        if is_none || self.is_missing {
            return;
        }
        if self.files.is_empty() {
            let what = "materials are used and no file of them is named: all are plain; name it \
                        by `mtllib`";
            warnings.add(&own.at, what);
        } else {
            let name = shorten(&own.name);
            let what = format!("there is no material `{name}`: it is plain; define it in the .mtl");
            warnings.add(&own.at, what);
        }
    }
}

/// The files of a `mtllib` line: one whose name may hold spaces, or several.
pub(super) fn library_files(uri_policy: UriPolicy<'_>, rest: &str) -> Vec<Named> {
    let named = |file: &str| Named { file: unquote(file).to_owned(), ..Named::default() };
    let is_there = |named: &Named| named.find(uri_policy).is_ok_and(|found| found.path.is_file());
    let whole = named(rest);
    if is_there(&whole) {
        return vec![whole];
    }
    let several: Vec<Named> = match rest.contains('"') {
        true => rest.split('"').filter(|file| !file.trim().is_empty()).map(named).collect(),
        false => rest.split_whitespace().map(named).collect(),
    };
    if several.iter().any(is_there) { several } else { vec![whole] }
}

/// The folder of a file, from `folder` if it is in there.
pub(super) fn folder_of(path: &Path, folder: &Path) -> PathBuf {
    let own = path.parent().unwrap_or(Path::new(""));
    own.strip_prefix(folder).unwrap_or(own).to_owned()
}
