//! Signals as values that the event loop reads.

use std::io::{self, Write};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGCONT, SIGHUP, SIGQUIT, SIGTSTP, SIGWINCH};
use signal_hook::iterator::{Handle, Signals};

use mge_base::stop::{ENDING_SIGNALS, SAME_SIGNAL};

/// What a signal asks of the workbench.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Shut down cleanly; the number of the signal.
    Quit(i32),
    /// Restore the terminal and stop.
    Suspend,
    /// The process continues after a stop: take over the terminal again.
    Continue,
    /// The size of the terminal has changed.
    Resize,
}

/// Listens for signals until it is dropped.
pub struct Listener {
    requests: Receiver<Request>,
    noticed: Arc<AtomicBool>,
    handle: Handle,
}

/// How long the event loop may take to notice a hang-up.
const PATIENCE: Duration = Duration::from_secs(5);

impl Listener {
    /// Starts listening; the returned socket becomes readable when a request arrives. A second request
    /// to quit does not wait for the first: it restores the terminal and exits at once.
    ///
    /// # Errors
    /// When the signal handlers, the socket or the thread cannot be set up.
    pub fn start() -> io::Result<(Self, UnixStream)> {
        let (mut bell, wake) = UnixStream::pair()?;
        bell.set_nonblocking(true)?;
        wake.set_nonblocking(true)?;
        let mut signals = Signals::new(ENDING_SIGNALS)?;
        let handle = signals.handle();
        [SIGHUP, SIGQUIT, SIGTSTP, SIGCONT, SIGWINCH].into_iter().try_for_each(|signal| handle.add_signal(signal))?;
        let (sender, requests) = channel();
        let noticed = Arc::new(AtomicBool::new(false));
        let shared = Arc::clone(&noticed);
        thread::Builder::new().name("signals".to_owned()).spawn(move || {
            let noticed = shared;
            let mut asked_to_quit: Option<Instant> = None;
            for signal in signals.forever() {
                let request = match signal {
                    SIGTSTP => Request::Suspend,
                    SIGCONT => Request::Continue,
                    SIGWINCH => Request::Resize,
                    // A closed terminal often sends several, while edits and checkpoints are being saved.
                    SIGHUP => Request::Quit(signal),
                    _ => match asked_to_quit {
                        Some(at) if at.elapsed() >= SAME_SIGNAL => super::exit(128 + signal),
                        _ => Request::Quit(signal),
                    },
                };
                if matches!(request, Request::Quit(_)) {
                    asked_to_quit.get_or_insert_with(Instant::now);
                }
                if signal == SIGHUP {
                    end_if_stuck(&noticed);
                }
                if sender.send(request).is_err() {
                    return;
                }
                // A full socket is readable already.
                let _ = bell.write(&[0]);
            }
        })?;
        Ok((Self { requests, noticed, handle }, wake))
    }

    /// Notes that the workbench is shutting down: it is not stuck, however long its trainings take to end.
    pub fn set_leaving(&self) {
        self.noticed.store(true, Ordering::Release);
    }

    /// The next request, if there is one.
    pub fn next(&self) -> Option<Request> {
        let request = self.requests.try_recv().ok();
        if matches!(request, Some(Request::Quit(_))) {
            self.set_leaving();
        }
        request
    }
}

/// Exits if the event loop does not notice a hang-up in time: a read can block on a terminal that
/// hung up. The last checkpoint of each run remains intact.
fn end_if_stuck(noticed: &Arc<AtomicBool>) {
    let noticed = Arc::clone(noticed);
    let watch = move || {
        thread::sleep(PATIENCE);
        if !noticed.load(Ordering::Acquire) {
            std::process::exit(128 + SIGHUP);
        }
    };
    // If the thread cannot be started, there is only the normal shutdown.
    let _ = thread::Builder::new().name("hang-up".to_owned()).spawn(watch);
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.set_leaving();
        self.handle.close();
    }
}

/// Stops the whole foreground job, as Ctrl-Z in the terminal does: a program that waits for this
/// one stops too, and the shell shows its prompt.
///
/// # Errors
/// When the signal cannot be sent.
pub fn stop_job() -> io::Result<()> {
    rustix::process::kill_current_process_group(rustix::process::Signal::TSTP).map_err(io::Error::from)
}
