//! What can be wrong with an image.

/// Errors of this crate, by whose fault it is.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The image or mask handed in can't be worked with.
    #[error("invalid image: {what}")]
    Invalid {
        /// What is wrong.
        what: String,
    },
}

/// A result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
