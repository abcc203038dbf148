//! Levels of detail for textured glTF that still look like the original, and atlases that do not
//! bleed.
//!
//! An asset flows one way, each stage taking values and giving values:
//!
//! ```text
//! path → read → Asset → weld → Mesh → chain → [Level] → polish → textures → write → .glb → evaluate → Report
//! ```
//!
//! The modules, from top to bottom. A file imports only from what stands below it, and no files
//! import each other in a circle; a test reads this list and holds both:
//!
//! - `commands` does what each subcommand of the binary is for.
//! - `cli` is what the user typed.
//! - [`batch`] runs many inputs along a bake.
//! - [`bake`](mod@bake) is the straight line through all that stand below it, with its options.
//! - [`repair`] fills the atlases of a file and leaves the rest as it is.
//! - [`inspect`](mod@inspect) tells what is in a file, and shows the quadrics of a surface's points as
//!   ellipsoids ([`inspect::quadrics`]).
//! - [`report`] tells what was done as JSON, as a table and as a page.
//! - [`export`] makes documents of levels and files of documents, and puts these where they belong; and all
//!   levels between the coarsest and the source one file, of which it reads any ([`export::progressive`]).
//! - [`transfer`] makes textures for each level, sampled from the source.
//! - [`level`] turns a simplified surface back into primitives, as small integers if it is asked to.
//! - [`evaluate`] measures how far a level is from its source.
//! - [`atlas`] finds the texels that no chart covers, and the seams where a surface reads two places
//!   of an image. `seamwise_texture` fills the texels, and makes both sides of a seam equal.
//! - [`surface`] welds all triangle primitives of a mesh to one surface of points and wedges.
//!   `seamwise_attr` simplifies it by a generalized quadric, with attributes in wedges, emits every
//!   level from one descent, and polishes each: fits it to the source by least squares.
//! - [`import`] brings a .gltf or .glb into memory, and an .obj, .ply or .off as if it were one. The
//!   document stays whole, so what no stage changes survives.
//! - `compression` makes compressed geometry plain, and plain geometry small.
//! - [`document`] is a glTF in memory: read as what it means, and edited.
//! - [`image_file`] turns image files into texels and back, with what else they hold.
//! - [`screen`] is the law of sizes: how large a level may be shown.
//! - [`progress`] tells how far a stage is, and ends what takes too long.
//! - [`limit`] bounds the memory that an input may ask for.
//! - [`warning`] tells what was left out, guessed or mended.
//! - [`error`] tells whose fault it was.
//!
//! # As a library
//!
//! Bytes to bytes is [`bake_bytes`], a file to files [`bake`](fn@bake::bake); [`evaluate::compare_assets`]
//! measures levels from any tool; [`attr::simplify`] takes arrays of your own, and [`texture`] images.
//!
//! ```no_run
//! use std::path::Path;
//! use seamwise::bake::{Input, bake};
//! use seamwise::{BakeOptions, progress::Progress};
//!
//! let input = Input::File(Path::new("helmet.gltf"));
//! let report = bake(input, Path::new("out"), &BakeOptions::default(), &Progress::hidden())?;
//! println!("{}", report.to_text(80));
//! # Ok::<(), seamwise::Error>(())
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
pub mod warning;

pub use bake::options::BakeOptions;
pub use bake::{Baked, BakedFile, bake_bytes, bake_in_memory};
pub use error::{Error, Result};

pub use glam;
pub use image;
pub use seamwise_attr as attr;
pub use seamwise_texture as texture;
