//! Input where there are no Unix terminals: the library's own reader.

use std::io;
use std::time::Duration;

use crossterm::event::{poll, read};

use super::Received;

/// Standard input.
pub struct Input;

impl Input {
    /// Waits until something comes, at most for `time`, and takes in what is there.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn wait(&mut self, time: Duration, received: &mut Vec<Received>) -> io::Result<bool> {
        let mut time = time;
        while poll(time)? {
            received.push(Received::Event(read()?));
            time = Duration::ZERO;
        }
        Ok(true)
    }
}
