//! The Log screen: what happened, the latest line last, or those lines that matter or have some words.

use std::cell::Cell;

use ratatui::prelude::*;

use super::Ui;
use super::pane::{hint, level_style, pane};
use crate::tui::effect::Effect;
use crate::tui::layers::{Form, Value};
use crate::tui::view::{Level, LogLine};
use crate::tui::widgets::popup::wrap;

/// Columns of the time of day and the space after it.
const TIME: usize = 9;

/// The least levels to choose from, each with what the title says of it.
const LEVELS: [(Level, &str); 3] =
    [(Level::Info, ""), (Level::Good, " · successes, warnings and errors"), (Level::Warning, " · warnings and errors")];

/// Which lines of the log are shown.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct LogState {
    /// Number of lines after those that are shown; drawing limits it to what leaves a full page.
    pub selected: Cell<usize>,
    /// Number of lines so far when it was drawn last: those that come later do not move those that are read.
    drawn: Cell<usize>,
    /// Place of the least level.
    least: usize,
    /// Words that all lines have, in lower case.
    words: String,
}

impl LogState {
    /// Shows all lines from the latest one; false if they are shown already.
    pub fn leave(&mut self) -> bool {
        Self { drawn: Cell::default(), ..std::mem::take(self) } != Self::default()
    }

    /// Shows the lines from the next level on, or all of them after the last.
    pub fn next_level(&mut self) {
        self.selected.set(0);
        self.least = (self.least + 1) % LEVELS.len();
    }

    /// Asks for the words of the lines to show.
    pub fn ask_for_words(&self, ui: &Ui) -> Vec<Effect> {
        let least = self.least;
        let read = move |text: &str| {
            let words = text.trim().to_lowercase();
            Ok(Effect::call(move |app| app.screens.log = LogState { words, least, ..LogState::default() }))
        };
        let runs = ui.view.runs.iter().rev().map(|run| Value::new(&*run.name, &*run.label)).collect();
        let prompt = Form::prompt("show lines with", "words, such as the name of a run", &*self.words, read);
        vec![Effect::open(prompt.completing(runs).live(read))]
    }

    /// The lines that are shown, the oldest first.
    pub fn lines<'a>(&self, ui: &Ui<'a>) -> Vec<&'a LogLine> {
        ui.view.log.iter().filter(|line| self.shows(line, ui)).collect()
    }

    fn shows(&self, line: &LogLine, ui: &Ui) -> bool {
        let text = format!("{}{}", level_style(line.level, ui.theme).0, line.text).to_lowercase();
        line.level >= LEVELS[self.least].0 && self.words.split_whitespace().all(|word| text.contains(word))
    }

    fn title(&self) -> String {
        let (_, level) = LEVELS[self.least];
        let words = if self.words.is_empty() { String::new() } else { format!(" · with `{}`", self.words) };
        let all = if level.is_empty() && words.is_empty() { "" } else { ", esc shows all" };
        format!("log{level}{words}{all}")
    }
}

/// Draws the screen.
pub fn draw(log: &LogState, ui: &Ui, area: Rect, buffer: &mut Buffer) {
    let Ui { view, theme, .. } = *ui;
    let inside = pane(&log.title(), area, theme, buffer);
    if view.log.is_empty() {
        let text = "Nothing has happened yet. Everything you do and everything a run reports appears here.";
        return hint(text, inside, theme, buffer);
    }
    let shown = log.lines(ui);
    if shown.is_empty() {
        return hint("No line matches. Escape shows all.", inside, theme, buffer);
    }
    let LogState { selected, drawn, .. } = log;
    let fresh = view.log_total - drawn.replace(view.log_total).min(view.log_total);
    if selected.get() > 0 && fresh < view.log_total {
        let later = view.log.iter().rev().take(fresh).filter(|line| log.shows(line, ui));
        selected.set(selected.get() + later.count());
    }
    let of_entry = |entry: &&LogLine| {
        let (mark, style) = level_style(entry.level, theme);
        let time = entry.time.strftime("%H:%M:%S ").to_string();
        let times = std::iter::once(time).chain(std::iter::repeat(" ".repeat(TIME)));
        let text = wrap(&format!("{mark}{}", entry.text), usize::from(inside.width).saturating_sub(TIME));
        let line = |(time, text)| Line::from(vec![Span::styled(time, theme.faint()), Span::styled(text, style)]);
        times.zip(text).map(line).collect::<Vec<Line>>().into_iter().rev()
    };
    // The first lines fill the page.
    let height = usize::from(inside.height);
    let rows = shown.iter().enumerate().flat_map(|(place, entry)| of_entry(entry).map(move |_| place + 1));
    let first = rows.take(height).last().unwrap_or(0);
    let end = shown.len().saturating_sub(selected.get()).max(first);
    selected.set(shown.len() - end);
    let mut lines: Vec<Line> = shown[..end].iter().rev().flat_map(of_entry).take(height).collect();
    lines.reverse();
    Text::from(lines).render(inside, buffer);
}
