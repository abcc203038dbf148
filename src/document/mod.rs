//! A glTF document in memory: read as what it means, and edited.

pub mod accessor;
pub mod asset;
pub(crate) mod edit;
pub(crate) mod extensions;
pub(crate) mod instances;
pub mod material;
pub(crate) mod nodes;
pub mod primitive;
pub(crate) mod prune;
mod quantization;
pub(crate) mod references;
