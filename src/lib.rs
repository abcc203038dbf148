//! Levels of detail for textured glTF that still look like the original, and atlases that do not
//! bleed.

pub mod accessor;
pub mod asset;
pub mod error;
pub mod evaluate;
pub mod geometry;
pub mod levels;
mod pack;
pub mod primitive;
pub mod read;
pub mod write;
