//! Progress display: a bar on a terminal, lines elsewhere, nothing if quiet.

use std::io::{IsTerminal, stderr};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::output;
use mge_base::sync::lock;
use mge_trainer::Phase;

/// Time between two lines when not on a terminal.
const LINE_EVERY: Duration = Duration::from_secs(60);

/// The bar currently on the terminal.
static SHOWN: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Clears the current bar, if any, before a final message.
pub(super) fn clear() {
    if let Some(bar) = &*lock(&SHOWN) {
        bar.finish_and_clear();
    }
}

/// A progress bar or its substitute, on stderr.
pub struct Progress {
    bar: Option<ProgressBar>,
    quiet: bool,
    /// The time of the first update and the steps done then, which belong to earlier work.
    first: Option<(Instant, u64)>,
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
        if let Some(bar) = &bar {
            *lock(&SHOWN) = Some(bar.clone());
        }
        Self { bar, quiet, first: None, last_line: Instant::now() }
    }

    /// Shows `done` of `length` steps and a message.
    pub fn set(&mut self, done: u64, length: u64, message: &str) {
        let is_first = self.first.is_none();
        let first = *self.first.get_or_insert_with(|| (Instant::now(), done));
        if let Some(bar) = &self.bar {
            bar.set_length(length);
            bar.set_position(done);
            if is_first {
                bar.reset_eta();
            }
            bar.set_message(output::shown(message));
        } else if !self.quiet && self.last_line.elapsed() >= LINE_EVERY {
            self.last_line = Instant::now();
            output::message(format_args!("{done}/{length} {message}{}", time_left(first, done, length)));
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

fn time_left((started, first): (Instant, u64), done: u64, length: u64) -> String {
    let elapsed = started.elapsed().as_secs_f64();
    // The estimate of the first seconds is unreliable.
    if done <= first || elapsed < 5.0 {
        return String::new();
    }
    let seconds = elapsed / (done - first) as f64 * length.saturating_sub(done) as f64;
    format!(" (about {} left)", indicatif::HumanDuration(Duration::from_secs_f64(seconds)))
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
