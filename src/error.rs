//! Errors of the tool, by whose fault they are.

use std::path::{Path, PathBuf};
use std::time::Duration;

/// An error of the tool, and its place.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file can't be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
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

    /// Adds the file that the error was found in.
    pub(crate) fn in_file(self, path: &Path) -> Self {
        let path = path.display();
        match self {
            Self::Invalid { what, at } => Self::Invalid { what, at: format!("{path}: {at}") },
            Self::Unsupported { what } => Self::Unsupported { what: format!("{path}: {what}") },
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

/// A result of the tool.
pub type Result<T> = std::result::Result<T, Error>;
