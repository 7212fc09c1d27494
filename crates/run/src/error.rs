//! Errors of runs on disk, as one line for users.

use std::io;
use std::path::{Path, PathBuf};

use mge_base::bounded::in_plain_words;
use thiserror::Error;

/// Why a run could not be read or written. Messages name the path and, where possible, a remedy.
#[derive(Debug, Error)]
pub enum RunError {
    /// The operating system reported an error.
    #[error("cannot {action} {}: {source}{}", path.display(), remedy(source))]
    Io {
        /// The failed operation, as a verb: "write", "read", "create".
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// A new run was requested in a folder that already holds a run.
    #[error("{} already holds a run: continue it, or choose another folder", .0.display())]
    AlreadyARun(PathBuf),
    /// What was asked for cannot be done, for the reason that the text gives.
    #[error("{0}")]
    Refused(String),
    /// A new run was requested in a folder that is not empty.
    #[error("{} is not empty: choose another folder", .0.display())]
    NotEmpty(PathBuf),
    /// The folder has no `config.json`, or does not exist.
    #[error("{} {}", .0.display(), why_not(.0))]
    NotARun(PathBuf),
    /// A folder that should hold runs has none.
    #[error("{} holds no runs: name the folder of a run, of a sweep or of a study", .0.display())]
    NoRuns(PathBuf),
    /// Another process (or another part of this one) holds the run's lock.
    #[error("the run {} is in use{}: stop that one first, or choose another folder", path.display(), .process.map_or_else(String::new, |id| format!(" by process {id}")))]
    InUse {
        /// The run.
        path: PathBuf,
        /// Process id of the writer, if it can be read.
        process: Option<u32>,
    },
    /// The file system of a run has no locks, without which two processes could train it at the same time.
    #[error(
        "{} cannot be locked: its file system has no locks; mount it with them (Lustre: `flock`, NFS: without \
         `nolock`), or train on a local disk and copy the run",
        .0.display()
    )]
    NoLocks(PathBuf),
    /// The folder was moved or deleted while the run was being written.
    #[error("{} was moved or deleted while it was being trained: the training has ended", .0.display())]
    Moved(PathBuf),
    /// The content of a file does not match its format.
    #[error("{}{}: {reason}", path.display(), .line.map_or_else(String::new, |line| format!(", line {line}")))]
    Malformed {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1, if the file has lines.
        line: Option<u64>,
        /// What is wrong.
        reason: String,
    },
    /// A log ends before the checkpoint from which to resume.
    #[error(
        "{} ends at episode {last}, before the checkpoint of episode {checkpoint}: the file was changed; \
         only a fork from a checkpoint of episode {last} or before can go on",
        path.display()
    )]
    LogTooShort {
        /// The log.
        path: PathBuf,
        /// Last episode in the log.
        last: u64,
        /// Episode of the checkpoint.
        checkpoint: u64,
    },
    /// There is no checkpoint at all.
    #[error("there is no checkpoint in {}", .0.display())]
    NoCheckpoint(PathBuf),
}

impl RunError {
    /// Turns an [`io::Error`] into a [`RunError::Io`]: `.map_err(RunError::io("read", path))`.
    pub fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> RunError + use<> {
        let path = path.to_path_buf();
        let plain = move |source| if action == "read" { in_plain_words(source) } else { source };
        move |source| RunError::Io { action, path, source: plain(source) }
    }

    /// A file whose content is wrong, possibly in a line, counted from 1.
    pub(super) fn malformed(path: &Path, line: Option<u64>, reason: impl Into<String>) -> RunError {
        RunError::Malformed { path: path.to_path_buf(), line, reason: reason.into() }
    }

    /// Whether the cause is a file or folder that does not exist.
    pub fn is_not_found(&self) -> bool {
        matches!(self, RunError::Io { source, .. } if source.kind() == io::ErrorKind::NotFound)
    }
}

/// Why a folder is not a run.
fn why_not(path: &Path) -> &'static str {
    if path.exists() { "is not a run: it has no config.json" } else { "does not exist" }
}

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "; free some space, then repeat the command, or continue the run"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; change the permissions, or use another folder"
        }
        io::ErrorKind::NotADirectory => "; a part of the path is a file: use another folder",
        _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_name_the_path_and_the_remedy() {
        let full = RunError::Io {
            action: "write",
            path: "runs/a/events.jsonl".into(),
            source: io::Error::from(io::ErrorKind::StorageFull),
        };
        let text = full.to_string();
        assert!(text.starts_with("cannot write runs/a/events.jsonl: "), "{text}");
        assert!(text.ends_with("; free some space, then repeat the command, or continue the run"), "{text}");

        for (kind, remedy) in [
            (io::ErrorKind::PermissionDenied, "; change the permissions, or use another folder"),
            (io::ErrorKind::ReadOnlyFilesystem, "; change the permissions, or use another folder"),
            (io::ErrorKind::NotADirectory, "; a part of the path is a file: use another folder"),
            (io::ErrorKind::NotFound, ""),
        ] {
            let source = io::Error::from(kind);
            let expected = format!("cannot create runs/a: {source}{remedy}");
            assert_eq!(RunError::io("create", Path::new("runs/a"))(source).to_string(), expected);
        }

        let used = RunError::InUse { path: "runs/a".into(), process: Some(12) };
        assert_eq!(
            used.to_string(),
            "the run runs/a is in use by process 12: stop that one first, or choose another folder"
        );
        let line = RunError::Malformed { path: "m.csv".into(), line: Some(3), reason: "no".into() };
        assert_eq!(line.to_string(), "m.csv, line 3: no");
    }
}
