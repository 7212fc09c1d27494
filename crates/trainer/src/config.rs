//! The complete configuration of a run, saved with the run.

use std::collections::BTreeMap;
use std::sync::Arc;

use educe::Educe;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;

use super::method::{Method, PriorSource};
use super::parts::{Evaluation, Fork, Granularity, NoiseDecay, Practice, Refinement, StopRule};
use super::removed;
use mge_agent::{self as agent, DdpgConfig};
use mge_base::json;
use mge_base::validation::Range::{CountOrNull, NumberOrNull};
use mge_base::validation::{Setting, ValidationError, check_settings};
use mge_dynamics::{TASK_MODEL_SETTINGS, TaskModelConfig};
use mge_guidance::{self as guidance, EpsilonSchedule, GuidanceConfig, PLANNER_SETTINGS, PlannerConfig};
use mge_run::Retention;
use mge_stats::rolling::{RollingRate, WINDOW};
use mge_task::Task;

/// The complete description of a training. Deserialisation validates it, so that no file or text can
/// produce a configuration that is out of range.
#[derive(Debug, Clone, Educe, PartialEq, Serialize, Deserialize)]
#[educe(Default)]
// Derives the inherent `RunConfig::deserialize` without validation; the trait implementation uses it.
#[serde(deny_unknown_fields, remote = "Self")]
pub struct RunConfig {
    /// The whole task, so that a run does not depend on a file that may change.
    pub task: Arc<Task>,
    /// Algorithm.
    pub method: Method,
    /// Master seed.
    pub seed: u64,
    /// Episodes to train.
    #[educe(Default = 2000)]
    pub episodes: u32,
    /// The episodes of the run before it was first extended, of which `noise_decay.share` is a share; none if it was not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extended_from: Option<u32>,
    /// When to end before.
    pub stop: StopRule,
    /// Schedule of the epsilon threshold; see [`Method::uses`].
    #[educe(Default(expression = EpsilonSchedule::Linear { from: 0.5, to: 0.0, episodes: 1000 }))]
    pub epsilon: EpsilonSchedule,
    /// How often epsilon is drawn.
    pub granularity: Granularity,
    /// Annealing of the exploration noise.
    pub noise_decay: NoiseDecay,
    /// With exploration by need: a copy of the policy acts until more than this share of its last
    /// greedy attempts at some stage has failed, and is then replaced; none if the actor itself acts.
    pub hold_tolerance: Option<f32>,
    /// With exploration by need: the number of steps for each update while no stage needs exploration.
    #[educe(Default = 1)]
    pub mastered_update_interval: u32,
    /// Half width of the uniform noise on the ball's start in training and evaluation, normalised;
    /// none for the task's own.
    pub start_noise: Option<f32>,
    /// The learner.
    pub ddpg: DdpgConfig,
    /// The source of clusters and plans, unless the method determines it.
    pub prior: PriorSource,
    /// The dynamics model that is trained for the run, if that is the source.
    pub model: TaskModelConfig,
    /// How clusters are built.
    pub guidance: GuidanceConfig,
    /// Refinement of clusters during training.
    pub refinement: Refinement,
    /// Practice before the first episode.
    pub practice: Practice,
    /// Planner, for [`Method::Planning`].
    pub planner: PlannerConfig,
    /// Greedy evaluation.
    pub evaluation: Evaluation,
    /// Which checkpoints are kept.
    pub checkpoints: Retention,
    /// The run from which it continues with other settings, if it is a fork.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fork: Option<Fork>,
    /// Settings of earlier versions that the run was trained with: see [`check_supported`](Self::check_supported).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub removed: BTreeMap<String, String>,
}

