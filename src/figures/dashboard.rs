//! One run at a glance.

use serde::{Deserialize, Serialize};

use super::axes::{Axis, Frame, Plot, number};
use super::canvas::{Canvas, Pen, Type};
use super::data::numbers;
use super::geometry::Rect;
use super::layout::{Mark, legend, note};
use super::style::{BLUE, DOUBLE_COLUMN, GAP, GREY, LINE_WIDTH, MARGIN, TITLE_SIZE, VERMILLION};
use super::table::{Table, cell};
use super::{Figure, FigureError};

/// Series of one run, each with one value an episode; what is not finite leaves a gap.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Dashboard {
    /// What the run is: task, method, seed.
    pub title: String,
    /// Number of episodes `success` and `greedy_success` are averaged over.
    pub window: usize,
    /// Episode numbers.
    #[serde(deserialize_with = "numbers")]
    pub episode: Vec<f64>,
    /// Share of training episodes with the goal reached, 0 to 1.
    #[serde(deserialize_with = "numbers")]
    pub success: Vec<f64>,
    /// Share of greedy evaluation episodes with the goal reached, 0 to 1.
    #[serde(deserialize_with = "numbers")]
    pub greedy_success: Vec<f64>,
    /// Return of the episode.
    #[serde(deserialize_with = "numbers")]
    pub episode_return: Vec<f64>,
    /// Mean critic loss of the episode's updates.
    #[serde(deserialize_with = "numbers")]
    pub critic_loss: Vec<f64>,
    /// Mean actor loss of the episode's updates.
    #[serde(deserialize_with = "numbers")]
    pub actor_loss: Vec<f64>,
    /// Mean action value of the sampled batches.
    #[serde(deserialize_with = "numbers")]
    pub q_mean: Vec<f64>,
    /// Share of action components at the limits, 0 to 1.
    #[serde(deserialize_with = "numbers")]
    pub saturation: Vec<f64>,
    /// Threshold of guided exploration, 0 to 1.
    #[serde(deserialize_with = "numbers")]
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

    /// The panels in order: title, y axis, lines.
    fn panels(&self) -> [(&'static str, Axis, Vec<&[f64]>); 6] {
        let share = |label| Axis::linear(label, 0.0, 1.03, 6);
        let around = |label, values: &[f64]| Axis::around(label, values.iter().copied(), 5);
        [
            ("Success", share("share of episodes"), vec![&self.success, &self.greedy_success]),
            ("Return", around("return", &self.episode_return), vec![&self.episode_return]),
            (
                "Critic loss",
                Axis::logarithmic("mean squared error", self.critic_loss.iter().copied()),
                vec![&self.critic_loss],
            ),
            ("Actor loss", around("\u{2212}mean Q", &self.actor_loss), vec![&self.actor_loss]),
            ("Action value", around("mean Q", &self.q_mean), vec![&self.q_mean]),
            ("Exploration and saturation", share("share"), vec![&self.epsilon, &self.saturation]),
        ]
    }

    fn panel(&self, canvas: &Canvas<'_>, cell: Rect, n: usize) -> Result<(), FigureError> {
        let [panels @ ..] = self.panels();
        let (title, y, lines) = &panels[n];
        let last = self.episode.iter().copied().filter(|x| x.is_finite()).fold(1.0, f64::max);
        let x = Axis::linear("episode", 0.0, last, 5);
        let x = if n >= 3 { x } else { x.unlabelled() };
        let plot = Plot::new(canvas, cell, &Frame { title, grid: true, square: false }, x, y.clone())?;
        for (values, color) in lines.iter().zip([BLUE, VERMILLION]) {
            plot.line(&self.episode, values, Pen::new(color, LINE_WIDTH))?;
        }
        if lines.iter().all(|values| !values.iter().any(|value| value.is_finite())) {
            canvas.text(plot.rect.center(), "nothing recorded", Type::SMALL.centered().color(GREY))?;
        }
        Ok(())
    }
}

impl Figure for Dashboard {
    fn name(&self) -> &'static str {
        "dashboard"
    }

    fn size(&self) -> [f64; 2] {
        [DOUBLE_COLUMN, 320.0]
    }

    fn draw(&self, canvas: &Canvas<'_>) -> Result<(), FigureError> {
        let page = canvas.page().inset(MARGIN);
        if self.episode.is_empty() {
            return canvas.nothing(page, "no finished episodes");
        }
        let text = format!(
            "One run, n = 1 seed, {} episodes; success is averaged over {} episodes. Gaps: nothing was measured.",
            number(self.episode.len() as f64, 0),
            self.window
        );
        let rect = note(canvas, page, &text)?;
        let (head, rect) = rect.split_top(1.7 * TITLE_SIZE);
        canvas.text(head.center(), &self.title, Type { size: 1.15 * TITLE_SIZE, ..Type::TITLE.centered() })?;
        let marks = [
            (Mark::Line(BLUE), "training; threshold \u{3b5}".to_owned()),
            (Mark::Line(VERMILLION), "greedy evaluation; saturated actions".to_owned()),
        ];
        let rect = legend(canvas, rect, &marks)?;
        rect.grid(2, 3, GAP).into_iter().enumerate().try_for_each(|(n, cell)| self.panel(canvas, cell, n))
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
