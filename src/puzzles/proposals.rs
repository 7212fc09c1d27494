//! Puzzles with subgoals proposed by a dynamics model, which was not trained on puzzles.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::error::{PuzzleError, finished};
use super::index::{Index, Puzzle};
use crate::batch::{Batch, BatchProgress, Job, JobHandle};
use crate::dynamics::DynamicsError;
use crate::guidance::{GuidanceConfig, InterruptibleModel, choose_subgoals};
use crate::task;
use crate::trainer::{PriorSource, rollout_model};

/// How subgoals are searched for.
#[derive(Debug, Clone)]
pub struct SubgoalSearch {
    /// The folder of the puzzles.
    pub puzzles: PathBuf,
    /// The model that predicts the rollouts for subgoals and clusters.
    pub model: PriorSource,
    /// Maximum number of subgoals proposed for a puzzle.
    pub subgoals: usize,
}

impl SubgoalSearch {
    /// Writes the puzzles with proposed subgoals to `out/tasks`, except existing ones. Returns their files in the order
    /// of the index.
    ///
    /// # Errors
    /// When the model cannot predict a puzzle, or a file cannot be read or written;
    /// [`PuzzleError::Interrupted`].
    pub(super) fn propose(
        &self,
        index: &Index,
        out: &Path,
        batch: &Batch<'_>,
        on_progress: &mut dyn FnMut(&BatchProgress<'_>),
    ) -> Result<Vec<PathBuf>, PuzzleError> {
        let tasks = out.join("tasks");
        std::fs::create_dir_all(&tasks).map_err(PuzzleError::io(&tasks))?;
        self.claim(index, &tasks)?;
        let proposal = |puzzle: &Puzzle| Proposal {
            search: self,
            name: puzzle.name.clone(),
            from: puzzle.path(&self.puzzles),
            to: puzzle.path(&tasks),
        };
        let missing = index.puzzles.iter().map(proposal).filter(|proposal| !proposal.to.exists());
        let jobs: Vec<_> = missing.map(Proposal::job).collect();
        let (_, interrupted) = finished(batch.run(&jobs, on_progress)?)?;
        if interrupted > 0 {
            return Err(PuzzleError::Interrupted { done: jobs.len() - interrupted, jobs: jobs.len() });
        }
        Ok(index.puzzles.iter().map(|puzzle| puzzle.path(&tasks)).collect())
    }

    /// Records in the folder of the proposals which puzzles and which search they are from.
    ///
    /// # Errors
    /// [`PuzzleError::OtherSearch`] when it holds others.
    fn claim(&self, index: &Index, tasks: &Path) -> Result<(), PuzzleError> {
        let path = tasks.join("search.txt");
        let Index { split, seed, start_noise, .. } = index;
        let (model, subgoals) = (String::from(self.model.clone()), self.subgoals);
        let text = format!("{model} --subgoals {subgoals}, {split:?} {seed}, start noise {start_noise}\n");
        match std::fs::read_to_string(&path) {
            Ok(known) if known == text => Ok(()),
            Ok(_) => Err(PuzzleError::OtherSearch { path: tasks.to_owned() }),
            Err(error) if error.kind() == ErrorKind::NotFound => {
                crate::atomic::write(&path, text.as_bytes()).map_err(PuzzleError::io(&path))
            }
            Err(error) => Err(PuzzleError::io(&path)(error)),
        }
    }
}

/// The job that proposes subgoals for one puzzle.
struct Proposal<'a> {
    search: &'a SubgoalSearch,
    name: String,
    from: PathBuf,
    to: PathBuf,
}

impl<'a> Proposal<'a> {
    fn job(self) -> Job<'a, (), PuzzleError> {
        Job::new(self.name.clone(), 1, move |handle| self.propose(handle))
    }

    fn propose(&self, handle: &JobHandle) -> Result<Option<()>, PuzzleError> {
        handle.report(format!("subgoals of {}", self.name));
        let mut puzzle = task::load(&self.from.display().to_string())?;
        // The uniform source has no model to propose subgoals with.
        if let Some(model) = rollout_model(&self.search.model, &puzzle)? {
            let config = GuidanceConfig::default();
            let model = InterruptibleModel::new(&*model, handle.stop());
            puzzle.subgoals = match choose_subgoals(&puzzle, &model, self.search.subgoals, &config, 0, |_| ()) {
                Err(DynamicsError::Stopped) => return Ok(None),
                found => found?.subgoals,
            };
        }
        task::save(&puzzle, &self.to)?;
        Ok(Some(()))
    }
}
