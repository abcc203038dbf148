//! PNGs as small as they can be without loss, by oxipng: it tries filters and color types, and packs by libdeflate.

use crate::error::{Error, Result};

/// Effort of oxipng, 0…6.
#[cfg(feature = "oxipng")]
const PRESET: u8 = 4;

/// The same picture in fewer bytes, or the file as it was if there are none. All metadata stays, and colors under alpha 0,
/// which filters read.
///
/// # Errors
/// [`Error::Internal`] if the file is damaged; [`Error::Options`] in a build without it.
#[cfg(feature = "oxipng")]
pub(crate) fn pack(png: &[u8]) -> Result<Vec<u8>> {
    let options = oxipng::Options::from_preset(PRESET);
    oxipng::optimize_from_memory(png, &options).map_err(Error::internal)
}

/// The error of a build without it.
#[cfg(not(feature = "oxipng"))]
pub(crate) fn pack(_: &[u8]) -> Result<Vec<u8>> {
    Err(not_built())
}

/// Makes sure that this build has it.
///
/// # Errors
/// [`Error::Options`] that names the feature, if not.
pub(crate) fn check_built() -> Result<()> {
    if cfg!(feature = "oxipng") { Ok(()) } else { Err(not_built()) }
}

fn not_built() -> Error {
    let what = "the smallest PNGs need the feature oxipng, which this program was built without: build it with \
                --features oxipng, which takes a C compiler";
    Error::Options { what: what.to_owned() }
}
