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
    #[command(flatten)]
    outside: OutsideArgs,
}

impl ReadingArgs {
    /// The options that these arguments give.
    pub(crate) fn resolve(&self, common: Common) -> ReadOptions {
        let Common { memory_limit, strict, .. } = common;
        let (allow_missing, OutsideArgs { allow_outside, allow_unknown }) =
            (self.allow_missing, self.outside);
        ReadOptions { memory_limit, allow_missing, allow_outside, allow_unknown, strict }
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
