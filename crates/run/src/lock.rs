//! The lock of a run: one process at a time writes it. A copy of a run by hard links, such as by `cp -al`, shares the
//! file of the lock until one of them replaces it by its own.

use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use rustix::io::Errno;

use super::{Result, RunDirectory, RunError, file};
use mge_base::atomic;

/// The name of the file.
pub(super) const LOCK: &str = "lock";
/// Time between two attempts to lock a file.
const INTERVAL: Duration = Duration::from_millis(10);
/// Others hold a lock for a moment only, if they do not train the run: readers of the status, and the writer of a copy.
const PATIENCE: Duration = Duration::from_millis(200);

/// The lock on a run for writing; released when dropped or when the process ends.
#[derive(Debug)]
pub struct RunLock {
    pub(super) file: File,
    pub(super) path: PathBuf,
}

impl RunDirectory {
    /// Locks the run for writing, until the lock is dropped.
    ///
    /// # Errors
    /// [`RunError::InUse`] if another process, or another part of this one, holds the lock.
    pub fn lock(&self) -> Result<RunLock> {
        let path = self.lock_path();
        // The folder is gone if the run was deleted meanwhile.
        let missing =
            |error: RunError| if error.is_not_found() { RunError::NotARun(self.path().into()) } else { error };
        let file = exclusive(&path, true, PATIENCE).map_err(missing)?;
        let Some(mut file) = file else { return Err(self.in_use()) };
        file.set_len(0).map_err(RunError::io("write", &path))?;
        write!(file, "{}", std::process::id()).map_err(RunError::io("write", &path))?;
        Ok(RunLock { file, path })
    }

    /// Does some work while no other process does such work on the run, which may be in training.
    ///
    /// # Errors
    /// [`RunError::Io`] if others go on doing so, or if the work fails.
    pub(super) fn in_turn<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let path = self.config_path();
        let others = || RunError::io("lock", &path)(ErrorKind::TimedOut.into());
        let _lock = match exclusive(&path, false, Duration::from_secs(10)) {
            Ok(lock) => Some(lock.ok_or_else(others)?),
            // Then the processes only have to be a little apart.
            Err(RunError::NoLocks(_)) => None,
            Err(error) => return Err(error),
        };
        work()
    }

    /// Checks that no process trains the run, and changes nothing.
    ///
    /// # Errors
    /// [`RunError::InUse`] if one does; [`RunError::Io`] if the lock cannot be read.
    pub fn check_free(&self) -> Result<()> {
        let since = Instant::now();
        while self.is_locked()? {
            if since.elapsed() >= PATIENCE {
                return Err(self.in_use());
            }
            thread::sleep(INTERVAL);
        }
        Ok(())
    }

    /// Whether a process holds the run's lock.
    ///
    /// # Errors
    /// [`RunError::Io`] if the lock cannot be read.
    pub fn is_locked(&self) -> Result<bool> {
        let path = self.lock_path();
        let file = match file::open(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(false),
            Err(error) => return Err(RunError::io("read", &path)(error)),
        };
        match file.try_lock_shared() {
            Ok(()) => Ok(false),
            Err(TryLockError::WouldBlock) => Ok(true),
            // Where nothing can be locked, nothing is trained.
            Err(TryLockError::Error(error)) if has_no_locks(&error) => Ok(false),
            Err(TryLockError::Error(error)) => Err(RunError::io("lock", &path)(error)),
        }
    }

    fn in_use(&self) -> RunError {
        let text = file::read(&self.lock_path()).ok().and_then(|text| String::from_utf8(text).ok());
        RunError::InUse { path: self.path().to_owned(), process: text.and_then(|text| text.trim().parse().ok()) }
    }

    fn lock_path(&self) -> PathBuf {
        self.path().join(LOCK)
    }
}

/// Opens and locks a file; none if others hold the lock all the time. A file that is also in another folder, such as
/// after `cp -al`, is first replaced by a new one, so that each has its own lock.
fn exclusive(path: &Path, create: bool, patience: Duration) -> Result<Option<File>> {
    let since = Instant::now();
    loop {
        let file = file::open_write(path, create).map_err(RunError::io("write", path))?;
        match file.try_lock() {
            Ok(()) if !is_at(&file, path) => {}
            Ok(()) if file.metadata().map_err(RunError::io("read", path))?.nlink() == 1 => return Ok(Some(file)),
            Ok(()) => atomic::write(path, &file::read(path)?).map_err(RunError::io("write", path))?,
            Err(TryLockError::WouldBlock) => {}
            Err(TryLockError::Error(error)) if has_no_locks(&error) => return Err(RunError::NoLocks(path.to_owned())),
            Err(TryLockError::Error(error)) => return Err(RunError::io("lock", path)(error)),
        }
        if since.elapsed() >= patience {
            return Ok(None);
        }
        thread::sleep(INTERVAL);
    }
}

/// Whether an error of locking a file means that its file system has no locks.
fn has_no_locks(error: &std::io::Error) -> bool {
    matches!(Errno::from_io_error(error), Some(Errno::NOSYS | Errno::OPNOTSUPP | Errno::NOLCK | Errno::INVAL))
}

/// Whether an open file is the one at a path.
pub(super) fn is_at(file: &File, path: &Path) -> bool {
    let (Ok(held), Ok(found)) = (file.metadata(), fs::symlink_metadata(path)) else { return false };
    (held.dev(), held.ino()) == (found.dev(), found.ino())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RunState;

    #[test]
    fn a_run_in_use_is_refused_until_it_is_released() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path(), &"config").unwrap();
        let lock = run.lock().unwrap();
        assert_eq!(run.status().unwrap().state, RunState::Running);
        let error = run.lock().unwrap_err();
        let own = std::process::id();
        assert!(matches!(error, RunError::InUse { process: Some(id), .. } if id == own), "{error}");
        drop(lock);
        assert_eq!(run.status().unwrap().state, RunState::NotStarted);
        run.lock().unwrap();
    }
}
