//! The training loop, one episode at a time, without threads or files.

mod evaluation;
mod exploring;
mod learning;
mod means;
mod practice;
mod saved;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::composition::{Actor, Composition};
use super::config::RunConfig;
use super::error::Result;
use super::exploration::{Attempts, Explorer};
use super::hold::Hold;
use super::parts::Granularity;
use super::streams::{self, Streams};
use super::trace::Trace;
use crate::watch::SharedPhase;
use mge_agent::{Ddpg, Learner};
use mge_base::stop::Stop;
use mge_base::streams::Stream;
use mge_env::{Action, Environment, Placement, Step, observation_len};
use mge_guidance::{ActionPrior, EpsilonSchedule, Played};
use mge_run::{EpisodeRecord, Source};
use mge_stats::rolling::{RollingRate, WINDOW};

pub use evaluation::greedy_episode;
use means::UpdateMeans;
pub use saved::{NETWORKS_SECTION, PROGRESS_SECTION, prior_at};

/// Length of an action: a position.
const ACTION_LEN: usize = 2;

/// Everything that changes during a run except the learner, which is saved separately.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct TrainingState {
    /// The seed that the run began with; none in checkpoints of earlier versions.
    #[serde(default)]
    seed: Option<u64>,
    episode: u64,
    environment_steps: u64,
    /// Actions that the run is charged for: see [`Metric::ChargedActions`](mge_run::Metric::ChargedActions). None in
    /// runs of earlier versions, which did not count them.
    #[serde(default)]
    charged_actions: Option<u64>,
    recent: RollingRate,
    streams: Streams,
    epsilon: EpsilonSchedule,
    prior: Option<Arc<ActionPrior>>,
    /// Rewarding actions of real play for each stage, the oldest first.
    #[serde(default)]
    rewarding: Vec<VecDeque<Action>>,
    /// Greedy attempts at each stage.
    #[serde(default, skip_serializing_if = "Attempts::is_empty")]
    attempts: Attempts,
    /// The record of the acting policy.
    #[serde(default, skip_serializing_if = "Hold::is_unused")]
    hold: Hold,
    /// Actions of the first successful episode, for [`Actor::FirstSuccess`] to repeat.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    first_success: Option<Vec<Action>>,
}

impl TrainingState {
    /// Counts actions of practice or of an episode.
    fn take_actions(&mut self, actions: u64) {
        self.environment_steps += actions;
        self.charge(actions);
    }

    fn charge(&mut self, actions: u64) {
        self.charged_actions = self.charged_actions.map(|charged| charged + actions);
    }

    /// Replaces the action prior, and charges the actions that it cost.
    fn use_prior(&mut self, prior: Option<Arc<ActionPrior>>) {
        if let Some(new) = prior.as_ref().filter(|new| self.prior.as_ref() != Some(*new)) {
            self.charge(new.environment_actions());
        }
        self.prior = prior;
    }
}

/// A run in memory: environment, learner, prior, schedule, streams and counters.
#[derive(Debug, Clone)]
pub struct Training {
    /// The configuration.
    pub config: RunConfig,
    parts: Composition,
    env: Environment,
    learner: Learner,
    progress: TrainingState,
    /// Abandons the current episode when requested.
    stop: Stop,
    /// Shows the current phase to observers.
    /// Set during practice.
    pub(super) phase: SharedPhase,
}

impl Training {
    /// A new run. The prior is needed only if the run is guided, and does not build it when it
    /// [practises](Self::practise).
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn new(config: RunConfig, prior: Option<Arc<ActionPrior>>) -> Result<Self> {
        config.validate()?;
        config.check_supported()?;
        let mut weights = Stream::AgentWeights.of(config.seed);
        let observation_len = observation_len(&config.task);
        let learner =
            Learner::new(observation_len, ACTION_LEN, &config.ddpg, &mut weights, streams::learner(config.seed))
                .map_err(|error| error.within("ddpg"))?;
        let mut progress = TrainingState {
            seed: Some(config.seed),
            episode: 0,
            environment_steps: 0,
            charged_actions: Some(config.task.search_actions + config.launches()),
            recent: RollingRate::default(),
            streams: Streams::new(config.seed),
            epsilon: config.epsilon.clone(),
            prior: None,
            rewarding: Vec::new(),
            attempts: Attempts::default(),
            hold: Hold::default(),
            first_success: None,
        };
        progress.use_prior(prior);
        Self::assembled(config, learner, progress)
    }

    /// Assembles a training between two episodes.
    fn assembled(config: RunConfig, learner: Learner, progress: TrainingState) -> Result<Self> {
        let parts = Composition::of(&config)?;
        let env = Environment::new(config.played_task());
        let (stop, phase) = (Stop::default(), SharedPhase::default());
        Ok(Self { config, parts, env, learner, progress, stop, phase })
    }

    /// Number of episodes finished so far.
    pub fn episode(&self) -> u64 {
        self.progress.episode
    }

    /// Whether all episodes are done, or the success is that of the stop rule.
    pub fn is_finished(&self) -> bool {
        self.config.is_finished(self.progress.episode, &self.progress.recent)
    }

    /// Number of transitions recorded so far.
    #[cfg(test)]
    pub(super) fn transitions(&self) -> u64 {
        self.learner.recorded
    }

    /// The scale of the exploration noise in the latest episode.
    #[cfg(test)]
    pub(super) fn noise_scale(&self) -> f32 {
        self.learner.noise.scale
    }

    /// The current actor and critic.
    pub fn ddpg(&self) -> &Ddpg {
        &self.learner.ddpg
    }

