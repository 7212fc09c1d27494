//! Figure 6, rolling success against episodes, and performance profiles.

use super::Figure;
use super::axes::{Axis, Frame, Plot};
use super::canvas::{Canvas, TextFormat};
use super::data::{Curve, Statistics, labels};
use super::layout::{LEGEND, Mark, NOTE, around_panels, legend_height, note_height, panels};
use super::plot_style::PlotStyle;
use super::style::{DOUBLE_COLUMN, GREY, LINE_WIDTH, MARGIN, SINGLE_COLUMN, Series, series};
use super::table::Table;
use super::tasks::{COLUMNS, heading};

/// Success against episodes, one panel per task.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LearningCurves {
    /// What the curves are shares of.
    pub measure: SuccessMeasure,
    /// The quantity on the x axis.
    pub against: Against,
    /// Number of episodes, or of greedy evaluations, the success rate is averaged over.
    pub window: usize,
    /// How runs were summarised.
    pub statistics: Statistics,
    /// The panels in order.
    pub panels: Vec<CurvePanel>,
    /// Labels of the curves in legend order, each with its text in the legend. If empty, all curves are listed in
    /// order of appearance.
    pub legend: Vec<(String, String)>,
    /// Label of the reference curve, which is grey and uses up none of the other curves' colours.
    pub reference: Option<String>,
    /// Labels among which each curve has its colour: those of all runs where only some are shown. If empty, those of
    /// the curves.
    pub known: Vec<String>,
    /// Size, font size, axes and bands.
    pub style: PlotStyle,
}

/// What a curve of success is a share of.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum SuccessMeasure {
    /// Of the latest training episodes: those that reached the goal.
    #[default]
    Training,
    /// Of the latest greedy evaluations: those that reached the goal.
    Greedy,
}

/// The quantity against which success is plotted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Against {
    /// Episodes of training.
    #[default]
    Episodes,
    /// Actions of episodes and practice.
    Actions,
    /// All actions in the real environment: of episodes, of practice, of the rollouts from which the action clusters
    /// were built, of the launches on which the dynamics model was trained, and of the search for subgoals.
    Charged,
}

impl Against {
    /// The name of one of them, as on the axis.
    pub fn label(self) -> &'static str {
        self.words()[0]
    }

    /// The axis label, the CSV column, and a sentence for the caption.
    fn words(self) -> [&'static str; 3] {
        match self {
            Self::Episodes => ["episode", "episode", ""],
            Self::Actions => ["action", "actions", " Actions are those of episodes and practice."],
            Self::Charged => [
                "charged action",
                "charged_actions",
                " Charged are all actions in the real environment: episodes, practice, the rollouts behind the \
                 clusters, the launches behind the model, and the search for subgoals.",
            ],
        }
    }
}

/// The curves of one task: x as in [`Against`], y the success rate, 0 to 1.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CurvePanel {
    /// Name of the task.
    pub task: String,
    /// One curve per method.
    pub curves: Vec<Curve>,
}

/// Share of runs that score above a threshold, against the threshold.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PerformanceProfile {
    /// What is scored, with its unit.
    pub measure: String,
    /// How intervals were computed.
    pub statistics: Statistics,
    /// One curve per method: x is the threshold, y the share of runs above it.
    pub curves: Vec<Curve>,
}

/// Room right of the panels, in points, for half the label of the last tick.
pub(super) const LAST_TICK: f64 = 6.0;

/// Dash pattern of the reference curve.
const REFERENCE: &[f64] = &[3.0, 2.0];

/// Height of a note of two lines.
const USUAL_NOTE: f64 = 2.0 * NOTE;

/// More overlapping bands than this hide each other and the lines.
const MAX_BANDS: usize = 5;

/// How a caption describes intervals that are not drawn.
const IN_TABLE: &str = "in the CSV only";

/// How a caption describes where the intervals are shown, for this many labels.
fn band_mark(labels: usize) -> &'static str {
    if labels <= MAX_BANDS { "band" } else { IN_TABLE }
}

