//! The training loop, one episode at a time, without threads or files.

mod error;
mod evaluation;
mod learning;
mod means;
mod multi_task;
mod practice;
mod saved;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::sync::Arc;

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::config::RunConfig;
use super::exploration::{Attempts, Explorer, explorer, needs};
use super::hold::{Failure, Hold};
use super::method::Method;
use super::parts::Granularity;
use super::prior::{PriorError, consulted_model};
use super::streams::{self, Streams};
use super::tools::{self, Space};
use super::trace::Trace;
use crate::watch::SharedPhase;
use mge_agent::{Ddpg, Learner};
use mge_base::stop::Stop;
use mge_base::streams::Stream;
use mge_env::{Action, Environment, Placement, Step};
use mge_guidance::{self as guidance, ActionPrior, EpsilonSchedule, InterruptibleModel, Played, RolloutModel};
use mge_run::{EpisodeRecord, Source};
use mge_stats::rolling::{RollingRate, WINDOW};

pub use error::TrainingError;
pub use evaluation::greedy_episode;
use means::UpdateMeans;
use multi_task::TaskState;
pub use saved::{CONFIG_SECTION, NETWORKS_SECTION, PROGRESS_SECTION, check_settings, priors_at};

/// Everything that changes during a run except the learner, which is saved separately.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct TrainingState {
    /// The seed that the run began with; none in checkpoints of earlier versions.
    #[serde(default)]
    seed: Option<u64>,
    episode: u64,
    environment_steps: u64,
    recent: RollingRate,
    streams: Streams,
    epsilon: EpsilonSchedule,
    prior: Option<Arc<ActionPrior>>,
    /// Rewarding actions of real play for each stage, the oldest first.
    #[serde(default)]
    rewarding: Vec<VecDeque<Vec<f32>>>,
    /// Greedy attempts at each stage.
    #[serde(default, skip_serializing_if = "Attempts::is_empty")]
    attempts: Attempts,
    /// The record of the acting policy.
    #[serde(default, skip_serializing_if = "Hold::is_unused")]
    hold: Hold,
    /// Actions of the first successful episode, for [`Method::OpenLoop`] to repeat.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    first_success: Option<Vec<Action>>,
    /// What is kept for each of the further tasks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    further: Vec<TaskState>,
}

/// A run in memory: environment, learner, prior, schedule, streams and counters.
#[derive(Debug, Clone)]
pub struct Training {
    config: RunConfig,
    /// The model for planning or imagination, if the method uses one.
    model: Option<Arc<dyn RolloutModel>>,
    /// The environment of the task being played; between episodes, of the first task.
    env: Environment,
    /// The environments of the further tasks.
    further: Vec<Environment>,
    learner: Learner,
    progress: TrainingState,
    /// Abandons the current episode when requested.
    stop: Stop,
    /// Shows the current phase to observers.
    phase: SharedPhase,
}

