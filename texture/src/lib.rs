//! Images over a surface. Knows no files.

mod background;
pub mod color;
mod coverage;
mod error;
mod kernel;
mod mips;
mod plane;
mod pyramid;
mod raster;
mod reads;
mod validity;
mod wrap;

pub use background::detect_background;
pub use error::{Error, Result};
pub use mips::Mips;
pub use plane::Plane;
pub use pyramid::{Part, fill_holes};
pub use raster::{Texel, UvTriangle, Window, to_texels};
pub use reads::{MipReads, count_reads};
pub use validity::Validity;
pub use wrap::Wrap;
