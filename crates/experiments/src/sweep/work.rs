//! Runs the jobs of a sweep as a batch.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::error::{SweepError, WorkError};
use super::expand::{Job, Sweep, Work};
use super::models::ModelJob;
use super::plan;
use mge_run::{RunDirectory, RunError};
use mge_trainer::RunConfig;
use mge_trainer::batch::{self, Batch, BatchProgress, JobFailure, train_to_end};

impl Job {
    /// The folder of the job in the folder of its sweep.
    pub fn folder(&self, sweep: &Path) -> PathBuf {
        sweep.join("runs").join(&self.name)
    }

    /// Refuses a folder of this name that holds a run with other settings.
    fn check_folder(&self, sweep: &Path) -> Result<(), SweepError> {
        let folder = self.folder(sweep);
        let directory = match RunDirectory::open(&folder) {
            Ok(directory) => directory,
            Err(RunError::NotARun(_)) => return Ok(RunDirectory::at(&folder).check_room()?),
            Err(error) => return Err(error.into()),
        };
        let same = match &self.work {
            Work::Train(config) => match RunConfig::of(&directory) {
                Ok(found) if found.trains_as(config) => true,
                Ok(found) if (RunConfig { prior: config.prior.clone(), ..found.clone() }).trains_as(config) => {
                    let [found, wanted] = [found.prior, config.prior.clone()].map(String::from);
                    return Err(SweepError::OtherModel { folder, found, wanted });
                }
                _ => false,
            },
            Work::Dynamics(job) => directory.config::<ModelJob>().is_ok_and(|found| found == **job),
        };
        if same { Ok(()) } else { Err(SweepError::OtherRun(folder)) }
    }

    /// Creates the run, unless another process has done so, which may have done it for another sweep.
    fn claim(&self, sweep: &Path) -> Result<(), WorkError> {
        let folder = self.folder(sweep);
        match &self.work {
            Work::Train(config) => config.open_or_create_run(&folder)?,
            Work::Dynamics(job) => RunDirectory::open_or_create(&folder, job)?,
        };
        Ok(self.check_folder(sweep).map_err(Box::new)?)
    }

    /// Its missing work as a job of a batch, with its size in episodes or epochs.
    fn in_batch<'a>(&'a self, sweep: &'a Path) -> batch::Job<'a, (), WorkError> {
        let size = match &self.work {
            Work::Train(config) => config.episodes.into(),
            Work::Dynamics(model) => model.epochs(),
        };
        batch::Job::new(&self.name, size, move |handle| {
            self.claim(sweep)?;
            let folder = self.folder(sweep);
            match &self.work {
                Work::Train(config) => Ok(train_to_end(&folder, config, handle)?),
                Work::Dynamics(model) => model.run(&folder, &plan::provenance(self), handle),
            }
        })
    }
}

/// Checks that a sweep can be run in `folder`, also before it is planned for other machines.
///
/// # Errors
/// When a folder cannot be used, or that of a run holds one with other settings.
pub fn check(sweep: &Sweep, folder: &Path) -> Result<(), SweepError> {
    let runs = folder.join("runs");
    if runs.ancestors().find(|place| place.exists()).is_some_and(|place| !place.is_dir()) {
        return Err(RunError::io("create", &runs)(ErrorKind::NotADirectory.into()).into());
    }
    sweep.jobs.iter().try_for_each(|job| job.check_folder(folder))
}

/// Does the missing work of a sweep in `folder` by [`Batch::run`]. Finished runs are kept, and interrupted
/// ones continue. Returns the failures, names and reasons, in the order of the jobs.
///
/// # Errors
/// Before any work: when the folder cannot be used, or no thread can be started. At the end:
/// [`SweepError::Interrupted`].
pub fn run(
    sweep: &Sweep,
    folder: &Path,
    batch: &Batch<'_>,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<Vec<(String, String)>, SweepError> {
    let runs = folder.join("runs");
    std::fs::create_dir_all(&runs).map_err(RunError::io("create", &runs))?;
    check(sweep, folder)?;
    let jobs: Vec<batch::Job<'_, (), WorkError>> = sweep.jobs.iter().map(|job| job.in_batch(folder)).collect();
    let outcomes = batch.run(&jobs, on_progress)?;
    if outcomes.iter().any(|outcome| matches!(outcome, Err(JobFailure::Interrupted))) {
        let done = outcomes.iter().filter(|outcome| outcome.is_ok()).count();
        return Err(SweepError::Interrupted { done, jobs: jobs.len() });
    }
    let failure = |(job, outcome): (&Job, Result<(), JobFailure<WorkError>>)| {
        outcome.err().map(|failure| (job.name.clone(), failure.to_string()))
    };
    Ok(sweep.jobs.iter().zip(outcomes).filter_map(failure).collect())
}
