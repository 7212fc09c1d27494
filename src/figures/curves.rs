//! Figure 6, rolling success against episodes, and performance profiles.

use super::Figure;
use super::axes::{Axis, Frame, Plot};
use super::canvas::{Canvas, Type};
use super::data::{Curve, Statistics, labels};
use super::layout::{LEGEND, Mark, legend, legend_height, note, panels};
use super::style::{DOUBLE_COLUMN, GREY, LINE_WIDTH, MARGIN, SINGLE_COLUMN, Series, series};
use super::table::Table;
use super::tasks::{COLUMNS, heading};

/// Success against episodes, one panel a task.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LearningCurves {
    /// What was counted: the episodes of training, or greedy evaluations.
    pub greedy: bool,
    /// What x is.
    pub progress: Progress,
    /// Number of episodes, or of greedy evaluations, the success rate is averaged over.
    pub window: usize,
    /// How runs were summarised.
    pub statistics: Statistics,
    /// The panels in order.
    pub panels: Vec<CurvePanel>,
}

/// What the success of a run is drawn against.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Progress {
    /// Episodes of training.
    #[default]
    Episodes,
    /// Every action in the real environment: of training, of the rollouts from which the action
    /// clusters were built, and of the launches from which the dynamics model learned.
    EnvironmentSteps,
}

impl Progress {
    /// The label of its axis, its column in the CSV, and what a caption says of it.
    fn words(self) -> [&'static str; 3] {
        match self {
            Self::Episodes => ["episode", "episode", ""],
            Self::EnvironmentSteps => [
                "environment steps",
                "environment_steps",
                " Steps are all actions in the real environment: training, the rollouts behind the clusters, and the \
                 launches behind the model.",
            ],
        }
    }
}

/// Curves of one task: x as [`Progress`] says, y the share of successes, 0 to 1.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CurvePanel {
    /// Name of the task.
    pub task: String,
    /// One curve a method.
    pub curves: Vec<Curve>,
}

/// Share of runs that score better than a threshold, against the threshold.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PerformanceProfile {
    /// What is scored, with its unit.
    pub measure: String,
    /// How intervals were computed.
    pub statistics: Statistics,
    /// One curve a method: x the threshold, y the share of runs above it.
    pub curves: Vec<Curve>,
}

/// Room right of the panels, in points, for half the label of the last tick.
pub(super) const LAST_TICK: f64 = 6.0;

/// More bands than these, one over the other, hide each other and the lines.
const MOST_BANDS: usize = 5;

/// Where a caption finds the intervals of curves with so many labels.
fn band_mark(labels: usize) -> &'static str {
    if labels <= MOST_BANDS { "band" } else { "in the CSV only" }
}

/// Draws curves as percentages, each in the look of its label.
fn draw_curves(canvas: &Canvas<'_>, plot: &Plot<'_, '_>, curves: &[Curve], order: &[&str]) {
    let percent = |values: &[f64]| values.iter().map(|value| 100.0 * value).collect::<Vec<_>>();
    let looks = series(order);
    let look = |curve: &Curve| looks[order.iter().position(|label| *label == curve.label).unwrap_or(0)];
    for curve in curves.iter().filter(|_| order.len() <= MOST_BANDS) {
        let from = curve.partial.min(curve.x.len());
        let [x, y, low, high] = [&curve.x, &curve.y, &curve.low, &curve.high].map(|values| values.get(from..));
        let [x, y, low, high] = [x, y, low, high].map(Option::unwrap_or_default);
        plot.band(x, [&percent(y), &percent(low), &percent(high)], look(curve).color);
    }
    for curve in curves {
        plot.rolling(&curve.x, &percent(&curve.y), curve.partial, look(curve).pen(LINE_WIDTH));
    }
    if order.len() > 1 {
        let end = |curve: &Curve| {
            let (x, y) = curve.x.iter().zip(&curve.y).rfind(|(x, y)| x.is_finite() && y.is_finite())?;
            Some((plot.at(*x, 100.0 * y), look(curve)))
        };
        plot.end_numbers(curves.iter().filter_map(end));
    }
    if curves.iter().all(Curve::is_empty) {
        let look = Type::SMALL.centered().color(GREY);
        canvas.text(plot.rect.center(), "no finished episodes", look);
    }
}

/// The legend of curves: lines with bands, or lines alone where no curve has an interval.
fn marks<'c>(curves: impl IntoIterator<Item = &'c Curve>) -> Vec<(Mark, String)> {
    let curves: Vec<&Curve> = curves.into_iter().collect();
    let order = labels(curves.iter().map(|curve| curve.label.as_str()));
    let banded = order.len() <= MOST_BANDS && curves.iter().any(|curve| !curve.low.is_empty());
    let entry = |(look, label): (Series, &&str)| {
        let pen = look.pen(1.2 * LINE_WIDTH);
        let text = if order.len() > 1 { look.numbered(label) } else { (*label).to_owned() };
        (if banded { Mark::Band(pen) } else { Mark::Line(pen) }, text)
    };
    series(&order).into_iter().zip(&order).map(entry).collect()
}

