//! The Training screen: curves of the runs.

use std::collections::HashSet;
use std::path::PathBuf;

use ratatui::prelude::*;
use ratatui::widgets::{Row, Table};

use super::charts::{self, Charts, CurvesState, Shown};
use super::pane::{hint, lines, pane};
use super::runs::Runs;
use super::workbench::scene_pane;
use super::{HitRegions, Screens, Ui};
use crate::tui::effect::Effect;
use crate::tui::view::{Choice, RunSummary, span};
use crate::tui::widgets::columns::{fitting, shortened};
use crate::tui::widgets::layout::{WIDE, grid};
use mge_base::text::{counted, printable};
use mge_run::Metric;

/// Width from which the scene fits beside the curves.
const BESIDE: u16 = 80;

/// The runs whose curves are shown: in a comparison the marked ones, or else the watched one.
fn chosen<'a>(curves: &CurvesState, runs: &Runs, ui: &Ui<'a>) -> Vec<&'a RunSummary> {
    let marked = if curves.comparing { runs.marked(ui.view) } else { Vec::new() };
    // The marks may have been removed since.
    if marked.is_empty() { ui.subject.run().into_iter().collect() } else { marked }
}

/// The two compared runs, the watched one first, if there are exactly two.
fn pair<'a>(curves: &CurvesState, runs: &Runs, ui: &Ui<'a>) -> Option<[&'a RunSummary; 2]> {
    let watched = ui.subject.run().filter(|_| curves.comparing)?;
    match chosen(curves, runs, ui).as_slice() {
        [first, second] if first.path == watched.path => Some([*first, *second]),
        [first, second] if second.path == watched.path => Some([*second, *first]),
        _ => None,
    }
}

/// What is drawn: folded groups, each as one curve, and single runs. A pair of compared runs is never folded.
fn shown<'a>(curves: &CurvesState, runs: &Runs, ui: &Ui<'a>) -> Vec<Shown<'a>> {
    if let Some(pair) = pair(curves, runs, ui) {
        return pair.map(|run| Shown::run(run, ui.view)).into();
    }
    let mut shown: Vec<Shown<'a>> = Vec::new();
    for run in chosen(curves, runs, ui) {
        let single = Shown::run(run, ui.view);
        let Shown::Run(_, Some(group)) = single else {
            shown.push(single);
            continue;
        };
        match group.curves.as_deref().filter(|_| curves.folded) {
            Some(of_group) => {
                let is_same = |known: &Shown| matches!(known, Shown::Group(other, _) if std::ptr::eq(*other, group));
                if !shown.iter().any(is_same) {
                    shown.push(Shown::Group(group, of_group));
                }
                if !curves.comparing {
                    shown.push(single);
                }
            }
            None if curves.comparing || curves.folded => shown.push(single),
            None => {
                let seeds = group.runs.iter().filter_map(|path| ui.view.run(path));
                shown.extend(seeds.map(|run| Shown::Run(run, Some(group))));
            }
        }
    }
    shown
}

/// Folders of the runs whose curves are needed.
pub fn wanted(curves: &CurvesState, runs: &Runs, ui: &Ui) -> Vec<PathBuf> {
    // Each group is added once; a run without a group is added on its own.
    let mut known = HashSet::new();
    let groups = chosen(curves, runs, ui).into_iter().map(|run| match ui.view.groups.of(&run.path) {
        Some(group) => &*group.runs,
        None => std::slice::from_ref(&run.path),
    });
    groups.filter(|runs| known.insert(runs.as_ptr())).flatten().cloned().collect()
}

/// Episodes of the longest curve that is shown.
fn episodes(curves: &CurvesState, runs: &Runs, ui: &Ui) -> usize {
    charts::episodes(&shown(curves, runs, ui))
}

/// The episode at a place on the x axis.
pub fn episode_at(curves: &CurvesState, runs: &Runs, ui: &Ui, x: f32) -> f32 {
    charts::reference(&shown(curves, runs, ui), curves.axis, ui).episode_at(x)
}

/// Draws charts below one another.
pub fn stack(
    curves: &CurvesState,
    runs: &Runs,
    ui: &Ui,
    metrics: &[Metric],
    area: Rect,
    buffer: &mut Buffer,
    regions: &mut HitRegions,
) {
    let charts = Charts::new(curves, shown(curves, runs, ui), ui);
    for (metric, row) in metrics.iter().zip(grid(area, 1, metrics.len())) {
        charts.draw(*metric, Rect { x: row.x + 1, width: row.width - 1, ..row }, buffer, regions);
    }
}

