//! The folder of an asset, in which the files lie that it names.
//!
//! A file from elsewhere may name anything: a device that never ends, or a key that would go into a
//! texture. So names lead into the asset's folder or below, unless that is waived: no absolute path,
//! and no `..` that climbs out, wherever it would come back in. Links in the folder are followed; who
//! put them there is who bakes.

use std::path::{Component, Path, PathBuf};

/// The file of a name, or what is wrong with the name.
pub(crate) type Found = Result<PathBuf, String>;

/// Where an asset's files are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Folder<'a> {
    path: &'a Path,
    allow_outside: bool,
}

impl<'a> Folder<'a> {
    /// A folder, and whether names may lead out of it.
    pub(crate) fn new(path: &'a Path, allow_outside: bool) -> Self {
        Self { path, allow_outside }
    }

    /// The folder of a file.
    pub(crate) fn of(file: &'a Path, allow_outside: bool) -> Self {
        Self::new(file.parent().unwrap_or(Path::new("")), allow_outside)
    }

    /// The file of a name, or what is wrong with the name.
    pub(crate) fn file(self, name: &str) -> Found {
        if self.allow_outside || is_inside(Path::new(name)) {
            return Ok(self.path.join(name));
        }
        Err(format!("{name} lies outside of the asset's folder, which --allow-outside allows"))
    }

    /// The same for a name of any system; under its last part alone where the whole is of another
    /// machine.
    pub(crate) fn find(self, name: &str) -> Found {
        let name = name.replace('\\', "/");
        let whole = self.file(&name);
        let last = name.rsplit('/').next().map(|last| self.path.join(last));
        match last {
            Some(last) if !whole.as_ref().is_ok_and(|path| path.is_file()) && last.is_file() => {
                Ok(last)
            }
            _ => whole,
        }
    }
}

/// Whether a path stays below where it starts, at each of its steps.
fn is_inside(path: &Path) -> bool {
    let mut depth = 0u32;
    path.components().all(|component| match component {
        Component::Normal(_) => {
            depth += 1;
            true
        }
        Component::CurDir => true,
        Component::ParentDir => match depth.checked_sub(1) {
            Some(above) => {
                depth = above;
                true
            }
            None => false,
        },
        Component::RootDir | Component::Prefix(_) => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_the_folder_or_below() {
        let folder = Folder::new(Path::new("/assets/box"), false);
        for inside in ["a.png", "./a.png", "maps/a.png", "maps/../a.png", "..a/b..png"] {
            assert_eq!(folder.file(inside).unwrap(), Path::new("/assets/box").join(inside));
        }
        for outside in ["/etc/passwd", "../a.png", "maps/../../a.png", "../box/a.png", "..", "/"] {
            let error = folder.file(outside).unwrap_err();
            assert!(error.starts_with(outside) && error.contains("--allow-outside"), "{error}");
            let allowed = Folder::new(Path::new("/assets/box"), true).file(outside);
            assert_eq!(allowed.unwrap(), Path::new("/assets/box").join(outside));
        }
    }

    #[test]
    fn what_another_machine_named_is_found_beside_the_asset() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("a.png");
        std::fs::write(&inside, b"").unwrap();
        let own = Folder::new(folder.path(), false);
        for name in ["C:\\scans\\a.png", "/home/me/a.png", "..\\maps\\a.png", "a.png"] {
            assert_eq!(own.find(name).unwrap(), inside, "{name}");
        }
        assert!(own.find("/home/me/b.png").is_err());
        assert!(own.find("..\\b.png").is_err());
        assert_eq!(own.find("b.png").unwrap(), folder.path().join("b.png"));
    }
}