impl<'de> Deserialize<'de> for RunConfig {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut saved = Value::deserialize(deserializer)?;
        let removed = removed::take(&mut saved);
        // What earlier versions did not save has its default.
        let task = saved.get("task").cloned().and_then(|task| serde_json::from_value(task).ok());
        if let (Some(task), Value::Object(saved)) = (task, &mut saved)
            && let Value::Object(mut whole) = json::to_value(&Self::new(task))
        {
            whole.append(saved);
            *saved = whole;
        }
        let mut track = serde_path_to_error::Track::new();
        let config = Self::deserialize(serde_path_to_error::Deserializer::new(saved, &mut track));
        let place = || json::known_path(&track.path());
        let mut config = config.map_err(|error| D::Error::custom(format_args!("{}: {error}", place())))?;
        config.removed.extend(removed);
        config.validate().map_err(D::Error::custom)?;
        Ok(config)
    }
}

impl Serialize for RunConfig {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

/// The numeric settings of the run itself.
const SETTINGS: [Setting; 19] = [
    Setting::count("seed", 0, u64::MAX, "master seed"),
    Setting::count("episodes", 1, 10_000_000, "episodes to train"),
    Setting::new("stop.success", NumberOrNull(0.0, 1.0), "success rate of the last 100 episodes that ends a run"),
    Setting::new("stop.minutes", NumberOrNull(0.01, 1e6), "minutes of training after which a process stops it"),
    Setting::number("noise_decay.final_scale", 0.0, 1.0, "least scale of the exploration noise; 1 keeps it constant"),
    Setting::number("noise_decay.share", 0.0, 1.0, "share of the episodes after which the scale would be 0"),
    Setting::new("hold_tolerance", NumberOrNull(0.0, 1.0), "share of failed attempts that replaces the held policy"),
    Setting::count("mastered_update_interval", 1, 1000, "steps for each update while no stage needs exploration"),
    Setting::new("start_noise", NumberOrNull(0.0, 1.0), "half width of the start noise; none for the task's own"),
    Setting::count("refinement.every", 0, 1_000_000_000, "episodes between refinements of the clusters; 0 for none"),
    Setting::count("refinement.least", 0, 100_000, "own rewarding actions of a stage before its clusters follow them"),
    Setting::count("refinement.most", 0, 100_000, "own rewarding actions of a stage that are kept"),
    Setting::count("practice.rollouts", 0, 100_000, "rollouts towards each stage before the first episode, at most"),
    Setting::count("practice.enough", 1, 100_000, "rollouts that reach a stage after which its practice ends"),
    Setting::count("evaluation.every", 0, 1_000_000_000, "episodes between evaluations; 0 for none"),
    Setting::count("evaluation.episodes", 1, 1000, "episodes of an evaluation"),
    Setting::count("checkpoints.last_every", 0, 1_000_000_000, "episodes between checkpoints `last`; 0 for none"),
    Setting::count("checkpoints.periodic_every", 0, 1_000_000_000, "episodes between checkpoints that stay; 0: none"),
    Setting::new("checkpoints.periodic_kept", CountOrNull(1, 1_000_000), "newest of these that are kept"),
];

/// Every numeric setting of a run, by its path in [`RunConfig`].
pub fn settings() -> impl Iterator<Item = (String, Setting)> {
    let groups: [(&str, &[Setting]); 5] = [
        ("", &SETTINGS),
        ("ddpg.", &agent::SETTINGS),
        ("model.", &TASK_MODEL_SETTINGS),
        ("guidance.", &guidance::SETTINGS),
        ("planner.", &PLANNER_SETTINGS),
    ];
    groups.into_iter().flat_map(|(group, settings)| {
        settings.iter().map(move |setting| (format!("{group}{}", setting.path), *setting))
    })
}

impl RunConfig {
    /// The default configuration for a task.
    pub fn new(task: Arc<Task>) -> Self {
        Self { task, ..Self::default() }
    }

    /// The configuration of a run that plays this many episodes, whatever its success: in its earlier episodes nothing
    /// changes.
    #[must_use]
    pub fn extended(self, episodes: u32) -> Self {
        let extended_from = Some(self.extended_from.unwrap_or(self.episodes)).filter(|from| *from != episodes);
        Self { extended_from, episodes, stop: StopRule { success: None, ..self.stop }, ..self }
    }