    /// The action prior in use.
    pub fn prior(&self) -> Option<&Arc<ActionPrior>> {
        self.progress.prior.as_ref()
    }

    /// From now on, episodes are abandoned once `stop` is requested. An abandoned episode leaves the training
    /// in an unusable state: continue with a copy made before.
    pub(super) fn stop_on(&mut self, stop: &Stop) {
        self.stop = stop.clone();
    }

    /// Whether the policy is evaluated after this many episodes.
    pub(super) fn is_evaluated_after(&self, episode: u64) -> bool {
        self.parts.evaluation_interval.is_some_and(|every| episode.is_multiple_of(every))
    }

    /// Whether the next episode does what the one before it did not: an evaluation, or the first update.
    pub fn may_take_longer(&self) -> bool {
        let (recorded, warmup) = (self.learner.recorded, self.config.ddpg.warmup_steps as u64);
        let most = u64::from(self.env.task().rules.max_actions);
        self.is_evaluated_after(self.progress.episode + 1) || (recorded < warmup && warmup <= recorded + most)
    }

    /// Sets the epsilon schedule from the next episode on.
    pub fn set_schedule(&mut self, schedule: EpsilonSchedule) {
        self.progress.epsilon = schedule;
    }

    /// Sets the action prior from the next episode on.
    pub fn set_prior(&mut self, prior: Arc<ActionPrior>) {
        self.progress.use_prior(Some(prior));
    }

    /// Runs one episode of acting and learning (paper, section 4.3): with probability epsilon,
    /// actions come from the clusters of the next stage, otherwise from the actor with
    /// Ornstein-Uhlenbeck noise. Returns the record for the log, and the trace of the episode.
    ///
    /// # Errors
    /// When the learner diverges, or the episode is abandoned.
    pub fn run_episode(&mut self) -> Result<(EpisodeRecord, Trace)> {
        let episode = self.progress.episode as u32;
        let threshold = self.threshold();
        let needs = self.needs();
        let mean_need = if needs.is_empty() { 1.0 } else { needs.iter().sum::<f32>() / needs.len() as f32 };
        self.learner.noise.scale = self.config.noise_scale(episode);
        self.hold_or_release();
        self.learner.start_episode();
        let mut observation = self.env.reset(&mut self.progress.streams.environment);
        let mut trace = Trace::begin(&self.env, u64::from(episode) + 1);
        let mut means = UpdateMeans::default();
        let mut played = Played::default();
        let mut explorer = self.draw(threshold);
        // Whether all actions since the beginning of the stage were greedy.
        let mut greedy = true;
        loop {
            self.stop.check()?;
            let stage = self.env.snapshot().stage();
            let (action, source) = self.choose(&observation, explorer, trace.steps.len())?;
            let step = trace.step(&mut self.env, action, source)?;
            let next_observation = self.env.observation();
            played.note(action, &step);
            let reached = step.reached_stage();
            greedy &= explorer == Explorer::Greedy;
            if (reached || step.end.is_some()) && std::mem::replace(&mut greedy, true) {
                self.note_attempt(stage, reached);
            }
            let updates = self.learn_from(stage, [&observation, &next_observation], action, &step, &mut played)?;
            updates.iter().for_each(|metrics| means.add(metrics));
            if step.end.is_some() {
                let record = self.finish_episode(&trace, &step, threshold * mean_need, &means);
                return Ok((record, trace));
            }
            let again = match self.config.granularity {
                Granularity::Episode => false,
                Granularity::Stage => !step.subgoals.is_empty(),
                Granularity::Step => true,
            };
            if again {
                explorer = self.draw(threshold);
            }
            observation = next_observation;
        }
    }

    fn finish_episode(&mut self, trace: &Trace, last: &Step, epsilon: f32, means: &UpdateMeans) -> EpisodeRecord {
        let progress = &mut self.progress;
        let snapshot = self.env.snapshot();
        let steps = trace.steps.len() as u64;
        progress.episode += 1;
        progress.take_actions(steps);
        if matches!(self.parts.actor, Actor::FirstSuccess) && snapshot.goal_reached {
            let actions = || trace.steps.iter().map(|step| step.action).collect();
            progress.first_success.get_or_insert_with(actions);
        }
        let rolling_success = progress.recent.push(snapshot.goal_reached, WINDOW);
        let placed = snapshot.placed.len() as u32;
        let is_blocked = |placement| !matches!(placement, Placement::Placed | Placement::NoOp);
        let blocked = trace.steps.iter().filter(|step| is_blocked(step.placement)).count() as u32;
        EpisodeRecord {
            episode: progress.episode,
            steps,
            environment_steps: progress.environment_steps,
            return_: trace.total_reward(),
            goal: snapshot.goal_reached,
            subgoals: snapshot.reached.iter().filter(|reached| **reached).count() as u32,
            subgoals_total: snapshot.reached.len() as u32,
            guided: trace.steps.iter().any(|step| step.source == Source::Clusters),
            epsilon,
            noise_sigma: self.config.ddpg.ou.sigma * self.learner.noise.scale,
            critic_loss: means.mean(|sum| sum.critic_loss),
            mean_q: means.mean(|sum| sum.mean_q),
            max_q: means.max_q(),
            actor_loss: means.mean(|sum| sum.actor_loss),
            action_saturation: means.mean(|sum| sum.action_saturation),
            rolling_success,
            terminated: last.terminated,
            truncated: last.truncated,
            end: last.end.map(|end| end.to_string()).unwrap_or_default(),
            placed,
            blocked,
            charged_actions: progress.charged_actions,
        }
    }
}
