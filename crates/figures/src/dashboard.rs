//! Overview of one run.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;

use super::Figure;
use super::axes::{Axis, Frame, Plot, Y_LABEL, number};
use super::canvas::{Canvas, Pen, TextFormat};
use super::curves::LAST_TICK;
use super::layout::{Panel, fitted, note, panels};
use super::style::{BLUE, DOUBLE_COLUMN, GREY, LINE_WIDTH, MARGIN, SKY, SMALL_SIZE, TITLE_SIZE, VERMILLION, faded};
use super::table::{Cell, Table};
use mge_run::Metric;
use mge_stats::rolling::rolling_mean;

/// Series of one run, with one value per episode; non-finite values leave gaps.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Dashboard {
    /// Description of the run: task, method, seed.
    pub title: String,
    /// Window, in episodes, of the rolling means of success and return.
    pub window: usize,
    /// Episode numbers.
    pub episode: Vec<f64>,
    /// Share of greedy evaluation episodes that reached the goal, 0 to 1.
    pub greedy_success: Vec<f64>,
    /// The metrics shown.
    pub metrics: BTreeMap<Metric, Vec<f64>>,
}

/// Metrics in the CSV, after the columns for episode and success.
const COLUMNS: [(&str, Metric); 6] = [
    ("return", Metric::Return),
    ("critic_loss", Metric::CriticLoss),
    ("actor_loss", Metric::ActorLoss),
    ("q_mean", Metric::MeanQ),
    ("saturation", Metric::Saturation),
    ("epsilon", Metric::Epsilon),
];

impl Dashboard {
    /// The metrics that a dashboard shows.
    pub fn metrics() -> impl Iterator<Item = Metric> {
        COLUMNS.into_iter().map(|(_, metric)| metric).chain([Metric::Success])
    }

    fn of(&self, metric: Metric) -> &[f64] {
        self.metrics.get(&metric).map_or(&[], Vec::as_slice)
    }

    /// The window as a number of values: for a long run the series may not hold every episode.
    fn window_of_values(&self) -> usize {
        let span = self.episode.last().zip(self.episode.first()).map_or(0.0, |(last, first)| last - first);
        let steps = self.episode.len().saturating_sub(1);
        if span > 0.0 { (self.window as f64 * steps as f64 / span).round() as usize } else { self.window }
    }

    /// The panels in order.
    fn panels(&self) -> [RunPanel<'_>; 6] {
        let percent = |values: &[f64]| values.iter().map(|value| 100.0 * value).collect::<Vec<_>>();
        let window = NonZeroUsize::new(self.window_of_values()).unwrap_or(NonZeroUsize::MIN);
        let around = |metric| Axis::around("", self.of(metric).iter().copied(), 5);
        let panel = |title: &str, y, lines| RunPanel { title: capitalised(title), y, lines, partial: 0, dots: &[] };
        let partial = self.episode.iter().take_while(|episode| **episode < self.window as f64).count();
        let alone = |metric: Metric, y| panel(metric.title(), y, vec![("", self.of(metric).to_vec())]);
        let success = vec![("training", percent(self.of(Metric::Success))), ("greedy", percent(&self.greedy_success))];
        let exploration = vec![
            ("threshold \u{3b5}", self.of(Metric::Epsilon).to_vec()),
            ("saturated", self.of(Metric::Saturation).to_vec()),
        ];
        let (dots, loss) = (self.of(Metric::Return), self.of(Metric::CriticLoss));
        let means = vec![("", rolling_mean(dots, window))];
        [
            RunPanel { partial, ..panel("success rate (%)", Axis::linear("", 0.0, 103.0, 6), success) },
            RunPanel { partial, dots, ..panel(Metric::Return.title(), around(Metric::Return), means) },
            alone(Metric::CriticLoss, Axis::logarithmic("", loss.iter().copied())),
            alone(Metric::ActorLoss, around(Metric::ActorLoss)),
            alone(Metric::MeanQ, around(Metric::MeanQ)),
            panel("exploration", Axis::linear("", 0.0, 1.03, 6), exploration),
        ]
    }

