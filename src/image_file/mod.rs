//! Image files to texels and back, with their metadata.

pub mod codec;
pub mod encoded;
pub(crate) mod exr;
pub(crate) mod ktx2;
pub(crate) mod lossy_webp;
pub(crate) mod metadata;
pub(crate) mod palette;
pub(crate) mod picture;
pub(crate) mod smallest_png;
mod tiff;
