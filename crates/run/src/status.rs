//! The state of a run, derived from its lock and the end of its log.

use super::event::{EpisodeRecord, Event, LoggedEvent};

/// The state of a run as a reader sees it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum RunState {
    /// Created, but not trained yet.
    #[default]
    NotStarted,
    /// A process is training it.
    Running,
    /// A process holds its lock and pauses.
    Paused,
    /// All episodes are done.
    Finished,
    /// It was ended early; it can be resumed.
    Stopped(String),
    /// An error ended it; it can be resumed from its last checkpoint.
    Failed(String),
    /// The process that trained it exited unexpectedly; it can be resumed.
    Interrupted,
}

impl RunState {
    /// A name of one or two words.
    pub fn name(&self) -> &'static str {
        match self {
            Self::NotStarted => "not started",
            Self::Running => "running",
            Self::Paused => "paused",
            Self::Finished => "finished",
            Self::Stopped(_) => "stopped",
            Self::Failed(_) => "failed",
            Self::Interrupted => "interrupted",
        }
    }

    /// Why it was stopped or has failed.
    pub fn reason(&self) -> Option<&str> {
        match self {
            Self::Stopped(reason) | Self::Failed(reason) => Some(reason),
            _ => None,
        }
    }

    /// The state after an event, if it follows from that event and from whether a process holds the lock.
    pub(super) fn after(event: &Event, locked: bool) -> Option<Self> {
        match event {
            Event::Paused { .. } if locked => Some(Self::Paused),
            Event::Started { .. } | Event::EpisodeFinished(_) | Event::Resumed { .. } | Event::Paused { .. } => {
                Some(if locked { Self::Running } else { Self::Interrupted })
            }
            Event::Finished { .. } => Some(Self::Finished),
            Event::Stopped { reason, .. } => Some(Self::Stopped(reason.clone())),
            Event::Failed { reason, .. } => Some(Self::Failed(reason.clone())),
            _ => None,
        }
    }
}

/// The state and progress of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunStatus {
    /// Whether a process trains it, or how it ended.
    pub state: RunState,
    /// The last finished episode, if there is one in the part of the log that was read.
    pub last_episode: Option<EpisodeRecord>,
}

impl RunStatus {
    /// Derives the status from the last events and from whether a process holds the lock.
    pub(super) fn derive(events: &[LoggedEvent], locked: bool) -> Self {
        let last_episode = events.iter().rev().find_map(|logged| logged.event.record()).cloned();
        let state = events.iter().rev().find_map(|logged| RunState::after(&logged.event, locked));
        let without_events = if locked { RunState::Running } else { RunState::NotStarted };
        Self { state: state.unwrap_or(without_events), last_episode }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(events: &[Event], locked: bool, state: RunState) {
        let log: Vec<_> = events.iter().map(|event| LoggedEvent { time: 2.0, event: event.clone() }).collect();
        assert_eq!(RunStatus::derive(&log, locked).state, state, "{events:?}, locked {locked}");
    }

    #[test]
    fn state_follows_from_the_last_decisive_event_and_the_lock() {
        let episode = || Event::EpisodeFinished(EpisodeRecord { episode: 1, ..Default::default() });
        let paused = || Event::Paused { episode: 1 };
        let schedule = || Event::ScheduleChanged { episode: 1, schedule: "0".into() };
        let stopped = || Event::Stopped { episode: 1, reason: "asked".into() };
        let failed = || Event::Failed { episode: 1, reason: "disk".into() };

        check(&[], false, RunState::NotStarted);
        check(&[], true, RunState::Running);
        check(&[episode()], true, RunState::Running);
        check(&[episode()], false, RunState::Interrupted);
        check(&[episode(), paused(), schedule()], true, RunState::Paused);
        check(&[episode(), paused(), schedule()], false, RunState::Interrupted);
        check(&[paused(), Event::Resumed { episode: 1 }], true, RunState::Running);
        check(&[episode(), Event::Finished { episode: 1 }], false, RunState::Finished);
        check(&[paused(), stopped()], false, RunState::Stopped("asked".into()));
        check(&[episode(), failed()], false, RunState::Failed("disk".into()));
        check(&[stopped(), episode()], true, RunState::Running);
    }

    #[test]
    fn status_reports_the_progress_of_the_run() {
        let record = EpisodeRecord { episode: 5, ..Default::default() };
        let log = [
            LoggedEvent { time: 1.0, event: Event::EpisodeFinished(record.clone()) },
            LoggedEvent { time: 3.0, event: Event::Finished { episode: 5 } },
        ];
        let status = RunStatus::derive(&log, false);
        assert_eq!(status.last_episode, Some(record));
    }
}
