//! Controls of a running training, and their handling by the loop.

use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::RecvTimeoutError;
use serde::{Deserialize, Serialize};

use super::RunLoop;
use crate::error::Result;
use crate::training::Training;
use crate::watch::Phase;
use mge_guidance::{ActionPrior, EpsilonSchedule};
use mge_run::{Event, RunError};

/// A control of a running training. Controls take effect between two episodes, in the order
/// of sending. Those of other processes are lines of `control.jsonl`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(tag = "request", rename_all = "snake_case")]
pub enum Control {
    /// Wait until [`Control::Resume`].
    Pause,
    /// Continue after a pause.
    Resume,
    /// Continue, and pause once this many episodes of the run are finished; at once if they are.
    #[serde(skip)]
    PauseAt(u64),
    /// Continue, and pause after this many more episodes, at least one.
    Advance { episodes: u32 },
    /// Save a checkpoint and end; the run can be resumed later.
    Stop {
        #[serde(skip, default = "on_request")]
        reason: String,
    },
    /// Use another epsilon schedule.
    #[serde(rename = "epsilon")]
    SetSchedule { schedule: EpsilonSchedule },
    /// Use another action prior.
    #[serde(skip)]
    SetPrior(Arc<ActionPrior>),
}

/// Why a run stopped that somebody stopped, in this process or another one.
fn on_request() -> String {
    "on request".to_owned()
}

/// What the loop does after handling controls.
pub(super) enum Next {
    Continue,
    Stop(String),
}

/// Poll interval for requests of other processes during a pause.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

impl RunLoop<'_> {
    /// The reason of a received but not yet handled stop.
    pub(super) fn stop_received(&mut self) -> Option<String> {
        self.received.extend(self.controls.try_iter());
        self.received.iter().find_map(|control| match control {
            Control::Stop { reason } => Some(reason.clone()),
            _ => None,
        })
    }

    /// Handles the controls received since the last episode; blocks while paused.
    pub(super) fn handle_controls(&mut self, training: &mut Training) -> Result<Next> {
        let mut paused = false;
        loop {
            if !paused && self.pause_after.is_some_and(|episode| training.episode() >= episode) {
                paused = true;
                self.pause_after = None;
                self.pause(training)?;
            }
            self.take_requests(training.episode())?;
            let control = match self.received.pop_front() {
                Some(control) => control,
                None if paused => match self.controls.recv_timeout(POLL_INTERVAL) {
                    Ok(control) => control,
                    Err(RecvTimeoutError::Timeout) => continue,
                    // No control can arrive any more, so stop instead of waiting forever.
                    Err(RecvTimeoutError::Disconnected) => Control::Stop { reason: "the program ended".to_owned() },
                },
                None => match self.controls.try_recv() {
                    Ok(control) => control,
                    Err(_) => return Ok(Next::Continue),
                },
            };
            match control {
                Control::Stop { reason } => return Ok(Next::Stop(reason)),
                Control::Pause if !paused => {
                    paused = true;
                    self.pause(training)?;
                }
                Control::Pause => {}
                Control::Resume | Control::PauseAt(_) | Control::Advance { .. } => {
                    match control {
                        Control::PauseAt(episode) => self.pause_after = Some(episode),
                        Control::Advance { episodes } => {
                            self.pause_after = Some(training.episode() + u64::from(episodes.max(1)));
                        }
                        _ => {}
                    }
                    if std::mem::take(&mut paused) {
                        self.writer.record(&Event::Resumed { episode: training.episode() })?;
                        self.watch.phase.set(Phase::Training);
                    }
                }
                Control::SetSchedule { schedule } => {
                    let event = Event::ScheduleChanged { episode: training.episode(), schedule: schedule.to_string() };
                    self.writer.record(&event)?;
                    let needs = training.needs();
                    training.set_schedule(schedule);
                    self.record_needs(training, &needs)?;
                    self.changed(training, paused)?;
                }
                Control::SetPrior(prior) => {
                    self.record_prior(prior.clone(), training.episode(), true)?;
                    training.set_prior(prior);
                    self.changed(training, paused)?;
                }
            }
        }
    }

    /// Receives new requests of other processes after `episode` episodes.
    fn take_requests(&mut self, episode: u64) -> Result<(), RunError> {
        let (requests, problems) = match self.requests.poll() {
            Ok(found) => found,
            // Unreadable requests do not end a training.
            Err(error) => (Vec::new(), vec![error.to_string()]),
        };
        self.received.extend(requests);
        for problem in problems {
            let problem = format!("a request cannot be carried out: {problem}");
            // A file that cannot be read is found again and again.
            if self.warned.as_ref() != Some(&problem) {
                self.writer.record(&Event::Warned { episode, problem: problem.clone() })?;
                self.warned = Some(problem);
            }
        }
        Ok(())
    }

    /// Notes a change between two episodes; saves it at once during a pause.
    fn changed(&mut self, training: &Training, paused: bool) -> Result<()> {
        self.is_changed = true;
        if paused { self.save_now(training) } else { Ok(()) }
    }

    fn pause(&mut self, training: &Training) -> Result<()> {
        self.save_now(training)?;
        self.writer.record(&Event::Paused { episode: training.episode() })?;
        self.watch.phase.set(Phase::Paused);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn controls_of_other_processes_are_lines_of_json() {
        for (control, text) in [
            (Control::Pause, r#"{"request":"pause"}"#),
            (Control::Resume, r#"{"request":"resume"}"#),
            (Control::Advance { episodes: 3 }, r#"{"request":"advance","episodes":3}"#),
            (Control::Stop { reason: "here".to_owned() }, r#"{"request":"stop"}"#),
            (
                Control::SetSchedule { schedule: "linear:0.5:0:100".parse().unwrap() },
                r#"{"request":"epsilon","schedule":"linear:0.5:0:100"}"#,
            ),
        ] {
            assert_eq!(serde_json::to_string(&control).unwrap(), text);
            let read: Control = serde_json::from_str(text).unwrap();
            assert_eq!(serde_json::to_string(&read).unwrap(), text);
        }
        let stop: Control = serde_json::from_str(r#"{"request":"stop"}"#).unwrap();
        assert!(matches!(stop, Control::Stop { reason } if reason == "on request"));
        for other in [r#"{"request":"pause_at"}"#, r#"{"request":"epsilon","schedule":"up"}"#] {
            assert!(serde_json::from_str::<Control>(other).is_err());
        }
    }
}