    /// Scale of the exploration noise in an episode, counted from 0.
    pub fn noise_scale(&self, episode: u32) -> f32 {
        self.noise_decay.scale(episode, self.extended_from.unwrap_or(self.episodes))
    }

    /// Whether [`extended`](Self::extended) lets a run with this configuration play on.
    pub fn extends_to(&self, episodes: u32) -> bool {
        episodes > self.episodes || (episodes == self.episodes && self.stop.success.is_some())
    }

    /// Whether a finished run of `done` episodes has others left, because it was extended.
    pub fn has_more(&self, done: u64) -> bool {
        self.stop.success.is_none() && done < u64::from(self.episodes)
    }

    /// Whether its success ends a run after `done` episodes, of the latest of which this share has reached the goal.
    pub fn is_solved(&self, done: u64, success: f64) -> bool {
        done >= WINDOW.get() as u64 && self.stop.success.is_some_and(|wanted| success >= wanted)
    }

    /// Whether a run is finished after `episode` episodes, of which these were the last.
    pub fn is_finished(&self, episode: u64, recent: &RollingRate) -> bool {
        episode >= u64::from(self.episodes) || self.is_solved(episode, recent.rate())
    }

    /// Checks all ranges.
    ///
    /// # Errors
    /// Names the first setting that is out of range.
    pub fn validate(&self) -> Result<(), ValidationError> {
        self.task.validate().map_err(|error| error.within("task"))?;
        check_settings(self, &SETTINGS)?;
        self.ddpg.validate().map_err(|error| error.within("ddpg"))?;
        self.model.validate().map_err(|error| error.within("model"))?;
        self.guidance.validate().map_err(|error| error.within("guidance"))?;
        self.planner.validate().map_err(|error| error.within("planner"))?;
        if self.refinement.every > 0 && self.refinement.most < self.refinement.least.max(1) {
            return Err(ValidationError::new("refinement.most", "must be at least 1 and at least refinement.least"));
        }
        let Some(fork) = &self.fork else { return Ok(()) };
        if !fork.tasks.iter().map(|past| past.until).chain([fork.episode]).is_sorted() {
            return Err(ValidationError::new(
                "fork.tasks",
                "must be in the order of `until`, none after `fork.episode`",
            ));
        }
        fork.tasks.iter().try_for_each(|past| past.task.validate().map_err(|error| error.within("fork.tasks")))
    }

    /// Whether the clusters are due for refinement after `episode` episodes.
    pub fn is_refined_after(&self, episode: u64) -> bool {
        let every = u64::from(self.refinement.every);
        every > 0 && episode.is_multiple_of(every)
    }

    /// The task with the start noise of the run.
    pub fn played_task(&self) -> Arc<Task> {
        match self.start_noise {
            Some(noise) if noise != self.task.rules.start_noise => {
                let mut task = Task::clone(&self.task);
                task.rules.start_noise = noise;
                Arc::new(task)
            }
            _ => self.task.clone(),
        }
    }

    /// Whether the run uses action clusters at all.
    pub fn is_guided(&self) -> bool {
        self.method.has_clusters() && !(self.method.uses("epsilon") && self.epsilon.is_zero())
    }

    /// Whether the run practises before its first episode.
    pub(super) fn practises(&self) -> bool {
        self.practice.rollouts > 0 && self.is_guided() && self.method.learns()
    }