/// What a legend of these curves needs beyond one row, so that it takes nothing from the plots.
fn further_legend<'c>(width: f64, curves: impl IntoIterator<Item = &'c Curve>) -> f64 {
    (legend_height(width, &marks(curves)) - LEGEND).max(0.0)
}

fn rate_axis(label: &str) -> Axis {
    Axis::linear(label, 0.0, 103.0, 6)
}

impl Figure for LearningCurves {
    fn size(&self) -> [f64; 2] {
        let curves = self.panels.iter().flat_map(|panel| &panel.curves);
        let legend = further_legend(DOUBLE_COLUMN - 2.0 * MARGIN - LAST_TICK, curves);
        [DOUBLE_COLUMN, self.panels.len().div_ceil(COLUMNS).max(1) as f64 * 138.0 + 36.0 + legend]
    }

    fn draw(&self, canvas: &Canvas<'_>) {
        let page = canvas.page().inset(MARGIN).cut(0.0, 0.0, LAST_TICK, 0.0);
        if self.panels.is_empty() {
            return canvas.nothing(page, "no learning curves");
        }
        let what = if self.greedy {
            format!("Success of the actor without noise, mean of the last {} evaluations.", self.window)
        } else {
            format!("Share of the last {} training episodes that reached the goal.", self.window)
        };
        let what = what + self.progress.words()[2];
        let order = labels(self.panels.iter().flat_map(|panel| &panel.curves).map(|curve| curve.label.as_str()));
        let partial = self.panels.iter().flat_map(|panel| &panel.curves).any(|curve| curve.partial > 0);
        let faint = if partial { " Faint: the mean of fewer, at the start." } else { "" };
        let text = format!("{what}{faint} {}.", self.statistics.caption(band_mark(order.len())));
        let rect = note(canvas, page, &text);
        let rect = legend(canvas, rect, &marks(self.panels.iter().flat_map(|panel| &panel.curves)));
        let columns = COLUMNS.min(self.panels.len());
        for (panel, place) in self.panels.iter().zip(panels(rect, self.panels.len(), columns)) {
            let last =
                panel.curves.iter().flat_map(|curve| &curve.x).copied().filter(|x| x.is_finite()).fold(1.0, f64::max);
            let x = Axis::linear(self.progress.words()[0], 0.0, last, 5).labelled(place.x_label);
            let y = rate_axis("success rate (%)").labelled(place.y_label);
            let frame = Frame { title: &heading(&panel.task), grid: true, square: false };
            let plot = Plot::new(canvas, place.cell, &frame, x, y);
            draw_curves(canvas, &plot, &panel.curves, &order);
        }
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["task", "method", self.progress.words()[1], "success", "low", "high"]);
        for panel in &self.panels {
            for curve in &panel.curves {
                push_curve(&mut table, &panel.task, curve);
            }
        }
        table
    }
}

impl Figure for PerformanceProfile {
    fn size(&self) -> [f64; 2] {
        [SINGLE_COLUMN, 190.0 + further_legend(SINGLE_COLUMN - 2.0 * MARGIN, &self.curves)]
    }

    fn draw(&self, canvas: &Canvas<'_>) {
        let page = canvas.page().inset(MARGIN);
        if self.curves.iter().all(Curve::is_empty) {
            return canvas.nothing(page, "no scores");
        }
        let order = labels(self.curves.iter().map(|curve| curve.label.as_str()));
        let rect = note(canvas, page, &format!("{}.", self.statistics.caption(band_mark(order.len()))));
        let rect = legend(canvas, rect, &marks(&self.curves));
        let thresholds = || self.curves.iter().flat_map(|curve| curve.x.iter().copied()).filter(|x| x.is_finite());
        let (low, high) = (thresholds().fold(f64::INFINITY, f64::min), thresholds().fold(f64::NEG_INFINITY, f64::max));
        let x = Axis::linear(&format!("threshold \u{3c4}: {}", self.measure), low, high.max(low + 1e-9), 6);
        let frame = Frame { title: "", grid: true, square: false };
        let plot = Plot::new(canvas, rect, &frame, x, rate_axis("runs above \u{3c4} (%)"));
        draw_curves(canvas, &plot, &self.curves, &order)
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["measure", "method", "threshold", "fraction", "low", "high"]);
        for curve in &self.curves {
            push_curve(&mut table, &self.measure, curve);
        }
        table
    }
}

/// A row for each point of a curve.
fn push_curve(table: &mut Table, name: &str, curve: &Curve) {
    for (n, (x, y)) in curve.x.iter().zip(&curve.y).enumerate() {
        table.push(&[&name, &curve.label, x, y, &curve.low.get(n).copied(), &curve.high.get(n).copied()]);
    }
}
