//! The interactive view of a model and its levels.

use std::io::IsTerminal;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::Result;

use seamwise::document::asset::Asset;
use seamwise::export::disk::{refuse_overwriting, write_files};
use seamwise::export::progressive::extract::{Fineness, extract};
use seamwise::export::progressive::format::EXTENSION;
use seamwise::export::progressive::timeline::Timeline;
use seamwise::import::{read_bytes_of, read_file};
use seamwise::report::viewer::{Exhibit, Viewer};

use super::console::{check_files, read_stdin, warn};
use crate::cli::{Common, ViewArgs, is_dash};

/// Writes the page, and opens it if somebody is there to look at it.
pub(crate) fn view(args: &ViewArgs, common: Common) -> Result<usize> {
    let outputs = std::slice::from_ref(&args.output);
    check_files(outputs)?;
    let mut models = Vec::new();
    for path in std::iter::once(&args.input).chain(&args.levels) {
        refuse_overwriting(path, outputs)?;
        models.push(Model::read(path, args, common).map_err(|error| error.in_file(path))?);
    }
    // A progressive file by itself is compared with the source that is in it.
    if let ([only], []) = (&models[..], &args.levels[..])
        && let Some(source) = only.source(args, common)?
    {
        models.insert(0, source);
    }
    let exhibits: Vec<Exhibit<'_>> = models.iter().map(Model::exhibit).collect();
    let page = Viewer::new(&exhibits, common.memory_limit)?.to_page(&models[0].name)?;
    write_files(&[(args.output.clone(), page.into_bytes())])?;
    if !args.no_open && std::io::stdout().is_terminal() {
        open_page(&args.output);
    }
    Ok(0)
}

/// A model of the page.
struct Model {
    name: String,
    asset: Asset,
    /// Its bytes and all of its levels, if it is a progressive file.
    progressive: Option<(Vec<u8>, Timeline)>,
}

impl Model {
    fn read(path: &Path, args: &ViewArgs, common: Common) -> seamwise::error::Result<Self> {
        let options = args.reading.resolve(common);
        let bytes = if is_dash(path) { read_stdin(common)? } else { read_file(path)? };
        let asset = read_bytes_of(&bytes, path, options)?;
        warn(common.quiet, path, &asset.warnings);
        let has_splits = asset.json.pointer(&format!("/extensions/{EXTENSION}")).is_some();
        let progressive = if has_splits {
            let timeline = Timeline::read(&bytes, Viewer::MOST_CONTINUOUS, options)?;
            Some((bytes, timeline))
        } else {
            None
        };
        Ok(Self { name: name_of(path), asset, progressive })
    }

    /// The source in a progressive file.
    fn source(&self, args: &ViewArgs, common: Common) -> seamwise::error::Result<Option<Self>> {
        let Some((bytes, _)) = &self.progressive else { return Ok(None) };
        let source = extract(bytes, Fineness::Source, args.reading.resolve(common))?;
        Ok(Some(Self { name: self.name.clone(), asset: source.asset, progressive: None }))
    }

    fn exhibit(&self) -> Exhibit<'_> {
        let timeline = self.progressive.as_ref().map(|(_, timeline)| timeline);
        Exhibit { timeline, ..Exhibit::new(&self.name, &self.asset) }
    }
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
