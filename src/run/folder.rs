//! Folders that appear whole: filled beside their place, synced, renamed.

use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, TempDir};

use super::{Result, RunError};

/// A new folder beside `path`, to be filled and then renamed to it; removed if dropped before.
pub(super) fn new_beside(path: &Path) -> Result<TempDir> {
    let mut builder = Builder::new();
    builder.prefix(TEMPORARY);
    follow_umask(&mut builder);
    builder.tempdir_in(parent_of(path)).map_err(RunError::io("create a folder beside", path))
}

/// Prefix of the name of a folder that is being filled.
pub(super) const TEMPORARY: &str = ".writing-";

/// Makes a folder in one that exists, unless it is there. The folder of a run that is gone does not
/// come back by this.
pub(super) fn create(path: &Path) -> Result<()> {
    match std::fs::create_dir(path) {
        Ok(()) => sync(&parent_of(path)),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => check(path),
        Err(error) => Err(RunError::io("create", path)(error)),
    }
}

/// Refuses a link in place of a folder of a run: what is written there would be another's.
pub(super) fn check(path: &Path) -> Result<()> {
    match std::fs::symlink_metadata(path) {
        Ok(found) if found.is_symlink() => {
            let reason = std::io::Error::new(ErrorKind::InvalidInput, "it is no folder but a link");
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
    // Only unix can open a folder as a file; elsewhere the rename itself is all there is.
    if cfg!(unix) {
        let file = File::open(folder).map_err(RunError::io("sync", folder))?;
        file.sync_all().map_err(RunError::io("sync", folder))?;
    }
    Ok(())
}

/// The folder that holds `path`; "." for a bare name.
pub(super) fn parent_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Temporary folders are private to the user by default; those of a run follow the user's umask.
fn follow_umask(builder: &mut Builder<'_, '_>) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o777));
    }
    #[cfg(not(unix))]
    let _ = builder;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_is_given_up_leaves_nothing() {
        let parent = tempfile::tempdir().unwrap();
        let folder = new_beside(&parent.path().join("last")).unwrap();
        write_new(&folder.path().join("file"), b"x").unwrap();
        assert!(write_new(&folder.path().join("file"), b"y").is_err());
        drop(folder);
        assert_eq!(std::fs::read_dir(parent.path()).unwrap().count(), 0);
    }

    #[test]
    fn bare_names_live_in_the_current_folder() {
        assert_eq!(parent_of(Path::new("last")), PathBuf::from("."));
        assert_eq!(parent_of(Path::new("checkpoint/last")), PathBuf::from("checkpoint"));
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_as_far_as_the_umask_allows() {
        use std::os::unix::fs::PermissionsExt;
        let parent = tempfile::tempdir().unwrap();
        let ours = new_beside(&parent.path().join("last")).unwrap();
        let plain = parent.path().join("plain");
        std::fs::create_dir(&plain).unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(ours.path()), mode(&plain));
    }
}
