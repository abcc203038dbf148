//! Arguments of `seamwise completions` and `seamwise man`.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

/// `seamwise completions`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: seamwise completions bash > ~/.local/share/bash-completion/completions/seamwise"
)]
pub(crate) struct CompletionsArgs {
    /// The shell.
    pub(crate) shell: Shell,
}

/// `seamwise man`.
#[derive(Debug, Args)]
#[command(after_help = "Example: seamwise man -o ~/.local/share/man/man1")]
pub(crate) struct ManArgs {
    /// The folder to write seamwise.1, seamwise-bake.1 and so on into.
    #[arg(long, short, value_name = "DIR")]
    pub(crate) output: PathBuf,
}
