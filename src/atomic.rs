//! Atomic file writes: a file is written beside its place, synced and renamed.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

/// Replaces the file at `path` with `bytes`, or leaves what was there.
///
/// # Errors
/// When the folder does not exist, is not writable, or the disk is full.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    // Not `tempfile_in`: its files are private, and its errors name the temporary file.
    let mut builder = tempfile::Builder::new();
    let created = builder.prefix(".mge-").make_in(folder, |path| File::create_new(path));
    let mut file = created.map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => io::Error::new(io::ErrorKind::NotFound, "its folder does not exist"),
        _ => error,
    })?;
    file.as_file_mut().write_all(bytes)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|error| error.error)?;
    File::open(folder)?.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
