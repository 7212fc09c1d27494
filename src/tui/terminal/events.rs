//! What the event loop waits for: input of the terminal, and signals as values.

use std::io;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Instant;

use crossterm::event;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use signal_hook::consts::{SIGCONT, SIGHUP, SIGQUIT, SIGTSTP};
use signal_hook::iterator::Signals;

use mge_base::stop::{ENDING_SIGNALS, SAME_SIGNAL};

/// Something to handle.
#[derive(Debug)]
pub enum Event {
    /// Input of the terminal, or why it cannot be read.
    Input(io::Result<event::Event>),
    /// Shut down cleanly; the number of the signal.
    Quit(i32),
    /// Restore the terminal and stop.
    Suspend,
    /// The process continues after a stop: take over the terminal again.
    Continue,
}

/// Starts listening for signals. A second request to quit does not wait for the first: it restores the terminal and
/// exits at once.
///
/// # Errors
/// When the signal handlers or the thread cannot be set up.
pub fn listen() -> io::Result<(Sender<Event>, Receiver<Event>)> {
    let mut signals = Signals::new(ENDING_SIGNALS.into_iter().chain([SIGHUP, SIGQUIT, SIGTSTP, SIGCONT]))?;
    let (sender, receiver) = channel();
    let events = sender.clone();
    let forward = move || {
        let mut asked_to_quit: Option<Instant> = None;
        for signal in signals.forever() {
            let event = match signal {
                SIGTSTP => Event::Suspend,
                SIGCONT => Event::Continue,
                // A closed terminal often sends several, while edits and checkpoints are being saved.
                SIGHUP => Event::Quit(signal),
                _ if asked_to_quit.is_some_and(|at| at.elapsed() >= SAME_SIGNAL) => super::exit(128 + signal),
                _ => Event::Quit(signal),
            };
            if matches!(event, Event::Quit(_)) {
                asked_to_quit.get_or_insert_with(Instant::now);
            }
            // Nobody listens any more once the workbench is being left; a second signal still ends the program.
            let _ = sender.send(event);
        }
    };
    thread::Builder::new().name("signals".to_owned()).spawn(forward)?;
    Ok((events, receiver))
}

/// Starts reading the terminal on a thread of its own, because a read waits for the rest of a sequence.
///
/// # Errors
/// When the thread cannot be started.
pub fn read_input(events: Sender<Event>) -> io::Result<()> {
    let read = move || {
        loop {
            let input = event::read();
            let is_over = input.is_err();
            if events.send(Event::Input(input)).is_err() || is_over {
                return;
            }
        }
    };
    thread::Builder::new().name("input".to_owned()).spawn(read).map(drop)
}

/// Whether the terminal has hung up.
pub fn is_hung_up() -> bool {
    let input = rustix::stdio::stdin();
    let mut wanted = [PollFd::new(&input, PollFlags::IN)];
    let found = poll(&mut wanted, Some(&Timespec { tv_sec: 0, tv_nsec: 0 }));
    found.is_ok() && wanted[0].revents().intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL)
}

/// Stops the whole foreground job, as Ctrl-Z in the terminal does: a program that waits for this
/// one stops too, and the shell shows its prompt.
///
/// # Errors
/// When the signal cannot be sent.
pub fn stop_job() -> io::Result<()> {
    rustix::process::kill_current_process_group(rustix::process::Signal::TSTP).map_err(io::Error::from)
}
