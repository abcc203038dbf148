//! Arguments of `seamwise report`.

use std::path::PathBuf;

use clap::Args;

/// `seamwise report`.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  seamwise report out/*.json -o models.html

A bake of several inputs with --report writes such a page itself, models.html in the folder of its outputs.")]
pub(crate) struct ReportArgs {
    /// The reports of bakes: <stem>.json.
    #[arg(required = true)]
    pub(crate) reports: Vec<PathBuf>,
    /// The page to write. It links to the <stem>.html beside each report, where there is one.
    #[arg(long, short, value_name = "FILE.html")]
    pub(crate) output: PathBuf,
}
