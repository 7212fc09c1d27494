//! What chooses the actions of a stage: clusters, the actor with noise, or the actor without noise.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

use mge_guidance::EpsilonSchedule;

/// What chooses the actions of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Explorer {
    /// The clusters of the stage, or uniform random actions in their place.
    Clusters,
    /// The actor with noise.
    Noise,
    /// The actor without noise: a greedy attempt, which measures the need for exploration.
    Greedy,
}

/// Outcomes of the latest greedy attempts at each stage.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(super) struct Attempts(Vec<VecDeque<bool>>);

impl Attempts {
    /// Records whether a greedy attempt reached its stage; keeps the last `kept` outcomes.
    pub fn note(&mut self, stage: usize, reached: bool, kept: u32) {
        if self.0.len() <= stage {
            self.0.resize(stage + 1, VecDeque::new());
        }
        let outcomes = &mut self.0[stage];
        outcomes.push_back(reached);
        outcomes.drain(..outcomes.len().saturating_sub(kept as usize));
    }

    /// Whether there was no greedy attempt.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Share of failures among the recorded attempts; 0 if there are none.
    pub fn failures(&self, stage: usize) -> f32 {
        let made = self.0.get(stage).map_or(0, VecDeque::len) as u32;
        if made == 0 { 0.0 } else { self.need(stage, made) }
    }

    /// Share of failures among the last `of` attempts; attempts not yet made count as failures.
    pub fn need(&self, stage: usize, of: u32) -> f32 {
        let outcomes = self.0.get(stage).into_iter().flatten().rev().take(of as usize);
        1.0 - outcomes.filter(|reached| **reached).count() as f32 / of as f32
    }

    /// The need of each stage; empty if the schedule does not depend on need.
    pub fn needs(&self, schedule: &EpsilonSchedule, stages: usize) -> Vec<f32> {
        match *schedule {
            EpsilonSchedule::Need { attempts, .. } => (0..stages).map(|stage| self.need(stage, attempts)).collect(),
            _ => Vec::new(),
        }
    }

    /// Decides what chooses the actions of a stage; `draw` is uniform in [0, 1).
    pub fn explorer(&self, schedule: &EpsilonSchedule, threshold: f32, stage: usize, draw: f32) -> Explorer {
        match *schedule {
            EpsilonSchedule::Need { clusters, noise, attempts } => {
                let need = self.need(stage, attempts);
                match draw {
                    _ if draw < clusters * need => Explorer::Clusters,
                    _ if draw < (clusters + noise) * need => Explorer::Noise,
                    _ => Explorer::Greedy,
                }
            }
            _ if draw < threshold => Explorer::Clusters,
            _ => Explorer::Noise,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn need_is_the_share_of_failures_where_missing_attempts_are_failures() {
        let mut attempts = Attempts::default();
        assert_eq!(attempts.need(1, 4), 1.0);
        for (reached, need) in [(true, 0.75), (false, 0.75), (true, 0.5), (true, 0.25), (true, 0.25), (true, 0.0)] {
            attempts.note(1, reached, 4);
            assert_eq!(attempts.need(1, 4), need);
        }
        assert_eq!((attempts.need(0, 4), attempts.need(2, 4)), (1.0, 1.0), "stages are apart");
        let again: Attempts = serde_json::from_str(&serde_json::to_string(&attempts).unwrap()).unwrap();
        assert_eq!(again, attempts);
    }

    #[test]
    fn need_is_computed_over_the_latest_attempts() {
        let mut attempts = Attempts::default();
        [false, false, true, true].iter().for_each(|reached| attempts.note(0, *reached, 4));
        assert_eq!([4, 2, 8].map(|of| attempts.need(0, of)), [0.5, 0.0, 0.75]);
    }

    #[test]
    fn clusters_and_noise_have_their_share_of_the_need() {
        let schedule = "need:0.5:0.25:4".parse().unwrap();
        let mut attempts = Attempts::default();
        let chosen = |attempts: &Attempts, draw| attempts.explorer(&schedule, 0.0, 0, draw);
        for (draw, expected) in [
            (0.0, Explorer::Clusters),
            (0.49, Explorer::Clusters),
            (0.51, Explorer::Noise),
            (0.74, Explorer::Noise),
            (0.76, Explorer::Greedy),
        ] {
            assert_eq!(chosen(&attempts, draw), expected, "{draw}");
        }
        (0..2).for_each(|_| attempts.note(0, true, 4));
        for (draw, expected) in
            [(0.24, Explorer::Clusters), (0.26, Explorer::Noise), (0.37, Explorer::Noise), (0.38, Explorer::Greedy)]
        {
            assert_eq!(chosen(&attempts, draw), expected, "{draw}");
        }
        (0..2).for_each(|_| attempts.note(0, true, 4));
        assert_eq!(chosen(&attempts, 0.0), Explorer::Greedy);
        assert_eq!(attempts.needs(&schedule, 2), [0.0, 1.0]);
    }

    #[test]
    fn schedules_by_episode_never_act_greedily() {
        let schedule = "0.5".parse().unwrap();
        let attempts = Attempts::default();
        assert_eq!(attempts.explorer(&schedule, 0.5, 0, 0.49), Explorer::Clusters);
        assert_eq!(attempts.explorer(&schedule, 0.5, 0, 0.5), Explorer::Noise);
        assert!(attempts.needs(&schedule, 2).is_empty());
    }
}
