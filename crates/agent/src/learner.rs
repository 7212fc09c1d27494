//! The learner: agent, replay buffer, noise and their random streams in one value.

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::{
    Batch, Ddpg, DdpgConfig, OrnsteinUhlenbeck, ReplayBuffer, ReplayError, Segments, Transition, UpdateError,
    UpdateMetrics,
};
use mge_base::validation::ValidationError;

/// The random streams of a learner, one per purpose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LearnerStreams {
    /// Exploration noise.
    pub noise: ChaCha8Rng,
    /// Minibatches.
    pub replay: ChaCha8Rng,
}

/// Everything that changes while an agent learns. [`save`](Self::save) writes a checkpoint and
/// [`load`](Self::load) restores it; learning then continues bit for bit.
///
/// For each episode, an environment loop calls [`start_episode`](Self::start_episode), and then for
/// each step [`explore`](Self::explore) (or chooses an action in another way),
/// [`record`](Self::record) and [`update`](Self::update).
#[derive(Clone, Debug)]
pub struct Learner {
    /// The networks.
    pub ddpg: Ddpg,
    pub(super) replay: ReplayBuffer,
    /// The exploration noise.
    pub noise: OrnsteinUhlenbeck,
    pub(super) streams: LearnerStreams,
    /// Number of transitions recorded so far, including overwritten ones.
    pub recorded: u64,
    /// Segments that reached their stage.
    pub(super) segments: Segments,
    /// Memory of the minibatch; its content is not needed between updates.
    pub(super) batch: Batch,
}

impl Learner {
    /// An untrained learner, with networks drawn from `initialisation`. Lengths are those of [`Ddpg::new`].
    ///
    /// # Errors
    /// If the config is invalid.
    ///
    /// # Panics
    /// If a length is 0.
    pub fn new(
        observation_len: usize,
        action_len: usize,
        config: &DdpgConfig,
        initialisation: &mut ChaCha8Rng,
        streams: LearnerStreams,
    ) -> Result<Self, ValidationError> {
        Ok(Self {
            ddpg: Ddpg::new(observation_len, action_len, config, initialisation)?,
            replay: ReplayBuffer::new(observation_len, action_len, config.replay_capacity),
            noise: OrnsteinUhlenbeck::new(action_len, config.ou),
            streams,
            recorded: 0,
            segments: Segments::default(),
            batch: Batch::default(),
        })
    }

    /// Changes the settings.
    ///
    /// # Errors
    /// When a setting is invalid or cannot change because the learned state depends on it; names the
    /// setting.
    pub fn reconfigure(&mut self, config: &DdpgConfig) -> Result<(), ValidationError> {
        config.validate()?;
        let old = &self.ddpg.config;
        let same = [
            ("layers", old.layers == config.layers),
            ("hidden", old.hidden == config.hidden),
            ("activation", old.activation == config.activation),
            ("optimiser", old.optimiser == config.optimiser),
            ("action_origin", old.action_origin == config.action_origin),
            ("replay_capacity", old.replay_capacity == config.replay_capacity),
        ];
        if let Some((path, _)) = same.into_iter().find(|(_, same)| !same) {
            return Err(ValidationError::new(path, "cannot change once something was learned"));
        }
        if old.ou != config.ou {
            self.noise = OrnsteinUhlenbeck::new(self.ddpg.action_len(), config.ou);
        }
        self.ddpg.config = config.clone();
        Ok(())
    }

    /// Begins an episode: resets the noise to its mean.
    pub fn start_episode(&mut self) {
        self.noise.reset();
        if self.has_segments() {
            self.segments.begin(self.recorded);
        }
    }

    /// Records that the latest transition reached a stage.
    pub fn reach(&mut self, stage: usize) {
        if self.has_segments() {
            self.segments.reach(stage, self.recorded);
        }
    }

    /// Whether segments are used.
    fn has_segments(&self) -> bool {
        self.ddpg.config().imitation.share > 0.0
    }

    /// `clip(μ(s) + noise, -1, 1)`: the exploratory action (paper, equation 2). The greedy one is
    /// `self.ddpg.act(observation)`.
    ///
    /// # Panics
    /// If the observation has the wrong length.
    pub fn explore(&mut self, observation: &[f32]) -> Vec<f32> {
        let mut action = self.ddpg.act(observation);
        self.noise.perturb(&mut action, &mut self.streams.noise);
        action
    }

    /// Adds a transition to the replay buffer.
    ///
    /// # Errors
    /// If its vectors have wrong lengths or contain numbers that are not finite.
    pub fn record(&mut self, transition: Transition<'_>) -> Result<(), ReplayError> {
        self.replay.push(transition)?;
        self.recorded += 1;
        Ok(())
    }

    /// Makes a number of updates, once the warm-up is over; returns what each reports.
    ///
    /// # Errors
    /// If learning has diverged.
    pub fn update(&mut self, count: usize) -> Result<Vec<UpdateMetrics>, UpdateError> {
        let config = self.ddpg.config();
        let batch_size = config.batch_size;
        if self.replay.is_empty() || self.recorded < config.warmup_steps as u64 {
            return Ok(Vec::new());
        }
        let update = |_| {
            self.sample(batch_size);
            self.ddpg.update(&self.batch)
        };
        (0..count).map(update).collect()
    }

    /// Draws a minibatch: uniformly, except for the share from segments.
    pub(super) fn sample(&mut self, count: usize) {
        let Self { ddpg, replay, segments, batch, recorded, streams: LearnerStreams { replay: rng, .. }, .. } = self;
        segments.forget_before(*recorded - replay.len() as u64);
        let share = ddpg.config().imitation.share;
        let imitated = if segments.is_empty() { 0 } else { (share * count as f32).round() as usize };
        replay.sample(count - imitated, rng, batch);
        for _ in 0..imitated {
            let age = *recorded - 1 - segments.sample(rng);
            batch.push(replay.latest(age as usize).expect("overwritten segments have been removed"));
        }
        batch.imitated = imitated;
    }
}
