//! Detects whether a run may have changed since it was read.

use std::path::Path;
use std::time::SystemTime;

/// Sizes and modification times of the log, the settings and the notes. They change whenever something relevant to
/// readers changes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stamp([Option<(u64, SystemTime)>; 3]);

impl Stamp {
    /// The current stamp of the run in a folder.
    pub fn of(folder: &Path) -> Self {
        Self(["events.jsonl", "config.json", "notes.json"].map(|name| {
            let data = std::fs::metadata(folder.join(name)).ok()?;
            Some((data.len(), data.modified().ok()?))
        }))
    }
}
