//! One run at a glance.

use std::num::NonZeroUsize;

use super::Figure;
use super::axes::{Axis, Frame, Plot, Y_LABEL, number};
use super::canvas::{Canvas, Pen, Type};
use super::curves::LAST_TICK;
use super::layout::{Panel, note, panels};
use super::style::{BLUE, DOUBLE_COLUMN, GREY, LINE_WIDTH, MARGIN, SKY, TITLE_SIZE, VERMILLION, faded};
use super::table::{Table, cell};
use crate::stats::rolling::rolling_mean;

/// Series of one run, each with one value an episode; what is not finite leaves a gap.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Dashboard {
    /// What the run is: task, method, seed.
    pub title: String,
    /// Number of episodes that `success`, and the line of the return, are averaged over.
    pub window: usize,
    /// Episode numbers.
    pub episode: Vec<f64>,
    /// Share of training episodes with the goal reached, 0 to 1.
    pub success: Vec<f64>,
    /// Share of greedy evaluation episodes with the goal reached, 0 to 1.
    pub greedy_success: Vec<f64>,
    /// Return of the episode.
    pub episode_return: Vec<f64>,
    /// Mean critic loss of the episode's updates.
    pub critic_loss: Vec<f64>,
    /// Mean actor loss of the episode's updates.
    pub actor_loss: Vec<f64>,
    /// Mean action value of the sampled batches.
    pub q_mean: Vec<f64>,
    /// Share of action components at the limits, 0 to 1.
    pub saturation: Vec<f64>,
    /// Threshold of guided exploration, 0 to 1.
    pub epsilon: Vec<f64>,
}

impl Dashboard {
    fn columns(&self) -> [(&'static str, &[f64]); 8] {
        [
            ("success", &self.success),
            ("greedy_success", &self.greedy_success),
            ("return", &self.episode_return),
            ("critic_loss", &self.critic_loss),
            ("actor_loss", &self.actor_loss),
            ("q_mean", &self.q_mean),
            ("saturation", &self.saturation),
            ("epsilon", &self.epsilon),
        ]
    }

    /// The panels in order.
    fn panels(&self) -> [RunPanel<'_>; 6] {
        let share = || Axis::linear("", 0.0, 1.03, 6);
        let percent = |values: &[f64]| values.iter().map(|value| 100.0 * value).collect::<Vec<_>>();
        let window = NonZeroUsize::new(self.window).unwrap_or(NonZeroUsize::MIN);
        let around = |values: &[f64]| Axis::around("", values.iter().copied(), 5);
        let panel =
            |title, y, lines: Vec<(&'static str, Vec<f64>)>| RunPanel { title, y, lines, partial: 0, dots: &[] };
        let partial = window.get() - 1;
        let alone = |title, y, values: &[f64]| panel(title, y, vec![("", values.to_vec())]);
        [
            RunPanel {
                partial,
                ..panel(
                    "Success rate (%)",
                    Axis::linear("", 0.0, 103.0, 6),
                    vec![("training", percent(&self.success)), ("greedy", percent(&self.greedy_success))],
                )
            },
            RunPanel {
                partial,
                dots: &self.episode_return,
                ..alone("Return", around(&self.episode_return), &rolling_mean(&self.episode_return, window))
            },
            alone("Critic loss", Axis::logarithmic("", self.critic_loss.iter().copied()), &self.critic_loss),
            alone("Actor loss", around(&self.actor_loss), &self.actor_loss),
            alone("Mean action value Q", around(&self.q_mean), &self.q_mean),
            panel(
                "Exploration",
                share(),
                vec![("threshold \u{3b5}", self.epsilon.clone()), ("saturated", self.saturation.clone())],
            ),
        ]
    }

    fn draw_panel(&self, canvas: &Canvas<'_>, panel: RunPanel<'_>, place: Panel) {
        let last = self.episode.iter().copied().filter(|x| x.is_finite()).fold(1.0, f64::max);
        let x = Axis::linear("episode", 0.0, last, 5);
        let x = if place.x_label { x } else { x.unlabelled() };
        // Titles name the y axes; the space of their labels stays free in every column.
        let cell = if place.y_label { place.cell.cut(Y_LABEL, 0.0, 0.0, 0.0) } else { place.cell };
        let plot = Plot::new(canvas, cell, &Frame { title: panel.title, grid: true, square: false }, x, panel.y);
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
            let look = Type::SMALL.right().color(color);
            canvas.text([right, plot.rect.top - 0.7 * TITLE_SIZE], label, look);
            right -= look.width(label) + 6.0;
        }
        if panel.lines.iter().all(|(_, values)| !values.iter().any(|value| value.is_finite())) {
            canvas.text(plot.rect.center(), "nothing recorded", Type::SMALL.centered().color(GREY));
        }
    }
}

/// What one panel shows: labelled lines.
struct RunPanel<'d> {
    title: &'static str,
    y: Axis,
    lines: Vec<(&'static str, Vec<f64>)>,
    /// Number of values of the first line that are means over a window not yet full.
    partial: usize,
    /// Single episodes behind the lines.
    dots: &'d [f64],
}

impl Figure for Dashboard {
    fn name(&self) -> &'static str {
        "dashboard"
    }

    fn size(&self) -> [f64; 2] {
        [DOUBLE_COLUMN, 320.0]
    }

    fn draw(&self, canvas: &Canvas<'_>) {
        let page = canvas.page().inset(MARGIN).cut(0.0, 0.0, LAST_TICK, 0.0);
        if self.episode.is_empty() {
            return canvas.nothing(page, "no finished episodes");
        }
        let text = format!(
            "One run (n = 1 seed), {} episodes; success is the share of the last {} episodes that reached the goal, greedy: of the \
             episodes of one evaluation without noise. Return: of single episodes (dots), and its mean over as many. Faint: means of fewer, at the start. Losses and Q: means over the updates of an episode. Saturated: share of action components at \
             their limits. Gaps: nothing was measured.",
            number(self.episode.len() as f64, 0),
            self.window
        );
        let rect = note(canvas, page, &text);
        let (head, rect) = rect.split_top(1.7 * TITLE_SIZE);
        canvas.text(head.center(), &self.title, Type { size: 1.15 * TITLE_SIZE, ..Type::TITLE.centered() });
        let places = panels(rect, 6, 3);
        self.panels().into_iter().zip(places).for_each(|(panel, place)| self.draw_panel(canvas, panel, place))
    }

    fn table(&self) -> Table {
        let mut table = Table::new([
            "episode",
            "success",
            "greedy_success",
            "return",
            "critic_loss",
            "actor_loss",
            "q_mean",
            "saturation",
            "epsilon",
        ]);
        for (n, episode) in self.episode.iter().enumerate() {
            let values = self.columns().map(|(_, values)| values.get(n).copied().map_or(String::new(), cell));
            let [a, b, c, d, e, f, g, h] = values;
            table.push([cell(*episode), a, b, c, d, e, f, g, h]);
        }
        table
    }
}
