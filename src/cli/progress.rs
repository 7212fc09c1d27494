//! Progress display: a bar on a terminal, lines elsewhere, nothing if quiet.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::output;
use mge_trainer::Phase;

/// Time between two lines when not on a terminal.
const LINE_EVERY: Duration = Duration::from_secs(60);

/// A progress bar or its substitute, on stderr.
pub struct Progress {
    bar: Option<ProgressBar>,
    quiet: bool,
    /// Nothing was shown yet: the steps of the first update belong to earlier work.
    is_new: bool,
    last_line: Instant,
}

impl Progress {
    /// Progress over `length` steps.
    pub fn new(length: u64, quiet: bool) -> Self {
        let on_terminal = !quiet && stderr().is_terminal();
        let bar = on_terminal.then(|| {
            let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
            // The template is constant and valid.
            let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {msg} ({eta} left)");
            bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
        });
        Self { bar, quiet, is_new: true, last_line: Instant::now() }
    }

    /// Shows `done` of `length` steps and a message.
    pub fn set(&mut self, done: u64, length: u64, message: &str) {
        let is_first = std::mem::take(&mut self.is_new);
        if let Some(bar) = &self.bar {
            bar.set_length(length);
            bar.set_position(done);
            if is_first {
                bar.reset_eta();
            }
            bar.set_message(output::shown(message));
        } else if !self.quiet && self.last_line.elapsed() >= LINE_EVERY {
            self.last_line = Instant::now();
            output::message(format_args!("{done}/{length} {message}"));
        }
    }

    /// Shows how far a phase before the first episode is, if that can be counted.
    pub fn show(&mut self, phase: &Phase) {
        if let Some((done, total, parts)) = phase.progress() {
            self.set(done as u64, total as u64, parts);
        }
    }

    /// Prints a warning, even if quiet: it is no progress.
    pub fn warn(&self, text: &str) {
        let line = format!("warning: {text}");
        match &self.bar {
            Some(bar) => bar.println(output::shown(&line)),
            None => output::message(line),
        }
    }

    /// Prints a permanent line.
    pub fn say(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.println(output::shown_lines(line)),
            None if self.quiet => {}
            None => output::message_lines(line),
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
