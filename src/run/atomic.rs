//! Files that are either the old one or the new one, whatever happens in between.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile, TempDir};

use super::{Result, RunError};

/// Replaces the file at `path` by `bytes`, or creates it.
///
/// The bytes go to a temporary file in the same folder, are synced to the disk and renamed over
/// `path`; then the folder is synced. A crash leaves the old file or the new one.
///
/// # Errors
/// [`RunError::Io`] with `path`, if the folder does not exist, is read-only or full. The old file
/// is untouched then.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let file = written_beside(path, bytes)?;
    file.persist(path).map_err(|error| RunError::io("write", path)(error.error))?;
    sync_folder(&folder_of(path))
}

/// As [`write()`], but fails with [`std::io::ErrorKind::AlreadyExists`] if there is a file.
pub(super) fn write_if_new(path: &Path, bytes: &[u8]) -> Result<()> {
    let file = written_beside(path, bytes)?;
    file.persist_noclobber(path).map_err(|error| RunError::io("create", path)(error.error))?;
    sync_folder(&folder_of(path))
}

fn written_beside(path: &Path, bytes: &[u8]) -> Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".writing-");
    widen(&mut builder, 0o666);
    let mut file = builder.tempfile_in(folder_of(path)).map_err(RunError::io("write", path))?;
    file.write_all(bytes).map_err(RunError::io("write", path))?;
    file.as_file().sync_all().map_err(RunError::io("write", path))?;
    Ok(file)
}

/// A new folder beside `path`, to be filled and then renamed to it; removed if dropped before.
pub(super) fn folder_beside(path: &Path) -> Result<TempDir> {
    let mut builder = Builder::new();
    builder.prefix(".writing-");
    widen(&mut builder, 0o777);
    builder.tempdir_in(folder_of(path)).map_err(RunError::io("create a folder beside", path))
}

/// Writes a new file and syncs it. Atomic only as a part of a folder that is renamed afterwards.
pub(super) fn write_new(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = File::create_new(path).map_err(RunError::io("create", path))?;
    file.write_all(bytes).map_err(RunError::io("write", path))?;
    file.sync_all().map_err(RunError::io("write", path))
}

/// Makes created, renamed and removed names in a folder durable.
pub(super) fn sync_folder(folder: &Path) -> Result<()> {
    // Only unix can open a folder as a file; elsewhere the rename itself is all there is.
    if cfg!(unix) {
        let file = File::open(folder).map_err(RunError::io("sync", folder))?;
        file.sync_all().map_err(RunError::io("sync", folder))?;
    }
    Ok(())
}

/// The folder that holds `path`; "." for a bare name.
pub(super) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Temporary files are private to the user by default; files of a run follow the user's umask.
fn widen(builder: &mut Builder<'_, '_>, mode: u32) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = (builder, mode);
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn replaces_and_leaves_nothing_beside() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        write(&path, b"one").unwrap();
        write(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn failure_names_the_path_and_keeps_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        write(&file, b"old").unwrap();
        let below = file.join("below.json");
        let error = write(&below, b"new").unwrap_err();
        assert!(error.to_string().contains("below.json"), "{error}");
        assert_eq!(fs::read(&file).unwrap(), b"old");
    }

    #[test]
    fn bare_names_live_in_the_current_folder() {
        assert_eq!(folder_of(Path::new("a.json")), PathBuf::from("."));
        assert_eq!(folder_of(Path::new("runs/a.json")), PathBuf::from("runs"));
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_as_far_as_the_umask_allows() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        write(&ours, b"x").unwrap();
        fs::write(&plain, b"x").unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
    }
}
