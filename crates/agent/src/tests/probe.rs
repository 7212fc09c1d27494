//! Probe environments in which only one thing can go wrong, and a small task with a known
//! optimum. The name of a failing probe tells which part of the algorithm is broken.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{Batch, Ddpg, DdpgConfig, Learner, LearnerStreams, OuConfig, Transition, UpdateMetrics};

fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Fast settings for problems of one or two numbers.
fn config() -> DdpgConfig {
    DdpgConfig {
        hidden: 32,
        actor_learning_rate: 1e-3,
        critic_learning_rate: 3e-3,
        batch_size: 64,
        gamma: 0.9,
        tau: 0.02,
        target_clamp: None,
        warmup_steps: 0,
        ..DdpgConfig::default()
    }
}

/// Appends experience of a probe to a batch, with actions drawn uniformly from [-1, 1].
type Probe = fn(&mut ChaCha8Rng, &mut Batch);

fn push(batch: &mut Batch, s: f32, a: f32, r: f32, next_s: f32, terminated: bool) {
    batch.push(Transition { observation: &[s], action: &[a], reward: r, next_observation: &[next_s], terminated });
}

/// An agent after `updates` updates on fresh experience of the probe.
fn trained(config: &DdpgConfig, updates: usize, probe: Probe) -> (Ddpg, UpdateMetrics) {
    let (mut ddpg, mut rng) = (Ddpg::new(1, 1, config, &mut rng(1)).unwrap(), rng(2));
    let (mut batch, mut metrics) = (Batch::default(), UpdateMetrics::default());
    for _ in 0..updates {
        batch.clear();
        while batch.len() < config.batch_size {
            probe(&mut rng, &mut batch);
        }
        metrics = ddpg.update(&batch).unwrap();
    }
    (ddpg, metrics)
}

fn assert_near(found: f32, expected: f32, tolerance: f32) {
    assert!((found - expected).abs() < tolerance, "{found}, expected {expected} ± {tolerance}");
}

fn any_action(rng: &mut ChaCha8Rng) -> f32 {
    rng.gen_range(-1.0..1.0)
}

#[test]
fn value_only() {
    let (ddpg, metrics) = trained(&config(), 300, |rng, batch| {
        push(batch, 0.0, any_action(rng), 1.0, 0.0, true);
    });
    let values = ddpg.q_values(&[0.0], &[-1.0, 0.0, 1.0]);
    values.iter().for_each(|&q| assert_near(q, 1.0, 0.05));
    assert_near(metrics.mean_q, 1.0, 0.05);
    assert_near(metrics.max_q, 1.0, 0.1);
    assert!(metrics.critic_loss < 1e-3, "{metrics:?}");
}

#[test]
fn observation_to_value() {
    let (ddpg, _) = trained(&config(), 300, |rng, batch| {
        let s = if rng.r#gen() { 1.0 } else { -1.0 };
        push(batch, s, any_action(rng), s, s, true);
    });
    for s in [-1.0, 1.0] {
        ddpg.q_values(&[s], &[-1.0, 0.0, 1.0]).iter().for_each(|&q| assert_near(q, s, 0.1));
    }
}

#[test]
fn discount() {
    // Two steps: nothing is earned in the first, 1 in the second.
    let (ddpg, _) = trained(&config(), 1000, |rng, batch| {
        push(batch, 0.0, any_action(rng), 0.0, 1.0, false);
        push(batch, 1.0, any_action(rng), 1.0, 0.0, true);
    });
    assert_near(ddpg.q_values(&[0.0], &[0.0])[0], 0.9, 0.05);
    assert_near(ddpg.q_values(&[1.0], &[0.0])[0], 1.0, 0.05);
}

#[test]
fn action_to_reward() {
    let (ddpg, metrics) = trained(&config(), 1500, |rng, batch| {
        let a = any_action(rng);
        push(batch, 0.0, a, -(a - 0.5).powi(2), 0.0, true);
    });
    assert_near(ddpg.act(&[0.0])[0], 0.5, 0.1);
    assert_near(metrics.actor_loss, 0.0, 0.05);
    assert_eq!(metrics.action_saturation, 0.0);
}

#[test]
fn observation_to_action() {
    let (ddpg, _) = trained(&config(), 2000, |rng, batch| {
        let (s, a) = (rng.gen_range(-1.0..1.0), any_action(rng));
        push(batch, s, a, -(a - 0.6 * s).powi(2), 0.0, true);
    });
    let actions = ddpg.act(&[-1.0, -0.5, 0.0, 0.5, 1.0]);
    for (a, expected) in actions.into_iter().zip([-0.6, -0.3, 0.0, 0.3, 0.6]) {
        assert_near(a, expected, 0.1);
    }
}

