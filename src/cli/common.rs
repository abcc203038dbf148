//! Arguments that all subcommands share.

use clap::Args;
use seamwise::limit::MemoryLimit;

/// What all jobs share.
#[derive(Clone, Copy, Debug, Args)]
#[command(next_help_heading = "General")]
pub(crate) struct Common {
    /// Say nothing but errors.
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// Threads to use; all cores if not given.
    #[arg(long, global = true, value_name = "N")]
    pub(crate) threads: Option<usize>,
    /// Take warnings for errors.
    ///
    /// Whatever would be left out, guessed or mended refuses the input, and nothing is written.
    #[arg(long, global = true)]
    pub(crate) strict: bool,
    /// Most memory that an input may claim of each kind, as 512MiB or 8GB.
    ///
    /// Each of these may take as much: decoding one image; all buffers and image files; all decompressed
    /// geometry; all vertices, and all of the scene with its instances. A small file can claim any size.
    #[arg(long, global = true, default_value_t, value_name = "SIZE")]
    pub(crate) memory_limit: MemoryLimit,
}
