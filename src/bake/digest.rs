//! A hash of all that the outputs of a bake follow from, by which a batch that is resumed knows
//! what is done.
//!
//! It is BLAKE3 (O'Connor, Aumasson, Neves & Wilcox-O'Hearn, 2020) over this tool's version, the
//! options, the bytes of the input, and those of each file that it or the options name. Equal
//! hashes mean equal outputs; unequal ones only that something changed, be it a space in the JSON.

use std::fs::File;
use std::path::Path;

use blake3::Hasher;

use super::input::Input;
use super::options::BakeOptions;
use crate::error::{Error, Result};
use crate::import::named_files;
use crate::import::options::ReadOptions;

/// The hash of an input, baked with `options`, in hexadecimal.
///
/// # Errors
/// [`Error::Io`] if the input can't be read. A file that it names may be missing, which counts as
/// well.
pub(crate) fn digest(input: Input<'_>, options: &BakeOptions) -> Result<String> {
    // What decides only whether there are outputs.
    let allow_outside = options.reading.allow_outside;
    let smooth_normals = options.reading.smooth_normals;
    let reading = ReadOptions { smooth_normals, ..ReadOptions::default() };
    let options = BakeOptions {
        reading,
        time_limit: None,
        allow_empty: false,
        preview: false,
        ..options.clone()
    };
    let mut hasher = Hasher::new();
    add(&mut hasher, env!("CARGO_PKG_VERSION").as_bytes());
    // Floats are printed with all their digits, and a new option counts without being named here.
    add(&mut hasher, format!("{options:?}").as_bytes());
    match input {
        Input::Bytes(bytes, _) => add(&mut hasher, bytes),
        Input::File(path) | Input::FileAs(path, _) => {
            let bytes = std::fs::read(path).map_err(|error| Error::io(path, error))?;
            add(&mut hasher, &bytes);
            for file in named_files(path, &bytes, allow_outside) {
                add_file(&mut hasher, &file);
            }
        }
    }
    if let Some(map) = &options.steering.importance.map {
        add_file(&mut hasher, map);
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// Adds bytes so that no other bytes, however they are split, add up to the same.
fn add(hasher: &mut Hasher, bytes: &[u8]) {
    hasher.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
}

/// Adds the hash of a file, or that there is none.
fn add_file(hasher: &mut Hasher, path: &Path) {
    let mut own = Hasher::new();
    let read = File::open(path).and_then(|file| own.update_reader(file).map(drop));
    match read {
        Ok(()) => add(hasher, own.finalize().as_bytes()),
        Err(_) => add(hasher, b"missing"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::options::Targets;
    use crate::limit::MemoryLimit;

    #[test]
    fn the_input_the_files_it_names_and_the_options_count_and_a_limit_does_not() {
        let folder = tempfile::tempdir().unwrap();
        let [gltf, bin] = ["a.gltf", "a.bin"].map(|name| folder.path().join(name));
        std::fs::write(&gltf, r#"{"buffers": [{"uri": "a.bin"}, {"uri": "data:,"}]}"#).unwrap();
        let options = BakeOptions::default();
        let of = |options: &BakeOptions| digest(Input::File(&gltf), options).unwrap();
        let missing = of(&options);
        std::fs::write(&bin, b"1").unwrap();
        let first = of(&options);
        let memory_limit = MemoryLimit::of_bytes(7);
        let reading = ReadOptions { memory_limit, ..options.reading };
        assert_eq!(of(&BakeOptions { reading, ..options.clone() }), first);
        let fewer = of(&BakeOptions { targets: Targets::halves(3), ..options.clone() });
        std::fs::write(&bin, b"2").unwrap();
        let changed = of(&options);
        let all = [&missing, &first, &fewer, &changed];
        assert!((1..4).all(|at| !all[..at].contains(&all[at])), "{all:?}");
        let bytes = |bytes| digest(Input::Bytes(bytes, ""), &options).unwrap();
        assert_ne!(bytes(b"a"), bytes(b"b"));
        assert!(digest(Input::File(&folder.path().join("none")), &options).is_err());
    }
}
