//! Errors of sweeps, studies and puzzles, each shown as one line.

use std::path::PathBuf;

use mge_base::json::SyntaxError;
use mge_base::stop::Stopped;
use mge_base::validation::ValidationError;
use mge_dynamics::DynamicsError;
use mge_figures::FigureError;
use mge_results::ResultsError;
use mge_run::RunError;
use mge_stats::StatsError;
use mge_task::TaskError;
use mge_trainer::batch::{BatchError, JobError, JobFailure};
use mge_trainer::{PriorError, TrainerError};

/// Why an experiment cannot be run or reported. What is finished is kept.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// A file is not JSON, or does not have the content of its kind.
    #[error(transparent)]
    Syntax(#[from] SyntaxError),
    /// A sweep file has an invalid setting or value; `origin` is the file and the line.
    #[error("{origin}: at {problem}")]
    Invalid { origin: String, problem: ValidationError },
    /// A file cannot be read or written, or a folder does not hold the run that it should.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The training of an agent failed.
    #[error(transparent)]
    Trainer(#[from] TrainerError),
    /// A dynamics model cannot be trained, loaded or evaluated.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
    /// An action prior cannot be built.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// The untrained agent cannot be configured.
    #[error(transparent)]
    Agent(#[from] ValidationError),
    /// A task file is invalid.
    #[error(transparent)]
    Task(#[from] TaskError),
    /// Runs cannot be compared.
    #[error(transparent)]
    Results(#[from] ResultsError),
    /// A statistic cannot be computed.
    #[error(transparent)]
    Stats(#[from] StatsError),
    /// A figure cannot be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// The threads of the batch cannot be started.
    #[error(transparent)]
    Batch(#[from] BatchError),
    /// A job panicked.
    #[error("a job panicked: {0}")]
    Panic(String),
    /// The batch was interrupted.
    #[error("interrupted after {done} of {jobs}: the same command continues where it stopped")]
    Interrupted { done: usize, jobs: usize },
    /// Jobs failed, such as this one.
    #[error("{failed} of {jobs} not finished, such as {name}: {reason}")]
    NotFinished { failed: usize, jobs: usize, name: String, reason: String },

    /// A run in the sweep's folder has the name of one of the sweep's runs, but other settings.
    #[error(
        "{} holds a run with other settings than the sweep asks for: choose another folder with --out, or remove it",
        .0.display()
    )]
    OtherRun(PathBuf),
    /// A run in the sweep's folder was trained with another model than that in the sweep's file.
    #[error(
        "{} was trained with the model {found}, and the sweep's file is now {wanted}: restore the file, choose another \
         folder with --out, or write the model as a list, so that the new one is trained under another name",
        folder.display()
    )]
    OtherModel { folder: PathBuf, found: String, wanted: String },
    /// The configuration of a run of the sweep is damaged.
    #[error("{0}: restore this file, or remove the run's folder, and it is made again")]
    DamagedRun(RunError),
    /// The result of a model or a count is damaged.
    #[error("{0}: remove this file, and it is made again")]
    Result(SyntaxError),
    /// A path that has a line break or is not UTF-8 cannot be part of a plan, which has one command per line of text.
    #[error("{:?} has a line break or is not UTF-8, and a plan is text with one command per line: choose another folder with --out", .0)]
    NoLine(PathBuf),
    /// There are several kinds of work, such as agents and dynamics models.
    #[error("{} holds {first_kind} and {} {second_kind}: keep them in different folders, and report one at a time", first.display(), second.display())]
    Mixed { first: PathBuf, first_kind: &'static str, second: PathBuf, second_kind: &'static str },
    /// None of the models or counts to report is finished.
    #[error("none of {all} is finished: the command of their sweep continues them")]
    NothingFinished { all: usize },

    /// The folder holds a study of an earlier version.
    #[error("{} holds a study of an earlier version, which `mge report` still reads: choose another folder with --out", .0.display())]
    EarlierStudy(PathBuf),

    /// The folder holds puzzles of another sequence.
    #[error("{}: these puzzles have another seed, split, start noise or format: choose another folder with --out", .0.display())]
    OtherPuzzles(PathBuf),
    /// The file of a puzzle is another file, or was made from another puzzle of the same name.
    #[error("{}: is not the puzzle of this name: remove it, and the puzzle is made again, or choose another folder with --out", .0.display())]
    OtherPuzzle(PathBuf),
    /// The index of puzzles is damaged, or a file of another kind.
    #[error("{0}: it is no index of puzzles: choose a folder that `mge puzzles generate` has written")]
    NoIndex(SyntaxError),
    /// The index of puzzles has another format version.
    #[error("{}: the index has format version {found}, this program reads version {wanted}: generate the puzzles again", path.display())]
    Version { path: PathBuf, found: u32, wanted: u32 },
    /// The proposals in the folder come from another search.
    #[error("{}: its puzzles have subgoals of another model or number: choose another folder with --out", .0.display())]
    OtherSearch(PathBuf),
    /// A setting of the trainings is also an option.
    #[error("--set {0}=...: tasks, methods, seeds, episodes and model of a bench have options of their own")]
    SettingOfOption(String),
}

impl ExperimentError {
    /// Whether an interruption was requested.
    pub fn is_interruption(&self) -> bool {
        matches!(self, Self::Interrupted { .. })
    }
}

impl From<Stopped> for ExperimentError {
    fn from(stopped: Stopped) -> Self {
        Self::Dynamics(stopped.into())
    }
}

impl JobError for ExperimentError {
    fn is_in_use(&self) -> bool {
        matches!(self, Self::Run(RunError::InUse { .. }) | Self::Trainer(TrainerError::Run(RunError::InUse { .. })))
    }

    fn is_stopped(&self) -> bool {
        match self {
            Self::Dynamics(DynamicsError::Stopped) => true,
            Self::Prior(error) => error.is_stopped(),
            _ => false,
        }
    }
}

/// The outputs of the finished jobs, and the number of interrupted ones.
///
/// # Errors
/// The first failure.
pub(crate) fn finished<T>(
    outcomes: Vec<Result<T, JobFailure<ExperimentError>>>,
) -> Result<(Vec<T>, usize), ExperimentError> {
    let (mut outputs, mut interrupted) = (Vec::new(), 0);
    for outcome in outcomes {
        match outcome {
            Ok(output) => outputs.push(output),
            Err(JobFailure::Interrupted) => interrupted += 1,
            Err(JobFailure::Error(error)) => return Err(error),
            Err(JobFailure::Panic(message)) => return Err(ExperimentError::Panic(message)),
        }
    }
    Ok((outputs, interrupted))
}

/// The outputs of all jobs.
///
/// # Errors
/// The first failure; [`ExperimentError::Interrupted`].
pub(crate) fn all_finished<T>(
    outcomes: Vec<Result<T, JobFailure<ExperimentError>>>,
) -> Result<Vec<T>, ExperimentError> {
    let jobs = outcomes.len();
    match finished(outcomes)? {
        (outputs, 0) => Ok(outputs),
        (outputs, _) => Err(ExperimentError::Interrupted { done: outputs.len(), jobs }),
    }
}
