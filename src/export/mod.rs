//! Levels out: as documents, and documents as files on a disk.

pub(crate) mod bundle;
pub mod certificate;
pub mod disk;
pub mod document;
pub mod files;
pub mod glb;
mod lod_nodes;
mod materials;
pub(crate) mod needle;
pub mod progressive;
mod vertex_pool;
