//! Atomic file writes: the new content goes to a temporary file in the same folder, is synced, and is renamed over
//! the target, so that the target holds either the whole new content or the old. The names of temporary files and
//! folders are decided here, which of them are leftovers, and whether a file that the user named may be replaced
//! ([`Target`]).

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, TempDir, TempPath};

use crate::bounded;

/// The names of temporary files and folders: a prefix, random letters and digits, a suffix. Together they are so
/// unlikely to be the name of a user's file that leftovers can be removed by their names.
const TEMPORARY: (&str, usize, &str) = (".mge-", 10, ".tmp");

/// Replaces the file at `path` with `bytes`, or leaves it unchanged on error. Also removes temporary files that
/// killed writers left in the folder.
///
/// # Errors
/// When the folder does not exist or is not writable, the disk is full, or `path` is a pipe or a device, which must
/// not be replaced.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    if let Err(error) = bounded::regular(path)
        && error.kind() == io::ErrorKind::InvalidInput
        && !path.is_dir()
    {
        return Err(error);
    }
    let folder = parent_of(path);
    remove_leftovers(folder);
    let (mut file, temporary) = create(folder)?;
    file.write_all(bytes)?;
    file.sync_all()?;
    std::fs::rename(&temporary, path)?;
    // The temporary name no longer exists, so nothing is to be removed.
    let _ = temporary.keep();
    drop(file);
    File::open(folder)?.sync_all()
}

/// A format of files that the program writes.
#[derive(Clone, Copy)]
pub struct Format<'a> {
    /// What such a file is, as in "not a task".
    pub name: &'a str,
    /// Whether the content of a file has the format.
    pub is: &'a dyn Fn(&[u8]) -> bool,
}

/// A file to write, or a folder of files to write, named by the user.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    /// Where it is.
    pub path: PathBuf,
    /// Whether files of any format are replaced; otherwise only those in the format of the new one.
    pub force: bool,
}

impl<P: AsRef<Path> + ?Sized> From<&P> for Target {
    fn from(path: &P) -> Self {
        Self { path: path.as_ref().to_owned(), force: false }
    }
}

impl From<&Target> for Target {
    fn from(target: &Self) -> Self {
        target.clone()
    }
}

impl Target {
    /// A file in the folder.
    pub fn join(&self, name: impl AsRef<Path>) -> Self {
        Self { path: self.path.join(name), force: self.force }
    }

    /// Checks that a file in the format may be written here: an existing file is replaced only if it has the format.
    ///
    /// # Errors
    /// When it has not, is not a regular file, or cannot be read.
    pub fn check(&self, format: &Format<'_>) -> io::Result<()> {
        if self.force && !self.path.is_dir() {
            return Ok(());
        }
        match bounded::regular(&self.path).and_then(|()| bounded::read(&self.path, bounded::MODEL)) {
            Ok(found) if (format.is)(&found) => Ok(()),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
            Err(error) => Err(error),
            Ok(_) => {
                let remedy = "choose another name, or replace it with `--force` (in commands and scripts, `force`)";
                let reason = format!("it exists and is not {} written by this program: {remedy}", format.name);
                Err(io::Error::new(io::ErrorKind::AlreadyExists, reason))
            }
        }
    }

    /// Writes the file, after [`Target::check`].
    ///
    /// # Errors
    /// As for [`Target::check`] and [`write()`].
    pub fn write(&self, bytes: &[u8], format: &Format<'_>) -> io::Result<()> {
        self.check(format)?;
        write(&self.path, bytes)
    }
}

/// The folder that holds `path`; "." for a bare name.
pub fn parent_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Creates the folder that holds `path`.
///
/// # Errors
/// When it cannot be created.
pub fn create_parent(path: &Path) -> io::Result<()> {
    std::fs::create_dir_all(parent_of(path))
}

/// Creates a temporary file. It stays locked while it is open: an unlocked one is a leftover.
fn create(folder: &Path) -> io::Result<(File, TempPath)> {
    loop {
        // Not `tempfile_in`: its files are private, and its errors name the temporary file.
        let created = temporary().make_in(folder, |path| File::create_new(path));
        let created = created.map_err(|error| match error.kind() {
            io::ErrorKind::NotFound if folder.is_dir() => io::Error::other("its folder takes no new files"),
            io::ErrorKind::NotFound => io::Error::new(io::ErrorKind::NotFound, "its folder does not exist"),
            _ => error,
        })?;
        let (file, temporary) = created.into_parts();
        // Where files cannot be locked, `remove_leftovers` cannot lock it either and leaves it alone.
        let held = file.lock().is_ok();
        // Another writer may have removed it as a leftover before it was locked.
        if !held || temporary.exists() {
            return Ok((file, temporary));
        }
    }
}

/// Names for temporary files and folders.
fn temporary() -> Builder<'static, 'static> {
    let (prefix, random, suffix) = TEMPORARY;
    let mut builder = Builder::new();
    builder.prefix(prefix).rand_bytes(random).suffix(suffix);
    builder
}

/// Whether this is the name of a temporary file or folder, of a live or a killed writer.
pub fn is_temporary(name: &str) -> bool {
    let (prefix, random, suffix) = TEMPORARY;
    let inner = name.strip_prefix(prefix).and_then(|rest| rest.strip_suffix(suffix));
    inner.is_some_and(|inner| inner.len() == random && inner.bytes().all(|byte| byte.is_ascii_alphanumeric()))
}

