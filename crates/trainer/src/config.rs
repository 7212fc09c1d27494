//! The complete configuration of a run, saved with the run.

use std::collections::BTreeSet;
use std::sync::Arc;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::method::{Method, PriorSource};
use super::parts::{Evaluation, Fork, Granularity, ModelReplay, NoiseDecay, Observation, Practice, Refinement};
use mge_agent::{self as agent, DdpgConfig};
use mge_base::validation::{Range, Setting, ValidationError, check_settings};
use mge_guidance::{self as guidance, EpsilonSchedule, GuidanceConfig, PLANNER_SETTINGS, PlannerConfig};
use mge_physics::{ACTION_SET, ToolSplit};
use mge_run::Retention;
use mge_task::Task;

/// The complete description of a training. Deserialisation validates it, so that no file or text can
/// produce a configuration that is out of range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
// Derives the inherent `RunConfig::deserialize` without validation; the trait implementation uses it.
#[serde(deny_unknown_fields, remote = "Self")]
pub struct RunConfig {
    /// The whole task, so that a run does not depend on a file that may change.
    pub task: Arc<Task>,
    /// Further tasks, played in turn with `task`: task files, or folders of them, separated by commas; empty for none.
    #[serde(default)]
    pub more_tasks: String,
    /// The tasks found there, whole for the same reason as `task`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub further_tasks: Vec<Arc<Task>>,
    /// Algorithm.
    #[serde(default)]
    pub method: Method,
    /// Master seed.
    #[serde(default)]
    pub seed: u64,
    /// Episodes to train.
    #[serde(default = "default_episodes")]
    pub episodes: u32,
    /// Schedule of the epsilon threshold; see [`Method::uses`].
    #[serde(default = "default_epsilon")]
    pub epsilon: EpsilonSchedule,
    /// How often epsilon is drawn.
    #[serde(default)]
    pub granularity: Granularity,
    /// Annealing of the exploration noise.
    #[serde(default)]
    pub noise_decay: NoiseDecay,
    /// With exploration by need: a copy of the policy acts until more than this share of its last
    /// greedy attempts at some stage has failed, and is then replaced; none if the actor itself acts.
    #[serde(default)]
    pub hold_tolerance: Option<f32>,
    /// With exploration by need: the number of steps for each update while no stage needs exploration.
    #[serde(default = "default_mastered_update_interval")]
    pub mastered_update_interval: u32,
    /// Half width of the uniform noise on the ball's start in training and evaluation, normalised;
    /// none for the task's own.
    #[serde(default)]
    pub start_noise: Option<f32>,
    /// What the agent observes.
    #[serde(default)]
    pub observation: Observation,
    /// The split of CREATE's tools from which every reset draws the action set that the agent chooses
    /// among; none if it uses the task's own tool.
    #[serde(default)]
    pub tools: Option<ToolSplit>,
    /// Number of tools of the action set, nearest to the actor's proposal, among which the critic chooses.
    #[serde(default = "default_tool_candidates")]
    pub tool_candidates: usize,
    /// The learner.
    #[serde(default)]
    pub ddpg: DdpgConfig,
    /// The source of clusters, plans and imagined transitions, unless the method determines it.
    #[serde(default)]
    pub prior: PriorSource,
    /// How clusters are built.
    #[serde(default)]
    pub guidance: GuidanceConfig,
    /// Refinement of clusters during training.
    #[serde(default)]
    pub refinement: Refinement,
    /// Practice before the first episode.
    #[serde(default)]
    pub practice: Practice,
    /// Imagined transitions, for [`Method::ModelReplay`].
    #[serde(default)]
    pub model_replay: ModelReplay,
    /// Planner, for [`Method::Planning`].
    #[serde(default)]
    pub planner: PlannerConfig,
    /// Greedy evaluation.
    #[serde(default)]
    pub evaluation: Evaluation,
    /// Which checkpoints are kept.
    #[serde(default)]
    pub checkpoints: Retention,
    /// The run from which it continues with other settings, if it is a fork.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fork: Option<Fork>,
}

