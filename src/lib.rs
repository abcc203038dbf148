//! Levels of detail for textured glTF that still look like the original, and atlases that do not
//! bleed.

pub mod accessor;
pub mod asset;
pub mod error;
pub mod evaluate;
pub mod read;
