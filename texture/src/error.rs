//! Errors: an image or mesh that can't be worked with, or an atlas without room.

/// Errors of this crate, by whose fault it is.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The image or mask handed in can't be worked with.
    #[error("invalid image: {what}")]
    Invalid {
        /// The fault.
        what: String,
    },
    /// The mesh handed in can't be worked with.
    #[error("invalid mesh: {what}")]
    Mesh {
        /// The fault.
        what: String,
    },
    /// An atlas has no room for all charts, however small.
    #[error(
        "{charts} charts do not fit an atlas of {size}×{size} texels with {padding} between them"
    )]
    Full {
        /// Number of charts.
        charts: usize,
        /// Texels along the atlas.
        size: usize,
        /// Texels between charts.
        padding: usize,
    },
}

/// A result of this crate.
pub type Result<T> = std::result::Result<T, Error>;
