//! The lines of the list: runs, and groups of runs that differ in the seed only; their order and columns.

use std::cmp::Reverse;
use std::collections::{BTreeSet, HashMap};

use ratatui::prelude::*;
use ratatui::widgets::{Row, Table};

use super::super::{HitRegions, Ui, row_regions};
use super::Runs;
use super::columns::{self, Column};
use super::line::Line;
use crate::tui::view::RunGroup;
use crate::tui::widgets::columns::{shortened, width};
use crate::tui::widgets::list;

/// The lines of the list.
pub fn lines<'a>(state: &Runs, ui: &Ui<'a>) -> Vec<Line<'a>> {
    let mut lines: Vec<Line<'a>> = Vec::new();
    // The index of each group's line, by the address of the group.
    let mut places: HashMap<*const RunGroup, usize> = HashMap::new();
    for run in ui.view.runs.iter().rev().map(|run| &**run).filter(|run| state.filter.accepts(run, ui)) {
        let group = ui.view.groups.of(&run.path).filter(|group| group.runs.len() > 1);
        let place = group.map_or(lines.len(), |group| *places.entry(std::ptr::from_ref(group)).or_insert(lines.len()));
        match lines.get_mut(place) {
            Some(line) => line.runs.push(run),
            None => lines.push(Line { runs: vec![run], group, ..Line::default() }),
        }
    }
    for line in &mut lines {
        // A group of which only one run is listed is not folded.
        line.group = line.group.filter(|_| line.runs.len() > 1);
        // Without a filter, the others are gone: the groups are those of a moment ago.
        let of_group = line.group.filter(|_| !state.filter.text.is_empty());
        line.hidden = of_group.map_or(0, |group| group.runs.len().saturating_sub(line.runs.len()));
        line.runs.sort_by_key(|run| run.config.seed);
    }
    if state.by_success {
        lines.sort_by_cached_key(|line| Reverse(line.success().map(|share| (share * 1e6) as u32)));
    }
    let unfolded = |line: Line<'a>| {
        let is_unfolded = line.group.is_some() && line.runs.iter().any(|run| state.unfolded.contains(&run.path));
        let runs = if is_unfolded { line.runs.clone() } else { Vec::new() };
        let below = |run| Line { runs: vec![run], is_below: true, ..Line::default() };
        std::iter::once(line).chain(runs.into_iter().map(below))
    };
    lines.into_iter().flat_map(unfolded).collect()
}

/// Width of the mark with the colour.
const MARK: u16 = 3;
/// Least and greatest width of the state.
const STATE: [u16; 2] = [11, 14];
/// Least width of a name beside the columns, and greatest one.
const NAME: [u16; 2] = [20, 70];

/// Lines that decide which columns are shown: judging thousands for every key would take milliseconds.
const JUDGED: usize = 500;

/// Draws headings and lines, with the selected one highlighted.
pub fn draw(
    state: &Runs,
    lines: &[Line],
    selected: usize,
    ui: &Ui,
    area: Rect,
    buffer: &mut Buffer,
    regions: &mut HitRegions,
) {
    let theme = ui.theme;
    let [header, rows] = Layout::vertical([Constraint::Length(1), Constraint::Fill(1)]).areas(area);
    let several_tasks = ui.view.runs.iter().any(|run| run.config.task.name != ui.view.runs[0].config.task.name);
    let judged = &lines[..lines.len().min(JUDGED)];
    let labels: Vec<String> = judged.iter().map(|line| line.name(several_tasks)).collect();
    let labels: BTreeSet<&str> = labels.iter().map(String::as_str).collect();
    let named = judged.iter().map(|line| line.named(usize::from(NAME[1]), several_tasks, &labels));
    let states = judged.iter().map(|line| width(&line.state(theme).0) as u16);
    let state_width = states.max().unwrap_or(0).clamp(STATE[0], STATE[1]);
    // Names that set the lines apart come before all columns but the first ones, or those that were chosen.
    let first = if state.columns.is_empty() { columns::FIRST } else { area.width };
    let most = area.width.saturating_sub(MARK + state_width + first + 3).max(NAME[0]);
    let least = named.map(|name| width(&name) as u16).max().unwrap_or(0).clamp(NAME[0], most);
    let shown = columns::fitting(&state.columns, judged, area.width.saturating_sub(MARK + state_width + least + 3), ui);
    let taken: u16 = MARK + state_width + 3 + shown.iter().map(|column| column.width + 1).sum::<u16>();
    let name = area.width.saturating_sub(taken).min(NAME[1]);
    let widths = [MARK, name, state_width].into_iter().chain(shown.iter().map(|column| column.width));
    let widths = Constraint::from_lengths(widths);
    let headings = ["", "run", "state"].map(Text::from).into_iter();
    let cell = |it: &str, column: &Column| Text::from(shortened(it, usize::from(column.width), true)).right_aligned();
    let headings = headings.chain(shown.iter().map(|column| cell(&column.heading, column)));
    Widget::render(Table::new([Row::new(headings).style(theme.faint())], &widths), header, buffer);
    let row = |index: usize| {
        let line = &lines[index];
        let watched = line.runs.iter().any(|run| ui.is_watched(run));
        let marked = line.runs.iter().all(|run| state.is_marked(run));
        let mark = ["■", if marked { "*" } else { " " }, if watched { ">" } else { " " }].concat();
        let (text, style) = line.state(theme);
        let first = [
            Text::from(mark),
            Text::from(line.named(usize::from(name), several_tasks, &labels)),
            Text::styled(shortened(&text, usize::from(state_width), false), style),
        ];
        let others = shown.iter().map(|one| cell(&(one.cell)(line, ui, &one.heading).unwrap_or_default(), one));
        Row::new(first.into_iter().chain(others))
    };
    let drawn = list::draw(lines.len(), Some(selected), row, &widths, rows, theme, buffer);
    for (area, index) in &drawn {
        // Also on the selected line, which has no other colours.
        let group = ui.view.groups.of(&lines[*index].runs[0].path);
        let colour = group.map_or(Color::Reset, |group| theme.visible(group.color));
        buffer[(area.x, area.y)].set_style(Style::reset().fg(colour));
    }
    regions.extend(row_regions(drawn));
}