/// A folder to be filled and then renamed; removed if dropped before.
#[derive(Debug)]
pub struct NewFolder {
    folder: TempDir,
    /// The folder itself, locked: an unlocked one is a leftover.
    _lock: File,
}

impl NewFolder {
    /// Creates a folder in `parent`.
    pub fn create(parent: &Path) -> io::Result<Self> {
        loop {
            let folder = temporary().tempdir_in(parent)?;
            // Another writer may have removed it as a leftover before it was locked.
            let lock = match File::open(folder.path()) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                opened => opened?,
            };
            // As for files, one that cannot be locked is left alone.
            let held = lock.lock().is_ok();
            if !held || folder.path().exists() {
                return Ok(Self { folder, _lock: lock });
            }
        }
    }

    /// Where it is for now.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Gives it its final name, which may be that of an empty folder.
    pub fn rename(self, to: &Path) -> io::Result<()> {
        std::fs::rename(self.path(), to)?;
        // The temporary name no longer exists, so nothing is to be removed.
        let _ = self.folder.keep();
        Ok(())
    }

    /// Removes it now.
    pub fn close(self) -> io::Result<()> {
        self.folder.close()
    }
}

/// Removes the temporary files and folders of killed writers. What cannot be removed is left: it does no harm.
pub fn remove_leftovers(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten().filter(|entry| is_temporary(&entry.file_name().to_string_lossy())) {
        let (path, Ok(kind)) = (entry.path(), entry.file_type()) else { continue };
        if !kind.is_file() && !kind.is_dir() {
            continue;
        }
        let Ok(file) = File::open(&path) else { continue };
        // The lock is held during the removal: a writer that has just created this file waits for the lock, finds the
        // file removed, and creates another.
        if file.try_lock().is_ok() {
            let _ = if kind.is_dir() { std::fs::remove_dir_all(&path) } else { std::fs::remove_file(&path) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bare_names_are_in_the_current_folder() {
        assert_eq!(parent_of(Path::new("last")), Path::new("."));
        assert_eq!(parent_of(Path::new("checkpoint/last")), Path::new("checkpoint"));
    }

    #[test]
    fn a_file_of_another_format_is_replaced_only_by_force() {
        let folder = tempfile::tempdir().unwrap();
        let format = Format { name: "a list", is: &|found| found.starts_with(b"list") };
        let target = Target::from(folder.path()).join("file");
        for content in [b"list 1", b"list 2"] {
            target.write(content, &format).unwrap();
            assert_eq!(std::fs::read(&target.path).unwrap(), content);
        }
        std::fs::write(&target.path, "mine").unwrap();
        let error = target.write(b"list 3", &format).unwrap_err().to_string();
        assert!(error.contains("is not a list written by this program") && error.contains("--force"), "{error}");
        assert_eq!(std::fs::read(&target.path).unwrap(), b"mine");
        Target { force: true, ..target.clone() }.write(b"list 3", &format).unwrap();
        assert_eq!(std::fs::read(&target.path).unwrap(), b"list 3");
    }

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

    #[test]
    #[cfg(target_os = "linux")]
    fn pipes_and_devices_are_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let [pipe, link] = ["pipe", "link"].map(|name| folder.path().join(name));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        std::os::unix::fs::symlink("/dev/null", &link).unwrap();
        for path in [&pipe, &link] {
            let before = path.symlink_metadata().unwrap().file_type();
            assert_eq!(write(path, b"text").unwrap_err().kind(), io::ErrorKind::InvalidInput);
            assert_eq!(path.symlink_metadata().unwrap().file_type(), before);
        }
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn leftovers_of_a_killed_writer_go_and_files_being_written_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path(".mge-DeadFile00.tmp"), "half").unwrap();
        std::fs::create_dir(path(".mge-DeadFolder.tmp")).unwrap();
        std::fs::write(path(".mge-DeadFolder.tmp").join("file"), "half").unwrap();
        let held = File::create(path(".mge-HeldFile00.tmp")).unwrap();
        held.lock().unwrap();
        let filled = NewFolder::create(folder.path()).unwrap();
        let users = [".mge-HeldFile00.tmp", ".mge-backup", ".mge-notes-of-mine", ".mge-notes.tmp"];
        users[1..].iter().for_each(|name| std::fs::write(path(name), "mine").unwrap());
        write(&path("a"), b"whole").unwrap();
        filled.rename(&path("b")).unwrap();
        let mut left = names(folder.path());
        left.sort();
        assert_eq!(left, [&users[..], &["a", "b"]].concat());
    }

    #[test]
    fn writers_in_one_folder_do_not_disturb_each_other() {
        let folder = tempfile::tempdir().unwrap();
        std::thread::scope(|scope| {
            for number in 0..4 {
                let path = folder.path().join(format!("file{number}"));
                scope.spawn(move || (0..50).for_each(|_| write(&path, b"whole").unwrap()));
            }
        });
        assert_eq!(names(folder.path()).len(), 4);
    }

    #[test]
    fn a_write_that_fails_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        std::fs::create_dir(&path).unwrap();
        assert!(write(&path, b"new").is_err(), "a folder is in its place");
        assert_eq!(names(folder.path()), ["taken"]);
    }
}
