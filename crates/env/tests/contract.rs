//! The contract on which agents rely, modelled on Gymnasium's checker and tested by playing every shipped task.

use std::sync::Arc;

use mge_base::streams::Stream;
use mge_env::{
    Action, Environment, EpisodeOver, OBJECT_FEATURES, OBJECT_SLOTS, Placement, Step, observation_len, uniform_action,
};
use mge_task::{Task, load, shipped};

/// Episodes played of each task.
const EPISODES: u64 = 8;

fn reset(env: &mut Environment, seed: u64) -> Vec<f32> {
    env.reset(&mut Stream::Episode.of(seed))
}

/// An episode as seen by the agent.
#[derive(Debug, PartialEq)]
struct Episode {
    start: Vec<f32>,
    steps: Vec<(Action, Step)>,
}

/// Plays one episode of random actions to its end and checks every step.
fn play(env: &mut Environment, seed: u64) -> Episode {
    let start = reset(env, seed);
    check_observation(env.loaded_task(), &start);
    let mut rng = Stream::Episode.of(seed);
    let mut steps = Vec::new();
    for number in 1..=env.task().rules.max_actions {
        let action = uniform_action(&mut rng);
        let step = env.step(action).unwrap_or_else(|_| panic!("action {number} of seed {seed} is refused"));
        check_observation(env.loaded_task(), &step.observation);
        check_reward(env.task(), &step);
        assert_eq!(step.end.is_some(), step.terminated ^ step.truncated);
        assert!(!(step.terminated && step.truncated));
        steps.push((action, step.clone()));
        if step.end.is_some() {
            assert_eq!(env.step([0.0; 2]), Err(EpisodeOver));
            return Episode { start, steps };
        }
    }
    panic!("seed {seed} continues after the last action");
}

/// Observations have the task's length, are finite, and mark exactly one next stage.
fn check_observation(task: &Task, observation: &[f32]) {
    assert_eq!(observation.len(), observation_len(task));
    assert!(observation.iter().all(|value| value.is_finite()));
    let stages = &observation[OBJECT_SLOTS * OBJECT_FEATURES..];
    assert!(stages.iter().all(|stage| [0.0, 1.0].contains(stage)) && stages.iter().sum::<f32>() == 1.0, "{stages:?}");
}

/// All reward terms can apply in one action, the subgoal reward several times.
fn check_reward(task: &Task, step: &Step) {
    let rewards = &task.rules.rewards;
    let marker_subgoals = task.marker.as_ref().map_or(0, |marker| marker.subgoals.len());
    let subgoals = (task.subgoals.len() + marker_subgoals) as f32 * rewards.subgoal;
    let cost = rewards.cost_per_tool * task.rules.max_actions as f32;
    let terms = [rewards.step, rewards.blocked, rewards.goal, rewards.goal - cost, subgoals, rewards.target_moved];
    let [lowest, highest]: [f32; 2] = [f32::min, f32::max].map(|of| terms.iter().map(|term| of(*term, 0.0)).sum());
    assert!((lowest..=highest).contains(&step.reward), "{} is not in [{lowest}, {highest}]", step.reward);
}

/// Plays the steps again: they are the same, bit by bit.
fn repeat(env: &mut Environment, steps: &[(Action, Step)]) {
    for (action, step) in steps {
        assert_eq!(env.step(*action).as_ref(), Ok(step));
    }
}

fn check(task: Task) {
    let env = &mut Environment::new(Arc::new(task));
    for seed in 0..EPISODES {
        let episode = play(env, seed);
        assert_eq!(play(env, seed), episode, "one seed gives one episode");
        let (before, after) = episode.steps.split_at(episode.steps.len() / 2);
        assert_eq!(reset(env, seed), episode.start);
        repeat(env, before);
        assert_eq!(reset(env, seed), episode.start, "a reset in the middle of an episode begins a new one");
        repeat(env, before);
        let snapshot = env.snapshot().clone();
        repeat(env, after);
        env.restore(&snapshot);
        repeat(env, after);
    }
    let first = reset(env, 0);
    let differ = (1..EPISODES).any(|seed| reset(env, seed) != first);
    let task = env.loaded_task().clone();
    // Random shifts may affect parts that the observation does not contain.
    assert!(differ || task.rules.start_noise == 0.0, "start noise gives different starts");
    assert!(!differ || task.rules.start_noise > 0.0 || !task.shifts.is_empty(), "without noise all starts are equal");
    let mut step = |action| {
        reset(env, 0);
        env.step(action).unwrap()
    };
    for (outside, clipped) in [([5.0, -7.0], [1.0, -1.0]), ([-1.5, 0.3], [-1.0, 0.3])] {
        assert_eq!(step(outside), step(clipped), "actions are clipped to the screen");
    }
    for action in [[f32::NAN, 0.0], [0.0, f32::INFINITY]] {
        assert_eq!(step(action).placement, Placement::Invalid);
    }
}

#[test]
fn every_shipped_task_keeps_the_contract_with_and_without_noise() {
    let tuning = (1..=6).map(|number| load(&format!("tune{number}")).unwrap());
    for mut task in shipped().into_iter().chain(tuning) {
        check(task.clone());
        task.rules.start_noise = 0.05;
        check(task);
    }
}

#[test]
fn levels_with_random_shifts_keep_the_contract() {
    for name in ["create/Push-random", "create/Obstacle-random"] {
        check(load(name).unwrap());
    }
}
