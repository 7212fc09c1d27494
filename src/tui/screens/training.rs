//! The Training screen: curves of the runs.

use std::collections::HashSet;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::Hits;
use super::frame::{WIDE, fitting, hint, pane};
use crate::tui::actions::{Action, Context};
use crate::tui::app::App;
use crate::tui::chart::{Curve, Plot, Range, Scale, draw as draw_chart};
use crate::tui::facts::{Level, RunFacts};
use crate::tui::metric::Metric;
use crate::tui::rate::span;

/// What the curves show.
#[derive(Debug)]
pub struct Curves {
    /// The episodes shown.
    pub range: Range,
    /// The episode whose values are read off.
    pub crosshair: Option<f32>,
    /// The selected curve.
    pub selected: usize,
    /// Only the selected curve is shown.
    pub alone: bool,
    /// The marked runs are shown, not only the watched one.
    pub comparing: bool,
    /// Each value is the mean of so many episodes.
    pub smoothing: usize,
    logarithmic: HashSet<Metric>,
}

const SMOOTHINGS: [usize; 4] = [1, 10, 50, 200];

impl Default for Curves {
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

impl Curves {
    /// Leaves what lies over the curves; false if there is nothing.
    pub fn leave(&mut self) -> bool {
        self.crosshair.take().is_some() || std::mem::take(&mut self.alone)
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
fn shown_runs(app: &App) -> Vec<&RunFacts> {
    let facts = app.desk.facts();
    if app.curves.comparing {
        return facts.runs.iter().filter(|run| run.opened && app.runs.is_marked(run)).collect();
    }
    facts.current_run().into_iter().collect()
}

/// Episodes of the longest run that is shown.
pub fn episodes(app: &App) -> usize {
    shown_runs(app).iter().map(|run| run.curves.episodes()).max().unwrap_or(0)
}

/// Draws one chart.
pub fn chart(app: &App, metric: Metric, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let runs = shown_runs(app);
    let many = runs.len() > 1;
    let hits_of = runs.first().filter(|_| metric == Metric::SubgoalShare && !many);
    let by_subgoal = hits_of.map(|run| run.hits()).unwrap_or_default();
    let single = by_subgoal.iter().enumerate().map(|(index, values)| Curve {
        name: (index + 1).to_string(),
        colour: app.theme.stage(index),
        values,
        points: &[],
    });
    let common = common_start(&runs);
    let whole = runs.iter().filter(|_| by_subgoal.is_empty());
    let curves = whole.enumerate().map(|(index, run)| Curve {
        name: if many { run.name[common..].to_owned() } else { String::new() },
        colour: app.theme.stage(index),
        values: run.curves.get(metric),
        points: if metric == Metric::Success { &run.evaluations } else { &[] },
    });
    let empty = format!("no episodes yet: {} trains", app.keymap.key_for(Action::Train, Context::Everywhere));
    let smoothing = app.curves.smoothing(metric);
    let title = match (smoothing, app.curves.scale(metric)) {
        (1, Scale::Linear) => metric.title().to_owned(),
        (1, Scale::Log) => format!("{}, log", metric.title()),
        (n, Scale::Linear) => format!("{}, mean of {n}", metric.title()),
        (n, Scale::Log) => format!("{}, mean of {n}, log", metric.title()),
    };
    let plot = Plot {
        title: &title,
        curves: single.chain(curves).collect(),
        x: app.curves.range.window(episodes(app)),
        y: metric.info().range,
        scale: app.curves.scale(metric),
        smoothing,
        crosshair: app.curves.crosshair,
        empty: &empty,
    };
    if let Some(axes) = draw_chart(&plot, area, &app.theme, buffer) {
        hits.charts.push((axes, metric));
    }
}

/// Length of what the names of the runs have in common, up to a hyphen: a legend has
/// little room.
fn common_start(runs: &[&RunFacts]) -> usize {
    let Some((first, others)) = runs.split_first() else { return 0 };
    let begins = |end: usize| others.iter().all(|run| run.name.starts_with(&first.name[..end]) && run.name.len() > end);
    first.name.match_indices('-').map(|(at, _)| at + 1).take_while(|end| begins(*end)).last().unwrap_or(0)
}

/// Draws charts below one another, as many as there is room for.
pub fn stack(app: &App, metrics: &[Metric], area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let count = (metrics.len() as u16).min(area.height / 5).max(1);
    let height = area.height / count;
    for (index, metric) in (0..count).zip(metrics) {
        let last = index + 1 == count;
        let rows = if last { area.height - index * height } else { height };
        let place = Rect { y: area.y + index * height, height: rows, x: area.x + 1, width: area.width - 1 };
        chart(app, *metric, place, buffer, hits);
    }
}

/// Draws the screen.
pub fn draw(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let runs = shown_runs(app);
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
    let inside = pane(&title, area, &app.theme, buffer);
    if runs.is_empty() {
        return hint(&nothing(app), inside, &app.theme, buffer);
    }
    let selected = Metric::CURVES[app.curves.selected];
    if app.curves.alone {
        return chart(app, selected, inside, buffer, hits);
    }
    let columns: u16 = if area.width >= WIDE { 2 } else { 1 };
    let rows = (inside.height / 7).clamp(1, (Metric::CURVES.len() as u16).div_ceil(columns));
    let (width, height) = (inside.width / columns, inside.height / rows);
    let page = usize::from(columns * rows);
    let first = app.curves.selected / page * page;
    for (index, metric) in (0..page as u16).zip(&Metric::CURVES[first..]) {
        let (column, row) = (index / rows, index % rows);
        let place = Rect { x: inside.x + column * width + 1, y: inside.y + row * height, width: width - 1, height };
        chart(app, *metric, place, buffer, hits);
        if *metric == selected {
            buffer.set_string(place.x - 1, place.y, "›", app.theme.strong());
        }
    }
}

fn nothing(app: &App) -> String {
    let key = |action, context| app.keymap.key_for(action, context);
    if app.curves.comparing {
        let mark = key(Action::Mark, Context::Runs);
        let compare = key(Action::Compare, Context::Curves);
        return format!(
            "No run is marked. Mark runs with {mark} on the Runs screen (5), or press {compare} to see the watched run."
        );
    }
    let train = key(Action::Train, Context::Everywhere);
    format!(
        "Nothing has been trained yet. {train} starts a training with the settings on the Scene screen; 5 shows past runs."
    )
}

/// What an action does on this screen.
pub fn perform(app: &mut App, action: Action) {
    let episodes = episodes(app);
    let last = Metric::CURVES.len() - 1;
    let curves = &mut app.curves;
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
            app.say(Level::Info, text);
        }
        _ => {}
    }
}
