//! The plan of a study: all its parameters in one value.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use mge_dynamics::{EvaluationConfig, ModelConfig, TrainConfig, Variant};
use mge_guidance::EpsilonSchedule;
use mge_physics::ToolKind;
use mge_stats::Bootstrap;
use mge_task::{self as task, Task};
use mge_trainer::{Method, RunConfig, SettingError};

/// Start noise of [`Part::NoisyStarts`], in normalised units.
pub(super) const START_NOISE: f32 = 0.01;

/// The parameters of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StudyPlan {
    /// Whether this is the small study.
    pub quick: bool,
    /// First of the consecutive seeds.
    pub seed: u64,
    /// The tasks.
    pub tasks: Vec<Task>,
    /// Structure of the dynamics models.
    pub model: ModelConfig,
    /// Their training.
    pub model_training: TrainConfig,
    /// Their evaluation.
    pub model_evaluation: EvaluationConfig,
    /// Number of independent cluster builds for the hit counts.
    pub builds: u64,
    /// Number of seeds of the hit counts.
    pub hit_seeds: u64,
    /// Episodes of a hit count.
    pub hit_episodes: u32,
    /// Number of seeds of the trainings.
    pub learning_seeds: u64,
    /// Episodes of a training.
    pub learning_episodes: u32,
    /// The methods and settings trained on every task.
    pub arms: Vec<Arm>,
    /// Episodes per seed of the planning method; 0 omits it.
    pub planning_episodes: u32,
    /// Bootstrap resamples of every interval.
    pub resamples: u32,
}

/// The part of a study to which an arm belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// The paper's methods (figure 6), with the study's own dynamics models and a fixed start.
    Paper,
    /// Further questions about them, under the same conditions.
    Questions,
    /// The paper's and the adaptive methods and open-loop replay from [noisy starts](START_NOISE), with the shipped
    /// dynamics models.
    NoisyStarts,
}

/// A method with the settings that distinguish it from the other arms of its part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Arm {
    /// The part to which it belongs.
    pub part: Part,
    /// The method.
    pub method: Method,
    /// Its epsilon schedule; none for the method's default.
    pub epsilon: Option<EpsilonSchedule>,
    /// Structure of its dynamics model, unless that is a shipped one.
    pub model: Variant,
    /// Whether the task's subgoals are replaced by the same number of proposed ones.
    pub proposed_subgoals: bool,
    /// Other settings that differ from the defaults, by JSON path.
    pub settings: BTreeMap<String, String>,
}

impl Arm {
    fn new(part: Part, method: Method, epsilon: Option<EpsilonSchedule>) -> Self {
        Self { part, method, epsilon, model: Variant::Full, proposed_subgoals: false, settings: BTreeMap::new() }
    }

    /// The settings that distinguish it from other arms of the same part, method and schedule, as in legends.
    pub fn differences(&self) -> BTreeMap<String, String> {
        let mut differences = self.settings.clone();
        if self.model != Variant::Full {
            differences.insert("model".to_owned(), self.model.label().to_owned());
        }
        if self.proposed_subgoals {
            differences.insert("subgoals".to_owned(), "proposed".to_owned());
        }
        differences
    }
}

/// One training of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedRun {
    /// Its configuration, without the path of its model.
    pub config: RunConfig,
    /// Its arm.
    pub arm: Arm,
}

