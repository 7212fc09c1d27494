//! The only reader of standard input: waits for bytes and parses them.
//!
//! Waiting is level-triggered: if bytes are left over, the next wait returns at once.

use std::io::{self, Read};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::parser::{Parser, Received};

/// How long to wait for the rest of an escape sequence before it counts as the Escape key.
const ESCAPE_TIMEOUT: Duration = Duration::from_millis(25);
/// The same for the rest of a string, which the network may delay.
const STRING_TIMEOUT: Duration = Duration::from_secs(1);
/// Bytes after which a call of [`Input::wait`] stops reading, so that a frame can be drawn.
const MAX_BYTES_PER_WAIT: usize = 1 << 18;

/// Standard input, and a socket through which signals end a wait.
pub struct Input {
    parser: Parser,
    /// When the latest byte arrived.
    latest: Instant,
    /// When a read last ended outside a string.
    outside: Instant,
    wake: UnixStream,
}

impl Input {
    /// Input that also wakes up when `wake` becomes readable.
    pub fn new(wake: UnixStream) -> Self {
        Self { parser: Parser::default(), latest: Instant::now(), outside: Instant::now(), wake }
    }

    /// Waits for input, at most for `time`, and appends the parsed events to `received`. False if
    /// the terminal has hung up.
    ///
    /// # Errors
    /// When polling or reading fails.
    pub fn wait(&mut self, time: Duration, received: &mut Vec<Received>) -> io::Result<bool> {
        let time = if self.parser.is_partial() { time.min(self.patience()) } else { time };
        let mut ready = self.poll(time)?;
        let mut read = 0;
        while ready == Ready::Bytes && read < MAX_BYTES_PER_WAIT {
            let mut bytes = [0; 4096];
            match rustix::io::read(rustix::stdio::stdin(), &mut bytes) {
                Ok(0) => return Ok(false),
                Ok(count) => {
                    self.latest = Instant::now();
                    self.parser.advance(&bytes[..count], received);
                    if !self.parser.is_in_string() {
                        self.outside = self.latest;
                    }
                    read += count;
                }
                Err(rustix::io::Errno::INTR | rustix::io::Errno::AGAIN) => {}
                Err(error) => return Err(error.into()),
            }
            ready = self.poll(Duration::ZERO)?;
        }
        if read == 0 && self.patience().is_zero() {
            self.parser.flush(received);
        }
        Ok(ready != Ready::HungUp)
    }

    /// How long to wait for the rest of a sequence or string. Keys typed after a string without an end are lost only
    /// for the time of [`STRING_TIMEOUT`].
    fn patience(&self) -> Duration {
        let quiet = ESCAPE_TIMEOUT.saturating_sub(self.latest.elapsed());
        let string = if self.parser.is_in_string() { STRING_TIMEOUT } else { Duration::ZERO };
        quiet.max(string.saturating_sub(self.outside.elapsed()))
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
            // Empty the non-blocking socket; its contents do not matter.
            let _ = (&self.wake).read(&mut [0; 64]);
        }
        Ok(if found.intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL) {
            Ready::HungUp
        } else if found.contains(PollFlags::IN) {
            Ready::Bytes
        } else {
            Ready::Nothing
        })
    }
}

/// State of standard input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ready {
    Nothing,
    Bytes,
    HungUp,
}
