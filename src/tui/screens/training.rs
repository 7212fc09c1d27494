//! The Training screen: curves of the runs.

use std::collections::HashSet;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::pane::{WIDE, hint, pane};
use super::runs::Runs;
use super::{HitRegions, Region, Ui};
use crate::run::Metric;
use crate::stats::rolling::WINDOW;
use crate::tui::actions::Action;
use crate::tui::chart::{Curve, Plot, Range, Scale, draw as draw_chart};
use crate::tui::effect::Effect;
use crate::tui::view::{RunSummary, span};
use crate::tui::widgets::columns::fitting;

/// What the curves show.
#[derive(Debug)]
pub struct CurvesState {
    /// The episodes shown.
    pub range: Range,
    /// The episode whose values are read off.
    pub crosshair: Option<f32>,
    /// The selected curve.
    selected: usize,
    /// Only the selected curve is shown.
    alone: bool,
    /// The marked runs are shown, not only the watched one.
    comparing: bool,
    /// Each value is the mean of so many episodes.
    smoothing: usize,
    logarithmic: HashSet<Metric>,
}

const SMOOTHINGS: [usize; 4] = [1, 10, 50, 200];

impl Default for CurvesState {
    fn default() -> Self {
        Self {
            range: Range::default(),
            crosshair: None,
            selected: 0,
            alone: false,
            comparing: false,
            smoothing: 10,
            logarithmic: HashSet::from([Metric::CriticLoss]),
        }
    }
}

impl CurvesState {
    /// Leaves what lies over the curves; false if there is nothing.
    pub fn leave(&mut self) -> bool {
        self.crosshair.take().is_some() || std::mem::take(&mut self.alone)
    }

    /// Shows all episodes: a window of one run says nothing of another.
    pub fn forget_window(&mut self) {
        (self.range, self.crosshair) = (Range::Whole, None);
    }

    /// Selects a curve.
    pub fn select(&mut self, metric: Metric) {
        self.selected = Metric::CURVES.iter().position(|drawn| *drawn == metric).unwrap_or(0);
    }

    fn switch_scale(&mut self) {
        let metric = Metric::CURVES[self.selected];
        if !self.logarithmic.remove(&metric) {
            self.logarithmic.insert(metric);
        }
    }

    fn scale(&self, metric: Metric) -> Scale {
        if self.logarithmic.contains(&metric) { Scale::Log } else { Scale::Linear }
    }

    /// Smoothing of a metric: the success rate is a mean already, schedules are exact.
    fn smoothing(&self, metric: Metric) -> usize {
        match metric {
            Metric::Success | Metric::Epsilon | Metric::Noise => 1,
            _ => self.smoothing,
        }
    }
}

/// Runs whose curves are shown.
fn shown_runs<'a>(curves: &CurvesState, runs: &Runs, ui: &Ui<'a>) -> Vec<&'a RunSummary> {
    if curves.comparing {
        let all = ui.view.runs.iter().map(|run| &**run);
        return all.filter(|run| run.opened && runs.is_marked(run)).collect();
    }
    ui.subject.run().into_iter().collect()
}

/// Episodes of the longest run that is shown.
pub fn episodes(curves: &CurvesState, runs: &Runs, ui: &Ui) -> usize {
    shown_runs(curves, runs, ui).iter().map(|run| run.curves.episodes()).max().unwrap_or(0)
}

/// Draws one chart of some runs.
struct Charts<'a> {
    state: &'a CurvesState,
    runs: Vec<&'a RunSummary>,
    ui: &'a Ui<'a>,
}

