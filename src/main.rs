//! The command line: parse, run, exit.
//!
//! Exit codes: 0 all went well, 1 some inputs failed, 2 nothing could be done.

mod cli;
mod commands;

use std::process::ExitCode;

fn main() -> ExitCode {
    let result =
        cli::parse(std::env::args_os().collect()).map_err(anyhow::Error::from).and_then(run);
    match result {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::from(1),
        Err(error) => {
            eprintln!("seamwise: {error}");
            ExitCode::from(2)
        }
    }
}

/// Does what was typed; tells how many inputs failed.
fn run(cli: cli::Cli) -> anyhow::Result<usize> {
    if let Some(threads) = cli.common.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    }
    if let Some(file) = cli.found_config.filter(|_| !cli.common.quiet) {
        eprintln!("seamwise: options from {}", file.display());
    }
    match &cli.command {
        cli::Command::Bake(args) => commands::bake(args, cli.common),
        cli::Command::Repair(args) => commands::repair(args, cli.common),
        cli::Command::Extract(args) => commands::extract(args, cli.common),
        cli::Command::Refine(args) => commands::refine(args, cli.common),
        cli::Command::Evaluate(args) => commands::evaluate(args, cli.common),
        cli::Command::Select(args) => commands::select(args),
        cli::Command::Inspect(args) => commands::inspect(args, cli.common),
        cli::Command::View(args) => commands::view(args, cli.common),
        cli::Command::Report(args) => commands::report(args),
        cli::Command::Quadrics(args) => commands::quadrics(args, cli.common),
        cli::Command::Completions(args) => commands::completions(args),
        cli::Command::Man(args) => commands::man(args, cli.common),
    }
}
