//! Files and folders that were named, as files to repair, and which of them are maps of one set.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use percent_encoding::percent_decode_str;
use serde_json::Value;
use walkdir::WalkDir;

use super::options::RepairOptions;
use crate::error::{Error, Result};
use crate::import::options::folder_of;

/// Extensions of what is repaired in a folder, in small letters.
const ASSETS: [&str; 2] = ["glb", "gltf"];
const PICTURES: [&str; 8] = ["exr", "hdr", "jpeg", "jpg", "png", "tif", "tiff", "webp"];

/// The words that names of maps end in, after a `_`, `-`, `.` or a space.
const MAPS: [&str; 44] = [
    "albedo",
    "alpha",
    "ambientocclusion",
    "ao",
    "arm",
    "basecolor",
    "bump",
    "col",
    "color",
    "colour",
    "d",
    "diff",
    "diffuse",
    "disp",
    "displacement",
    "emission",
    "emissive",
    "gloss",
    "glossiness",
    "height",
    "m",
    "mask",
    "metal",
    "metallic",
    "metallicroughness",
    "metalness",
    "mr",
    "n",
    "nor",
    "normal",
    "normals",
    "nrm",
    "occlusion",
    "occlusionroughnessmetallic",
    "opacity",
    "orm",
    "r",
    "rma",
    "rough",
    "roughness",
    "s",
    "spec",
    "specular",
    "transmission",
];

/// A file to repair, and where to.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct RepairJob {
    /// The file.
    pub input: PathBuf,
    /// The file to write.
    pub output: PathBuf,
}

/// The files of a list of inputs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RepairJobs {
    /// Files that are repaired together, the maps of a set, and files alone.
    pub groups: Vec<Vec<RepairJob>>,
    /// Pictures in a folder that a .gltf in it names: they are repaired with it.
    pub parts: Vec<PathBuf>,
}

/// The files of inputs: each under its own name in `output`, an asset as a .glb. A folder stands for
/// every asset and picture in it and below, whose outputs keep their places. Pictures are maps of one
/// set if they lie in one folder and their names differ in what map they are alone (`a_color.png` and
/// `a_normal.png`), or all if `one_set`.
///
/// # Errors
/// [`Error::Options`] if a folder holds nothing to repair or is where the outputs are to go, or an
/// output would overwrite another or an input.
pub fn find_repairs(
    inputs: &[PathBuf],
    output: &Path,
    options: &RepairOptions,
    one_set: bool,
) -> Result<RepairJobs> {
    let (mut jobs, mut parts) = (Vec::new(), Vec::new());
    let to = |input: &Path, place: &Path| {
        let output = output.join(folder_of(place)).join(output_name(input, options.encoding.png));
        RepairJob { input: input.into(), output }
    };
    for input in inputs {
        if !input.is_dir() {
            // Whether it is there is found out when its turn comes.
            jobs.push(to(input, Path::new("")));
            continue;
        }
        let found = files_in(input, output)?;
        let named: BTreeSet<PathBuf> =
            found.iter().filter(|path| is_a(path, &["gltf"])).flat_map(|p| named_by(p)).collect();
        for path in found {
            if path.canonicalize().is_ok_and(|path| named.contains(&path)) {
                parts.push(path);
            } else {
                jobs.push(to(&path, path.strip_prefix(input).unwrap_or(&path)));
            }
        }
    }
    jobs.sort();
    jobs.dedup();
    refuse_collisions(&jobs)?;
    Ok(RepairJobs { groups: groups(jobs, one_set), parts })
}

/// Files in a folder and below that may be repaired, but for those in `output`.
fn files_in(folder: &Path, output: &Path) -> Result<Vec<PathBuf>> {
    let outputs = output.canonicalize().ok();
    let is_output = |path: &Path| outputs.is_some() && path.canonicalize().ok() == outputs;
    if is_output(folder) {
        let what = format!("{}: outputs would lie among the inputs", folder.display());
        return Err(Error::Options { what });
    }
    let walk = WalkDir::new(folder).follow_links(true).sort_by_file_name().into_iter();
    let mut files = Vec::new();
    for entry in walk.filter_entry(|entry| !(entry.file_type().is_dir() && is_output(entry.path())))
    {
        match &entry {
            Ok(entry) if entry.file_type().is_file() && is_known(entry.path()) => {
                files.push(entry.path().to_owned());
            }
            // What can't be read is an input that fails.
            Err(error) if error.loop_ancestor().is_none() => {
                files.push(error.path().unwrap_or(folder).to_owned());
            }
            _ => {}
        }
    }
    if files.is_empty() {
        let what = format!("{}: there is no asset and no picture in it", folder.display());
        return Err(Error::Options { what });
    }
    Ok(files)
}

fn is_a(path: &Path, extensions: &[&str]) -> bool {
    let extension = path.extension().and_then(OsStr::to_str).map(str::to_lowercase);
    extension.is_some_and(|own| extensions.contains(&own.as_str()))
}

fn is_known(path: &Path) -> bool {
    is_a(path, &ASSETS) || is_a(path, &PICTURES)
}

/// The pictures that a .gltf names, as far as it can be read.
fn named_by(path: &Path) -> Vec<PathBuf> {
    let json = std::fs::read(path).ok().and_then(|text| serde_json::from_slice(&text).ok());
    let json: Value = json.unwrap_or_default();
    let uris = json["images"].as_array().into_iter().flatten().filter_map(|i| i["uri"].as_str());
    let file = |uri: &str| {
        let name = percent_decode_str(uri).decode_utf8().ok()?;
        folder_of(path).join(name.as_ref()).canonicalize().ok()
    };
    uris.filter(|uri| !uri.starts_with("data:")).filter_map(file).collect()
}

