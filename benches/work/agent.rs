//! DDPG with the shapes of the tasks.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use mge_agent::{Batch, Ddpg, DdpgConfig, Learner, LearnerStreams, Transition};

const OBSERVATION: usize = 160;
const ACTION: usize = 2;

pub fn update() -> Box<dyn FnMut()> {
    let config = DdpgConfig::default();
    // The default configuration is valid.
    let mut ddpg = Ddpg::new(OBSERVATION, ACTION, &config, &mut rng()).expect("the default is valid");
    let mut batch = Batch::default();
    for _ in 0..config.batch_size {
        let mut numbers = rng();
        let mut random = |count: usize| (0..count).map(|_| numbers.gen_range(-1.0..1.0)).collect::<Vec<f32>>();
        batch.push(Transition {
            observation: &random(OBSERVATION),
            action: &random(ACTION),
            reward: 0.5,
            next_observation: &random(OBSERVATION),
            terminated: false,
        });
    }
    Box::new(move || {
        // Bounded data and a clamped target keep the loss finite.
        ddpg.update(&batch).expect("the loss is finite");
    })
}

pub fn environment_step() -> Box<dyn FnMut()> {
    let config = DdpgConfig { warmup_steps: 0, ..DdpgConfig::default() };
    let streams = LearnerStreams { noise: rng(), replay: rng() };
    // The default configuration is valid.
    let mut learner = Learner::new(OBSERVATION, ACTION, &config, &mut rng(), streams).expect("the default is valid");
    let (observation, next_observation) = ([0.1; OBSERVATION], [0.2; OBSERVATION]);
    Box::new(move || {
        let action = learner.explore(&observation);
        let transition = Transition {
            observation: &observation,
            action: &action,
            reward: 0.0,
            next_observation: &next_observation,
            terminated: false,
        };
        // Lengths fit, and bounded data with a clamped target keep the loss finite.
        learner.record(transition).expect("lengths fit");
        learner.update(learner.ddpg.config().updates_per_step).expect("the loss is finite");
    })
}

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(0)
}
