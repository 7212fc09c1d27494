//! Append-only files, written in complete pieces.

use std::fs::File;
use std::io::Write;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{Result, RunError, file, folder};
use mge_base::atomic::{self, parent_of};

/// An append-only file. Each piece is passed to the operating system at once, so that other processes
/// see it; a partially written piece is removed again.
#[derive(Debug)]
pub(super) struct AppendFile {
    path: PathBuf,
    file: File,
}

impl AppendFile {
    /// Opens the file for appending; creates it if there is none. A file that is also in another folder, such as after
    /// `cp -al`, is first replaced by a copy, so that the other one does not change.
    pub fn open(path: &Path) -> Result<Self> {
        let is_new = !path.exists();
        let open = || file::open_append(path).map_err(RunError::io("write", path));
        let mut file = open()?;
        if file.metadata().map_err(RunError::io("read", path))?.nlink() > 1 {
            atomic::write(path, &file::read(path)?).map_err(RunError::io("write", path))?;
            file = open()?;
        }
        if is_new {
            // Later syncs of the content are useless unless the name is durable as well.
            folder::sync(parent_of(path))?;
        }
        Ok(Self { path: path.to_path_buf(), file })
    }

    /// Replaces the file by one with this content and opens that.
    pub fn anew(path: &Path, content: &[u8]) -> Result<Self> {
        atomic::write(path, content).map_err(RunError::io("write", path))?;
        Self::open(path)
    }

    /// Appends `bytes` as one piece.
    pub fn append(&mut self, bytes: &[u8]) -> Result<()> {
        // Not a length remembered from earlier: other processes may have appended in the meantime.
        let length = self.file.metadata().map_err(RunError::io("read", &self.path))?.len();
        self.file.write_all(bytes).map_err(|source| {
            // Best effort: half a line would make the next line unreadable as well.
            let _ = self.file.set_len(length);
            RunError::Io { action: "write", path: self.path.clone(), source }
        })
    }

    /// Appends a value as a line of JSON.
    pub fn append_json(&mut self, value: &impl Serialize) -> Result<()> {
        self.append(&file::json_line(value))
    }

    /// Removes everything after this many bytes.
    pub fn cut(&self, length: usize) -> Result<()> {
        self.file.set_len(length as u64).map_err(RunError::io("truncate", &self.path))
    }

    /// Waits until everything is on disk.
    pub fn sync(&self) -> Result<()> {
        self.file.sync_data().map_err(RunError::io("write", &self.path))
    }

    /// A file on a device that is always full.
    #[cfg(test)]
    #[cfg(target_os = "linux")]
    pub fn on_a_full_disk() -> Self {
        let path = PathBuf::from("/dev/full");
        Self { file: File::options().append(true).open(&path).unwrap(), path }
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
    fn a_failed_append_keeps_what_another_process_appended() {
        use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, memfd_create};

        let mut theirs = File::from(memfd_create("log", MemfdFlags::ALLOW_SEALING).unwrap());
        let mut ours = AppendFile { path: "log".into(), file: theirs.try_clone().unwrap() };
        theirs.write_all(b"theirs\n").unwrap();
        // As on a full disk, nothing can be appended any more.
        fcntl_add_seals(&theirs, SealFlags::GROW).unwrap();
        ours.append(b"ours\n").unwrap_err();
        assert_eq!(theirs.metadata().unwrap().len(), 7);
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
