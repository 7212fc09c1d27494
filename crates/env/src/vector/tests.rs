//! Environments stepped together, and their states.

use std::sync::Arc;

use rand::Rng;

use super::*;
use crate::Action;
use crate::{Placement, Step, TOOL_FEATURES, tool_features, uniform_action};
use mge_physics::ACTION_SET;
use mge_task::Task;

fn noisy_task() -> Arc<Task> {
    let mut task = mge_task::load("task5").unwrap();
    task.rules.start_noise = 0.05;
    Arc::new(task)
}

/// Plays the actions in a single environment. Returns its episodes, each with its first observation.
fn alone(task: &Arc<Task>, seed: u64, actions: &[Action]) -> Vec<(Vec<f32>, Vec<Step>)> {
    let mut rng = Stream::Episode.of(seed);
    let mut env = Environment::new(task.clone());
    let mut episodes = vec![(env.reset(&mut rng), Vec::new())];
    for action in actions {
        match env.step(*action) {
            Ok(step) => episodes.last_mut().unwrap().1.push(step),
            Err(_) => episodes.push((env.reset(&mut rng), vec![env.step(*action).unwrap()])),
        }
    }
    episodes
}

/// `steps` x `count` actions, the same for every test.
fn actions(steps: usize, count: usize) -> Vec<Vec<Action>> {
    let mut rng = Stream::Episode.of(77);
    (0..steps).map(|_| (0..count).map(|_| uniform_action(&mut rng)).collect()).collect()
}

#[test]
fn each_environment_plays_as_if_alone_on_any_number_of_threads() {
    const COUNT: usize = 100;
    let task = noisy_task();
    let actions = actions(40, COUNT);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut vector = VectorEnvironment::new(Environment::new(task.clone()), COUNT, Autoreset::SameStep);
        let length = vector.observation_len();
        let mut observations = vec![0.0; COUNT * length];
        let seeds: Vec<Option<u64>> = (0..COUNT as u64).map(|index| Some(500 + index)).collect();
        vector.reset(&seeds, None, &mut observations);
        let mut seen: Vec<Vec<(Vec<f32>, Vec<Step>)>> =
            observations.chunks(length).map(|row| vec![(row.to_vec(), Vec::new())]).collect();
        for actions in &actions {
            pool.install(|| vector.step(actions, &mut observations)).unwrap();
            for ((episodes, row), outcome) in seen.iter_mut().zip(observations.chunks(length)).zip(vector.outcomes()) {
                let (last, info) = match &outcome.ended {
                    Some(ended) => (ended.observation.clone(), ended.info.clone()),
                    None => (row.to_vec(), outcome.info.clone()),
                };
                let steps = &mut episodes.last_mut().unwrap().1;
                steps.push(Step {
                    observation: last,
                    reward: outcome.reward,
                    terminated: outcome.terminated,
                    truncated: outcome.truncated,
                    end: info.end,
                    placement: info.placement.unwrap(),
                    subgoals: Vec::new(),
                    goal: info.goal,
                    touched: Vec::new(),
                });
                if outcome.ended.is_some() {
                    episodes.push((row.to_vec(), Vec::new()));
                }
            }
        }
        for (index, episodes) in seen.iter_mut().enumerate() {
            let own: Vec<Action> = actions.iter().map(|all| all[index]).collect();
            let mut expected = alone(&task, 500 + index as u64, &own);
            for step in expected.iter_mut().flat_map(|(_, steps)| steps) {
                (step.subgoals, step.touched) = (Vec::new(), Vec::new());
            }
            // Drops the episode that the last step has just started.
            episodes.retain(|(_, steps)| !steps.is_empty());
            assert_eq!(*episodes, expected, "environment {index}, {threads} threads");
        }
    }
}

#[test]
fn the_next_step_after_the_end_begins_an_episode_and_ignores_its_action() {
    let task = noisy_task();
    let mut vector = VectorEnvironment::new(Environment::new(task.clone()), 1, Autoreset::NextStep);
    let mut row = vec![0.0; vector.observation_len()];
    vector.reset(&[Some(3)], None, &mut row);
    let mut rng = Stream::Episode.of(3);
    let mut env = Environment::new(task);
    env.reset(&mut rng);
    let mut ends = 0;
    for action in actions(60, 1).concat() {
        vector.step(&[action], &mut row).unwrap();
        let outcome = vector.outcomes().next().unwrap();
        match env.step(action) {
            Ok(step) => {
                assert_eq!(
                    (&row, outcome.reward, outcome.terminated),
                    (&step.observation, step.reward, step.terminated)
                );
            }
            Err(_) => {
                ends += 1;
                assert_eq!(row, env.reset(&mut rng));
                assert_eq!((outcome.reward, outcome.terminated, outcome.truncated), (0.0, false, false));
                assert_eq!((outcome.info.placement, outcome.info.placed), (None, 0));
            }
        }
    }
    assert!(ends > 2);
}

