//! What can be wrong with a mesh.

/// Errors of this crate, by whose fault it is.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The mesh handed in is not sound.
    #[error("invalid mesh: {what}")]
    Invalid {
        /// What is wrong and at which element.
        what: String,
    },
    /// An option makes no sense.
    #[error("invalid option: {what}")]
    Options {
        /// Which option, and what it would have to be.
        what: String,
    },
}

/// A result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
