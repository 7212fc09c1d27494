//! Times of the agent's work on one core: `cargo bench --bench agent`.
//!
//! Shapes as in the comparison with other libraries: observation 160, action 2, three linear
//! layers with hidden size 64, batch 128, Adam.

use divan::Bencher;
use mge::agent::{Batch, Ddpg, DdpgConfig, Learner, ReplayBuffer, Streams, Transition};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const OBSERVATION: usize = 160;
const ACTION: usize = 2;

fn main() {
    divan::main();
}

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(0)
}

fn random<const N: usize>(rng: &mut ChaCha8Rng) -> [f32; N] {
    std::array::from_fn(|_| rng.gen_range(-1.0..1.0))
}

fn replay(count: usize) -> ReplayBuffer {
    let (mut rng, mut replay) = (rng(), ReplayBuffer::new(OBSERVATION, ACTION, count));
    for _ in 0..count {
        let transition = Transition {
            observation: &random::<OBSERVATION>(&mut rng),
            action: &random::<ACTION>(&mut rng),
            reward: rng.r#gen(),
            next_observation: &random::<OBSERVATION>(&mut rng),
            terminated: false,
        };
        replay.push(transition).expect("lengths fit");
    }
    replay
}

/// One critic step, one actor step, soft target updates.
#[divan::bench]
fn ddpg_update(bencher: Bencher) {
    let mut ddpg = Ddpg::new(OBSERVATION, ACTION, &DdpgConfig::default(), &mut rng()).expect("valid");
    let mut batch = Batch::default();
    replay(1000).sample(128, &mut rng(), &mut batch);
    bencher.bench_local(|| ddpg.update(&batch).expect("finite"));
}

/// One step of the whole loop on an environment that costs nothing: act, noise, store, sample,
/// update.
#[divan::bench]
fn ddpg_env_step(bencher: Bencher) {
    let config = DdpgConfig { warmup_steps: 0, ..DdpgConfig::default() };
    let streams = Streams { noise: rng(), replay: rng() };
    let mut learner = Learner::new(OBSERVATION, ACTION, &config, &mut rng(), streams).expect("valid");
    let (observation, next_observation) = ([0.1; OBSERVATION], [0.2; OBSERVATION]);
    bencher.bench_local(|| {
        let action = learner.explore(&observation);
        let transition = Transition {
            observation: &observation,
            action: &action,
            reward: 0.0,
            next_observation: &next_observation,
            terminated: false,
        };
        learner.record(transition).expect("lengths fit");
        learner.learn().expect("finite")
    });
}

/// A greedy action for one observation.
#[divan::bench]
fn act(bencher: Bencher) {
    let ddpg = Ddpg::new(OBSERVATION, ACTION, &DdpgConfig::default(), &mut rng()).expect("valid");
    bencher.bench_local(|| ddpg.act(divan::black_box(&[0.1; OBSERVATION])));
}

/// A minibatch of 128 from a full buffer.
#[divan::bench]
fn replay_sample(bencher: Bencher) {
    let (replay, mut rng, mut batch) = (replay(100_000), rng(), Batch::default());
    bencher.bench_local(|| replay.sample(128, &mut rng, &mut batch));
}
