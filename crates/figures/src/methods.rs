//! Scores of many methods side by side: one row per method, one panel per task.

use super::Figure;
use super::axes::{Axis, Frame, Plot};
use super::canvas::{Canvas, Pen, TextFormat};
use super::data::{Statistics, labels, text_of};
use super::geometry::Rect;
use super::layout::{Mark, around_panels, legend_height, note_height};
use super::style::{
    Color, DOUBLE_COLUMN, FRAME_WIDTH, GAP, GREY, GRID, LABEL_SIZE, MARGIN, SMALL_SIZE, Series, THIN_WIDTH, TITLE_SIZE,
    faded, series,
};
use super::table::Table;
use super::tasks::heading;
use mge_stats::Estimate;

/// A score of every method on every task: summaries with intervals, and the single runs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MethodScores {
    /// What is scored, with its unit.
    pub measure: String,
    /// How runs were summarised.
    pub statistics: Statistics,
    /// The method with which the others are compared; the first if None.
    pub reference: Option<String>,
    /// The panels in order.
    pub panels: Vec<ScorePanel>,
    /// Labels of methods with their texts in the legend, where these are others.
    pub legend: Vec<(String, String)>,
}

/// The methods on one task, or over all tasks.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ScorePanel {
    /// Name of the task, or another title.
    pub task: String,
    /// The methods run on it.
    pub methods: Vec<MethodScore>,
}

/// One method on one task.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodScore {
    /// Name of the method. Equal labels share a row and a colour in all panels.
    pub label: String,
    /// Its summary.
    pub estimate: Estimate,
    /// The score of each run; empty if there are too many to show.
    pub runs: Vec<f64>,
}

/// Height of a row of a panel.
const ROW: f64 = 1.45 * SMALL_SIZE;
/// Ticks and labels below a panel, its title above.
const AROUND: f64 = 1.6 * TITLE_SIZE + 2.8 * SMALL_SIZE;
/// Offset of the dots of runs below the middle of their row, in rows.
const BELOW: f64 = 0.27;
/// Half the height of an interval's bar, and of the stroke at its centre, in points.
const BAR: f64 = 1.5;
const STROKE: f64 = 2.4;
/// Most panels side by side.
const COLUMNS: usize = 4;

impl MethodScores {
    /// The method with which the others are compared.
    fn compared(&self) -> &str {
        self.reference.as_deref().or(self.methods().first().copied()).unwrap_or_default()
    }

    /// Names of all methods.
    fn methods(&self) -> Vec<&str> {
        labels(self.panels.iter().flat_map(|panel| &panel.methods).map(|method| method.label.as_str()))
    }

    /// The legend: the colour and name of every method, in the order of the rows.
    fn marks(&self) -> Vec<(Mark, String)> {
        let methods = self.methods();
        let entry = |(look, label): (Series, &&str)| (Mark::Dot(look.color), text_of(&self.legend, label).to_owned());
        series(&methods).into_iter().zip(&methods).map(entry).collect()
    }

    /// Number of columns, chosen so that rows are about equally long.
    fn columns(&self) -> usize {
        let count = self.panels.len().max(1);
        count.div_ceil(count.div_ceil(COLUMNS))
    }

    fn rows(&self) -> usize {
        self.panels.len().div_ceil(self.columns()).max(1)
    }

    /// The note below the panels.
    fn caption(&self) -> String {
        let runs = self.panels.iter().flat_map(|panel| &panel.methods).any(|method| !method.runs.is_empty());
        let small = if runs { " Small dots: single runs." } else { "" };
        format!("{}.{small} Dashed: {}.", self.statistics.caption("bars"), text_of(&self.legend, self.compared()))
    }

    /// The x axis, from slightly below zero, so that dots there are drawn whole, to beyond the largest score.
    fn x_axis(&self) -> Axis {
        let scores = self.panels.iter().flat_map(|panel| &panel.methods);
        let values = scores.flat_map(|score| score.estimate.values().into_iter().chain(score.runs.iter().copied()));
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((0.0, 0.1), |(low, high): (f64, f64), value| (low.min(value), high.max(value)));
        Axis::linear("", low - 0.04 * (high - low), high + 0.04 * (high - low), 6)
    }

