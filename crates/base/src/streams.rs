//! Random streams: the assignment of a seed's streams to purposes.
//!
//! A seed gives 2^64 independent ChaCha8 streams. Every purpose has its own stream, so that, for example, an
//! additional evaluation does not change the training. The stream numbers determine every recorded result and must
//! not change.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A purpose for which random numbers are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stream {
    /// Start noise of an episode outside training, or the only purpose for which a seed is used.
    Episode,
    /// Start of the episode from which an action prior is built.
    PriorStart,
    /// Rollouts and clusters of a stage of an action prior, from 0.
    PriorStage(usize),
    /// Rollouts for a proposed subgoal. They differ from the rollouts of the subgoal's clusters, so that a proposal
    /// is not evaluated on the rollouts it was derived from.
    Proposal {
        /// Which proposal, from 0.
        attempt: usize,
        /// Number of the subgoal in it, from 1.
        number: usize,
    },
    /// Episodes in which a proposal is tried.
    Trial,
    /// Rollouts of practice.
    Practice,
    /// Start noise of training episodes.
    TrainingStart,
    /// Epsilon, and actions from the clusters.
    Guidance,
    /// Start noise of evaluation episodes.
    Evaluation,
    /// Starts of the episodes that decide whether a checkpoint becomes `best`.
    Judgement,
    /// Initial weights of the agent.
    AgentWeights,
    /// Exploration noise.
    ExplorationNoise,
    /// Minibatches from the replay buffer.
    Minibatch,
    /// Candidates and exploration of an agent that chooses among tools.
    Candidates,
    /// Plans, imagined rollouts and refined clusters.
    ModelRollouts,
    /// A launch for a dynamics model.
    Launch {
        /// Training, validation or test, from 0.
        split: u64,
        /// Index of the tool's type.
        kind: u64,
        /// Number of the launch.
        index: u64,
    },
    /// A generated puzzle.
    Puzzle {
        /// Its split, from 0.
        split: u64,
        /// Its number.
        number: u64,
    },
    /// Initial weights of a dynamics model.
    ModelWeights,
    /// Sample order and random draws of one epoch of a dynamics model, from 0.
    ModelEpoch(u32),
    /// Additional tools in the launch scenes of a dynamics model.
    Bystanders,
    /// Samples of the settings of a sweep.
    SweepSamples,
}

impl Stream {
    /// This purpose's stream of a seed, at its start.
    pub fn of(self, seed: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(self.number());
        rng
    }

    fn number(self) -> u64 {
        const PROPOSALS: u64 = 1 << 16;
        const TRAINING: u64 = 1 << 32;
        const PUZZLES: u64 = 1 << 62;
        const MODEL: u64 = 1 << 63;
        match self {
            Self::Episode | Self::PriorStart => 0,
            Self::PriorStage(stage) => 1 + stage as u64,
            Self::Proposal { attempt, number } => PROPOSALS | (attempt as u64) << 8 | number as u64,
            Self::TrainingStart => TRAINING + 1,
            Self::Guidance => TRAINING + 2,
            Self::Evaluation => TRAINING + 3,
            Self::AgentWeights => TRAINING + 4,
            Self::ExplorationNoise => TRAINING + 5,
            Self::Minibatch => TRAINING + 6,
            Self::ModelRollouts => TRAINING + 7,
            Self::Trial => TRAINING + 8,
            Self::Practice => TRAINING + 9,
            Self::Judgement => TRAINING + 10,
            Self::Candidates => TRAINING + 11,
            Self::SweepSamples => TRAINING + 12,
            // The first launches share stream numbers with an action prior. With equal seeds both draw the same
            // random numbers for different things, which does no harm.
            Self::Launch { split, kind, index } => split << 48 | kind << 40 | index,
            Self::Puzzle { split, number } => PUZZLES | split << 48 | number,
            Self::ModelWeights => MODEL,
            Self::ModelEpoch(epoch) => MODEL | (1 + u64::from(epoch)),
            Self::Bystanders => MODEL | 1 << 40,
        }
    }
}

/// A uniform index below `length`, the same on machines of every word size.
pub fn index(rng: &mut impl Rng, length: usize) -> usize {
    rng.gen_range(0..length as u64) as usize
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn purposes_of_one_training_never_share_a_stream() {
        use Stream::*;
        let single = [
            PriorStart,
            TrainingStart,
            Guidance,
            Evaluation,
            AgentWeights,
            ExplorationNoise,
            Minibatch,
            ModelRollouts,
            Trial,
            Practice,
            Judgement,
            Candidates,
        ];
        let stages = (0..200).flat_map(|n| [PriorStage(n), Proposal { attempt: n / 20, number: n + 1 }]);
        let all: Vec<u64> = single.into_iter().chain(stages).map(Stream::number).collect();
        assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), all.len());
        let launch = |split, kind, index| Launch { split, kind, index };
        let of_model = [
            ModelWeights,
            ModelEpoch(0),
            ModelEpoch(1),
            Bystanders,
            launch(0, 0, 0),
            launch(0, 0, 1),
            launch(0, 1, 0),
            launch(1, 0, 0),
        ];
        assert_eq!(of_model.map(Stream::number).iter().collect::<BTreeSet<_>>().len(), of_model.len());
    }

    /// Every recorded run and model depends on these.
    #[test]
    fn numbers_are_those_of_recorded_results() {
        let numbers = [
            (Stream::PriorStage(2), 3),
            (Stream::Proposal { attempt: 0, number: 1 }, 65_537),
            (Stream::TrainingStart, 4_294_967_297),
            (Stream::ModelRollouts, 4_294_967_303),
            (Stream::Launch { split: 2, kind: 3, index: 4 }, 562_949_953_421_312 + 3_298_534_883_328 + 4),
            (Stream::Puzzle { split: 2, number: 3 }, 4_611_686_018_427_387_904 + 562_949_953_421_312 + 3),
            (Stream::ModelEpoch(4), 9_223_372_036_854_775_813),
        ];
        for (stream, number) in numbers {
            assert_eq!(stream.number(), number, "{stream:?}");
        }
    }
}
