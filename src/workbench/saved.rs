//! What a run has saved: its past episodes, and the agents of its checkpoints.

use std::path::Path;
use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::SessionError;
use crate::agent::Ddpg;
use crate::guidance::ActionPrior;
use crate::physics::ToolSplit;
use crate::run::{Checkpoint, CheckpointName, RunDirectory, RunError, read_episode};
use crate::trainer::{NETWORKS_SECTION, PROGRESS_SECTION, RunConfig, Trace, greedy_episode, prior_at};

/// The agent of a checkpoint.
#[derive(Debug, Clone)]
pub struct SavedAgent {
    /// Episodes finished when it was saved.
    pub episode: u64,
    /// Actor and critic; none for a method that learns none.
    pub networks: Option<Arc<Ddpg>>,
    /// The action clusters in use then.
    pub prior: Option<Arc<ActionPrior>>,
    /// Episodes of all checkpoints there were when it was read, this one included.
    checkpoints: Vec<u64>,
}

impl SavedAgent {
    /// Whether no checkpoint is nearer to the agent that played an episode, counted from 1.
    pub fn is_nearest_to(&self, episode: u64) -> bool {
        nearest(self.checkpoints.iter().copied(), episode) == Some(self.episode)
    }
}

/// The episode nearest to the one before `episode`, the earlier one of two as near.
fn nearest(checkpoints: impl Iterator<Item = u64>, episode: u64) -> Option<u64> {
    let before = episode.saturating_sub(1);
    checkpoints.min_by_key(|checkpoint| (checkpoint.abs_diff(before), *checkpoint))
}

/// A run's checkpoints and what they were trained with; to be read on any thread.
#[derive(Debug, Clone)]
pub struct SavedRun {
    directory: RunDirectory,
    config: Arc<RunConfig>,
}

impl SavedRun {
    pub(super) fn new(directory: RunDirectory, config: Arc<RunConfig>) -> Self {
        Self { directory, config }
    }

    /// What the run in a folder has saved; `config` is the run's.
    ///
    /// # Errors
    /// When there is no run.
    pub fn open(folder: &Path, config: Arc<RunConfig>) -> Result<Self, RunError> {
        Ok(Self::new(RunDirectory::open(folder)?, config))
    }

    /// An episode of its past, played again.
    ///
    /// # Errors
    /// When it is not recorded, or cannot be read.
    pub fn past_episode(&self, episode: u64) -> Result<Trace, RunError> {
        let played = read_episode(&self.directory.episodes_path(), episode)?;
        Ok(Trace::replay(self.config.task_of(episode), &played))
    }

    /// The agent of the checkpoint nearest to the one that played an episode, counted from 1; that
    /// which is `known` already if it is the same.
    ///
    /// # Errors
    /// When there is no checkpoint yet, or one that cannot be read.
    pub fn agent_near(&self, episode: u64, known: Option<Arc<SavedAgent>>) -> Result<Arc<SavedAgent>, SessionError> {
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
        let stages = self.config.task.stage_count();
        let prior = prior_at(&checkpoint)?.filter(|prior| prior.stages.len() == stages);
        Ok(Arc::new(SavedAgent { episode: checkpoint.episode, networks: networks.map(Arc::new), prior, checkpoints }))
    }

    /// The agent of the newest checkpoint.
    ///
    /// # Errors
    /// When the method learns none, there is no checkpoint yet, or one that cannot be read.
    pub fn agent(&self) -> Result<Ddpg, SessionError> {
        if !self.config.method.learns() {
            return Err(SessionError::Failed(format!(
                "{} learns no policy: there is none to play or export",
                self.config.method
            )));
        }
        networks(&self.directory.checkpoints().load_sections(CheckpointName::Last, &[NETWORKS_SECTION])?)
    }

    /// An episode of the greedy policy of the newest checkpoint.
    ///
    /// # Errors
    /// As [`SavedRun::agent`].
    pub fn greedy_episode(&self, seed: u64) -> Result<Trace, SessionError> {
        self.greedy_episode_among(None, seed)
    }

    /// An episode of the greedy policy of the newest checkpoint with an action set of these tools; none for
    /// those of the training.
    ///
    /// # Errors
    /// As [`SavedRun::agent`], and when the agent does not choose among tools, but is to.
    pub fn greedy_episode_among(&self, tools: Option<ToolSplit>, seed: u64) -> Result<Trace, SessionError> {
        let agent = self.agent()?;
        if tools.is_some() && agent.options().is_none() {
            let reason = "the agent of this run has the task's own tool: it does not choose among others";
            return Err(SessionError::Failed(reason.to_owned()));
        }
        let tools = tools.or(self.config.tools);
        Ok(greedy_episode(&self.config.task, tools, &agent, &mut ChaCha8Rng::seed_from_u64(seed)))
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
    fn the_nearest_checkpoint_is_that_of_the_agent_that_played() {
        let near = |episode| nearest([0, 100, 200].into_iter(), episode);
        assert_eq!([near(1), near(50), near(51), near(101)], [Some(0), Some(0), Some(0), Some(100)]);
        assert_eq!([near(151), near(152), near(9000)], [Some(100), Some(200), Some(200)]);
        assert_eq!(nearest(std::iter::empty(), 5), None);
    }
}
