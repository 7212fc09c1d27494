//! The one owner of standard input: it alone waits for bytes, reads them and says what they mean.
//!
//! Waiting is level-triggered: bytes that are left for the next turn end its wait at once.

use std::io::{self, Read};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::Received;
use super::parser::Parser;

/// How long a sequence may be without its rest: what takes longer is the Escape key.
const GRACE: Duration = Duration::from_millis(25);
/// Bytes that are read in one turn; what is more waits until a picture was drawn.
const TURN: usize = 1 << 18;

/// Standard input, and a pipe by which signals end a wait.
pub struct Input {
    parser: Parser,
    /// When the latest byte came.
    latest: Instant,
    wake: UnixStream,
}

impl Input {
    /// Input that also wakes up when `wake` can be read.
    pub fn new(wake: UnixStream) -> Self {
        Self { parser: Parser::default(), latest: Instant::now(), wake }
    }

    /// Waits until something comes, at most for `time`, and takes in what is there. False if the
    /// terminal is gone.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn wait(&mut self, time: Duration, received: &mut Vec<Received>) -> io::Result<bool> {
        let partial = self.parser.is_partial();
        let time = if partial { time.min(GRACE.saturating_sub(self.latest.elapsed())) } else { time };
        let mut there = self.poll(time)?;
        let mut read = 0;
        while there == Ready::Bytes && read < TURN {
            let mut bytes = [0; 4096];
            match rustix::io::read(rustix::stdio::stdin(), &mut bytes) {
                Ok(0) => return Ok(false),
                Ok(count) => {
                    self.latest = Instant::now();
                    self.parser.advance(&bytes[..count], received);
                    read += count;
                }
                Err(rustix::io::Errno::INTR | rustix::io::Errno::AGAIN) => {}
                Err(error) => return Err(error.into()),
            }
            there = self.poll(Duration::ZERO)?;
        }
        if read == 0 && self.latest.elapsed() >= GRACE {
            self.parser.flush(received);
        }
        Ok(there != Ready::Gone)
    }

    fn poll(&mut self, time: Duration) -> io::Result<Ready> {
        let input = rustix::stdio::stdin();
        let mut wanted = [PollFd::new(&input, PollFlags::IN), PollFd::new(&self.wake, PollFlags::IN)];
        let time = Timespec { tv_sec: time.as_secs() as i64, tv_nsec: i64::from(time.subsec_nanos()) };
        match poll(&mut wanted, Some(&time)) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
        let [found, woken] = [0, 1].map(|index| wanted[index].revents());
        if woken.contains(PollFlags::IN) {
            // It has done what it is for; it does not block.
            let _ = (&self.wake).read(&mut [0; 64]);
        }
        Ok(if found.intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL) {
            Ready::Gone
        } else if found.contains(PollFlags::IN) {
            Ready::Bytes
        } else {
            Ready::Nothing
        })
    }
}

/// What there is to read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ready {
    Nothing,
    Bytes,
    Gone,
}
