//! Images over a surface. Knows no files.

pub mod color;
mod error;
mod mips;
mod plane;
mod raster;
mod wrap;

pub use error::{Error, Result};
pub use mips::Mips;
pub use plane::Plane;
pub use raster::{Texel, UvTriangle, Window, to_texels};
pub use wrap::Wrap;
