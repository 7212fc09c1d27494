//! The jobs of a sweep, worked on in parallel.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use rayon::prelude::*;

use super::error::SweepError;
use super::expand::{Job, Sweep, Work};
use super::models::ModelJob;
use super::plan;
use crate::dynamics::DynamicsError;
use crate::run::{RunDirectory, RunError};
use crate::study::train_to_end;
use crate::trainer::{RunConfig, TrainerError, Watch, panic_message};

/// Time between two looks at how far the jobs are.
const LOOK_EVERY: Duration = Duration::from_millis(200);

/// How far a sweep is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SweepProgress<'a> {
    /// Episodes or epochs done.
    pub done: u64,
    /// Episodes or epochs in all.
    pub total: u64,
    /// Jobs that have ended.
    pub ended: usize,
    /// Jobs of those that failed.
    pub failed: usize,
    /// Jobs in all.
    pub jobs: usize,
    /// A job that failed just now, and why.
    pub failure: Option<(&'a str, &'a str)>,
}

/// Why a job failed.
#[derive(Debug, thiserror::Error)]
pub(super) enum WorkError {
    /// An agent's training.
    #[error(transparent)]
    Training(#[from] TrainerError),
    /// A dynamics model.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// Its files.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A mistake of the program.
    #[error("it panicked: {0}")]
    Panic(String),
}

impl WorkError {
    /// Whether another process works on the job.
    fn is_in_use(&self) -> bool {
        let (Self::Run(error) | Self::Training(TrainerError::Run(error))) = self else { return false };
        matches!(error, RunError::InUse { .. })
    }
}

/// How far one job is.
#[derive(Debug, Default)]
pub(super) struct Meter {
    watch: Watch,
    done: AtomicU64,
}

impl Meter {
    /// Sets the episodes or epochs that are done.
    pub fn set(&self, done: u64) {
        self.done.store(done, Ordering::Relaxed);
    }

    fn done(&self) -> u64 {
        self.done.load(Ordering::Relaxed).max(self.watch.episode())
    }
}

impl Job {
    /// Where the job is in the folder of its sweep.
    pub fn folder(&self, sweep: &Path) -> PathBuf {
        sweep.join("runs").join(&self.name)
    }

    /// Episodes or epochs.
    fn size(&self) -> u64 {
        match &self.work {
            Work::Train(config) => u64::from(config.episodes),
            Work::Dynamics(job) => job.epochs(),
        }
    }

    fn run(&self, sweep: &Path, meter: &Meter) -> Result<(), WorkError> {
        let folder = self.folder(sweep);
        let work = || match &self.work {
            Work::Train(config) => Ok(train_to_end(&folder, config, &meter.watch).map(drop)?),
            Work::Dynamics(job) => job.run(&folder, &plan::provenance(self), meter),
        };
        let outcome = catch_unwind(AssertUnwindSafe(work))
            .unwrap_or_else(|panic| Err(WorkError::Panic(panic_message(&*panic).to_owned())));
        if !outcome.as_ref().is_err_and(WorkError::is_in_use) {
            // Whether it failed or was finished before: there is nothing left to wait for.
            meter.set(self.size());
        }
        outcome
    }

    /// Waits for the other process that works on the job, and does what that leaves.
    fn run_after_others(&self, sweep: &Path, meter: &Meter) -> Result<(), WorkError> {
        loop {
            match self.run(sweep, meter) {
                Err(error) if error.is_in_use() => std::thread::sleep(LOOK_EVERY),
                outcome => return outcome,
            }
        }
    }

    /// A folder of this name with other settings would be taken for this job.
    fn check_folder(&self, sweep: &Path) -> Result<(), SweepError> {
        let folder = self.folder(sweep);
        let directory = match RunDirectory::open(&folder) {
            Ok(directory) => directory,
            Err(RunError::NotARun(_)) => return Ok(()),
            Err(error) => return Err(error.into()),
        };
        let same = match &self.work {
            Work::Train(config) => directory.config::<RunConfig>().is_ok_and(|found| found == **config),
            Work::Dynamics(job) => directory.config::<ModelJob>().is_ok_and(|found| found == **job),
        };
        if same { Ok(()) } else { Err(SweepError::OtherRun(folder)) }
    }
}

/// Does what is missing of a sweep in `folder`, on all threads of the current rayon pool.
/// Finished runs stay as they are, interrupted ones go on, one that fails does not stop the
/// others, and those that another process works on are waited for at the end. Returns the failures: names and reasons. `tell` hears of progress, from any
/// thread.
///
/// # Errors
/// Before anything is done: when the folder cannot be used.
pub fn run(
    sweep: &Sweep,
    folder: &Path,
    tell: &(dyn Fn(&SweepProgress<'_>) + Sync),
) -> Result<Vec<(String, String)>, SweepError> {
    let runs = folder.join("runs");
    std::fs::create_dir_all(&runs).map_err(RunError::io("create", &runs))?;
    for job in &sweep.jobs {
        job.check_folder(folder)?;
    }
    let state = State {
        meters: sweep.jobs.iter().map(|_| Meter::default()).collect(),
        total: sweep.jobs.iter().map(Job::size).sum(),
        ended: AtomicUsize::new(0),
        failed: AtomicUsize::new(0),
    };
    let (finished, ended) = crossbeam_channel::bounded::<()>(0);
    let failures = std::thread::scope(|scope| {
        scope.spawn(|| {
            // Until the other end of the channel is gone.
            while ended.recv_timeout(LOOK_EVERY) == Err(crossbeam_channel::RecvTimeoutError::Timeout) {
                tell(&state.progress(None));
            }
        });
        let end = |job: &Job, outcome: Result<(), WorkError>| {
            let failure = outcome.err().map(|error| error.to_string());
            state.failed.fetch_add(usize::from(failure.is_some()), Ordering::Relaxed);
            state.ended.fetch_add(1, Ordering::Relaxed);
            let failure = failure?;
            tell(&state.progress(Some((&job.name, &failure))));
            Some((job.name.clone(), failure))
        };
        let jobs = sweep.jobs.par_iter().zip(&state.meters);
        let done: Vec<Ended<'_>> = jobs
            .map(|(job, meter)| match job.run(folder, meter) {
                Err(error) if error.is_in_use() => Ended::Elsewhere(job, meter),
                outcome => Ended::Here(end(job, outcome)),
            })
            .collect();
        let failures = done.into_iter().filter_map(|ended| match ended {
            Ended::Here(failure) => failure,
            Ended::Elsewhere(job, meter) => end(job, job.run_after_others(folder, meter)),
        });
        let failures = failures.collect();
        drop(finished);
        failures
    });
    tell(&state.progress(None));
    Ok(failures)
}

/// What became of a job at the first try.
enum Ended<'a> {
    /// It was done here; name and reason if it failed.
    Here(Option<(String, String)>),
    /// Another process works on it.
    Elsewhere(&'a Job, &'a Meter),
}

struct State {
    meters: Vec<Meter>,
    total: u64,
    ended: AtomicUsize,
    failed: AtomicUsize,
}

impl State {
    fn progress<'a>(&self, failure: Option<(&'a str, &'a str)>) -> SweepProgress<'a> {
        SweepProgress {
            done: self.meters.iter().map(Meter::done).sum(),
            total: self.total,
            ended: self.ended.load(Ordering::Relaxed),
            failed: self.failed.load(Ordering::Relaxed),
            jobs: self.meters.len(),
            failure,
        }
    }
}