/// The legend of a figure: label, text and style of each curve.
struct Legend<'f> {
    entries: Vec<(&'f str, &'f str, Series)>,
    /// Whether curves have bands.
    banded: bool,
    /// Whether curves have their numbers in the legend at their right ends.
    numbered: bool,
}

impl<'f> Legend<'f> {
    /// A legend in order of appearance, without numbers: for curves that all end at the same point.
    fn of(curves: impl IntoIterator<Item = &'f Curve>) -> Self {
        let curves: Vec<&Curve> = curves.into_iter().collect();
        let order = labels(curves.iter().map(|curve| curve.label.as_str()));
        Self { numbered: false, ..Self::new(&curves, order.into_iter().map(|label| (label, label)), None, &[]) }
    }

    /// A legend in this order, of labels and texts, with the colours that the labels have among the `known` ones.
    fn new(
        curves: &[&'f Curve],
        order: impl IntoIterator<Item = (&'f str, &'f str)>,
        reference: Option<&str>,
        known: &[String],
    ) -> Self {
        let order: Vec<(&str, &str)> = order.into_iter().collect();
        let is_reference = |label: &str| Some(label) == reference;
        let others: Vec<&str> = order.iter().map(|(label, _)| *label).filter(|label| !is_reference(label)).collect();
        let mut looks = series(&others);
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        let colours = series(&known);
        for (look, label) in looks.iter_mut().zip(&others) {
            let place = known.iter().position(|known| known == label);
            look.color = place.map_or(look.color, |place| colours[place].color);
        }
        let mut looks = looks.into_iter();
        let grey = || Series { color: GREY, dash: REFERENCE, place: 0 };
        let look = |(place, (label, text)): (usize, (&'f str, &'f str))| {
            let look = Some(()).filter(|()| !is_reference(label)).and_then(|()| looks.next());
            (label, text, Series { place, ..look.unwrap_or_else(grey) })
        };
        let entries: Vec<_> = order.into_iter().enumerate().map(look).collect();
        let banded = entries.len() <= MAX_BANDS && curves.iter().any(|curve| !curve.low.is_empty());
        Self { numbered: entries.len() > 1, entries, banded }
    }

    fn look(&self, curve: &Curve) -> Option<Series> {
        self.entries.iter().find(|(label, ..)| *label == curve.label).map(|(.., look)| *look)
    }

    /// Legend entries: lines with bands, or lines alone if no bands are drawn.
    fn marks(&self) -> Vec<(Mark, String)> {
        let entry = |(_, text, look): &(&str, &str, Series)| {
            let pen = look.pen(1.2 * LINE_WIDTH);
            let text = if self.numbered { look.numbered(text) } else { (*text).to_owned() };
            (if self.banded { Mark::Band(pen) } else { Mark::Line(pen) }, text)
        };
        self.entries.iter().map(entry).collect()
    }

    /// Extra height that it needs beyond one row.
    fn further(&self, width: f64) -> f64 {
        (legend_height(width, &self.marks()) - LEGEND).max(0.0)
    }

    /// Draws curves as percentages, each in its label's style.
    fn draw_curves(&self, canvas: &Canvas, plot: &Plot<'_>, curves: &[Curve]) {
        let percent = |values: &[f64]| values.iter().map(|value| 100.0 * value).collect::<Vec<_>>();
        let shown = || curves.iter().filter_map(|curve| Some((curve, self.look(curve)?)));
        for (curve, look) in shown().filter(|_| self.banded) {
            let from = curve.partial.min(curve.x.len());
            let [x, y, low, high] = [&curve.x, &curve.y, &curve.low, &curve.high].map(|values| values.get(from..));
            let [x, y, low, high] = [x, y, low, high].map(Option::unwrap_or_default);
            plot.band(x, [&percent(y), &percent(low), &percent(high)], look.color);
        }
        for (curve, look) in shown() {
            plot.rolling(&curve.x, &percent(&curve.y), curve.partial, look.pen(LINE_WIDTH));
        }
        if self.numbered {
            let end = |(curve, look): (&Curve, Series)| {
                let mut points = curve.x.iter().zip(&curve.y).map(|(x, y)| plot.at(*x, 100.0 * y));
                Some((points.rfind(|point| plot.rect.contains(*point))?, look))
            };
            plot.end_numbers(shown().filter_map(end));
        }
        if shown().all(|(curve, _)| curve.is_empty()) {
            let look = TextFormat::SMALL.centered().color(GREY);
            canvas.text(plot.rect.center(), "no finished episodes", look);
        }
    }
}

fn rate_axis(label: &str) -> Axis {
    Axis::linear(label, 0.0, 103.0, 6)
}

impl LearningCurves {
    fn legend(&self) -> Legend<'_> {
        let curves: Vec<&Curve> = self.panels.iter().flat_map(|panel| &panel.curves).collect();
        let there = labels(curves.iter().map(|curve| curve.label.as_str()));
        let named = self.legend.iter().map(|(label, text)| (label.as_str(), text.as_str()));
        let mut order: Vec<(&str, &str)> = named.filter(|(label, _)| there.contains(label)).collect();
        // A reference that is not named in the legend comes last.
        let is_shown = |label: &&str| self.legend.is_empty() || self.reference.as_deref() == Some(label);
        let others =
            there.into_iter().filter(is_shown).filter(|label| self.legend.iter().all(|(known, _)| known != label));
        order.extend(others.map(|label| (label, label)).collect::<Vec<_>>());
        let legend = Legend::new(&curves, order, self.reference.as_deref(), &self.known);
        Legend { banded: legend.banded && !self.style.without_bands, ..legend }
    }

