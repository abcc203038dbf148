//! The files that an asset may name: those in its own folder and below, unless the user allows
//! more.
//!
//! Whoever sends an asset chooses the names in it. Without a bound, one could have any file that the
//! user may read put into a texture, or name a device that never ends. So a name is judged as it is
//! written, before anything is opened: it may be neither absolute, of this system or of Windows, nor
//! climb above the folder by `..`, whichever way its slashes lean. Percent signs are decoded before.
//!
//! Not guarded against: links. One that lies in the folder was put there by whoever unpacked it, and
//! is followed wherever it leads.

use std::path::{Path, PathBuf};

use super::data_uri::DataUri;
use crate::error::Error;
use crate::warning::Warnings;

/// The policy on the files that an asset names.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UriPolicy<'a> {
    /// The asset's folder, which names start from.
    pub(crate) folder: &'a Path,
    /// Whether a name may lead out of it.
    pub(crate) allow_outside: bool,
}

impl UriPolicy<'_> {
    /// The file of a name; says what is wrong with one that leads outside.
    pub(crate) fn file(self, name: &str) -> Result<PathBuf, String> {
        if self.allow_outside {
            return Ok(self.folder.join(name));
        }
        if leads_outside(name) {
            return Err(refusal(name));
        }
        // As it was judged: `a/../b` is `b`, wherever a link `a` would lead.
        let mut path = PathBuf::new();
        for part in name.split('/') {
            match part {
                "" | "." => {}
                ".." => drop(path.pop()),
                part => path.push(part),
            }
        }
        Ok(self.folder.join(path))
    }

    /// The file of a name with slashes for its backslashes, if that is there and `path`, that of the name
    /// as it is, is not.
    fn with_slashes(self, name: &str, path: &Path) -> Option<PathBuf> {
        let other = name.contains('\\').then(|| self.file(&name.replace('\\', "/")))?.ok()?;
        (!path.exists() && other.exists()).then_some(other)
    }

    /// The file of a URI with the scheme `file`, which is always absolute; `rest` follows the scheme.
    pub(crate) fn absolute(self, uri: &str, rest: &str) -> Result<PathBuf, String> {
        if !self.allow_outside {
            return Err(refusal(uri));
        }
        let path = rest.strip_prefix("//").unwrap_or(rest);
        let path = path.strip_prefix("localhost").unwrap_or(path);
        if path.starts_with('/') { Ok(path.into()) } else { Err(format!("{uri} is no local file")) }
    }
}

/// The message about a name that leads outside.
fn refusal(name: &str) -> String {
    let name: String = name.chars().take(200).collect();
    format!("{name} is outside the asset's folder; --allow-outside allows that")
}

/// Whether a name is absolute or climbs above where it starts, on this system or any other.
fn leads_outside(name: &str) -> bool {
    let slash = |c: char| c == '/' || c == '\\';
    let has_drive = |part: &str| {
        let mut chars = part.chars();
        chars.next().is_some_and(|first| first.is_ascii_alphabetic()) && chars.next() == Some(':')
    };
    let mut depth = 0usize;
    for part in name.split(slash) {
        match part {
            "" | "." => {}
            ".." => match depth.checked_sub(1) {
                Some(above) => depth = above,
                None => return true,
            },
            part if has_drive(part) => return true,
            _ => depth += 1,
        }
    }
    name.starts_with(slash)
}

/// The resource that a URI names.
pub(crate) enum Resource {
    /// Bytes in the URI itself.
    Data(Vec<u8>),
    /// A file that the asset may name.
    File(PathBuf),
}

