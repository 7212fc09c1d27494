//! Detects whether a run may have changed since it was read.

use std::path::Path;
use std::time::SystemTime;

/// Size and modification time of the log, and modification times of settings and notes. They change whenever
/// something relevant to readers changes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stamp {
    log: Option<(u64, SystemTime)>,
    config: Option<SystemTime>,
    notes: Option<SystemTime>,
}

impl Stamp {
    /// The current stamp of the run in a folder.
    pub fn of(folder: &Path) -> Self {
        let metadata = |name: &str| std::fs::metadata(folder.join(name)).ok();
        let modified = |data: &std::fs::Metadata| data.modified().ok();
        Self {
            log: metadata("events.jsonl").and_then(|data| Some((data.len(), modified(&data)?))),
            config: metadata("config.json").and_then(|data| modified(&data)),
            notes: metadata("notes.json").and_then(|data| modified(&data)),
        }
    }
}
