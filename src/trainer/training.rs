//! The training loop, one episode at a time, without threads or files.

use std::collections::VecDeque;
use std::sync::Arc;

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::config::{Granularity, RunConfig};
use super::exploration::{Attempts, Explorer, explorer, needs};
use super::hold::Hold;
use super::imagination::imagine;
use super::method::Method;
use super::prior::{PriorError, consulted_model};
use super::streams::{self, Streams};
use super::trace::Trace;
use crate::agent::{self, Ddpg, Learner, Transition, UpdateMetrics};
use crate::env::{Action, Environment, EpisodeOver, Placement, Snapshot, Step, observation_len};
use crate::guidance::{self, ActionPrior, EpsilonSchedule, Played, RolloutModel, Stoppable};
use crate::run::{Checkpoint, EpisodeRecord, Event, RunError, Source};
use crate::stats::rolling::{RollingRate, WINDOW};
use crate::stop::Stop;
use crate::streams::Stream;
use crate::task::Task;
use crate::validation::ValidationError;

/// The checkpoint section that holds the networks, as a safetensors file.
pub const NETWORKS_SECTION: &str = "learner.safetensors";
const REPLAY_SECTION: &str = "replay.bin";
/// The checkpoint section that holds counters, streams, schedule and action prior, as JSON.
pub const PROGRESS_SECTION: &str = "progress.json";

