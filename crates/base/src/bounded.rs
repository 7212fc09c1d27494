//! Reads files named by the user into memory, up to a size limit, so that an endless file is an error instead of
//! exhausting memory or time.

use std::fs::File;
use std::io::{self, Read};
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

use crate::text::without_mark;

/// Largest text file, in bytes.
pub const TEXT: u64 = 16 << 20;
/// Largest dynamics model, in bytes.
pub const MODEL: u64 = 1 << 30;

/// Opens a file named by the user for reading. Named pipes, which may have no writer, are refused; other pipes, such as
/// of `<(..)` in a shell, have one.
///
/// # Errors
/// When it cannot be opened, or is a named pipe.
pub fn open(path: &Path) -> io::Result<File> {
    // Other pipes have no path.
    let named = path.canonicalize().and_then(|place| place.metadata());
    if named.is_ok_and(|data| data.file_type().is_fifo()) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "a named pipe, not a file"));
    }
    File::open(path).map_err(in_plain_words)
}

/// The error of a read, in plain words if nothing or a folder is there.
pub fn in_plain_words(error: io::Error) -> io::Error {
    match error.kind() {
        kind @ io::ErrorKind::NotFound => io::Error::new(kind, "it does not exist"),
        kind @ io::ErrorKind::IsADirectory => io::Error::new(kind, "it is a folder"),
        _ => error,
    }
}

/// All bytes of a file.
///
/// # Errors
/// When the file cannot be read, or has more than `most` bytes.
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.take(most + 1).read_to_end(&mut bytes).map_err(in_plain_words)?;
    if bytes.len() as u64 > most {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("it is larger than {} MB", most >> 20)));
    }
    Ok(bytes)
}

/// The text in a file, without a byte-order mark.
///
/// # Errors
/// As [`read`] with [`TEXT`], and when the file is not UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    let invalid = |reason: String| io::Error::new(io::ErrorKind::InvalidData, reason);
    let bytes = read(path, TEXT)?;
    let text = std::str::from_utf8(without_mark(&bytes));
    text.map(str::to_owned).map_err(|error| invalid(format!("not UTF-8 text: {error}")))
}

/// Refuses folders, and pipes and devices, on which a read might block.
///
/// # Errors
/// When there is no file, or it is not a regular file.
pub fn regular(path: &Path) -> io::Result<()> {
    if path.metadata().map_err(in_plain_words)?.is_file() {
        return Ok(());
    }
    Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file, but a pipe, a device or a folder"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_too_large_or_not_text_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text");
        std::fs::write(&path, b"four").unwrap();
        assert_eq!(read(&path, 4).unwrap(), b"four");
        assert_eq!(read(&path, 3).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        assert_eq!(read_text(&path).unwrap(), "four");
        std::fs::write(&path, "\u{feff}four").unwrap();
        assert_eq!(read_text(&path).unwrap(), "four");
        std::fs::write(&path, b"\xff").unwrap();
        assert_eq!(read_text(&path).unwrap_err().kind(), io::ErrorKind::InvalidData);
        assert_eq!(read_text(&folder.path().join("none")).unwrap_err().kind(), io::ErrorKind::NotFound);
        assert!(regular(&path).is_ok());
        assert_eq!(regular(folder.path()).unwrap_err().kind(), io::ErrorKind::InvalidInput);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_pipe_is_read_unless_it_is_named() {
        use std::process::{Command, Stdio};
        let folder = tempfile::tempdir().unwrap();
        let [pipe, link] = ["pipe", "link"].map(|name| folder.path().join(name));
        assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        assert_eq!(read(&link, 9).unwrap_err().kind(), io::ErrorKind::InvalidInput);
        let mut echo = Command::new("echo").arg("text").stdout(Stdio::piped()).spawn().unwrap();
        let output = std::os::fd::AsRawFd::as_raw_fd(echo.stdout.as_ref().unwrap());
        assert_eq!(read(Path::new(&format!("/dev/fd/{output}")), 9).unwrap(), b"text\n");
        echo.wait().unwrap();
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn an_endless_file_is_refused() {
        let error = read_text(Path::new("/dev/zero")).unwrap_err();
        assert_eq!(error.to_string(), "it is larger than 16 MB");
        assert!(regular(Path::new("/dev/zero")).is_err());
    }
}
