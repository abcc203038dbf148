//! Files and folders that were named, as a list of inputs.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use walkdir::{DirEntry, WalkDir};

use super::job::Job;
use crate::error::{Error, Result};
use crate::import::foreign::{PICTURE, foreign_name};
use crate::import::options::folder_of;

/// Extensions of files that are inputs, in small letters.
const EXTENSIONS: [&str; 5] = ["glb", "gltf", "obj", "off", "ply"];

/// The inputs of a batch, sorted by where they go. A folder stands for every asset in it and below,
/// whose outputs keep their place below `output`; what lies in `output` is none of them.
///
/// # Errors
/// [`Error::Options`] if a folder holds no asset, or is where the outputs are to go.
pub fn find_jobs(inputs: &[PathBuf], output: &Path) -> Result<Vec<Job>> {
    let mut jobs = Vec::new();
    for input in inputs {
        if input.is_dir() {
            jobs.extend(find_in_folder(input, output)?);
        } else {
            // Whether it is there is found out when its turn comes.
            jobs.push(Job::new(output.into(), input.clone()));
        }
    }
    jobs.sort();
    Ok(jobs)
}

fn find_in_folder(folder: &Path, output: &Path) -> Result<Vec<Job>> {
    let outputs = output.canonicalize().ok();
    let is_output = |path: &Path| outputs.is_some() && path.canonicalize().ok() == outputs;
    if is_output(folder) {
        let what = format!("{}: outputs would lie among the inputs", folder.display());
        return Err(Error::Options { what });
    }
    let walk = WalkDir::new(folder).follow_links(true).into_iter();
    let mut jobs = Vec::new();
    for entry in walk.filter_entry(|entry| !(entry.file_type().is_dir() && is_output(entry.path())))
    {
        // What can't be read is an input that fails. A link to where it is itself leads to nothing
        // new.
        let path = match &entry {
            Ok(entry) if is_asset(entry) => entry.path(),
            Err(error) if error.loop_ancestor().is_none() => error.path().unwrap_or(folder),
            _ => continue,
        };
        let place = path.strip_prefix(folder).unwrap_or(path);
        jobs.push(Job::new(output.join(folder_of(place)), path.into()));
    }
    if jobs.is_empty() {
        return Err(Error::Options {
            what: format!("{}: {}", folder.display(), without_assets(folder)),
        });
    }
    Ok(jobs)
}

/// The message about a folder without an asset, with what lies there instead.
fn without_assets(folder: &Path) -> String {
    let files = WalkDir::new(folder).into_iter().flatten();
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for kind in files.filter_map(|entry| foreign_name(entry.path())) {
        *kinds.entry(kind).or_default() += 1;
    }
    let what = "there is no .glb, .gltf, .obj, .ply or .off in it";
    match kinds.into_iter().max_by_key(|(_, count)| *count) {
        Some((PICTURE, count)) => format!(
            "{what}, but {count} × {PICTURE}: `seamwise repair {} -o DIR` fills what no chart covers in them",
            folder.display()
        ),
        Some((kind, count)) => {
            format!("{what}, but {count} × {kind}, which is not read: make it a .glb")
        }
        None => what.to_owned(),
    }
}

fn is_asset(entry: &DirEntry) -> bool {
    let extension = entry.path().extension().and_then(OsStr::to_str).map(str::to_lowercase);
    entry.file_type().is_file() && extension.is_some_and(|own| EXTENSIONS.contains(&own.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_stands_for_its_assets_and_outputs_keep_their_places() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        for name in ["in/b/a.glb", "in/a.GLTF", "in/b/notes.txt", "in/out/a_lod1.glb", "one.ply"] {
            std::fs::create_dir_all(folder_of(&at(name))).unwrap();
            std::fs::write(at(name), b"").unwrap();
        }
        let job = |folder: &str, input: &str| Job::new(at(folder), at(input));
        let found = find_jobs(&[at("one.ply"), at("in")], &at("in/out")).unwrap();
        let expected =
            [job("in/out", "in/a.GLTF"), job("in/out", "one.ply"), job("in/out/b", "in/b/a.glb")];
        assert_eq!(found, expected);
        assert_eq!(find_jobs(&[at("in"), at("one.ply")], &at("in/out")).unwrap(), found);
        assert!(find_jobs(&[at("in")], &at("in")).unwrap_err().to_string().contains("among"));
        std::fs::create_dir(at("empty")).unwrap();
        let said = || find_jobs(&[at("empty")], &at("out")).unwrap_err().to_string();
        assert!(
            said().ends_with("there is no .glb, .gltf, .obj, .ply or .off in it"),
            "{}",
            said()
        );
        std::fs::write(at("empty/a.JPG"), b"").unwrap();
        assert!(said().contains("but 1 × picture: `seamwise repair"), "{}", said());
        for name in ["a.fbx", "b.fbx"] {
            std::fs::write(at("empty").join(name), b"").unwrap();
        }
        assert!(
            said().ends_with("but 2 × FBX file, which is not read: make it a .glb"),
            "{}",
            said()
        );
    }
}
