//! Runs on disk: a run is one training with one configuration and one seed.
//!
//! A run is a folder with one writer ([`RunWriter`], which holds the lock) and any number of
//! readers ([`RunDirectory`]). Everything that shows a run, live or finished, in the writer's
//! process or in another, reads these files:
//!
//! ```text
//! config.json                 {"format": 1, "mge_version": "..", "config": {..}}, including all defaults
//! events.jsonl                the event log: one JSON object per line, written as events happen
//! metrics.csv                 one row per episode, the fields of `EpisodeRecord`; no times: one seed gives one file
//! episodes.jsonl              the actions of each episode, for replays
//! model.safetensors           a copy of the dynamics model, if the run uses one that is in a file
//! prior.json                  the action clusters in use, if any
//! control.jsonl               requests of other processes to the trainer, one per line
//! notes.json                  name and note that users gave it
//! log.txt                     the events except single episodes, as readable text
//! tensorboard/                TFEvents files, tags grouped as train/, loss/, eval/, time/
//! checkpoint/last/            always the newest; `best/` and `episode-N/` beside it
//! figures/                    figures of the run
//! lock                        locked while a process writes the run; contains that process's id
//! ```
//!
//! ```
//! use mge_run::{EpisodeRecord, Event, RunDirectory, RunHistory, RunState, RunWriter};
//!
//! let folder = tempfile::tempdir()?;
//! let run = RunDirectory::create(folder.path().join("run"), &serde_json::json!({"seed": 1}))?;
//! let mut writer = RunWriter::open(&run, 0)?;
//! writer.record(&Event::EpisodeFinished(EpisodeRecord { episode: 1, steps: 12, ..EpisodeRecord::default() }))?;
//! assert_eq!(RunHistory::read(&run)?.records.len(), 1);
//! assert_eq!(run.status()?.state, RunState::Running);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Formats and versions
//!
//! `config.json` contains one format number, [`FORMAT`], for the whole folder: a change in the
//! meaning of any of its files increases it. Checkpoints can be copied separately, so they have
//! their own format number, [`checkpoint::FORMAT`]. Newer formats are rejected with an error that
//! names the format; older formats remain readable. Non-finite numbers (a diverged loss) are written
//! as `NaN`, `inf` and `-inf`, both in the log and in the table.
//!
//! # After an interruption
//!
//! `events.jsonl` and `episodes.jsonl` are synced to disk before a checkpoint is written, so they always reach at least
//! as far as the checkpoint. [`RunWriter::open`] truncates them to the checkpoint's episode and continues from there.
//! `metrics.csv`, `log.txt` and TensorBoard's files only show the events: they are written anew from what is left of
//! them (`projection.rs`), so that an interrupted run ends with the same `metrics.csv` as an uninterrupted one.
//! Readers ignore a half-written last line.
//!
//! # Deletion
//!
//! A deleted run is moved to `.trash/` beside it, in one step and under its lock; see `trash.rs`.

#![deny(unsafe_code)]

mod append;
mod branch;
pub mod checkpoint;
mod directory;
mod episodes;
mod error;
mod event;
mod file;
mod folder;
mod history;
mod lock;
mod log;
mod metric;
mod notes;
mod number;
mod projection;
mod reader;
mod request;
mod retention;
mod series;
mod stamp;
mod status;
mod store;
mod tensorboard;
mod trash;
mod writer;

pub use branch::Branch;
pub use checkpoint::Checkpoint;
pub use directory::{FORMAT, RunDirectory, config_hash};
pub use episodes::{PlayedAction, PlayedEpisode, Source, read_episode};
pub use error::RunError;
pub use event::{EpisodeRecord, Event, LoggedEvent, Practised};
pub use file::read_optional;
pub use history::{EvaluationRecord, RunHistory, TrainingTime};
pub use lock::RunLock;
pub use metric::{Direction, Metric, MetricInfo};
pub use notes::Notes;
pub use reader::{EventReader, Poll, read_events};
pub use request::RequestReader;
pub use retention::{CheckpointName, Retention};
pub use series::Series;
pub use stamp::Stamp;
pub use status::{RunState, RunStatus};
pub use store::CheckpointStore;
pub use trash::{deletions, empty_trash, restore, trashed};
pub use writer::RunWriter;

/// Result of operations on a run on disk.
pub type Result<T, E = RunError> = std::result::Result<T, E>;
