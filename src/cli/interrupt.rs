//! SIGINT and SIGTERM while a command works: the first asks it to end in good order, so that
//! nothing is lost; a second one ends the program at once. A command that has nothing to save ends
//! at the first.

use std::io;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use nix::sys::signal::{SigSet, SigmaskHow, Signal};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::{flag, low_level};

use super::{output, progress};
use crate::atomic;

/// From now on the first signal ends the program, as soon as no file is being written: for work whose
/// result is there whole or not at all.
///
/// # Errors
/// When the system refuses the handlers.
pub fn end_at_once() -> io::Result<()> {
    undisturbed(wait_for_the_end)
}

/// Registers handlers while the signals are held back: one that came between two of them would be lost.
fn undisturbed<T>(register: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
    let signals: SigSet = [Signal::SIGINT, Signal::SIGTERM].into_iter().collect();
    let before = signals.thread_swap_mask(SigmaskHow::SIG_BLOCK)?;
    let registered = register();
    before.thread_set_mask()?;
    registered
}

fn wait_for_the_end() -> io::Result<()> {
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    let end = move || {
        let Some(number) = signals.forever().next() else { return };
        let _writes = atomic::end_writes();
        progress::clear();
        output::message("interrupted: the same command begins again");
        low_level::exit(128 + number);
    };
    let waits = std::thread::Builder::new().name("mge-signals".to_owned()).spawn(end).is_ok();
    // Without a thread that waits for the first signal, that one ends the program here and now.
    let ending = Arc::new(AtomicBool::new(!waits));
    for number in [SIGINT, SIGTERM] {
        // Nobody is to wait for a terminal or a disk that does not answer.
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
    /// Begins to listen.
    ///
    /// # Errors
    /// When the system refuses the handlers.
    pub fn listen() -> io::Result<Self> {
        undisturbed(Self::register)
    }

    fn register() -> io::Result<Self> {
        let (requested, signal) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
        for number in [SIGINT, SIGTERM] {
            // In this order: the first signal finds the flag unset.
            flag::register_conditional_shutdown(number, 128 + number, requested.clone())?;
            flag::register(number, requested.clone())?;
            flag::register_usize(number, signal.clone(), number as usize)?;
        }
        Ok(Self { requested, signal })
    }

    /// Set once a signal has come, for those who look at it while they work.
    pub fn flag(&self) -> &AtomicBool {
        &self.requested
    }

    /// [`flag`](Self::flag) for those who outlive this value.
    pub fn shared(&self) -> Arc<AtomicBool> {
        self.requested.clone()
    }

    /// Whether a signal has come.
    pub fn is_requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }

    /// The result of work that looks at the flag: ended by the signal if `is_interruption` says so of
    /// its error, whose text then says how to continue.
    ///
    /// # Errors
    /// [`Interrupted`], or the error as it is.
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

    /// What a command returns that has ended because of the signal; `message` says how to go on.
    pub fn ended(&self, message: String) -> Interrupted {
        Interrupted { signal: self.signal.load(Ordering::Relaxed), message }
    }
}

/// A command ended because a signal asked for it.
#[derive(Debug, thiserror::Error)]
#[error("{message}")]
pub struct Interrupted {
    signal: usize,
    message: String,
}

impl Interrupted {
    /// The status that says which signal it was: 130 or 143.
    pub fn status(&self) -> ExitCode {
        ExitCode::from(128 + (self.signal & 0x7f) as u8)
    }
}
