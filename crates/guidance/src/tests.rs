//! Clusters of known points, plans with a known optimum, and credit for actions.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::*;
use mge_base::stop::Stop;
use mge_dynamics::{DynamicsError, Result, Rollout};
use mge_env::{Action, Environment, Placement, Snapshot, Step};
use mge_physics as physics;
use mge_task::{self as task, Offset, Part, Shift, Task};

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(0)
}

/// A model in which only the first action matters: the nearer it is to the field's point, the nearer
/// the ball comes to the stage.
#[derive(Debug)]
struct Bullseye([f32; 2]);

impl RolloutModel for Bullseye {
    fn rollouts(&self, starts: &[&Snapshot], sequences: &[Vec<Action>], _: &Stop) -> Result<Vec<Rollout>> {
        let roll_out = |(start, sequence): (&&Snapshot, &Vec<Action>)| {
            let [x, y] = start.task.stages()[start.stage()].position;
            let miss = (sequence[0][0] - self.0[0]).hypot(sequence[0][1] - self.0[1]);
            Rollout { path: vec![[x + 1.0, y], [x + miss, y]], hit: miss < 0.02, ..Rollout::default() }
        };
        Ok(starts.iter().zip(sequences).map(roll_out).collect())
    }
}

#[test]
fn rollouts_aim_at_the_stages_of_a_shifted_scene() {
    let mut task = task::load("task1").unwrap();
    // The ball falls to the place to which the first subgoal is shifted.
    let [x, y] = task.ball.position;
    (task.subgoals[0].position, task.subgoals[0].radius) = ([x, y - 0.9], 4.0);
    task.shifts = vec![Shift { parts: vec![Part::Subgoal(0)], by: Offset::OneOf(vec![[0.0, 0.7]]) }];
    let mut env = Environment::new(Arc::new(task));
    env.reset(&mut rng());
    for model in [&RapierPhysics as &dyn RolloutModel, &TruePhysics, &*mge_dynamics::shipped("bucket-box").unwrap()] {
        let rollout = model.rollouts(&[env.snapshot()], &[vec![[-0.9, 0.9]]], &Stop::default()).unwrap().remove(0);
        assert!(rollout.hit, "{model:?}");
    }
}

fn with_clusters(fixed: usize) -> GuidanceConfig {
    GuidanceConfig { clusters: ClusterCount { fixed }, ..GuidanceConfig::default() }
}

fn clustered(actions: &[Action], fixed: usize) -> Vec<Cluster> {
    clusters::cluster(actions, &with_clusters(fixed), &rng()).unwrap()
}

#[test]
fn two_groups_become_two_clusters_with_their_means_and_deviations() {
    let group = |x: f32| [[x - 0.1, 0.0], [x + 0.1, 0.0], [x, 0.2], [x, -0.2]];
    let actions: Vec<Action> = group(-0.5).into_iter().chain(group(0.5)).chain([[0.5, 0.0]; 4]).collect();
    let found = clustered(&actions, 2);
    assert_eq!(found.iter().map(|cluster| cluster.count).collect::<Vec<_>>(), [8, 4]);
    assert_eq!(found.iter().map(|cluster| cluster.mean[0]).collect::<Vec<_>>(), [0.5, -0.5]);
    let expected = [0.02f32 / 4.0, 0.08 / 4.0].map(f32::sqrt);
    found[1].std.iter().zip(expected).for_each(|(std, expected)| assert!((std - expected).abs() < 1e-6));
}

#[test]
fn there_are_no_more_clusters_than_distinct_actions() {
    let same = clustered(&[[0.3, 0.3]; 5], 3);
    assert_eq!((same.len(), same[0].std, same[0].weight), (1, [0.02, 0.02], 1.0));
    assert!(clustered(&[], 3).is_empty());
}

#[test]
fn an_action_that_is_not_finite_is_an_error_and_not_one_cluster() {
    for wrong in [f32::NAN, f32::INFINITY] {
        let found = clusters::cluster(&[[0.1, 0.2], [0.3, -0.5], [wrong, 0.0], [0.5, 0.5]], &with_clusters(2), &rng());
        assert!(matches!(found, Err(DynamicsError::ActionNotFinite)), "{wrong}: {found:?}");
    }
}

