//! Training: imitation of a lookahead in the real scene, in rounds.

use std::sync::Arc;

use dfdx::losses::binary_cross_entropy_with_logits_loss;
use dfdx::prelude::{Backward, Cpu, Trace};
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::decision::Decision;
use super::error::SelectionError;
use super::evaluate::is_over;
use super::flight::Flight;
use super::policy::{Policy, Settings};
use mge_base::streams::{Stream, index};
use mge_env::Environment;
use mge_nn::{InitScheme, Mlp, NnError, Optimiser, OptimiserKind, matrix};
use mge_physics::ToolSplit;
use mge_task::Task;

/// Rounds of episodes, each followed by updates. The first has half of the episodes, which the lookahead plays.
const ROUNDS: usize = 5;
/// Updates after a round, as passes over its samples.
const PASSES: usize = 2;
/// Samples in an update.
const BATCH: usize = 128;
/// Share of samples of an update in which the goal is reached.
const SUCCESSES: f64 = 0.25;
/// Chance that an episode ends once the flight reaches the goal: what follows teaches little.
const FORESEEN: f64 = 0.6;
/// Share of random actions, and learning rate, in the first round; both fall linearly.
const EXPLORATION: f64 = 0.25;
const LEARNING_RATE: f32 = 1e-3;

/// Features of candidates, and what came of them.
#[derive(Default)]
struct Samples {
    rows: Vec<f32>,
    /// Whether the goal is reached, and the improvement, both from 0 to 1.
    targets: Vec<[f32; 2]>,
    /// The samples in which the goal is reached.
    successes: Vec<usize>,
}

struct Training {
    policy: Policy,
    optimiser: Optimiser,
    samples: Samples,
    env: Environment,
    starts: ChaCha8Rng,
    /// Candidates and exploration.
    rng: ChaCha8Rng,
    batches: ChaCha8Rng,
}

/// Trains a policy for a task with tools of the split `train`. `on_progress` is told the number of episodes played.
///
/// # Errors
/// When the training diverges.
pub fn train(
    task: &Arc<Task>,
    settings: Settings,
    mut on_progress: impl FnMut(usize),
) -> Result<Policy, SelectionError> {
    let network = Mlp::new(Policy::shape(task), InitScheme::Orthogonal, &mut Stream::AgentWeights.of(settings.seed))?;
    let mut training = Training {
        optimiser: Optimiser::new(OptimiserKind::Adam, &[&network]),
        policy: Policy::new(network, task, settings),
        samples: Samples::default(),
        env: Environment::new(task.clone()).with_tools(ToolSplit::Train),
        starts: Stream::TrainingStart.of(settings.seed),
        rng: Stream::Candidates.of(settings.seed),
        batches: Stream::Minibatch.of(settings.seed),
    };
    let mut played = 0;
    for round in 0..ROUNDS {
        let left = 1.0 - round as f64 / ROUNDS as f64;
        let before = training.samples.targets.len();
        // The first round has half of the episodes, and the others have equal shares of the rest.
        let share = if round == 0 { 2 } else { ROUNDS - round };
        for _ in 0..(settings.episodes - played).div_ceil(share) {
            training.play(left);
            played += 1;
            on_progress(played);
        }
        for _ in 0..PASSES * (training.samples.targets.len() - before).div_ceil(BATCH) {
            training.update(LEARNING_RATE * left as f32)?;
        }
    }
    Ok(training.policy)
}

impl Training {
    /// Plays an episode and records all candidates. `left` is the share of rounds that are left: 1 in the first.
    fn play(&mut self, left: f64) {
        let Self { policy, samples, env, rng, .. } = self;
        env.reset(&mut self.starts);
        let is_lookahead = rng.gen_bool(left * left);
        while !is_over(env) {
            let decision = Decision::new(env, policy.settings.candidates, rng);
            if decision.flight.goal && rng.gen_bool(FORESEEN) {
                break;
            }
            let foreseen = samples.record(env, &decision);
            let chosen = match rng.gen_bool(EXPLORATION * left) {
                true => index(rng, decision.choices.len()),
                false if is_lookahead => foreseen,
                false => policy.best(&decision.rows),
            };
            // The episode is not over.
            let _ = env.step_without_observation(decision.choices[chosen]);
        }
    }

    /// One update of the network with a batch of samples.
    fn update(&mut self, learning_rate: f32) -> Result<(), NnError> {
        let Self { policy: Policy { network, .. }, optimiser, samples, batches, .. } = self;
        let width = network.shape().inputs();
        let (mut rows, mut targets) = (Vec::with_capacity(BATCH * width), Vec::with_capacity(2 * BATCH));
        for _ in 0..BATCH {
            let sample = match !samples.successes.is_empty() && batches.gen_bool(SUCCESSES) {
                true => samples.successes[index(batches, samples.successes.len())],
                false => index(batches, samples.targets.len()),
            };
            rows.extend_from_slice(&samples.rows[sample * width..][..width]);
            targets.extend(samples.targets[sample]);
        }
        let device = Cpu::default();
        let outputs = network.forward_data(matrix(&device, rows, BATCH, width).leaky_traced());
        let loss = binary_cross_entropy_with_logits_loss(outputs, matrix(&device, targets, BATCH, 2));
        optimiser.update(&mut [network], &mut loss.backward(), learning_rate)?;
        Ok(())
    }
}

impl Samples {
    /// Tries every candidate in the real scene, records what comes of it, and returns the index of the best.
    fn record(&mut self, env: &Environment, decision: &Decision) -> usize {
        let mut best = (0, f32::NEG_INFINITY);
        for (number, choice) in decision.choices.iter().enumerate() {
            let tried = Flight::after(env, *choice);
            let improvement = tried.score() - decision.flight.score();
            if improvement > best.1 {
                best = (number, improvement);
            }
            if tried.goal {
                self.successes.push(self.targets.len());
            }
            // 0.5 is no change.
            self.targets.push([f32::from(tried.goal), 0.5 + 0.5 * improvement / (1.0 + improvement.abs())]);
        }
        self.rows.extend_from_slice(&decision.rows);
        best.0
    }
}
