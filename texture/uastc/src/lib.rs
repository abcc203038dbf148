//! Images as blocks of UASTC: 4 × 4 texels in 16 bytes, which a graphics processor reads as BC7 or ASTC
//! after a quick transcoding (Binomial, "UASTC LDR 4x4 Texture Specification").
//!
//! The encoder is that of Basis Universal, in C++. Its wrapper calls the functions unsafe that run it, since it
//! tests none of its parameters; this crate tests them and has no other purpose. Each block is found from its own
//! 16 texels alone, so an image may be cut between rows of blocks; strips are encoded in parallel.
//!
//! Guaranteed: the same bytes at any number of threads. Not guaranteed: the same on another machine, since the encoder
//! computes in floats.

use basis_universal::{BasisTextureFormat, ColorSpace, Compressor, CompressorParams, sys};
use rayon::prelude::*;

/// Texels along each side of a block.
pub const BLOCK_SIDE: usize = 4;
/// Bytes of a block.
pub const BLOCK_BYTES: usize = 16;

/// Rows of blocks that are encoded at once: enough of them to keep many threads busy, large enough that what a
/// run of the encoder sets up does not count.
const STRIP_ROWS: usize = 16;
/// The most texels along a side that the encoder takes.
const MAX_SIDE: usize = 16384;
/// Effort of the encoder.
///
/// A block also holds hints for a transcoding to ETC1, which old phones alone need. They have no part in what BC7 and ASTC
/// show, and took two thirds of the time: the fewest are tried. Then, on a scan's color, a helmet's and its normals,
/// PSNR in dB and seconds per million texels on one thread: fastest 48.7, 51.0, 40.3 and 0.23; **faster 51.8, 51.3, 42.9 and
/// 1.14**; default 52.2, 51.9, 43.0 and 2.06.
const EFFORT: sys::UastcPackFlags = sys::UastcPackFlags_PackUASTCLevelFaster
    | sys::UastcPackFlags_PackUASTCETC1FastestHints
    | sys::UastcPackFlags_PackUASTCETC1DisableFlipAndIndividual;

/// An error of the encoding.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The image is not one.
    #[error("{bytes} bytes for {width} × {height} texels of four channels, 1 to 16384 a side")]
    Size {
        /// Width in texels.
        width: usize,
        /// Height in texels.
        height: usize,
        /// Bytes of the texels.
        bytes: usize,
    },
    /// The encoder refused it.
    #[error("the encoder of Basis Universal failed: {0}")]
    Encoder(String),
}

/// The blocks of an image, row after row; `texels`: red, green, blue and alpha of each texel, 8 bits each, row after
/// row. Blocks at the right and the bottom of a size that is no multiple of four repeat the last texels.
///
/// # Errors
/// [`Error::Size`] if `texels` has another length than the size, or a side is 0 or above 16384;
/// [`Error::Encoder`] if the encoder fails.
pub fn encode(texels: &[u8], width: usize, height: usize) -> Result<Vec<u8>, Error> {
    let is_side = |side: usize| (1..=MAX_SIDE).contains(&side);
    if !is_side(width) || !is_side(height) || texels.len() != width * height * 4 {
        return Err(Error::Size { width, height, bytes: texels.len() });
    }
    let strips = texels.par_chunks(width * 4 * STRIP_ROWS * BLOCK_SIDE);
    let strips: Vec<Vec<u8>> =
        strips.map(|strip| encode_strip(strip, width)).collect::<Result<_, Error>>()?;
    Ok(strips.concat())
}

/// The blocks of a part of an image.
fn encode_strip(texels: &[u8], width: usize) -> Result<Vec<u8>, Error> {
    let height = texels.len() / (4 * width);
    let mut params = CompressorParams::new();
    params.set_basis_format(BasisTextureFormat::UASTC4x4);
    set_effort(&mut params);
    // All channels count alike.
    params.set_color_space(ColorSpace::Linear);
    params.set_generate_mipmaps(false);
    params.source_image_mut(0).init(texels, width as u32, height as u32, 4);
    let mut compressor = Compressor::new(1);
    run(&mut compressor, &params)?;
    let blocks = width.div_ceil(BLOCK_SIDE) * height.div_ceil(BLOCK_SIDE);
    let file = compressor.basis_file();
    let slice = first_slice(file).filter(|slice| slice.len() == blocks * BLOCK_BYTES);
    slice.map(<[u8]>::to_vec).ok_or_else(|| Error::Encoder("its file has no blocks".to_owned()))
}

#[expect(
    unsafe_code,
    reason = "the wrapper sets a level alone, and adds it to the one that is set"
)]
fn set_effort(params: &mut CompressorParams) {
    // SAFETY: the pointer is that of parameters which live, and the flags are of the encoder's own.
    unsafe { sys::compressor_params_set_pack_uastc_flags(params.0, EFFORT) };
}

#[expect(unsafe_code, reason = "the wrapper's only way to run its encoder")]
fn run(compressor: &mut Compressor, params: &CompressorParams) -> Result<(), Error> {
    // SAFETY: the parameters are the wrapper's defaults, a format and an effort of its own constants, and one image
    // that was tested: of 4 × width × height bytes, each side within what the encoder takes.
    let is_ready = unsafe { compressor.init(params) };
    if !is_ready {
        return Err(Error::Encoder("it takes no such image".to_owned()));
    }
    // SAFETY: it has just been given parameters that it took.
    let done = unsafe { compressor.process() };
    done.map_err(|code| Error::Encoder(format!("{code:?}")))
}

/// The data of the first slice of a .basis file: the offset of the list of slices stands in its header at byte 65, and
/// offset and length of a slice's data 13 bytes into its entry (`basisu_file_headers.h`).
fn first_slice(file: &[u8]) -> Option<&[u8]> {
    let number = |at: usize| {
        let bytes = file.get(at..)?.first_chunk()?;
        usize::try_from(u32::from_le_bytes(*bytes)).ok()
    };
    let entry = number(65)?;
    let (start, length) = (number(entry + 13)?, number(entry + 17)?);
    file.get(start..start.checked_add(length)?)
}
