//! The folder of a run: paths, configuration, lock.

use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use rustix::io::Errno;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::file::{check_format, parse_json};
use super::log::{EventReader, read_tail};
use super::status::{RunState, RunStatus};
use super::store::CheckpointStore;
use super::{Result, RunError, file, folder};
use mge_base::atomic::{self, parent_of};
use mge_base::identity::{self, sha256};

/// The format of a run folder that this program writes, and the newest that it reads.
pub const FORMAT: u64 = 1;

const LOCK: &str = "lock";
/// Time between two attempts to lock a file.
const LOCK_INTERVAL: Duration = Duration::from_millis(10);
const MODEL: &str = "model.safetensors";

/// `config.json`.
#[derive(Serialize, Deserialize)]
struct Saved<C> {
    format: u64,
    mge_version: String,
    config: C,
}

/// The folder of a run, for reading. Writing requires a [`RunWriter`](super::RunWriter).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunDirectory {
    path: PathBuf,
}

impl RunDirectory {
    /// Creates a new run in `path`, a folder that is empty or does not exist yet.
    ///
    /// `config` should contain every setting, including defaults, so that the run can be repeated
    /// by a program whose defaults have changed.
    ///
    /// # Errors
    /// [`RunError::AlreadyARun`] or [`RunError::NotEmpty`], with nothing changed;
    /// [`RunError::Io`] if the folder cannot be written.
    pub fn create(path: impl Into<PathBuf>, config: &impl Serialize) -> Result<Self> {
        Self::create_with_model(path, config, None)
    }

    /// As [`create`](Self::create), with the file of a dynamics model.
    ///
    /// # Errors
    /// As [`create`](Self::create).
    pub fn create_with_model(path: impl Into<PathBuf>, config: &impl Serialize, model: Option<&[u8]>) -> Result<Self> {
        let directory = Self { path: path.into() };
        let path = &directory.path;
        directory.make_room()?;
        fs::create_dir_all(path).map_err(RunError::io("create", path))?;
        let _lock = directory.lock()?;
        // Another process may have been faster.
        directory.refuse_existing()?;
        directory.write_config(config, model)?;
        // The folder's own name should survive a power failure as well.
        folder::sync(parent_of(path))?;
        Ok(directory)
    }

    /// The run in `path`, which is created if there is none; another process may do the same.
    ///
    /// # Errors
    /// As [`RunDirectory::open`] and [`RunDirectory::create`].
    pub fn open_or_create(path: &Path, config: &impl Serialize) -> Result<Self> {
        Self::open_or(path, || Self::create(path, config))
    }

    /// The run in `path`, or else what `create` makes there; another process may do the same.
    ///
    /// # Errors
    /// As [`RunDirectory::open`] and `create`.
    pub fn open_or<E: From<RunError>>(path: &Path, create: impl FnOnce() -> Result<Self, E>) -> Result<Self, E> {
        match Self::open(path) {
            // If that fails, another process may have been faster.
            Err(RunError::NotARun(_)) => create().or_else(|error| Self::open(path).map_err(|_| error)),
            opened => Ok(opened?),
        }
    }

