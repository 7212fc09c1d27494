//! Files that a person names, read whole: what never ends is an error, and takes neither all memory nor
//! for ever.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Bytes of a text at most.
pub(crate) const TEXT: u64 = 16 << 20;
/// Bytes of a dynamics model at most.
pub(crate) const MODEL: u64 = 1 << 30;

/// All bytes of a file.
///
/// # Errors
/// When it cannot be read, or has more than `most` bytes.
pub(crate) fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("it is larger than {} MB", most >> 20)));
    }
    Ok(bytes)
}

/// The text in a file.
///
/// # Errors
/// As [`read`] with [`TEXT`], and when it is no text.
pub(crate) fn read_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read(path, TEXT)?)
        .map_err(|error| io::Error::new(io::ErrorKind::InvalidData, format!("it is no text: {}", error.utf8_error())))
}

/// Refuses folders, and pipes and devices, which might keep a reader waiting: for those who must not wait.
///
/// # Errors
/// When there is no file, or no regular one.
pub(crate) fn regular(path: &Path) -> io::Result<()> {
    if path.metadata()?.is_file() {
        return Ok(());
    }
    Err(io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file but a pipe, a device or a folder"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_large_or_no_text_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("text");
        std::fs::write(&path, b"four").unwrap();
        assert_eq!(read(&path, 4).unwrap(), b"four");
        assert_eq!(read(&path, 3).unwrap_err().kind(), io::ErrorKind::FileTooLarge);
        assert_eq!(read_text(&path).unwrap(), "four");
        std::fs::write(&path, b"\xff").unwrap();
        assert_eq!(read_text(&path).unwrap_err().kind(), io::ErrorKind::InvalidData);
        assert_eq!(read_text(&folder.path().join("none")).unwrap_err().kind(), io::ErrorKind::NotFound);
        assert!(regular(&path).is_ok());
        assert_eq!(regular(folder.path()).unwrap_err().kind(), io::ErrorKind::InvalidInput);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_file_without_end_ends() {
        let error = read_text(Path::new("/dev/zero")).unwrap_err();
        assert_eq!(error.to_string(), "it is larger than 16 MB");
        assert!(regular(Path::new("/dev/zero")).is_err());
    }
}
