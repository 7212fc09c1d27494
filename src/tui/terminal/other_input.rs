//! Input on platforms other than Unix: crossterm's own reader.

use std::io;
use std::time::Duration;

use crossterm::event::{poll, read};

use super::Received;

/// Standard input.
pub struct Input;

impl Input {
    /// Waits for input, at most for `time`, and appends the events to `received`.
    ///
    /// # Errors
    /// When polling or reading fails.
    pub fn wait(&mut self, time: Duration, received: &mut Vec<Received>) -> io::Result<bool> {
        let mut time = time;
        while poll(time)? {
            received.push(Received::Event(read()?));
            time = Duration::ZERO;
        }
        Ok(true)
    }
}