/// Draws the screen.
pub fn draw(ui: &Ui, screens: &Screens, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let (curves, marked) = (&screens.curves, &screens.runs);
    let mut area = area;
    if matches!(ui.subject.choice, Choice::Past(_)) && area.width >= BESIDE {
        let width = (2 * (area.height - 2) + 2).min(area.width / 2);
        let [left, right] = Layout::horizontal([Constraint::Fill(1), Constraint::Length(width)]).areas(area);
        let _ = scene_pane(ui, &screens.scene, right, buffer, regions);
        area = left;
    }
    let shown = shown(curves, marked, ui);
    let inside = pane(&title(&shown, ui, area.width), area, ui.theme, buffer);
    if shown.is_empty() {
        return hint(&nothing(curves, ui), inside, ui.theme, buffer);
    }
    let inside = match pair(curves, marked, ui) {
        Some(pair) => differences(pair, marked.page, inside, ui, buffer),
        None => inside,
    };
    let is_own_group = matches!(*shown, [Shown::Group(..), Shown::Run(..)]);
    let charts = Charts::new(curves, shown, ui);
    if curves.alone {
        return charts.draw(curves.selected, inside, buffer, regions);
    }
    let constants = charts.constants();
    let is_varying = |metric: &Metric| constants.iter().all(|(constant, _)| constant != metric);
    // All values at the crosshair: some curves have no room, and the legends of others are cut.
    let (values, most) = match charts.crosshair() {
        Some(at) => (Metric::CURVES.map(|metric| (metric, charts.values_at(metric, at))).into(), inside.height / 4),
        None => (constants.clone(), 1),
    };
    let values: Vec<String> = values.iter().map(|(metric, value)| format!("{} {value}", metric.title())).collect();
    let order = match charts.crosshair() {
        Some(_) if is_own_group => "group / run: ".to_owned(),
        Some(_) if charts.names.len() > 1 => charts.names.join(" / ") + ": ",
        _ => String::new(),
    };
    let text: Vec<_> = lines(&format!("{order}{}", values.join(" · ")), inside.width, ui.theme.faint()).collect();
    let rows = Constraint::Length(if values.is_empty() { 0 } else { most.min(text.len() as u16) });
    let [inside, below] = Layout::vertical([Constraint::Fill(1), rows]).areas(inside);
    Text::from(text).render(below, buffer);
    for (metric, place) in places(inside, curves.selected, is_varying) {
        charts.draw(metric, Rect { x: place.x + 1, width: place.width - 1, ..place }, buffer, regions);
        if metric == curves.selected {
            buffer.set_string(place.x, place.y, "›", ui.theme.strong());
        }
    }
}

/// The curves that are shown large.
const LARGE: [Metric; 2] = [Metric::Success, Metric::Return];
/// Least rows and columns of a small chart.
const SMALL: [u16; 2] = [6, 36];

/// Where each curve is drawn: success and return large, below them the small charts that fit, of those that vary, with
/// the selected one.
fn places(area: Rect, selected: Metric, is_varying: impl Fn(&Metric) -> bool) -> Vec<(Metric, Rect)> {
    let is_small = |metric: &Metric| !LARGE.contains(metric) && is_varying(metric);
    let others: Vec<Metric> = Metric::CURVES.into_iter().filter(is_small).collect();
    let side_by_side = area.width >= WIDE;
    let columns = (area.width / SMALL[1]).max(1);
    let all_rows = (others.len() as u16).div_ceil(columns);
    let large = if side_by_side { area.height / 2 } else { area.height * 2 / 3 };
    let rows = ((area.height - large) / SMALL[0]).min(all_rows);
    let large = if rows == 0 { area.height } else { large };
    let [above, below] = Layout::vertical([Constraint::Length(large), Constraint::Fill(1)]).areas(area);
    let halves = if side_by_side { grid(above, 2, 1) } else { grid(above, 1, 2) };
    let mut all: Vec<(Metric, Rect)> = LARGE.into_iter().zip(halves).collect();
    let page = usize::from(columns * rows).max(1);
    let first = others.iter().position(|metric| *metric == selected).unwrap_or(0) / page * page;
    all.extend(others.into_iter().skip(first).zip(grid(below, columns.into(), rows.into())));
    all
}

/// The title of the curves: what is shown, and how far it is.
fn title(shown: &[Shown], ui: &Ui, width: u16) -> String {
    match shown {
        [] => "training".to_owned(),
        [Shown::Group(group, _)] => format!("training · {} · {}", group.title(), group.progress(&ui.view.runs)),
        [Shown::Run(run, _)] => title_of_run(run, width),
        // The watched run is drawn over its own group.
        [Shown::Group(group, _), Shown::Run(run, Some(own))] if std::ptr::eq(*group, *own) => title_of_run(run, width),
        shown => format!("training · {}", counted(shown.len(), "curve")),
    }
}

