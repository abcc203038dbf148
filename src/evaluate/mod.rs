//! How far a candidate is from its reference.

pub mod camera;
mod light;
pub mod luminance;
mod raster;
pub mod render;
pub mod scene;
mod shade;
