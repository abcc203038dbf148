//! The command line as the user typed it. No work is done here.

mod bake;
mod batch;
mod camera;
mod common;
mod config;
mod evaluate;
mod extract;
mod goals;
mod look;
mod output;
mod place;
mod quadrics;
mod reading;
mod refine;
mod repair;
mod report;
mod shell;
mod steering;
mod textures;
mod view;

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

pub(crate) use bake::{BakeArgs, Source, Target, is_dash};
pub(crate) use common::Common;
pub(crate) use evaluate::EvaluateArgs;
pub(crate) use extract::ExtractArgs;
pub(crate) use look::{InspectArgs, SelectArgs};
pub(crate) use quadrics::QuadricsArgs;
pub(crate) use reading::ReadingArgs;
pub(crate) use refine::RefineArgs;
pub(crate) use repair::RepairArgs;
pub(crate) use report::ReportArgs;
pub(crate) use shell::{CompletionsArgs, ManArgs};
pub(crate) use view::ViewArgs;

/// Levels of detail for textured glTF that still look like the original, and atlases that do not
/// bleed.
#[derive(Debug, Parser)]
#[command(name = "seamwise", version, arg_required_else_help = true)]
pub(crate) struct Cli {
    /// The subcommand.
    #[command(subcommand)]
    pub(crate) command: Command,
    #[command(flatten)]
    pub(crate) common: Common,
    /// The file of options that was found beside the input.
    #[arg(skip)]
    pub(crate) found_config: Option<PathBuf>,
}

/// The jobs.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Bake levels of detail, with the atlas repaired and the errors measured.
    Bake(Box<BakeArgs>),
    /// Fill the texels around the charts of a texture atlas, so that its seams do not bleed.
    Repair(RepairArgs),
    /// Make a level of any size of a progressive file.
    Extract(ExtractArgs),
    /// Make a progressive file fine where an eye looks closely.
    Refine(RefineArgs),
    /// Say how far models are from a reference.
    Evaluate(EvaluateArgs),
    /// Say what an asset is made of, and where its atlases would bleed.
    Inspect(InspectArgs),
    /// Say which level to show at a size on screen.
    Select(SelectArgs),
    /// Write a page that shows a model and its levels, to be turned and compared.
    View(ViewArgs),
    /// Put the reports of several bakes on one page.
    Report(ReportArgs),
    /// Draw the quadrics of a surface's points as ellipsoids.
    Quadrics(QuadricsArgs),
    /// Print completions for a shell.
    Completions(CompletionsArgs),
    /// Write man pages.
    Man(ManArgs),
}

/// The options that matter most: short help (`-h`) shows these alone, and long help (`--help`) these
/// first and then the others in groups.
const SHORT: [(&str, &[&str]); 5] = [
    ("quadrics", &["input", "output", "level", "epsilon", "resolution", "camera"]),
    (
        "bake",
        &[
            "inputs",
            "output",
            "preset",
            "levels",
            "ratios",
            "textures",
            "compress",
            "layout",
            "progressive",
            "no_evaluate",
            "report",
            "resume",
        ],
    ),
    (
        "repair",
        &[
            "inputs",
            "output",
            "mesh",
            "mask",
            "background",
            "scale",
            "equalize_seams",
            "diff",
            "png",
        ],
    ),
    ("inspect", &["input", "json", "blocks", "anisotropy"]),
    ("evaluate", &["reference", "candidates", "unlit", "json", "csv", "report", "sheet"]),
];

/// The command line that is parsed.
pub(crate) fn command() -> clap::Command {
    let mut command = Cli::command().mut_args(|option| {
        let is_rare = ["threads", "strict", "memory_limit"].contains(&option.get_id().as_str());
        option.hide_short_help(is_rare)
    });
    let names: Vec<String> =
        command.get_subcommands().map(|own| own.get_name().to_owned()).collect();
    for name in names {
        let shown = SHORT.iter().find(|(own, _)| *own == name);
        command = command.mut_subcommand(name, |own| {
            own.mut_args(|option| match shown {
                None => option,
                Some((_, ids)) if ids.contains(&option.get_id().as_str()) => {
                    option.help_heading(None::<&str>)
                }
                Some(_) => option.hide_short_help(true),
            })
        });
    }
    command
}

/// Parses the arguments of the process, with those that a file of options and a preset add. Help, and
/// what is wrong, is printed, and the process ends.
pub(crate) fn parse(arguments: Vec<OsString>) -> seamwise::error::Result<Cli> {
    let mut command = command();
    let typed = command.clone().get_matches_from(&arguments);
    command.build();
    let Some(("bake", bake)) = typed.subcommand() else {
        return Ok(Cli::from_arg_matches(&typed).unwrap_or_else(|error| error.exit()));
    };
    let added = config::added(command.find_subcommand("bake").unwrap_or(&command), bake)?;
    let mut all = arguments;
    let behind = all.iter().position(|own| own == "bake").map_or(all.len(), |at| at + 1);
    all.splice(behind..behind, added.arguments);
    let parsed = command.try_get_matches_from(&all).and_then(|own| Cli::from_arg_matches(&own));
    let parsed = parsed.map_err(|error| {
        let text = error.to_string();
        let text = text.lines().next().unwrap_or_default().trim_start_matches("error: ");
        let what = format!("{}: {text}", added.names.join(", "));
        seamwise::error::Error::Options { what }
    });
    Ok(Cli { found_config: added.found, ..parsed? })
}
