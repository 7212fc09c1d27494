//! Counts how often exploration reaches each subgoal and the goal (paper, figure 5).

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use mge_agent::{Ddpg, DdpgConfig, OrnsteinUhlenbeck};
use mge_base::by_name;
use mge_base::stop::{Stop, Stopped};
use mge_base::streams::Stream;
use mge_base::validation::ValidationError;
use mge_env::{Action, Environment, observation_len, uniform_action};
use mge_guidance::ActionPrior;
use mge_task::Task;

/// Numbers of episodes in which each stage was reached.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct HitCounts {
    /// Number of episodes played.
    pub episodes: u32,
    /// Number of episodes that reached the goal.
    pub goal: u32,
    /// Number of episodes that reached each subgoal.
    pub subgoals: Vec<u32>,
}

/// A policy that does not learn, by its name in sweeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Policy {
    /// [`Guided`].
    Guided,
    /// [`ActorNoise`].
    Random,
    /// [`Uniform`].
    Uniform,
}

by_name!(Policy, "policy");

impl Policy {
    /// Every policy.
    pub const ALL: [Self; 3] = [Self::Guided, Self::Random, Self::Uniform];

    /// The name in sweeps and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Guided => "guided",
            Self::Random => "random",
            Self::Uniform => "uniform",
        }
    }
}

/// A policy that does not learn.
pub trait FixedPolicy {
    /// Called before each episode.
    fn start_episode(&mut self) {}
    /// The next action.
    fn act(&mut self, env: &Environment, rng: &mut ChaCha8Rng) -> Action;
}

/// Actions drawn uniformly.
#[derive(Debug, Clone, Copy, Default)]
pub struct Uniform;

impl FixedPolicy for Uniform {
    fn act(&mut self, _: &Environment, rng: &mut ChaCha8Rng) -> Action {
        uniform_action(rng)
    }
}

/// Actions drawn from the clusters of the next stage (epsilon threshold 1).
#[derive(Debug, Clone, Copy)]
pub struct Guided<'a>(pub &'a ActionPrior);

impl FixedPolicy for Guided<'_> {
    fn act(&mut self, env: &Environment, rng: &mut ChaCha8Rng) -> Action {
        self.0.sample(env.snapshot().stage(), rng)
    }
}

/// An untrained actor with Ornstein-Uhlenbeck noise: the exploration of standard DDPG before its
/// first reward (epsilon threshold 0).
#[derive(Debug)]
pub struct ActorNoise {
    agent: Ddpg,
    noise: OrnsteinUhlenbeck,
}

impl ActorNoise {
    /// The initial actor of a training with this seed.
    ///
    /// # Errors
    /// When the configuration is invalid.
    pub fn untrained(task: &Task, config: &DdpgConfig, seed: u64) -> Result<Self, ValidationError> {
        let agent = Ddpg::new(observation_len(task), 2, config, &mut Stream::AgentWeights.of(seed))?;
        Ok(Self { agent, noise: OrnsteinUhlenbeck::new(2, config.ou) })
    }
}

impl FixedPolicy for ActorNoise {
    fn start_episode(&mut self) {
        self.noise.reset();
    }

    fn act(&mut self, env: &Environment, rng: &mut ChaCha8Rng) -> Action {
        let mut action = self.agent.act(&env.observation());
        self.noise.perturb(&mut action, rng);
        [action[0], action[1]]
    }
}

/// Plays episodes until `keep_going`, called with the policy and the environment after each of them, returns false.
///
/// # Errors
/// When `stop` is requested first.
pub fn play<P: FixedPolicy>(
    task: &Arc<Task>,
    policy: &mut P,
    seed: u64,
    stop: &Stop,
    mut keep_going: impl FnMut(&P, &Environment) -> bool,
) -> Result<(), Stopped> {
    let mut rng = Stream::Episode.of(seed);
    let mut env = Environment::new(task.clone());
    loop {
        env.reset(&mut rng);
        policy.start_episode();
        loop {
            stop.check()?;
            let action = policy.act(&env, &mut rng);
            if env.step_without_observation(action).map_or(true, |step| step.end.is_some()) {
                break;
            }
        }
        if !keep_going(policy, &env) {
            return Ok(());
        }
    }
}

/// Plays `episodes` episodes, at least one, and counts the stages reached.
///
/// # Errors
/// When `stop` is requested before the last one ends.
pub fn count_hits(
    task: &Arc<Task>,
    policy: &mut impl FixedPolicy,
    episodes: u32,
    seed: u64,
    stop: &Stop,
) -> Result<HitCounts, Stopped> {
    let mut hits = HitCounts { episodes: 0, goal: 0, subgoals: vec![0; task.subgoals.len()] };
    play(task, policy, seed, stop, |_, env| {
        hits.episodes += 1;
        hits.goal += u32::from(env.snapshot().goal_reached());
        for (count, reached) in hits.subgoals.iter_mut().zip(env.snapshot().reached()) {
            *count += u32::from(*reached);
        }
        hits.episodes < episodes
    })?;
    Ok(hits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_task as task;

    #[test]
    fn random_play_uses_the_initial_actor_of_a_training_and_a_separate_stream_of_start_noise() {
        let task = Arc::new(task::load("task1").unwrap());
        let config = DdpgConfig { hidden: 8, ..DdpgConfig::default() };
        let mut env = Environment::new(task.clone());
        let observation = env.reset(&mut Stream::Episode.of(3));
        let of = |mut weights: ChaCha8Rng| {
            Ddpg::new(observation_len(&task), 2, &config, &mut weights).unwrap().act(&observation)
        };
        let actor = ActorNoise::untrained(&task, &config, 3).unwrap().agent.act(&observation);
        assert_eq!(actor, of(Stream::AgentWeights.of(3)));
        assert_ne!(actor, of(Stream::Episode.of(3)), "weights and start noise share a stream");
    }
}