#[test]
fn saturation_is_reported() {
    let (ddpg, metrics) = trained(&config(), 1000, |rng, batch| {
        let a = any_action(rng);
        push(batch, 0.0, a, a, 0.0, true);
    });
    assert!(ddpg.act(&[0.0])[0] > 0.99);
    assert_eq!(metrics.action_saturation, 1.0);
}

#[test]
fn truncation_bootstraps_and_termination_does_not() {
    let config = DdpgConfig { gamma: 0.5, ..config() };
    // The same experience of one-step episodes: if truncated, the value is that of continuing
    // forever, 1 / (1 - γ).
    let (truncated, _) = trained(&config, 1000, |rng, batch| {
        push(batch, 0.0, any_action(rng), 1.0, 0.0, false);
    });
    let (terminated, _) = trained(&config, 1000, |rng, batch| {
        push(batch, 0.0, any_action(rng), 1.0, 0.0, true);
    });
    assert_near(truncated.q_values(&[0.0], &[0.0])[0], 2.0, 0.1);
    assert_near(terminated.q_values(&[0.0], &[0.0])[0], 1.0, 0.05);
}

#[test]
fn targets_are_clamped() {
    let config = DdpgConfig { gamma: 0.5, target_clamp: Some([-1.0, 1.5]), ..config() };
    let (ddpg, _) = trained(&config, 1000, |rng, batch| {
        push(batch, 0.0, any_action(rng), 1.0, 0.0, false);
    });
    assert_near(ddpg.q_values(&[0.0], &[0.0])[0], 1.5, 0.05);
}

/// Pushes the ball `x` by up to half a unit per step; each step costs the squared position. Returns the
/// new position and the reward. The best push is `clip(-2 x, -1, 1)`; from |x| up to 1 its total cost
/// is `max(|x| - 0.5, 0)²`.
fn push_to_the_middle(x: f32, a: f32) -> (f32, f32) {
    let next_x = x + 0.5 * a;
    (next_x, -next_x.powi(2))
}

#[test]
fn a_small_task_is_solved_close_to_its_optimum() {
    let config =
        DdpgConfig { warmup_steps: 200, tau: 0.01, actor_learning_rate: 3e-4, critic_learning_rate: 1e-3, ..config() };
    let streams = LearnerStreams { noise: rng(4), replay: rng(5) };
    let mut learner = Learner::new(1, 1, &config, &mut rng(3), streams).unwrap();
    let mut starts = rng(6);
    let regret = |learner: &Learner| {
        let mut regret = 0.0;
        for start in -10..=10 {
            let mut x = start as f32 / 10.0;
            regret -= (x.abs() - 0.5).max(0.0).powi(2);
            for _ in 0..10 {
                let (next_x, reward) = push_to_the_middle(x, learner.ddpg.act(&[x])[0]);
                (x, regret) = (next_x, regret - reward);
            }
        }
        regret / 21.0
    };
    let before = regret(&learner);
    for _ in 0..600 {
        learner.start_episode();
        let mut x: f32 = starts.gen_range(-1.0..1.0);
        for _ in 0..10 {
            let action = learner.explore(&[x]);
            let (next_x, reward) = push_to_the_middle(x, action[0]);
            let transition = Transition {
                observation: &[x],
                action: &action,
                reward,
                next_observation: &[next_x],
                // The tenth step ends at a time limit, which is not a termination.
                terminated: false,
            };
            learner.record(transition).unwrap();
            learner.update(learner.ddpg.config().updates_per_step).unwrap();
            x = next_x;
        }
    }
    let after = regret(&learner);
    assert!(before > 1.0, "an untrained agent should do badly: {before}");
    assert!(after < 0.03, "regret {after}");
}

#[test]
fn noise_follows_the_config() {
    let config = DdpgConfig { ou: OuConfig { theta: 1.0, mu: 0.3, sigma: 0.0 }, ..config() };
    let streams = LearnerStreams { noise: rng(4), replay: rng(5) };
    let mut learner = Learner::new(1, 1, &config, &mut rng(3), streams).unwrap();
    let greedy = learner.ddpg.act(&[0.5])[0];
    assert_eq!(learner.explore(&[0.5]), [(greedy + 0.3).clamp(-1.0, 1.0)]);
}
