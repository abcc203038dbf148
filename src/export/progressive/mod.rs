//! Continuous levels as a file: the coarsest level for any reader, and the vertex splits that lead from it
//! to the source, to the bit.
//!
//! [`mod@format`] specifies the extension, so that a reader can be written from it.

mod blocks;
mod decode;
mod document;
mod encode;
pub mod extract;
pub mod format;
mod header;
mod history;
mod observer;
pub(crate) mod part_timeline;
mod parts;
mod recorded;
pub mod refine;
mod script;
mod source;
mod splits;
mod surface;
pub mod timeline;
mod told;
mod values;
mod whole;
pub(crate) mod write;
