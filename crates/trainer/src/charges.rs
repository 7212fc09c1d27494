//! The actions in the real environment that runs of earlier versions took outside their episodes and practice.

use super::config::RunConfig;
use super::method::PriorSource;
use mge_run::RunHistory;

impl RunConfig {
    /// The actions of the search for the task's subgoals and of the real rollouts for the run's first clusters, and the
    /// launches of its dynamics model, one action each. The rollouts were not counted then: each is taken to have the
    /// full horizon. In the true physics all rollouts are real, and their least number is taken, without those of plans
    /// during the episodes. A model that cannot be read has no launches.
    pub(super) fn charged_before_episodes(&self) -> u64 {
        let source = self.rollout_source();
        let rollouts = if self.is_guided() { self.rollout_actions(&source) } else { 0 };
        self.task.search_actions + rollouts + self.launches()
    }

    /// Adds the charged actions to episodes of a log of an earlier version, which has none.
    pub fn complete(&self, history: &mut RunHistory) {
        let mut before = None;
        for record in history.records.values_mut().iter_mut().filter(|record| record.charged_actions.is_none()) {
            let before = *before.get_or_insert_with(|| self.charged_before_episodes());
            record.charged_actions = Some(before + record.environment_steps);
        }
    }

    fn rollout_actions(&self, source: &PriorSource) -> u64 {
        let (stages, guidance) = (self.task.stage_count(), &self.guidance);
        let explored = stages - 1;
        let real = match source {
            PriorSource::Uniform => 0,
            _ => explored * guidance.environment_rollouts.div_ceil(explored.max(1)),
        };
        let imagined = if *source == PriorSource::TruePhysics { stages * guidance.model_rollouts } else { 0 };
        ((real + imagined) * guidance.horizon) as u64
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{Method, Practice, Training, build_prior};
    use mge_base::stop::Stop;
    use mge_dynamics as dynamics;
    use mge_guidance::EpsilonSchedule;
    use mge_run::EpisodeRecord;
    use mge_task as task;

    fn config() -> RunConfig {
        let mut config = RunConfig::new(Arc::new(task::load("task2").unwrap()));
        config.epsilon = EpsilonSchedule::Constant(0.5);
        config.prior = PriorSource::Learned;
        (config.guidance.environment_rollouts, config.guidance.model_rollouts, config.guidance.horizon) = (10, 100, 4);
        (config.ddpg.hidden, config.ddpg.warmup_steps) = (8, 10_000);
        config
    }

    fn launches() -> u64 {
        let model = dynamics::shipped_for(&config().task.tool_set()).unwrap();
        (model.tools().len() * model.provenance().training.observations) as u64
    }

    #[test]
    fn clusters_and_models_of_earlier_versions_are_charged_to_the_runs_that_used_them() {
        let mut config = config();
        Arc::make_mut(&mut config.task).search_actions = 70;
        let stages = config.task.stage_count() as u64;
        assert!(stages > 1 && launches() > 0);
        let rollouts = (stages - 1) * 10_u64.div_ceil(stages - 1) * 4;
        let check = |method: Method, epsilon: f32, expected: u64| {
            let config = RunConfig { method, epsilon: EpsilonSchedule::Constant(epsilon), ..config.clone() };
            assert_eq!(config.charged_before_episodes(), 70 + expected, "{method}, epsilon {epsilon}");
        };
        check(Method::Ddpg, 0.5, 0);
        check(Method::DdpgUniform, 0.5, 0);
        check(Method::DdpgMge, 0.0, 0);
        check(Method::DdpgMge, 0.5, rollouts + launches());
        check(Method::DdpgMgeTrue, 0.5, rollouts + stages * 100 * 4);
        check(Method::Planning, 0.0, launches());
    }

    #[test]
    fn every_action_in_the_environment_is_charged_once() {
        let mut config = config();
        let prior = Arc::new(build_prior(&config, |_| (), &Stop::default()).unwrap());
        let rollouts = prior.environment_actions();
        let most = prior.stages.iter().map(|stage| stage.environment_rollouts as u64 * 4).sum();
        assert!((1..=most).contains(&rollouts) && prior.stages[2].environment_actions == 0);
        let mut training = Training::new(config.clone(), Some(prior.clone())).unwrap();
        let (record, _) = training.run_episode().unwrap();
        assert_eq!(record.charged_actions, Some(launches() + rollouts + record.steps));
        // The same clusters cost nothing more, and others what they cost.
        training.set_prior(prior.clone());
        let other = RunConfig { seed: 1, ..config.clone() };
        let other = Arc::new(build_prior(&other, |_| (), &Stop::default()).unwrap());
        training.set_prior(other.clone());
        let (next, _) = training.run_episode().unwrap();
        let charged = |record: &EpisodeRecord| record.charged_actions.unwrap();
        assert_eq!(charged(&next), charged(&record) + other.environment_actions() + next.steps);

        // In practice, the rollouts are those of practice; the model that is trained for the run has its own launches.
        config.practice = Practice { rollouts: 5, enough: 5 };
        config.prior = PriorSource::default();
        (config.model.launches, config.model.epochs) = (3, 1);
        let mut training = Training::new(config.clone(), None).unwrap();
        let practised = training.practise().unwrap().unwrap();
        let (record, _) = training.run_episode().unwrap();
        let launches = 3 * config.task.tool_set().len() as u64;
        assert_eq!(charged(&record), launches + practised.actions + record.steps);

        // All rollouts in the true physics are real, also those of plans.
        let plans = RunConfig { method: Method::Planning, prior: PriorSource::TruePhysics, ..config.clone() };
        let (record, _) = Training::new(plans.clone(), None).unwrap().run_episode().unwrap();
        let rollouts = (plans.planner.rollouts * plans.planner.iterations) as u64 * record.steps;
        let planned = charged(&record) - record.steps;
        assert!((rollouts..=rollouts * plans.planner.horizon as u64).contains(&planned), "{planned}");
        config.prior = PriorSource::TruePhysics;
        let mut training = Training::new(config.clone(), None).unwrap();
        let practised = training.practise().unwrap().unwrap();
        let imagined = training.prior().unwrap().environment_actions();
        let (record, _) = training.run_episode().unwrap();
        assert!(imagined > 300, "at least an action a rollout");
        assert_eq!(charged(&record), imagined + practised.actions + record.steps);
    }

    #[test]
    fn episodes_of_earlier_versions_are_charged_what_they_took() {
        let mut history = RunHistory::default();
        for (episode, environment_steps) in [(1, 8), (2, 15)] {
            history.records.push(EpisodeRecord { episode, environment_steps, ..EpisodeRecord::default() });
        }
        history.records.values_mut()[1].charged_actions = Some(3);
        config().complete(&mut history);
        let charged: Vec<Option<u64>> = history.records.iter().map(|record| record.charged_actions).collect();
        assert_eq!(charged, [Some(config().charged_before_episodes() + 8), Some(3)]);
    }
}
