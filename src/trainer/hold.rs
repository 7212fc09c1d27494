//! Decides which copy of the policy acts during exploration by need: a copy that succeeds is kept.

use serde::{Deserialize, Serialize};

use super::exploration::Attempts;

/// Results of the greedy attempts of the acting policy, and the record of the proven policy, which acts
/// again when a new one does worse.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Hold {
    /// Latest attempts of the acting policy.
    attempts: Attempts,
    /// Number of its attempts since it began to act.
    age: u64,
    /// Whether the acting policy is the proven one.
    proven_acts: bool,
    /// Number of attempts of the proven policy before it first failed; none if no policy is proven.
    proven_age: Option<u64>,
}

/// The acting policy has failed too often; decides what acts next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Failure {
    /// It did better than the proven policy and becomes the proven one. A new copy of the policy acts next.
    Proven,
    /// It did worse than the proven policy, which acts next.
    Worse,
    /// It was the proven one, or there is none. A new copy of the policy acts next.
    Unproven,
}

impl Hold {
    /// Whether nothing was recorded.
    pub fn is_unused(&self) -> bool {
        *self == Self::default()
    }

    /// Records a greedy attempt at a stage. The policy has failed when more than the share `tolerance` of
    /// its last `kept` attempts at the stage did not reach it. It becomes the proven one if it made at
    /// least `kept` attempts, and more than the one proven so far.
    pub fn note(&mut self, stage: usize, reached: bool, kept: u32, tolerance: f32) -> Option<Failure> {
        self.attempts.note(stage, reached, kept);
        self.age += 1;
        if self.attempts.failures(stage) <= tolerance {
            return None;
        }
        let least = self.proven_age.map_or(u64::from(kept), |age| age + 1);
        let failure = match self.proven_acts {
            false if self.age >= least => Failure::Proven,
            false if self.proven_age.is_some() => Failure::Worse,
            _ => Failure::Unproven,
        };
        *self = Self {
            proven_acts: failure == Failure::Worse,
            proven_age: if failure == Failure::Proven { Some(self.age) } else { self.proven_age },
            ..Self::default()
        };
        Some(failure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records `successes` successful attempts, then failed ones until the policy has failed.
    fn play(hold: &mut Hold, successes: usize) -> Failure {
        (0..successes).for_each(|_| assert_eq!(hold.note(0, true, 4, 0.25), None));
        std::iter::repeat_with(|| hold.note(0, false, 4, 0.25)).flatten().next().unwrap()
    }

    #[test]
    fn a_policy_fails_when_too_many_of_its_latest_attempts_do() {
        let mut hold = Hold::default();
        assert!(hold.note(0, false, 4, 0.25).is_some(), "the first of all");
        for reached in [true, true, true, false, true, true, true, false] {
            assert_eq!(hold.note(0, reached, 4, 0.25), None, "one of four may");
        }
        assert_eq!(hold.note(1, true, 4, 0.25), None);
        assert!(hold.note(1, false, 4, 0.25).is_some(), "each stage counts by itself");
    }

    #[test]
    fn a_proven_policy_alternates_with_new_ones() {
        let mut hold = Hold::default();
        assert_eq!(play(&mut hold, 0), Failure::Unproven, "nothing is proven yet");
        assert_eq!(play(&mut hold, 10), Failure::Proven);
        assert_eq!(play(&mut hold, 3), Failure::Worse);
        assert_eq!(play(&mut hold, 5), Failure::Unproven, "the proven one fails: a new one is tried");
        assert_eq!(play(&mut hold, 20), Failure::Proven, "better than the proven one");
    }

    #[test]
    fn the_state_round_trips_through_json() {
        let mut hold = Hold::default();
        play(&mut hold, 10);
        hold.note(2, true, 4, 0.25);
        let json = serde_json::to_string(&hold).unwrap();
        assert_eq!(serde_json::from_str::<Hold>(&json).unwrap(), hold);
        assert!(!hold.is_unused() && Hold::default().is_unused());
    }
}
