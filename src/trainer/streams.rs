//! One master seed, one random stream for each purpose.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::agent;

/// The random streams of a run outside of the learner, which keeps its own two. Each
/// purpose draws from its own, so that, for example, an evaluation more or less leaves
/// the training as it was.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Streams {
    /// Start noise of training episodes.
    pub environment: ChaCha8Rng,
    /// Epsilon, and actions from the clusters.
    pub guidance: ChaCha8Rng,
    /// Start noise of evaluation episodes.
    pub evaluation: ChaCha8Rng,
    /// Plans, imagined rollouts and refined clusters. Checkpoints of runs without them
    /// may lack it.
    #[serde(default = "unused")]
    pub model: ChaCha8Rng,
}

fn unused() -> ChaCha8Rng {
    stream(0, 7)
}

impl Streams {
    /// The streams of a master seed.
    pub fn new(seed: u64) -> Self {
        Self {
            environment: stream(seed, 1),
            guidance: stream(seed, 2),
            evaluation: stream(seed, 3),
            model: stream(seed, 7),
        }
    }
}

/// The stream of a master seed that draws initial weights.
pub fn initialisation(seed: u64) -> ChaCha8Rng {
    stream(seed, 4)
}

/// The streams of a master seed that the learner keeps.
pub fn learner(seed: u64) -> agent::Streams {
    agent::Streams { noise: stream(seed, 5), replay: stream(seed, 6) }
}

fn stream(seed: u64, purpose: u64) -> ChaCha8Rng {
    // Guidance numbers its streams from 0; those of training must differ.
    const TRAINING: u64 = 1 << 32;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(TRAINING + purpose);
    rng
}
