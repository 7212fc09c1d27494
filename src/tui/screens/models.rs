//! The Models screen: dynamics models to choose, train and measure.

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Margin, Rect};
use ratatui::style::Style;
use ratatui::text::Text;
use ratatui::widgets::{Row, Widget};

use super::lists::{Lists, select};
use super::pane::{hint, lines, pane};
use super::status::bar;
use super::{HitRegions, Ui};
use crate::trainer::PriorSource;
use crate::tui::actions::Action;
use crate::tui::effect::Effect;
use crate::tui::layers::Prompt;
use crate::tui::view::ModelSummary;
use crate::tui::widgets::columns::{self, shortened};
use crate::tui::widgets::list;
use crate::workbench::command;

/// Draws the screen.
pub fn draw(lists: &Lists, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let view = ui.view;
    let theme = ui.theme;
    let inside = pane("what predicts the rollouts behind the clusters", area, theme, buffer);
    let longest = view.models.iter().map(|model| columns::width(&model.name)).max().unwrap_or(0);
    let column = longest.clamp(16, usize::from(inside.width / 3));
    let row = |index: usize| {
        let model = &view.models[index];
        let mark = if model.name == view.model() { ">" } else { " " };
        Row::new([mark.to_owned(), shortened(&model.name, column, true), model.about.clone()])
    };
    let widths = [Constraint::Length(1), Constraint::Length(column as u16), Constraint::Fill(1)];
    let count = view.models.len();
    let rows = Constraint::Length(count as u16);
    let [above, _, below] = Layout::vertical([rows, Constraint::Length(1), Constraint::Fill(1)]).areas(inside);
    regions.add_rows(list::draw(count, Some(lists.model), row, &widths, above, theme, buffer));
    let below = below.inner(Margin::new(2, 0));
    let paragraph = |text: &str, style| lines(&format!("{text}\n "), below.width, style);
    let mut text = Text::default();
    if let Some(model) = view.models.get(lists.model) {
        text.extend(paragraph(&format!("{}: {}", model.name, model.about), Style::new()));
    }
    if let Some((name, done)) = &view.model_work {
        let progress = match done {
            Some(done) => format!("{} {name} {:.0} %", bar((1000.0 * done) as u64, 1000, 24, theme), 100.0 * done),
            None => format!("{name} ..."),
        };
        text.extend(paragraph(&progress, Style::new().fg(theme.accent)));
    }
    match &view.model_outcome {
        Some(Ok(outcome)) => text.extend(paragraph(outcome, Style::new())),
        Some(Err(reason)) => text.extend(paragraph(reason, Style::new().fg(theme.bad))),
        None => {
            let height = Constraint::Length(text.height() as u16);
            let [_, rest] = Layout::vertical([height, Constraint::Fill(1)]).areas(below);
            hint(&ui.text(EXPLANATION), rest, theme, buffer);
        }
    }
    text.render(below, buffer);
}

const EXPLANATION: &str = "{choose-model} chooses a model for the next clusters, {evaluate-model} measures it, {train-model} trains another one; models in the folder models/ are listed here.";

/// What an action does on this screen.
pub fn perform(lists: &mut Lists, ui: &Ui, action: Action) -> Vec<Effect> {
    let models = &ui.view.models;
    let last = models.len().saturating_sub(1);
    if let Some(selected) = select(action, lists.model, last) {
        lists.model = selected;
        return Vec::new();
    }
    match (action, models.get(lists.model.min(last))) {
        (Action::Confirm, Some(model)) => {
            vec![Effect::apply(command::Model(PriorSource::from(model.name.clone())))]
        }
        (Action::EvaluateModel, Some(model)) => vec![evaluate(model)],
        (Action::TrainModel, _) => vec![train(ui)],
        (Action::StopModel, _) => vec![Effect::apply(command::ModelStop)],
        _ => Vec::new(),
    }
}

fn evaluate(model: &ModelSummary) -> Effect {
    match model.name.as_str() {
        "true" | "uniform" => Effect::info("there is nothing to measure: it is no model"),
        "learned" => Effect::info("select the shipped model itself: this is the one of the task's tool set"),
        name => Effect::apply(command::ModelEvaluate(name.to_owned())),
    }
}

/// Asks what to train, with the task's tool set as a start.
fn train(ui: &Ui) -> Effect {
    let task = &ui.view.task;
    let mut tools: Vec<String> = task.tools.iter().map(|tool| tool.kind.to_string()).collect();
    tools.push(task.placeable.kind.to_string());
    tools.sort();
    tools.dedup();
    let text = format!("{} models/{}.safetensors", tools.join(","), tools.join("-"));
    let hint = "tool types, file, and epochs if not the usual number: box,bucket models/mine.safetensors 3000";
    Effect::open(Prompt::arguments("model train", "train a dynamics model", hint, text))
}
