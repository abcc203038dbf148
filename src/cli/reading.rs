//! Arguments for reading assets, and for what an asset may name.

use clap::Args;

use seamwise::import::options::ReadOptions;

use super::common::Common;

/// Arguments for reading assets.
#[derive(Debug, Args)]
#[command(next_help_heading = "Reading")]
pub(crate) struct ReadingArgs {
    /// Go on, with a warning, without image files that are not there.
    ///
    /// Their textures are measured as white, or flat for normals. What is written still names them, to be put beside it. Without an
    /// .mtl an .obj is read anyway, as plain.
    #[arg(long)]
    allow_missing: bool,
    /// Give surfaces without normals some: smooth, but for creases where faces bend by more than so many degrees.
    ///
    /// Scans in .off, .ply and .obj often come without; they are shown flat otherwise.
    #[arg(long, value_name = "DEGREES", num_args = 0..=1, require_equals = true, default_missing_value = "45", value_parser = clap::value_parser!(u8).range(0..=180))]
    smooth_normals: Option<u8>,
    #[command(flatten)]
    outside: OutsideArgs,
}

impl ReadingArgs {
    /// The options that these arguments give.
    pub(crate) fn resolve(&self, common: Common) -> ReadOptions {
        let Common { memory_limit, strict, .. } = common;
        let (allow_missing, OutsideArgs { allow_outside, allow_unknown }) =
            (self.allow_missing, self.outside);
        ReadOptions {
            memory_limit,
            allow_missing,
            allow_outside,
            allow_unknown,
            strict,
            smooth_normals: self.smooth_normals,
        }
    }
}

/// Arguments for what an asset may name.
#[derive(Clone, Copy, Debug, Args)]
#[command(next_help_heading = "Reading")]
pub(crate) struct OutsideArgs {
    /// Read files that an asset names outside its own folder: by absolute paths, file URIs or `..`.
    ///
    /// Whoever made the asset chose these names, and what they lead to may end up in the output.
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// Go on, with a warning, where a document requires an extension that is not known.
    ///
    /// It is kept as it is, and what it says of geometry or textures is not read.
    #[arg(long)]
    pub(crate) allow_unknown: bool,
}
