//! Arguments that all subcommands share.

use clap::Args;
use seamwise::limit::MemoryLimit;

/// What all jobs share.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct Common {
    /// Say nothing but errors.
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// Take warnings for errors: whatever would be left out, guessed or mended refuses the input, and
    /// nothing is written.
    #[arg(long, global = true)]
    pub(crate) strict: bool,
    /// Most memory, as 512MiB or 8GB, that each of these may take: decoding one image; all buffers and
    /// image files; all decompressed geometry; all vertices, and all of the scene with its instances.
    /// A small file can claim any size.
    #[arg(long, global = true, default_value_t, value_name = "SIZE")]
    pub(crate) memory_limit: MemoryLimit,
}