#[test]
fn a_cluster_samples_its_normal_distribution() {
    let cluster = Cluster { mean: [0.1, -0.2], std: [0.05, 0.2], weight: 1.0, count: 1 };
    let mut rng = rng();
    let samples: Vec<Action> = (0..20_000).map(|_| cluster.sample(&mut rng)).collect();
    for axis in 0..2 {
        let values = || samples.iter().map(|sample| f64::from(sample[axis]));
        let mean = values().sum::<f64>() / 20_000.0;
        let std = (values().map(|value| (value - mean).powi(2)).sum::<f64>() / 20_000.0).sqrt();
        let (expected_mean, expected_std) = (f64::from(cluster.mean[axis]), f64::from(cluster.std[axis]));
        assert!((mean - expected_mean).abs() < 0.03 * expected_std, "{mean}");
        assert!((std / expected_std - 1.0).abs() < 0.02, "{std}");
    }
    // Samples beyond the screen are clipped.
    let wide = Cluster { mean: [0.9, 0.0], std: [1.0, 1.0], ..cluster };
    // Samples use the normal numbers as drawn, so that they stay the same for a seed.
    let mut normals = rng.clone();
    let [x, y] = std::array::from_fn(|_| rand::Rng::sample::<f32, _>(&mut normals, rand_distr::StandardNormal));
    assert_eq!(cluster.sample(&mut rng), [0.1 + 0.05 * x, -0.2 + 0.2 * y]);
    let clipped: Vec<Action> = (0..200).map(|_| wide.sample(&mut rng)).collect();
    assert!(clipped.iter().flatten().all(|value| value.abs() <= 1.0) && clipped.iter().any(|[x, _]| *x == 1.0));
}

#[test]
fn clusters_are_drawn_by_their_weights() {
    let cluster = |x: f32, weight| Cluster { mean: [x, 0.0], std: [0.01; 2], weight, count: 1 };
    let stage =
        StagePrior { clusters: vec![cluster(-0.5, 0.7), cluster(0.0, 0.2), cluster(0.5, 0.1)], ..Default::default() };
    let task = task::load("task1").unwrap();
    let mut prior = ActionPrior::uniform(&task, &GuidanceConfig::default(), 0);
    prior.stages[1] = stage;
    let mut rng = rng();
    let mut drawn = [0; 3];
    for _ in 0..10_000 {
        let [x, _] = prior.sample(1, &mut rng);
        drawn[((x + 0.5) * 2.0).round() as usize] += 1;
    }
    for (drawn, expected) in drawn.into_iter().zip([7000, 2000, 1000]) {
        assert!(i32::abs(drawn - expected) < 150, "{drawn} of {expected}");
    }
    // A stage without clusters is explored uniformly.
    let spread = (0..2000).filter(|_| prior.sample(0, &mut rng).iter().all(|value| *value < 0.0)).count();
    assert!((400..600).contains(&spread), "{spread}");
}

/// A model in which every sequence reaches the stage, the later the larger the first action's x.
#[derive(Debug)]
struct SoonerOnTheLeft;

impl RolloutModel for SoonerOnTheLeft {
    fn rollouts(&self, _: &[&Snapshot], sequences: &[Vec<Action>], _: &Stop) -> Result<Vec<Rollout>> {
        let roll_out = |sequence: &Vec<Action>| {
            let points = (20.0 * (2.0 + sequence[0][0])) as usize;
            Rollout { path: vec![[0.0; 2]; points], hit: true, ..Rollout::default() }
        };
        Ok(sequences.iter().map(roll_out).collect())
    }
}

/// A model in which one sequence of a batch reaches the stage.
#[derive(Debug)]
struct OneInABatch;

impl RolloutModel for OneInABatch {
    fn rollouts(&self, _: &[&Snapshot], sequences: &[Vec<Action>], _: &Stop) -> Result<Vec<Rollout>> {
        let roll_out = |index: usize| Rollout { hit: index == 0, ..Rollout::default() };
        Ok((0..sequences.len()).map(roll_out).collect())
    }
}

