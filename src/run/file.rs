//! Opening the files of a run, which must be regular files in its folder. A link would make a writer
//! change another file, and a pipe would block a reader forever, so both are rejected.

use std::fs::{File, OpenOptions};
use std::io::{self, Read};
use std::path::Path;

use super::{Result, RunError};

/// Opens a file for reading.
pub(super) fn open(path: &Path) -> io::Result<File> {
    open_with(OpenOptions::new().read(true), path)
}

/// Opens a file for appending; creates it if there is none.
pub(super) fn open_append(path: &Path) -> io::Result<File> {
    open_with(OpenOptions::new().create(true).append(true), path)
}

/// Opens a file for overwriting without truncating it; creates it if there is none.
pub(super) fn open_write(path: &Path) -> io::Result<File> {
    open_with(OpenOptions::new().create(true).write(true).truncate(false), path)
}

/// All bytes of a file.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    let read = || {
        let mut bytes = Vec::new();
        open(path)?.read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    read().map_err(RunError::io("read", path))
}

fn open_with(options: &mut OpenOptions, path: &Path) -> io::Result<File> {
    let irregular =
        || io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file but a link, a pipe or a folder");
    #[cfg(unix)]
    let file = {
        use std::os::unix::fs::OpenOptionsExt;

        use rustix::fs::OFlags;
        use rustix::io::Errno;

        // Do not wait for the other end of a pipe.
        options.custom_flags((OFlags::NOFOLLOW | OFlags::NONBLOCK).bits() as i32);
        options.open(path).map_err(|error| match Errno::from_io_error(&error) {
            Some(Errno::LOOP | Errno::NXIO) => irregular(),
            _ => error,
        })?
    };
    #[cfg(not(unix))]
    let file = {
        if std::fs::symlink_metadata(path).is_ok_and(|found| !found.is_file()) {
            return Err(irregular());
        }
        options.open(path)?
    };
    if file.metadata()?.is_file() { Ok(file) } else { Err(irregular()) }
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use std::os::unix::fs::symlink;
    use std::process::Command;

    use super::*;

    #[test]
    fn links_pipes_devices_and_folders_are_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, pipe] = ["file", "link", "pipe"].map(|name| folder.path().join(name));
        std::fs::write(&file, "kept").unwrap();
        symlink(&file, &link).unwrap();
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for path in [&link, &pipe, Path::new("/dev/null"), folder.path()] {
            for opened in [open(path), open_append(path), open_write(path)] {
                assert!(opened.is_err(), "{}", path.display());
            }
        }
        // The system's own errors would not tell what is wrong.
        let irregular = "it is no regular file but a link, a pipe or a folder";
        for path in [&link, &pipe, Path::new("/dev/null"), folder.path()] {
            let error = read(path).unwrap_err().to_string();
            assert!(error.ends_with(irregular), "{error}");
        }
        let error = open_write(&pipe).unwrap_err().to_string();
        assert_eq!(error, irregular, "nobody reads the pipe");
        assert_eq!(read(&file).unwrap(), b"kept");
        assert!(read(&folder.path().join("none")).unwrap_err().is_not_found());
    }
}
