//! Finds runs in folders and reads their training results.

use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::curve::score_equal_budgets;
use super::row::TrainedRun;
use super::settings::distinguish;
use mge_base::paths::entries;
use mge_base::text::natural_key;
use mge_figures::{Against, LearningCurves, Success};
use mge_run::{RunDirectory, RunError, RunHistory, RunState, Stamp};
use mge_trainer::RunConfig;

/// Number of runs read in parallel between two progress reports.
const READ_AT_ONCE: usize = 32;
/// Number of cached runs above which those not requested are dropped.
const MAX_KEPT: usize = 1000;

/// A run on disk.
#[derive(Debug, Clone)]
pub struct FoundRun {
    /// Its folder.
    pub path: PathBuf,
    /// Whether it is being trained, or how it ended.
    pub state: RunState,
    /// Its configuration, with the epsilon schedule in force.
    pub config: RunConfig,
    /// Its training results.
    pub trained: TrainedRun,
}

impl FoundRun {
    /// The name that users gave it, or else that of its folder.
    pub fn name(&self) -> String {
        RunDirectory::at(&self.path).name()
    }

    /// Reads more points of its curves; those of a moving average of `smooth` points become as many more.
    pub(super) fn refine(&mut self, smooth: &mut usize) -> Result<(), RunError> {
        let history = RunHistory::read(&RunDirectory::at(&self.path))?;
        self.trained = self.trained.clone().refined(&self.config, &history, smooth);
        Ok(())
    }
}

/// The folders of the runs in `folders`, without duplicates. Each of `folders` is a run itself, or holds runs
/// directly, in its subfolder `runs`, or both; these are ordered by name, with numbers in names as numbers.
///
/// # Errors
/// [`RunError::NoRuns`] for a folder without runs, [`RunError::NotARun`] if there is none; [`RunError::Io`].
pub fn find_runs(folders: &[PathBuf]) -> Result<Vec<PathBuf>, RunError> {
    let mut found = Vec::new();
    for folder in folders {
        if is_run(folder) {
            found.push(folder.clone());
            continue;
        }
        let (mut runs, inner) = (runs_in(folder)?, folder.join("runs"));
        if inner.is_dir() {
            runs.extend(runs_in(&inner)?);
        }
        if runs.is_empty() {
            let why = if folder.exists() { RunError::NoRuns } else { RunError::NotARun };
            return Err(why(folder.clone()));
        }
        found.extend(runs);
    }
    let mut known = BTreeSet::new();
    // A path that cannot be resolved is kept: reading it reports the error.
    found.retain(|path| std::fs::canonicalize(path).map_or(true, |path| known.insert(path)));
    Ok(found)
}

/// Whether a folder is a run, also a damaged one without its configuration, which reading it reports.
fn is_run(folder: &Path) -> bool {
    ["config.json", "events.jsonl"].iter().any(|file| folder.join(file).symlink_metadata().is_ok())
}

/// Whether an entry of a folder of runs is a run. Hidden folders are not: they are of processes that copy or remove a
/// run, or were killed while they did.
pub fn is_listed_run(entry: &Path) -> bool {
    let is_hidden = entry.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."));
    !is_hidden && is_run(entry)
}

fn runs_in(folder: &Path) -> Result<Vec<PathBuf>, RunError> {
    let mut runs = entries(folder).map_err(RunError::io("read", folder))?;
    runs.retain(|path| is_listed_run(path));
    runs.sort_by_cached_key(|path| natural_key(&path.file_name().unwrap_or_default().to_string_lossy()));
    Ok(runs)
}

/// Reads runs, each with the settings in which it differs from the others (see [`distinguish`]).
///
/// # Errors
/// When a run cannot be read.
pub fn read_runs(paths: &[PathBuf]) -> Result<Vec<FoundRun>, RunError> {
    RunReader::default().read(paths, &mut |_| {}).all()
}

/// Runs on disk that were read.
#[derive(Debug, Default)]
pub struct ReadRuns {
    /// The readable ones.
    pub runs: Vec<FoundRun>,
    /// The folders of the others, and why they cannot be read.
    pub unreadable: Vec<(PathBuf, RunError)>,
}

impl ReadRuns {
    /// The runs, if all of them could be read.
    ///
    /// # Errors
    /// The first reason why one cannot be read.
    pub fn all(self) -> Result<Vec<FoundRun>, RunError> {
        self.unreadable.into_iter().next().map_or(Ok(self.runs), |(_, error)| Err(error))
    }
}

/// What the curves of a figure show.
type CurvesOf = (Vec<TrainedRun>, Against, Success, Option<[f64; 2]>);

/// Reads runs, caching those that have not changed.
#[derive(Debug, Default)]
pub struct RunReader {
    known: HashMap<PathBuf, (Stamp, FoundRun)>,
    /// The curves of the latest figure, and of what they are: a figure is drawn often while its style is chosen, and
    /// resampling takes most of its time.
    pub(super) curves: Option<(CurvesOf, LearningCurves)>,
}

