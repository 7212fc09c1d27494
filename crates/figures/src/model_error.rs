//! Prediction error of the dynamics models: one step, and rollouts.

use super::Figure;
use super::axes::{Axis, Frame, Plot, number};
use super::bars::{BarCluster, BarLook, grouped_bars};
use super::canvas::Canvas;
use super::data::Statistics;
use super::geometry::Rect;
use super::layout::{Mark, around_panels, panels};
use super::style::{DOUBLE_COLUMN, LINE_WIDTH, MARGIN, Series, series};
use super::table::Table;
use mge_stats::Estimate;

/// Errors of several predictors on several tools (or tool sets).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ModelError {
    /// Names of the tools, one group and one panel each.
    pub tools: Vec<String>,
    /// Time in seconds that one prediction spans.
    pub step_seconds: f64,
    /// How errors were summarised.
    pub statistics: Statistics,
    /// The model and its baselines, in the order of the legend.
    pub predictors: Vec<Predictor>,
}

/// Errors of one predictor, as normalised distances.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Predictor {
    /// Name, as in the legend.
    pub label: String,
    /// One-step error on each tool.
    pub one_step: Vec<Estimate>,
    /// On each tool, the error after 1, 2, ... steps of a rollout.
    pub rollout: Vec<Vec<Estimate>>,
    /// On each tool, precision and recall of predicted subgoal hits.
    pub hits: Vec<[Estimate; 2]>,
}

impl ModelError {
    fn looks(&self) -> Vec<Series> {
        series(&self.predictors.iter().map(|predictor| predictor.label.as_str()).collect::<Vec<_>>())
    }

    /// Bars of all predictors, in one cluster per tool with one member per name; `of` gives the bar of a predictor
    /// for a tool and a member.
    fn bars(&self, names: &[&str], of: fn(&Predictor, usize, usize) -> Option<Estimate>) -> Vec<BarCluster> {
        let bars = |tool: usize, member: usize| {
            let bar = |predictor| of(predictor, tool, member).unwrap_or(Estimate::exact(f64::NAN));
            self.predictors.iter().map(bar).collect()
        };
        let members = |tool| names.iter().enumerate().map(|(n, name)| ((*name).to_owned(), bars(tool, n))).collect();
        let cluster = |(tool, label): (usize, &String)| BarCluster { label: label.clone(), members: members(tool) };
        self.tools.iter().enumerate().map(cluster).collect()
    }

    fn rollouts(&self, tool: usize) -> impl Iterator<Item = &[Estimate]> {
        self.predictors.iter().map(move |predictor| predictor.rollout.get(tool).map_or(&[][..], Vec::as_slice))
    }

    fn draw_rollouts(&self, canvas: &Canvas, rect: Rect) {
        let all = || (0..self.tools.len()).flat_map(|tool| self.rollouts(tool));
        let longest = all().map(<[Estimate]>::len).max().unwrap_or(0).max(2);
        let values: Vec<f64> = all().flatten().flat_map(Estimate::values).collect();
        for (tool, place) in panels(rect, self.tools.len(), self.tools.len()).into_iter().enumerate() {
            let ticks = (1..=longest).step_by(longest.div_ceil(6)).map(|k| (k as f64, k.to_string())).collect();
            let x = Axis::with_ticks("steps", 0.7, longest as f64 + 0.3, ticks);
            let y = Axis::from_zero("rollout error (normalised)", values.iter().copied(), 5).labelled(place.y_label);
            let title = if tool == 0 { format!("(c) {}", self.tools[tool]) } else { self.tools[tool].clone() };
            let plot = Plot::new(canvas, place.cell, &Frame { title: &title, grid: true, square: false }, x, y);
            let mut ends = Vec::new();
            for (look, errors) in self.looks().into_iter().zip(self.rollouts(tool)) {
                let column = |of: fn(&Estimate) -> f64| errors.iter().map(of).collect::<Vec<f64>>();
                let steps: Vec<f64> = (1..=errors.len()).map(|k| k as f64).collect();
                let values = column(|e| e.value);
                plot.band(&steps, [&values, &column(|e| e.lower), &column(|e| e.upper)], look.color);
                plot.line(&steps, &values, look.pen(LINE_WIDTH));
                if let (Some(x), Some(y)) = (steps.last(), values.last()) {
                    ends.push((plot.at(*x, *y), look));
                }
            }
            plot.end_numbers(ends);
        }
    }
}

impl Figure for ModelError {
    fn size(&self) -> [f64; 2] {
        [DOUBLE_COLUMN, 420.0]
    }

    fn draw(&self, canvas: &Canvas) {
        let text = format!(
            "Distance between predicted and true position of the ball; 1 normalised = 42 units = half the screen. One step spans {} s. Subgoals are circles near the paths of balls deflected by a tool. {}.",
            number(self.step_seconds, 2),
            self.statistics.caption("error bars and bands")
        );
        let looks = self.looks();
        let marks: Vec<(Mark, String)> = looks
            .iter()
            .zip(&self.predictors)
            .map(|(look, predictor)| (Mark::Bar(*look), look.numbered(&predictor.label)))
            .collect();
        let empty = (self.tools.is_empty() || self.predictors.is_empty()).then_some("no model was evaluated");
        let Some(rect) = around_panels(canvas, canvas.page().inset(MARGIN), empty, &text, &marks) else { return };
        let (above, below) = rect.split_top(rect.height() / 3.0);
        let (middle, below) = below.split_top(0.5 * below.height());
        let look = |title, label| BarLook { title, label, ..BarLook::default() };
        let one_step = self.bars(&[""], |predictor, tool, _| predictor.one_step.get(tool).copied());
        let hits = self.bars(&["precision", "recall"], |predictor, tool, n| Some(predictor.hits.get(tool)?[n]));
        grouped_bars(canvas, above, &look("(a) One step", "error (normalised)"), &one_step, &looks);
        grouped_bars(canvas, middle, &look("(b) Subgoal hits", "share"), &hits, &looks);
        self.draw_rollouts(canvas, below)
    }

    fn table(&self) -> Table {
        let mut table = Table::new(["tools", "predictor", "measure", "steps", "error", "low", "high"]);
        for (n, tool) in self.tools.iter().enumerate() {
            for predictor in &self.predictors {
                let mut row = |measure: &str, steps: usize, estimate: &Estimate| {
                    let [value, low, high] = estimate.values();
                    table.push(&[tool, &predictor.label, &measure, &steps, &value, &low, &high]);
                };
                if let Some(estimate) = predictor.one_step.get(n) {
                    row("one step", 1, estimate);
                }
                for (measure, estimate) in
                    predictor.hits.get(n).into_iter().flat_map(|hits| ["precision", "recall"].into_iter().zip(hits))
                {
                    row(measure, predictor.rollout.get(n).map_or(0, Vec::len), estimate);
                }
                for (k, estimate) in predictor.rollout.get(n).into_iter().flatten().enumerate() {
                    row("rollout", k + 1, estimate);
                }
            }
        }
        table
    }
}
