//! The trash: deleted runs, in the folder `.trash` beside them, until the user empties it.
//!
//! A deletion is one rename, so that a run is always either whole in its place or whole in the trash. It is
//! `.trash/N/NAME` there, where `N` counts the deletions.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::{Result, RunDirectory, RunError, folder};
use mge_base::paths::entries;

const TRASH: &str = ".trash";

impl RunDirectory {
    /// What is in a folder and can be deleted as a run: one with a configuration that `is_valid` accepts, or one without,
    /// if it has the log of a run.
    ///
    /// # Errors
    /// [`RunError::NotARun`], [`RunError::Malformed`] and others: why it is not a run.
    pub fn deletable(path: &Path, is_valid: impl FnOnce(&Self) -> Result<()>) -> Result<Self> {
        let directory = Self::at(path);
        folder::check(directory.path())?;
        match directory.config_bytes().and_then(|_| is_valid(&directory)) {
            Err(error) if !directory.events_path().is_file() => Err(error),
            _ => Ok(directory),
        }
    }

    /// Moves the run, with everything in its folder, to the trash, as part of one deletion `with` what was moved there
    /// before, if that is possible. Returns where it is now.
    ///
    /// # Errors
    /// [`RunError::InUse`]; [`RunError::Io`]. Then nothing has changed.
    pub fn discard(&self, with: Option<&Path>) -> Result<PathBuf> {
        folder::check(self.path())?;
        let _lock = self.lock()?;
        let (trash, from) = trash_of(self.path())?;
        folder::create(&trash)?;
        let name = from.file_name().unwrap_or_default();
        let mut number = numbers(&trash)?.max().unwrap_or(0);
        let with = with.and_then(Path::parent).filter(|with| with.parent() == Some(&trash) && with.is_dir());
        let place = loop {
            if let Some(with) = with.filter(|with| !with.join(name).exists()) {
                break with.to_owned();
            }
            number += 1;
            let place = trash.join(number.to_string());
            match fs::create_dir(&place) {
                Ok(()) => break place,
                // Another process was faster.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(RunError::io("create", &place)(error)),
            }
        };
        let to = place.join(name);
        if let Err(error) = fs::rename(&from, &to) {
            let _ = fs::remove_dir(&place);
            return Err(RunError::io("delete", self.path())(error));
        }
        folder::sync(&place)?;
        folder::sync(&trash)?;
        Ok(to)
    }
}

/// Moves the run that was last deleted from `path` back to it.
///
/// # Errors
/// [`RunError::Refused`] if it is not in the trash, or something has taken its place; [`RunError::Io`].
pub fn restore(path: &Path) -> Result<()> {
    let (from, to) = trashed(path)?;
    if to.exists() {
        let what = format!("{} exists: move it elsewhere, then restore the run", path.display());
        return Err(RunError::Refused(what));
    }
    fs::rename(&from, &to).map_err(RunError::io("restore", path))?;
    // Fails if others were deleted together with it, or the user has added something there.
    let _ = from.parent().map(fs::remove_dir);
    folder::sync(to.parent().unwrap_or(&to))
}

/// Where the run that was last deleted from `path` is, and the absolute path of its former place.
///
/// # Errors
/// [`RunError::Refused`] if it is not in the trash; [`RunError::Io`].
pub fn trashed(path: &Path) -> Result<(PathBuf, PathBuf)> {
    let missing = || RunError::Refused(format!("{} is not in the trash", path.display()));
    let (trash, to) = trash_of(path)?;
    let name = to.file_name().ok_or_else(missing)?;
    let places = numbers(&trash)?.map(|number| (number, trash.join(number.to_string()).join(name)));
    let (_, from) = places.filter(|(_, place)| place.exists()).max().ok_or_else(missing)?;
    Ok((from, to))
}

/// The former places of the deleted runs of a folder of runs, by deletion, the last one first.
///
/// # Errors
/// [`RunError::Io`].
pub fn deletions(folder: &Path) -> Result<Vec<Vec<PathBuf>>> {
    let trash = folder.join(TRASH);
    let mut numbers: Vec<u64> = numbers(&trash)?.collect();
    numbers.sort_unstable();
    let runs = |number: &u64| entries(&trash.join(number.to_string())).unwrap_or_default();
    // A user may have put files there.
    let place = |run: PathBuf| Some(folder.join(run.file_name().filter(|_| run.is_dir())?));
    let all = numbers.iter().rev().map(|number| runs(number).into_iter().filter_map(place).collect());
    Ok(all.filter(|together: &Vec<PathBuf>| !together.is_empty()).collect())
}

