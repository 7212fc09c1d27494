//! Append-only files, written in complete pieces.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{Result, RunError, file, folder};

/// An append-only file. Each piece is passed to the operating system at once, so that other processes
/// see it; a partially written piece is removed again.
#[derive(Debug)]
pub(super) struct AppendFile {
    path: PathBuf,
    file: File,
    length: u64,
}

impl AppendFile {
    /// Opens the file for appending; creates it if there is none.
    pub fn open(path: &Path) -> Result<Self> {
        let is_new = !path.exists();
        let file = Self::of(file::open_append(path).map_err(RunError::io("write", path))?, path)?;
        if is_new {
            // Later syncs of the content are useless unless the name is durable as well.
            folder::sync(&folder::parent_of(path))?;
        }
        Ok(file)
    }

    fn of(file: File, path: &Path) -> Result<Self> {
        let length = file.metadata().map_err(RunError::io("read", path))?.len();
        Ok(Self { path: path.to_path_buf(), file, length })
    }

    /// Appends `bytes` as one piece.
    pub fn append(&mut self, bytes: &[u8]) -> Result<()> {
        match self.file.write_all(bytes) {
            Ok(()) => {
                self.length += bytes.len() as u64;
                Ok(())
            }
            Err(source) => {
                // Best effort: half a line would make the next line unreadable as well.
                let _ = self.file.set_len(self.length);
                Err(RunError::Io { action: "write", path: self.path.clone(), source })
            }
        }
    }

    /// Appends a value as a line of JSON.
    pub fn append_json(&mut self, value: &impl Serialize) -> Result<()> {
        let mut line =
            serde_json::to_vec(value).map_err(|source| RunError::Encode { what: "a line".into(), source })?;
        line.push(b'\n');
        self.append(&line)
    }

    /// Ends the last line if another process left it incomplete.
    pub fn end_line(&mut self) -> Result<()> {
        let last_byte = || -> std::io::Result<[u8; 1]> {
            let mut last = [b'\n'];
            let mut file = file::open(&self.path)?;
            if file.metadata()?.len() > 0 {
                file.seek(SeekFrom::End(-1))?;
                file.read_exact(&mut last)?;
            }
            Ok(last)
        };
        match last_byte().map_err(RunError::io("read", &self.path))? {
            [b'\n'] => Ok(()),
            _ => self.append(b"\n"),
        }
    }

    /// Truncates the file to `length` bytes.
    pub fn cut(&mut self, length: u64) -> Result<()> {
        self.file.set_len(length).map_err(RunError::io("shorten", &self.path))?;
        self.length = length;
        Ok(())
    }

    /// Whether the file is empty.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Waits until everything is on disk.
    pub fn sync(&self) -> Result<()> {
        self.file.sync_data().map_err(RunError::io("write", &self.path))
    }

    /// A file on a device that is always full.
    #[cfg(test)]
    #[cfg(target_os = "linux")]
    pub fn on_a_full_disk() -> Self {
        let path = Path::new("/dev/full");
        Self::of(File::options().append(true).open(path).unwrap(), path).unwrap()
    }

    /// The path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn appends_across_openings_and_cuts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        let mut file = AppendFile::open(&path).unwrap();
        assert!(file.is_empty());
        file.append(b"one\n").unwrap();
        drop(file);
        let mut file = AppendFile::open(&path).unwrap();
        file.append(b"two\n").unwrap();
        file.cut(4).unwrap();
        file.append(b"three\n").unwrap();
        file.sync().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"one\nthree\n");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_an_error_with_the_path_and_the_remedy() {
        let mut file = AppendFile::on_a_full_disk();
        let text = file.append(b"one\n").unwrap_err().to_string();
        assert!(text.starts_with("cannot write /dev/full: "), "{text}");
        assert!(text.contains("free some space"), "{text}");
    }
}
