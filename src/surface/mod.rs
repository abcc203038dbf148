//! The meshes of a document, welded to surfaces of points and wedges.

pub(crate) mod edges;
pub mod geometry;
pub mod group;
mod handedness;
pub(crate) mod tangents;
