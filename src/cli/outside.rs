//! Arguments on the files that an asset names.

use clap::Args;

/// Arguments for the files that an asset may name.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct OutsideArgs {
    /// Read files that an asset names outside its own folder: by absolute paths, file URIs or `..`.
    /// Whoever made the asset chose these names, and what they lead to may end up in the output.
    #[arg(long)]
    pub(crate) allow_outside: bool,
}
