//! Puzzles played by an agent that was trained on others: at once, and after a short training on each.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;

use super::error::{PuzzleError, finished};
use super::index::Index;
use super::proposals::SubgoalSearch;
use super::results::{GROUPS, SOLVED, check_report, group_of, write_report};
use mge_agent::Ddpg;
use mge_base::atomic::Target;
use mge_base::markdown;
use mge_base::stop::{Pieces, Stop, Stopped};
use mge_base::streams::Stream;
use mge_base::sync::hold_folder;
use mge_task::{self as task, Task};
use mge_trainer::batch::{Batch, BatchProgress, Job, JobHandle};
use mge_trainer::{Observation, RunConfig, Training, build_prior, greedy_episode};

/// A transfer: the agent, the puzzles, and the training on each of them.
#[derive(Debug)]
pub struct TransferPlan {
    /// The puzzles and the search for their subgoals.
    pub search: SubgoalSearch,
    /// The configuration of the agent's training.
    pub config: Arc<RunConfig>,
    /// The agent.
    pub agent: Ddpg,
    /// Number of episodes of the training on a puzzle.
    pub episodes: u32,
    /// Number of greedy episodes that measure the success on a puzzle.
    pub evaluations: u32,
    /// Seed of the training and of the starts of the greedy episodes.
    pub seed: u64,
}

/// The success of the greedy policy on a puzzle, as the share of its episodes that reached the goal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TransferRow {
    /// Name of the puzzle.
    pub puzzle: String,
    /// Of the agent, which has not been trained on the puzzle.
    pub at_once: f64,
    /// Of the agent after the training on the puzzle.
    pub after: f64,
    /// Of a new agent after the same training.
    pub from_scratch: f64,
}

/// The results of a transfer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TransferResults {
    /// The command that reproduces them.
    pub command: String,
    /// Version of the program that wrote them.
    pub mge_version: String,
    /// Number of tasks on which the agent was trained.
    pub trained_on: usize,
    /// Number of episodes of that training.
    pub trained_episodes: u64,
    /// Number of episodes of the training on a puzzle.
    pub episodes: u32,
    /// Number of greedy episodes that measure a success.
    pub evaluations: u32,
    /// The puzzles.
    pub index: Index,
    /// One row per puzzle.
    pub rows: Vec<TransferRow>,
}

