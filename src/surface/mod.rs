//! The meshes of a document, welded to surfaces of points and wedges.

pub(crate) mod colors;
pub(crate) mod edges;
pub(crate) mod frame;
pub mod geometry;
pub mod group;
mod handedness;
pub mod part;
mod precision;
mod reader;
pub(crate) mod tangents;
