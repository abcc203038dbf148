//! Several models on one page.

use std::path::{Component, Path, PathBuf};

use anyhow::Result;

use seamwise::error::Error;
use seamwise::export::disk::{refuse_overwriting, write_files};
use seamwise::report::several::{Model, several_page};

use super::console::check_files;
use crate::cli::ReportArgs;

/// Writes the page of the models whose reports are named.
pub(crate) fn report(args: &ReportArgs) -> Result<usize> {
    check_files([&args.output])?;
    for report in &args.reports {
        refuse_overwriting(report, std::slice::from_ref(&args.output))?;
    }
    write_page(&args.reports, &args.output)?;
    Ok(0)
}

/// Writes the page of the models with these reports.
pub(super) fn write_page(reports: &[PathBuf], output: &Path) -> Result<()> {
    let folder = output.parent().unwrap_or(Path::new(""));
    let model = |path: &PathBuf| {
        let named = |source| Error::Io { path: path.clone(), source };
        let json = std::fs::read(path).map_err(named)?;
        let page = path.with_extension("html");
        let link = page.is_file().then(|| link(folder, &page));
        Model::new(&json, path, link).map_err(|error| error.in_file(path))
    };
    let models = reports.iter().map(model).collect::<seamwise::error::Result<Vec<_>>>()?;
    Ok(write_files(&[(output.to_owned(), several_page(models)?.into_bytes())])?)
}

/// A link from a folder to a file: relative where both are below one.
fn link(folder: &Path, file: &Path) -> String {
    let absolute = |path: &Path| {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
    };
    let (folder, file) = (absolute(folder), absolute(file));
    let (own, other): (Vec<_>, Vec<_>) =
        (folder.components().collect(), file.components().collect());
    let common = own.iter().zip(&other).take_while(|(a, b)| a == b).count();
    let ups = std::iter::repeat_n("..".to_owned(), own.len() - common);
    let names = other[common..].iter().map(|part: &Component<'_>| {
        let name = part.as_os_str().to_string_lossy();
        // What means something else in a link.
        name.replace('%', "%25").replace('#', "%23").replace('?', "%3F").replace('\\', "/")
    });
    ups.chain(names).collect::<Vec<_>>().join("/")
}