/// Why training cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum TrainingError {
    /// A setting is out of range.
    #[error(transparent)]
    Config(#[from] ValidationError),
    /// The model that the method consults.
    #[error(transparent)]
    Model(PriorError),
    /// The environment was not reset.
    #[error(transparent)]
    Episode(#[from] EpisodeOver),
    /// The learner diverged.
    #[error(transparent)]
    Update(#[from] agent::UpdateError),
    /// The replay buffer refused a transition.
    #[error(transparent)]
    Replay(#[from] agent::ReplayError),
    /// A saved learner cannot be used.
    #[error(transparent)]
    State(#[from] agent::StateError),
    /// A checkpoint cannot be read or written.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The settings were changed after the run had begun.
    #[error("config.json has other settings of `ddpg` than the run began with: put them back, or start a new run")]
    OtherSettings,
    /// The checkpoint from which a fork goes on is gone.
    #[error("the run is a fork, and the checkpoint from which it goes on is gone: fork the other run again")]
    ForkedFromNothing,
    /// The task has another number of subgoals.
    #[error("a fork keeps the number of subgoals: the networks have learned with it")]
    OtherObservations,
    /// The episode was abandoned, as was asked for.
    #[error("stopped in the middle of an episode")]
    Stopped,
}

impl From<PriorError> for TrainingError {
    fn from(error: PriorError) -> Self {
        if error.is_stopped() { Self::Stopped } else { Self::Model(error) }
    }
}

/// The action prior in use when a checkpoint was saved, if there was one.
///
/// # Errors
/// When the checkpoint does not have it in the form in which it is saved.
pub fn prior_at(checkpoint: &Checkpoint) -> Result<Option<Arc<ActionPrior>>, RunError> {
    #[derive(Deserialize)]
    struct WithPrior {
        prior: Option<Arc<ActionPrior>>,
    }
    Ok(checkpoint.json::<WithPrior>(PROGRESS_SECTION)?.prior)
}

/// Everything that changes during a run but the learner, which saves itself.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Progress {
    episode: u64,
    environment_steps: u64,
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
    /// What is known of the policy that acts.
    #[serde(default, skip_serializing_if = "Hold::is_unused")]
    hold: Hold,
    /// Actions of the first successful episode, for [`Method::OpenLoop`] to repeat.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    first_success: Option<Vec<Action>>,
}

/// A run in memory: environment, learner, prior, schedule, streams and counters.
#[derive(Debug, Clone)]
pub struct Training {
    config: RunConfig,
    /// What plans or imagines, if the method does.
    model: Option<Arc<dyn RolloutModel>>,
    env: Environment,
    learner: Learner,
    progress: Progress,
    /// An episode is abandoned when it is set.
    stop: Stop,
}

/// Means over the updates of an episode.
#[derive(Debug, Default)]
struct UpdateMeans {
    updates: u32,
    sum: UpdateMetrics,
}

impl Training {
    /// A new run. The prior is needed only if the run is guided.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub fn new(config: RunConfig, prior: Option<Arc<ActionPrior>>) -> Result<Self, TrainingError> {
        config.validate()?;
        let mut weights = Stream::AgentWeights.of(config.seed);
        let observations = observation_len(&config.task);
        let learner_streams = streams::learner(config.seed);
        let learner = Learner::new(observations, 2, &config.ddpg, &mut weights, learner_streams)
            .map_err(|error| error.within("ddpg"))?;
        let progress = Progress {
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
        };
        let model = consulted_model(&config)?;
        Ok(Self {
            env: Environment::new(config.played_task()),
            config,
            model,
            learner,
            progress,
            stop: Stop::default(),
        })
    }

    /// A run that continues from a checkpoint exactly as if it had not been interrupted.
    ///
    /// # Errors
    /// When the checkpoint is not one of this configuration.
    pub fn resume(config: RunConfig, checkpoint: &Checkpoint) -> Result<Self, TrainingError> {
        config.validate()?;
        let learner = Learner::load(&agent::Checkpoint {
            networks: checkpoint.section(NETWORKS_SECTION)?.to_vec(),
            replay: checkpoint.section(REPLAY_SECTION)?.to_vec(),
        })?;
        if learner.ddpg().observation_len() != observation_len(&config.task) {
            return Err(agent::StateError::Foreign.into());
        }
        if *learner.ddpg().config() != config.ddpg {
            return Err(TrainingError::OtherSettings);
        }
        let progress = checkpoint.json(PROGRESS_SECTION)?;
        let model = consulted_model(&config)?;
        Ok(Self {
            env: Environment::new(config.played_task()),
            config,
            model,
            learner,
            progress,
            stop: Stop::default(),
        })
    }

    /// The training with other settings from here on. What was learned stays, and so does what is in the replay
    /// buffer; on another task what was found on the old one does not.
    ///
    /// # Errors
    /// When a setting is out of range, or what was learned has another shape with it.
    pub(super) fn forked(self, config: RunConfig, prior: Option<Arc<ActionPrior>>) -> Result<Self, TrainingError> {
        config.validate()?;
        let Self { config: old, mut learner, mut progress, .. } = self;
        if learner.ddpg().observation_len() != observation_len(&config.task) {
            return Err(TrainingError::OtherObservations);
        }
        learner.change(&config.ddpg).map_err(|error| error.within("ddpg"))?;
        // A schedule that was changed since the run began holds until another is asked for.
        if config.epsilon != old.epsilon {
            progress.epsilon = config.epsilon.clone();
        }
        if config.task != old.task {
            progress.rewarding.clear();
            progress.first_success = None;
        }
        if config.epsilon != old.epsilon || config.task != old.task {
            // What attempts have shown, and the policies that were held for it.
            (progress.attempts, progress.hold) = (Attempts::default(), Hold::default());
            learner.ddpg_mut().release_policy();
        }
        progress.prior = prior;
        let model = consulted_model(&config)?;
        let env = Environment::new(config.played_task());
        Ok(Self { config, model, env, learner, progress, stop: Stop::default() })
    }

    /// The whole state of the run, between two episodes.
    ///
    /// # Errors
    /// When the progress cannot be encoded.
    pub fn checkpoint(&self) -> Result<Checkpoint, TrainingError> {
        let saved = self.learner.save();
        let mut checkpoint = Checkpoint::new(self.progress.episode);
        checkpoint.insert(NETWORKS_SECTION, saved.networks)?;
        checkpoint.insert(REPLAY_SECTION, saved.replay)?;
        checkpoint.insert_json(PROGRESS_SECTION, &self.progress)?;
        Ok(checkpoint)
    }

    /// The configuration.
    pub fn config(&self) -> &RunConfig {
        &self.config
    }

    /// Episodes finished so far.
    pub fn episode(&self) -> u64 {
        self.progress.episode
    }

    /// Whether all episodes are done.
    pub fn is_finished(&self) -> bool {
        self.progress.episode >= u64::from(self.config.episodes)
    }

    /// Transitions recorded for learning so far, imagined ones included.
    pub fn transitions(&self) -> u64 {
        self.learner.recorded()
    }

    /// What the exploration noise of the latest episode was multiplied by.
    #[cfg(test)]
    pub(super) fn noise_scale(&self) -> f32 {
        self.learner.noise().scale()
    }

    /// Actor and critic as they are.
    pub fn ddpg(&self) -> &Ddpg {
        self.learner.ddpg()
    }

    /// The action prior in use.
    pub fn prior(&self) -> Option<&Arc<ActionPrior>> {
        self.progress.prior.as_ref()
    }

    /// From now on an episode is abandoned once `stop` is requested. What an abandoned episode leaves is
    /// of no use: go on with a copy of what there was before.
    pub(super) fn obey(&mut self, stop: &Stop) {
        self.stop = stop.clone();
    }

    /// Another epsilon schedule from the next episode on.
    pub fn set_schedule(&mut self, schedule: EpsilonSchedule) {
        self.progress.epsilon = schedule;
    }

    /// The need for exploration of each stage, the goal last; empty if the schedule does not go by need.
    pub fn needs(&self) -> Vec<f32> {
        needs(&self.progress.epsilon, &self.progress.attempts, self.config.task.stage_count())
    }

    /// Another action prior from the next episode on.
    pub fn set_prior(&mut self, prior: Arc<ActionPrior>) {
        self.progress.prior = Some(prior);
    }

    /// One episode of acting and learning (paper, section 4.3): with probability epsilon
    /// actions come from the clusters of the next stage, otherwise from the actor with
    /// Ornstein-Uhlenbeck noise. Returns what is logged, and the episode step by step.
    ///
    /// # Errors
    /// When the learner diverges, or the episode is abandoned.
    pub fn run_episode(&mut self) -> Result<(EpisodeRecord, Trace), TrainingError> {
        let episode = self.progress.episode as u32;
        let threshold = if self.config.is_guided() || self.has_live_schedule() {
            self.progress.epsilon.threshold(episode)
        } else {
            0.0
        };
        let needs = self.needs();
        let mean_need = if needs.is_empty() { 1.0 } else { needs.iter().sum::<f32>() / needs.len() as f32 };
        let noise_scale = self.config.noise_decay.scale(episode, self.config.episodes);
        self.learner.set_noise_scale(noise_scale);
        self.learner.set_actor_rate_scale(self.config.actor_rate_decay.scale(episode, self.config.episodes));
        self.hold_or_release();
        self.learner.start_episode();
        let mut observation = self.env.reset(&mut self.progress.streams.environment);
        let mut trace = Trace { episode: u64::from(episode) + 1, shift: self.env.shift(), steps: Vec::new() };
        let mut means = UpdateMeans::default();
        let mut played = Played::default();
        let mut states = Vec::new();
        let mut explorer = self.draw(threshold);
        // Whether the stage has been played greedily from its beginning.
        let mut greedy = true;
        loop {
            if self.stop.is_requested() {
                return Err(TrainingError::Stopped);
            }
            if self.config.method == Method::ModelReplay {
                states.push(self.env.snapshot().clone());
            }
            let stage = self.env.snapshot().stage();
            let (action, source) = self.choose(&observation, explorer, trace.steps.len())?;
            let step = trace.step(&mut self.env, action, source)?;
            played.note(action, &step);
            let reached = step.goal || !step.subgoals.is_empty();
            greedy &= explorer == Explorer::Greedy;
            if (reached || step.end.is_some()) && std::mem::replace(&mut greedy, true) {
                self.note_attempt(stage, reached);
            }
            if reached {
                self.keep_rewarding(stage, played.take_rewarding(self.config.guidance.rewarding));
            }
            if self.config.method.learns() {
                self.learner.record(Transition {
                    observation: &observation,
                    action: &action,
                    reward: step.reward,
                    next_observation: &step.observation,
                    terminated: step.terminated,
                })?;
                if reached {
                    self.learner.reach(stage);
                }
                if let Some(metrics) = self.learner.learn()? {
                    means.add(&metrics);
                }
            }
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
            observation = step.observation;
        }
    }

    /// Puts transitions imagined by the model from the episode's states into the replay buffer, if that
    /// is the method.
    fn imagine(&mut self, states: &[Snapshot], noise_scale: f32) -> Result<(), TrainingError> {
        let (Method::ModelReplay, Some(model)) = (self.config.method, &self.model) else { return Ok(()) };
        let model = Stoppable::new(&**model, &self.stop);
        let rng = &mut self.progress.streams.model;
        let config = &self.config;
        let ddpg = self.learner.ddpg();
        let imagined = imagine(&model, &config.task, states, ddpg, &config.model_replay, noise_scale, rng);
        for imagined in imagined.map_err(PriorError::from)? {
            self.learner.record(Transition {
                observation: &imagined.observation,
                action: &imagined.action,
                reward: imagined.reward,
                next_observation: &imagined.next_observation,
                terminated: imagined.terminated,
            })?;
        }
        Ok(())
    }

    fn keep_rewarding(&mut self, stage: usize, actions: Vec<Action>) {
        if self.config.refinement.every == 0 {
            return;
        }
        let stages = self.config.task.stage_count();
        self.progress.rewarding.resize(stages, VecDeque::new());
        let kept = &mut self.progress.rewarding[stage];
        kept.extend(actions);
        kept.drain(..kept.len().saturating_sub(self.config.refinement.most));
    }

    /// Makes clusters from the agent's own rewarding actions where there are enough of
    /// them, if it is time to. Returns the prior if it changed.
    pub fn refine(&mut self) -> Option<Arc<ActionPrior>> {
        let refinement = self.config.refinement;
        let due = refinement.every > 0 && self.progress.episode.is_multiple_of(u64::from(refinement.every));
        let prior = self.progress.prior.as_ref().filter(|_| due)?;
        let mut refined = ActionPrior::clone(prior);
        for (stage, actions) in self.progress.rewarding.iter().enumerate() {
            if actions.len() >= refinement.least {
                refined = refined.with_actions(stage, actions.iter().copied().collect(), &self.progress.streams.model);
            }
        }
        if refined == **prior {
            return None;
        }
        self.progress.prior = Some(Arc::new(refined));
        self.progress.prior.clone()
    }

    /// Episodes of the greedy policy, without noise, clusters or learning.
    ///
    /// # Errors
    /// When it is abandoned.
    pub fn evaluate(&mut self, episodes: u32) -> Result<Event, TrainingError> {
        let (mut successes, mut total) = (0u32, 0.0f64);
        for _ in 0..episodes {
            if self.stop.is_requested() {
                return Err(TrainingError::Stopped);
            }
            let trace = greedy_episode(self.env.task(), self.learner.ddpg(), &mut self.progress.streams.evaluation);
            successes += u32::from(trace.reached_goal());
            total += f64::from(trace.total_reward());
        }
        let count = f64::from(episodes.max(1));
        Ok(Event::Evaluated {
            episode: self.progress.episode,
            episodes: u64::from(episodes),
            success: f64::from(successes) / count,
            mean_return: total / count,
        })
    }

    /// A person may raise the threshold of a run that began without guidance and was given
    /// clusters since.
    fn has_live_schedule(&self) -> bool {
        self.progress.prior.is_some() && self.progress.epsilon != self.config.epsilon
    }

    /// Who chooses the actions of the stage that comes next. Always draws, so that the stream does
    /// not depend on the schedule.
    fn draw(&mut self, threshold: f32) -> Explorer {
        let progress = &mut self.progress;
        let draw: f32 = progress.streams.guidance.r#gen();
        if self.config.method == Method::OpenLoop {
            return Explorer::Clusters;
        }
        explorer(&progress.epsilon, threshold, &progress.attempts, self.env.snapshot().stage(), draw)
    }

    /// A policy is held only where greedy attempts tell how good it is.
    fn hold_or_release(&mut self) {
        let is_held = self.learner.ddpg().holds_policy();
        let by_need = matches!(self.progress.epsilon, EpsilonSchedule::Need { .. });
        match by_need && self.config.hold_tolerance.is_some() {
            true if !is_held => {
                self.progress.hold = Hold::default();
                self.learner.ddpg_mut().hold_policy();
            }
            false if is_held => self.learner.ddpg_mut().release_policy(),
            _ => {}
        }
    }

    fn note_attempt(&mut self, stage: usize, reached: bool) {
        let EpsilonSchedule::Need { attempts, .. } = self.progress.epsilon else { return };
        let progress = &mut self.progress;
        progress.attempts.note(stage, reached, attempts);
        let Some(tolerance) = self.config.hold_tolerance else { return };
        let Some(failure) = progress.hold.note(stage, reached, attempts, tolerance) else { return };
        let ddpg = self.learner.ddpg_mut();
        if failure.is_proven {
            ddpg.prove_policy();
        }
        match failure.proven_is_next {
            true => ddpg.return_to_proven_policy(),
            false => ddpg.hold_policy(),
        }
    }

    fn choose(
        &mut self,
        observation: &[f32],
        explorer: Explorer,
        step: usize,
    ) -> Result<(Action, Source), TrainingError> {
        let recorded = self.progress.first_success.iter().find_map(|actions| actions.get(step).or(actions.last()));
        if let Some(action) = recorded {
            return Ok((*action, Source::Recorded));
        }
        let streams = &mut self.progress.streams;
        Ok(match (&self.model, &self.progress.prior) {
            (Some(model), _) if self.config.method == Method::Planning => {
                let (task, planner) = (&self.config.task, &self.config.planner);
                let model = Stoppable::new(&**model, &self.stop);
                let action = guidance::plan(&model, task, self.env.snapshot(), planner, &mut streams.model);
                let action = action.map_err(PriorError::from)?;
                (action, Source::Planner)
            }
            (_, Some(prior)) if explorer == Explorer::Clusters => {
                (prior.sample(self.env.snapshot().stage(), &mut streams.guidance), Source::Clusters)
            }
            _ if explorer == Explorer::Greedy => (to_action(&self.learner.ddpg().act(observation)), Source::Policy),
            _ => (to_action(&self.learner.explore(observation)), Source::Policy),
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
        let blocked = trace.steps.iter().filter(|step| step.placement != Placement::Placed).count() as u32;
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
            max_q: (means.updates > 0).then_some(means.sum.max_q),
            actor_loss: means.mean(|sum| sum.actor_loss),
            action_saturation: means.mean(|sum| sum.action_saturation),
            rolling_success,
            terminated: last.terminated,
            truncated: last.truncated,
            end: last.end.map_or_else(String::new, |end| end.to_string()),
            placed,
            blocked,
        }
    }
}

impl UpdateMeans {
    fn add(&mut self, metrics: &UpdateMetrics) {
        let first = self.updates == 0;
        self.updates += 1;
        self.sum.critic_loss += metrics.critic_loss;
        self.sum.mean_q += metrics.mean_q;
        self.sum.max_q = if first { metrics.max_q } else { self.sum.max_q.max(metrics.max_q) };
        self.sum.actor_loss += metrics.actor_loss;
        self.sum.action_saturation += metrics.action_saturation;
    }

    fn mean(&self, of: impl Fn(&UpdateMetrics) -> f32) -> Option<f32> {
        (self.updates > 0).then(|| (f64::from(of(&self.sum)) / f64::from(self.updates)) as f32)
    }
}

/// One episode of the actor alone; `rng` draws the start noise.
pub fn greedy_episode(task: &Arc<Task>, ddpg: &Ddpg, rng: &mut ChaCha8Rng) -> Trace {
    let mut env = Environment::new(task.clone());
    let mut observation = env.reset(rng);
    let mut trace = Trace::default();
    while let Ok(step) = trace.step(&mut env, to_action(&ddpg.act(&observation)), Source::Policy) {
        observation = step.observation;
    }
    trace
}

/// The actor's two numbers as an action.
pub(super) fn to_action(vector: &[f32]) -> Action {
    [vector[0], vector[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(method: Method) -> RunConfig {
        let mut config = RunConfig::new(Arc::new(crate::task::load("task1").unwrap()));
        config.method = method;
        config.ddpg.hidden = 8;
        config.prior = crate::trainer::PriorSource::TruePhysics;
        config
    }

    /// The configuration of a task whose ball falls into the goal by itself.
    fn easy() -> RunConfig {
        let mut config = config(Method::Ddpg);
        let mut task = Task::clone(&config.task);
        let [x, y] = task.ball.position;
        task.subgoals.clear();
        task.goal.position = [x, y - 0.3];
        config.task = Arc::new(task);
        config
    }

    #[test]
    fn means_are_over_the_updates_and_the_maximum_is_the_greatest() {
        let mut means = UpdateMeans::default();
        assert_eq!(means.mean(|sum| sum.mean_q), None);
        let update = |critic_loss, max_q| UpdateMetrics {
            critic_loss,
            mean_q: -critic_loss,
            max_q,
            actor_loss: 2.0 * critic_loss,
            action_saturation: 0.5 * critic_loss,
            ..UpdateMetrics::default()
        };
        for (loss, max_q) in [(0.5, -3.0), (1.0, -1.0), (3.0, -2.0)] {
            means.add(&update(loss, max_q));
        }
        let found = [
            means.mean(|sum| sum.critic_loss),
            means.mean(|sum| sum.mean_q),
            means.mean(|sum| sum.actor_loss),
            means.mean(|sum| sum.action_saturation),
        ];
        assert_eq!(found, [1.5, -1.5, 3.0, 0.75].map(Some));
        assert_eq!(means.sum.max_q, -1.0);
    }

    #[test]
    fn evaluations_are_shares_and_means_over_their_episodes() {
        let mut training = Training::new(easy(), None).unwrap();
        let trace = greedy_episode(&training.config().task.clone(), training.ddpg(), &mut Stream::Evaluation.of(0));
        assert!(trace.reached_goal() && trace.total_reward() > 0.0, "{trace:?}");
        let expected =
            Event::Evaluated { episode: 0, episodes: 4, success: 1.0, mean_return: f64::from(trace.total_reward()) };
        assert_eq!(training.evaluate(4).unwrap(), expected);
        let mut training = Training::new(config(Method::Ddpg), None).unwrap();
        let Event::Evaluated { success, .. } = training.evaluate(2).unwrap() else { panic!("an evaluation") };
        assert_eq!(success, 0.0);
    }

    #[test]
    fn before_the_first_update_there_are_no_numbers_of_the_networks() {
        let mut training = Training::new(easy(), None).unwrap();
        let (record, _) = training.run_episode().unwrap();
        assert_eq!((record.max_q, record.mean_q, record.critic_loss), (None, None, None));
    }

    #[test]
    fn a_schedule_given_to_an_unguided_run_holds_once_it_has_clusters_too() {
        let thresholds = |schedule: Option<&str>, prior: bool| {
            let mut training = Training::new(easy(), None).unwrap();
            if let Some(schedule) = schedule {
                training.set_schedule(schedule.parse().unwrap());
            }
            if prior {
                training.set_prior(Arc::new(ActionPrior::uniform(&training.config().task, 0)));
            }
            let (record, trace) = training.run_episode().unwrap();
            (record.epsilon, trace.steps[0].source)
        };
        assert_ne!(easy().epsilon.threshold(0), 0.0);
        assert_eq!(thresholds(None, false), (0.0, Source::Policy));
        assert_eq!(thresholds(Some("1"), false), (0.0, Source::Policy));
        assert_eq!(thresholds(None, true), (0.0, Source::Policy));
        assert_eq!(thresholds(Some("1"), true), (1.0, Source::Clusters));
    }

    /// First actions of a few episodes of greedy attempts, while the networks learn.
    fn first_actions(config: &RunConfig, hold_tolerance: Option<f32>, schedule: &str) -> Vec<Action> {
        let mut config = RunConfig { method: Method::DdpgAdaptive, hold_tolerance, ..config.clone() };
        config.ddpg.warmup_steps = 0;
        config.noise_decay.final_scale = 0.0;
        config.noise_decay.share = 0.0;
        let mut training = Training::new(config, None).unwrap();
        training.set_schedule(schedule.parse().unwrap());
        (0..6).map(|_| training.run_episode().unwrap().1.steps[0].action).collect()
    }

    #[test]
    fn a_held_policy_acts_until_it_fails() {
        let changes = |config: &RunConfig, tolerance, schedule| {
            let actions = first_actions(config, tolerance, schedule);
            actions.windows(2).filter(|pair| pair[0] != pair[1]).count()
        };
        let (succeeds, fails) = (easy(), config(Method::DdpgAdaptive));
        assert_eq!(changes(&succeeds, Some(0.15), "need:0:0:20"), 0);
        assert_eq!(changes(&succeeds, None, "need:0:0:20"), 5);
        assert_eq!(changes(&fails, Some(0.15), "need:0:0:20"), 5);
        assert_eq!(changes(&fails, Some(1.0), "need:0:0:20"), 0, "all may fail");
        assert_eq!(changes(&succeeds, Some(0.15), "0"), 5, "nothing tells how good it is");
    }

    #[test]
    fn only_a_planner_acts_by_its_model() {
        let mut config = config(Method::ModelReplay);
        config.model_replay.rollouts = 1;
        config.model_replay.horizon = 1;
        let (_, trace) = Training::new(config, None).unwrap().run_episode().unwrap();
        assert!(trace.steps.iter().all(|step| step.source == Source::Policy));
    }
}
