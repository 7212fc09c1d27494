//! Real rollouts with the clusters of a candidate.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::candidate::{Candidate, least, rollouts};
use mge_env::{Environment, Snapshot};

/// Real rollouts towards each stage of a candidate.
const ROLLOUTS: usize = 8;
/// Weight of the predicted share of a stage among the real rollouts, as a number of rollouts.
const PREDICTED_WEIGHT: f32 = 2.0;

/// What real rollouts towards the stages of a candidate reached.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Check {
    /// For each stage, the numbers of rollouts that reached it and of all rollouts.
    stages: Vec<(usize, usize)>,
    /// Number of actions that they took.
    pub actions: usize,
}

impl Check {
    /// Plays guided rollouts from stage to stage, until one is not reached or `most` actions are taken; the rollout
    /// that takes the last of them is played to its end.
    pub fn of(candidate: &Candidate, horizon: usize, most: usize, rng: &mut ChaCha8Rng) -> Self {
        let mut check = Self { stages: Vec::new(), actions: 0 };
        let mut env = Environment::new(candidate.task.clone());
        let mut starts: Vec<Snapshot> = Vec::new();
        for (stage, prior) in candidate.stages.iter().enumerate() {
            let horizon = prior.longer_horizon.unwrap_or(horizon);
            let (mut hits, mut reached) = (0, Vec::new());
            let mut played = 0;
            while played < ROLLOUTS && check.actions < most {
                match starts.len() {
                    0 => _ = env.reset(rng),
                    count => env.restore(&starts[rng.gen_range(0..count)]),
                }
                let is_there = |env: &Environment| env.snapshot().stage() > stage || env.snapshot().goal_reached;
                let mut left = horizon;
                while left > 0 && !is_there(&env) && env.step_without_observation(prior.sample(rng)).is_ok() {
                    (left, check.actions) = (left - 1, check.actions + 1);
                }
                played += 1;
                hits += usize::from(is_there(&env));
                if env.snapshot().stage() > stage && env.snapshot().end().is_none() {
                    reached.push(env.snapshot().clone());
                }
            }
            check.stages.push((hits, played));
            starts = reached;
            if starts.is_empty() {
                break;
            }
        }
        check
    }

    /// The smallest share, over all stages, of the rollouts towards a stage that reached it.
    pub fn least_reached(&self, candidate: &Candidate) -> f32 {
        let shares = self.stages.iter().map(|(hits, of)| *hits as f32 / (*of).max(1) as f32);
        let unplayed = if self.stages.len() < candidate.stages.len() { 0.0 } else { 1.0 };
        least(&shares.collect::<Vec<_>>()).min(unplayed)
    }

    /// Expected number of rollouts until every stage is reached once, from these rollouts and what the model predicts.
    pub fn rollouts(&self, candidate: &Candidate) -> f32 {
        let unplayed = std::iter::repeat(&(0, ROLLOUTS));
        let share = |((hits, of), predicted): (&(usize, usize), &f32)| {
            (*hits as f32 + PREDICTED_WEIGHT * predicted) / (*of as f32 + PREDICTED_WEIGHT)
        };
        rollouts(&self.stages.iter().chain(unplayed).zip(&candidate.reached).map(share).collect::<Vec<_>>())
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::TruePhysics;
    use crate::build::Prediction;
    use crate::config::GuidanceConfig;
    use mge_base::stop::Stop;

    #[test]
    fn few_real_rollouts_correct_what_the_model_predicts() {
        let (config, stop) = (GuidanceConfig::default(), Stop::default());
        let prediction = Prediction { model: &TruePhysics, config: &config, seed: 0, stop: &stop };
        let task = mge_task::load("task3").unwrap();
        let root = prediction.root(&task).unwrap();
        let candidate = prediction.successor(&root, task.subgoals[0]).unwrap();
        let check = |most| Check::of(&candidate, config.horizon, most, &mut ChaCha8Rng::seed_from_u64(1));
        let whole = check(1000);
        assert_eq!(whole.stages.len(), 2);
        assert!(whole.stages.iter().all(|(_, of)| *of == ROLLOUTS) && whole.actions <= 2 * ROLLOUTS * config.horizon);
        assert!(whole.least_reached(&candidate) > 0.0 && whole.rollouts(&candidate).is_finite());
        // With a single action, a single rollout.
        let short = check(1);
        assert_eq!(short.stages.iter().map(|(_, of)| of).sum::<usize>(), 1);
        assert!((1..=config.horizon).contains(&short.actions) && short.least_reached(&candidate) == 0.0);
        let of = |stages: &[(usize, usize)]| Check { stages: stages.to_vec(), actions: 0 }.rollouts(&candidate);
        assert!(of(&[(8, 8), (8, 8)]) < of(&[(8, 8), (4, 8)]));
        assert!(of(&[(8, 8), (0, 8)]) < of(&[(0, 8)]), "what was not played counts as not reached");
    }
}
