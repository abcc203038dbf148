//! Arguments on what an asset names: files, and extensions.

use clap::Args;

/// Arguments for what an asset may name.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct OutsideArgs {
    /// Read files that an asset names outside its own folder: by absolute paths, file URIs or `..`.
    /// Whoever made the asset chose these names, and what they lead to may end up in the output.
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// Go on, with a warning, where a document requires an extension that is not known: it is kept as it
    /// is, and what it says of geometry or textures is not read.
    #[arg(long)]
    pub(crate) allow_unknown: bool,
}
