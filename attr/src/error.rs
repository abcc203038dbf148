//! Errors: a mesh that is not sound, or an option that makes no sense.

/// Errors of this crate, by whose fault it is.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The mesh handed in is not sound.
    #[error("invalid mesh: {what}")]
    Invalid {
        /// The fault, and at which element.
        what: String,
    },
    /// An option makes no sense.
    #[error("invalid option: {what}")]
    Options {
        /// The option, and what it would have to be.
        what: String,
    },
}

/// A result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