    /// Width of the page before magnification, in points.
    fn width(&self) -> f64 {
        self.style.width() / self.style.scale()
    }

    /// Number of columns, so that panels are about as wide as in other figures.
    fn columns(&self) -> usize {
        let fitting = (COLUMNS as f64 * self.width() / DOUBLE_COLUMN).round() as usize;
        fitting.clamp(1, COLUMNS).min(self.panels.len().max(1))
    }

    /// The note below the panels.
    fn caption(&self, legend: &Legend<'_>) -> String {
        let window = self.window;
        let what = match self.measure {
            SuccessMeasure::Training => format!("Share of the last {window} training episodes that reached the goal."),
            SuccessMeasure::Greedy => {
                format!("Success of the actor without noise, mean of the last {window} evaluations.")
            }
        };
        let what = what + self.against.words()[2];
        let partial = self.panels.iter().flat_map(|panel| &panel.curves).any(|curve| curve.partial > 0);
        let faint = if partial { " Faint: the mean of fewer, at the start." } else { "" };
        let mark = if self.style.without_bands { IN_TABLE } else { band_mark(legend.entries.len()) };
        format!("{what}{faint} {}.", self.statistics.caption(mark))
    }

    fn x_axis(&self, curves: &[Curve]) -> Axis {
        let label = self.against.words()[0];
        let values = || curves.iter().flat_map(|curve| &curve.x).copied().filter(|x| x.is_finite());
        let last = values().fold(1.0, f64::max);
        let first = if self.style.logarithmic { values().filter(|x| *x > 0.0).fold(last, f64::min) } else { 0.0 };
        let [first, last] = self.style.x.unwrap_or([first, last]);
        if self.style.logarithmic { Axis::decades(label, first, last) } else { Axis::linear(label, first, last, 5) }
    }

    fn y_axis(&self) -> Axis {
        let label = "success rate (%)";
        self.style.y.map_or_else(|| rate_axis(label), |[low, high]| Axis::linear(label, low, high, 6))
    }
}

impl Figure for LearningCurves {
    fn size(&self) -> [f64; 2] {
        let width = self.width();
        let legend = self.legend();
        let rows = self.panels.len().div_ceil(self.columns()).max(1);
        // The default page height includes a note of two lines.
        let note = (note_height(width, &self.caption(&legend)) - USUAL_NOTE).max(0.0);
        let further = legend.further(width - 2.0 * MARGIN - LAST_TICK)
            + if self.style == PlotStyle::default() { 0.0 } else { note };
        [width, rows as f64 * self.style.height() + 36.0 + further].map(|side| side * self.style.scale())
    }

