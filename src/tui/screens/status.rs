//! The status pane: what is set, what is known, what is going on.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};

use super::Ui;
use super::pane::pane;
use crate::run::{Metric, RunState};
use crate::tui::actions::{Action, Context};
use crate::tui::chart::number;
use crate::tui::view::{RunSummary, span};
use crate::tui::widgets::columns::shortened;
use crate::tui::widgets::popup::wrap;
use crate::tui::widgets::theme::{Marker, Theme};
use crate::workbench::PriorState;

/// Draws the pane.
pub fn draw(ui: &Ui, area: Rect, buffer: &mut Buffer) {
    if area.height < 3 {
        return;
    }
    let theme = ui.theme;
    let inside = pane("status", area, theme, buffer);
    let view = ui.view;
    let settings = &view.settings;
    let mut pen = Pen { area: inside, y: inside.y, theme, buffer };
    pen.line("method", &format!("{}, seed {}", settings.method, settings.seed), Style::new());
    pen.line("epsilon", &settings.epsilon.to_string(), Style::new());
    let (text, colour) = clusters(ui);
    let style = colour.map_or(Style::new(), |colour| Style::new().fg(colour));
    // What is said of a run must have its place; the Edit screen and the log have the rest.
    if ui.subject.run().is_some() {
        pen.line("clusters", &text, style)
    } else {
        pen.row("clusters", &text, style)
    }
    pen.line("model", &settings.model, Style::new());
    match ui.subject.run() {
        None => {
            let key = ui.key(Action::Train, Context::Everywhere);
            pen.row("run", &format!("none; {key} trains {} episodes", settings.episodes), theme.faint());
        }
        Some(run) => pen.run(run),
    }
}

/// How the clusters stand, and what to press.
pub fn clusters(ui: &Ui) -> (String, Option<Color>) {
    let view = ui.view;
    let theme = ui.theme;
    let key = ui.key(Action::Clusters, Context::Everywhere);
    let count = |prior: &crate::guidance::ActionPrior| {
        let clusters: usize = prior.stages.iter().map(|stage| stage.clusters.len()).sum();
        format!("{clusters} in {} stages", prior.stages.len())
    };
    if let (Some(reason), PriorState::Absent | PriorState::Stale) = (&view.prior_failure, &view.prior_state) {
        return (format!("failed: {reason}"), Some(theme.bad));
    }
    if let PriorState::Building { stage, stages } = view.prior_state {
        return (format!("computing stage {} of {stages}", (stage + 1).min(stages)), Some(theme.warn));
    }
    match ui.subject.clusters() {
        Some(clusters) if clusters.of_run => (format!("{} (of the run)", count(&clusters.prior)), None),
        Some(clusters) if clusters.stale => (format!("out of date; {key} computes them"), Some(theme.warn)),
        Some(clusters) => (count(&clusters.prior), Some(theme.good)),
        None => (format!("none; {key} computes them"), None),
    }
}

/// Columns of the labels.
const LABEL: usize = 9;
/// Columns from which on there is room for whole words.
const ROOMY: usize = 26;

struct Pen<'a> {
    area: Rect,
    y: u16,
    theme: &'a Theme,
    buffer: &'a mut Buffer,
}

impl Pen<'_> {
    fn row(&mut self, label: &str, text: &str, style: Style) {
        let room = self.room();
        for (index, line) in wrap(text, room).iter().enumerate() {
            if self.y >= self.area.bottom() {
                return;
            }
            if index == 0 {
                self.buffer.set_stringn(self.area.x, self.y, label, LABEL, self.theme.faint());
            }
            self.buffer.set_stringn(self.area.x + LABEL as u16, self.y, line, room, style);
            self.y += 1;
        }
    }

    /// A row that is one line whatever happens; the rows below it have their place.
    fn line(&mut self, label: &str, text: &str, style: Style) {
        let text = shortened(text, self.room(), false);
        self.row(label, &text, style);
    }

    fn room(&self) -> usize {
        usize::from(self.area.width).saturating_sub(LABEL)
    }

    fn run(&mut self, run: &RunSummary) {
        let style = Style::new().fg(state_colour(&run.state, self.theme));
        self.row("run", &shortened(&run.name, self.room(), true), Style::new());
        let state = match (&run.state, run.preparing) {
            (RunState::Running, Some((stage, stages))) => format!("clusters, stage {} of {stages}", stage + 1),
            (RunState::Failed(reason), _) => format!("failed: {reason}"),
            _ => run.state_word().to_owned(),
        };
        self.row("state", &state, style);
        self.progress(run);
        let latest = |metric| run.latest(metric).map_or_else(|| "-".to_owned(), number);
        let sign = if self.room() >= ROOMY { " %" } else { "%" };
        let percent = |share: Option<f32>| share.map_or_else(|| "-".to_owned(), |s| format!("{:.0}{sign}", 100.0 * s));
        let greedy = run.evaluations.last().map(|(_, success)| *success);
        let text = format!("{}, greedy {}", percent(run.latest(Metric::Success)), percent(greedy));
        self.line("success", &text, Style::new());
        let (now, per) = if self.room() >= ROOMY { ("now epsilon", " episodes/s") } else { ("eps.", "/s") };
        let text = format!("{}, {now} {}", latest(Metric::Return), latest(Metric::Epsilon));
        self.line("return", &text, Style::new());
        let speed = run.rate.map_or_else(|| "-".to_owned(), |rate| format!("{rate:.1}{per}"));
        let left = run.seconds_left().map_or_else(String::new, |seconds| format!(", {} left", span(seconds)));
        if run.active {
            self.line("speed", &format!("{speed}{left}"), Style::new());
        }
    }

    fn progress(&mut self, run: &RunSummary) {
        let room = self.room();
        let count = format!(" {}/{}", run.done, run.episodes);
        let text = bar(run.done, run.episodes, room.saturating_sub(count.len()).min(24), self.theme) + &count;
        self.row("episodes", &text, Style::new().fg(self.theme.accent));
    }
}

/// A progress bar that is full only when everything is done.
pub fn bar(done: u64, all: u64, width: usize, theme: &Theme) -> String {
    let full = if all == 0 { 0 } else { (done.min(all) as usize * width) / all as usize };
    let [on, off] = if theme.marker == Marker::Ascii { ["#", "."] } else { ["█", "░"] };
    on.repeat(full) + &off.repeat(width - full)
}

/// The colour of a run's state.
pub fn state_colour(state: &RunState, theme: &Theme) -> Color {
    match state {
        RunState::Running => theme.accent,
        RunState::Paused | RunState::Stopped(_) | RunState::Interrupted => theme.warn,
        RunState::Finished => theme.good,
        RunState::Failed(_) => theme.bad,
        RunState::NotStarted => theme.dim,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::widgets::theme::{Depth, Palette};

    #[test]
    fn a_bar_is_full_only_at_the_end() {
        let theme = Theme::new(Palette::Dark, Depth::True, Marker::Ascii);
        assert_eq!(bar(0, 0, 4, &theme), "....");
        assert_eq!(bar(999, 1000, 4, &theme), "###.");
        assert_eq!(bar(1000, 1000, 4, &theme), "####");
    }
}
