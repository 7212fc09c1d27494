//! Counts of hits of a sweep: how often a policy that does not learn reaches each subgoal and the goal (paper, figure 5).

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::file::Choice;
use super::training::{Agents, setting};
use crate::error::Result;
use crate::play::play;
use mge_agent::{Ddpg, DdpgConfig, OrnsteinUhlenbeck};
use mge_base::by_name;
use mge_base::json;
use mge_base::spelling::did_you_mean;
use mge_base::stop::{Stop, Stopped};
use mge_base::streams::Stream;
use mge_base::validation::ValidationError;
use mge_env::{Action, Environment, observation_len, uniform_action};
use mge_task::Task;
use mge_trainer::{PriorSource, RunConfig, build_prior};

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
    /// Actions drawn from the clusters of the next stage (epsilon threshold 1).
    Guided,
    /// An untrained actor with Ornstein-Uhlenbeck noise: the exploration of standard DDPG before its first reward
    /// (epsilon threshold 0).
    Random,
    /// Actions drawn uniformly.
    Uniform,
}

by_name!(Policy, "policy", { Guided = "guided", Random = "random", Uniform = "uniform" });

/// A count: the content of `config.json` in its folder. `result.json` has its [`HitCounts`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HitJob {
    /// The task, whole as in a run.
    pub task: Arc<Task>,
    /// Who plays.
    pub policy: Policy,
    /// The source of the clusters of guided play.
    pub prior: PriorSource,
    /// Seed of these clusters.
    pub build: u64,
    /// Episodes to play.
    pub episodes: u32,
    /// Seed of the episodes, and of the weights of an untrained actor.
    pub seed: u64,
}

impl HitJob {
    /// The settings of a count in a sweep file.
    const SETTINGS: [&str; 7] = ["task", "policy", "model", "build", "episodes", "seed", "kind"];

    /// The count of a combination of settings.
    pub(super) fn new(chosen: &[Choice<'_>], agents: &mut Agents) -> Result<Self, ValidationError> {
        let task = agents.task(chosen)?;
        let (policy, prior) = (Policy::Guided, PriorSource::default());
        let (mut job, mut build) = (Self { task, policy, prior, build: 0, episodes: 1000, seed: 0 }, None);
        for choice in chosen {
            let count = |from: u64, to: u64| {
                let count = choice.value().as_u64().filter(|count| (from..=to).contains(count));
                count.ok_or_else(|| choice.wrong(format_args!("must be a whole number from {from} to {to}")))
            };
            let text = json::text(choice.value());
            match setting(choice.key()) {
                "task" => {}
                "policy" => job.policy = text.parse().map_err(|error: String| choice.wrong(error))?,
                "prior" => job.prior = agents.source(&text, &job.task),
                "build" => build = Some(count(0, u64::MAX)?),
                "episodes" => job.episodes = count(1, 10_000_000)? as u32,
                "seed" => job.seed = count(0, u64::MAX)?,
                key => {
                    let hint = did_you_mean(Self::SETTINGS, key);
                    return Err(choice.wrong(format_args!("there is no setting `{key}` of a count of hits{hint}")));
                }
            }
        }
        job.build = build.filter(|_| job.policy == Policy::Guided).unwrap_or(job.seed);
        if job.policy == Policy::Guided {
            agents.check_model(chosen, &job.clusters())?;
        } else {
            job.prior = PriorSource::Uniform;
        }
        Ok(job)
    }

    /// The configuration of a run with the clusters of guided play.
    pub fn clusters(&self) -> RunConfig {
        RunConfig { prior: self.prior.clone(), seed: self.build, ..RunConfig::new(self.task.clone()) }
    }

    /// Plays the episodes.
    ///
    /// # Errors
    /// When the clusters cannot be built, or `stop` is requested.
    pub fn count(&self, stop: &Stop) -> Result<HitCounts> {
        Ok(match self.policy {
            Policy::Guided => {
                let clusters = build_prior(&self.clusters(), |_| (), stop)?;
                self.play(stop, |env, rng| clusters.sample(env.snapshot().stage(), rng))?
            }
            Policy::Random => {
                let config = DdpgConfig::default();
                let (actor, mut noise) = (self.untrained(&config), OrnsteinUhlenbeck::new(2, config.ou));
                self.play(stop, |env, rng| {
                    if env.snapshot().actions == 0 {
                        noise.reset();
                    }
                    let mut action = actor.act(&env.observation());
                    noise.perturb(&mut action, rng);
                    [action[0], action[1]]
                })?
            }
            Policy::Uniform => self.play(stop, |_, rng| uniform_action(rng))?,
        })
    }

    /// The initial actor of a training with this seed.
    fn untrained(&self, config: &DdpgConfig) -> Ddpg {
        let agent = Ddpg::new(observation_len(&self.task), 2, config, &mut Stream::AgentWeights.of(self.seed));
        agent.expect("the usual configuration is valid")
    }

    fn play(
        &self,
        stop: &Stop,
        act: impl FnMut(&Environment, &mut ChaCha8Rng) -> Action,
    ) -> Result<HitCounts, Stopped> {
        let mut hits = HitCounts { episodes: 0, goal: 0, subgoals: vec![0; self.task.subgoals.len()] };
        play(&self.task, act, self.seed, stop, |env| {
            hits.episodes += 1;
            hits.goal += u32::from(env.snapshot().goal_reached);
            for (count, reached) in hits.subgoals.iter_mut().zip(&env.snapshot().reached) {
                *count += u32::from(*reached);
            }
            hits.episodes < self.episodes
        })?;
        Ok(hits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_play_uses_the_initial_actor_of_a_training_and_a_separate_stream_of_start_noise() {
        let task = Arc::new(mge_task::load("task1").unwrap());
        let config = DdpgConfig { hidden: 8, ..DdpgConfig::default() };
        let observation = Environment::new(task.clone()).reset(&mut Stream::Episode.of(3));
        let of = |mut weights: ChaCha8Rng| {
            Ddpg::new(observation_len(&task), 2, &config, &mut weights).unwrap().act(&observation)
        };
        let prior = PriorSource::Uniform;
        let job = HitJob { task: task.clone(), policy: Policy::Random, prior, build: 3, episodes: 1, seed: 3 };
        let actor = job.untrained(&config).act(&observation);
        assert_eq!(actor, of(Stream::AgentWeights.of(3)));
        assert_ne!(actor, of(Stream::Episode.of(3)), "weights and start noise share a stream");
    }
}