/// Removes the runs in the trash of a folder of runs for good, and returns their number. What a user has put into the
/// trash itself stays.
///
/// # Errors
/// [`RunError::Io`]: there is no such folder, or some of them are left.
pub fn empty_trash(folder: &Path) -> Result<usize> {
    fs::metadata(folder).map_err(RunError::io("read", folder))?;
    let trash = folder.join(TRASH);
    folder::check(&trash)?;
    let count = deletions(folder)?.concat().len();
    for number in numbers(&trash)? {
        let place = trash.join(number.to_string());
        fs::remove_dir_all(&place).map_err(RunError::io("remove", &place))?;
    }
    // Fails if the user has added something there.
    let _ = fs::remove_dir(&trash);
    Ok(count)
}

/// The trash for a run, and the absolute path of the run: `.` and a folder named with `..` have no name to keep.
fn trash_of(path: &Path) -> Result<(PathBuf, PathBuf)> {
    let absolute = match fs::canonicalize(path) {
        // Its folder exists, if it has been deleted.
        Err(error) if error.kind() == ErrorKind::NotFound => std::path::absolute(path),
        found => found,
    };
    let absolute = absolute.map_err(RunError::io("find", path))?;
    let parent = absolute.parent().ok_or_else(|| RunError::NotARun(path.to_owned()))?;
    Ok((parent.join(TRASH), absolute))
}

/// The numbers of the deletions in the trash.
fn numbers(trash: &Path) -> Result<impl Iterator<Item = u64>> {
    let entries = entries(trash).map_err(RunError::io("read", trash))?;
    Ok(entries.into_iter().filter_map(|entry| entry.file_name()?.to_str()?.parse().ok()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deleted_run_is_whole_in_the_trash_and_can_be_restored() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        let delete = |note: &str| {
            let run = RunDirectory::create(&path, &note).unwrap();
            fs::write(path.join("thesis.tex"), note).unwrap();
            run.discard(None).unwrap()
        };
        let places = ["first", "second"].map(delete);
        assert_eq!(places, [1, 2].map(|number| path.with_file_name(".trash").join(number.to_string()).join("run")));
        assert_eq!(fs::read_to_string(places[0].join("thesis.tex")).unwrap(), "first");
        restore(&path).unwrap();
        assert_eq!(RunDirectory::open(&path).unwrap().config::<String>().unwrap(), "second");
        assert!(matches!(restore(&path), Err(RunError::Refused(_))));
        assert!(matches!(restore(&path.with_file_name("other")), Err(RunError::Refused(_))));
        assert!(matches!(restore(&folder.path().join("no/run")), Err(RunError::Refused(_))));
        let last = RunDirectory::open(&path).unwrap().discard(Some(&places[0])).unwrap();
        let other = RunDirectory::create(path.with_file_name("other"), &"third").unwrap();
        assert_eq!(other.discard(Some(&last)).unwrap(), last.with_file_name("other"));
        assert_eq!(deletions(folder.path()).unwrap()[0], [path.with_file_name("other"), path.clone()]);
        assert!(path.with_file_name(".trash/2/run").exists(), "the last deletion has the largest number");
        let mine = folder.path().join(".trash/mine");
        fs::write(&mine, "mine").unwrap();
        assert_eq!(empty_trash(folder.path()).unwrap(), 3);
        assert_eq!(fs::read_dir(folder.path().join(".trash")).unwrap().count(), 1, "the user's file");
        fs::remove_file(mine).unwrap();
        assert_eq!([(); 2].map(|()| empty_trash(folder.path()).unwrap()), [0, 0]);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_locked_run_and_a_link_are_not_deleted() {
        let folder = tempfile::tempdir().unwrap();
        let [path, link] = ["run", "link"].map(|name| folder.path().join(name));
        let run = RunDirectory::create(&path, &"config").unwrap();
        let lock = run.lock().unwrap();
        assert!(matches!(run.discard(None), Err(RunError::InUse { .. })));
        drop(lock);
        std::os::unix::fs::symlink(&path, &link).unwrap();
        assert!(RunDirectory::open(&link).unwrap().discard(None).is_err());
        assert!(run.config_path().exists());
    }
}
