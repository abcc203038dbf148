//! Errors of the tool, by whose fault they are.

use std::path::{Path, PathBuf};
use std::time::Duration;

/// What went wrong, and where.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file can't be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A file is wrong.
    #[error("{at}: {what}")]
    Invalid {
        /// What is wrong.
        what: String,
        /// The place in the file: a JSON pointer in a glTF document, or the file's name.
        at: String,
    },
    /// A file is valid but unsupported: it asks for something that this version can't do.
    #[error("{what} is not supported")]
    Unsupported {
        /// What it asks for.
        what: String,
    },
    /// It took longer than the user allows.
    #[error(
        "it takes longer than the limit of {} s, stopped at the stage `{stage}`; --time-limit allows more",
        limit.as_secs_f64()
    )]
    Time {
        /// What was done last, or would have been next.
        stage: String,
        /// How long it might take.
        limit: Duration,
    },
    /// An option makes no sense.
    #[error("{what}")]
    Options {
        /// Which, and what it would have to be.
        what: String,
    },
    /// A mistake in Seamwise.
    #[error("internal error, please report it: {what}")]
    Internal {
        /// What was found to be impossible.
        what: String,
    },
}

impl Error {
    /// An [`Error::Invalid`].
    pub(crate) fn invalid(at: impl Into<String>, what: impl Into<String>) -> Self {
        Self::Invalid { what: what.into(), at: at.into() }
    }

    /// The same error, with the file it was found in.
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
