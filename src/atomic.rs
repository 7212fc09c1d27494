//! Atomic file writes: a file is written beside its place, synced and renamed, so that it is there
//! whole or as it was before.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

/// Prefix of the name of a file that is being written.
const TEMPORARY: &str = ".mge-";

/// Replaces the file at `path` with `bytes`, or leaves what was there. Removes what earlier writers
/// that died have left in the folder.
///
/// # Errors
/// When the folder does not exist, is not writable, or the disk is full.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    remove_leftovers(folder);
    let new = tempfile::Builder::new().prefix(TEMPORARY).tempfile_in(folder).map_err(|error| match error.kind() {
        // The error itself would name the temporary file, which nobody knows.
        io::ErrorKind::NotFound => io::Error::new(io::ErrorKind::NotFound, "its folder does not exist"),
        kind => kind.into(),
    })?;
    let (mut file, temporary) = new.into_parts();
    // Held until it has its name: a file that nobody holds is a leftover.
    let _ = file.try_lock();
    file.write_all(bytes)?;
    file.sync_all()?;
    set_usual_permissions(&file)?;
    std::fs::rename(&temporary, path)?;
    // It has another name now and is no longer to be removed.
    let _ = temporary.keep();
    drop(file);
    File::open(folder)?.sync_all()
}

/// Whether a file of this name is one that is being written, or was when its writer died.
pub(crate) fn is_temporary(name: &str) -> bool {
    name.starts_with(TEMPORARY)
}

/// Removes the temporary files of writers that died. What cannot be removed stays: it does no harm.
pub(crate) fn remove_leftovers(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let temporary = entries.flatten().filter(|entry| is_temporary(&entry.file_name().to_string_lossy()));
    for entry in temporary.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file())) {
        if File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Temporary files are private; what a person saves is readable like any other file.
#[cfg(unix)]
fn set_usual_permissions(file: &File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(std::fs::Permissions::from_mode(0o644))
}

#[cfg(not(unix))]
fn set_usual_permissions(_: &File) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn leftovers_of_a_dead_writer_go_and_files_being_written_stay() {
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
    fn a_write_that_fails_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        std::fs::create_dir(&path).unwrap();
        assert!(write(&path, b"new").is_err(), "a folder is in its place");
        assert_eq!(names(folder.path()), ["taken"]);
    }
}