    /// The source of the run's clusters or plans.
    pub fn rollout_source(&self) -> PriorSource {
        self.method.fixed_source().unwrap_or_else(|| self.prior.clone())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use mge_base::validation::Setting;
    use mge_dynamics::{MODEL_SETTINGS, ModelConfig, TRAIN_SETTINGS, TrainConfig};
    use mge_task::{RULES, Rules, load};

    fn config() -> RunConfig {
        RunConfig::new(Arc::new(load("task1").unwrap()))
    }

    /// The paths of a configuration's numbers that are missing from the table, and of table rows that match none of its
    /// numbers.
    fn differences(config: &impl Serialize, settings: &[Setting]) -> Vec<String> {
        let config = serde_json::to_value(config).unwrap();
        let leaves = json::leaf_values(&config);
        let row = |path: &str| settings.iter().any(|setting| setting.path == path);
        let is_number = |value: &Value| value.is_number() || value.get(0).is_some_and(Value::is_number);
        let numbers =
            leaves.iter().filter(|(path, value)| is_number(value) && !row(path)).map(|(path, _)| path.clone());
        let rows = settings.iter().map(|setting| setting.path.to_owned());
        numbers.chain(rows.filter(|path| leaves.iter().all(|(known, _)| known != path))).collect()
    }

    #[test]
    fn every_number_has_a_range() {
        let mut config = config();
        config.checkpoints.periodic_kept = Some(3);
        let own = |config: &RunConfig| {
            let mut value = serde_json::to_value(config).unwrap();
            for other in ["task", "ddpg", "model", "guidance", "planner"] {
                value.as_object_mut().unwrap().remove(other);
            }
            value
        };
        let none: [String; 0] = [];
        assert_eq!(differences(&own(&config), &SETTINGS), none);
        assert_eq!(differences(&config.ddpg, &agent::SETTINGS), none);
        assert_eq!(differences(&config.model, &TASK_MODEL_SETTINGS), none);
        assert_eq!(differences(&config.guidance, &guidance::SETTINGS), none);
        assert_eq!(differences(&config.planner, &PLANNER_SETTINGS), none);
        assert_eq!(differences(&Rules::default(), &RULES), none);
        assert_eq!(differences(&ModelConfig::default(), &MODEL_SETTINGS), none);
        assert_eq!(differences(&TrainConfig::default(), &TRAIN_SETTINGS), none);
    }

    #[test]
    fn numbers_that_would_take_forever_or_exhaust_memory_are_refused() {
        for key in [
            "planner.rollouts",
            "planner.horizon",
            "planner.iterations",
            "guidance.model_rollouts",
            "guidance.horizon",
            "guidance.environment_rollouts",
            "guidance.clusters.fixed",
            "evaluation.episodes",
            "ddpg.layers",
            "ddpg.hidden",
            "ddpg.batch_size",
            "ddpg.replay_capacity",
        ] {
            for value in ["4294967295", "18446744073709551615"] {
                let Err(error) = config().with_setting(key, value) else { panic!("{key} may be {value}") };
                let error = error.to_string();
                assert!(error.contains(key) && (error.contains("from") || error.contains("u32")), "{error}");
            }
        }
    }

    #[test]
    fn deserialisation_validates_the_configuration_and_its_task() {
        let right = serde_json::to_value(config()).unwrap();
        assert_eq!(serde_json::from_value::<RunConfig>(right.clone()).unwrap(), config());
        for (pointer, value, expected) in [
            ("/task/ball/radius", json!(-5), "ball.radius: is -5"),
            ("/task/ball/radius", json!(1e38), "ball.radius: is 1"),
            ("/task/rules/gravity/1", json!(1e38), "rules.gravity: is [0, 1e38]"),
            ("/task/rules/steps_per_action", json!(4_294_967_295u32), "rules.steps_per_action: is 4294967295"),
            ("/task/name", json!("../../x"), "name: must be"),
            ("/task/name", json!(".."), "name: must be"),
            ("/task/name", json!("x".repeat(101)), "name: must be"),
            ("/guidance/model_rollouts", json!(u64::MAX), "guidance.model_rollouts: is"),
            ("/ddpg/gamma", json!(2), "ddpg.gamma: is 2"),
        ] {
            let mut wrong = right.clone();
            *wrong.pointer_mut(pointer).unwrap() = value;
            let error = serde_json::from_value::<RunConfig>(wrong).unwrap_err().to_string();
            assert!(error.contains(expected), "{pointer}: {error}");
        }
    }
}
