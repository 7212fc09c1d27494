//! Errors of runs on disk, as one line for users.

use std::io;
use std::path::{Path, PathBuf};

use mge_base::bounded::in_plain_words;
use thiserror::Error;

use super::retention::CheckpointName;

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
    #[error(
        "{} already holds a run: continue it with `mge resume`, or choose another folder, for a script with `--runs`",
        .0.display()
    )]
    AlreadyARun(PathBuf),
    /// A run of an agent was requested, and it is of a dynamics model or a count of hits.
    #[error("{} is a dynamics model or a count of hits of a sweep, not a run: `results.csv` of the sweep has its numbers", .0.display())]
    OfModel(PathBuf),
    /// A new run was requested in a folder that is not empty.
    #[error("{} is not empty: choose another folder", .0.display())]
    NotEmpty(PathBuf),
    /// A run cannot be restored because something is in its place.
    #[error("{} exists: move it elsewhere, then restore the run", .0.display())]
    PlaceTaken(PathBuf),
    /// The folder has no `config.json`, or does not exist.
    #[error("{} {}", .0.display(), if .0.exists() { "is not a run: it has no config.json" } else { "does not exist" })]
    NotARun(PathBuf),
    /// The run to be restored was not deleted, or the trash was emptied.
    #[error("{} is not in the trash", .0.display())]
    NotInTrash(PathBuf),
    /// A folder that should hold runs has none.
    #[error("{} holds no runs: name the folder of a run, of a sweep or of a study", .0.display())]
    NoRuns(PathBuf),
    /// Another process (or another part of this one) holds the run's lock.
    #[error("the run {} is in use{}: stop that one first, or choose another folder", path.display(), by(.process))]
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
    /// Written by a newer version of the program.
    #[error(
        "{} has format {found}, and this program reads formats 1 to {supported}: update mge",
        path.display()
    )]
    UnknownFormat {
        /// The file that names the format.
        path: PathBuf,
        /// The format found.
        found: u64,
        /// The newest format that this program reads.
        supported: u64,
    },
    /// The content of a file does not match its format.
    #[error("{}{}: {reason}", path.display(), at_line(.line))]
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
         `mge fork --at N` can only continue from a checkpoint of episode {last} or before",
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
    /// The file does not contain an episode.
    #[error("{}: there is no episode {episode} in it", path.display())]
    NoEpisode {
        /// The file of the episodes.
        path: PathBuf,
        /// The requested episode.
        episode: u64,
    },
    /// There is no checkpoint at all.
    #[error("there is no checkpoint in {}", .0.display())]
    NoCheckpoint(PathBuf),
    /// There is no checkpoint with this name or of this episode.
    #[error("there is no checkpoint {choice} in {}: it has {present}", path.display())]
    NoSuchCheckpoint {
        /// The folder of the checkpoints.
        path: PathBuf,
        /// The requested one.
        choice: CheckpointName,
        /// The existing ones, separated by commas.
        present: String,
    },
    /// The length of a checkpoint's file does not match the manifest.
    #[error(
        "{} has {found} bytes instead of {expected}: the checkpoint is incomplete, only an earlier one can be used",
        path.display()
    )]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Length in the manifest.
        expected: u64,
        /// Length on disk.
        found: u64,
    },
    /// The content of a checkpoint's file does not match the manifest.
    #[error("{} is damaged (its checksum differs): `mge fork` can continue from an earlier checkpoint", .0.display())]
    Damaged(PathBuf),
    /// A checkpoint lacks a required section.
    #[error("the checkpoint of episode {episode} has no section \"{section}\"; it has {present}")]
    MissingSection {
        /// Episode of the checkpoint.
        episode: u64,
        /// The requested section.
        section: String,
        /// The existing sections, separated by commas.
        present: String,
    },
    /// A section name is not a valid file name.
    #[error("\"{0}\" cannot name a section: use lower-case letters, digits, '_', '-' and '.', at most 64")]
    SectionName(String),
    /// The run is not being trained.
    #[error("no process is training {}: `mge resume` continues an unfinished run", .0.display())]
    NotTrained(PathBuf),
    /// Notes are too long, or tags are not words.
    #[error("{0}")]
    Notes(String),
    /// A value has no JSON form.
    #[error("cannot write {what} as JSON: {source}")]
    Encode {
        /// The value.
        what: String,
        /// The cause.
        source: serde_json::Error,
    },
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

fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "; free some space, then repeat the command, or continue the run with `mge resume`"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "; change the permissions, or use another folder"
        }
        io::ErrorKind::NotADirectory => "; a part of the path is a file: use another folder",
        _ => "",
    }
}

fn by(process: &Option<u32>) -> String {
    process.map_or_else(String::new, |id| format!(" by process {id}"))
}

fn at_line(line: &Option<u64>) -> String {
    line.map_or_else(String::new, |line| format!(", line {line}"))
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
        assert!(
            text.ends_with("; free some space, then repeat the command, or continue the run with `mge resume`"),
            "{text}"
        );

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