impl<'de> Deserialize<'de> for RunConfig {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let config = Self::deserialize(deserializer)?;
        config.validate().map_err(D::Error::custom)?;
        Ok(config)
    }
}

impl Serialize for RunConfig {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

fn default_episodes() -> u32 {
    2000
}

fn default_mastered_update_interval() -> u32 {
    1
}

fn default_tool_candidates() -> usize {
    8
}

fn default_epsilon() -> EpsilonSchedule {
    EpsilonSchedule::Linear { from: 0.5, to: 0.0, episodes: 1000 }
}

/// Limit of the number of tasks of a run.
const MAX_TASKS: usize = 1000;

/// The numeric settings of the run itself.
const SETTINGS: [Setting; 20] = [
    Setting::count("seed", 0, u64::MAX, "master seed"),
    Setting::count("episodes", 1, 10_000_000, "episodes to train"),
    Setting::number("noise_decay.final_scale", 0.0, 1.0, "least scale of the exploration noise; 1 keeps it constant"),
    Setting::number(
        "noise_decay.share",
        0.0,
        1.0,
        "share of the episodes, rounded to whole ones, after which the scale would be 0",
    ),
    Setting {
        path: "hold_tolerance",
        range: Range::NumberOrNull(0.0, 1.0),
        about: "share of failed greedy attempts above which the held policy is replaced; null to hold none",
    },
    Setting::count(
        "mastered_update_interval",
        1,
        1000,
        "steps for each update while no stage needs exploration, with exploration by need",
    ),
    Setting {
        path: "start_noise",
        range: Range::NumberOrNull(0.0, 1.0),
        about: "half width of the uniform noise on the ball's start, normalised; null for that of the task",
    },
    Setting::count(
        "tool_candidates",
        1,
        ACTION_SET as u64,
        "tools nearest to what the actor proposes, among which the critic chooses",
    ),
    Setting::count(
        "refinement.every",
        0,
        1_000_000_000,
        "episodes of a task between refinements of its clusters; 0 for none",
    ),
    Setting::count("refinement.least", 0, 100_000, "own rewarding actions of a stage before its clusters follow them"),
    Setting::count("refinement.most", 0, 100_000, "own rewarding actions of a stage that are kept"),
    Setting::count("practice.rollouts", 0, 100_000, "rollouts towards each stage before the first episode, at most"),
    Setting::count(
        "practice.enough",
        1,
        100_000,
        "rollouts that reach a stage after which it is not practised further",
    ),
    Setting::count("model_replay.rollouts", 1, 1000, "imagined rollouts after each episode"),
    Setting::count("model_replay.horizon", 1, 100, "actions in an imagined rollout"),
    Setting::count("evaluation.every", 0, 1_000_000_000, "episodes between evaluations; 0 for none"),
    Setting::count("evaluation.episodes", 1, 1000, "episodes of an evaluation"),
    Setting::count(
        "checkpoints.last_every",
        0,
        1_000_000_000,
        "episodes between checkpoints called `last`; 0 for none",
    ),
    Setting::count(
        "checkpoints.periodic_every",
        0,
        1_000_000_000,
        "episodes between checkpoints that stay; 0 for none",
    ),
    Setting {
        path: "checkpoints.periodic_kept",
        range: Range::CountOrNull(1, 1_000_000),
        about: "newest of these that are kept; null for all",
    },
];

/// Every numeric setting of a run, by its path in [`RunConfig`].
pub fn settings() -> impl Iterator<Item = (String, Setting)> {
    let groups: [(&str, &[Setting]); 4] = [
        ("", &SETTINGS),
        ("ddpg.", &agent::SETTINGS),
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
        Self {
            task,
            more_tasks: String::new(),
            further_tasks: Vec::new(),
            method: Method::default(),
            seed: 0,
            episodes: default_episodes(),
            epsilon: default_epsilon(),
            granularity: Granularity::default(),
            noise_decay: NoiseDecay::default(),
            hold_tolerance: None,
            mastered_update_interval: default_mastered_update_interval(),
            start_noise: None,
            observation: Observation::default(),
            tools: None,
            tool_candidates: default_tool_candidates(),
            ddpg: DdpgConfig::default(),
            prior: PriorSource::default(),
            guidance: GuidanceConfig::default(),
            refinement: Refinement::default(),
            practice: Practice::default(),
            model_replay: ModelReplay::default(),
            planner: PlannerConfig::default(),
            evaluation: Evaluation::default(),
            checkpoints: Retention::default(),
            fork: None,
        }
    }

    /// The configuration of a run whose number of episodes is raised: in its earlier episodes nothing changes.
    #[must_use]
    pub fn extended(self, episodes: u32) -> Self {
        Self { noise_decay: self.noise_decay.extended(self.episodes, episodes), episodes, ..self }
    }

    /// Checks all ranges.
    ///
    /// # Errors
    /// Names the first setting that is out of range.
    pub fn validate(&self) -> Result<(), ValidationError> {
        self.task.validate().map_err(|error| error.within("task"))?;
        check_settings(self, &SETTINGS)?;
        self.ddpg.validate().map_err(|error| error.within("ddpg"))?;
        self.guidance.validate().map_err(|error| error.within("guidance"))?;
        self.planner.validate().map_err(|error| error.within("planner"))?;
        if self.refinement.every > 0 && self.refinement.most < self.refinement.least.max(1) {
            return Err(ValidationError::new("refinement.most", "must be at least 1 and at least refinement.least"));
        }
        self.validate_tools()?;
        self.validate_further_tasks()
    }

    /// Checks the settings that are restricted with several tasks.
    fn validate_further_tasks(&self) -> Result<(), ValidationError> {
        let wrong = |path: &str, message: &str| Err(ValidationError::new(path, message));
        let mut names = BTreeSet::from([&self.task.name]);
        for (index, task) in self.further_tasks.iter().enumerate() {
            task.validate().map_err(|error| error.within(format_args!("further_tasks[{index}]")))?;
            if !names.insert(&task.name) {
                let place = format!("further_tasks[{index}].name");
                return wrong(&place, "is also the name of another task of the run: tasks are known by their names");
            }
        }
        if let Some(fork) = &self.fork
            && !fork.tasks.iter().map(|past| past.until).chain([fork.episode]).is_sorted()
        {
            return wrong("fork.tasks", "must be in the order of `until`, none after `fork.episode`");
        }
        let past = self.fork.iter().flat_map(|fork| &fork.tasks);
        for task in past.flat_map(|past| std::iter::once(&past.task).chain(&past.further)) {
            task.validate().map_err(|error| error.within("fork.tasks"))?;
        }
        match (self.further_tasks.len(), self.more_tasks.is_empty()) {
            (0, true) => return Ok(()),
            (0, false) => return wrong("more_tasks", "has no tasks besides that of the run: leave it empty"),
            (_, true) => return wrong("more_tasks", "must say where the `further_tasks` come from"),
            (MAX_TASKS.., _) => return wrong("more_tasks", "has more tasks than the limit of 1000"),
            _ => {}
        }
        if self.observation != Observation::Rays {
            return wrong("observation", "must be `rays` with `more_tasks`: other observations differ in length");
        }
        if self.hold_tolerance.is_some() {
            return wrong("hold_tolerance", "must be null with `more_tasks`: a policy is held for a single task");
        }
        if !self.method.learns_from_play() {
            return wrong(
                "method",
                "cannot be used with `more_tasks`: it has no policy that several tasks could share",
            );
        }
        Ok(())
    }

    /// Checks the settings that are restricted with or without `tools`.
    fn validate_tools(&self) -> Result<(), ValidationError> {
        if self.tools.is_some() && self.observation == Observation::Rays {
            let message = "is `rays`, but an agent that chooses among `tools` observes their properties: use only one of \
                           the two settings";
            return Err(ValidationError::new("observation", message));
        }
        if self.tools.is_none() {
            let without = "is set, but the run has no `tools` to choose among: set `tools` as well";
            let is_odd = self.evaluation.tools.is_some();
            return if is_odd { Err(ValidationError::new("evaluation.tools", without)) } else { Ok(()) };
        }
        if !self.method.learns_from_play() {
            let known = Method::ALL.into_iter().filter(|method| method.learns_from_play());
            let known: Vec<&str> = known.map(Method::name).collect();
            let message = format!(
                "is `{}`, which knows only the task's own tool: with `tools` use {}",
                self.method,
                known.join(", ")
            );
            return Err(ValidationError::new("method", message));
        }
        // `longest_horizon` has no effect either, but adaptive runs of earlier versions have another one.
        let (guidance, usual) = (&self.guidance, GuidanceConfig::default());
        let unused = [
            ("least_hits", guidance.least_hits == usual.least_hits),
            ("most_model_rollouts", guidance.most_model_rollouts == usual.most_model_rollouts),
            ("start_states", guidance.start_states == usual.start_states),
        ];
        match unused.into_iter().find(|(_, is_usual)| !is_usual) {
            Some((name, _)) => {
                let message = "has no effect with `tools`, whose clusters are built from one batch of rollouts";
                Err(ValidationError::new(name, message).within("guidance"))
            }
            None => Ok(()),
        }
    }

    /// All tasks of the run, in the order in which they are played.
    pub fn tasks(&self) -> impl Iterator<Item = &Arc<Task>> {
        std::iter::once(&self.task).chain(&self.further_tasks)
    }

    /// Whether the clusters of the first task are due for refinement after `episode` episodes. Every task is refined
    /// after as many of its own episodes.
    pub fn is_refined_after(&self, episode: u64) -> bool {
        let (every, tasks) = (u64::from(self.refinement.every), 1 + self.further_tasks.len() as u64);
        let own = |before: u64| before.is_multiple_of(tasks) && (before / tasks + 1).is_multiple_of(every);
        every > 0 && episode.checked_sub(1).is_none_or(own)
    }

    /// The configuration with only this task.
    #[must_use]
    pub fn on(&self, task: &Arc<Task>) -> Self {
        Self { task: task.clone(), more_tasks: String::new(), further_tasks: Vec::new(), ..self.clone() }
    }

    /// A task of the run with its start noise.
    pub fn played(&self, task: &Arc<Task>) -> Arc<Task> {
        match self.start_noise {
            Some(noise) if noise != task.rules.start_noise => {
                let mut task = Task::clone(task);
                task.rules.start_noise = noise;
                Arc::new(task)
            }
            _ => task.clone(),
        }
    }

    /// Whether the run uses action clusters at all.
    pub fn is_guided(&self) -> bool {
        self.method.has_clusters() && !(self.method.uses("epsilon") && self.epsilon.is_zero())
    }

    /// The source of the run's clusters, plans or imagined transitions.
    pub fn rollout_source(&self) -> PriorSource {
        self.method.fixed_source().unwrap_or_else(|| self.prior.clone())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use mge_base::validation::differences;
    use mge_dynamics::{MODEL_SETTINGS, ModelConfig, TRAIN_SETTINGS, TrainConfig};
    use mge_guidance::ClusterCount;
    use mge_task::{RULES, Rules, load};

    fn config() -> RunConfig {
        RunConfig::new(Arc::new(load("task1").unwrap()))
    }

    #[test]
    fn every_number_has_a_range() {
        let mut config = config();
        config.checkpoints.periodic_kept = Some(3);
        let own = |config: &RunConfig| {
            let mut value = serde_json::to_value(config).unwrap();
            for other in ["task", "ddpg", "guidance", "planner"] {
                value.as_object_mut().unwrap().remove(other);
            }
            value
        };
        let none: [String; 0] = [];
        assert_eq!(differences(&own(&config), &SETTINGS), none);
        assert_eq!(differences(&config.ddpg, &agent::SETTINGS), none);
        assert_eq!(differences(&config.guidance, &guidance::SETTINGS), ["clusters.silhouette"]);
        config.guidance.clusters = ClusterCount::Silhouette(5);
        assert_eq!(differences(&config.guidance, &guidance::SETTINGS), ["clusters.fixed"]);
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
            "model_replay.rollouts",
            "model_replay.horizon",
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