#[test]
fn more_rollouts_are_made_if_few_reach_a_stage() {
    let task = Arc::new(Task { subgoals: Vec::new(), ..task::load("task1").unwrap() });
    for (least_hits, most_model_rollouts, expected) in
        [(0, 1000, (50, 1)), (1, 1000, (50, 1)), (3, 1000, (150, 3)), (3, 60, (100, 2)), (3, 1, (50, 1))]
    {
        let config = GuidanceConfig { model_rollouts: 50, least_hits, most_model_rollouts, ..Default::default() };
        let prior = build(&task, &OneInABatch, &config, 0, &Stop::default(), |_| ()).unwrap();
        let stage = &prior.stages[0];
        assert_eq!((stage.model_rollouts, stage.model_hits), expected, "{least_hits} {most_model_rollouts}");
    }
}

/// A model in which the stage is reached by sequences of at least so many actions.
#[derive(Debug)]
struct Slow(usize);

impl RolloutModel for Slow {
    fn rollouts(&self, _: &[&Snapshot], sequences: &[Vec<Action>], _: &Stop) -> Result<Vec<Rollout>> {
        let roll_out = |sequence: &Vec<Action>| Rollout { hit: sequence.len() >= self.0, ..Rollout::default() };
        Ok(sequences.iter().map(roll_out).collect())
    }
}

#[test]
fn rollouts_become_longer_while_none_reaches_a_stage() {
    let mut task = Task { subgoals: Vec::new(), ..task::load("task1").unwrap() };
    task.rules.max_actions = 20;
    let task = Arc::new(task);
    for (needed, longest_horizon, (horizon, rollouts, hits)) in [
        (8, 32, (8, 50, 50)),
        (9, 32, (16, 150, 50)),
        (20, 32, (20, 250, 50)),
        (21, 32, (20, 300, 0)),
        (16, 12, (12, 200, 0)),
        (9, 8, (8, 100, 0)),
    ] {
        let config =
            GuidanceConfig { model_rollouts: 50, most_model_rollouts: 100, longest_horizon, ..Default::default() };
        let prior = build(&task, &Slow(needed), &config, 0, &Stop::default(), |_| ()).unwrap();
        let stage = &prior.stages[0];
        let found = (prior.horizon(0), stage.model_rollouts, stage.model_hits);
        assert_eq!(found, (horizon, rollouts, hits), "{needed} {longest_horizon}");
    }
}

#[test]
fn the_plan_that_hits_soonest_is_taken() {
    let task = Arc::new(task::load("task1").unwrap());
    let env = Environment::new(task.clone());
    let config = PlannerConfig { iterations: 1, ..PlannerConfig::default() };
    let ([x, _], _) = plan(&SoonerOnTheLeft, env.snapshot(), &config, &Stop::default(), &mut rng()).unwrap();
    assert!(x < -0.8, "{x}");
}

#[test]
fn any_hit_is_better_than_the_nearest_miss() {
    /// Actions on the left narrowly miss; those on the right hit late.
    #[derive(Debug)]
    struct HitsOnTheRight;
    impl RolloutModel for HitsOnTheRight {
        fn rollouts(&self, starts: &[&Snapshot], sequences: &[Vec<Action>], _: &Stop) -> Result<Vec<Rollout>> {
            let target = starts[0].task.stages()[starts[0].stage()].position;
            let roll_out = |sequence: &Vec<Action>| match sequence[0][0] > 0.5 {
                true => Rollout { path: vec![[0.0; 2]; 64], hit: true, ..Rollout::default() },
                false => Rollout { path: vec![target], hit: false, ..Rollout::default() },
            };
            Ok(sequences.iter().map(roll_out).collect())
        }
    }
    let task = Arc::new(task::load("task1").unwrap());
    let env = Environment::new(task.clone());
    let ([x, _], _) =
        plan(&HitsOnTheRight, env.snapshot(), &PlannerConfig::default(), &Stop::default(), &mut rng()).unwrap();
    assert!(x > 0.5, "{x}");
}

