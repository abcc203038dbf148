//! The command line: parse, run, exit.
//!
//! Exit codes: 0 all went well, 1 some inputs failed, 2 nothing could be done.

mod cli;
mod commands;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    if let Some(threads) = cli.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
        if let Err(error) = pool {
            eprintln!("seamwise: {error}");
            return ExitCode::from(2);
        }
    }
    let result = match &cli.command {
        cli::Command::Bake(args) => commands::bake(args, cli.common),
        cli::Command::Repair(args) => commands::repair(args, cli.common),
        cli::Command::Evaluate(args) => commands::evaluate(args, cli.common),
        cli::Command::Select(args) => commands::select(args),
        cli::Command::Inspect(args) => commands::inspect(args, cli.common),
        cli::Command::View(args) => commands::view(args, cli.common),
    };
    match result {
        Ok(0) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::from(1),
        Err(error) => {
            eprintln!("seamwise: {error}");
            ExitCode::from(2)
        }
    }
}
