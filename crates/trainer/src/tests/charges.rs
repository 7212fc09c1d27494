//! Every action in the environment is charged once.

use super::*;
use mge_dynamics as dynamics;
use mge_guidance::EpsilonSchedule;

fn charged_config() -> RunConfig {
    let mut config = RunConfig::new(Arc::new(task::load("task2").unwrap()));
    config.epsilon = EpsilonSchedule::Constant(0.5);
    config.prior = PriorSource::Learned;
    (config.guidance.environment_rollouts, config.guidance.model_rollouts, config.guidance.horizon) = (10, 100, 4);
    config.guidance.most_model_rollouts = 400;
    (config.ddpg.hidden, config.ddpg.warmup_steps) = (8, 10_000);
    config
}

fn launches() -> u64 {
    let model = dynamics::shipped_for(&charged_config().task.tool_set()).unwrap();
    (model.tools().len() * model.provenance.training.observations) as u64
}

#[test]
fn every_action_in_the_environment_is_charged_once() {
    let mut config = charged_config();
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
