//! Handling of SIGINT and SIGTERM: the first signal asks the command to save its state and end, the
//! second ends the program at once. A command without state to save ends at the first signal.

use std::io;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use nix::sys::signal::{SigSet, SigmaskHow, Signal};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::{flag, low_level};

use super::output::{self, Outcome};
use super::progress::{self, Progress};
use crate::atomic;
use crate::batch::{Batch, BatchProgress, default_threads};

/// Makes the first signal end the program as soon as no file is being written. For work without state to
/// save, whose results are written atomically.
///
/// # Errors
/// When the handlers cannot be registered.
fn exit_on_first_signal() -> io::Result<()> {
    blocked(wait_for_the_end)
}

/// Runs work without state to save: the first signal ends it.
pub fn brief(work: impl FnOnce() -> Outcome) -> Outcome {
    exit_on_first_signal()?;
    work()
}

/// Runs `work` with SIGINT and SIGTERM blocked in this thread and in the threads that it starts.
pub fn blocked<T>(work: impl FnOnce() -> T) -> T {
    let signals: SigSet = [Signal::SIGINT, Signal::SIGTERM].into_iter().collect();
    // These calls fail only for an invalid operation on the mask.
    let before = signals.thread_swap_mask(SigmaskHow::SIG_BLOCK);
    let done = work();
    let _ = before.map(|before| before.thread_set_mask());
    done
}

fn wait_for_the_end() -> io::Result<()> {
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    let end = move || {
        let Some(number) = signals.forever().next() else { return };
        let _writes = atomic::end_writes();
        progress::clear();
        output::message("interrupted: run the same command again");
        low_level::exit(128 + number);
    };
    let waits = std::thread::Builder::new().name("mge-signals".to_owned()).spawn(end).is_ok();
    // Without the waiting thread, the first signal ends the program immediately.
    let ending = Arc::new(AtomicBool::new(!waits));
    for number in [SIGINT, SIGTERM] {
        // The second signal ends the program even if the terminal or the disk does not respond.
        flag::register_conditional_shutdown(number, 128 + number, ending.clone())?;
        flag::register(number, ending.clone())?;
    }
    Ok(())
}

/// Whether a signal has asked the command to end.
#[derive(Debug)]
pub struct Interrupt {
    requested: Arc<AtomicBool>,
    signal: Arc<AtomicUsize>,
}

impl Interrupt {
    /// Registers the handlers.
    ///
    /// # Errors
    /// When the handlers cannot be registered.
    pub fn listen() -> io::Result<Self> {
        // A signal that arrives between two registrations would be lost.
        blocked(Self::register)
    }

    fn register() -> io::Result<Self> {
        let (requested, signal) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
        for number in [SIGINT, SIGTERM] {
            // The shutdown handler runs before the flag is set, so only the second signal triggers it.
            flag::register_conditional_shutdown(number, 128 + number, requested.clone())?;
            flag::register(number, requested.clone())?;
            flag::register_usize(number, signal.clone(), number as usize)?;
        }
        Ok(Self { requested, signal })
    }

    /// Set once a signal has arrived; polled by long work.
    pub fn flag(&self) -> &AtomicBool {
        &self.requested
    }

    /// A shared handle of [`flag`](Self::flag).
    pub fn shared(&self) -> Arc<AtomicBool> {
        self.requested.clone()
    }

    /// Whether a signal has arrived.
    pub fn is_requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }

    /// The result of work that polls the flag. An error that satisfies `is_interruption` becomes
    /// [`Interrupted`]; its text should tell the user how to continue.
    ///
    /// # Errors
    /// [`Interrupted`], or the error unchanged.
    pub fn result<T, E: std::error::Error + 'static>(
        &self,
        result: Result<T, E>,
        is_interruption: impl FnOnce(&E) -> bool,
    ) -> Result<T, Box<dyn std::error::Error>> {
        result.map_err(|error| match is_interruption(&error) {
            true => self.ended(error.to_string()).into(),
            false => error.into(),
        })
    }

    /// The error of a command ended by the signal; `message` tells the user how to continue.
    pub fn ended(&self, message: String) -> Interrupted {
        Interrupted { signal: self.signal.load(Ordering::Relaxed), message }
    }
}

/// A command was ended by a signal.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct Interrupted {
    signal: usize,
    message: String,
}

impl Interrupted {
    /// The exit status for the signal: 130 or 143.
    pub fn status(&self) -> ExitCode {
        ExitCode::from(128 + (self.signal & 0x7f) as u8)
    }
}

/// Runs a batch with progress. A signal ends it cleanly; its error then satisfies `is_interruption`.
pub fn in_batch<T, E: std::error::Error + 'static>(
    threads: Option<usize>,
    quiet: bool,
    work: impl FnOnce(&Batch<'_>, &mut dyn FnMut(&BatchProgress<'_>)) -> Result<T, E>,
    is_interruption: impl FnOnce(&E) -> bool,
) -> Result<T, Box<dyn std::error::Error>> {
    let mut progress = Progress::new(1, quiet);
    let interrupt = Interrupt::listen()?;
    let batch = Batch { threads: threads.unwrap_or_else(default_threads), interrupt: interrupt.flag() };
    let outcome = work(&batch, &mut |now| {
        if let Some((name, reason)) = now.failure {
            progress.say(&format!("{name} failed: {reason}"));
        }
        let failed = if now.failed > 0 { format!(", {} failed", now.failed) } else { String::new() };
        let message = match now.message {
            "" => format!("{} of {} done", now.ended - now.failed, now.jobs),
            message => message.to_owned(),
        };
        progress.set(now.done, now.total, &(message + &failed));
    });
    drop(progress);
    interrupt.result(outcome, is_interruption)
}
