//! Checksums of the logs, kept with each checkpoint: they tell whether anything before it was changed since.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use mge_base::identity::hexadecimal;

/// The checkpoint section that holds the checksums, as JSON.
pub const SUMS_SECTION: &str = "logs.json";

/// Length and checksum of a text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sum {
    /// Its length.
    pub bytes: u64,
    sha256: String,
}

/// Computes the [`Sum`] of a text piece by piece.
#[derive(Clone, Debug, Default)]
pub(super) struct Summing {
    bytes: u64,
    hasher: Sha256,
}

impl Summing {
    /// Begins with a piece.
    pub fn of(piece: &[u8]) -> Self {
        let mut summing = Self::default();
        summing.add(piece);
        summing
    }

    /// Adds a piece.
    pub fn add(&mut self, piece: &[u8]) {
        self.bytes += piece.len() as u64;
        self.hasher.update(piece);
    }

    /// The sum of all pieces so far.
    pub fn sum(&self) -> Sum {
        Sum { bytes: self.bytes, sha256: hexadecimal(&self.hasher.clone().finalize()) }
    }
}

/// Checksums of the logs up to an episode. `metrics.csv` has none, because it follows from the events.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LogSums {
    /// The results in `events.jsonl`, without their times, which differ when a run is repeated.
    pub events: Sum,
    /// `episodes.jsonl`.
    pub episodes: Sum,
}
