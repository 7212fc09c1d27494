//! Handling of [`ENDING_SIGNALS`], and of SIGHUP from a closing terminal: the first signal asks the command to save its
//! state and end, a second one ends the program at once. A command without state to save does not listen: the first signal
//! ends it, and its files are written atomically.

use std::io;
use std::num::NonZeroUsize;
use std::process::ExitCode;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicI32, Ordering};
use std::thread;
use std::time::Instant;

use nix::sys::signal::{SigSet, SigmaskHow, Signal};
use signal_hook::consts::SIGHUP;
use signal_hook::iterator::Signals;
use signal_hook::low_level;

use super::arguments::Jobs;
use super::output::Outcome;
use super::progress::Progress;
use mge_base::stop::{ENDING_SIGNALS, SAME_SIGNAL, Stop};
use mge_experiments::ExperimentError;
use mge_trainer::batch::{Batch, BatchProgress};

/// Whether a signal has asked the program to end: one for the whole program, so that no signal is lost between two
/// parts of a command.
#[derive(Debug, Default)]
pub struct Interrupt {
    /// Requested once a signal has arrived; polled by long work.
    pub stop: Stop,
    /// The first signal.
    signal: AtomicI32,
}

static INTERRUPT: LazyLock<Interrupt> = LazyLock::new(Interrupt::default);

impl Interrupt {
    /// Registers the handlers, unless they are.
    ///
    /// # Errors
    /// When the handlers cannot be registered.
    pub fn listen() -> io::Result<&'static Self> {
        static REGISTERED: LazyLock<io::Result<()>> = LazyLock::new(|| blocked(register));
        match &*REGISTERED {
            Ok(()) => Ok(&INTERRUPT),
            Err(error) => Err(io::Error::new(error.kind(), error.to_string())),
        }
    }

    /// Notes the first signal.
    fn receive(&self, number: i32) {
        self.signal.store(number, Ordering::SeqCst);
        self.stop.request();
    }

    /// The result of work that polls the flag. After a signal, an error that satisfies `is_interruption` becomes
    /// [`Interrupted`]; its text should tell the user how to continue.
    ///
    /// # Errors
    /// [`Interrupted`], or the error unchanged.
    pub fn result<T, E: std::error::Error + 'static>(
        &self,
        result: Result<T, E>,
        is_interruption: impl FnOnce(&E) -> bool,
    ) -> Result<T, Box<dyn std::error::Error>> {
        result.map_err(|error| match self.stop.is_requested() && is_interruption(&error) {
            true => self.ended(error.to_string()).into(),
            false => error.into(),
        })
    }

    /// The error of a command ended by the signal; `message` tells the user how to continue.
    pub fn ended(&self, message: String) -> Interrupted {
        Interrupted { signal: self.signal.load(Ordering::SeqCst), message }
    }
}

/// Whether SIGHUP ends the program: not if the process was started with the signal ignored, as by `nohup`, which only
/// Linux tells.
fn ends_at_hang_up() -> bool {
    let is_ignored = |status: String| {
        let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"))?;
        Some(u64::from_str_radix(mask.trim(), 16).ok()? & 1 << (SIGHUP - 1) != 0)
    };
    let status = std::fs::read_to_string("/proc/self/status").ok();
    status.and_then(is_ignored) == Some(false)
}

/// Runs `work` with the signals blocked: one that arrived while the handlers are being registered would be lost.
fn blocked<T>(work: impl FnOnce() -> T) -> T {
    let signals: SigSet = ENDING_SIGNALS.into_iter().filter_map(|number| Signal::try_from(number).ok()).collect();
    // These calls fail only for an invalid operation on the mask.
    let before = signals.thread_swap_mask(SigmaskHow::SIG_BLOCK);
    let done = work();
    let _ = before.map(|before| before.thread_set_mask());
    done
}

/// Starts the thread that receives the signals.
fn register() -> io::Result<()> {
    let hang_up = Some(SIGHUP).filter(|_| ends_at_hang_up());
    let mut signals = Signals::new(ENDING_SIGNALS.into_iter().chain(hang_up))?;
    let receive = move || {
        let mut first = None;
        for number in signals.forever() {
            match first {
                None => INTERRUPT.receive(number),
                Some(at) if Instant::elapsed(&at) < SAME_SIGNAL => {}
                // A closing terminal may send several, while the work is being saved.
                Some(_) if number == SIGHUP => {}
                Some(_) => low_level::exit(128 + number),
            }
            first = first.or_else(|| Some(Instant::now()));
        }
    };
    let started = thread::Builder::new().name("mge-signals".to_owned()).spawn(receive).map(drop);
    started.map_err(|error| io::Error::new(error.kind(), format!("cannot start a thread: {error}")))
}

/// A command was ended by a signal.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct Interrupted {
    signal: i32,
    message: String,
}

impl Interrupted {
    /// The exit status for the signal, such as 130 for SIGINT.
    pub fn status(&self) -> ExitCode {
        ExitCode::from(128 + (self.signal & 0x7f) as u8)
    }
}

/// Runs a batch with progress. A signal ends it cleanly.
pub fn in_batch<T>(jobs: &Jobs, work: impl FnOnce(&mut Batch<'_>) -> Result<T, ExperimentError>) -> Outcome<T> {
    let mut progress = Progress::new(1, jobs.quiet);
    let interrupt = Interrupt::listen()?;
    let threads = jobs.threads.unwrap_or_else(|| thread::available_parallelism().map_or(1, NonZeroUsize::get));
    let on_progress = &mut |now: &BatchProgress<'_>| {
        if let Some((name, reason)) = now.failure {
            progress.say(&format!("{name}: {reason}"));
        }
        let failed = if now.failed > 0 { format!(", {} not finished", now.failed) } else { String::new() };
        let message = match now.message {
            "" => format!("{} of {} done", now.ended - now.failed, now.jobs),
            message => message.to_owned(),
        };
        progress.set(now.done, now.total, &(message + &failed));
    };
    let outcome = work(&mut Batch { threads, interrupt: &interrupt.stop, on_progress });
    drop(progress);
    interrupt.result(outcome, |error| matches!(error, ExperimentError::Interrupted { .. }))
}
