//! The actions in the real environment that a run takes outside its own episodes.

use std::collections::HashMap;

use mge_dynamics::{self as dynamics, Model};
use mge_physics::ToolKind;
use mge_trainer::{PriorSource, RunConfig};

/// Counts the actions that runs take outside their episodes; reads each dynamics model once.
#[derive(Debug, Default)]
pub(super) struct Charges {
    /// Launches of the model for a source and the tools of a task.
    launches: HashMap<(String, Vec<ToolKind>), u64>,
}

impl Charges {
    /// The actions of the real rollouts from which a run's first clusters are built, plus the launches on which
    /// its dynamics model was trained, one action each. With the true physics all rollouts are real, and their
    /// minimum number is counted. Rollouts that end early are counted in full, and the launches are counted for
    /// every run that uses the model. A model that cannot be read has no launches. Rollouts that planning makes
    /// during the episodes are not counted, not even in the true physics.
    pub fn of(&mut self, config: &RunConfig) -> u64 {
        let source = config.rollout_source();
        let rollouts = if config.is_guided() { rollout_actions(config, &source) } else { 0 };
        let uses_model = config.is_guided() || config.method.consults_model();
        rollouts + if uses_model { self.launches(config.task.tool_set(), &source) } else { 0 }
    }

    /// Launches of the model for a task with these tools.
    fn launches(&mut self, tools: Vec<ToolKind>, source: &PriorSource) -> u64 {
        *self.launches.entry((String::from(source.clone()), tools)).or_insert_with_key(|(_, tools)| {
            let model = match source {
                PriorSource::Uniform | PriorSource::Rapier | PriorSource::TruePhysics => None,
                PriorSource::Learned => dynamics::shipped_for(tools),
                PriorSource::ModelFile(file) => file.load().ok(),
            };
            model.map_or(0, |model| launches_of(&model))
        })
    }
}

fn rollout_actions(config: &RunConfig, source: &PriorSource) -> u64 {
    let (stages, guidance) = (config.task.stage_count(), &config.guidance);
    let explored = stages - 1;
    let real = match source {
        PriorSource::Uniform => 0,
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
    use std::sync::Arc;

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
        check(Method::Planning, 0.0, launches);
    }
}
