//! What a run is on disk: one training with one configuration and one seed.
//!
//! A run is a folder with one writer ([`RunWriter`], which holds the lock) and any number of
//! readers ([`RunDirectory`]). Everything that shows a run, live or finished, in the writer's
//! process or in another, reads these files:
//!
//! ```text
//! config.json                 {"format": 1, "mge_version": "..", "config": {..}}, every default written out
//! events.jsonl                one JSON object a line, appended and flushed as things happen: the log
//! metrics.csv                 one row an episode, the fields of `EpisodeRecord`; no times, so one seed gives one file
//! episodes.jsonl              the actions of each episode, so that it can be played again
//! prior.json                  the action clusters in use, if there are any
//! control.jsonl               what others asked of whoever trains it, one request a line
//! notes.json                  tags and a note, written by people
//! log.txt                     the events but single episodes, as text for people
//! tensorboard/                TFEvents files, tags grouped as train/, loss/, eval/, time/
//! checkpoint/last/            always the newest; `best/` and `episode-N/` beside it
//! figures/                    figures of the run
//! lock                        locked while a process writes the run; its text is that process's id
//! ```
//!
//! # Formats and versions
//!
//! `config.json` carries one number, [`FORMAT`], for the whole folder: a change in the meaning of
//! any of its files raises it. A checkpoint is copied about on its own and carries its own number,
//! [`checkpoint::FORMAT`]. A newer number than the program knows is refused by name; older numbers
//! keep loading. Numbers that are not finite (a loss that diverged) are written as the words `NaN`,
//! `inf` and `-inf`, in the log as in the table.
//!
//! # After an interruption
//!
//! Logs are synced to the disk before a checkpoint is written, so they always reach at least as
//! far as the checkpoint. [`RunWriter::open`] cuts them back to the checkpoint's episode and goes
//! on from there, so that an interrupted run ends with the same `metrics.csv` as an uninterrupted
//! one. A reader takes a half-written last line as "not yet".

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
mod log;
mod metric;
mod metrics;
mod notes;
mod number;
mod request;
mod retention;
mod scalars;
mod series;
mod stamp;
mod status;
mod store;
mod tensorboard;
mod writer;

pub use branch::Branch;
pub use checkpoint::Checkpoint;
pub use directory::{FORMAT, RunDirectory, RunLock, config_hash};
pub use episodes::{PlayedAction, PlayedEpisode, Source, read_episode};
pub use error::RunError;
pub use event::{EpisodeRecord, Event, LoggedEvent, Practised};
pub use history::{EvaluationRecord, RunHistory};
pub use log::{EventReader, Poll, read_events};
pub use metric::{Direction, Metric, MetricInfo};
pub use metrics::read_metrics;
pub use notes::Notes;
pub use request::{Request, RequestReader};
pub use retention::{CheckpointAction, CheckpointName, Retention, RetentionContext, what_to_keep};
pub use series::Series;
pub use stamp::Stamp;
pub use status::{RunState, RunStatus};
pub use store::CheckpointStore;
pub use writer::RunWriter;

/// Result of everything that touches a run on disk.
pub type Result<T> = std::result::Result<T, RunError>;