    /// The run in a folder, without any check.
    pub fn at(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    fn refuse_existing(&self) -> Result<()> {
        if self.config_path().exists() { Err(RunError::AlreadyARun(self.path.clone())) } else { Ok(()) }
    }

    /// Makes sure that a run can be created here. What is left of a run without its configuration, as of an
    /// interrupted deletion, is moved to the trash.
    ///
    /// # Errors
    /// [`RunError::AlreadyARun`] or [`RunError::NotEmpty`], with nothing changed; [`RunError::Io`].
    pub fn make_room(&self) -> Result<()> {
        if self.has_remains()? {
            let _lock = self.lock()?;
            // Another process may have been faster.
            if self.has_remains()? {
                super::trash::discard(&self.path)?;
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

    /// Whether the folder has what is left of a run; an error if it has anything else.
    fn has_remains(&self) -> Result<bool> {
        self.refuse_existing()?;
        let names = match self.names() {
            Err(error) if error.is_not_found() => return Ok(false),
            names => names?,
        };
        // A process that was killed while it created the run leaves at most its lock: creation is then completed.
        match names.iter().all(|name| name == LOCK) {
            true => Ok(false),
            false if is_of_a_run(&names) => Ok(true),
            false => Err(RunError::NotEmpty(self.path.clone())),
        }
    }

    /// The names in the folder, without temporary ones.
    fn names(&self) -> Result<Vec<String>> {
        let names = self.contents()?.into_iter().map(|(name, _)| name);
        Ok(names.filter(|name| !atomic::is_temporary(name)).collect())
    }

    /// Moves the run, with everything in its folder, to the trash. Returns where it is now.
    ///
    /// # Errors
    /// [`RunError::InUse`]; [`RunError::Io`]. Then nothing has changed.
    pub fn discard(&self) -> Result<PathBuf> {
        folder::check(&self.path)?;
        let _lock = self.lock()?;
        super::trash::discard(&self.path)
    }

    /// What is in a folder and can be deleted as a run: one with a configuration that `is_valid` accepts, or a damaged
    /// one, if the folder has nothing but the files of a run.
    ///
    /// # Errors
    /// [`RunError::NotARun`], [`RunError::Malformed`] and others: why it is not a run.
    pub fn deletable(path: impl Into<PathBuf>, is_valid: impl FnOnce(&Self) -> Result<()>) -> Result<Self> {
        let directory = Self { path: path.into() };
        folder::check(&directory.path)?;
        let checked = directory.config_bytes().and_then(|_| is_valid(&directory));
        let is_damaged = || directory.names().is_ok_and(|names| is_of_a_run(&names));
        checked.or_else(|error| if is_damaged() { Ok(()) } else { Err(error) })?;
        Ok(directory)
    }

    /// Opens the run in `path` for reading.
    ///
    /// # Errors
    /// [`RunError::NotARun`] if there is no `config.json`, [`RunError::UnknownFormat`] if it is
    /// newer than this program.
    pub fn open(path: impl Into<PathBuf>) -> Result<Self> {
        let directory = Self { path: path.into() };
        directory.config_bytes()?;
        Ok(directory)
    }

    /// The configuration of the run.
    ///
    /// # Errors
    /// [`RunError::Malformed`] with the position in `config.json`.
    pub fn config<C: DeserializeOwned>(&self) -> Result<C> {
        Ok(parse_json::<Saved<C>>(&self.config_path(), &self.config_bytes()?)?.config)
    }

    /// Whether it is of a dynamics model in a sweep instead of an agent.
    ///
    /// # Errors
    /// As [`RunDirectory::config`].
    pub fn is_of_model(&self) -> Result<bool> {
        let config: serde_json::Value = self.config()?;
        // The tools of a model are a list; those of an agent are the name of a split.
        let settings = ["model", "training", "evaluation"];
        Ok(config.get("tools").is_some_and(serde_json::Value::is_array)
            && settings.iter().all(|key| config.get(key).is_some_and(serde_json::Value::is_object)))
    }

    /// Returns an error if it is of a dynamics model.
    ///
    /// # Errors
    /// [`RunError::OfModel`], or as [`RunDirectory::config`].
    pub fn refuse_model(&self) -> Result<()> {
        if self.is_of_model()? { Err(RunError::OfModel(self.path.clone())) } else { Ok(()) }
    }

    /// Replaces the configuration of a run that is not being trained, for example to add episodes.
    ///
    /// # Errors
    /// [`RunError::InUse`]; [`RunError::Io`] if it cannot be written; then it is unchanged.
    pub fn replace_config(&self, config: &impl Serialize) -> Result<()> {
        let _lock = self.lock()?;
        self.write_config(config, None)
    }

    /// Writes the configuration, after the file of the model to which it refers, if given.
    pub(super) fn write_config(&self, config: &impl Serialize, model: Option<&[u8]>) -> Result<()> {
        if let Some(bytes) = model {
            let path = self.model_path();
            atomic::write(&path, bytes).map_err(RunError::io("write", &path))?;
        }
        let saved = Saved { format: FORMAT, mge_version: identity::version().into(), config };
        file::write_json(&self.config_path(), "the configuration", &saved)
    }

    fn config_bytes(&self) -> Result<Vec<u8>> {
        let path = self.config_path();
        let bytes = file::read(&path).map_err(|error| match error {
            RunError::Io { source, .. } if matches!(source.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                RunError::NotARun(self.path.clone())
            }
            error => error,
        })?;
        check_format(&path, &bytes, FORMAT)?;
        Ok(bytes)
    }

    /// Whether a process trains the run, how it ended, and its progress. Cheap even for a long
    /// run: usually only the ends of files are read.
    ///
    /// # Errors
    /// [`RunError::Io`] if the lock or the log cannot be read.
    pub fn status(&self) -> Result<RunStatus> {
        // Try with a few events, then with more, finally with all.
        const TAILS: [u64; 3] = [1 << 12, 1 << 16, u64::MAX];
        let locked = self.is_locked()?;
        let mut status = RunStatus::derive(&[], locked);
        for tail in TAILS {
            status = RunStatus::derive(&read_tail(&self.events_path(), tail)?, locked);
            if status.is_decided() {
                break;
            }
        }
        let episode = status.last_episode.as_ref().map_or(0, |record| record.episode);
        if status.state == RunState::Finished
            && !locked
            && let Some(reason) = self.missing(episode)?
        {
            status.state = RunState::Incomplete(reason);
        }
        Ok(status)
    }

    /// Locks the run for writing, until the lock is dropped.
    ///
    /// # Errors
    /// [`RunError::InUse`] if another process, or another part of this one, holds the lock.
    pub fn lock(&self) -> Result<RunLock> {
        let path = self.path.join(LOCK);
        // Readers of the status hold the lock for a moment.
        // The folder is gone if the run was deleted meanwhile.
        let missing = |error: RunError| if error.is_not_found() { RunError::NotARun(self.path.clone()) } else { error };
        let file = exclusive(&path, true, Duration::from_millis(200)).map_err(missing)?;
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

    /// Checks that no process holds the run's lock, without waiting for it.
    ///
    /// # Errors
    /// [`RunError::InUse`] if one does; [`RunError::Io`] if the lock cannot be read.
    pub fn check_free(&self) -> Result<()> {
        if self.is_locked()? { Err(self.in_use()) } else { Ok(()) }
    }

    fn in_use(&self) -> RunError {
        let text = file::read(&self.path.join(LOCK)).ok().and_then(|text| String::from_utf8(text).ok());
        RunError::InUse { path: self.path.clone(), process: text.and_then(|text| text.trim().parse().ok()) }
    }

    /// Whether a process holds the run's lock.
    ///
    /// # Errors
    /// [`RunError::Io`] if the lock cannot be read.
    pub fn is_locked(&self) -> Result<bool> {
        let path = self.path.join(LOCK);
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

    /// The text of `prior.json`; none if the run has no action clusters.
    ///
    /// # Errors
    /// [`RunError::Io`] if it cannot be read.
    pub fn read_prior(&self) -> Result<Option<String>> {
        let bytes = file::read_optional(&self.prior_path())?;
        Ok(bytes.map(|bytes| String::from_utf8_lossy(&bytes).into_owned()))
    }

    /// A reader of the event log, from its beginning.
    pub fn events(&self) -> EventReader {
        EventReader::new(self.events_path())
    }

    /// The checkpoints.
    pub fn checkpoints(&self) -> CheckpointStore {
        CheckpointStore::new(self.path.join("checkpoint"))
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// `config.json`
    pub fn config_path(&self) -> PathBuf {
        self.path.join("config.json")
    }

    /// `events.jsonl`
    pub fn events_path(&self) -> PathBuf {
        self.path.join("events.jsonl")
    }

    /// `metrics.csv`
    pub fn metrics_path(&self) -> PathBuf {
        self.path.join("metrics.csv")
    }

    /// `episodes.jsonl`.
    pub fn episodes_path(&self) -> PathBuf {
        self.path.join("episodes.jsonl")
    }

    /// `model.safetensors`: the copy of the dynamics model that the run uses, if that is in a file.
    pub fn model_path(&self) -> PathBuf {
        self.path.join(MODEL)
    }

    /// `prior.json`
    pub fn prior_path(&self) -> PathBuf {
        self.path.join("prior.json")
    }

    /// `log.txt`.
    pub fn log_path(&self) -> PathBuf {
        self.path.join("log.txt")
    }

    /// `control.jsonl`
    pub fn requests_path(&self) -> PathBuf {
        self.path.join("control.jsonl")
    }

    /// `notes.json`
    pub fn notes_path(&self) -> PathBuf {
        self.path.join("notes.json")
    }

    /// The last lines of `log.txt`, the oldest first; none if there is no log yet.
    ///
    /// # Errors
    /// [`RunError::Io`] if it cannot be read.
    pub fn log_tail(&self, lines: usize) -> Result<Vec<String>> {
        /// Approximate bytes per line.
        const LINE: u64 = 200;
        let (bytes, is_whole) = file::read_end(&self.log_path(), LINE * lines as u64)?;
        // Unless this is the beginning of the file, the first line may be incomplete.
        let start = bytes.iter().position(|byte| *byte == b'\n').filter(|_| !is_whole).map_or(0, |end| end + 1);
        let text = String::from_utf8_lossy(&bytes[start..]);
        let all: Vec<&str> = text.lines().collect();
        Ok(all[all.len().saturating_sub(lines)..].iter().map(|line| (*line).to_owned()).collect())
    }

    /// The files and folders in the run's folder, sorted by name, with the sizes of files in bytes.
    ///
    /// # Errors
    /// [`RunError::Io`] if the folder cannot be read.
    pub fn contents(&self) -> Result<Vec<(String, Option<u64>)>> {
        let mut contents = Vec::new();
        for entry in fs::read_dir(&self.path).map_err(RunError::io("read", &self.path))? {
            let entry = entry.map_err(RunError::io("read", &self.path))?;
            let name = entry.file_name().to_string_lossy().into_owned();
            let size = entry.metadata().ok().filter(fs::Metadata::is_file).map(|data| data.len());
            contents.push((name, size));
        }
        contents.sort();
        Ok(contents)
    }

    /// `tensorboard/`
    pub fn tensorboard_path(&self) -> PathBuf {
        self.path.join("tensorboard")
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
        thread::sleep(LOCK_INTERVAL);
    }
}

/// Whether an error of locking a file means that its file system has no locks.
fn has_no_locks(error: &std::io::Error) -> bool {
    matches!(Errno::from_io_error(error), Some(Errno::NOSYS | Errno::OPNOTSUPP | Errno::NOLCK | Errno::INVAL))
}

/// Whether an open file is the one at a path.
fn is_at(file: &File, path: &Path) -> bool {
    let (Ok(held), Ok(found)) = (file.metadata(), fs::symlink_metadata(path)) else { return false };
    (held.dev(), held.ino()) == (found.dev(), found.ino())
}

/// Whether these names, of everything in a folder, are those of a run: all of them are names of its files, and one is
/// not likely in another folder.
fn is_of_a_run(names: &[String]) -> bool {
    const DISTINCT: &str = "episodes.jsonl events.jsonl lock tensorboard";
    const OTHERS: &str = "checkpoint config.json control.jsonl figures log.txt metrics.csv model.safetensors \
                          model.safetensors.checkpoint notes.json prior.json result.json";
    let is_in = |list: &str, name: &String| list.split(' ').any(|known| known == name);
    names.iter().any(|name| is_in(DISTINCT, name))
        && names.iter().all(|name| is_in(DISTINCT, name) || is_in(OTHERS, name))
}

/// The lock on a run for writing; released when dropped or when the process ends.
#[derive(Debug)]
pub struct RunLock {
    file: File,
    path: PathBuf,
}

impl RunLock {
    /// Whether the lock file is still in place; false if the run was moved or deleted.
    pub(super) fn is_in_place(&self) -> bool {
        is_at(&self.file, &self.path)
    }
}

/// Twelve hexadecimal digits that identify a configuration in the metadata of figures and reports.
///
/// # Errors
/// [`RunError::Encode`] if the configuration has no JSON form.
pub fn config_hash(config: &impl Serialize) -> Result<String> {
    let text =
        serde_json::to_vec(config).map_err(|source| RunError::Encode { what: "the configuration".into(), source })?;
    Ok(sha256(&text)[..12].to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Config {
        seed: u64,
        epsilon: f64,
    }

    const CONFIG: Config = Config { seed: 3, epsilon: 0.1 };

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
    fn config_is_versioned_and_round_trips() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs/a");
        let run = RunDirectory::create(&path, &CONFIG).unwrap();
        let text = fs::read_to_string(run.config_path()).unwrap();
        let golden = "{\n  \"format\": 1,\n  \"mge_version\": \"VERSION\",\n  \"config\": {\n    \
                      \"seed\": 3,\n    \"epsilon\": 0.1\n  }\n}\n";
        assert_eq!(text.replace(identity::version(), "VERSION"), golden);

        let run = RunDirectory::open(&path).unwrap();
        assert_eq!(run.config::<Config>().unwrap(), CONFIG);
        assert_eq!(run.status().unwrap().state, RunState::NotStarted);
        assert_eq!(config_hash(&CONFIG).unwrap(), "474a4553bc16", "figures contain this hash");
        assert_ne!(config_hash(&CONFIG).unwrap(), config_hash(&Config { seed: 4, ..CONFIG }).unwrap());
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
    fn folders_in_place_of_files_are_errors_and_not_treated_as_missing() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path().join("a"), &CONFIG).unwrap();
        assert!(!run.is_locked().unwrap(), "nobody has trained it");
        fs::remove_file(run.path().join(LOCK)).unwrap();
        assert!(!run.is_locked().unwrap());
        fs::create_dir(run.path().join(LOCK)).unwrap();
        assert!(matches!(run.is_locked(), Err(RunError::Io { .. })));
        fs::remove_file(run.config_path()).unwrap();
        assert!(matches!(RunDirectory::open(run.path()), Err(RunError::NotARun(_))));
        fs::create_dir(run.config_path()).unwrap();
        assert!(matches!(RunDirectory::open(run.path()), Err(RunError::Io { .. })));
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

    fn check_refused(config: &str, expected: &str) {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("config.json"), config).unwrap();
        let error = RunDirectory::open(folder.path()).and_then(|run| run.config::<Config>()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
        assert!(error.contains("config.json"), "{error}");
    }

    #[test]
    fn folders_that_are_not_runs_are_refused_by_name() {
        check_refused(r#"{"format": 9, "new": 1}"#, "has format 9, and this program reads formats 1 to 1");
        check_refused(r#"{"format": 0}"#, "has format 0");
        check_refused("{\"format\": 1,\n!", "line 2");
        check_refused(
            r#"{"format": 1, "mge_version": "0.1.0", "config": {"seed": 1, "epsilon": "high"}}"#,
            "config.epsilon: invalid type",
        );
        let error = RunDirectory::open("nowhere/at/all").unwrap_err().to_string();
        assert_eq!(error, "nowhere/at/all is not a run: it has no config.json");
    }

    #[test]
    fn a_run_in_use_is_refused_until_it_is_released() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path(), &CONFIG).unwrap();
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
