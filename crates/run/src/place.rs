//! What a folder holds in which a run is to be created, replaced or deleted. Nothing is touched that the program did
//! not write: a file whose name could as well be that of a user's is recognised by its content.

use std::path::PathBuf;

use super::lock::LOCK;
use super::{Result, RunDirectory, RunError, file, folder, metrics, trash};
use mge_base::atomic;

impl RunDirectory {
    /// Makes sure that a run can be created here. What is left of a run without its configuration is moved to the
    /// trash.
    ///
    /// # Errors
    /// [`RunError::AlreadyARun`] or [`RunError::NotEmpty`], with nothing changed; [`RunError::Io`].
    pub fn make_room(&self) -> Result<()> {
        if self.has_remains()? {
            let _lock = self.lock()?;
            // Another process may have been faster.
            if self.has_remains()? {
                trash::discard(self.path())?;
            }
        }
        Ok(())
    }

    /// Checks that a run can be created here, and changes nothing. Another process may just have created it.
    ///
    /// # Errors
    /// [`RunError::NotEmpty`]; [`RunError::Io`].
    pub fn check_room(&self) -> Result<()> {
        match self.has_remains() {
            Err(RunError::AlreadyARun(_)) => Ok(()),
            checked => checked.map(drop),
        }
    }

    /// Whether the folder has what is left of a run without its configuration, such as an interrupted deletion leaves;
    /// false for one that does not exist or has nothing, but for the lock of a process that was killed while it created a
    /// run.
    ///
    /// # Errors
    /// [`RunError::AlreadyARun`] if it has a run, perhaps with further files of the user, or one whose configuration is
    /// damaged; [`RunError::NotEmpty`] if it has anything else; [`RunError::Io`].
    pub(super) fn has_remains(&self) -> Result<bool> {
        let names = match self.names() {
            Err(error) if error.is_not_found() => return Ok(false),
            names => names?,
        };
        let is_of_a_run = self.is_of_a_run(&names);
        if self.config_bytes().is_ok() || (is_of_a_run && names.iter().any(|name| name == "config.json")) {
            return Err(RunError::AlreadyARun(self.path().to_owned()));
        }
        if names.iter().all(|name| name == LOCK && self.is_recognised(name)) {
            return Ok(false);
        }
        if is_of_a_run { Ok(true) } else { Err(RunError::NotEmpty(self.path().to_owned())) }
    }

    /// What is in a folder and can be deleted as a run: one with a configuration that `is_valid` accepts, or a damaged
    /// one, if the folder has nothing but the files of a run.
    ///
    /// # Errors
    /// [`RunError::NotARun`], [`RunError::Malformed`] and others: why it is not a run.
    pub fn deletable(path: impl Into<PathBuf>, is_valid: impl FnOnce(&Self) -> Result<()>) -> Result<Self> {
        let directory = Self::at(&path.into());
        folder::check(directory.path())?;
        let checked = directory.config_bytes().and_then(|_| is_valid(&directory));
        let is_of_a_run = || directory.names().is_ok_and(|names| directory.is_of_a_run(&names));
        checked.or_else(|error| if is_of_a_run() { Ok(()) } else { Err(error) })?;
        Ok(directory)
    }

    /// Moves the run, with everything in its folder, to the trash. Returns where it is now.
    ///
    /// # Errors
    /// [`RunError::InUse`]; [`RunError::Io`]. Then nothing has changed.
    pub fn discard(&self) -> Result<PathBuf> {
        folder::check(self.path())?;
        let _lock = self.lock()?;
        trash::discard(self.path())
    }

    /// The names in the folder, without temporary ones.
    fn names(&self) -> Result<Vec<String>> {
        let names = self.contents()?.into_iter().map(|(name, _)| name);
        Ok(names.filter(|name| !atomic::is_temporary(name)).collect())
    }

    /// Whether these names, of everything in the folder, are those of a run's files, and one of them is recognised.
    fn is_of_a_run(&self, names: &[String]) -> bool {
        const FILES: [&str; 15] = [
            "checkpoint",
            "config.json",
            "control.jsonl",
            "episodes.jsonl",
            "events.jsonl",
            "figures",
            LOCK,
            "log.txt",
            "metrics.csv",
            "model.safetensors",
            "model.safetensors.checkpoint",
            "notes.json",
            "prior.json",
            "result.json",
            "tensorboard",
        ];
        names.iter().all(|name| FILES.contains(&name.as_str())) && names.iter().any(|name| self.is_recognised(name))
    }

