//! Errors of the tool, by whose fault they are.

use std::path::{Path, PathBuf};
use std::time::Duration;

/// An error of the tool, and its place.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file can't be read or written.
    #[error("{}: {}", path.display(), plain(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file is of a kind that can't be read or written here.
    #[error("{what}")]
    Kind {
        /// The kind, and what to do.
        what: String,
    },
    /// A file is wrong.
    #[error("{at}: {what}")]
    Invalid {
        /// The fault.
        what: String,
        /// The place in the file: a JSON pointer in a glTF document, or the file's name.
        at: String,
    },
    /// A file is valid but unsupported: it asks for something that this version can't do.
    #[error("{what} is not supported")]
    Unsupported {
        /// The feature that it asks for.
        what: String,
    },
    /// The work took longer than the user allows.
    #[error(
        "it takes longer than the limit of {} s, stopped at the stage `{stage}`; --time-limit allows more",
        limit.as_secs_f64()
    )]
    Time {
        /// The stage that was done last, or would have been next.
        stage: String,
        /// The time limit.
        limit: Duration,
    },
    /// Whoever watches the progress ended the run: see
    /// [`Display::is_canceled`](crate::progress::Display::is_canceled).
    #[error("it was ended at the stage `{stage}`")]
    Canceled {
        /// The stage that was done last, or would have been next.
        stage: String,
    },
    /// An option makes no sense.
    #[error("{what}")]
    Options {
        /// The option, and what it would have to be.
        what: String,
    },
    /// A mistake in Seamwise.
    #[error("internal error, please report it: {what}")]
    Internal {
        /// The state that should be impossible.
        what: String,
    },
}

impl Error {
    /// An [`Error::Invalid`].
    pub(crate) fn invalid(at: impl Into<String>, what: impl Into<String>) -> Self {
        Self::Invalid { what: what.into(), at: at.into() }
    }

    /// Adds the file that the error was found in, unless it names one already.
    #[must_use]
    pub fn in_file(self, path: &Path) -> Self {
        let path = path.display();
        match self {
            Self::Invalid { what, at } => Self::Invalid { what, at: format!("{path}: {at}") },
            Self::Unsupported { what } => Self::Unsupported { what: format!("{path}: {what}") },
            Self::Kind { what } => Self::Kind { what: format!("{path}: {what}") },
            Self::Options { what } => Self::Options { what: format!("{path}: {what}") },
            other => other,
        }
    }

    /// An [`Error::Internal`].
    #[allow(clippy::needless_pass_by_value, reason = "so that map_err takes it by its name")]
    pub(crate) fn internal(what: impl ToString) -> Self {
        Self::Internal { what: what.to_string() }
    }

    /// An [`Error::Io`].
    pub(crate) fn io(path: impl Into<PathBuf>, source: std::io::Error) -> Self {
        Self::Io { path: path.into(), source }
    }
}

/// The reason why a file can't be read or written in plain words: no number, and no other name.
fn plain(error: &std::io::Error) -> String {
    use std::io::ErrorKind;
    let known = match error.kind() {
        ErrorKind::NotFound => "there is no such file or folder",
        ErrorKind::PermissionDenied => "permission denied",
        ErrorKind::IsADirectory => "it is a folder, not a file",
        ErrorKind::NotADirectory => "a part of its path is a file, not a folder",
        ErrorKind::AlreadyExists => "there is a file of that name already",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "the disk is full",
        ErrorKind::ReadOnlyFilesystem => "the disk may only be read",
        ErrorKind::InvalidFilename => "its name is too long, or has signs that no file may have",
        _ => "",
    };
    if !known.is_empty() {
        return known.to_owned();
    }
    let text = error.to_string();
    let text = text.split(" at path ").next().unwrap_or_default();
    text.split(" (os error").next().unwrap_or_default().to_owned()
}

/// A result of the tool.
pub type Result<T> = std::result::Result<T, Error>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_system_is_quoted_without_its_numbers_and_without_other_names() {
        let said = |error: std::io::Error| Error::io("a.glb", error).to_string();
        assert_eq!(
            said(std::io::Error::from_raw_os_error(2)),
            "a.glb: there is no such file or folder"
        );
        // Too many open files.
        let many = said(std::io::Error::from_raw_os_error(24));
        assert!(many.starts_with("a.glb: ") && !many.contains("os error"), "{many}");
        let wrapped = std::io::Error::other("Odd (os error 99) at path \"/tmp/.seamwise-1.tmp\"");
        assert_eq!(said(wrapped), "a.glb: Odd");
    }

    #[test]
    fn a_file_is_named_once() {
        let path = Path::new("a.glb");
        let missing = Error::io("a.glb", std::io::Error::from_raw_os_error(2)).in_file(path);
        assert_eq!(missing.to_string().matches("a.glb").count(), 1);
        let kind = Error::Kind { what: "an FBX file".into() }.in_file(path);
        assert_eq!(kind.to_string(), "a.glb: an FBX file");
    }
}