#[test]
fn a_model_without_the_task_s_tools_is_an_error() {
    let task = Arc::new(task::load("task1").unwrap());
    let model = mge_dynamics::shipped("square-floor").unwrap();
    let config = GuidanceConfig::default();
    let error = build(&task, &*model, &config, 0, &Stop::default(), |_| ()).unwrap_err();
    assert!(matches!(error, DynamicsError::UnseenEdge { .. }), "{error}");
    assert!(choose_subgoals(&task, &*model, 1, &config, 0, &Stop::default(), |_| ()).is_err());
    let env = Environment::new(task.clone());
    assert!(plan(&*model, env.snapshot(), &PlannerConfig::default(), &Stop::default(), &mut rng()).is_err());
}

#[test]
fn a_prior_round_trips_and_is_accepted_only_for_its_task() {
    let task = task::load("task1").unwrap();
    let mut prior = ActionPrior::uniform(&task, &GuidanceConfig::default(), 7);
    prior = prior.with_actions(0, &[[0.1, 0.2], [0.15, 0.2], [-0.7, 0.5]], &rng()).unwrap();
    let text = prior.to_json();
    assert_eq!(ActionPrior::parse(&text, "prior.json", &task).unwrap(), prior);
    let refused = |text: &str, task: &Task| ActionPrior::parse(text, "prior.json", task).unwrap_err().to_string();
    let changed = |from: &str, to: &str| {
        assert!(text.contains(from), "{text}");
        refused(&text.replacen(from, to, 1), &task)
    };
    let error = changed("\"version\": 1", "\"version\": 2");
    assert!(error.starts_with("prior.json: ") && error.contains("version 2"), "{error}");
    assert!(refused(&text, &task::load("task2").unwrap()).contains("for task1 with 2 stages, not for task2 with 3"));
    let renamed = Task { name: "another".to_owned(), ..task.clone() };
    assert!(refused(&text, &renamed).contains("for task1 with 2 stages, not for another with 2"));
    let fewer = Task { subgoals: Vec::new(), ..task.clone() };
    assert!(refused(&text, &fewer).contains("not for task1 with 1"));
    let error = changed("0.02", "-0.02");
    assert!(error.contains("std_floor"), "{error}");
    assert!(
        changed("\"actions\": [\n        [\n          0.1", "\"actions\": [\n        [\n          1.5")
            .contains("of stage 1 are out of range")
    );
    for (from, to) in [
        (r#""mean": ["#, r#""mean": [1.5, "#),
        (r#""std": ["#, r#""std": [1.5, "#),
        (r#""weight": 0."#, r#""weight": 1."#),
    ] {
        let at = text.find(from).unwrap();
        let (head, tail) = text.split_at(at);
        // Replaces the first number of the list.
        let tail = match to.strip_suffix(", ") {
            Some(list) => format!("{list}{}", &tail[tail.find(',').unwrap()..]),
            None => tail.replacen(from, to, 1),
        };
        let error = refused(&format!("{head}{tail}"), &task);
        assert!(error.contains("of stage 1 are out of range"), "{to}: {error}");
    }
    assert!(refused(&text[..text.len() / 2], &task).starts_with("not an action prior: prior.json:"));
    assert!(refused("{\"version\": 9, \"clusters\": []}", &task).contains("version 9"));
    assert!(refused("[]", &task).contains("not an action prior"));
}

#[test]
fn a_plan_converges_to_the_best_action() {
    let task = Arc::new(task::load("task1").unwrap());
    let env = Environment::new(task.clone());
    let distance = |iterations: usize| {
        let config = PlannerConfig { iterations, ..PlannerConfig::default() };
        let ([x, y], _) = plan(&Bullseye([0.3, -0.6]), env.snapshot(), &config, &Stop::default(), &mut rng()).unwrap();
        (x - 0.3).hypot(y + 0.6)
    };
    let (shooting, entropy) = (distance(1), distance(4));
    assert!(entropy < 0.05 && entropy < shooting && shooting < 0.4, "{entropy} {shooting}");
}

#[test]
fn planner_settings_are_checked() {
    for (config, field) in [
        (PlannerConfig { rollouts: 0, ..PlannerConfig::default() }, "rollouts"),
        (PlannerConfig { elites: 65, ..PlannerConfig::default() }, "elites"),
        (PlannerConfig { std_floor: f32::NAN, ..PlannerConfig::default() }, "std_floor"),
    ] {
        assert!(config.validate().unwrap_err().to_string().starts_with(field));
    }
    PlannerConfig::default().validate().unwrap();
}

#[test]
fn only_tools_that_the_ball_touched_are_rewarding() {
    let outcome = |placement, touched: &[usize]| Step {
        observation: Vec::new(),
        reward: 0.0,
        terminated: false,
        truncated: false,
        end: None,
        placement,
        subgoals: Vec::new(),
        goal: false,
        touched: touched.to_vec(),
    };
    // One tool is already present; the second of four actions is blocked.
    let mut played = Played::after(1);
    played.note([0.1, 0.0], &outcome(Placement::Placed, &[]));
    played.note([0.2, 0.0], &outcome(Placement::Overlap, &[0]));
    played.note([0.3, 0.0], &outcome(Placement::Placed, &[1]));
    played.note([0.4, 0.0], &outcome(Placement::Placed, &[]));
    for (which, expected) in [
        (Rewarding::Touched, vec![[0.1, 0.0]]),
        (Rewarding::Placed, vec![[0.1, 0.0], [0.3, 0.0], [0.4, 0.0]]),
        (Rewarding::Last, vec![[0.4, 0.0]]),
        (Rewarding::All, vec![[0.1, 0.0], [0.2, 0.0], [0.3, 0.0], [0.4, 0.0]]),
    ] {
        assert_eq!(played.clone().take_rewarding(which), expected, "{which:?}");
    }
    // After a stage, touches of earlier tools no longer count for any action.
    played.take_rewarding(Rewarding::Touched);
    played.note([0.5, 0.0], &outcome(Placement::Placed, &[1]));
    assert!(played.clone().take_rewarding(Rewarding::Touched).is_empty(), "an earlier tool was touched");
    played.note([0.6, 0.0], &outcome(Placement::Placed, &[4]));
    assert_eq!(played.take_rewarding(Rewarding::Touched), [[0.5, 0.0]]);
}

/// The true physics; records the stage and the number of actions of each rollout's start state.
#[derive(Debug, Default)]
struct Observed(std::sync::Mutex<Vec<(usize, u32)>>);

impl RolloutModel for Observed {
    fn rollouts(&self, starts: &[&Snapshot], sequences: &[Vec<Action>], stop: &Stop) -> Result<Vec<Rollout>> {
        self.0.lock().unwrap().extend(starts.iter().map(|start| (start.stage(), start.actions)));
        TruePhysics.rollouts(starts, sequences, stop)
    }
}

#[test]
fn a_stage_is_explored_from_where_the_previous_one_was_reached() {
    let task = Arc::new(task::load("task3").unwrap());
    let stages = |start_states| {
        let config =
            GuidanceConfig { start_states, model_rollouts: 200, environment_rollouts: 40, ..GuidanceConfig::default() };
        let model = Observed::default();
        build(&task, &model, &config, 1, &Stop::default(), |_| ()).unwrap();
        model.0.into_inner().unwrap()
    };
    let reached = stages(StartStates::Reached);
    assert!(reached[..200].iter().all(|start| *start == (0, 0)) && reached[200..].iter().all(|(stage, _)| *stage == 1));
    let horizon = GuidanceConfig::default().horizon as u32;
    assert!(reached[200..].iter().any(|(_, actions)| *actions < horizon), "the episode continues at once");
    let last: Vec<usize> = stages(StartStates::Last)[200..].iter().map(|(stage, _)| *stage).collect();
    assert!(last.contains(&0) && last.contains(&1), "also from where it was not reached");
}

#[test]
fn a_prior_records_the_numbers_of_rollouts_and_hits() {
    let task = Arc::new(task::load("task3").unwrap());
    let config = GuidanceConfig {
        model_rollouts: 200,
        least_hits: 0,
        environment_rollouts: 40,
        rewarding: Rewarding::Last,
        ..GuidanceConfig::default()
    };
    let mut asked = Vec::new();
    let progress = |stage| asked.push(stage);
    let prior = build(&task, &TruePhysics, &config, 1, &Stop::default(), progress).unwrap();
    assert_eq!(asked, [0, 1]);
    let [first, last] = &prior.stages[..] else { panic!("two stages") };
    for stage in [first, last] {
        assert_eq!(stage.model_rollouts, 200);
        assert_eq!(stage.clusters.iter().map(|cluster| cluster.count).sum::<usize>(), stage.actions.len());
    }
    // Each hit gives its last action, if any was placed.
    assert!(first.model_hits > 0 && first.model_hits < 200);
    assert!(!first.actions.is_empty() && first.actions.len() <= first.model_hits);
    assert_eq!((first.environment_rollouts, last.environment_rollouts), (40, 0));
    assert!(first.environment_hits > 0 && first.environment_hits <= 40 && last.environment_hits == 0);
}

#[test]
fn true_rollouts_hit_exactly_when_the_next_stage_is_reached() {
    let mut task = task::load("task1").unwrap();
    task.subgoals.clear();
    let [x, y] = task.ball.position;
    let roll_out = |goal: [f32; 2]| {
        let task = Arc::new(Task { goal: task::Goal { position: goal, ..task.goal }, ..task.clone() });
        let env = Environment::new(task.clone());
        let sequence = vec![vec![[-0.95, 0.95], [0.95, 0.95]]];
        let rollouts = TruePhysics.rollouts(&[env.snapshot()], &sequence, &Stop::default()).unwrap();
        (rollouts.into_iter().next().unwrap(), task)
    };
    // The ball falls into the lower goal and cannot reach the upper one.
    let (below, task) = roll_out([x, y - 0.3]);
    assert!(below.hit && below.balls.len() == below.actions.len());
    assert_eq!(below.path[0], physics::to_normalised(physics::to_units(task.ball.position)));
    assert!(!roll_out([0.9, 0.9]).0.hit);
}

#[test]
fn true_physics_guides_better_than_chance() {
    let task = Arc::new(task::load("task3").unwrap());
    let config = GuidanceConfig { model_rollouts: 300, environment_rollouts: 40, ..GuidanceConfig::default() };
    let prior = build(&task, &TruePhysics, &config, 1, &Stop::default(), |_| ()).unwrap();
    let reached = |prior: &ActionPrior| {
        let (mut rng, mut env) = (rng(), Environment::new(task.clone()));
        let episode = |_: u32| {
            env.reset(&mut rng);
            while env.snapshot().stage() == 0 && env.step(prior.sample(0, &mut rng)).is_ok_and(|s| s.end.is_none()) {}
            u32::from(env.snapshot().stage() > 0)
        };
        (0..100).map(episode).sum::<u32>()
    };
    let (guided, random) = (reached(&prior), reached(&ActionPrior::uniform(&task, &GuidanceConfig::default(), 1)));
    assert!(guided > 50 && random < 30, "{guided} {random}");
}

#[test]
fn rollouts_and_what_uses_them_can_be_stopped() {
    let task = Arc::new(task::load("task1").unwrap());
    let learned = mge_dynamics::shipped_for(&task.tool_set()).unwrap();
    let (env, config, stop) = (Environment::new(task.clone()), GuidanceConfig::default(), Stop::default());
    stop.request();
    for model in [&*learned as &dyn RolloutModel, &TruePhysics, &RapierPhysics] {
        let stopped = model.rollouts(&[env.snapshot()], &[vec![[0.0; 2]]], &stop);
        assert!(matches!(stopped, Err(DynamicsError::Stopped(_))), "{model:?}");
        assert!(matches!(build(&task, model, &config, 0, &stop, |_| ()), Err(DynamicsError::Stopped(_))));
        let plan = plan(model, env.snapshot(), &PlannerConfig::default(), &stop, &mut rng());
        assert!(matches!(plan, Err(DynamicsError::Stopped(_))));
        let chosen = choose_subgoals(&task, model, 1, &config, 0, &stop, |_| ());
        assert!(matches!(chosen, Err(DynamicsError::Stopped(_))));
    }
}
