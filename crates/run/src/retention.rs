//! The names of checkpoints, and the settings that say which are kept.

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

#[cfg(test)]
mod tests {
    use super::CheckpointName::{Best, Episode, Last};
    use super::*;

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
