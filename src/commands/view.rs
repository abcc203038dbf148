//! The interactive view of a model and its levels.

use std::io::IsTerminal;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::Result;

use seamwise::document::asset::Asset;
use seamwise::export::disk::{refuse_overwriting, write_files};
use seamwise::report::viewer::{Exhibit, Viewer};

use super::console::{check_files, read_warned};
use crate::cli::{Common, ViewArgs};

/// Writes the page, and opens it if somebody is there to look at it.
pub(crate) fn view(args: &ViewArgs, common: Common) -> Result<usize> {
    let outputs = std::slice::from_ref(&args.output);
    check_files(outputs)?;
    let mut models: Vec<(String, Asset)> = Vec::new();
    for path in std::iter::once(&args.input).chain(&args.levels) {
        refuse_overwriting(path, outputs)?;
        let asset =
            read_warned(path, &args.reading, common).map_err(|error| error.in_file(path))?;
        models.push((name_of(path), asset));
    }
    let exhibit = |(file, asset)| Exhibit { file, asset, largest_size: None };
    let exhibits: Vec<Exhibit<'_>> =
        models.iter().map(|(file, asset)| exhibit((file.as_str(), asset))).collect();
    let page = Viewer::new(&exhibits, common.memory_limit)?.to_page(&models[0].0)?;
    write_files(&[(args.output.clone(), page.into_bytes())])?;
    if !args.no_open && std::io::stdout().is_terminal() {
        open_page(&args.output);
    }
    Ok(0)
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Opens a page in the browser, where there is one; that it can't is no failure, since the page is there.
fn open_page(page: &Path) {
    let (program, before): (&str, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("cmd", &["/C", "start", ""]),
        _ if ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some()) => {
            ("xdg-open", &[])
        }
        _ => return,
    };
    let mut command = Command::new(program);
    command.args(before).arg(page).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    drop(command.spawn());
}
