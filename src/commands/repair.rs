//! The repair of a file, of the maps of a set, or of all that is in a folder.

use std::path::Path;

use anyhow::{Result, bail};
use serde_json::{Value, json};

use seamwise::error::Error;
use seamwise::export::disk::write_files;
use seamwise::image_file::codec::detect_format;
use seamwise::repair::options::RepairOptions;
use seamwise::repair::several::{RepairJob, RepairJobs, find_repairs, repair_group};
use seamwise::repair::{repair_bytes, repair_file};
use seamwise::report::repair::RepairReport;

use super::console::{check_files, read_stdin, say, warn, write_stdout, write_text};
use crate::cli::{Common, RepairArgs, is_dash};

/// Repairs what was named; tells how many files failed.
pub(crate) fn repair(args: &RepairArgs, common: Common) -> Result<usize> {
    let options = args.resolve(common);
    check_files(args.json.iter())?;
    match args.inputs.as_slice() {
        [input] if is_dash(input) || is_dash(&args.output) => {
            repair_piped(args, input, &options, common)
        }
        [input] if !is_folder(args, input) => repair_one(args, input, &options, common),
        _ => repair_several(args, &options, common),
    }
}

/// Whether the output is a folder.
fn is_folder(args: &RepairArgs, input: &Path) -> bool {
    let ends_as_one = args.output.as_os_str().as_encoded_bytes().ends_with(b"/");
    input.is_dir() || args.output.is_dir() || ends_as_one
}

fn repair_one(
    args: &RepairArgs,
    input: &Path,
    options: &RepairOptions,
    common: Common,
) -> Result<usize> {
    let report = repair_file(input, &args.output, options)?;
    warn(common.quiet, input, &report.warnings);
    tell(args, &report, common)
}

/// Says what was repaired, to people or to a program.
fn tell(args: &RepairArgs, report: &RepairReport, common: Common) -> Result<usize> {
    let is_json = args.json.as_deref().is_some_and(is_dash);
    if is_dash(&args.output) && !common.quiet {
        eprint!("{}", report.to_table());
    } else {
        say(common.quiet || is_json, &report.to_table())?;
    }
    if let Some(path) = &args.json {
        write_text(path, report.to_json())?;
    }
    Ok(0)
}

/// Repairs what comes from standard input or goes to standard output, in the format it came in unless
/// the output has a name.
fn repair_piped(
    args: &RepairArgs,
    input: &Path,
    options: &RepairOptions,
    common: Common,
) -> Result<usize> {
    if args.draws() {
        bail!("--diff and --pyramid need files: give an input and an output with names");
    }
    let to_stdout = is_dash(&args.output);
    if to_stdout && args.json.as_deref().is_some_and(is_dash) {
        bail!("standard output can't take both the result and JSON: give --json a file");
    }
    let bytes = if is_dash(input) {
        read_stdin(common)?
    } else {
        std::fs::read(input).map_err(|source| Error::Io { path: input.into(), source })?
    };
    let ending = ending(&bytes);
    let named = |path: &Path, name: &str| match is_dash(path) {
        true => Path::new(name).with_extension(ending),
        false => path.to_owned(),
    };
    let output = named(&args.output, "stdout");
    let (file, report) = repair_bytes(&bytes, &named(input, "stdin"), &output, options)?;
    warn(common.quiet, input, &report.warnings);
    if to_stdout {
        write_stdout(&file)?;
    } else {
        write_files(&[(output, file)])?;
    }
    tell(args, &report, common)
}

/// The extension of a file by its first bytes.
fn ending(bytes: &[u8]) -> &'static str {
    if bytes.starts_with(b"glTF") || bytes.trim_ascii_start().starts_with(b"{") {
        return "glb";
    }
    let format = detect_format(bytes).and_then(|format| format.extensions_str().first().copied());
    format.unwrap_or("exr")
}

fn repair_several(args: &RepairArgs, options: &RepairOptions, common: Common) -> Result<usize> {
    if args.draws() && args.inputs.len() > 1 {
        bail!("--diff and --pyramid draw one input: give one");
    }
    let found = find_repairs(&args.inputs, &args.output, options, args.one_set)?;
    let RepairJobs { groups, parts } = &found;
    if args.draws() && groups.iter().map(Vec::len).sum::<usize>() > 1 {
        bail!("--diff and --pyramid draw one input: give one");
    }
    let (mut repaired, mut failures, mut inputs) = (0, Vec::new(), Vec::new());
    for group in groups {
        let results = repair_group(group, options);
        let set: Vec<String> = group.iter().map(|job| job.input.display().to_string()).collect();
        let mut told = String::new();
        for (job, result) in group.iter().zip(results) {
            let mut entry = entry(job, &result);
            if set.len() > 1 {
                entry["set"] = json!(set);
            }
            inputs.push(entry);
            match result {
                Ok(report) => {
                    warn(common.quiet, &job.input, &report.warnings);
                    told += &format!("{}\n{}", job.input.display(), report.to_table());
                    repaired += 1;
                }
                Err(error) => failures.push((job, error)),
            }
        }
        if set.len() > 1 {
            told = format!("one set: {}\n{told}", set.join(", "));
        }
        say(common.quiet, &(told + "\n"))?;
    }
    if let Some(path) = &args.json {
        let json =
            json!({"schema": 1, "repaired": repaired, "failed": failures.len(), "inputs": inputs});
        write_text(path, format!("{json:#}\n"))?;
    }
    let of_gltf = match parts.len() {
        0 => String::new(),
        count => format!(", {count} pictures with the .gltf that names them"),
    };
    say(common.quiet, &format!("{repaired} repaired{of_gltf}, {} failed\n", failures.len()))?;
    eprint!("{}", lines(&failures, repaired + failures.len()));
    if repaired == 0 {
        bail!("nothing was repaired");
    }
    Ok(failures.len())
}

/// The outcome of an input, for programs.
fn entry(job: &RepairJob, result: &Result<RepairReport, Error>) -> Value {
    let mut entry = json!({
        "input": job.input.display().to_string(),
        "output": job.output.display().to_string(),
    });
    match result {
        Ok(report) => {
            entry["outcome"] = json!("repaired");
            let report = report.to_value();
            entry["images"] = report["images"].clone();
            entry["warnings"] = report["warnings"].clone();
        }
        Err(error) => {
            entry["outcome"] = json!("failed");
            entry["reason"] = json!(error.to_string());
        }
    }
    entry
}

/// A line for each input that failed, with the reason.
fn lines(failures: &[(&RepairJob, Error)], all: usize) -> String {
    if failures.is_empty() {
        return String::new();
    }
    let line = |(job, error): &(&RepairJob, Error)| {
        let input = job.input.display().to_string();
        let reason = error.to_string();
        // The name is a part of what the system says.
        let reason = reason.strip_prefix(&format!("{input}: ")).unwrap_or(&reason);
        format!("seamwise:   {input}  {}\n", reason.replace('\n', " "))
    };
    let lines: String = failures.iter().map(line).collect();
    format!("seamwise: {} of {all} inputs failed:\n{lines}", failures.len())
}
