//! Locks: of values, ignoring poisoning; of folders, between processes.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Locks a mutex, even if it is poisoned: the values behind this crate's mutexes are replaced as a whole, or by a single
/// call such as a push, so a panic cannot leave them inconsistent.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Pause between two attempts to lock a folder.
const RETRY: Duration = Duration::from_millis(20);

/// Waits until no other process writes a set of files into a folder that belong together, and keeps others from it
/// while the result is held. None if `waits`, asked before every pause, gave up. Where folders cannot be locked, there
/// is no protection.
///
/// # Errors
/// When the folder cannot be opened.
pub fn hold_folder(folder: &Path, mut waits: impl FnMut() -> bool) -> io::Result<Option<File>> {
    let folder = File::open(folder)?;
    while let Err(TryLockError::WouldBlock) = folder.try_lock() {
        if !waits() {
            return Ok(None);
        }
        std::thread::sleep(RETRY);
    }
    Ok(Some(folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_held_by_one_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let held = hold_folder(folder.path(), || true).unwrap();
        let mut asked = 0;
        let second = hold_folder(folder.path(), || {
            asked += 1;
            asked < 3
        });
        assert!(held.is_some() && second.unwrap().is_none() && asked == 3);
        drop(held);
        assert!(hold_folder(folder.path(), || false).unwrap().is_some());
    }
}