impl Charts<'_> {
    fn draw(&self, metric: Metric, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
        let many = self.runs.len() > 1;
        let names = if many { names(&self.runs) } else { vec![String::new(); self.runs.len()] };
        let labels: Vec<&str> = self.runs.iter().map(|run| run.label.as_str()).collect();
        let colours = self.ui.theme.runs(&labels);
        let of_subgoals = self.runs.first().filter(|_| metric == Metric::SubgoalShare && !many);
        let by_subgoal = of_subgoals.map(|run| run.subgoal_hits()).unwrap_or_default();
        let single = by_subgoal.iter().enumerate().map(|(index, values)| Curve {
            name: (index + 1).to_string(),
            colour: self.ui.theme.stage(index),
            values,
            partial: 0,
            points: &[],
        });
        let whole = self.runs.iter().filter(|_| by_subgoal.is_empty());
        let curves = whole.zip(names).zip(colours).map(|((run, name), colour)| Curve {
            name,
            colour,
            values: run.curves.get(metric),
            // The success rate of the first episodes is that of fewer than the others.
            partial: if metric == Metric::Success { WINDOW.get() - 1 } else { 0 },
            points: if metric == Metric::Success { &run.evaluations } else { &[] },
        });
        let empty = match self.runs.first() {
            Some(run) if run.queued => "waiting for a free core",
            Some(run) if run.active => "the first episode is going on",
            Some(run) if run.done > 0 => "its log is being read",
            Some(_) => "it ended before its first episode",
            None => "no episodes yet: {train} trains",
        };
        let empty = self.ui.text(empty);
        let smoothing = self.state.smoothing(metric);
        let title = match (smoothing, self.state.scale(metric)) {
            (1, Scale::Linear) => metric.title().to_owned(),
            (1, Scale::Log) => format!("{}, log", metric.title()),
            (n, Scale::Linear) => format!("{}, mean of {n}", metric.title()),
            (n, Scale::Log) => format!("{}, mean of {n}, log", metric.title()),
        };
        let plot = Plot {
            title: &title,
            curves: single.chain(curves).collect(),
            x: self.state.range.window(self.episodes()),
            y: metric.info().range,
            scale: self.state.scale(metric),
            smoothing,
            crosshair: self.state.crosshair,
            empty: &empty,
        };
        if let Some(axes) = draw_chart(&plot, area, self.ui.theme, buffer) {
            regions.add(axes.plot, Region::Chart(axes, metric));
        }
    }

    fn episodes(&self) -> usize {
        self.runs.iter().map(|run| run.curves.episodes()).max().unwrap_or(0)
    }
}

/// What sets each of several runs apart from the others, in words: the parts of their labels that
/// not all have. Runs of one label have the names of their folders.
fn names(runs: &[&RunSummary]) -> Vec<String> {
    let parts = |run: &&RunSummary| run.label.split(", ").map(str::to_owned).collect::<Vec<String>>();
    let labels: Vec<Vec<String>> = runs.iter().map(parts).collect();
    let is_common = |part: &String| labels.iter().all(|label| label.contains(part));
    let own =
        |label: &Vec<String>| label.iter().filter(|part| !is_common(part)).cloned().collect::<Vec<_>>().join(", ");
    let names: Vec<String> = labels.iter().map(own).collect();
    let is_unique = |name: &String| names.iter().filter(|other| *other == name).count() == 1;
    names.iter().zip(runs).map(|(name, run)| if is_unique(name) { name } else { &run.name }.clone()).collect()
}

/// Draws charts below one another, as many as there is room for.
pub fn stack(
    curves: &CurvesState,
    runs: &Runs,
    ui: &Ui,
    metrics: &[Metric],
    area: Rect,
    buffer: &mut Buffer,
    regions: &mut HitRegions,
) {
    let charts = Charts { state: curves, runs: shown_runs(curves, runs, ui), ui };
    let count = (metrics.len() as u16).min(area.height / 5).max(1);
    let height = area.height / count;
    for (index, metric) in (0..count).zip(metrics) {
        let last = index + 1 == count;
        let rows = if last { area.height - index * height } else { height };
        let place = Rect { y: area.y + index * height, height: rows, x: area.x + 1, width: area.width - 1 };
        charts.draw(*metric, place, buffer, regions);
    }
}

