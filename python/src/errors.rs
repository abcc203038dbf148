//! Errors as exceptions, which the package's `_errors` defines.

use std::path::Path;

use pyo3::prelude::*;
use seamwise::Error;

/// The exception for an error in `file`, with its path and the place in it.
pub(crate) fn raise(py: Python<'_>, error: &Error, file: Option<&Path>) -> PyErr {
    let named = |path: &Path| path.display().to_string();
    let path = match error {
        Error::Io { path, .. } => Some(named(path)),
        Error::Options { .. } | Error::Canceled { .. } => None,
        _ => file.map(named),
    };
    let place = match error {
        Error::Invalid { at, .. } => Some(place_in(at, path.as_deref())),
        _ => None,
    };
    let class = match error {
        Error::Io { .. } => "FileError",
        Error::Invalid { .. } => "InvalidError",
        Error::Kind { .. } | Error::Unsupported { .. } => "UnsupportedError",
        Error::Time { .. } => "TimeLimitError",
        Error::Canceled { .. } => "CanceledError",
        Error::Options { .. } => "OptionsError",
        Error::Internal { .. } => "InternalError",
    };
    let message = match (error.to_string(), &path) {
        (message, Some(path)) if !message.contains(path.as_str()) => format!("{path}: {message}"),
        (message, _) => message,
    };
    exception(py, class, message, path, place)
}

/// The exception for options of a simplification or for arrays that do not fit.
pub(crate) fn refuse(py: Python<'_>, class: &str, what: impl ToString) -> PyErr {
    exception(py, class, what.to_string(), None, None)
}

fn exception(
    py: Python<'_>,
    class: &str,
    message: String,
    path: Option<String>,
    place: Option<String>,
) -> PyErr {
    let make = || py.import("seamwise._errors")?.getattr(class)?.call1((message, path, place));
    make().map_or_else(|error| error, PyErr::from_value)
}

/// A place without the file that it begins with.
fn place_in(at: &str, path: Option<&str>) -> String {
    let rest = path.and_then(|path| at.strip_prefix(path));
    rest.map_or(at, |rest| rest.trim_start_matches([':', ' '])).to_owned()
}
