//! The status pane: settings of the next run, state of the clusters, and the watched run.

use ratatui::prelude::*;

use super::Ui;
use super::pane::pane;
use crate::tui::view::{RunSummary, span};
use crate::tui::widgets::columns::shortened;
use crate::tui::widgets::popup::wrap;
use crate::tui::widgets::theme::Theme;
use mge_base::text::{counted, number};
use mge_run::{Metric, RunState};
use mge_trainer::Phase;
use mge_workbench::PriorState;

/// Draws the pane.
pub fn draw(ui: &Ui, area: Rect, buffer: &mut Buffer) {
    let inside = pane("status", area, ui.theme, buffer);
    let settings = &ui.view.settings;
    let run = ui.subject.run();
    let room = usize::from(inside.width).saturating_sub(LABEL);
    let mut rows = Rows { lines: Vec::new(), room, theme: ui.theme };
    let (clusters, colour) = clusters(ui);
    let colour = colour.map_or(Style::new(), |colour| Style::new().fg(colour));
    // Beside those of a run.
    let method = if run.is_some() { "next run" } else { "method" };
    let mut next = vec![(method, format!("{}, seed {}", settings.method.label(), settings.seed), Style::new())];
    if settings.method.uses("epsilon") {
        next.push(("epsilon", settings.epsilon.describe(), Style::new()));
    }
    let stages = ui.subject.clusters.iter().flat_map(|known| &known.prior.stages);
    if settings.uses("guidance") || stages.into_iter().any(|stage| !stage.clusters.is_empty()) {
        next.push(("clusters", clusters, colour));
    }
    if settings.uses("prior") {
        next.push(("model", settings.prior.name(), Style::new()));
    }
    for (label, text, style) in next {
        // With a run, each takes one line, to leave room for it; the Edit screen and the log show the full text.
        if run.is_some() { rows.line(label, &text, style) } else { rows.add(label, &text, style) }
    }
    match run {
        None => {
            let text = format!("{} {} episodes", ui.text("none; {train} trains"), settings.episodes);
            rows.add("run", &text, ui.theme.faint());
        }
        Some(run) => rows.run(run),
    }
    Text::from(rows.lines).render(inside, buffer);
}

/// The state of the clusters, with the key that computes them, and its colour.
pub fn clusters(ui: &Ui) -> (String, Option<Color>) {
    let Ui { view, theme, .. } = *ui;
    let count = |prior: &mge_guidance::ActionPrior| {
        let clusters: usize = prior.stages.iter().map(|stage| stage.clusters.len()).sum();
        format!("{clusters} in {}", counted(prior.stages.len(), "stage"))
    };
    if let (Some(reason), PriorState::Absent | PriorState::Stale) = (&view.prior_failure, &view.prior_state) {
        return (format!("failed: {reason}"), Some(theme.bad));
    }
    if let PriorState::Building(phase) = view.prior_state {
        let what = match phase {
            Phase::BuildingPrior { stage, stages } => format!("computing stage {} of {stages}", stage + 1),
            phase => phase.preparation().unwrap_or_else(|| "computing".to_owned()),
        };
        return (what, Some(theme.warn));
    }
    match &ui.subject.clusters {
        Some(clusters) if clusters.of_run => (format!("{}, used by the run", count(&clusters.prior)), None),
        // The workspace computes outdated clusters again by itself.
        Some(clusters) if clusters.stale => ("out of date; soon computed again".to_owned(), Some(theme.warn)),
        Some(clusters) => (count(&clusters.prior), Some(theme.good)),
        None => (ui.text("none; {clusters} computes them"), None),
    }
}

/// Columns of the labels.
const LABEL: usize = 9;

/// Lines of the pane.
struct Rows<'a> {
    lines: Vec<Line<'static>>,
    /// Width beside the labels.
    room: usize,
    theme: &'a Theme,
}

impl Rows<'_> {
    fn add(&mut self, label: &'static str, text: &str, style: Style) {
        let labels = std::iter::once(label).chain(std::iter::repeat(""));
        self.lines.extend(labels.zip(wrap(text, self.room)).map(|(label, line)| {
            Line::from(vec![Span::styled(format!("{label:LABEL$}"), self.theme.faint()), Span::styled(line, style)])
        }));
    }

    /// Adds a row, shortened to one line.
    fn line(&mut self, label: &'static str, text: &str, style: Style) {
        self.add(label, &shortened(text, self.room, false), style);
    }

    fn run(&mut self, run: &RunSummary) {
        let plain = Style::new();
        self.add("run", &shortened(&run.name, self.room, true), plain);
        self.line("", &run.label, plain);
        let state = match (&run.state, &run.preparing) {
            (RunState::Running, Some(work)) => work.clone(),
            (RunState::Failed(reason), _) => format!("failed: {reason}"),
            _ => run.state_word().to_owned(),
        };
        self.add("state", &state, plain.fg(state_colour(&run.state, self.theme)));
        let count = format!(" {}/{}", run.done, run.episodes());
        let progress = bar(run.done, run.episodes(), self.room.saturating_sub(count.len()).min(24));
        self.add("episodes", &(progress + &count), plain.fg(self.theme.accent));
        let percent = |share: Option<f32>| share.map_or_else(|| "-".to_owned(), |s| format!("{:.0} %", 100.0 * s));
        let greedy = run.evaluations.last().map(|(_, success)| *success);
        let text = format!("{}, greedy {}", percent(run.latest(Metric::Success)), percent(greedy));
        self.line("success", &text, plain);
        let latest = |metric| run.latest(metric).map_or_else(|| "-".to_owned(), number);
        let text = format!("{}, epsilon {}", latest(Metric::Return), latest(Metric::Epsilon));
        self.line("return", &text, plain);
        if run.active {
            let speed = run.rate().map_or_else(|| "-".to_owned(), |rate| format!("{rate:.1}/s"));
            let left = run.seconds_left().map_or_else(String::new, |seconds| format!(", {} left", span(seconds)));
            self.line("speed", &format!("{speed}{left}"), plain);
        }
    }
}

/// A progress bar that is full only when everything is done.
pub fn bar(done: u64, all: u64, width: usize) -> String {
    let full = if all == 0 { 0 } else { (done.min(all) as usize * width) / all as usize };
    "█".repeat(full) + &"░".repeat(width - full)
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

    #[test]
    fn a_bar_is_full_only_at_the_end() {
        assert_eq!([(0, 0), (999, 1000), (1000, 1000)].map(|(done, all)| bar(done, all, 4)), ["░░░░", "███░", "████"]);
    }
}
