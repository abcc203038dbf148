//! Files out: written to a temporary name beside their own and renamed, so that a reader never
//! sees half of one.

use std::fs::TryLockError;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

use tempfile::NamedTempFile;

use crate::error::{Error, Result};

/// Refuses to write over a file that was read, whatever way its path is written.
///
/// # Errors
/// [`Error::Options`] if one of the outputs leads to the input.
pub fn refuse_overwriting(input: &Path, outputs: &[PathBuf]) -> Result<()> {
    let Ok(own) = input.canonicalize() else {
        return Ok(());
    };
    if outputs.iter().any(|output| output.canonicalize().is_ok_and(|path| path == own)) {
        let what = format!("{} would be overwritten: choose another output", input.display());
        return Err(Error::Options { what });
    }
    Ok(())
}

/// Writes files whole or not at all: each goes to a temporary name first, and none gets its own
/// before all are there. Folders are made as they are needed.
///
/// # Errors
/// [`Error::Io`] with the file's name.
pub fn write_files<B: AsRef<[u8]>>(files: &[(PathBuf, B)]) -> Result<()> {
    rename(write_all_beside(files)?)
}

/// As [`write_files`], with a record of them: an old one goes before any of them gets its name, and
/// the new one comes last, so that a record is never beside files of another run.
///
/// # Errors
/// [`Error::Io`] with the file's name.
pub(crate) fn write_recorded<B: AsRef<[u8]>>(
    files: &[(PathBuf, B)],
    record: &(PathBuf, B),
) -> Result<()> {
    let written = write_all_beside(files)?;
    let last = write_all_beside(std::slice::from_ref(record))?;
    match std::fs::remove_file(&record.0) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::io(&record.0, error))
        }
        _ => rename(written).and_then(|()| rename(last)),
    }
}

/// Prefix and suffix of temporary names; between is what makes each unique.
const PREFIX: &str = ".seamwise-";
const SUFFIX: &str = ".tmp";
/// The time that a temporary file must have been left alone to count as left over.
const LEFTOVER_AGE: Duration = Duration::from_secs(60);

/// Removes temporary files of runs that were killed from a folder: files of our names that no process
/// holds and that nothing was written to for a minute. What can't be removed stays.
pub(crate) fn remove_leftovers(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let between =
            name.to_str().and_then(|name| name.strip_prefix(PREFIX)?.strip_suffix(SUFFIX));
        let is_own = between.is_some_and(|own| {
            !own.is_empty() && own.chars().all(|character| character.is_ascii_alphanumeric())
        });
        if is_own && entry.file_type().is_ok_and(|kind| kind.is_file()) && is_left(&entry.path()) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

fn is_left(path: &Path) -> bool {
    let Ok(file) = std::fs::File::open(path) else { return false };
    let modified = file.metadata().and_then(|data| data.modified());
    let age = modified.ok().and_then(|time| time.elapsed().ok());
    let is_held = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
    age.is_some_and(|age| age > LEFTOVER_AGE) && !is_held
}

/// Files under temporary names, with those that they are to have.
type Written<'a> = Vec<(&'a PathBuf, NamedTempFile)>;

fn write_all_beside<B: AsRef<[u8]>>(files: &[(PathBuf, B)]) -> Result<Written<'_>> {
    files.iter().map(|(path, bytes)| Ok((path, write_beside(path, bytes.as_ref())?))).collect()
}

fn rename(written: Written<'_>) -> Result<()> {
    written.into_iter().try_for_each(|(path, file)| {
        file.persist(path).map(drop).map_err(|error| Error::io(path, error.error))
    })
}

/// Writes bytes to a temporary file in the folder of `path`; it vanishes unless it is renamed.
fn write_beside(path: &Path, bytes: &[u8]) -> Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    let attempt = || {
        std::fs::create_dir_all(folder)?;
        let mut file =
            tempfile::Builder::new().prefix(PREFIX).suffix(SUFFIX).tempfile_in(folder)?;
        // A lock ends with its process, be it killed. Where there are none, age alone tells.
        let _ = file.as_file().try_lock();
        file.write_all(bytes)?;
        make_readable(file.as_file())?;
        Ok(file)
    };
    attempt().map_err(|error| Error::io(path, error))
}

/// Gives a temporary file, which only its owner may read, the rights of an ordinary one.
#[cfg(unix)]
fn make_readable(file: &std::fs::File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn make_readable(_: &std::fs::File) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_nothing_is_left_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.bin");
        write_files(&[(path.clone(), b"old".to_vec())]).unwrap();
        write_files(&[(path.clone(), b"new".to_vec())]).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_record_is_not_left_beside_files_that_it_is_not_of() {
        let folder = tempfile::tempdir().unwrap();
        let [good, record] = ["a.bin", "a.json"].map(|name| folder.path().join(name));
        // A folder can't be replaced by a file: the run ends between its files.
        let bad = folder.path().join("b");
        std::fs::create_dir(&bad).unwrap();
        std::fs::write(&record, b"old").unwrap();
        let files = [(good.clone(), b"new".to_vec()), (bad.clone(), b"new".to_vec())];
        assert!(write_recorded(&files, &(record.clone(), b"new".to_vec())).is_err());
        assert!(good.exists() && !record.exists());
        write_recorded(&files[..1], &(record.clone(), b"new".to_vec())).unwrap();
        assert_eq!(std::fs::read(&record).unwrap(), b"new");
    }

    #[test]
    fn only_old_files_of_ours_that_nobody_holds_are_left_over() {
        let folder = tempfile::tempdir().unwrap();
        let old = std::time::SystemTime::now() - 2 * LEFTOVER_AGE;
        let put = |name: &str, is_old: bool| {
            let file = std::fs::File::create(folder.path().join(name)).unwrap();
            if is_old {
                file.set_modified(old).unwrap();
            }
            file
        };
        let kept = [
            ".seamwise-.tmp",
            ".seamwise-a b.tmp",
            ".seamwise-held.tmp",
            ".seamwise-new.tmp",
            ".tmpAbCdEf",
            "seamwise-abc.tmp",
        ];
        let files = kept.map(|name| put(name, !name.contains("new")));
        files[2].lock().unwrap();
        put(".seamwise-Ab3.tmp", true);
        std::fs::create_dir(folder.path().join(".seamwise-dir.tmp")).unwrap();
        remove_leftovers(folder.path());
        let mut names: Vec<String> = std::fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.retain(|name| !name.contains("dir"));
        names.sort();
        assert_eq!(names, kept);
        remove_leftovers(&folder.path().join("nowhere"));
    }

    #[test]
    fn if_one_file_fails_none_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let good = folder.path().join("a.bin");
        let file = folder.path().join("file");
        std::fs::write(&file, b"").unwrap();
        let bad = file.join("a.bin");
        assert!(write_files(&[(good, b"a".to_vec()), (bad, b"b".to_vec())]).is_err());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "the file that was there");
    }
}
