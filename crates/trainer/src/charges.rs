//! The actions in the real environment that a run is charged for outside its episodes and practice.

use super::config::RunConfig;
use super::method::PriorSource;
use mge_dynamics::{self as dynamics, Model};
use mge_run::RunHistory;

impl RunConfig {
    /// The actions of the search for the task's subgoals, of the real rollouts from which the run's first clusters are
    /// built, plus the launches on which
    /// its dynamics model was trained, one action each. With the true physics all rollouts are real, and their
    /// minimum number is counted. Rollouts that end early are counted in full, and the launches are counted for
    /// every run that uses the model. A model that cannot be read has no launches. Rollouts that planning makes
    /// during the episodes are not counted, not even in the true physics.
    pub(super) fn charged_before_episodes(&self) -> u64 {
        let source = self.rollout_source();
        let rollouts = if self.is_guided() { self.rollout_actions(&source) } else { 0 };
        let uses_model = self.is_guided() || self.method.consults_model();
        let launches = if uses_model { self.launches(&source) } else { 0 };
        self.task.search_actions + rollouts + launches
    }

    /// Adds the charged actions to episodes of a log of an earlier version, which has none.
    pub fn complete(&self, history: &mut RunHistory) {
        let mut before = None;
        for record in history.records.values_mut().iter_mut().filter(|record| record.charged_actions.is_none()) {
            let before = *before.get_or_insert_with(|| self.charged_before_episodes());
            record.charged_actions = Some(before + record.environment_steps);
        }
    }

    /// Launches of the model for the tools of the task.
    fn launches(&self, source: &PriorSource) -> u64 {
        let model = match source {
            PriorSource::Uniform | PriorSource::Rapier | PriorSource::TruePhysics => None,
            PriorSource::Learned => dynamics::shipped_for(&self.task.tool_set()),
            PriorSource::ModelFile(file) => file.load().ok(),
        };
        model.map_or(0, |model| launches_of(&model))
    }

    fn rollout_actions(&self, source: &PriorSource) -> u64 {
        let (stages, guidance) = (self.task.stage_count(), &self.guidance);
        let explored = stages - 1;
        let real = match source {
            PriorSource::Uniform => 0,
            _ if explored == 0 => 0,
            _ => explored * guidance.environment_rollouts.div_ceil(explored),
        };
        let imagined = if *source == PriorSource::TruePhysics { stages * guidance.model_rollouts } else { 0 };
        ((real + imagined) * guidance.horizon) as u64
    }
}

fn launches_of(model: &Model) -> u64 {
    (model.tools().len() * model.provenance().training.observations) as u64
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{Method, Training};
    use mge_guidance::{ActionPrior, EpsilonSchedule};
    use mge_run::EpisodeRecord;
    use mge_task as task;

    fn config() -> RunConfig {
        let mut config = RunConfig::new(Arc::new(task::load("task2").unwrap()));
        config.epsilon = EpsilonSchedule::Constant(0.5);
        (config.guidance.environment_rollouts, config.guidance.model_rollouts, config.guidance.horizon) = (10, 100, 4);
        config
    }

    #[test]
    fn clusters_and_models_are_charged_to_the_runs_that_use_them() {
        let mut config = config();
        Arc::make_mut(&mut config.task).search_actions = 70;
        let stages = config.task.stage_count() as u64;
        assert!(stages > 1);
        let rollouts = (stages - 1) * 10_u64.div_ceil(stages - 1) * 4;
        let launches = launches_of(&dynamics::shipped_for(&config.task.tool_set()).unwrap());
        assert!(launches > 0);
        let check = |method: Method, epsilon: f32, expected: u64| {
            let config = RunConfig { method, epsilon: EpsilonSchedule::Constant(epsilon), ..config.clone() };
            assert_eq!(config.charged_before_episodes(), 70 + expected, "{method}, epsilon {epsilon}");
        };
        check(Method::Ddpg, 0.5, 0);
        check(Method::DdpgUniform, 0.5, 0);
        check(Method::DdpgMge, 0.0, 0);
        check(Method::DdpgMge, 0.5, rollouts + launches);
        check(Method::DdpgMgeTrue, 0.5, rollouts + stages * 100 * 4);
        check(Method::Planning, 0.0, launches);
    }

    #[test]
    fn episodes_of_earlier_versions_are_charged_as_those_of_now() {
        let config = config();
        let prior = ActionPrior::uniform(&config.task, &config.guidance, config.seed);
        let mut training = Training::new(config.clone(), Some(Arc::new(prior))).unwrap();
        let mut now = RunHistory::default();
        (0..2).for_each(|_| now.records.push(training.run_episode().unwrap().0));
        let mut earlier = RunHistory::default();
        let without = |record: &EpisodeRecord| EpisodeRecord { charged_actions: None, ..record.clone() };
        now.records.iter().for_each(|record| earlier.records.push(without(record)));
        config.complete(&mut earlier);
        assert!(earlier.records[1].charged_actions > earlier.records[0].charged_actions);
        assert_eq!(earlier, now);
    }
}