/// Plays every puzzle of `index` with the agent. The puzzles with proposed subgoals are written to `out/tasks`.
///
/// # Errors
/// [`PuzzleError::NotByRays`] and [`PuzzleError::TrainedOn`]; when the model cannot predict a puzzle, or a file cannot
/// be read or written; [`PuzzleError::Interrupted`] and [`PuzzleError::TransferInterrupted`].
pub fn transfer(
    plan: &TransferPlan,
    index: &Index,
    out: impl Into<Target>,
    batch: &Batch<'_>,
    on_progress: &mut dyn FnMut(&BatchProgress<'_>),
) -> Result<Vec<TransferRow>, PuzzleError> {
    if plan.config.observation != Observation::Rays {
        return Err(PuzzleError::NotByRays);
    }
    let is_known = |name: &str| plan.config.tasks().any(|task| task.name == name);
    if let Some(known) = index.puzzles.iter().find(|puzzle| is_known(&puzzle.name)) {
        return Err(PuzzleError::TrainedOn { name: known.name.clone() });
    }
    let out = out.into();
    check_report(&out)?;
    let files = plan.search.propose(index, &out, batch, on_progress)?;
    let job = |file: PathBuf| {
        let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Job::new(name.clone(), 1, move |handle: &JobHandle| {
            handle.report(format!("training on {name}"));
            plan.play(name.clone(), &file, handle).map(Some)
        })
    };
    let jobs: Vec<_> = files.into_iter().map(job).collect();
    let (rows, interrupted) = finished(batch.run(&jobs, on_progress)?)?;
    match interrupted {
        0 => Ok(rows),
        _ => Err(PuzzleError::TransferInterrupted { done: rows.len(), jobs: jobs.len() }),
    }
}

impl TransferPlan {
    /// Plays one puzzle.
    fn play(&self, puzzle: String, file: &Path, handle: &JobHandle) -> Result<TransferRow, PuzzleError> {
        let task = Arc::new(task::load(&file.display().to_string())?);
        let [trained, new] = self.trainings(&task, handle)?;
        let task = trained.config().played(&task);
        let at_once = self.success(&task, trained.ddpg(), handle.stop())?;
        let success_after = |training| self.success(&task, &self.train(training, handle.stop())?, handle.stop());
        Ok(TransferRow { puzzle, at_once, after: success_after(trained)?, from_scratch: success_after(new)? })
    }

    /// The training on a puzzle with the agent, and that with a new agent.
    pub(super) fn trainings(&self, task: &Arc<Task>, handle: &JobHandle) -> Result<[Training; 2], PuzzleError> {
        let mut config = RunConfig { episodes: self.episodes, seed: self.seed, ..self.config.on(task) };
        config.prior = self.search.model.clone();
        // The episodes are all that the agent learns from on this puzzle.
        config.practice.rollouts = 0;
        let prior = match config.is_guided() {
            true => Some(Arc::new(build_prior(&config, |_| (), handle.stop())?)),
            false => None,
        };
        let new = Training::new(config, prior)?;
        let mut trained = new.clone();
        trained.adopt(self.agent.clone())?;
        Ok([trained, new])
    }

    /// The agent at the end of a training.
    fn train(&self, mut training: Training, stop: &Stop) -> Result<Ddpg, PuzzleError> {
        let mut pieces = Pieces::default();
        while !training.is_finished() {
            stop.check()?;
            pieces.is_slow |= training.may_take_longer();
            let episode = |training: &mut Training, _: &Stop| {
                Some(training.run_episode().and_then(|_| training.refine()).map(drop))
            };
            pieces.run(&mut training, stop, episode).ok_or(Stopped)??;
        }
        Ok(training.ddpg().clone())
    }

    /// The share of greedy episodes that reach the goal.
    fn success(&self, task: &Arc<Task>, agent: &Ddpg, stop: &Stop) -> Result<f64, PuzzleError> {
        let (mut rng, mut goals) = (Stream::Evaluation.of(self.seed), 0u32);
        for _ in 0..self.evaluations {
            stop.check()?;
            let trace = greedy_episode(task, self.config.observation, None, agent, &mut rng);
            goals += u32::from(trace.reached_goal());
        }
        Ok(f64::from(goals) / f64::from(self.evaluations))
    }
}

impl TransferResults {
    /// Writes `report.md` and `report.json` into `folder`.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write(&self, folder: impl Into<Target>) -> Result<(), PuzzleError> {
        let folder = folder.into();
        let _alone = hold_folder(&folder.path, || true).map_err(PuzzleError::io(&folder.path))?;
        write_report(&folder, self, &self.to_markdown())
    }

    /// The results as Markdown tables.
    pub fn to_markdown(&self) -> String {
        let mut text = String::from("# An agent on puzzles that it was not trained on\n\n");
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{}. The agent was trained on {} tasks for {} episodes. On each puzzle, its greedy \
             policy played {} episodes before any training on it, and as many after {} episodes of training; so did a \
             new agent after the same training. A puzzle is solved when {:.0} % of these episodes reach the goal.\n",
            markdown::made_by(&self.command, &self.mge_version),
            self.trained_on,
            self.trained_episodes,
            self.evaluations,
            self.episodes,
            100.0 * SOLVED,
        );
        let titles = ["fewest actions", "puzzles"].into_iter().map(str::to_owned);
        let columns = ["without training", "after training", "from scratch"];
        let columns = columns.iter().flat_map(|column| [format!("success {column}"), format!("solved {column}")]);
        text += &markdown::header(titles.chain(columns));
        text += &self.row("all", |_| true);
        for (group, (_, name)) in GROUPS.iter().enumerate() {
            text += &self.row(name, |actions| group_of(actions) == Some(group));
        }
        text
    }

    /// The row of the puzzles whose fewest actions are `among`; empty if there are none.
    fn row(&self, name: &str, among: impl Fn(u32) -> bool) -> String {
        let is_among = |row: &&TransferRow| {
            self.index.puzzles.iter().any(|puzzle| puzzle.name == row.puzzle && among(puzzle.actions_needed))
        };
        let rows: Vec<&TransferRow> = self.rows.iter().filter(is_among).collect();
        if rows.is_empty() {
            return String::new();
        }
        let mean = |values: &mut dyn Iterator<Item = f64>| format!("{:.2}", values.sum::<f64>() / rows.len() as f64);
        let columns: [fn(&TransferRow) -> f64; 3] = [|row| row.at_once, |row| row.after, |row| row.from_scratch];
        let shares = columns.iter().flat_map(|of| {
            let success = mean(&mut rows.iter().map(|row| of(row)));
            let solved = mean(&mut rows.iter().map(|row| f64::from(u8::from(of(row) >= SOLVED))));
            [success, solved]
        });
        markdown::row([name.to_owned(), rows.len().to_string()].into_iter().chain(shares))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_trainer::{Method, PriorSource};

    #[test]
    fn one_training_begins_with_the_agent_and_the_other_with_a_new_one() {
        let task = Arc::new(task::load("task1").unwrap());
        let mut config = RunConfig::default_for(task.clone(), Method::DdpgAdaptive);
        (config.hold_tolerance, config.observation, config.seed) = (None, Observation::Rays, 9);
        let search = SubgoalSearch { puzzles: PathBuf::new(), model: PriorSource::Uniform, subgoals: 0 };
        let agent = Training::new(config.clone(), None).unwrap().ddpg().clone();
        let plan = TransferPlan { search, config: Arc::new(config), agent, episodes: 7, evaluations: 1, seed: 2 };
        let [trained, new] = plan.trainings(&task, &JobHandle::default()).unwrap();
        let observation = vec![0.3; plan.agent.observation_len()];
        assert_eq!(trained.ddpg().act(&observation), plan.agent.act(&observation));
        assert_ne!(new.ddpg().act(&observation), plan.agent.act(&observation));
        for training in [trained, new] {
            let config = training.config();
            assert_eq!((config.episodes, config.seed, config.practice.rollouts), (7, 2, 0));
        }
    }
}
