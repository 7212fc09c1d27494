//! Counts of hits of a sweep: how often a policy that does not learn reaches each subgoal and the goal (paper, figure 5).

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::file::{Combination, Grid};
use super::training::{Agents, setting};
use crate::error::ExperimentError;
use crate::hits::{ActorNoise, Guided, HitCounts, Policy, Uniform, count_hits};
use mge_agent::DdpgConfig;
use mge_base::json;
use mge_base::spelling::did_you_mean;
use mge_base::stop::Stop;
use mge_base::validation::ValidationError;
use mge_task::Task;
use mge_trainer::{PriorSource, RunConfig, build_prior};

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
    pub(super) fn new(grid: &Grid, combination: &Combination, agents: &mut Agents) -> Result<Self, ValidationError> {
        let task = agents.task(grid, combination)?;
        let (policy, prior) = (Policy::Guided, PriorSource::default());
        let (mut job, mut build) = (Self { task, policy, prior, build: 0, episodes: 1000, seed: 0 }, None);
        for (axis, &number) in grid.axes.iter().zip(combination) {
            let value = &axis.values[number];
            let wrong = |message: String| ValidationError::new(axis.path(number), message);
            let count = |from: u64, to: u64| {
                let count = value.as_u64().filter(|count| (from..=to).contains(count));
                count.ok_or_else(|| wrong(format!("must be a whole number from {from} to {to}")))
            };
            match setting(&axis.key) {
                "task" => {}
                "policy" => job.policy = json::text(value).parse().map_err(wrong)?,
                "prior" => job.prior = agents.source(&json::text(value), &job.task),
                "build" => build = Some(count(0, u64::MAX)?),
                "episodes" => job.episodes = count(1, 10_000_000)? as u32,
                "seed" => job.seed = count(0, u64::MAX)?,
                key => {
                    let hint = did_you_mean(Self::SETTINGS, key);
                    return Err(wrong(format!("there is no setting `{key}` of a count of hits{hint}")));
                }
            }
        }
        job.build = build.filter(|_| job.policy == Policy::Guided).unwrap_or(job.seed);
        if job.policy == Policy::Guided {
            agents.check_model(grid, combination, &job.clusters())?;
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
    pub fn count(&self, stop: &Stop) -> Result<HitCounts, ExperimentError> {
        let Self { task, episodes, seed, .. } = self;
        Ok(match self.policy {
            Policy::Guided => {
                let clusters = build_prior(&self.clusters(), |_| (), stop)?;
                count_hits(task, &mut Guided(&clusters), *episodes, *seed, stop)?
            }
            Policy::Random => {
                let mut actor = ActorNoise::untrained(task, &DdpgConfig::default(), *seed)?;
                count_hits(task, &mut actor, *episodes, *seed, stop)?
            }
            Policy::Uniform => count_hits(task, &mut Uniform, *episodes, *seed, stop)?,
        })
    }
}
