//! Files that others name, found as they are meant.
//!
//! A name in a material file starts from that file's folder, by the format's own words, and from the
//! model's in what many programs write; both are looked at in this order. Backslashes are slashes, and
//! quotation marks are none of the name. Where there is no such file, one is taken that is spelled in
//! other cases, or else one of the same last part, for names that are another machine's: guesses, which
//! are told.

use std::path::{Path, PathBuf};

use super::uri::UriPolicy;

/// A file as it is named.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Named {
    pub(super) file: String,
    /// The folder of the file that names it, from the model's; empty if it is the model that does.
    pub(super) base: PathBuf,
    /// Where it is named.
    pub(super) at: String,
}

/// Where a file is, which may be not there.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) path: PathBuf,
    /// Whether it is another than the one that is named.
    pub(super) is_guess: bool,
}

impl Named {
    /// The file in the folder or below. Says what is wrong with a name that leads outside.
    pub(super) fn find(&self, uri_policy: UriPolicy<'_>) -> Result<Found, String> {
        let name = unquote(&self.file).replace('\\', "/");
        let last = name.rsplit('/').next().unwrap_or_default();
        let places = |name: &str| {
            let beside = (!self.base.as_os_str().is_empty() && !name.starts_with('/'))
                .then(|| format!("{}/{name}", self.base.display()));
            let names = beside.into_iter().chain([name.to_owned()]);
            names.map(|name| uri_policy.file(&name)).collect::<Vec<_>>()
        };
        let [named, last] = [places(&name), places(last)];
        let exact = |places: &[Result<PathBuf, String>]| {
            places.iter().flatten().find(|path| path.is_file()).cloned()
        };
        let spelled = |places: &[Result<PathBuf, String>]| {
            places.iter().flatten().find_map(|path| in_other_cases(path, uri_policy.folder))
        };
        if let Some(path) = exact(&named) {
            return Ok(Found { path, is_guess: false });
        }
        if let Some(path) = spelled(&named).or_else(|| exact(&last)).or_else(|| spelled(&last)) {
            return Ok(Found { path, is_guess: true });
        }
        let missing = |path| Found { path, is_guess: false };
        named.into_iter().reduce(Result::or).unwrap_or(Err(name)).map(missing)
    }
}

/// A name without quotation marks around.
pub(super) fn unquote(name: &str) -> &str {
    let name = name.trim();
    let inside = |mark: char| name.strip_prefix(mark)?.strip_suffix(mark);
    inside('"').or_else(|| inside('\'')).unwrap_or(name)
}

/// A path as others call it: from `folder`, with slashes, if it is in there.
pub(super) fn relative(path: &Path, folder: &Path) -> Option<String> {
    let parts = path.strip_prefix(folder).ok()?.iter();
    Some(parts.map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/"))
}

/// A file below `folder` whose path differs in cases alone; the first by name of several.
fn in_other_cases(path: &Path, folder: &Path) -> Option<PathBuf> {
    let mut found = folder.to_owned();
    for part in path.strip_prefix(folder).ok()? {
        let exact = found.join(part);
        if exact.exists() {
            found = exact;
            continue;
        }
        let wanted = part.to_str()?.to_lowercase();
        let here = if found.as_os_str().is_empty() { Path::new(".") } else { &found };
        let names = std::fs::read_dir(here).ok()?.flatten().map(|entry| entry.file_name());
        let is_same = |name: &std::ffi::OsString| {
            name.to_str().is_some_and(|name| name.to_lowercase() == wanted)
        };
        found = found.join(names.filter(is_same).min()?);
    }
    found.is_file().then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_found_as_it_is_meant_and_guesses_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let policy = UriPolicy { folder: folder.path(), allow_outside: false };
        std::fs::create_dir_all(folder.path().join("materials/Images")).unwrap();
        for file in ["a.png", "materials/a.png", "materials/Images/B c.png", "d.PNG"] {
            std::fs::write(folder.path().join(file), file).unwrap();
        }
        let find = |file: &str, base: &str| {
            let named = Named { file: file.into(), base: base.into(), at: String::new() };
            named
                .find(policy)
                .map(|found| (relative(&found.path, folder.path()).unwrap(), found.is_guess))
        };
        for (file, base, found, is_guess) in [
            ("a.png", "", "a.png", false),
            ("a.png", "materials", "materials/a.png", false),
            ("../a.png", "materials", "a.png", false),
            ("d.PNG", "materials", "d.PNG", false),
            ("\"Images\\B c.png\"", "materials", "materials/Images/B c.png", false),
            ("images/b C.png", "materials", "materials/Images/B c.png", true),
            ("d.png", "materials", "d.PNG", true),
            ("C:\\work\\A.png", "", "a.png", true),
            ("e.png", "materials", "materials/e.png", false),
        ] {
            assert_eq!(find(file, base), Ok((found.to_owned(), is_guess)), "{file}");
        }
        for outside in ["../none.png", "C:\\none.png", "/etc/none"] {
            assert!(find(outside, "").unwrap_err().contains("--allow-outside"), "{outside}");
        }
        assert!(find("../../none.png", "materials").is_err());
    }
}
