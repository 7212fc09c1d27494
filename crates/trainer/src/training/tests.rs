//! Tests of single episodes.

use super::*;
use crate::Method;
use mge_guidance::GuidanceConfig;
use mge_run::Event;
use mge_task::Task;

fn config(method: Method) -> RunConfig {
    let mut config = RunConfig::new(Arc::new(mge_task::load("task1").unwrap()));
    config.method = method;
    config.ddpg.hidden = 8;
    config.prior = crate::PriorSource::TruePhysics;
    config
}

/// The configuration of a task whose ball falls into the goal by itself.
fn easy() -> RunConfig {
    let mut config = config(Method::Ddpg);
    let mut task = Task::clone(&config.task);
    let [x, y] = task.ball.position;
    task.subgoals.clear();
    task.goal.position = [x, y - 0.3];
    config.task = Arc::new(task);
    config
}

#[test]
fn evaluations_are_shares_and_means_over_their_episodes() {
    let mut training = Training::new(easy(), None).unwrap();
    let trace = greedy_episode(&training.config.task, training.ddpg(), &mut Stream::Evaluation.of(0));
    assert!(trace.reached_goal() && trace.total_reward() > 0.0, "{trace:?}");
    let expected =
        Event::Evaluated { episode: 0, episodes: 4, success: 1.0, mean_return: f64::from(trace.total_reward()) };
    assert_eq!(training.evaluate(4).unwrap(), expected);
    let mut training = Training::new(config(Method::Ddpg), None).unwrap();
    let Event::Evaluated { success, .. } = training.evaluate(2).unwrap() else { panic!("an evaluation") };
    assert_eq!(success, 0.0);
}

#[test]
fn before_the_first_update_there_are_no_network_metrics() {
    let mut training = Training::new(easy(), None).unwrap();
    let (record, _) = training.run_episode().unwrap();
    assert_eq!((record.max_q, record.mean_q, record.critic_loss), (None, None, None));
}

#[test]
fn a_schedule_set_for_an_unguided_run_applies_once_it_has_clusters() {
    let thresholds = |schedule: Option<&str>, prior: bool| {
        let mut training = Training::new(easy(), None).unwrap();
        if let Some(schedule) = schedule {
            training.set_schedule(schedule.parse().unwrap());
        }
        if prior {
            training.set_prior(Arc::new(ActionPrior::uniform(&training.config.task, &GuidanceConfig::default(), 0)));
        }
        let (record, trace) = training.run_episode().unwrap();
        (record.epsilon, trace.steps[0].source)
    };
    assert_ne!(easy().epsilon.threshold(0), 0.0);
    assert_eq!(thresholds(None, false), (0.0, Source::Policy));
    assert_eq!(thresholds(Some("1"), false), (0.0, Source::Policy));
    assert_eq!(thresholds(None, true), (0.0, Source::Policy));
    assert_eq!(thresholds(Some("1"), true), (1.0, Source::Clusters));
}

#[test]
fn a_method_that_does_not_use_epsilon_ignores_every_schedule() {
    let actions = |epsilon: &str| {
        let mut training = Training::new(easy().with_setting("epsilon", epsilon).unwrap(), None).unwrap();
        let played = (0..3).map(|_| training.run_episode().unwrap().1.steps[0].action).collect::<Vec<_>>();
        assert!(training.needs().is_empty(), "{epsilon}");
        played
    };
    assert_eq!(actions("need:0:0:20"), actions("0.5"));
}

#[test]
fn open_loop_replay_draws_from_clusters_until_it_has_a_success() {
    let config = RunConfig { method: Method::OpenLoop, ..easy() };
    let prior = Arc::new(ActionPrior::uniform(&config.task, &config.guidance, 0));
    let mut training = Training::new(config, Some(prior)).unwrap();
    let epsilons = [0; 3].map(|_| training.run_episode().unwrap().0.epsilon);
    assert_eq!(epsilons, [1.0, 0.0, 0.0]);
}

/// First actions of several episodes without noise, while the networks learn.
fn first_actions(config: &RunConfig, hold_tolerance: Option<f32>, schedule: &str) -> Vec<Action> {
    let mut config = RunConfig { method: Method::DdpgAdaptive, hold_tolerance, ..config.clone() };
    config.ddpg.warmup_steps = 0;
    config.noise_decay.final_scale = 0.0;
    config.noise_decay.share = 0.0;
    let mut training = Training::new(config, None).unwrap();
    training.set_schedule(schedule.parse().unwrap());
    (0..6).map(|_| training.run_episode().unwrap().1.steps[0].action).collect()
}

#[test]
fn a_held_policy_acts_until_it_fails() {
    let changes = |config: &RunConfig, tolerance, schedule| {
        let actions = first_actions(config, tolerance, schedule);
        actions.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    let (succeeds, fails) = (easy(), config(Method::DdpgAdaptive));
    assert_eq!(changes(&succeeds, Some(0.15), "need:0:0:20"), 0);
    assert_eq!(changes(&succeeds, None, "need:0:0:20"), 5);
    assert_eq!(changes(&fails, Some(0.15), "need:0:0:20"), 5);
    assert_eq!(changes(&fails, Some(1.0), "need:0:0:20"), 0, "all may fail");
    assert_eq!(changes(&succeeds, Some(0.15), "0"), 5, "no policy is held without need");
}

#[test]
fn a_held_policy_is_judged_by_its_attempts_at_the_goal() {
    let mut config = config(Method::DdpgAdaptive);
    (config.hold_tolerance, config.epsilon) = (Some(0.1), "need:0:0.5:4".parse().unwrap());
    let mut training = Training::new(config, None).unwrap();
    assert_eq!(training.env.task().stage_count(), 2);
    training.hold_or_release();
    training.note_attempt(0, true);
    assert!(training.progress.hold.is_unused(), "the way to the goal has not ended");
    training.note_attempt(1, true);
    assert!(!training.progress.hold.is_unused());
}

#[test]
fn the_less_a_task_needs_exploration_the_fewer_updates_follow() {
    let learned = |interval, updates_per_step, schedule: &str| {
        let mut config = RunConfig { method: Method::DdpgAdaptive, mastered_update_interval: interval, ..easy() };
        (config.ddpg.warmup_steps, config.ddpg.updates_per_step) = (0, updates_per_step);
        let mut training = Training::new(config, None).unwrap();
        training.set_schedule(schedule.parse().unwrap());
        (0..12).for_each(|_| drop(training.run_episode().unwrap()));
        (training.transitions(), training.ddpg().updates())
    };
    let (steps, updates) = learned(4, 1, "need:0:0:1");
    assert_eq!((steps, updates), (24, 7), "the first of all steps, then every fourth");
    for (interval, schedule) in [(1, "need:0:0:1"), (4, "need:0:0:20"), (4, "0")] {
        let (steps, updates) = learned(interval, 1, schedule);
        assert_eq!(updates, steps, "{interval} {schedule}");
    }
    assert_eq!(learned(4, 4, "0"), (24, 96));
    // The need falls by 1/20 with every episode.
    let expected = (0..12).map(|episode: u64| (20 - episode).div_ceil(5) + (19 - episode).div_ceil(5)).sum();
    assert_eq!(learned(4, 4, "need:0:0:20"), (24, expected));
}