impl Resource {
    /// The resource that the URI of the object at `at` names. Warns of what is read as if it were right.
    pub(crate) fn of(
        uri: &str,
        at: &str,
        uri_policy: UriPolicy<'_>,
        warnings: &mut Warnings,
    ) -> Result<Self, Error> {
        let at = || format!("{at}/uri");
        if let Some(data) = uri.strip_prefix("data:") {
            let DataUri { bytes, mended } =
                DataUri::read(data).map_err(|what| Error::invalid(at(), what))?;
            mended.into_iter().for_each(|what| warnings.add(at(), what));
            return Ok(Self::Data(bytes));
        }
        let name = percent_encoding::percent_decode_str(uri)
            .decode_utf8()
            .map_err(|_| Error::invalid(at(), "its file name is not UTF-8"))?;
        let path = match name.split_once(':') {
            Some((scheme, rest)) if scheme.eq_ignore_ascii_case("file") => {
                uri_policy.absolute(&name, rest)
            }
            Some((_, rest)) if rest.starts_with("//") => {
                return Err(Error::Unsupported { what: format!("{}: fetching {uri}", at()) });
            }
            _ => uri_policy.file(&name).map(|path| match uri_policy.with_slashes(&name, &path) {
                Some(other) => {
                    let what = "its backslashes are taken for slashes; write slashes";
                    warnings.add(at(), what);
                    other
                }
                None => path,
            }),
        };
        path.map(Self::File).map_err(|what| Error::invalid(at(), what))
    }

    /// Whether it is a file that is certainly not there.
    pub(crate) fn is_missing(&self) -> bool {
        matches!(self, Self::File(path) if path.try_exists().is_ok_and(|exists| !exists))
    }

    /// Its bytes; `at` is the object that names it.
    pub(crate) fn read(self, at: &str) -> Result<Vec<u8>, Error> {
        let path = match self {
            Self::Data(bytes) => return Ok(bytes),
            Self::File(path) => path,
        };
        let fault = |error| format!("{} can't be read: {error}", path.display());
        std::fs::read(&path).map_err(|error| Error::invalid(format!("{at}/uri"), fault(error)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str, allow_outside: bool) -> Result<PathBuf, String> {
        UriPolicy { folder: Path::new("/assets/ship"), allow_outside }.file(name)
    }

    #[test]
    fn a_name_inside_is_found_where_it_says() {
        for (name, path) in [
            ("a.png", "a.png"),
            ("./textures//a b.png", "textures/a b.png"),
            ("textures/../a.png", "a.png"),
            ("a..b/..c/...", "a..b/..c/..."),
            ("x:y/1:2.png", ""),
            ("ab:c.png", "ab:c.png"),
        ] {
            match file(name, false) {
                Ok(found) => assert_eq!(found, Path::new("/assets/ship").join(path)),
                Err(_) => assert!(path.is_empty(), "{name}"),
            }
        }
    }

    #[test]
    fn a_name_that_leads_outside_is_refused_unless_it_is_allowed() {
        for name in [
            "/etc/passwd",
            "//server/share/a.png",
            "..",
            "../a.png",
            "textures/../../a.png",
            "./../ship/a.png",
            "..\\a.png",
            "textures\\..\\..\\a.png",
            "textures/..\\../a.png",
            "\\\\server\\share\\a.png",
            "C:\\a.png",
            "c:/a.png",
            "c:a.png",
            "./c:a.png",
        ] {
            let error = file(name, false).expect_err(name);
            assert!(error.contains(name) && error.contains("--allow-outside"), "{error}");
            assert_eq!(file(name, true), Ok(Path::new("/assets/ship").join(name)));
        }
    }

    #[test]
    fn a_file_uri_is_absolute() {
        let absolute = |rest: &str, allow_outside| {
            UriPolicy { folder: Path::new(""), allow_outside }.absolute("file:…", rest)
        };
        for rest in ["/etc/passwd", "///etc/passwd", "//localhost/etc/passwd"] {
            assert!(absolute(rest, false).is_err());
            assert_eq!(absolute(rest, true), Ok("/etc/passwd".into()));
        }
        assert!(absolute("//server/a.png", true).is_err_and(|what| what.contains("local")));
    }
}