impl StudyPlan {
    /// The full study: ten seeds each of counts and trainings.
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
            arms: main_arms(episodes),
            planning_episodes: 0,
            resamples: 2000,
        }
    }

    /// The small study: the same pieces with few seeds, short trainings, and models trained for three
    /// fifths of the paper's epochs.
    pub fn quick(seed: u64) -> Self {
        let episodes = 1000;
        Self {
            quick: true,
            model_training: TrainConfig { seed, epochs: 3000, ..TrainConfig::default() },
            hit_seeds: 3,
            learning_seeds: 2,
            learning_episodes: episodes,
            arms: main_arms(episodes),
            ..Self::full(seed)
        }
    }

    /// Adds the arms of further questions. The study may run in the folder of the study without
    /// them, and reuses its results.
    pub fn with_questions(mut self) -> Self {
        self.arms.extend(questions(self.learning_episodes));
        self.planning_episodes = 20;
        self
    }

    /// The bootstrap of every interval.
    pub fn bootstrap(&self) -> Bootstrap {
        Bootstrap { resamples: self.resamples, ..Bootstrap::default() }
    }

    /// The part of the plan that a study's folder is bound to: all but the arms, to which others may be added.
    pub fn foundation(&self) -> Self {
        Self { arms: Vec::new(), planning_episodes: 0, ..self.clone() }
    }

    /// The distinct tool sets of the tasks, the largest first, as its model takes longest to train.
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

    /// The ablated model structures that the arms need.
    pub fn ablations(&self) -> Vec<Variant> {
        Variant::ALL
            .into_iter()
            .filter(|v| *v != Variant::Full && self.arms.iter().any(|arm| arm.model == *v))
            .collect()
    }

    /// Every training of the study, ordered by seed, so that an unfinished study has about the same
    /// number of seeds of every arm.
    ///
    /// # Errors
    /// When a setting of an arm is invalid.
    pub fn runs(&self) -> Result<Vec<PlannedRun>, SettingError> {
        let tasks: Vec<Arc<Task>> = self.tasks.iter().cloned().map(Arc::new).collect();
        let planning = Arm::new(Part::Questions, Method::Planning, None);
        let planning = (self.planning_episodes > 0).then_some((&planning, self.planning_episodes));
        let arms = self.arms.iter().map(|arm| (arm, self.learning_episodes)).chain(planning);
        let mut runs = Vec::new();
        for seed in self.seed..self.seed + self.learning_seeds {
            for (arm, episodes) in arms.clone() {
                for task in &tasks {
                    runs.push(self.run(arm, task.clone(), seed, episodes)?);
                }
            }
        }
        Ok(runs)
    }

    fn run(&self, arm: &Arm, task: Arc<Task>, seed: u64, episodes: u32) -> Result<PlannedRun, SettingError> {
        let mut config = RunConfig::default_for(task, arm.method);
        (config.seed, config.episodes) = (seed, episodes);
        config.epsilon = arm.epsilon.clone().unwrap_or(config.epsilon);
        if arm.part == Part::NoisyStarts {
            config.start_noise = Some(START_NOISE);
            (config.evaluation.every, config.evaluation.episodes) = (episodes.div_ceil(4), 50);
        }
        for (key, value) in &arm.settings {
            config = config.with_setting(key, value)?;
        }
        Ok(PlannedRun { config, arm: arm.clone() })
    }
}

/// The arms of figure 6: the baseline, a small constant threshold, and a large decaying one (paper,
/// section 5.4); and those from noisy starts.
fn main_arms(episodes: u32) -> Vec<Arm> {
    let paper = |method, epsilon| Arm::new(Part::Paper, method, epsilon);
    let noisy = |method, epsilon| Arm::new(Part::NoisyStarts, method, epsilon);
    vec![
        paper(Method::Ddpg, None),
        paper(Method::DdpgMge, Some(EpsilonSchedule::Constant(0.1))),
        paper(Method::DdpgMge, Some(decayed(episodes))),
        noisy(Method::Ddpg, None),
        noisy(Method::DdpgMge, Some(decayed(episodes))),
        noisy(Method::DdpgMgeAdaptive, None),
        noisy(Method::DdpgUniformAdaptive, None),
        noisy(Method::DdpgAdaptive, None),
        noisy(Method::OpenLoop, None),
    ]
}

/// The arms of further questions: the effect of the clusters versus that of epsilon, a perfect model, refined
/// clusters, proposed subgoals, and each structural assumption of the model.
fn questions(episodes: u32) -> Vec<Arm> {
    let decayed = |method| Arm::new(Part::Questions, method, Some(decayed(episodes)));
    let guided = || decayed(Method::DdpgMge);
    vec![
        decayed(Method::DdpgUniform),
        decayed(Method::DdpgMgeTrue),
        Arm { settings: [("refinement.every", "50")].map(|(k, v)| (k.to_owned(), v.to_owned())).into(), ..guided() },
        Arm { proposed_subgoals: true, ..guided() },
        Arm { model: Variant::SharedEdges, ..guided() },
        Arm { model: Variant::FullyConnected, ..guided() },
        Arm { model: Variant::Absolute, ..guided() },
    ]
}

fn decayed(episodes: u32) -> EpsilonSchedule {
    EpsilonSchedule::Linear { from: 0.5, to: 0.0, episodes: episodes / 2 }
}
