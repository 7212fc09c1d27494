//! Runs the jobs of a sweep as a batch.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::expand::{Job, Sweep, Work};
use super::plan;
use crate::error::{ExperimentError, Result};
use mge_base::{atomic, json};
use mge_run::{RunDirectory, RunError, read_optional};
use mge_trainer::RunConfig;
use mge_trainer::batch::{self, Batch, JobFailure, train_to_end};

/// The results of a model or of a count, in its folder.
pub(super) const RESULT: &str = "result.json";

impl Job {
    /// The folder of the job in the folder of its sweep.
    pub fn folder(&self, sweep: &Path) -> PathBuf {
        sweep.join("runs").join(&self.name)
    }

    /// Refuses a folder of this name that holds a run with other settings.
    fn check_folder(&self, sweep: &Path) -> Result<()> {
        let folder = self.folder(sweep);
        let directory = match RunDirectory::open(&folder) {
            // Another process may just have created it.
            Err(RunError::NotARun(_)) => match RunDirectory::at(&folder).check_room() {
                Err(RunError::AlreadyARun(_)) => return Ok(()),
                checked => return Ok(checked?),
            },
            opened => opened?,
        };
        let same = match &self.work {
            Work::Train(config) => RunConfig::of(&directory)?.trains_as(config),
            Work::Dynamics(job) => **job == directory.config()?,
            Work::Hits(job) => **job == directory.config()?,
        };
        let refusal = "holds a run with other settings than the sweep asks for, or with another model: choose another \
                       folder with --out, or remove it";
        if same { Ok(()) } else { Err(ExperimentError::Refused(format!("{} {refusal}", folder.display()))) }
    }

    /// Creates the run, unless another process has done so, which may have done it for another sweep.
    fn claim(&self, sweep: &Path) -> Result<()> {
        self.check_folder(sweep)?;
        let folder = self.folder(sweep);
        match &self.work {
            Work::Train(config) => config.open_or_create_run(&folder)?,
            Work::Dynamics(job) => RunDirectory::open_or_create(&folder, job)?,
            Work::Hits(job) => RunDirectory::open_or_create(&folder, job)?,
        };
        self.check_folder(sweep)
    }

    /// Its amount of work in the episodes of a training or the epochs of a model.
    fn size(&self) -> u64 {
        match &self.work {
            Work::Train(config) => config.episodes.into(),
            Work::Dynamics(model) => model.training.epochs.into(),
            Work::Hits(count) => count.episodes.into(),
        }
    }

    /// Its missing work as a job of a batch.
    fn in_batch<'a>(&'a self, sweep: &'a Path) -> batch::Job<'a, (), ExperimentError> {
        batch::Job::new(&self.name, self.size(), move |handle| {
            self.claim(sweep)?;
            let folder = self.folder(sweep);
            match &self.work {
                Work::Train(config) => Ok(train_to_end(&folder, config, handle)?),
                Work::Dynamics(model) => model.run(&folder, &plan::provenance(self), handle).map(Some),
                Work::Hits(count) => once(&folder, || count.count(handle.stop())).map(Some),
            }
        })
    }
}

/// The result of a model or of a count in its folder; none if it is not finished.
///
/// # Errors
/// When it cannot be read, or is damaged.
pub fn result_in<T: DeserializeOwned>(folder: &Path) -> Result<Option<T>> {
    let file = folder.join(RESULT);
    let read = |bytes: Vec<u8>| Ok::<_, ExperimentError>(json::parse(&bytes, &file.display().to_string())?);
    read_optional(&file)?.map(read).transpose()
}

/// Makes the result of a model or of a count and writes it into its folder, unless it is there.
pub(super) fn once<T: Serialize + DeserializeOwned>(folder: &Path, make: impl FnOnce() -> Result<T>) -> Result<()> {
    let _lock = RunDirectory::open(folder)?.lock()?;
    if result_in::<T>(folder)?.is_some() {
        return Ok(());
    }
    let file = folder.join(RESULT);
    atomic::write(&file, json::pretty(&make()?).as_bytes()).map_err(RunError::io("write", &file))?;
    Ok(())
}

/// Checks that a sweep can be run in `folder`, also before it is planned for other machines.
///
/// # Errors
/// When the folder of a run holds one with other settings.
pub fn check(sweep: &Sweep, folder: &Path) -> Result<()> {
    sweep.jobs.iter().try_for_each(|job| match job.check_folder(folder) {
        // A damaged run fails alone, as a job.
        Err(ExperimentError::Run(RunError::Malformed { .. })) => Ok(()),
        checked => checked,
    })
}

/// The failures of a sweep, names and reasons, as one error.
///
/// # Errors
/// When there are any.
pub fn no_failure(sweep: &Sweep, failures: &[(String, String)]) -> Result<()> {
    let Some((name, reason)) = failures.first() else { return Ok(()) };
    let (failed, all) = (failures.len(), sweep.jobs.len());
    Err(ExperimentError::Refused(format!("{failed} of {all} not finished, such as {name}: {reason}")))
}

/// Does the missing work of a sweep in `folder` by [`Batch::run`]. Finished runs are kept, and interrupted
/// ones continue. Returns the failures, names and reasons, in the order of the jobs.
///
/// # Errors
/// Before any work: when the folder cannot be used, or no thread can be started. At the end:
/// [`ExperimentError::Interrupted`].
pub fn run(sweep: &Sweep, folder: &Path, batch: &mut Batch<'_>) -> Result<Vec<(String, String)>> {
    let runs = folder.join("runs");
    std::fs::create_dir_all(&runs).map_err(RunError::io("create", &runs))?;
    check(sweep, folder)?;
    let jobs: Vec<batch::Job<'_, (), ExperimentError>> = sweep.jobs.iter().map(|job| job.in_batch(folder)).collect();
    let outcomes = batch.run(&jobs)?;
    if outcomes.iter().any(|outcome| matches!(outcome, Err(JobFailure::Interrupted))) {
        let done = outcomes.iter().filter(|outcome| outcome.is_ok()).count();
        return Err(ExperimentError::Interrupted { done, jobs: jobs.len() });
    }
    let failure = |(job, outcome): (&Job, Result<(), JobFailure<ExperimentError>>)| {
        outcome.err().map(|failure| (job.name.clone(), failure.to_string()))
    };
    Ok(sweep.jobs.iter().zip(outcomes).filter_map(failure).collect())
}
