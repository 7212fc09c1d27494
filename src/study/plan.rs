//! What a study does: all its numbers in one value.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::dynamics::{EvaluationConfig, ModelConfig, TrainConfig};
use crate::guidance::EpsilonSchedule;
use crate::physics::ToolKind;
use crate::task::{self, Task};
use crate::trainer::{Method, RunConfig};

/// The numbers of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyPlan {
    /// Whether this is the small study.
    pub quick: bool,
    /// First seed; the others follow it.
    pub seed: u64,
    /// The tasks.
    pub tasks: Vec<Task>,
    /// Structure of the dynamics models.
    pub model: ModelConfig,
    /// Their training.
    pub model_training: TrainConfig,
    /// Their evaluation.
    pub model_evaluation: EvaluationConfig,
    /// Independent cluster builds for the hit counts.
    pub builds: u64,
    /// Seeds of the hit counts.
    pub hit_seeds: u64,
    /// Episodes of a hit count.
    pub hit_episodes: u32,
    /// Seeds of the trainings.
    pub learning_seeds: u64,
    /// Episodes of a training.
    pub learning_episodes: u32,
    /// Epsilon schedules of DDPG-MGE; the baseline is always trained.
    pub schedules: Vec<EpsilonSchedule>,
    /// Resamples behind every interval.
    pub resamples: u32,
}

impl StudyPlan {
    /// The full study: ten seeds of everything.
    pub fn full(seed: u64) -> Self {
        let episodes = 4000;
        Self {
            quick: false,
            seed,
            tasks: task::shipped(),
            model: ModelConfig::default(),
            model_training: TrainConfig { seed, ..TrainConfig::default() },
            model_evaluation: EvaluationConfig::default(),
            builds: 3,
            hit_seeds: 10,
            hit_episodes: 1000,
            learning_seeds: 10,
            learning_episodes: episodes,
            schedules: schedules(episodes),
            resamples: 2000,
        }
    }

    /// The small study: the same pieces with few seeds, short trainings, and models that
    /// were trained for three fifths of the paper's epochs.
    pub fn quick(seed: u64) -> Self {
        let episodes = 1000;
        Self {
            quick: true,
            model_training: TrainConfig { seed, epochs: 3000, ..TrainConfig::default() },
            hit_seeds: 3,
            learning_seeds: 3,
            learning_episodes: episodes,
            schedules: schedules(episodes),
            ..Self::full(seed)
        }
    }

    /// The tool sets of the tasks, each once, the largest first: its model takes longest
    /// to train.
    pub fn tool_sets(&self) -> Vec<Vec<ToolKind>> {
        let mut sets: Vec<Vec<ToolKind>> = Vec::new();
        for set in self.tasks.iter().map(Task::tool_set) {
            if !sets.contains(&set) {
                sets.push(set);
            }
        }
        sets.sort_by_key(|set| std::cmp::Reverse(set.len()));
        sets
    }

    /// Every training of the study, without the source of its clusters.
    pub fn runs(&self) -> Vec<RunConfig> {
        let baseline = (Method::Ddpg, EpsilonSchedule::Constant(0.0));
        let guided = self.schedules.iter().map(|schedule| (Method::DdpgMge, schedule.clone()));
        let methods: Vec<(Method, EpsilonSchedule)> = std::iter::once(baseline).chain(guided).collect();
        let mut runs = Vec::new();
        for task in &self.tasks {
            let task = Arc::new(task.clone());
            for (method, epsilon) in &methods {
                for seed in self.seed..self.seed + self.learning_seeds {
                    let mut config = RunConfig::new(task.clone());
                    config.method = *method;
                    config.epsilon = epsilon.clone();
                    config.seed = seed;
                    config.episodes = self.learning_episodes;
                    config.checkpoints.last_every = 500;
                    runs.push(config);
                }
            }
        }
        runs
    }
}

/// A small constant threshold, and a large one that decays (paper, section 5.4).
fn schedules(episodes: u32) -> Vec<EpsilonSchedule> {
    vec![EpsilonSchedule::Constant(0.1), EpsilonSchedule::Linear { from: 0.5, to: 0.0, episodes: episodes / 2 }]
}