    /// Whether the file of this name can only be one of a run: by its name, or else by its content.
    fn is_recognised(&self, name: &str) -> bool {
        let bytes = || file::read(&self.path().join(name)).unwrap_or_default();
        match name {
            "episodes.jsonl" | "events.jsonl" | "tensorboard" => true,
            // The id of a process, unless that was killed before it wrote it.
            LOCK => file::read(&self.path().join(name)).is_ok_and(|id| id.iter().all(u8::is_ascii_digit)),
            "metrics.csv" => metrics::is_table(&bytes()),
            "log.txt" => is_log(&bytes()),
            "control.jsonl" => bytes().trim_ascii_start().starts_with(b"{\"format\":1,\"time\":"),
            "notes.json" => self.notes().is_ok(),
            "checkpoint" => self.checkpoints().episodes().is_ok_and(|episodes| !episodes.is_empty()),
            _ => false,
        }
    }
}

/// Whether a text begins like `log.txt`, with the time of its first line.
fn is_log(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let time = text.strip_prefix('[').and_then(|rest| rest.split_once(" s] ")).map(|(time, _)| time.trim());
    time.is_some_and(|time| time.parse::<f64>().is_ok())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const CONFIG: &str = "config";

    #[test]
    fn several_processes_may_create_the_same_run() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        let made: Vec<_> = std::thread::scope(|scope| {
            let make = || RunDirectory::open_or_create(&path, &CONFIG).map(|run| run.path().to_owned());
            let threads: Vec<_> = (0..8).map(|_| scope.spawn(make)).collect();
            threads.into_iter().map(|thread| thread.join().unwrap()).collect()
        });
        for run in made {
            assert!(matches!(&run, Ok(made) if *made == path) || matches!(run, Err(RunError::InUse { .. })), "{run:?}");
        }
        fs::write(folder.path().join("note.txt"), "").unwrap();
        let taken = RunDirectory::open_or_create(folder.path(), &CONFIG);
        assert!(matches!(taken, Err(RunError::NotEmpty(_))), "{taken:?}");
    }

    #[test]
    fn a_new_folder_may_contain_only_leftovers_of_a_killed_process() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(LOCK), "12").unwrap();
        RunDirectory::create(folder.path(), &CONFIG).unwrap();
        let other = tempfile::tempdir().unwrap();
        fs::write(other.path().join("notes"), "").unwrap();
        assert!(matches!(RunDirectory::create(other.path(), &CONFIG), Err(RunError::NotEmpty(_))));
    }

    #[test]
    fn nothing_is_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        RunDirectory::create(folder.path(), &CONFIG).unwrap();
        let error = RunDirectory::create(folder.path(), &CONFIG).unwrap_err();
        assert!(matches!(error, RunError::AlreadyARun(_)), "{error}");

        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("thesis.tex"), "x").unwrap();
        let error = RunDirectory::create(folder.path(), &CONFIG).unwrap_err();
        assert!(matches!(error, RunError::NotEmpty(_)), "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);

        let below_a_file = folder.path().join("thesis.tex/run");
        let error = RunDirectory::create(&below_a_file, &CONFIG).unwrap_err().to_string();
        assert!(error.contains("thesis.tex/run"), "{error}");
    }

    #[test]
    fn files_with_common_names_are_recognised_by_their_content() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        let run = RunDirectory::create(&path, &CONFIG).unwrap();
        let mut writer = crate::RunWriter::open(&run, 0).unwrap();
        for event in [crate::Event::EpisodeFinished(Default::default()), crate::Event::Paused { episode: 0 }] {
            writer.record(&event).unwrap();
        }
        run.request(&crate::Request::Stop).unwrap();
        run.change_notes(|notes| notes.note = "mine".to_owned()).unwrap();
        let save = [crate::CheckpointAction::Save(crate::CheckpointName::Last)];
        run.checkpoints().apply(&save, &crate::Checkpoint::new(0)).unwrap();
        drop(writer);
        for name in ["metrics.csv", "log.txt", "notes.json", "checkpoint", "control.jsonl", LOCK] {
            let other = folder.path().join(name);
            let has_remains = |from: &std::path::Path| {
                fs::create_dir(&other).unwrap();
                fs::rename(from, other.join(name)).unwrap();
                let has_remains = RunDirectory::at(&other).has_remains();
                fs::remove_dir_all(&other).unwrap();
                has_remains
            };
            assert_eq!(has_remains(&path.join(name)).unwrap(), name != LOCK, "{name}");
            let mine = folder.path().join("mine");
            if name == "checkpoint" {
                fs::create_dir_all(mine.join("last"))
            } else {
                fs::write(&mine, "{\"mine\": 1}")
            }
            .unwrap();
            assert!(matches!(has_remains(&mine), Err(RunError::NotEmpty(_))), "{name}");
        }
        assert!(matches!(run.has_remains(), Err(RunError::AlreadyARun(_))));
        fs::write(run.config_path(), "{").unwrap();
        assert!(matches!(run.has_remains(), Err(RunError::AlreadyARun(_))), "a damaged run");
        fs::write(path.join("thesis.tex"), "mine").unwrap();
        assert!(matches!(run.has_remains(), Err(RunError::NotEmpty(_))));
    }
}