impl RunReader {
    /// As [`read_runs`]; `on_progress` is called with the number of folders read so far.
    pub fn read(&mut self, paths: &[PathBuf], on_progress: &mut dyn FnMut(usize)) -> ReadRuns {
        if self.known.len() > MAX_KEPT {
            let wanted: BTreeSet<&PathBuf> = paths.iter().collect();
            self.known.retain(|path, _| wanted.contains(path));
        }
        let ReadRuns { mut runs, mut unreadable } = ReadRuns::default();
        for some in paths.chunks(READ_AT_ONCE) {
            let read: Vec<_> = some.par_iter().map(|path| read_run(path, self.known.get(path))).collect();
            for (path, read) in some.iter().zip(read) {
                match read {
                    Ok((stamp, run)) => {
                        runs.push(run.clone());
                        self.known.insert(path.clone(), (stamp, run));
                    }
                    Err(error) => unreadable.push((path.clone(), error)),
                }
            }
            on_progress(runs.len() + unreadable.len());
        }
        distinguish(runs.iter_mut().map(|run| (&run.config, &mut run.trained.row)).collect());
        let finished = runs.iter_mut().filter(|run| run.state == RunState::Finished);
        let with_whole = finished.map(|FoundRun { config, trained, .. }| {
            (config.method.learns() && trained.row.episodes >= u64::from(config.episodes), trained)
        });
        score_equal_budgets(&mut with_whole.collect::<Vec<_>>());
        ReadRuns { runs, unreadable }
    }
}

/// Reads one run, or takes the known one if its stamp is unchanged. The stamp is taken before reading.
fn read_run(path: &Path, known: Option<&(Stamp, FoundRun)>) -> Result<(Stamp, FoundRun), RunError> {
    let stamp = Stamp::of(path);
    let directory = RunDirectory::open(path)?;
    if let Some((_, run)) = known.filter(|(known, _)| *known == stamp) {
        // The state may have changed: a process that was killed leaves the log unchanged.
        return Ok((stamp, FoundRun { state: directory.status()?.state, ..run.clone() }));
    }
    let config = RunConfig::of(&directory).or_else(|error| {
        directory.refuse_model()?;
        Err(error)
    })?;
    let history = match RunHistory::read(&directory) {
        // The run was created, but has not started.
        Err(error) if error.is_not_found() => RunHistory::default(),
        read => read?,
    };
    let config = config.in_force(&history.interventions).unwrap_or(config);
    let mut trained = TrainedRun::new(&config, &history);
    trained.row.name = directory.given_name();
    Ok((stamp, FoundRun { path: path.to_owned(), state: directory.status()?.state, config, trained }))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use mge_run::{EpisodeRecord, Event, RunWriter};

    /// The configuration of a dynamics model.
    const MODEL: &str = r#"{ "tools": ["box"], "model": {}, "training": {}, "evaluation": {} }"#;

    #[test]
    fn unfinished_copies_and_dynamics_models_are_not_runs() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        for name in ["a", ".mge-Collecting.tmp", ".trash/1/b"] {
            RunDirectory::create(folder.path().join(name), &config).unwrap();
        }
        let found = find_runs(&[folder.path().to_owned()]).unwrap();
        assert_eq!(found, [folder.path().join("a")]);
        RunDirectory::create(folder.path().join("b"), &MODEL.parse::<serde_json::Value>().unwrap()).unwrap();
        let error = read_runs(&find_runs(&[folder.path().to_owned()]).unwrap()).unwrap_err();
        assert!(error.to_string().contains("is a dynamics model"), "{error}");
    }

    #[test]
    fn a_run_without_its_configuration_is_damaged() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        let directory = RunDirectory::create(folder.path().join("a"), &config).unwrap();
        drop(RunWriter::open(&directory, 0).unwrap());
        std::fs::remove_file(directory.config_path()).unwrap();
        let found = find_runs(&[folder.path().to_owned()]).unwrap();
        let read = RunReader::default().read(&found, &mut |_| {});
        assert_eq!(read.unreadable.iter().map(|(path, _)| path).collect::<Vec<_>>(), [directory.path()]);
    }

    #[test]
    fn only_changed_runs_are_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
        let make = |name: &str| {
            let directory = RunDirectory::create(folder.path().join(name), &config).unwrap();
            let mut writer = RunWriter::open(&directory, 0).unwrap();
            writer.record(&Event::EpisodeFinished(EpisodeRecord { episode: 1, ..EpisodeRecord::default() })).unwrap();
            writer
        };
        let (_quiet, mut busy) = (make("a"), make("b"));
        let paths = ["a", "b"].map(|name| folder.path().join(name));
        let mut reader = RunReader::default();
        assert_eq!(reader.read(&paths, &mut |_| {}).all().unwrap().len(), 2);
        // Marks the cached rows by a number that is not in the files.
        reader.known.values_mut().for_each(|(_, run)| run.trained.row.episodes = 77);
        busy.record(&Event::EpisodeFinished(EpisodeRecord { episode: 2, ..EpisodeRecord::default() })).unwrap();
        let episodes = |runs: Vec<FoundRun>| runs.iter().map(|run| run.trained.row.episodes).collect::<Vec<_>>();
        assert_eq!(episodes(reader.read(&paths, &mut |_| {}).all().unwrap()), [77, 2]);
        std::fs::remove_dir_all(&paths[0]).unwrap();
        assert!(reader.read(&paths, &mut |_| {}).all().is_err(), "a deleted run is an error");
    }
}