    fn scale(&self) -> f64 {
        self.style.scale()
    }

    fn draw(&self, canvas: &Canvas) {
        let curves = self.legend();
        let empty = self.panels.is_empty().then_some("no learning curves");
        let page = canvas.page().inset(MARGIN).cut(0.0, 0.0, LAST_TICK, 0.0);
        let Some(rect) = around_panels(canvas, page, empty, &self.caption(&curves), &curves.marks()) else { return };
        for (panel, place) in self.panels.iter().zip(panels(rect, self.panels.len(), self.columns())) {
            let x = self.x_axis(&panel.curves).labelled(place.x_label);
            let y = self.y_axis().labelled(place.y_label);
            let frame = Frame { title: &heading(&panel.task), grid: true, square: false };
            let plot = Plot::new(canvas, place.cell, &frame, x, y);
            curves.draw_curves(canvas, &plot, &panel.curves);
        }
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["task", "method", self.against.words()[1], "success", "low", "high"]);
        for panel in &self.panels {
            for curve in &panel.curves {
                let named = self.legend.iter().find(|(label, _)| *label == curve.label).map(|(_, name)| name);
                push_curve(&mut table, &panel.task, named.unwrap_or(&curve.label), curve);
            }
        }
        table
    }
}

impl Figure for PerformanceProfile {
    fn size(&self) -> [f64; 2] {
        [SINGLE_COLUMN, 190.0 + Legend::of(&self.curves).further(SINGLE_COLUMN - 2.0 * MARGIN)]
    }

    fn draw(&self, canvas: &Canvas) {
        let curves = Legend::of(&self.curves);
        let caption = format!("{}.", self.statistics.caption(band_mark(curves.entries.len())));
        let empty = self.curves.iter().all(Curve::is_empty).then_some("no scores");
        let page = canvas.page().inset(MARGIN);
        let Some(rect) = around_panels(canvas, page, empty, &caption, &curves.marks()) else { return };
        let thresholds = || self.curves.iter().flat_map(|curve| curve.x.iter().copied()).filter(|x| x.is_finite());
        let (low, high) = (thresholds().fold(f64::INFINITY, f64::min), thresholds().fold(f64::NEG_INFINITY, f64::max));
        let x = Axis::linear(&format!("threshold \u{3c4}: {}", self.measure), low, high.max(low + 1e-9), 6);
        let frame = Frame { title: "", grid: true, square: false };
        let plot = Plot::new(canvas, rect, &frame, x, rate_axis("share above \u{3c4} (%)"));
        curves.draw_curves(canvas, &plot, &self.curves)
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["measure", "method", "threshold", "fraction", "low", "high"]);
        for curve in &self.curves {
            push_curve(&mut table, &self.measure, &curve.label, curve);
        }
        table
    }
}

/// Adds a row for each point of a curve.
fn push_curve(table: &mut Table, name: &str, label: &str, curve: &Curve) {
    for (n, (x, y)) in curve.x.iter().zip(&curve.y).enumerate() {
        table.push(&[&name, &label, x, y, &curve.low.get(n).copied(), &curve.high.get(n).copied()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Color;

    #[test]
    fn a_curve_has_its_colour_among_all_known_ones() {
        let known = ["ours", "theirs", "DDPG", "DDPG, gamma 0.5"].map(str::to_owned);
        let among: Vec<Color> = series(&known.each_ref().map(|label| &**label)).iter().map(|look| look.color).collect();
        for (label, color) in known.iter().zip(among) {
            let curve = Curve { label: label.clone(), x: vec![1.0], y: vec![0.5], ..Curve::default() };
            let figure = LearningCurves {
                panels: vec![CurvePanel { task: "task1".into(), curves: vec![curve] }],
                known: known.to_vec(),
                ..LearningCurves::default()
            };
            assert_eq!(figure.legend().entries[0].2.color, color, "{label}");
        }
    }
}
