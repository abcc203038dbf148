//! Images over a surface. Knows no files.

pub mod color;
mod error;
mod mips;
mod plane;
mod wrap;

pub use error::{Error, Result};
pub use mips::{Encoding, Level, Mips};
pub use plane::Plane;
pub use wrap::Wrap;
