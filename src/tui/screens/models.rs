//! The Models screen: dynamics models to choose, train and measure.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::Hits;
use super::frame::{hint, pane, shortened};
use super::lists::{line, select};
use super::status::bar;
use crate::tui::actions::{Action, Context};
use crate::tui::app::App;
use crate::tui::columns;
use crate::tui::facts::{Level, ModelFacts};
use crate::tui::layers::{Layer, Prompt, Then, wrap};

/// Draws the screen.
pub fn draw(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let facts = app.desk.facts();
    let theme = &app.theme;
    let inside = pane("what predicts the rollouts behind the clusters", area, theme, buffer);
    hits.rows = Some((inside, 0));
    let longest = facts.models.iter().map(|model| columns::width(&model.name)).max().unwrap_or(0);
    let column = longest.clamp(16, usize::from(inside.width / 3));
    for (y, (index, model)) in (inside.y..inside.bottom()).zip(facts.models.iter().enumerate()) {
        let mark = if model.name == facts.settings.model { ">" } else { " " };
        let name = columns::padded(&shortened(&model.name, column, true), column);
        let text = format!("{mark} {name} {}", model.about);
        let text = shortened(&text, usize::from(inside.width), false);
        line(&text, index == app.lists.model, inside, y, theme, buffer);
    }
    let rows = (facts.models.len() as u16 + 1).min(inside.height);
    let mut below = Rect { y: inside.y + rows, height: inside.height - rows, ..inside };
    if let Some(model) = facts.models.get(app.lists.model) {
        below = told(&format!("{}: {}", model.name, model.about), Style::new(), below, buffer);
    }
    if let Some((name, done)) = &facts.model_work {
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
    let (outcome, style) = match &facts.model_outcome {
        Some(Ok(outcome)) => (outcome, Style::new()),
        Some(Err(reason)) => (reason, Style::new().fg(theme.bad)),
        None => return hint(&explanation(app), below, theme, buffer),
    };
    told(outcome, style, below, buffer);
}

/// Writes a text at the top of an area and returns what is left below it.
fn told(text: &str, style: Style, area: Rect, buffer: &mut Buffer) -> Rect {
    let lines = wrap(text, usize::from(area.width.saturating_sub(2)));
    let height = (lines.len() as u16 + 1).min(area.height);
    for (y, line) in (area.y..area.bottom()).zip(lines) {
        buffer.set_stringn(area.x + 2, y, line, usize::from(area.width.saturating_sub(2)), style);
    }
    Rect { y: area.y + height, height: area.height - height, ..area }
}

fn explanation(app: &App) -> String {
    let key = |action, context| app.keymap.key_for(action, context);
    format!(
        "{} chooses a model for the next clusters, {} measures it, {} trains another one; models in the folder models/ are listed here.",
        key(Action::Confirm, Context::Models),
        key(Action::EvaluateModel, Context::Models),
        key(Action::TrainModel, Context::Models),
    )
}

/// What an action does on this screen.
pub fn perform(app: &mut App, action: Action) {
    let facts = app.desk.facts();
    let last = facts.models.len().saturating_sub(1);
    if let Some(selected) = select(action, app.lists.model, last) {
        app.lists.model = selected;
        return;
    }
    let model = facts.models.get(app.lists.model.min(last)).cloned();
    match (action, model) {
        (Action::Confirm, Some(model)) => app.line(&format!("model {}", shell_words::quote(&model.name))),
        (Action::EvaluateModel, Some(model)) => evaluate(app, &model),
        (Action::TrainModel, _) => train(app),
        (Action::StopModel, _) => app.line("model stop"),
        _ => {}
    }
}

fn evaluate(app: &mut App, model: &ModelFacts) {
    match model.name.as_str() {
        "true" | "uniform" => app.say(Level::Info, "there is nothing to measure: it is no model"),
        "learned" => app.say(Level::Info, "select the shipped model itself: this is the one of the task's tool set"),
        name => app.line(&format!("model evaluate {}", shell_words::quote(name))),
    }
}

/// Asks what to train, with the task's tool set as a start.
fn train(app: &mut App) {
    let task = &app.desk.facts().task;
    let mut tools: Vec<String> = task.tools.iter().map(|tool| tool.kind.to_string()).collect();
    tools.push(task.placeable.kind.to_string());
    tools.sort();
    tools.dedup();
    let text = format!("{} models/{}.safetensors", tools.join(","), tools.join("-"));
    let hint = "tool types, file, and epochs if not the usual number: box,bucket models/mine.safetensors 3000";
    let then = Then::Command("model train".to_owned());
    app.layers.push(Layer::Prompt(Prompt::new("train a dynamics model", hint, text, then)));
}