/// Draws the screen.
pub fn draw(curves: &CurvesState, marked: &Runs, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let runs = shown_runs(curves, marked, ui);
    let title = match runs.as_slice() {
        [] => "training".to_owned(),
        [run] => {
            let speed = run.rate.filter(|_| run.active).map(|rate| format!("{rate:.1} episodes/s"));
            let left = run.seconds_left().map(|seconds| format!("{} left", span(seconds)));
            let (name, state) = (run.name.clone(), run.state_word().to_owned());
            let done = format!("{}/{}", run.done, run.episodes);
            let parts = ["training".to_owned(), name, state, done, left.unwrap_or_default(), speed.unwrap_or_default()];
            fitting(&parts, usize::from(area.width).saturating_sub(4))
        }
        runs => format!("training · {} runs", runs.len()),
    };
    let inside = pane(&title, area, ui.theme, buffer);
    if runs.is_empty() {
        return hint(&nothing(curves, ui), inside, ui.theme, buffer);
    }
    let selected = Metric::CURVES[curves.selected];
    let charts = Charts { state: curves, runs, ui };
    if curves.alone {
        return charts.draw(selected, inside, buffer, regions);
    }
    let columns: u16 = if area.width >= WIDE { 2 } else { 1 };
    let rows = (inside.height / 7).clamp(1, (Metric::CURVES.len() as u16).div_ceil(columns));
    let (width, height) = (inside.width / columns, inside.height / rows);
    let page = usize::from(columns * rows);
    let first = curves.selected / page * page;
    for (index, metric) in (0..page as u16).zip(&Metric::CURVES[first..]) {
        let (column, row) = (index / rows, index % rows);
        let place = Rect { x: inside.x + column * width + 1, y: inside.y + row * height, width: width - 1, height };
        charts.draw(*metric, place, buffer, regions);
        if *metric == selected {
            buffer.set_string(place.x - 1, place.y, "›", ui.theme.strong());
        }
    }
}

fn nothing(curves: &CurvesState, ui: &Ui) -> String {
    ui.text(match curves.comparing {
        true => "No run is marked. Mark runs with {mark-run} on the Runs screen ({screen-runs}), or press {compare} to see the watched run.",
        false => "Nothing has been trained yet. {train} starts a training with the settings on the Scene screen; {screen-runs} shows past runs.",
    })
}

/// What an action does on this screen.
pub fn perform(curves: &mut CurvesState, runs: &Runs, ui: &Ui, action: Action) -> Vec<Effect> {
    let episodes = episodes(curves, runs, ui);
    let last = Metric::CURVES.len() - 1;
    match action {
        Action::Up => curves.selected = curves.selected.checked_sub(1).unwrap_or(last),
        Action::Down => curves.selected = if curves.selected == last { 0 } else { curves.selected + 1 },
        Action::Confirm => curves.alone = !curves.alone,
        Action::Left | Action::Right => {
            let window = curves.range.window(episodes);
            let step = ((window.to - window.from) / 100.0).max(1.0).round();
            let by = if action == Action::Left { -step } else { step };
            let now = curves.crosshair.unwrap_or(window.to - by);
            curves.crosshair = Some((now + by).clamp(window.from.ceil(), window.to));
        }
        Action::FarLeft => curves.range = curves.range.pan(-0.25, episodes),
        Action::FarRight => curves.range = curves.range.pan(0.25, episodes),
        Action::ZoomIn => curves.range = curves.range.zoom(0.5, curves.crosshair, episodes),
        Action::ZoomOut => curves.range = curves.range.zoom(2.0, curves.crosshair, episodes),
        Action::WholeRange => curves.range = Range::Whole,
        Action::RecentRange => curves.range = Range::Recent,
        Action::Smoothing => {
            let index = SMOOTHINGS.iter().position(|n| *n == curves.smoothing).unwrap_or(0);
            curves.smoothing = SMOOTHINGS[(index + 1) % SMOOTHINGS.len()];
        }
        Action::LogAxis => curves.switch_scale(),
        Action::Compare => {
            curves.comparing = !curves.comparing;
            let text = if curves.comparing { "the marked runs" } else { "the watched run" };
            return vec![Effect::info(text)];
        }
        _ => {}
    }
    Vec::new()
}
