//! Clusters of known points, plans with a known best, and who gets the credit.

use std::sync::Arc;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::env::{Action, Environment, Placement, Snapshot, Step};
use crate::task::{self, Task};

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(0)
}

/// A model in which only the first action matters: the nearer to `0` it is, the nearer
/// the ball comes to the stage.
#[derive(Debug)]
struct Bullseye([f32; 2]);

impl RolloutModel for Bullseye {
    fn rollouts(&self, task: &Arc<Task>, starts: &[&Snapshot], sequences: &[Vec<Action>]) -> Vec<Rollout> {
        let roll_out = |(start, sequence): (&&Snapshot, &Vec<Action>)| {
            let [x, y] = task.stages()[start.stage()].position;
            let miss = (sequence[0][0] - self.0[0]).hypot(sequence[0][1] - self.0[1]);
            Rollout { path: vec![[x + 1.0, y], [x + miss, y]], hit: miss < 0.02, ..Rollout::default() }
        };
        starts.iter().zip(sequences).map(roll_out).collect()
    }
}

#[test]
fn two_heaps_become_two_clusters_with_their_means_and_deviations() {
    let heap = |x: f32| [[x - 0.1, 0.0], [x + 0.1, 0.0], [x, 0.2], [x, -0.2]];
    let actions: Vec<Action> = heap(-0.5).into_iter().chain(heap(0.5)).chain([[0.5, 0.0]; 4]).collect();
    for count in [ClusterCount::Fixed(2), ClusterCount::Silhouette(4)] {
        let found = clusters::cluster(&actions, count, 0.02, &rng());
        assert_eq!(found.iter().map(|cluster| cluster.count).collect::<Vec<_>>(), [8, 4], "{count:?}");
        assert_eq!(found.iter().map(|cluster| cluster.mean[0]).collect::<Vec<_>>(), [0.5, -0.5]);
        let expected = [0.02f32 / 4.0, 0.08 / 4.0].map(f32::sqrt);
        found[1].std.iter().zip(expected).for_each(|(std, expected)| assert!((std - expected).abs() < 1e-6));
    }
}

#[test]
fn more_clusters_than_actions_are_as_many_as_there_are_actions() {
    let same = clusters::cluster(&[[0.3, 0.3]; 5], ClusterCount::Fixed(3), 0.02, &rng());
    assert_eq!((same.len(), same[0].std, same[0].weight), (1, [0.02, 0.02], 1.0));
    assert!(clusters::cluster(&[], ClusterCount::Fixed(3), 0.02, &rng()).is_empty());
}

#[test]
fn a_plan_homes_in_on_the_best_action() {
    let task = Arc::new(task::load("task1").unwrap());
    let env = Environment::new(task.clone());
    let distance = |iterations: usize| {
        let config = PlannerConfig { iterations, ..PlannerConfig::default() };
        let [x, y] = plan(&Bullseye([0.3, -0.6]), &task, env.snapshot(), &config, &mut rng());
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
    // One tool is there already; of four actions the second is blocked.
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
    // After a stage the earlier tools belong to none of the next actions.
    played.take_rewarding(Rewarding::Touched);
    played.note([0.5, 0.0], &outcome(Placement::Placed, &[1, 4]));
    assert_eq!(played.take_rewarding(Rewarding::Touched), [[0.5, 0.0]]);
}

#[test]
fn true_physics_guides_better_than_chance() {
    let task = Arc::new(task::load("task3").unwrap());
    let config = GuidanceConfig { model_rollouts: 300, environment_rollouts: 40, ..GuidanceConfig::default() };
    let prior = build(&task, &TruePhysics, "true physics", &config, 1, |_| true).unwrap();
    let reached = |prior: &ActionPrior| {
        let (mut rng, mut env) = (rng(), Environment::new(task.clone()));
        let episode = |_: u32| {
            env.reset(&mut rng);
            while env.snapshot().stage() == 0 && env.step(prior.sample(0, &mut rng)).is_ok_and(|s| s.end.is_none()) {}
            u32::from(env.snapshot().stage() > 0)
        };
        (0..100).map(episode).sum::<u32>()
    };
    let (guided, random) = (reached(&prior), reached(&ActionPrior::uniform(&task, 1)));
    assert!(guided > 50 && random < 30, "{guided} {random}");
}

#[test]
fn proposed_subgoals_lead_to_a_goal_that_chance_does_not_find() {
    let task = task::load("task6").unwrap();
    let config = GuidanceConfig::default();
    let subgoals = propose_subgoals(&task, &TruePhysics, 2, &config, 0, |_| true);
    assert_eq!(subgoals.len(), 2);
    assert_eq!(
        propose_subgoals(&task, &TruePhysics, 2, &config, 0, |_| true),
        subgoals,
        "the same seed, the same proposal"
    );
    let task = Arc::new(Task { subgoals, ..task });
    let prior = build(&task, &TruePhysics, "true physics", &config, 1, |_| true).unwrap();
    let goals = |prior: &ActionPrior| {
        let (mut rng, mut env) = (rng(), Environment::new(task.clone()));
        let episode = |_: u32| {
            env.reset(&mut rng);
            while env.step(prior.sample(env.snapshot().stage(), &mut rng)).is_ok_and(|step| step.end.is_none()) {}
            u32::from(env.snapshot().goal_reached())
        };
        (0..300).map(episode).sum::<u32>()
    };
    let (guided, random) = (goals(&prior), goals(&ActionPrior::uniform(&task, 1)));
    assert!(guided >= 5 && random == 0, "{guided} {random}");
}
