//! Atomic file writes: the new content goes to a temporary file in the same folder, is synced, and is renamed over
//! the target, so that the target holds either the whole new content or the old.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{PoisonError, RwLock};

use tempfile::TempPath;

use crate::bounded;

/// Prefix of the names of temporary files.
const TEMPORARY: &str = ".mge-";

/// Read-locked during each write; [`end_writes`] takes the write lock.
static WRITING: RwLock<()> = RwLock::new(());

/// Waits until no file is being written, and blocks new writes while the result is held. For ending the program while
/// other threads may be writing.
pub(crate) fn end_writes() -> impl Sized {
    WRITING.write().unwrap_or_else(PoisonError::into_inner)
}

/// Replaces the file at `path` with `bytes`, or leaves it unchanged on error. Also removes temporary files that
/// killed writers left in the folder.
///
/// # Errors
/// When the folder does not exist or is not writable, the disk is full, or `path` is a pipe or a device, which must
/// not be replaced.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let _writing = WRITING.read().unwrap_or_else(PoisonError::into_inner);
    if let Err(error) = bounded::regular(path)
        && error.kind() == io::ErrorKind::InvalidInput
        && !path.is_dir()
    {
        return Err(error);
    }
    let folder = parent_of(path);
    remove_leftovers(folder);
    let (mut file, temporary) = create(folder)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    std::fs::rename(&temporary, path)?;
    // The temporary name no longer exists, so nothing is to be removed.
    let _ = temporary.keep();
    drop(file);
    File::open(folder)?.sync_all()
}

/// The folder that holds `path`; "." for a bare name.
pub fn parent_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Creates the folder that holds `path`.
///
/// # Errors
/// When it cannot be created.
pub fn create_parent(path: &Path) -> io::Result<()> {
    std::fs::create_dir_all(parent_of(path))
}

/// Creates a temporary file. It stays locked while it is open: an unlocked one is a leftover.
fn create(folder: &Path) -> io::Result<(File, TempPath)> {
    loop {
        // Not `tempfile_in`: its files are private, and its errors name the temporary file.
        let mut builder = tempfile::Builder::new();
        let created = builder.prefix(TEMPORARY).make_in(folder, |path| File::create_new(path));
        let created = created.map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => io::Error::new(io::ErrorKind::NotFound, "its folder does not exist"),
            _ => error,
        })?;
        let (file, temporary) = created.into_parts();
        // Where files cannot be locked, `remove_leftovers` cannot lock it either and leaves it alone.
        let held = file.lock().is_ok();
        // Another writer may have removed it as a leftover before it was locked.
        if !held || temporary.exists() {
            return Ok((file, temporary));
        }
    }
}

/// Whether this is the name of a temporary file, of a live or a killed writer.
pub(crate) fn is_temporary(name: &str) -> bool {
    name.starts_with(TEMPORARY)
}

/// Removes the temporary files of killed writers. Files that cannot be removed are left: they do no harm.
pub(crate) fn remove_leftovers(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let temporary = entries.flatten().filter(|entry| is_temporary(&entry.file_name().to_string_lossy()));
    for entry in temporary.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file())) {
        let Ok(file) = File::open(entry.path()) else { continue };
        // The lock is held during the removal: a writer that has just created this file waits for the lock, finds the
        // file removed, and creates another.
        if file.try_lock().is_ok() {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bare_names_are_in_the_current_folder() {
        assert_eq!(parent_of(Path::new("last")), Path::new("."));
        assert_eq!(parent_of(Path::new("checkpoint/last")), Path::new("checkpoint"));
    }

    #[test]
    fn errors_are_those_of_the_system_without_the_temporary_name() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        write(&file, b"whole").unwrap();
        assert_eq!(std::fs::read(&file).unwrap(), b"whole");
        let error = write(&file.join("below"), b"").unwrap_err();
        assert!(error.raw_os_error().is_some() && !error.to_string().contains(".mge-"), "{error}");
        let error = write(&folder.path().join("nowhere/file"), b"").unwrap_err();
        assert_eq!(error.to_string(), "its folder does not exist");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left behind");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn pipes_and_devices_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let [pipe, link] = ["pipe", "link"].map(|name| folder.path().join(name));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        std::os::unix::fs::symlink("/dev/null", &link).unwrap();
        for path in [&pipe, &link] {
            let before = path.symlink_metadata().unwrap().file_type();
            assert_eq!(write(path, b"text").unwrap_err().kind(), io::ErrorKind::InvalidInput);
            assert_eq!(path.symlink_metadata().unwrap().file_type(), before);
        }
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn leftovers_of_a_killed_writer_go_and_files_being_written_stay() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(".mge-dead"), "half").unwrap();
        std::fs::create_dir(folder.path().join(".mge-folder")).unwrap();
        let held = File::create(folder.path().join(".mge-held")).unwrap();
        held.lock().unwrap();
        write(&folder.path().join("a"), b"whole").unwrap();
        let mut left = names(folder.path());
        left.sort();
        assert_eq!(left, [".mge-folder", ".mge-held", "a"]);
    }

    #[test]
    fn writers_in_one_folder_do_not_disturb_each_other() {
        let folder = tempfile::tempdir().unwrap();
        std::thread::scope(|scope| {
            for number in 0..4 {
                let path = folder.path().join(format!("file{number}"));
                scope.spawn(move || (0..50).for_each(|_| write(&path, b"whole").unwrap()));
            }
        });
        assert_eq!(names(folder.path()).len(), 4);
    }

    #[test]
    fn a_write_that_fails_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        std::fs::create_dir(&path).unwrap();
        assert!(write(&path, b"new").is_err(), "a folder is in its place");
        assert_eq!(names(folder.path()), ["taken"]);
    }
}