impl Training {
    /// A new run. The prior is needed only if the run is guided.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn new(config: RunConfig, prior: Option<Arc<ActionPrior>>) -> Result<Self, TrainingError> {
        config.validate()?;
        let mut weights = Stream::AgentWeights.of(config.seed);
        let Space { observation, action, options } = Space::of(&config);
        let learner_streams = streams::learner(config.seed);
        let learner = Learner::new(observation, action, options, &config.ddpg, &mut weights, learner_streams)
            .map_err(|error| error.within("ddpg"))?;
        let progress = TrainingState {
            seed: Some(config.seed),
            episode: 0,
            environment_steps: 0,
            recent: RollingRate::default(),
            streams: Streams::new(config.seed),
            epsilon: config.epsilon.clone(),
            prior,
            rewarding: Vec::new(),
            attempts: Attempts::default(),
            hold: Hold::default(),
            first_success: None,
            further: vec![TaskState::default(); config.further_tasks.len()],
        };
        Self::assembled(config, learner, progress)
    }

    /// Assembles a training between two episodes.
    fn assembled(config: RunConfig, mut learner: Learner, progress: TrainingState) -> Result<Self, TrainingError> {
        let model = consulted_model(&config)?;
        let env_of = |task| tools::environment(config.played(task), config.observation, config.tools);
        let env = env_of(&config.task);
        let further = config.further_tasks.iter().map(env_of).collect();
        learner.ddpg_mut().set_candidates(config.tool_candidates);
        let (stop, phase) = (Stop::default(), SharedPhase::default());
        Ok(Self { config, model, env, further, learner, progress, stop, phase })
    }

    /// The configuration.
    pub fn config(&self) -> &RunConfig {
        &self.config
    }

    /// Number of episodes finished so far.
    pub fn episode(&self) -> u64 {
        self.progress.episode
    }

    /// Whether all episodes are done.
    pub fn is_finished(&self) -> bool {
        self.progress.episode >= u64::from(self.config.episodes)
    }

    /// Number of transitions recorded so far, including imagined ones.
    #[cfg(test)]
    pub(super) fn transitions(&self) -> u64 {
        self.learner.recorded()
    }

    /// The scale of the exploration noise in the latest episode.
    #[cfg(test)]
    pub(super) fn noise_scale(&self) -> f32 {
        self.learner.noise().scale()
    }

    /// The current actor and critic.
    pub fn ddpg(&self) -> &Ddpg {
        self.learner.ddpg()
    }

    /// The action prior in use; with several tasks, that of the first.
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
        let every = u64::from(self.config.evaluation.every);
        self.config.method.learns() && every > 0 && episode.is_multiple_of(every)
    }

    /// Whether the next episode does what the one before it did not: an evaluation, or the first update.
    pub fn may_take_longer(&self) -> bool {
        let (recorded, warmup) = (self.learner.recorded(), self.config.ddpg.warmup_steps as u64);
        let most = u64::from(self.env.task().rules.max_actions);
        self.is_evaluated_after(self.progress.episode + 1) || (recorded < warmup && warmup <= recorded + most)
    }

    /// From now on, sets `phase` during practice.
    pub(super) fn share_phase(&mut self, phase: &SharedPhase) {
        self.phase = phase.clone();
    }

    /// Sets the epsilon schedule from the next episode on.
    pub fn set_schedule(&mut self, schedule: EpsilonSchedule) {
        self.progress.epsilon = schedule;
    }

    /// The need for exploration of each stage, the goal last; empty if the schedule does not depend on need, and with
    /// several tasks, each of which has its own.
    pub fn needs(&self) -> Vec<f32> {
        if self.further.is_empty() { self.current_needs() } else { Vec::new() }
    }

    fn current_needs(&self) -> Vec<f32> {
        needs(self.schedule(), &self.progress.attempts, self.env.task().stage_count())
    }

    /// Sets the action prior from the next episode on; with several tasks, that of the first.
    pub fn set_prior(&mut self, prior: Arc<ActionPrior>) {
        self.progress.prior = Some(prior);
    }

    /// Runs one episode, with several tasks on the one whose turn it is. Returns the record for the log, and the trace
    /// of the episode.
    ///
    /// # Errors
    /// When the learner diverges, or the episode is abandoned.
    pub fn run_episode(&mut self) -> Result<(EpisodeRecord, Trace), TrainingError> {
        let turn = self.turn();
        self.on_task(turn, Self::play_episode)
    }

    /// Runs one episode of acting and learning (paper, section 4.3): with probability epsilon,
    /// actions come from the clusters of the next stage, otherwise from the actor with
    /// Ornstein-Uhlenbeck noise.
    fn play_episode(&mut self) -> Result<(EpisodeRecord, Trace), TrainingError> {
        let episode = self.progress.episode as u32;
        let threshold = self.threshold();
        let needs = self.current_needs();
        let mean_need = if needs.is_empty() { 1.0 } else { needs.iter().sum::<f32>() / needs.len() as f32 };
        let noise_scale = self.config.noise_decay.scale(episode, self.config.episodes);
        self.learner.set_noise_scale(noise_scale);
        self.hold_or_release();
        self.learner.start_episode();
        self.env.reset(&mut self.progress.streams.environment);
        let mut observation = tools::observed(&self.env);
        let mut trace = Trace::begin(&self.env, u64::from(episode) + 1);
        let mut means = UpdateMeans::default();
        let mut played = Played::default();
        let mut states = Vec::new();
        let mut explorer = self.draw(threshold);
        // Whether all actions since the beginning of the stage were greedy.
        let mut greedy = true;
        loop {
            self.stop.check()?;
            if self.config.method == Method::ModelReplay {
                states.push(self.env.snapshot().clone());
            }
            let stage = self.env.snapshot().stage();
            let (action, source) = self.choose(&observation, explorer, trace.steps.len())?;
            let choice = tools::choice(self.learner.ddpg(), &self.env, &action);
            let attempted = self.attempted_stage();
            let step = trace.step(&mut self.env, choice, source)?;
            let next_observation = tools::observed(&self.env);
            played.note(&action, &step);
            let reached = step.reached_stage();
            greedy &= explorer == Explorer::Greedy;
            if (reached || step.end.is_some())
                && std::mem::replace(&mut greedy, true)
                && let Some(stage) = attempted
            {
                self.note_attempt(stage, reached);
            }
            let updates = self.learn_from(stage, [&observation, &next_observation], &action, &step, &mut played)?;
            updates.iter().for_each(|metrics| means.add(metrics));
            if step.end.is_some() {
                self.imagine(&states, noise_scale)?;
                let record = self.finish_episode(&trace, &step, threshold * mean_need, noise_scale, &means);
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

    /// The epsilon schedule in effect. A schedule that a user has changed in a run that has clusters applies even if
    /// the run began without guidance.
    fn schedule(&self) -> &EpsilonSchedule {
        if self.config.method.uses("epsilon") || self.has_live_schedule() {
            &self.progress.epsilon
        } else {
            &EpsilonSchedule::Constant(0.0)
        }
    }

    fn has_live_schedule(&self) -> bool {
        self.progress.prior.is_some() && self.progress.epsilon != self.config.epsilon
    }

    /// The probability with which the next episode's actions are drawn from the clusters.
    fn threshold(&self) -> f32 {
        if self.config.method == Method::OpenLoop {
            return if self.progress.first_success.is_some() { 0.0 } else { 1.0 };
        }
        let has_clusters = self.config.is_guided() || self.has_live_schedule();
        if has_clusters { self.schedule().threshold(self.progress.episode as u32) } else { 0.0 }
    }

    /// Draws what chooses the actions of the next stage. Always consumes a random number, so that the
    /// stream does not depend on the schedule.
    fn draw(&mut self, threshold: f32) -> Explorer {
        let draw: f32 = self.progress.streams.guidance.r#gen();
        if self.config.method == Method::OpenLoop {
            return Explorer::Clusters;
        }
        explorer(self.schedule(), threshold, &self.progress.attempts, self.env.snapshot().stage(), draw)
    }

    /// Holds a policy only with exploration by need, where greedy attempts measure its success.
    fn hold_or_release(&mut self) {
        let is_held = self.learner.ddpg().holds_policy();
        let by_need = matches!(self.schedule(), EpsilonSchedule::Need { .. });
        match by_need && self.config.hold_tolerance.is_some() {
            true if !is_held => {
                self.progress.hold = Hold::default();
                self.learner.ddpg_mut().hold_policy();
            }
            false if is_held => self.learner.ddpg_mut().release_policy(),
            _ => {}
        }
    }

    /// The stage that an action taken now attempts to reach. After the goal there is none, except in runs with the
    /// task's own tool: these keep counting attempts at the goal, as they did when their results were recorded.
    fn attempted_stage(&self) -> Option<usize> {
        let now = self.env.snapshot();
        (self.config.tools.is_none() || !now.goal_reached()).then_some(now.stage())
    }

    fn note_attempt(&mut self, stage: usize, reached: bool) {
        let EpsilonSchedule::Need { attempts, .. } = *self.schedule() else { return };
        let progress = &mut self.progress;
        progress.attempts.note(stage, reached, attempts);
        let Some(tolerance) = self.config.hold_tolerance else { return };
        let Some(failure) = progress.hold.note(stage, reached, attempts, tolerance) else { return };
        let ddpg = self.learner.ddpg_mut();
        match failure {
            Failure::Proven => {
                ddpg.mark_policy_proven();
                ddpg.hold_policy();
            }
            Failure::Worse => ddpg.return_to_proven_policy(),
            Failure::Unproven => ddpg.hold_policy(),
        }
    }

    fn choose(
        &mut self,
        observation: &[f32],
        explorer: Explorer,
        step: usize,
    ) -> Result<(Vec<f32>, Source), TrainingError> {
        let recorded = self.progress.first_success.iter().find_map(|actions| actions.get(step).or(actions.last()));
        if let Some(action) = recorded {
            return Ok((action.to_vec(), Source::Recorded));
        }
        let streams = &mut self.progress.streams;
        Ok(match (&self.model, &self.progress.prior) {
            (Some(model), _) if self.config.method == Method::Planning => {
                let planner = &self.config.planner;
                let model = InterruptibleModel::new(&**model, &self.stop);
                let action = guidance::plan(&model, self.env.snapshot(), planner, &mut streams.model);
                let action = action.map_err(PriorError::from)?;
                (action.to_vec(), Source::Planner)
            }
            (_, Some(prior)) if explorer == Explorer::Clusters => {
                (tools::explored(self.learner.ddpg(), &self.env, prior, &mut streams.guidance), Source::Clusters)
            }
            _ if explorer == Explorer::Greedy => (self.learner.ddpg().act(observation), Source::Policy),
            _ => (self.learner.explore(observation), Source::Policy),
        })
    }

    fn finish_episode(
        &mut self,
        trace: &Trace,
        last: &Step,
        epsilon: f32,
        noise_scale: f32,
        means: &UpdateMeans,
    ) -> EpisodeRecord {
        let progress = &mut self.progress;
        let snapshot = self.env.snapshot();
        let steps = trace.steps.len() as u64;
        progress.episode += 1;
        progress.environment_steps += steps;
        if self.config.method == Method::OpenLoop && snapshot.goal_reached() {
            let actions = || trace.steps.iter().map(|step| step.action).collect();
            progress.first_success.get_or_insert_with(actions);
        }
        let rolling_success = progress.recent.push(snapshot.goal_reached(), WINDOW);
        let placed = snapshot.placed().len() as u32;
        let is_blocked = |placement| !matches!(placement, Placement::Placed | Placement::NoOp);
        let blocked = trace.steps.iter().filter(|step| is_blocked(step.placement)).count() as u32;
        EpisodeRecord {
            episode: progress.episode,
            steps,
            environment_steps: progress.environment_steps,
            return_: trace.total_reward(),
            goal: snapshot.goal_reached(),
            subgoals: snapshot.reached().iter().filter(|reached| **reached).count() as u32,
            subgoals_total: snapshot.reached().len() as u32,
            guided: trace.steps.iter().any(|step| step.source == Source::Clusters),
            epsilon,
            noise_sigma: self.config.ddpg.ou.sigma * noise_scale,
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
        }
    }
}