    fn draw_panel(&self, canvas: &Canvas, panel: RunPanel<'_>, place: Panel) {
        let last = self.episode.iter().copied().filter(|x| x.is_finite()).fold(1.0, f64::max);
        let x = Axis::linear("episode", 0.0, last, 5).labelled(place.x_label);
        // Titles name the y axes; the space for their labels stays empty in every column.
        let cell = if place.y_label { place.cell.cut(Y_LABEL, 0.0, 0.0, 0.0) } else { place.cell };
        let plot = Plot::new(canvas, cell, &Frame { title: &panel.title, grid: true, square: false }, x, panel.y);
        for (x, y) in self.episode.iter().zip(panel.dots) {
            let place = plot.at(*x, *y);
            if plot.rect.contains(place) {
                canvas.dot(place, 0.5, faded(SKY, 0.5));
            }
        }
        let mut right = plot.rect.right;
        // Only the first line of a panel is a mean over a window.
        let pens = [Pen::new(BLUE, 0.8 * LINE_WIDTH), Pen::new(VERMILLION, 0.8 * LINE_WIDTH).dashed(&[2.0, 1.0])];
        for ((label, values), (pen, partial)) in panel.lines.iter().zip(pens.into_iter().zip([panel.partial, 0])).rev()
        {
            plot.rolling(&self.episode, values, partial, pen);
            let color = pen.color;
            let look = TextFormat::SMALL.right().color(color);
            canvas.text([right, plot.rect.top - 0.7 * TITLE_SIZE], label, look);
            right -= look.width(label) + 6.0;
        }
        if panel.lines.iter().all(|(_, values)| !values.iter().any(|value| value.is_finite())) {
            canvas.text(plot.rect.center(), "nothing recorded", TextFormat::SMALL.centered().color(GREY));
        }
    }
}

/// A metric's title with a capital first letter.
fn capitalised(title: &str) -> String {
    let mut letters = title.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}

/// Contents of one panel: labelled lines.
struct RunPanel<'d> {
    title: String,
    y: Axis,
    lines: Vec<(&'static str, Vec<f64>)>,
    /// Number of values of the first line that are means over a window not yet full.
    partial: usize,
    /// Values of single episodes, drawn behind the lines.
    dots: &'d [f64],
}

impl Figure for Dashboard {
    fn size(&self) -> [f64; 2] {
        [DOUBLE_COLUMN, 320.0]
    }

    fn draw(&self, canvas: &Canvas) {
        let page = canvas.page().inset(MARGIN).cut(0.0, 0.0, LAST_TICK, 0.0);
        if self.episode.is_empty() {
            return canvas.placeholder(page, "no finished episodes");
        }
        let text = format!(
            "One run (n = 1 seed), {} episodes; success is the share of the last {} episodes that reached the goal, greedy: of the \
             episodes of one evaluation without noise. Return: single episodes (dots) and their mean over the same window. Faint: \
             means over fewer episodes, at the start. Losses and Q: means over the updates of an episode. Saturated: share of \
             action components at their limits. Gaps: nothing was measured.",
            number(self.episode.len() as f64, 0),
            self.window
        );
        let rect = note(canvas, page, &text);
        let (head, rect) = rect.split_top(1.7 * TITLE_SIZE);
        let title = TextFormat { size: 1.15 * TITLE_SIZE, ..TextFormat::TITLE.centered() };
        let shrunk = title.size * (head.width() / title.width(&self.title)).min(1.0);
        let title = TextFormat { size: shrunk.max(SMALL_SIZE), ..title };
        canvas.text(head.center(), &fitted(&self.title, title, head.width()), title);
        let places = panels(rect, 6, 3);
        self.panels().into_iter().zip(places).for_each(|(panel, place)| self.draw_panel(canvas, panel, place))
    }

    fn table(&self) -> Table {
        let metrics = COLUMNS.map(|(name, metric)| (name, self.of(metric)));
        let columns = [("success", self.of(Metric::Success)), ("greedy_success", &*self.greedy_success)];
        let columns: Vec<(&'static str, &[f64])> =
            [("episode", &*self.episode)].into_iter().chain(columns).chain(metrics).collect();
        let mut table = Table::new(columns.iter().map(|(name, _)| *name));
        for n in 0..self.episode.len() {
            let cells: Vec<Option<f64>> = columns.iter().map(|(_, values)| values.get(n).copied()).collect();
            table.push(&cells.iter().map(|cell| cell as &dyn Cell).collect::<Vec<_>>());
        }
        table
    }
}
