//! Files out: written to a temporary name beside their own and renamed, so that a reader never
//! sees half of one. Devices and pipes are written to as they are.

use std::collections::BTreeSet;
use std::fs::TryLockError;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use tempfile::NamedTempFile;

use crate::error::{Error, Result};
use crate::import::options::folder_of;

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

/// Makes sure that files can be written, before the work that makes them: their folders, or those that
/// these would be made in, take files, and nothing but a file is in the place of any.
///
/// # Errors
/// [`Error::Options`] with what is in the way.
pub fn check_writable(paths: &[PathBuf]) -> Result<()> {
    if let Some(path) = paths.iter().find(|path| path.is_dir()) {
        return Err(refusal(path, "a folder is in its place"));
    }
    let files = paths.iter().filter(|path| !is_special(path));
    let folders: BTreeSet<&Path> = files.map(|path| folder_of(path)).collect();
    folders.into_iter().try_for_each(check_folder)
}

/// Makes sure that files can be written into a folder, which need not be there.
///
/// # Errors
/// [`Error::Options`] with what is in the way.
pub fn check_folder(folder: &Path) -> Result<()> {
    let parts =
        || folder.ancestors().map(|part| if part == Path::new("") { Path::new(".") } else { part });
    let Some(there) = parts().find(|part| part.symlink_metadata().is_ok()) else {
        return Ok(());
    };
    if !there.is_dir() {
        return Err(refusal(
            there,
            "it is no folder, so that nothing can be written into it; choose another -o",
        ));
    }
    let made = tempfile::Builder::new().prefix(PREFIX).suffix(SUFFIX).tempfile_in(there);
    let Err(error) = made else { return Ok(()) };
    let why = match error.kind() {
        ErrorKind::PermissionDenied => "permission denied: nothing can be written there",
        ErrorKind::ReadOnlyFilesystem => "the disk may only be read: nothing can be written there",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "the disk is full",
        _ => "nothing can be written there",
    };
    Err(refusal(there, why))
}

fn refusal(path: &Path, why: &str) -> Error {
    Error::Options { what: format!("{}: {why}", path.display()) }
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
/// the new one comes last, so that a record is never beside files of another run. `stale` are files of
/// the old record that have no successor: they go first, while it still tells of them, so that a run
/// that is killed leaves none that no record knows.
///
/// # Errors
/// [`Error::Io`] with the file's name.
pub(crate) fn write_recorded<B: AsRef<[u8]>>(
    files: &[(PathBuf, B)],
    record: &(PathBuf, B),
    stale: &[PathBuf],
) -> Result<()> {
    let written = write_all_beside(files)?;
    let last = write_all_beside(std::slice::from_ref(record))?;
    for path in stale {
        std::fs::remove_file(path).map_err(|error| Error::io(path, error))?;
    }
    match std::fs::remove_file(&record.0) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(Error::io(&record.0, error)),
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

/// A file that is not yet under its name.
enum Written<'a> {
    /// It is under another one.
    Beside(NamedTempFile),
    /// Its bytes go into what is there, a device or a pipe, which a file must not replace.
    Through(&'a [u8]),
}

fn write_all_beside<B: AsRef<[u8]>>(
    files: &[(PathBuf, B)],
) -> Result<Vec<(&PathBuf, Written<'_>)>> {
    let written = files.iter().map(|(path, bytes)| {
        let bytes = bytes.as_ref();
        let own = match is_special(path) {
            true => Written::Through(bytes),
            false => Written::Beside(write_beside(path, bytes)?),
        };
        Ok((path, own))
    });
    written.collect()
}

/// Whether something is there that is neither a file nor a folder.
fn is_special(path: &Path) -> bool {
    std::fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir())
}

fn rename(written: Vec<(&PathBuf, Written<'_>)>) -> Result<()> {
    let finish = |path: &Path, file: Written<'_>| match file {
        Written::Beside(file) => file.persist(path).map(drop).map_err(|error| error.error),
        Written::Through(bytes) => {
            std::fs::OpenOptions::new().write(true).open(path)?.write_all(bytes)
        }
    };
    let mut written = written.into_iter();
    written.try_for_each(|(path, file)| finish(path, file).map_err(|error| Error::io(path, error)))
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
    #[cfg(unix)]
    fn what_is_no_file_is_written_to_and_stays() {
        use std::io::Read;
        use std::os::unix::fs::FileTypeExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        if !made.is_ok_and(|status| status.success()) {
            println!("skipped: mkfifo is absent, so nothing is written to a pipe");
            return;
        }
        std::thread::scope(|scope| {
            let reader = scope.spawn(|| {
                let mut read = Vec::new();
                std::fs::File::open(&path).unwrap().read_to_end(&mut read).unwrap();
                read
            });
            write_files(&[(path.clone(), b"through".to_vec())]).unwrap();
            assert_eq!(reader.join().unwrap(), b"through");
        });
        assert!(std::fs::metadata(&path).unwrap().file_type().is_fifo());
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
        assert!(write_recorded(&files, &(record.clone(), b"new".to_vec()), &[]).is_err());
        assert!(good.exists() && !record.exists());
        write_recorded(&files[..1], &(record.clone(), b"new".to_vec()), &[]).unwrap();
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
    fn what_is_in_the_way_of_files_is_found_before_they_are_made() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, b"").unwrap();
        let check_writable = |path: &Path| check_writable(&[path.to_owned()]);
        assert!(check_writable(&file).is_ok() && check_folder(&folder.path().join("a/b")).is_ok());
        let said = |result: Result<()>| result.unwrap_err().to_string();
        assert!(said(check_writable(folder.path())).ends_with("a folder is in its place"));
        for below in [file.join("a.glb"), file.join("a/b.glb")] {
            let said = said(check_writable(&below));
            assert!(said.starts_with(&format!("{}: it is no folder", file.display())), "{said}");
        }
        if Path::new("/proc/self").exists() {
            assert_eq!(
                said(check_writable(Path::new("/proc/a.glb"))),
                "/proc: nothing can be written there"
            );
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left");
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
