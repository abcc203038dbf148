//! Damaged and hostile files. A process of its own: what it holds at most is measured, and must not
//! be what another test takes.

#[path = "../common/mod.rs"]
mod common;

mod hostile_documents;
mod hostile_pictures;
mod robust;