    fn draw_panel(&self, canvas: &Canvas, panel: &ScorePanel, cell: Rect) {
        let methods = self.methods();
        let row = |label: &str| methods.iter().position(|name| *name == label).unwrap_or(0);
        let place = |row: usize| (methods.len() - row) as f64;
        let looks = series(&methods);
        let y = Axis::with_ticks("", 0.4, methods.len() as f64 + 0.6, Vec::new());
        let frame = Frame { title: &heading(&panel.task), grid: false, square: false };
        let plot = Plot::new(canvas, cell, &frame, self.x_axis(), y);
        for row in 0..methods.len() {
            let y = plot.at(0.0, place(row))[1];
            canvas.line(&[[plot.rect.left, y], [plot.rect.right, y]], Pen::new(GRID, FRAME_WIDTH));
        }
        let compared = panel.methods.iter().find(|score| score.label == self.compared());
        if let Some(x) = compared.map(|score| plot.at(score.estimate.value, 0.0)[0]).filter(|x| x.is_finite()) {
            let pen = Pen::new(GREY, THIN_WIDTH).dashed(&[2.4, 1.8]);
            canvas.line(&[[x, plot.rect.bottom], [x, plot.rect.top]], pen);
        }
        for score in &panel.methods {
            let row = row(&score.label);
            draw_score(canvas, &plot, score, place(row), looks[row].color);
        }
    }
}

fn draw_score(canvas: &Canvas, plot: &Plot<'_>, score: &MethodScore, y: f64, color: Color) {
    for run in score.runs.iter().filter(|run| run.is_finite()) {
        canvas.dot(plot.at(*run, y - BELOW), 0.9, faded(color, 0.45));
    }
    // A bar with a stroke, because a dot would hide a narrow interval.
    let Estimate { value, lower, upper } = score.estimate;
    if score.estimate.has_interval() {
        let ([left, middle], [right, _]) = (plot.at(lower, y), plot.at(upper, y));
        canvas.fill(&Rect::new(left, middle - BAR, right, middle + BAR).corners(), faded(color, 0.6));
    }
    if value.is_finite() {
        let [x, middle] = plot.at(value, y);
        canvas.line(&[[x, middle - STROKE], [x, middle + STROKE]], Pen::new(color, 1.6 * THIN_WIDTH));
    }
}

impl Figure for MethodScores {
    fn size(&self) -> [f64; 2] {
        let panel = AROUND + ROW * (self.methods().len().max(2) as f64 + 0.2);
        let rows = self.rows() as f64;
        let around = legend_height(DOUBLE_COLUMN - 2.0 * MARGIN, &self.marks())
            + note_height(DOUBLE_COLUMN, &self.caption())
            + 1.4 * LABEL_SIZE
            + 2.0 * MARGIN;
        [DOUBLE_COLUMN, rows * panel + (rows - 1.0) * GAP + around]
    }

    fn draw(&self, canvas: &Canvas) {
        let empty = self.methods().is_empty().then_some("no finished runs");
        let Some(rect) = around_panels(canvas, canvas.page().inset(MARGIN), empty, &self.caption(), &self.marks())
        else {
            return;
        };
        // The label of the x axes is written once, below all panels.
        let (rect, foot) = rect.split_bottom(1.4 * LABEL_SIZE);
        canvas.text(foot.center(), &self.measure, TextFormat::LABEL.centered());
        let cells = rect.grid(self.rows(), self.columns(), GAP);
        self.panels.iter().zip(cells).for_each(|(panel, cell)| self.draw_panel(canvas, panel, cell));
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["measure", "task", "method", "what", "value", "low", "high"]);
        for panel in &self.panels {
            for method in &panel.methods {
                let name = &text_of(&self.legend, &method.label);
                let [value, low, high] = method.estimate.values();
                table.push(&[&self.measure, &panel.task, name, &"summary", &value, &low, &high]);
                for run in &method.runs {
                    table.push(&[&self.measure, &panel.task, name, &"run", run]);
                }
            }
        }
        table
    }
}
