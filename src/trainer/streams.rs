//! The random streams that a run keeps and saves, one a purpose.

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::agent;
use crate::streams::Stream;

/// The random streams of a run outside of the learner, which keeps its own two.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Streams {
    /// [`Stream::TrainingStart`].
    pub environment: ChaCha8Rng,
    /// [`Stream::Guidance`].
    pub guidance: ChaCha8Rng,
    /// [`Stream::Evaluation`].
    pub evaluation: ChaCha8Rng,
    /// [`Stream::ModelRollouts`]. Checkpoints of runs without them may lack it.
    #[serde(default = "unused")]
    pub model: ChaCha8Rng,
}

fn unused() -> ChaCha8Rng {
    Stream::ModelRollouts.of(0)
}

impl Streams {
    /// The streams of a master seed.
    pub fn new(seed: u64) -> Self {
        Self {
            environment: Stream::TrainingStart.of(seed),
            guidance: Stream::Guidance.of(seed),
            evaluation: Stream::Evaluation.of(seed),
            model: Stream::ModelRollouts.of(seed),
        }
    }
}

/// The streams of a master seed that the learner keeps.
pub(super) fn learner(seed: u64) -> agent::Streams {
    agent::Streams { noise: Stream::ExplorationNoise.of(seed), replay: Stream::Minibatch.of(seed) }
}
