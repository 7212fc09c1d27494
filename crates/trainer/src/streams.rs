//! The random streams that a run saves, one per purpose.

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use mge_agent as agent;
use mge_base::streams::Stream;

/// The random streams of a run except those of the learner, which has its own two.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Streams {
    /// [`Stream::TrainingStart`].
    pub environment: ChaCha8Rng,
    /// [`Stream::Guidance`].
    pub guidance: ChaCha8Rng,
    /// [`Stream::Evaluation`].
    pub evaluation: ChaCha8Rng,
    /// [`Stream::ModelRollouts`]. May be missing in checkpoints of runs that do not use it.
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

/// The learner's streams of a master seed.
pub(super) fn learner(seed: u64) -> agent::LearnerStreams {
    agent::LearnerStreams { noise: Stream::ExplorationNoise.of(seed), replay: Stream::Minibatch.of(seed) }
}
