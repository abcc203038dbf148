//! A glTF document in memory: read as what it means, and edited.

pub mod accessor;
pub(crate) mod animation;
pub mod asset;
pub(crate) mod edit;
pub(crate) mod extensions;
pub(crate) mod features;
pub(crate) mod instances;
pub(crate) mod known_extensions;
pub(crate) mod material;
pub(crate) mod nodes;
pub(crate) mod poses;
pub mod primitive;
pub(crate) mod prune;
mod quantization;
pub(crate) mod references;