/// The title of the curves of one run.
fn title_of_run(run: &RunSummary, width: u16) -> String {
    let left = run.seconds_left().map(|seconds| format!("{} left", span(seconds))).unwrap_or_default();
    let (name, state) = (run.name.clone(), run.state_word().to_owned());
    let done = format!("{}/{}", run.done, run.episodes());
    let before = run.preparing.clone().unwrap_or_default();
    fitting(&["training".to_owned(), name, state, done, left, before], usize::from(width).saturating_sub(4))
}

/// Draws a page of the settings in which two runs differ below the charts, in the colours of the runs; returns the area
/// left.
fn differences(pair: [&RunSummary; 2], page: usize, area: Rect, ui: &Ui, buffer: &mut Buffer) -> Rect {
    let mut all = mge_results::differences(&pair[0].config, &pair[1].config);
    // What matters most comes first.
    all.sort_by_key(|(path, _)| ["task.name", "method"].iter().position(|first| first == path).unwrap_or(usize::MAX));
    let room = usize::from(area.height / 3).max(3) - 1;
    let (count, pages) = (all.len(), all.len().div_ceil(room).max(1));
    let first = page % pages * room;
    let shown = match (count, pages) {
        (0, _) => "no setting differs".to_owned(),
        (_, 1) => String::new(),
        _ => ui.text(&format!("{} to {} of {count}: {{more-differences}}", first + 1, count.min(first + room))),
    };
    let mut rows = vec![[shown, pair[0].name.clone(), pair[1].name.clone()]];
    rows.extend(all.into_iter().skip(first).take(room).map(|(path, values)| {
        let [first, second] = values.map(|value| printable(&value).to_string());
        [path, first, second]
    }));
    // A short last page leaves its room.
    let [charts, below] =
        Layout::vertical([Constraint::Fill(1), Constraint::Length(count.min(room) as u16 + 1)]).areas(area);
    let colours = charts::colours(&pair.map(|run| Shown::run(run, ui.view)), ui.theme);
    let styles = [ui.theme.faint(), Style::new().fg(colours[0]), Style::new().fg(colours[1])];
    let width = usize::from(below.width / 3).saturating_sub(1);
    let row = |cells: [String; 3]| {
        let cells = cells.iter().zip(styles).map(|(cell, style)| Text::styled(shortened(cell, width, true), style));
        Row::new(cells.collect::<Vec<_>>())
    };
    Widget::render(Table::new(rows.into_iter().map(row), [Constraint::Fill(1); 3]), below, buffer);
    charts
}

fn nothing(curves: &CurvesState, ui: &Ui) -> String {
    ui.text(match curves.comparing {
        true => "There is nothing to compare: {mark-run} marks runs on the Runs screen ({screen-runs}).",
        false => "No run is being watched. {train} starts a training with the settings on the Scene screen; {screen-runs} shows past runs.",
    })
}

/// Moves the crosshair left or right, or far so the window of episodes, or selects the curve above or below.
pub fn move_by(screens: &mut Screens, ui: &Ui, [right, up]: [f32; 2], far: bool) -> Vec<Effect> {
    let Screens { curves, runs, .. } = screens;
    let episodes = episodes(curves, runs, ui);
    match (right == 0.0, far) {
        (true, true) => {}
        (true, false) => curves.select_neighbour(if up > 0.0 { -1 } else { 1 }),
        (false, true) => curves.range = curves.range.pan(0.25 * right, episodes),
        (false, false) => {
            let window = curves.range.window(episodes);
            let by = right * ((window.to - window.from) / 100.0).max(1.0).round();
            let shown = ui.subject.past_episode().map(|episode| episode as f32);
            let now = curves.crosshair.or(shown).unwrap_or(window.to - by);
            let to = (now.min(episodes as f32 - by.min(0.0)) + by).clamp(window.from.ceil(), window.to);
            return move_crosshair((curves, runs), ui, to);
        }
    }
    Vec::new()
}

/// Shows fewer episodes, for a factor below 1, or more, around an episode or else the crosshair.
pub fn zoom((curves, runs): (&mut CurvesState, &Runs), ui: &Ui, factor: f32, centre: Option<f32>) {
    let episodes = episodes(curves, runs, ui);
    curves.range = curves.range.zoom(factor, centre.or(curves.crosshair), episodes);
}

/// Moves the crosshair to an episode; the scene follows if the watched run has episodes.
pub fn move_crosshair((curves, runs): (&mut CurvesState, &Runs), ui: &Ui, to: f32) -> Vec<Effect> {
    // The scene shows the watched run, so the crosshair stays within its episodes.
    let done = ui.subject.run().map_or(0, |run| run.curves.last_episode());
    let last = if done > 0 { done } else { episodes(curves, runs, ui) };
    if last == 0 {
        return Vec::new();
    }
    let to = to.round().clamp(1.0, last as f32);
    (curves.crosshair, curves.hovered) = (Some(to), None);
    if done > 0 { vec![Effect::new(move |app| app.await_episode(to as u64, true))] } else { Vec::new() }
}
