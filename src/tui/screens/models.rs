//! The Models screen: dynamics models to choose, train and measure.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::lists::{Lists, line, select};
use super::pane::{hint, pane};
use super::status::bar;
use super::{HitRegions, Ui};
use crate::trainer::PriorSource;
use crate::tui::actions::{Action, Context};
use crate::tui::effect::Effect;
use crate::tui::layers::{Layer, Prompt};
use crate::tui::view::ModelSummary;
use crate::tui::widgets::columns::{self, shortened};
use crate::tui::widgets::popup::wrap;
use crate::workbench::command;

/// Draws the screen.
pub fn draw(lists: &Lists, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let view = ui.view;
    let theme = ui.theme;
    let inside = pane("what predicts the rollouts behind the clusters", area, theme, buffer);
    regions.set_rows(inside, 0);
    let longest = view.models.iter().map(|model| columns::width(&model.name)).max().unwrap_or(0);
    let column = longest.clamp(16, usize::from(inside.width / 3));
    for (y, (index, model)) in (inside.y..inside.bottom()).zip(view.models.iter().enumerate()) {
        let mark = if model.name == view.settings.model { ">" } else { " " };
        let name = columns::padded(&shortened(&model.name, column, true), column);
        let text = format!("{mark} {name} {}", model.about);
        let text = shortened(&text, usize::from(inside.width), false);
        line(&text, index == lists.model, inside, y, theme, buffer);
    }
    let rows = (view.models.len() as u16 + 1).min(inside.height);
    let mut below = Rect { y: inside.y + rows, height: inside.height - rows, ..inside };
    if let Some(model) = view.models.get(lists.model) {
        below = paragraph(&format!("{}: {}", model.name, model.about), Style::new(), below, buffer);
    }
    if let Some((name, done)) = &view.model_work {
        let text = match done {
            Some(done) => {
                let progress = bar((1000.0 * done) as u64, 1000, 24, theme);
                format!("  {progress} {name} {:.0} %", 100.0 * done)
            }
            None => format!("  {name} ..."),
        };
        buffer.set_stringn(below.x, below.y, text, usize::from(below.width), Style::new().fg(theme.accent));
        below = Rect { y: (below.y + 2).min(inside.bottom()), height: below.height.saturating_sub(2), ..below };
    }
    let (outcome, style) = match &view.model_outcome {
        Some(Ok(outcome)) => (outcome, Style::new()),
        Some(Err(reason)) => (reason, Style::new().fg(theme.bad)),
        None => return hint(&explanation(ui), below, theme, buffer),
    };
    paragraph(outcome, style, below, buffer);
}

/// Writes a text at the top of an area and returns what is left below it.
fn paragraph(text: &str, style: Style, area: Rect, buffer: &mut Buffer) -> Rect {
    let lines = wrap(text, usize::from(area.width.saturating_sub(2)));
    let height = (lines.len() as u16 + 1).min(area.height);
    for (y, line) in (area.y..area.bottom()).zip(lines) {
        buffer.set_stringn(area.x + 2, y, line, usize::from(area.width.saturating_sub(2)), style);
    }
    Rect { y: area.y + height, height: area.height - height, ..area }
}

fn explanation(ui: &Ui) -> String {
    let key = |action, context| ui.key(action, context);
    format!(
        "{} chooses a model for the next clusters, {} measures it, {} trains another one; models in the folder models/ are listed here.",
        key(Action::Confirm, Context::Models),
        key(Action::EvaluateModel, Context::Models),
        key(Action::TrainModel, Context::Models),
    )
}

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
    Effect::Open(Layer::Prompt(Prompt::arguments("model train", "train a dynamics model", hint, text)))
}
