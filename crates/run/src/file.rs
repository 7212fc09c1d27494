//! Opening the files of a run, which must be regular files in its folder. A link would make a writer
//! change another file, and a pipe would block a reader forever, so both are rejected.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use rustix::fs::OFlags;
use rustix::io::Errno;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::{Result, RunError};
use mge_base::atomic;
use mge_base::json;

/// Opens a file for reading.
pub(super) fn open(path: &Path) -> io::Result<File> {
    open_with(OpenOptions::new().read(true), path)
}

/// Opens a file for appending; creates it if there is none.
pub(super) fn open_append(path: &Path) -> io::Result<File> {
    open_with(OpenOptions::new().create(true).append(true), path)
}

/// Opens a file for overwriting without truncating it; may create it if there is none.
pub(super) fn open_write(path: &Path, create: bool) -> io::Result<File> {
    open_with(OpenOptions::new().create(create).write(true).truncate(false), path)
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

/// All bytes of a file; `None` if there is no such file.
pub fn read_optional(path: &Path) -> Result<Option<Vec<u8>>> {
    match read(path) {
        Err(error) if error.is_not_found() => Ok(None),
        found => found.map(Some),
    }
}

/// The last `most` bytes of a file; none if there is no such file.
pub(super) fn read_end(path: &Path, most: u64) -> Result<Vec<u8>> {
    let read = || -> io::Result<Vec<u8>> {
        let mut file = open(path)?;
        file.seek(SeekFrom::Start(file.metadata()?.len().saturating_sub(most)))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    match read() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        found => found.map_err(RunError::io("read", path)),
    }
}

/// The part of a text before a half-written last line.
pub(super) fn whole_lines(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
    &bytes[..end]
}

/// A value as a line of JSON.
pub(super) fn json_line(value: &impl Serialize) -> Vec<u8> {
    let mut line = serde_json::to_vec(value).expect("plain data");
    line.push(b'\n');
    line
}

/// Replaces a file by a value as indented JSON.
pub(super) fn write_json(path: &Path, value: &impl Serialize) -> Result<()> {
    atomic::write(path, json::pretty(value).as_bytes()).map_err(RunError::io("write", path))
}

/// Rejects a JSON file whose `format` is not in 1 to `supported`. Call this before parsing the rest
/// of it.
pub(super) fn check_format(path: &Path, bytes: &[u8], supported: u64) -> Result<()> {
    #[derive(Deserialize)]
    struct Format {
        format: u64,
    }
    let Format { format: found } = parse_json(path, bytes)?;
    if (1..=supported).contains(&found) {
        Ok(())
    } else {
        let path = path.display();
        let what = format!("{path} has format {found}, and this program reads formats 1 to {supported}: update mge");
        Err(RunError::Refused(what))
    }
}

/// Parses a JSON file; the error names the position in it.
pub(super) fn parse_json<T: DeserializeOwned>(path: &Path, bytes: &[u8]) -> Result<T> {
    json::parse(bytes, "").map_err(|error| {
        let at = if error.path == "." { String::new() } else { format!("{}: ", error.path) };
        let line = (error.line > 0).then_some(error.line as u64);
        RunError::Malformed { path: path.to_path_buf(), line, reason: at + &error.message }
    })
}

fn open_with(options: &mut OpenOptions, path: &Path) -> io::Result<File> {
    let irregular =
        || io::Error::new(io::ErrorKind::InvalidInput, "not a regular file, but a link, a pipe or a folder");
    // Do not wait for the other end of a pipe.
    options.custom_flags((OFlags::NOFOLLOW | OFlags::NONBLOCK).bits() as i32);
    let file = options.open(path).map_err(|error| match Errno::from_io_error(&error) {
        Some(Errno::LOOP | Errno::NXIO) => irregular(),
        _ => error,
    })?;
    if file.metadata()?.is_file() { Ok(file) } else { Err(irregular()) }
}

#[cfg(test)]
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
            for opened in [open(path), open_append(path), open_write(path, true)] {
                assert!(opened.is_err(), "{}", path.display());
            }
        }
        // The system's own errors would not tell what is wrong.
        let irregular = "not a regular file, but a link, a pipe or a folder";
        for path in [&link, &pipe, Path::new("/dev/null"), folder.path()] {
            let error = read(path).unwrap_err().to_string();
            assert!(error.ends_with(irregular), "{error}");
        }
        let error = open_write(&pipe, true).unwrap_err().to_string();
        assert_eq!(error, irregular, "nobody reads the pipe");
        assert_eq!(read(&file).unwrap(), b"kept");
        assert!(read(&folder.path().join("none")).unwrap_err().is_not_found());
    }
}
