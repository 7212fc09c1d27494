//! The actions in the real environment that a run takes outside its own episodes.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use mge_dynamics::{self as dynamics, Model};
use mge_physics::ToolKind;
use mge_task::Task;
use mge_trainer::{PriorSource, RunConfig};

/// Counts the actions that runs take outside their episodes; reads each dynamics model once.
#[derive(Debug, Default)]
pub(super) struct Charges {
    /// Hash and launches of the model for a source and the tools of a task.
    launches: HashMap<(String, Vec<ToolKind>), (String, u64)>,
}

impl Charges {
    /// The actions of the real rollouts from which a run's first clusters are built, plus the launches on which
    /// its dynamics model was trained, one action each. With the true physics all rollouts are real, and their
    /// minimum number is counted. Rollouts that end early are counted in full, and the launches are counted for
    /// every run that uses the model. A model that cannot be read has no launches. Rollouts that planning and model
    /// replay make during the episodes are not counted, not even in the true physics.
    pub fn of(&mut self, config: &RunConfig) -> u64 {
        let source = config.rollout_source();
        let rollouts = |task: &Arc<Task>| rollout_actions(config, task, &source);
        let rollouts = if config.is_guided() { config.tasks().map(rollouts).sum() } else { 0 };
        if !config.is_guided() && !config.method.consults_model() {
            return rollouts;
        }
        // Several tasks may share a model.
        let models: BTreeMap<String, u64> =
            config.tasks().map(|task| self.launches(task.tool_set(), &source)).collect();
        rollouts + models.values().sum::<u64>()
    }

    /// Hash and launches of the model for tasks with these tools.
    fn launches(&mut self, tools: Vec<ToolKind>, source: &PriorSource) -> (String, u64) {
        let launches = self.launches.entry((String::from(source.clone()), tools)).or_insert_with_key(|(_, tools)| {
            let model = match source {
                PriorSource::Uniform | PriorSource::Rapier | PriorSource::TruePhysics => None,
                PriorSource::Learned => dynamics::shipped_for(tools),
                PriorSource::ModelFile(file) => file.load().ok(),
            };
            model.map_or_else(Default::default, |model| (model.id().sha256, launches_of(&model)))
        });
        launches.clone()
    }
}

fn rollout_actions(config: &RunConfig, task: &Task, source: &PriorSource) -> u64 {
    let (stages, guidance) = (task.stage_count(), &config.guidance);
    let explored = stages - 1;
    let real = match source {
        PriorSource::Uniform => 0,
        // Rollouts of agents that choose among tools go on from the states of the stage before.
        PriorSource::TruePhysics if config.tools.is_some() => 0,
        _ if explored == 0 => 0,
        _ => explored * guidance.environment_rollouts.div_ceil(explored),
    };
    let imagined = if *source == PriorSource::TruePhysics { stages * guidance.model_rollouts } else { 0 };
    ((real + imagined) * guidance.horizon) as u64
}

fn launches_of(model: &Model) -> u64 {
    (model.tools().len() * model.provenance().training.observations) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use mge_guidance::EpsilonSchedule;
    use mge_task as task;
    use mge_trainer::Method;

    #[test]
    fn clusters_and_models_are_charged_to_the_runs_that_use_them() {
        let mut config = RunConfig::new(Arc::new(task::load("task2").unwrap()));
        config.epsilon = EpsilonSchedule::Constant(0.5);
        (config.guidance.environment_rollouts, config.guidance.model_rollouts, config.guidance.horizon) = (10, 100, 4);
        let stages = config.task.stage_count() as u64;
        assert!(stages > 1);
        let rollouts = (stages - 1) * 10_u64.div_ceil(stages - 1) * 4;
        let launches = launches_of(&dynamics::shipped_for(&config.task.tool_set()).unwrap());
        assert!(launches > 0);
        let mut charges = Charges::default();
        let mut check = |method: Method, epsilon: f32, expected: u64| {
            let config = RunConfig { method, epsilon: EpsilonSchedule::Constant(epsilon), ..config.clone() };
            assert_eq!(charges.of(&config), expected, "{method}, epsilon {epsilon}");
        };
        check(Method::Ddpg, 0.5, 0);
        check(Method::DdpgUniform, 0.5, 0);
        check(Method::DdpgMge, 0.0, 0);
        check(Method::DdpgMge, 0.5, rollouts + launches);
        check(Method::DdpgMgeTrue, 0.5, rollouts + stages * 100 * 4);
        check(Method::ModelReplay, 0.0, launches);
    }

    #[test]
    fn a_model_shared_by_several_tasks_is_charged_once_and_rollouts_for_each() {
        let config = RunConfig::default_for(Arc::new(task::load("task1").unwrap()), Method::DdpgMge);
        let mut charges = Charges::default();
        let mut of = |tasks: &str| charges.of(&config.with_setting("more_tasks", tasks).unwrap());
        let of_one = |name: &str| Charges::default().of(&config.on(&Arc::new(task::load(name).unwrap())));
        let model = |name: &str| dynamics::shipped_for(&task::load(name).unwrap().tool_set()).unwrap();
        let same = task::shipped_names().find(|name| *name != "task1" && model(name).name() == model("task1").name());
        let other = task::shipped_names().find(|name| model(name).name() != model("task1").name()).unwrap();
        let same = same.expect("tool sets have two tasks each");
        assert_eq!(of(same), of("") + of_one(same) - launches_of(&model("task1")));
        assert_eq!(of(other), of("") + of_one(other));
    }
}
