//! A training on its own thread.

use std::sync::Arc;
use std::thread::JoinHandle;

use crossbeam_channel::{Sender, unbounded};

use super::panic_message;
use super::run_loop::{Control, Ending, train};
use super::watch::{Phase, Watch};
use mge_run::RunDirectory;

/// A handle to a training thread. Dropping it stops the training and waits for its checkpoint. The
/// current episode is completed first, unless it takes long; then it is abandoned.
#[derive(Debug)]
pub struct Trainer {
    controls: Sender<Control>,
    /// The state for observers.
    pub watch: Arc<Watch>,
    thread: Option<JoinHandle<Result<Ending, String>>>,
}

impl Trainer {
    /// Starts or continues the run in `directory`. The controls `first` are guaranteed to take effect
    /// before the next episode.
    ///
    /// # Errors
    /// When the system cannot create a thread.
    pub fn spawn(directory: RunDirectory, first: impl IntoIterator<Item = Control>) -> std::io::Result<Self> {
        let (controls, receiver) = unbounded();
        for control in first {
            // Cannot fail: the receiver still exists.
            let _ = controls.send(control);
        }
        let watch = Arc::new(Watch::default());
        let seen = watch.clone();
        let work = move || {
            let outcome = train(&directory, &receiver, &seen).map_err(|error| error.to_string());
            seen.phase.set(Phase::Ended);
            outcome
        };
        let thread = std::thread::Builder::new().name("mge-trainer".to_owned()).spawn(work)?;
        Ok(Self { controls, watch, thread: Some(thread) })
    }

    /// Sends a control; has no effect once the training has ended.
    pub fn send(&self, control: Control) {
        let stops = matches!(control, Control::Stop { .. });
        let _ = self.controls.send(control);
        // Only after sending, so that the trainer finds the control when it sees the flag.
        if stops {
            self.watch.stop.request();
        }
    }

    /// Whether the thread is still running.
    pub fn is_active(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Waits for the end.
    ///
    /// # Errors
    /// The error, or the panic, that ended the training, in one line.
    pub fn join(mut self) -> Result<Ending, String> {
        self.finish().unwrap_or(Ok(Ending::Stopped))
    }

    /// The outcome, once the thread has ended.
    pub fn outcome(&mut self) -> Option<Result<Ending, String>> {
        if self.is_active() { None } else { self.finish() }
    }

    fn finish(&mut self) -> Option<Result<Ending, String>> {
        let thread = self.thread.take()?;
        Some(thread.join().unwrap_or_else(|panic| Err(format!("the training panicked: {}", panic_message(&*panic)))))
    }
}

impl Drop for Trainer {
    fn drop(&mut self) {
        self.send(Control::Stop { reason: "the program ended".to_owned() });
        self.finish();
    }
}
