//! Figure 6: rolling success against episodes.

use super::Figure;
use super::axes::{Axis, Frame, Plot};
use super::canvas::{Canvas, TextFormat};
use super::data::{Curve, Statistics, labels, text_of};
use super::layout::{LEGEND, Mark, NOTE, around_panels, legend_height, note_height, panels};
use super::plot_style::PlotStyle;
use super::style::{Color, DOUBLE_COLUMN, GREY, LINE_WIDTH, MARGIN, Series, series};
use super::table::Table;
use super::tasks::{COLUMNS, heading};

/// Success against episodes, one panel per task.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LearningCurves {
    /// What the curves are shares of.
    pub measure: Success,
    /// The quantity on the x axis.
    pub against: Against,
    /// Number of episodes, or of greedy evaluations, the success rate is averaged over.
    pub window: usize,
    /// Number of points of the moving average that smoothed the curves.
    pub smooth: usize,
    /// How runs were summarised.
    pub statistics: Statistics,
    /// Which runs are left out, and where curves end, as sentences that begin with a space; empty for nothing special.
    pub remark: String,
    /// The panels in order.
    pub panels: Vec<CurvePanel>,
    /// Labels of the curves in legend order, each with its text in the legend. If empty, all curves are listed in
    /// order of appearance.
    pub legend: Vec<(String, String)>,
    /// Label of the reference curve, which is grey and uses up none of the other curves' colours.
    pub reference: Option<String>,
    /// Colours of labels; others have those of [`series`].
    pub colors: Vec<(String, Color)>,
    /// Size, font size, axes and bands.
    pub style: PlotStyle,
}

/// What a curve of success is a share of.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Success {
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
                "charged actions",
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

/// Room right of the panels, in points, for half the label of the last tick.
const LAST_TICK: f64 = 6.0;

/// Dash pattern of the reference curve.
const REFERENCE: &[f64] = &[3.0, 2.0];

/// Height of a legend of one row and a note of two lines.
const AROUND: f64 = 36.0;
const USUAL_NOTE: f64 = 2.0 * NOTE;

/// More overlapping bands than this hide each other and the lines.
const MAX_BANDS: usize = 5;

/// The legend of a figure: label, text and style of each curve.
struct Legend<'f> {
    entries: Vec<(&'f str, &'f str, Series)>,
    /// Whether curves have bands.
    banded: bool,
}

impl<'f> Legend<'f> {
    /// A legend in this order, of labels and texts, with the `known` colours of labels.
    fn new(order: Vec<(&'f str, &'f str)>, reference: Option<&str>, known: &[(String, Color)]) -> Self {
        let is_reference = |label: &str| Some(label) == reference;
        let others: Vec<&str> = order.iter().map(|(label, _)| *label).filter(|label| !is_reference(label)).collect();
        let mut looks = series(&others);
        for (look, label) in looks.iter_mut().zip(&others) {
            look.color = known.iter().find(|(known, _)| known == label).map_or(look.color, |(_, color)| *color);
        }
        let mut looks = looks.into_iter();
        let grey = || Series { color: GREY, dash: REFERENCE };
        let look = |(label, text): (&'f str, &'f str)| {
            let look = if is_reference(label) { None } else { looks.next() };
            (label, text, look.unwrap_or_else(grey))
        };
        let entries: Vec<_> = order.into_iter().map(look).collect();
        Self { banded: entries.len() <= MAX_BANDS, entries }
    }

    fn look(&self, curve: &Curve) -> Option<Series> {
        self.entries.iter().find(|(label, ..)| *label == curve.label).map(|(.., look)| *look)
    }

    /// Legend entries: lines with bands, or lines alone if no bands are drawn.
    fn marks(&self) -> Vec<(Mark, String)> {
        let entry = |(_, text, look): &(&str, &str, Series)| {
            let pen = look.pen(1.2 * LINE_WIDTH);
            (if self.banded { Mark::Band(pen) } else { Mark::Line(pen) }, (*text).to_owned())
        };
        self.entries.iter().map(entry).collect()
    }

    /// Draws curves as percentages, each in its label's style.
    fn draw_curves(&self, canvas: &Canvas, plot: &Plot<'_>, curves: &[Curve]) {
        let percent = |values: &[f64]| values.iter().map(|value| 100.0 * value).collect::<Vec<_>>();
        let shown = || curves.iter().filter_map(|curve| Some((curve, self.look(curve)?)));
        for (curve, look) in shown().filter(|_| self.banded) {
            let [y, low, high] = [&curve.y, &curve.low, &curve.high].map(|values| percent(values));
            plot.band(&curve.x, [&y, &low, &high], look.color);
        }
        for (curve, look) in shown() {
            plot.line(&curve.x, &percent(&curve.y), look.pen(LINE_WIDTH));
        }
        if shown().all(|(curve, _)| curve.is_empty()) {
            let look = TextFormat::SMALL.centered().color(GREY);
            canvas.text(plot.rect.center(), "no finished episodes", look);
        }
    }
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
        let legend = Legend::new(order, self.reference.as_deref(), &self.colors);
        let has_intervals = curves.iter().any(|curve| !curve.low.is_empty());
        Legend { banded: legend.banded && has_intervals && !self.style.without_bands, ..legend }
    }

    /// The label, the text and the colour of each curve in legend order, and whether they have bands.
    pub fn entries(&self) -> (Vec<(&str, &str, Color)>, bool) {
        let Legend { entries, banded } = self.legend();
        (entries.into_iter().map(|(label, text, look)| (label, text, look.color)).collect(), banded)
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
            Success::Training => format!("Share of the last {window} training episodes that reached the goal"),
            Success::Greedy => format!("Success of the actor without noise, mean of the last {window} evaluations"),
        };
        let smooth = if self.smooth > 1 { format!(", mean of {} points", self.smooth) } else { String::new() };
        let what = what + &smooth + "; of fewer at the start." + self.against.words()[2];
        let mark = if legend.banded { "band" } else { "in the CSV only" };
        format!("{what} {}.{}", self.statistics.caption(mark), self.remark)
    }

    fn x_axis(&self, curves: &[Curve]) -> Axis {
        let values = curves.iter().flat_map(|curve| &curve.x).copied().filter(|x| x.is_finite());
        let [first, last] = self.style.x.unwrap_or([0.0, values.fold(1.0, f64::max)]);
        Axis::linear(self.against.label(), first, last, 5)
    }

    fn y_axis(&self) -> Axis {
        let [low, high] = self.style.y.unwrap_or([0.0, 103.0]);
        Axis::linear("success rate (%)", low, high, 6)
    }
}

impl Figure for LearningCurves {
    fn size(&self) -> [f64; 2] {
        let width = self.width();
        let legend = self.legend();
        let rows = self.panels.len().div_ceil(self.columns()).max(1);
        let note = (note_height(width, &self.caption(&legend)) - USUAL_NOTE).max(0.0);
        let further = (legend_height(width - 2.0 * MARGIN - LAST_TICK, &legend.marks()) - LEGEND).max(0.0);
        [width, rows as f64 * self.style.height + AROUND + further + note].map(|side| side * self.style.scale())
    }

    fn scale(&self) -> f64 {
        self.style.scale()
    }

    fn curves(&self) -> Option<&LearningCurves> {
        Some(self)
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
                let name = &text_of(&self.legend, &curve.label);
                for (n, (x, y)) in curve.x.iter().zip(&curve.y).enumerate() {
                    table.push(&[&panel.task, name, x, y, &curve.low.get(n).copied(), &curve.high.get(n).copied()]);
                }
            }
        }
        table
    }
}
