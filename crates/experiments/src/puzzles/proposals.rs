//! Puzzles with subgoals proposed by a dynamics model, which was not trained on puzzles.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::index::{Index, Puzzle};
use crate::error::{ExperimentError, all_finished};
use mge_base::atomic::Target;
use mge_base::sync::hold_folder;
use mge_guidance::{GuidanceConfig, choose_subgoals};
use mge_run::RunError;
use mge_task as task;
use mge_trainer::batch::{Batch, BatchProgress, Job, JobHandle};
use mge_trainer::{PriorSource, RunConfig, rollout_model};

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
    /// [`ExperimentError::Interrupted`].
    pub(super) fn propose(
        &self,
        index: &Index,
        out: &Target,
        batch: &Batch<'_>,
        on_progress: &mut dyn FnMut(&BatchProgress<'_>),
    ) -> Result<Vec<PathBuf>, ExperimentError> {
        let tasks = out.path.join("tasks");
        std::fs::create_dir_all(&tasks).map_err(RunError::io("create", &tasks))?;
        self.claim(&tasks)?;
        let proposal = |puzzle: &Puzzle| Proposal {
            search: self,
            name: puzzle.name.clone(),
            from: puzzle.path(&self.puzzles),
            to: puzzle.path(&tasks),
        };
        let mut missing = Vec::new();
        for proposal in index.puzzles.iter().map(proposal) {
            if !proposal.is_known()? {
                missing.push(proposal);
            }
        }
        let jobs: Vec<_> = missing.into_iter().map(Proposal::job).collect();
        all_finished(batch.run(&jobs, on_progress)?)?;
        Ok(index.puzzles.iter().map(|puzzle| puzzle.path(&tasks)).collect())
    }

    /// Whether the recorded search is this one, wherever the model's file was.
    fn is_search(&self, recorded: &str) -> bool {
        let Some((model, subgoals)) = recorded.trim_end().rsplit_once(" --subgoals ") else { return false };
        PriorSource::from(model.to_owned()).identified() == self.model && subgoals == self.subgoals.to_string()
    }

    /// Records in the folder of the proposals how they are searched for.
    ///
    /// # Errors
    /// [`ExperimentError::OtherSearch`] when it holds proposals of another search.
    fn claim(&self, tasks: &Path) -> Result<(), ExperimentError> {
        let _alone = hold_folder(tasks, || true).map_err(RunError::io("write into", tasks))?;
        let path = tasks.join("search.txt");
        let text = format!("{} --subgoals {}\n", String::from(self.model.clone()), self.subgoals);
        match mge_base::bounded::read_text(&path) {
            Ok(known) if self.is_search(&known) => Ok(()),
            Ok(_) => Err(ExperimentError::OtherSearch(tasks.to_owned())),
            Err(error) if error.kind() == ErrorKind::NotFound => {
                Ok(mge_base::atomic::write(&path, text.as_bytes()).map_err(RunError::io("write", &path))?)
            }
            Err(error) => Err(RunError::io("read", &path)(error).into()),
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
    fn job(self) -> Job<'a, (), ExperimentError> {
        Job::new(self.name.clone(), 1, move |handle| self.propose(handle))
    }

    /// Whether the puzzle has its proposed subgoals already.
    ///
    /// # Errors
    /// [`ExperimentError::OtherPuzzle`] when they are of another puzzle, as after a change of its file.
    fn is_known(&self) -> Result<bool, ExperimentError> {
        if !self.to.exists() {
            return Ok(false);
        }
        let [puzzle, proposed] = [&self.from, &self.to].map(|path| task::load(&path.display().to_string()));
        let proposed = proposed?;
        let mut puzzle = puzzle?.with_subgoals(proposed.subgoals.clone());
        puzzle.search_actions = proposed.search_actions;
        if puzzle == proposed { Ok(true) } else { Err(ExperimentError::OtherPuzzle(self.to.clone())) }
    }

    fn propose(&self, handle: &JobHandle) -> Result<Option<()>, ExperimentError> {
        handle.report(format!("subgoals of {}", self.name));
        let mut puzzle = task::load(&self.from.display().to_string())?;
        // The uniform source has no model to propose subgoals with.
        let (config, most, stop) = (GuidanceConfig::default(), self.search.subgoals, handle.stop());
        let run = RunConfig { prior: self.search.model.clone(), ..RunConfig::new(Arc::new(puzzle.clone())) };
        if let Some(model) = rollout_model(&run, |_| (), stop)? {
            let chosen = choose_subgoals(&puzzle, &*model, most, &config, 0, stop, |_| ())?;
            // A run trains another model, with its own seed.
            let launches = if run.prior == PriorSource::default() { run.launches() } else { 0 };
            puzzle = puzzle.with_subgoals(chosen.subgoals);
            puzzle.search_actions = chosen.actions as u64 + launches;
        }
        task::save(&puzzle, &self.to)?;
        Ok(Some(()))
    }
}
