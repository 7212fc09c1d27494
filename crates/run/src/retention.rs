//! Decides which checkpoints to write and which to remove, without accessing the disk.

use std::str::FromStr;

use derive_more::Display;
use educe::Educe;
use serde::{Deserialize, Serialize};

/// Name of a checkpoint: its folder in `checkpoint/`.
#[derive(Clone, Copy, Debug, Display, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CheckpointName {
    /// `last`: the newest checkpoint.
    #[display("last")]
    Last,
    /// `best`: the latest checkpoint with the highest score.
    #[display("best")]
    Best,
    /// `episode-N`: the checkpoint of episode N.
    #[display("episode-{_0}")]
    Episode(u64),
}

impl FromStr for CheckpointName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "last" => Ok(CheckpointName::Last),
            "best" => Ok(CheckpointName::Best),
            _ => text
                .strip_prefix("episode-")
                .unwrap_or(text)
                .parse()
                .map(CheckpointName::Episode)
                .map_err(|_| format!("\"{text}\" is not a checkpoint: use last, best or the number of an episode")),
        }
    }
}

/// The retention policy for checkpoints.
#[derive(Clone, Copy, Debug, Educe, PartialEq, Eq, Serialize, Deserialize)]
#[educe(Default)]
#[serde(deny_unknown_fields, default)]
pub struct Retention {
    /// Number of episodes between writes of `last`; 0: only at the end, on a stop and with other checkpoints.
    #[educe(Default = 100)]
    pub last_every: u64,
    /// Number of episodes between writes of `episode-N`; 0: never.
    pub periodic_every: u64,
    /// Number of newest `episode-N` to keep; `None`: all of them.
    pub periodic_kept: Option<usize>,
}

/// The inputs of [`checkpoint_actions`] besides the policy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RetentionContext<'a> {
    /// Episodes finished so far.
    pub episode: u64,
    /// Score of the current networks, if they were just evaluated.
    pub score: Option<f64>,
    /// Score of the checkpoint `best`, if there is one.
    pub best_score: Option<f64>,
    /// The run is about to end, so its state must be saved.
    pub closing: bool,
    /// The existing checkpoints.
    pub existing: &'a [CheckpointName],
}

/// An action on the checkpoints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckpointAction {
    /// Write the current state under this name.
    Save(CheckpointName),
    /// Remove this one.
    Delete(CheckpointName),
}

/// The checkpoints to write and then to remove, in this order.
///
/// Whenever something is saved, `last` is saved first, so that it is never older than any other
/// checkpoint. A checkpoint becomes `best` unless its score is lower than that of the current `best`; one with NaN
/// never does. So of equal ones the latest, which has learned most, is `best`.
pub(super) fn checkpoint_actions(policy: &Retention, moment: &RetentionContext) -> Vec<CheckpointAction> {
    let due = |every: u64| every > 0 && moment.episode > 0 && moment.episode.is_multiple_of(every);
    let best = match (moment.score, moment.best_score) {
        (Some(score), Some(best)) => score >= best,
        (Some(score), None) => !score.is_nan(),
        (None, _) => false,
    };
    let periodic = due(policy.periodic_every);
    if !(best || periodic || moment.closing || due(policy.last_every)) {
        return Vec::new();
    }
    let mut actions = vec![CheckpointAction::Save(CheckpointName::Last)];
    if best {
        actions.push(CheckpointAction::Save(CheckpointName::Best));
    }
    if periodic {
        let new = CheckpointName::Episode(moment.episode);
        actions.push(CheckpointAction::Save(new));
        let is_other = |name: &CheckpointName| matches!(name, CheckpointName::Episode(_)) && *name != new;
        let mut old: Vec<_> = moment.existing.iter().copied().filter(is_other).collect();
        old.sort_unstable();
        let kept = policy.periodic_kept.map_or(usize::MAX, |kept| kept.saturating_sub(1));
        let surplus = old.len().saturating_sub(kept);
        actions.extend(old.into_iter().take(surplus).map(CheckpointAction::Delete));
    }
    actions
}

#[cfg(test)]
mod tests {
    use super::CheckpointAction::{Delete, Save};
    use super::CheckpointName::{Best, Episode, Last};
    use super::*;

    const POLICY: Retention = Retention { last_every: 10, periodic_every: 100, periodic_kept: Some(2) };

    const QUIET: RetentionContext =
        RetentionContext { episode: 7, score: None, best_score: None, closing: false, existing: &[] };

    fn check(moment: RetentionContext, actions: &[CheckpointAction]) {
        assert_eq!(checkpoint_actions(&POLICY, &moment), actions, "{moment:?}");
    }

    #[test]
    fn last_is_written_when_due_and_when_closing() {
        check(QUIET, &[]);
        check(RetentionContext { episode: 0, ..QUIET }, &[]);
        check(RetentionContext { episode: 20, ..QUIET }, &[Save(Last)]);
        check(RetentionContext { closing: true, ..QUIET }, &[Save(Last)]);
        check(RetentionContext { episode: 0, closing: true, ..QUIET }, &[Save(Last)]);
        let never = Retention { last_every: 0, periodic_every: 0, periodic_kept: None };
        assert_eq!(checkpoint_actions(&never, &RetentionContext { episode: 20, ..QUIET }), []);
    }

    #[test]
    fn best_is_the_latest_of_the_highest_score() {
        let with = |score, best_score| RetentionContext { score, best_score, ..QUIET };
        check(with(Some(0.5), None), &[Save(Last), Save(Best)]);
        check(with(Some(0.5), Some(0.4)), &[Save(Last), Save(Best)]);
        check(with(Some(0.5), Some(0.5)), &[Save(Last), Save(Best)]);
        check(with(Some(0.4), Some(0.5)), &[]);
        check(with(Some(f64::NAN), None), &[]);
        check(with(Some(f64::NAN), Some(0.1)), &[]);
        check(with(None, Some(0.1)), &[]);
    }

    #[test]
    fn old_periodic_checkpoints_are_removed_oldest_first() {
        let existing = [Episode(300), Best, Last, Episode(100), Episode(200)];
        check(
            RetentionContext { episode: 400, existing: &existing, ..QUIET },
            &[Save(Last), Save(Episode(400)), Delete(Episode(100)), Delete(Episode(200))],
        );
        check(
            RetentionContext { episode: 300, existing: &existing, ..QUIET },
            &[Save(Last), Save(Episode(300)), Delete(Episode(100))],
        );
        let all = Retention { periodic_kept: None, ..POLICY };
        let actions = checkpoint_actions(&all, &RetentionContext { episode: 400, existing: &existing, ..QUIET });
        assert_eq!(actions, [Save(Last), Save(Episode(400))]);
    }

    #[test]
    fn names_round_trip_as_text() {
        for name in [Last, Best, Episode(12)] {
            assert_eq!(name.to_string().parse(), Ok(name));
        }
        assert_eq!("12".parse(), Ok(Episode(12)));
        assert!("episode-x".parse::<CheckpointName>().unwrap_err().contains("episode-x"));
        assert!(".writing-abc".parse::<CheckpointName>().is_err());
    }
}
