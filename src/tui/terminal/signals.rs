//! Signals as values that the event loop reads.

use std::io::{self, Write};
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use signal_hook::consts::{SIGCONT, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP, SIGWINCH};
use signal_hook::iterator::{Handle, Signals};

/// What a signal asks of the workbench.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Leave in good order; the number of the signal.
    Quit(i32),
    /// Give the terminal back and stop.
    Suspend,
    /// The process goes on after a stop: take the terminal again.
    Continue,
    /// The terminal has another size.
    Resize,
}

/// Listens for signals until it is dropped.
pub struct Listener {
    requests: Receiver<Request>,
    noticed: Arc<AtomicBool>,
    handle: Handle,
}

/// How long the event loop may take to notice that the terminal is gone.
const PATIENCE: Duration = Duration::from_secs(5);

impl Listener {
    /// Starts to listen; the returned pipe can be read when a request has come. A second request to
    /// quit does not wait for the first: it restores the terminal and ends the process at once.
    ///
    /// # Errors
    /// When the system refuses the handlers.
    pub fn start() -> io::Result<(Self, UnixStream)> {
        let (mut bell, wake) = UnixStream::pair()?;
        bell.set_nonblocking(true)?;
        wake.set_nonblocking(true)?;
        let mut signals = Signals::new([SIGTERM, SIGINT, SIGHUP, SIGQUIT, SIGTSTP, SIGCONT, SIGWINCH])?;
        let handle = signals.handle();
        let (sender, requests) = channel();
        let noticed = Arc::new(AtomicBool::new(false));
        let shared = Arc::clone(&noticed);
        thread::Builder::new().name("signals".to_owned()).spawn(move || {
            let noticed = shared;
            let mut asked_to_quit = false;
            for signal in signals.forever() {
                let request = match signal {
                    SIGTSTP => Request::Suspend,
                    SIGCONT => Request::Continue,
                    SIGWINCH => Request::Resize,
                    _ if asked_to_quit => {
                        super::leave();
                        std::process::exit(128 + signal);
                    }
                    _ => Request::Quit(signal),
                };
                asked_to_quit |= matches!(request, Request::Quit(_));
                if signal == SIGHUP {
                    end_if_stuck(&noticed);
                }
                if sender.send(request).is_err() {
                    return;
                }
                // A bell that is full rings already.
                let _ = bell.write(&[0]);
            }
        })?;
        Ok((Self { requests, noticed, handle }, wake))
    }

    /// The workbench is being left: nobody is stuck, however long its trainings take to end.
    pub fn note_leaving(&self) {
        self.noticed.store(true, Ordering::Relaxed);
    }

    /// The next request, if there is one.
    pub fn next(&self) -> Option<Request> {
        let request = self.requests.try_recv().ok();
        if matches!(request, Some(Request::Quit(_))) {
            self.note_leaving();
        }
        request
    }
}

/// Ends the process if the event loop does not notice a hang-up: a terminal that goes
/// away while it is being read keeps the reader reading. The run's last checkpoint is whole.
fn end_if_stuck(noticed: &Arc<AtomicBool>) {
    let noticed = Arc::clone(noticed);
    let watch = move || {
        thread::sleep(PATIENCE);
        if !noticed.load(Ordering::Relaxed) {
            std::process::exit(128 + SIGHUP);
        }
    };
    // Without a thread there is only the ordinary way out.
    let _ = thread::Builder::new().name("hang-up".to_owned()).spawn(watch);
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.note_leaving();
        self.handle.close();
    }
}

/// Stops the whole foreground job, as the terminal's own Ctrl-Z would: a program that
/// waits for this one stops too, and the shell gets its prompt back.
///
/// # Errors
/// When the system refuses.
pub fn stop_job() -> io::Result<()> {
    rustix::process::kill_current_process_group(rustix::process::Signal::TSTP).map_err(io::Error::from)
}