#[test]
fn invalid_steps_are_refused_and_change_nothing() {
    let mut vector = VectorEnvironment::new(Environment::new(noisy_task()), 3, Autoreset::Disabled);
    let length = vector.observation_len();
    let mut rows = vec![0.0; 3 * length];
    let refused = |vector: &mut VectorEnvironment, actions: [Action; 3]| {
        let mut rows = vec![0.0; 3 * length];
        vector.step(&actions, &mut rows).unwrap_err()
    };
    assert_eq!(refused(&mut vector, [[0.0; 2]; 3]), VectorError::ResetNeeded { index: 0, problem: "has not begun" });
    vector.reset(&[Some(1); 3], Some(&[true, false, true]), &mut rows);
    assert!(rows[length..2 * length].iter().all(|value| *value == 0.0), "the other row is unchanged");
    assert_eq!(refused(&mut vector, [[0.0; 2]; 3]), VectorError::ResetNeeded { index: 1, problem: "has not begun" });
    vector.reset(&[Some(1); 3], None, &mut rows);
    let before = vector.state(0).unwrap().to_json();
    let error = refused(&mut vector, [[0.5; 2], [0.0; 2], [0.0, f32::NAN]]);
    assert!(error.to_string().starts_with("the action of environment 2 is "), "{error}");
    assert_eq!(vector.state(0).unwrap().to_json(), before);
    let over = (0..100).find_map(|_| vector.step(&[[0.9, 0.9]; 3], &mut rows).err());
    assert_eq!(over, Some(VectorError::ResetNeeded { index: 0, problem: "is over" }));
    assert_eq!(vector.state(3).unwrap_err(), VectorError::NoSuchEnvironment { index: 3, count: 3 });
}

#[test]
fn a_state_continues_like_the_original_also_after_a_round_trip() {
    let task = noisy_task();
    let mut vector = VectorEnvironment::new(Environment::new(task.clone()), 2, Autoreset::NextStep);
    let length = vector.observation_len();
    let mut rows = vec![0.0; 2 * length];
    vector.reset(&[Some(8), Some(9)], None, &mut rows);
    let actions = actions(50, 2);
    for (number, pair) in actions.iter().enumerate() {
        let state = vector.state(0).unwrap();
        let read = State::parse(&state.to_json(), &task).unwrap();
        assert_eq!(read.to_json(), state.to_json());
        let observation = rows[..length].to_vec();
        let (first, second) = rows.split_at_mut(length);
        vector.restore(1, &read, second).unwrap();
        assert_eq!((&*first, &*second), (&*observation, &*observation), "before action {number}");
        vector.step(&[pair[0]; 2], &mut rows).unwrap();
        assert_eq!(rows[..length], rows[length..], "after action {number}");
    }
    let other = Arc::new(mge_task::load("task1").unwrap());
    let state = VectorEnvironment::new(Environment::new(other), 1, Autoreset::NextStep).state(0).unwrap();
    assert!(matches!(vector.restore(0, &state, &mut rows[..length]), Err(VectorError::Refused(_))));
    assert!(State::parse("{}", &task).is_err());
}

/// Random choices of tools and positions.
fn choices(steps: usize, tools: usize) -> Vec<Choice> {
    let mut rng = Stream::Episode.of(78);
    (0..steps).map(|_| Choice { tool: rng.gen_range(0..tools), place: uniform_action(&mut rng) }).collect()
}

#[test]
fn with_tools_every_episode_draws_an_action_set_and_observes_it() {
    let task = Arc::new(mge_task::load("create/Ladder-random").unwrap());
    let mut vector =
        VectorEnvironment::new(Environment::new(task).with_tools(ToolSplit::Train), 1, Autoreset::NextStep);
    let mut row = vec![0.0; vector.observation_len()];
    vector.reset(&[Some(4)], None, &mut row);
    let parts = vector.template().observation_parts();
    assert_eq!(parts.iter().map(|part| part.name).collect::<Vec<_>>(), ["objects", "progress", "tools"]);
    let [described, mut placed, mut sets] = [ACTION_SET * TOOL_FEATURES, 0, 0];
    for choice in choices(200, ACTION_SET) {
        let before = vector.environment(0).unwrap().start().tools.clone();
        vector.step(&[choice], &mut row).unwrap();
        let env = vector.environment(0).unwrap();
        let set = env.action_set().unwrap();
        sets += usize::from(env.start().tools != before);
        let features: Vec<f32> = set.tools().flat_map(tool_features).collect();
        assert_eq!(row[row.len() - described..], features);
        assert!(set.numbers().skip(1).all(|number| ToolSplit::Train.tools().contains(&number)));
        if vector.outcomes().next().unwrap().info.placement == Some(Placement::Placed) {
            placed += 1;
            let tool = *env.snapshot().world.tools().last().unwrap();
            let chosen = *set.tools().nth(choice.tool).unwrap().unwrap();
            assert_eq!(tool.at([0.0; 2]), chosen);
        }
    }
    assert!(placed > 20 && sets > 3, "{placed} tools, {sets} sets");
    let error = vector.step(&[Choice { tool: ACTION_SET, place: [0.0; 2] }], &mut row).unwrap_err();
    assert!(error.to_string().contains("asks for tool 40, but its 40 tools"), "{error}");
}

#[test]
fn a_state_with_tools_and_random_shifts_continues_after_a_round_trip() {
    let task = Arc::new(mge_task::load("create/Obstacle-random").unwrap());
    let new = |count| {
        VectorEnvironment::new(Environment::new(task.clone()).with_tools(ToolSplit::Test), count, Autoreset::NextStep)
    };
    let mut vector = new(2);
    let length = vector.observation_len();
    let mut rows = vec![0.0; 2 * length];
    vector.reset(&[Some(8), Some(9)], None, &mut rows);
    for choice in choices(120, ACTION_SET) {
        let state = State::parse(&vector.state(0).unwrap().to_json(), &task).unwrap();
        let (first, second) = rows.split_at_mut(length);
        vector.restore(1, &state, second).unwrap();
        assert_eq!(first, second);
        vector.step(&[choice; 2], &mut rows).unwrap();
        assert_eq!(rows[..length], rows[length..]);
    }
    let state = vector.state(0).unwrap();
    let mut own = VectorEnvironment::new(Environment::new(task), 1, Autoreset::NextStep);
    let error = own.restore(0, &state, &mut rows).unwrap_err();
    assert!(error.to_string().contains("with test tools, but the environment"), "{error}");
}
