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

/// Columns of the labels.
const LABEL: usize = 9;

/// A row of the pane: label, text and style.
type Row = (&'static str, String, Style);

/// Draws the pane.
pub fn draw(ui: &Ui, area: Rect, buffer: &mut Buffer) {
    let theme = ui.theme;
    let inside = pane("status", area, theme, buffer);
    let settings = &ui.view.settings;
    let run = ui.subject.run();
    let room = usize::from(inside.width).saturating_sub(LABEL);
    // Beside those of a run.
    let method = if run.is_some() { "next run" } else { "method" };
    let mut rows = vec![(method, format!("{}, seed {}", settings.method.label(), settings.seed), Style::new())];
    if settings.method.uses("epsilon") {
        rows.push(("epsilon", settings.epsilon.describe(), Style::new()));
    }
    let stages = ui.subject.clusters.iter().flat_map(|known| &known.prior.stages);
    if settings.uses("guidance") || stages.into_iter().any(|stage| !stage.clusters.is_empty()) {
        let (clusters, style) = clusters(ui);
        rows.push(("clusters", clusters, style));
    }
    if settings.uses("prior") {
        rows.push(("model", settings.prior.name(), Style::new()));
    }
    let none = || format!("{} {} episodes", ui.text("none; {train} trains"), settings.episodes);
    rows.extend(run.map_or_else(|| vec![("run", none(), theme.faint())], |run| rows_of(run, room, theme)));
    let lines = rows.into_iter().flat_map(|(label, text, style)| {
        // With a run, each takes one line, to leave room for why it failed; the Edit screen and the log show the full text.
        let text = if run.is_some() && label != STATE { shortened(&text, room, false) } else { text };
        let labels = std::iter::once(label).chain(std::iter::repeat(""));
        let label = |label| Span::styled(format!("{label:LABEL$}"), theme.faint());
        labels.zip(wrap(&text, room)).map(move |(of, line)| Line::from(vec![label(of), Span::styled(line, style)]))
    });
    Text::from_iter(lines).render(inside, buffer);
}

/// The label of the state of a run.
const STATE: &str = "state";

/// The rows of a run.
fn rows_of(run: &RunSummary, room: usize, theme: &Theme) -> Vec<Row> {
    let plain = Style::new();
    let state = match (&run.state, &run.preparing) {
        (RunState::Running, Some(work)) => work.clone(),
        (RunState::Failed(reason), _) => format!("failed: {reason}"),
        _ => run.state_word().to_owned(),
    };
    let count = format!(" {}/{}", run.done, run.episodes());
    let progress = bar(run.done, run.episodes(), room.saturating_sub(count.len()).min(24)) + &count;
    let percent = |share: Option<f32>| share.map_or_else(|| "-".to_owned(), |s| format!("{:.0} %", 100.0 * s));
    let [success, greedy] = [run.latest(Metric::Success), run.evaluations.last().map(|last| last.1)].map(percent);
    let latest = |metric| run.latest(metric).map_or_else(|| "-".to_owned(), number);
    let mut rows = vec![
        ("run", shortened(&run.name, room, true), plain),
        ("", run.label.clone(), plain),
        (STATE, state, plain.fg(state_colour(&run.state, theme))),
        ("episodes", progress, plain.fg(theme.accent)),
        ("success", format!("{success}, greedy {greedy}"), plain),
        ("return", format!("{}, epsilon {}", latest(Metric::Return), latest(Metric::Epsilon)), plain),
    ];
    if run.active {
        let speed = run.rate().map_or_else(|| "-".to_owned(), |rate| format!("{rate:.1}/s"));
        let left = run.seconds_left().map_or_else(String::new, |seconds| format!(", {} left", span(seconds)));
        rows.push(("speed", speed + &left, plain));
    }
    rows
}

/// The state of the clusters, with the key that computes them, and its style.
pub fn clusters(ui: &Ui) -> (String, Style) {
    let Ui { view, theme, .. } = *ui;
    let plain = Style::new();
    let count = |prior: &mge_guidance::ActionPrior| {
        let clusters: usize = prior.stages.iter().map(|stage| stage.clusters.len()).sum();
        format!("{clusters} in {}", counted(prior.stages.len(), "stage"))
    };
    if let (Some(reason), PriorState::Absent | PriorState::Stale) = (&view.prior_failure, &view.prior_state) {
        return (format!("failed: {reason}"), plain.fg(theme.bad));
    }
    if let PriorState::Building(phase) = view.prior_state {
        let what = match phase {
            Phase::BuildingPrior { stage, stages } => format!("computing stage {} of {stages}", stage + 1),
            phase => phase.preparation().unwrap_or_else(|| "computing".to_owned()),
        };
        return (what, plain.fg(theme.warn));
    }
    match &ui.subject.clusters {
        Some(clusters) if clusters.of_run => (format!("{}, used by the run", count(&clusters.prior)), plain),
        // The workspace computes outdated clusters again by itself.
        Some(clusters) if clusters.stale => ("out of date; soon computed again".to_owned(), plain.fg(theme.warn)),
        Some(clusters) => (count(&clusters.prior), plain.fg(theme.good)),
        None => (ui.text("none; {clusters} computes them"), plain),
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
