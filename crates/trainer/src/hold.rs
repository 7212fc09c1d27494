//! Decides which copy of the policy acts during exploration by need: a copy that succeeds is kept.

use serde::{Deserialize, Serialize};

use super::exploration::Attempts;

/// Place of the attempts at the goal among those kept by [`Attempts`].
const GOAL: usize = 0;

/// Results of the greedy attempts of the acting policy, and the record of the proven policy, which acts
/// again when a new one does worse.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Hold {
    /// Latest attempts at the goal of the acting policy since it began or returned to act.
    latest: Attempts,
    /// All its attempts at the goal.
    acting: Record,
    /// Whether the acting policy is the proven one.
    proven_acts: bool,
    /// Those of the proven policy, until it last failed; none if no policy is proven.
    proven: Option<Record>,
}

/// The attempts of a policy at the goal: each ends with the goal or with the first stage that is not reached.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    attempts: u64,
    failures: u64,
}

impl Record {
    fn failed_share(self) -> f64 {
        self.failures as f64 / self.attempts as f64
    }
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

    /// Records a greedy attempt at the goal. The policy has failed when more than the share `tolerance` of
    /// its last `kept` attempts did not reach it. It becomes the proven one if it made at
    /// least `kept` attempts, and a smaller share of them failed than of those of the one proven so far.
    pub fn note(&mut self, reached: bool, kept: u32, tolerance: f32) -> Option<Failure> {
        self.latest.note(GOAL, reached, kept);
        self.acting.attempts += 1;
        self.acting.failures += u64::from(!reached);
        if self.latest.failures(GOAL) <= tolerance {
            return None;
        }
        let is_better = self.proven.is_none_or(|proven| self.acting.failed_share() < proven.failed_share());
        let failure = match self.proven {
            _ if self.proven_acts => Failure::Unproven,
            _ if is_better && self.acting.attempts >= kept.into() => Failure::Proven,
            Some(_) => Failure::Worse,
            None => Failure::Unproven,
        };
        if self.proven_acts || failure == Failure::Proven {
            self.proven = Some(self.acting);
        }
        self.proven_acts = failure == Failure::Worse;
        self.acting = self.proven.filter(|_| self.proven_acts).unwrap_or_default();
        self.latest = Attempts::default();
        Some(failure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records `successes` successful attempts, then failed ones until the policy has failed.
    fn play(hold: &mut Hold, successes: usize) -> Failure {
        (0..successes).for_each(|_| assert_eq!(hold.note(true, 4, 0.25), None));
        std::iter::repeat_with(|| hold.note(false, 4, 0.25)).flatten().next().unwrap()
    }

    #[test]
    fn a_policy_fails_when_too_many_of_its_latest_attempts_do() {
        let mut hold = Hold::default();
        assert!(hold.note(false, 4, 0.25).is_some(), "the first of all");
        for reached in [true, true, true, false, true, true, true, false] {
            assert_eq!(hold.note(reached, 4, 0.25), None, "one of four may");
        }
    }

    #[test]
    fn a_proven_policy_alternates_with_new_ones() {
        let mut hold = Hold::default();
        assert_eq!(play(&mut hold, 0), Failure::Unproven, "nothing is proven yet");
        assert_eq!(play(&mut hold, 10), Failure::Proven);
        assert_eq!(play(&mut hold, 3), Failure::Worse);
        assert_eq!(play(&mut hold, 5), Failure::Unproven, "the proven one fails: a new one is tried");
        // The proven one has failed 4 of 19 times by now.
        assert_eq!(play(&mut hold, 7), Failure::Worse, "2 of 9 failed");
        assert_eq!(play(&mut hold, 9), Failure::Unproven);
        // 6 of 30 by now.
        assert_eq!(play(&mut hold, 9), Failure::Proven, "2 of 11 failed");
    }

    #[test]
    fn the_state_round_trips_through_json() {
        let mut hold = Hold::default();
        play(&mut hold, 10);
        hold.note(true, 4, 0.25);
        let json = serde_json::to_string(&hold).unwrap();
        assert_eq!(serde_json::from_str::<Hold>(&json).unwrap(), hold);
        assert!(!hold.is_unused() && Hold::default().is_unused());
    }
}
