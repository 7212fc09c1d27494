//! The folder of a run: paths and configuration.

use std::cmp::Reverse;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::checkpoint::Checkpoint;
use super::file::{check_format, parse_json};
use super::lock::LOCK;
use super::reader::{EventReader, read_tail};
use super::status::RunStatus;
use super::store::CheckpointStore;
use super::{Result, RunError, file, folder};
use mge_base::atomic::{self, parent_of};
use mge_base::identity::{self, sha256};

/// The format of a run folder that this program writes, and the newest that it reads.
pub const FORMAT: u64 = 1;

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
        directory.check_room()?;
        fs::create_dir_all(path).map_err(RunError::io("create", path))?;
        let _lock = directory.lock()?;
        // Another process may have been faster.
        directory.check_room()?;
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

    /// Checks that a run can be created here: there is no such folder, or it has nothing but the lock, and the model, of a
    /// process that was killed while it created a run.
    ///
    /// # Errors
    /// [`RunError::AlreadyARun`] or [`RunError::NotEmpty`]; [`RunError::Io`].
    pub fn check_room(&self) -> Result<()> {
        let mut names: Vec<String> = match self.contents() {
            Err(error) if error.is_not_found() => return Ok(()),
            contents => contents?.into_iter().map(|(name, _)| name).collect(),
        };
        names.retain(|name| !atomic::is_temporary(name));
        if self.config_bytes().is_ok() {
            return Err(RunError::AlreadyARun(self.path.clone()));
        }
        // Empty if that was killed before it wrote its id.
        let is_lock = || file::read(&self.path.join(LOCK)).is_ok_and(|id| id.iter().all(u8::is_ascii_digit));
        let is_left = names.iter().all(|name| name == LOCK || name == MODEL) && is_lock();
        if names.is_empty() || is_left { Ok(()) } else { Err(RunError::NotEmpty(self.path.clone())) }
    }

    /// The newest checkpoint from which the run can be continued, none if it has no checkpoint at all, and why newer ones
    /// cannot be used.
    ///
    /// # Errors
    /// Why none can be used.
    pub fn newest_checkpoint(&self) -> Result<(Option<Checkpoint>, Vec<RunError>)> {
        let store = self.checkpoints();
        let last = self.status()?.last_episode.map_or(0, |record| record.episode);
        let mut names = store.names()?;
        names.sort_by_key(|name| Reverse(store.episode_of(*name)));
        let (mut problems, mut failed) = (Vec::new(), None);
        for name in names {
            let of = store.episode_of(name);
            match store.load(name) {
                Ok(Checkpoint { episode, .. }) if episode > last => {
                    problems.push(RunError::LogTooShort { path: self.events_path(), last, checkpoint: episode });
                }
                Ok(checkpoint) => return Ok((Some(checkpoint), problems)),
                // The checkpoint of an episode may have several names.
                Err(problem) => problems.extend(Some(problem).filter(|_| of.is_none() || failed != of)),
            }
            failed = of;
        }
        problems.into_iter().next().map_or(Ok((None, Vec::new())), Err)
    }

    /// The run in a folder, without any check.
    pub fn at(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    /// Opens the run in `path` for reading.
    ///
    /// # Errors
    /// [`RunError::NotARun`] if there is no `config.json`, [`RunError::Refused`] if it is newer than this program.
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

    /// Whether it is of a dynamics model or a count of hits in a sweep instead of an agent.
    ///
    /// # Errors
    /// As [`RunDirectory::config`].
    pub fn is_of_model(&self) -> Result<bool> {
        let config: serde_json::Value = self.config()?;
        Ok(["policy", "training"].iter().any(|key| config.get(key).is_some()))
    }

    /// Returns an error if it is of a dynamics model or a count of hits.
    ///
    /// # Errors
    /// [`RunError::Refused`], or as [`RunDirectory::config`].
    pub fn refuse_model(&self) -> Result<()> {
        if !self.is_of_model()? {
            return Ok(());
        }
        let what =
            "a dynamics model or a count of hits of a sweep, not a run: `results.csv` of the sweep has its numbers";
        Err(RunError::Refused(format!("{} is {what}", self.path.display())))
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
        file::write_json(&self.config_path(), &saved)
    }

    pub(super) fn config_bytes(&self) -> Result<Vec<u8>> {
        let path = self.config_path();
        let bytes = file::read(&path).map_err(|error| match error {
            RunError::Io { source, .. } if matches!(source.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                RunError::NotARun(self.path.clone())
            }
            error => error,
        })?;
        check_format(&path, &bytes, FORMAT).map_err(|error| match error {
            RunError::Malformed { path, line, reason } => {
                let reason = reason + ": it is not the configuration of a run, or damaged: restore it from a copy";
                RunError::Malformed { path, line, reason }
            }
            error => error,
        })?;
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
            if status.last_episode.is_some() {
                break;
            }
        }
        Ok(status)
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

/// Twelve hexadecimal digits that identify a configuration in the metadata of figures and reports.
pub fn config_hash(config: &impl Serialize) -> String {
    sha256(&serde_json::to_vec(config).expect("plain data"))[..12].to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RunState;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Config {
        seed: u64,
        epsilon: f64,
    }

    const CONFIG: Config = Config { seed: 3, epsilon: 0.1 };

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
        assert_eq!(config_hash(&CONFIG), "474a4553bc16", "figures contain this hash");
        assert_ne!(config_hash(&CONFIG), config_hash(&Config { seed: 4, ..CONFIG }));
    }

    #[test]
    fn folders_in_place_of_files_are_errors_and_not_treated_as_missing() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create(folder.path().join("a"), &CONFIG).unwrap();
        assert!(!run.is_locked().unwrap(), "nobody has trained it");
        fs::remove_file(run.path().join("lock")).unwrap();
        assert!(!run.is_locked().unwrap());
        fs::create_dir(run.path().join("lock")).unwrap();
        assert!(matches!(run.is_locked(), Err(RunError::Io { .. })));
        fs::remove_file(run.config_path()).unwrap();
        assert!(matches!(RunDirectory::open(run.path()), Err(RunError::NotARun(_))));
        fs::create_dir(run.config_path()).unwrap();
        assert!(matches!(RunDirectory::open(run.path()), Err(RunError::Io { .. })));
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
        assert_eq!(error, "nowhere/at/all does not exist");
        let folder = tempfile::tempdir().unwrap();
        let error = RunDirectory::open(folder.path()).unwrap_err().to_string();
        assert!(error.ends_with(" is not a run: it has no config.json"), "{error}");
        let run = RunDirectory::create(folder.path().join("a"), &1).unwrap();
        run.change_notes(|notes| notes.name = "best".into()).unwrap();
        let error = RunDirectory::open(folder.path().join("best")).unwrap_err().to_string();
        assert!(error.ends_with("best does not exist"), "no other run is read for it: {error}");
    }
}
