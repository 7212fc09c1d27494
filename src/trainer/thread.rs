//! A training on a thread of its own.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::JoinHandle;

use crossbeam_channel::{Sender, unbounded};

use super::panic_message;
use super::run_loop::{Control, Ending, train};
use super::watch::{Phase, Watch};
use crate::run::RunDirectory;

/// A handle on a training thread. Dropping it stops the training, at the end of its episode or,
/// where episodes take long, before the one that goes on, and waits for its checkpoint.
#[derive(Debug)]
pub struct Trainer {
    controls: Sender<Control>,
    watch: Arc<Watch>,
    thread: Option<JoinHandle<Result<Ending, String>>>,
}

impl Trainer {
    /// Starts or continues the run in `directory` with controls that take effect before its next
    /// episode, however fast it is.
    ///
    /// # Errors
    /// When the system has no more threads.
    pub fn spawn(directory: RunDirectory, first: impl IntoIterator<Item = Control>) -> std::io::Result<Self> {
        let (controls, receiver) = unbounded();
        for control in first {
            // The receiver lives.
            let _ = controls.send(control);
        }
        let watch = Arc::new(Watch::default());
        let seen = watch.clone();
        let work = move || {
            let outcome = catch_unwind(AssertUnwindSafe(|| train(&directory, &receiver, &seen)));
            seen.set_phase(Phase::Ended);
            match outcome {
                Ok(outcome) => outcome.map_err(|error| error.to_string()),
                Err(panic) => Err(format!("the training panicked: {}", panic_message(&*panic))),
            }
        };
        let thread = std::thread::Builder::new().name("mge-trainer".to_owned()).spawn(work)?;
        Ok(Self { controls, watch, thread: Some(thread) })
    }

    /// What observers see.
    pub fn watch(&self) -> &Watch {
        &self.watch
    }

    /// Asks for something; has no effect once the training has ended.
    pub fn send(&self, control: Control) {
        let stops = matches!(control, Control::Stop { .. });
        let _ = self.controls.send(control);
        // Afterwards: who sees it finds the control.
        if stops {
            self.watch.note_stop();
        }
    }

    /// Whether the thread still works.
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
