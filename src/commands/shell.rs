//! Completions and man pages, made of the command line itself.

use std::path::PathBuf;

use anyhow::Result;
use clap_mangen::Man;

use seamwise::export::disk::write_files;

use super::console::say;
use crate::cli::{Common, CompletionsArgs, ManArgs, command};

/// Prints completions.
pub(crate) fn completions(args: &CompletionsArgs) -> Result<usize> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut command(), "seamwise", &mut text);
    say(false, &String::from_utf8_lossy(&text))?;
    Ok(0)
}

/// Writes a page for the tool and one for each subcommand.
pub(crate) fn man(args: &ManArgs, common: Common) -> Result<usize> {
    let mut whole = command().disable_help_subcommand(true);
    whole.build();
    let mut files: Vec<(PathBuf, Vec<u8>)> = Vec::new();
    for page in std::iter::once(&whole).chain(whole.get_subcommands()) {
        let man = Man::new(page.clone());
        let mut text = Vec::new();
        man.render(&mut text)?;
        files.push((args.output.join(man.get_filename()), text));
    }
    write_files(&files)?;
    let names: Vec<String> =
        files.iter().map(|(path, _)| format!("{}\n", path.display())).collect();
    say(common.quiet, &names.concat())?;
    Ok(0)
}
