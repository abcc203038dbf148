//! How far a candidate is from its reference.

pub mod appearance;
pub mod camera;
pub mod distance;
mod light;
pub mod luminance;
mod raster;
pub mod render;
pub mod sample;
pub mod scene;
mod shade;
pub mod volume;
