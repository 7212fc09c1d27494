//! Saved data of a run: its recorded episodes and the agents of its checkpoints.

use std::path::Path;
use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::SessionError;
use mge_agent::Ddpg;
use mge_env::observation_len;
use mge_guidance::ActionPrior;
use mge_run::{Checkpoint, CheckpointName, RunDirectory, RunError, read_episode};
use mge_task::Task;
use mge_trainer::{NETWORKS_SECTION, PROGRESS_SECTION, RunConfig, Trace, greedy_episode, prior_at};

/// The agent of a checkpoint.
#[derive(Debug, Clone)]
pub struct SavedAgent {
    /// Number of episodes finished when it was saved.
    pub episode: u64,
    /// Actor and critic; None for a method that does not learn.
    pub networks: Option<Arc<Ddpg>>,
    /// The action clusters in use at that time, if there were any.
    prior: Option<Arc<ActionPrior>>,
    /// Episodes of all checkpoints that existed when it was read, including this one.
    checkpoints: Vec<u64>,
}

impl SavedAgent {
    /// The action clusters, if there were any of this task.
    pub fn prior_of(&self, task: &Task) -> Option<&Arc<ActionPrior>> {
        self.prior.as_ref().filter(|prior| prior.task == task.name && prior.stages.len() == task.stage_count())
    }

    /// Whether this checkpoint is the nearest to the agent that played an episode, counted from 1.
    pub fn is_nearest_to(&self, episode: u64) -> bool {
        nearest(self.checkpoints.iter().copied(), episode) == Some(self.episode)
    }
}

/// The checkpoint nearest to the end of the episode before `episode`; the earlier one of a tie.
fn nearest(checkpoints: impl Iterator<Item = u64>, episode: u64) -> Option<u64> {
    let before = episode.saturating_sub(1);
    checkpoints.min_by_key(|checkpoint| (checkpoint.abs_diff(before), *checkpoint))
}

/// The checkpoints and recorded episodes of a run, readable on any thread.
#[derive(Debug, Clone)]
pub struct SavedRun {
    pub(super) directory: RunDirectory,
    pub(super) config: Arc<RunConfig>,
    /// The checkpoint of the agent that plays.
    pub(super) checkpoint: CheckpointName,
}

impl SavedRun {
    /// The same run with the agent of another checkpoint.
    #[must_use]
    pub fn at(self, checkpoint: CheckpointName) -> Self {
        Self { checkpoint, ..self }
    }

    /// The saved data of the run in a folder; `config` is the configuration of the run.
    ///
    /// # Errors
    /// When there is no run.
    pub fn open(folder: &Path, config: Arc<RunConfig>) -> Result<Self, RunError> {
        Ok(Self { directory: RunDirectory::open(folder)?, config, checkpoint: CheckpointName::Last })
    }

    /// Replays a recorded episode.
    ///
    /// # Errors
    /// When it is not recorded, or cannot be read.
    pub fn past_episode(&self, episode: u64) -> Result<Trace, RunError> {
        if self.config.has_removed_tasks() {
            let reason = "it was played on one of several tasks, which this version does not know".to_owned();
            return Err(RunError::Malformed { path: self.directory.episodes_path(), line: None, reason });
        }
        let played = read_episode(&self.directory.episodes_path(), episode)?;
        Ok(Trace::replay(self.config.task_of(episode), &played))
    }

    /// The agent of the checkpoint nearest to the agent that played an episode, counted from 1;
    /// returns `known` if it is that agent.
    ///
    /// # Errors
    /// When there is no checkpoint yet, or it cannot be read.
    pub fn agent_near(&self, episode: u64, known: Option<Arc<SavedAgent>>) -> Result<Arc<SavedAgent>, SessionError> {
        self.config.check_supported()?;
        let store = self.directory.checkpoints();
        let all = store.episodes()?;
        let checkpoints: Vec<u64> = all.iter().map(|(episode, _)| *episode).collect();
        let wanted = nearest(checkpoints.iter().copied(), episode);
        if let Some(known) = known.filter(|known| Some(known.episode) == wanted && known.checkpoints == checkpoints) {
            return Ok(known);
        }
        let name = all.iter().find(|(episode, _)| Some(*episode) == wanted).map_or(CheckpointName::Last, |(_, it)| *it);
        let checkpoint = store.load_sections(name, &[NETWORKS_SECTION, PROGRESS_SECTION])?;
        let networks = self.config.method.learns().then(|| networks(&checkpoint)).transpose()?;
        let prior = prior_at(&checkpoint)?;
        Ok(Arc::new(SavedAgent { episode: checkpoint.episode, networks: networks.map(Arc::new), prior, checkpoints }))
    }

    /// The agent of the checkpoint, with the number of episodes that it has finished.
    ///
    /// # Errors
    /// When the method does not learn, or there is no such checkpoint yet.
    pub fn agent(&self) -> Result<(u64, Ddpg), SessionError> {
        self.config.check_supported()?;
        if !self.config.method.learns() {
            return Err(format!("{} learns no policy: there is none to play or export", self.config.method).into());
        }
        let store = self.directory.checkpoints();
        let name = store.chosen(self.checkpoint)?;
        let checkpoint = store.load_sections(name, &[NETWORKS_SECTION])?;
        Ok((checkpoint.episode, networks(&checkpoint)?))
    }

    /// The agent of the checkpoint, to play greedy episodes: on another task than that of the run, if
    /// given (with its own start noise).
    ///
    /// # Errors
    /// As [`SavedRun::agent`], and when the agent's observations do not fit the task.
    pub fn player(&self, task: Option<Arc<Task>>) -> Result<Player, SessionError> {
        let (trained, agent) = self.agent()?;
        let task = task.unwrap_or_else(|| self.config.played_task());
        if observation_len(&task) != agent.observation_len() {
            return Err(format!("{} has another number of subgoals than the task of this run", task.name).into());
        }
        Ok(Player { trained, agent, task })
    }
}

/// An agent with a task on which it plays.
#[derive(Debug)]
pub struct Player {
    /// The number of episodes after which the agent was saved.
    pub trained: u64,
    agent: Ddpg,
    task: Arc<Task>,
}

impl Player {
    /// An episode of the greedy policy; `seed` draws its start.
    pub fn episode(&self, seed: u64) -> Trace {
        greedy_episode(&self.task, &self.agent, &mut ChaCha8Rng::seed_from_u64(seed))
    }

    /// The agent's observation before each action of an episode.
    pub fn observations(&self, trace: &Trace) -> Vec<Vec<f32>> {
        let mut env = trace.environment(&self.task);
        let before = trace.steps.iter().map_while(|step| {
            let before = env.observation();
            env.step_without_observation(step.action).ok().map(|_| before)
        });
        before.collect()
    }
}

/// Actor and critic of a checkpoint.
fn networks(checkpoint: &Checkpoint) -> Result<Ddpg, SessionError> {
    Ok(Ddpg::load(checkpoint.section(NETWORKS_SECTION)?)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checkpoint_nearest_to_the_playing_agent_is_found() {
        let near = |episode| nearest([0, 100, 200].into_iter(), episode);
        assert_eq!([near(1), near(50), near(51), near(101)], [Some(0), Some(0), Some(0), Some(100)]);
        assert_eq!([near(151), near(152), near(9000)], [Some(100), Some(200), Some(200)]);
        assert_eq!(nearest(std::iter::empty(), 5), None);
    }
}
