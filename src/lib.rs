//! Levels of detail for textured glTF that still look like the original, and atlases that do not
//! bleed.
//!
//! An asset flows one way, each stage taking values and giving values:
//!
//! ```text
//! path → read → Asset → weld → Mesh → chain → [Level] → polish → textures → write → .glb → evaluate → Report
//! ```
//!
//! - [`read`](mod@read) brings a .gltf or .glb into memory, and an .obj, .ply or .off as if it were
//!   one. The document stays whole, so what no stage changes survives.
//! - [`geometry`] welds all triangle primitives of a mesh to one surface of points and wedges;
//!   [`parts`] turns its levels back into primitives.
//! - `seamwise_attr` simplifies that surface by a generalized quadric, with attributes in wedges,
//!   emits every level from one descent, and polishes each: fits it to the source by least squares.
//! - [`atlas`] finds the texels that no chart covers, and `seamwise_texture` fills them.
//! - [`transfer`] makes textures for each level, sampled from the source, and [`dress`] puts them into
//!   documents.
//! - [`seams`] finds the edges where a surface reads two places of an image, to make both equal.
//! - [`levels`] puts levels into documents, as small integers if [`quantize`](mod@quantize) is asked
//!   to; [`output`] makes files of documents, [`write`](mod@write) puts them where they belong.
//! - [`repair`](mod@repair) fills the atlases of a file and leaves the rest as it is.
//! - [`evaluate`] measures how far a level is from its source.
//! - [`report`](mod@report) tells it as JSON, as a table and as a page.
//! - [`bake`](mod@bake) is the straight line through all of them, [`batch`] runs many inputs along it.
//!
//! ```no_run
//! use std::path::Path;
//! use seamwise::bake::{Input, bake};
//! use seamwise::bake::options::BakeOptions;
//! use seamwise::progress::Progress;
//!
//! let input = Input::File(Path::new("helmet.gltf"));
//! let report = bake(input, Path::new("out"), &BakeOptions::default(), &Progress::hidden())?;
//! println!("{}", report.to_table());
//! # Ok::<(), seamwise::error::Error>(())
//! ```

pub mod atlas;
pub mod bake;
pub mod batch;
mod compression;
pub mod document;
pub mod error;
pub mod evaluate;
pub mod export;
pub mod image_file;
pub mod import;
pub mod inspect;
pub mod level;
pub mod limit;
pub mod progress;
pub mod repair;
pub mod report;
pub mod screen;
pub mod surface;
pub mod transfer;