/// The name of the result: that of the input, but assets end in .glb, and pictures in .png if all are to
/// be PNGs.
fn output_name(input: &Path, png: bool) -> PathBuf {
    let name = PathBuf::from(input.file_name().unwrap_or_default());
    if is_a(input, &ASSETS) {
        name.with_extension("glb")
    } else if png && is_a(input, &PICTURES) && !is_a(input, &["exr"]) {
        name.with_extension("png")
    } else {
        name
    }
}

fn refuse_collisions(jobs: &[RepairJob]) -> Result<()> {
    let mut writers: BTreeMap<&Path, &Path> = BTreeMap::new();
    for RepairJob { input, output } in jobs {
        if let Some(other) = writers.insert(output, input) {
            let [a, b, to] = [other, input, output].map(Path::display);
            let what = format!("{a} and {b} would both write {to}: repair them into two folders");
            return Err(Error::Options { what });
        }
    }
    let there = |path: &Path| path.canonicalize().ok();
    let written: BTreeSet<PathBuf> = writers.keys().filter_map(|path| there(path)).collect();
    let overwritten =
        |job: &&RepairJob| there(&job.input).is_some_and(|own| written.contains(&own));
    match jobs.iter().find(overwritten) {
        Some(RepairJob { input, .. }) => {
            let what = format!("{} would be overwritten: choose another output", input.display());
            Err(Error::Options { what })
        }
        None => Ok(()),
    }
}

/// Jobs of one set together, in the order of the first of each.
fn groups(jobs: Vec<RepairJob>, one_set: bool) -> Vec<Vec<RepairJob>> {
    let mut groups: Vec<Vec<RepairJob>> = Vec::new();
    let mut known: BTreeMap<(PathBuf, String), usize> = BTreeMap::new();
    for job in jobs {
        // An EXR has layers of its own.
        let is_map = is_a(&job.input, &PICTURES) && !is_a(&job.input, &["exr"]);
        let set = match one_set {
            true => (PathBuf::new(), String::new()),
            false => (folder_of(&job.input).to_owned(), set_name(&job.input)),
        };
        match known.get(&set).filter(|_| is_map) {
            Some(&group) => groups[group].push(job),
            None => {
                if is_map {
                    known.insert(set, groups.len());
                }
                groups.push(vec![job]);
            }
        }
    }
    groups
}

/// The name of a picture without what says which map it is, in small letters.
fn set_name(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
    let split = stem.rsplit_once(['_', '-', '.', ' ']);
    match split.filter(|(name, map)| !name.is_empty() && MAPS.contains(map)) {
        Some((name, _)) => name.to_owned(),
        None => stem,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_of_one_set_are_told_by_their_names() {
        let name = |name: &str| set_name(Path::new(name));
        for map in
            ["a/Rock_Color.png", "rock.jpg", "rock-normal.png", "rock_ORM.tif", "rock.ao.png"]
        {
            assert_eq!(name(map), "rock", "{map}");
        }
        assert_eq!(name("rock_mossy.png"), "rock_mossy");
        assert_eq!(name("_normal.png"), "_normal");
        assert_eq!(name("normal.png"), "normal");
        assert!(MAPS.is_sorted());
    }

    #[test]
    fn a_folder_stands_for_what_is_in_it_and_pictures_of_a_gltf_are_its_own() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        let gltf: &[u8] =
            br#"{"images": [{"uri": "skin%20a.png"}, {"uri": "data:image/png,"}, {}]}"#;
        for (name, bytes) in [
            ("in/b/wood_color.png", &b""[..]),
            ("in/b/wood_normal.JPG", b""),
            ("in/b/light.exr", b""),
            ("in/notes.txt", b""),
            ("in/s.gltf", gltf),
            ("in/skin a.png", b""),
            ("in/out/s.glb", b""),
            ("lone.png", b""),
        ] {
            std::fs::create_dir_all(folder_of(&at(name))).unwrap();
            std::fs::write(at(name), bytes).unwrap();
        }
        let job = |input: &str, output: &str| RepairJob { input: at(input), output: at(output) };
        let options = RepairOptions::default();
        let inputs = [at("lone.png"), at("in")];
        let found = find_repairs(&inputs, &at("in/out"), &options, false).unwrap();
        assert_eq!(found.parts, [at("in/skin a.png")]);
        let expected = [
            vec![job("in/b/light.exr", "in/out/b/light.exr")],
            vec![
                job("in/b/wood_color.png", "in/out/b/wood_color.png"),
                job("in/b/wood_normal.JPG", "in/out/b/wood_normal.JPG"),
            ],
            vec![job("in/s.gltf", "in/out/s.glb")],
            vec![job("lone.png", "in/out/lone.png")],
        ];
        assert_eq!(found.groups, expected);
        let one = find_repairs(&inputs, &at("in/out"), &options, true).unwrap();
        assert_eq!(one.groups.iter().map(Vec::len).collect::<Vec<_>>(), [1, 3, 1]);
        let refused = |inputs: &[PathBuf], output: &str| {
            find_repairs(inputs, &at(output), &options, false).unwrap_err().to_string()
        };
        assert!(refused(&[at("in")], "in").contains("among"));
        assert!(refused(&[at("lone.png"), at("in/b")], "").contains("overwritten"));
        std::fs::write(at("in/b/lone.png"), b"").unwrap();
        assert!(refused(&[at("lone.png"), at("in/b/lone.png")], "x").contains("both write"));
        std::fs::create_dir(at("empty")).unwrap();
        assert!(refused(&[at("empty")], "x").contains("no picture"));
    }
}
