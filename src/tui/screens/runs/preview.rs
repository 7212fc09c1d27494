//! The preview of the selected run or group: curves, the settings in which it differs, notes.

use ratatui::prelude::*;
use ratatui::text::{Line as TextLine, Text};

use super::super::charts::{Charts, CurvesState, Shown};
use super::super::pane::{fitted, lines, pane};
use super::super::{HitRegions, Ui};
use super::columns;
use super::line::Line;
use crate::tui::view::RunGroup;
use mge_base::text::printable;
use mge_run::Metric;

/// Least height of a chart.
const CHART: u16 = 6;
/// Draws the preview, `whole` without its curves, which leaves more room for the text.
pub fn draw(ui: &Ui, line: &Line, about: &str, whole: bool, area: Rect, buffer: &mut Buffer) {
    let name = line.group.map_or_else(|| line.runs[0].name.clone(), RunGroup::title);
    let inside = pane(&name, area, ui.theme, buffer);
    let about = Text::from_iter(lines(about, inside.width, Style::new()));
    let chart = Constraint::Length(if whole { 0 } else { (inside.height / 4).max(CHART) });
    let heights = [Constraint::Length(about.height() as u16), chart, chart, Constraint::Fill(1)];
    let [head, first, second, rest] = Layout::vertical(heights).areas(inside);
    about.render(head, buffer);
    // Window, axis and crosshair of the Training screen stay there; these charts do not react to the mouse.
    let curves = CurvesState::default();
    let charts = [(Metric::Success, first), (Metric::Return, second)];
    for (metric, place) in charts.into_iter().filter(|_| !whole) {
        Charts::new(&curves, shown(ui, line), ui).draw(metric, place, buffer, &mut HitRegions::new());
    }
    let note = lines(&printable(line.note()), rest.width, Style::new()).collect();
    // What a user wrote comes first: what does not fit is cut off at the end.
    let mut text = section(ui, "note", note, rest.width);
    text.extend(section(ui, "main and differing settings", settings(ui, line, rest.width), rest.width));
    Text::from(fitted(ui, text, rest.height, if whole { "" } else { ": {whole-preview}" })).render(rest, buffer);
}

/// The curves of a line: one for a group as soon as it is known, before that one for each of its runs.
fn shown<'a>(ui: &Ui<'a>, line: &Line<'a>) -> Vec<Shown<'a>> {
    // Not the mean of runs that are not listed.
    match line.group.filter(|_| line.hidden == 0).and_then(|group| Some((group, group.curves.as_ref()?))) {
        Some((group, curves)) => vec![Shown::Group(group, curves)],
        None => line.runs.iter().map(|run| Shown::run(run, ui.view)).collect(),
    }
}

/// Lines below a heading; nothing if there are no lines.
fn section(ui: &Ui, heading: &str, text: Vec<TextLine<'static>>, width: u16) -> Vec<TextLine<'static>> {
    if text.is_empty() {
        return text;
    }
    lines(heading, width, ui.theme.strong()).chain(text).chain([TextLine::default()]).collect()
}

/// The main settings of a line, and those in which it differs from the others on its task.
fn settings(ui: &Ui, line: &Line, width: u16) -> Vec<TextLine<'static>> {
    let run = line.foremost();
    let main = ["epsilon", "episodes"];
    let differing = ui.view.groups.settings(&run.path).into_iter().flatten().map(|(path, _)| &**path);
    let paths = main.into_iter().chain(differing.filter(|path| !main.contains(path)));
    let others = paths.filter_map(|path| Some(format!("{path} {}", columns::setting(line, ui, path)?)));
    let all = std::iter::once(format!("method {}", run.config.method.label())).chain(others);
    all.flat_map(|text| lines(&text, width, Style::new())).collect()
}
