//! Atomically created folders: filled beside their place, synced, renamed.

use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::Path;

use super::{Result, RunError};
use mge_base::atomic::{NewFolder, parent_of};

/// A new folder beside `path`, to fill and then rename to it; removed if dropped before.
pub(super) fn new_beside(path: &Path) -> Result<NewFolder> {
    NewFolder::create(parent_of(path)).map_err(RunError::io("create a folder beside", path))
}

/// Creates a folder, unless it exists. Its parent must exist, so that this does not recreate the folder of
/// a deleted run.
pub(super) fn create(path: &Path) -> Result<()> {
    match std::fs::create_dir(path) {
        Ok(()) => sync(parent_of(path)),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => check(path),
        Err(error) => Err(RunError::io("create", path)(error)),
    }
}

/// Rejects a link in place of a folder of a run, because writes would go elsewhere.
pub(super) fn check(path: &Path) -> Result<()> {
    match std::fs::symlink_metadata(path) {
        Ok(found) if found.is_symlink() => {
            let reason = std::io::Error::new(ErrorKind::InvalidInput, "not a folder, but a link");
            Err(RunError::io("open", path)(reason))
        }
        _ => Ok(()),
    }
}

/// Writes a new file and syncs it.
pub(super) fn write_new(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = File::create_new(path).map_err(RunError::io("create", path))?;
    file.write_all(bytes).map_err(RunError::io("write", path))?;
    file.sync_all().map_err(RunError::io("write", path))
}

/// Makes created, renamed and removed names in a folder durable.
pub(super) fn sync(folder: &Path) -> Result<()> {
    let file = File::open(folder).map_err(RunError::io("sync", folder))?;
    file.sync_all().map_err(RunError::io("sync", folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dropped_folder_leaves_nothing_behind() {
        let parent = tempfile::tempdir().unwrap();
        let folder = new_beside(&parent.path().join("last")).unwrap();
        write_new(&folder.path().join("file"), b"x").unwrap();
        assert!(write_new(&folder.path().join("file"), b"y").is_err());
        drop(folder);
        assert_eq!(std::fs::read_dir(parent.path()).unwrap().count(), 0);
    }

    #[test]
    fn permissions_follow_the_umask() {
        use std::os::unix::fs::PermissionsExt;
        let parent = tempfile::tempdir().unwrap();
        let ours = new_beside(&parent.path().join("last")).unwrap();
        let plain = parent.path().join("plain");
        std::fs::create_dir(&plain).unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(ours.path()), mode(&plain));
    }
}
