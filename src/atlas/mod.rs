//! The texels of an asset's images that its surfaces use, and the repair of all others.

pub mod alpha;
pub mod charts;
pub(crate) mod fill_picture;
mod image;
pub(crate) mod meanings;
mod repair;
pub(crate) mod seams;

pub use image::{Atlas, atlases};
pub use repair::{
    AtlasOptions, ImageRepair, LeftAlone, Repaired, encode_repaired, repair_all, repair_all_with,
};
