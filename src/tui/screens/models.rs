//! The Models screen: dynamics models to choose, train and evaluate.

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Margin, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Text};
use ratatui::widgets::{Row, Table, Widget};

use super::lists::Lists;
use super::pane::{hint, lines, pane};
use super::status::bar;
use super::{HitRegions, Ui};
use crate::tui::effect::Effect;
use crate::tui::view::ModelSummary;
use crate::tui::widgets::columns::{self, shortened};
use crate::tui::widgets::list;
use mge_dynamics::{Compared, Evaluation, LaunchErrors, OneTool};
use mge_physics::ToolKind;
use mge_trainer::PriorSource;
use mge_workbench::command;

/// Draws the screen.
pub fn draw(lists: &Lists, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let view = ui.view;
    let theme = ui.theme;
    let inside = pane("dynamics models, which predict the rollouts behind the clusters", area, theme, buffer);
    let longest = view.models.iter().map(|model| columns::width(&model.name)).max().unwrap_or(0);
    let column = longest.clamp(16, usize::from(inside.width / 3));
    let room = usize::from(inside.width).saturating_sub(column + ERRORS.len() + 4);
    let row = |index: usize| {
        let model = &view.models[index];
        let mark = if model.name == view.settings.prior.place() { ">" } else { " " };
        let (error, is_poor) = after_action(model);
        let style = match (model.fits, is_poor) {
            (false, _) => theme.faint(),
            (true, true) => Style::new().fg(theme.warn),
            (true, false) => Style::new(),
        };
        let name = shortened(&model.name, column, true);
        Row::new([mark.to_owned(), name, error, shortened(&model.about, room, false)]).style(style)
    };
    let length = |columns: usize| Constraint::Length(columns as u16);
    let widths = [length(1), length(column), length(ERRORS.len()), Constraint::Fill(1)];
    let heading = Row::new(["", "model", ERRORS, ""]);
    let [header, inside] = Layout::vertical([Constraint::Length(1), Constraint::Fill(1)]).areas(inside);
    Table::new([heading.style(theme.faint())], &widths).render(header, buffer);
    let count = view.models.len();
    // A file may have been deleted since it was selected.
    let selected = lists.model.min(count.saturating_sub(1));
    let rows = Constraint::Length(count as u16);
    let [above, _, below] = Layout::vertical([rows, Constraint::Length(1), Constraint::Fill(1)]).areas(inside);
    regions.add_rows(list::draw(count, Some(selected), row, &widths, above, theme, buffer));
    let below = below.inner(Margin::new(2, 0));
    let paragraph = |text: &str, style| lines(&format!("{text}\n "), below.width, style);
    let mut text = Text::default();
    if let Some(model) = view.models.get(selected) {
        text.extend(paragraph(&format!("{}: {}", model.name, model.about), Style::new()));
        if let Some(evaluation) = &model.evaluation {
            text.extend(errors(evaluation, below.width));
        }
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
        None if view.model_work.is_some() => {}
        None => {
            let height = Constraint::Length(text.height() as u16);
            let [_, rest] = Layout::vertical([height, Constraint::Fill(1)]).areas(below);
            hint(&ui.text(EXPLANATION), rest, theme, buffer);
        }
    }
    text.render(below, buffer);
}

/// What the marks and columns of the list mean.
pub const COLUMNS: &str = "> chosen; error after one action, that of constant velocity in brackets; grey: does not know \
                           the task's tools";

/// The heading of the errors of the models.
const ERRORS: &str = "error  (velocity)";

/// The mean error of a model after one action over its tool types, beside that of constant velocity, and whether it is
/// no better than that; nothing before it is evaluated.
fn after_action(model: &ModelSummary) -> (String, bool) {
    let Some(evaluation) = &model.evaluation else { return (String::new(), false) };
    let mean = |of: fn(&Compared<OneTool>) -> &OneTool| {
        let errors = evaluation.launches.iter().filter_map(|launches| of(&launches.errors).rollout.last());
        let all: Vec<f64> = errors.map(|errors| errors.mean).filter(|mean| mean.is_finite()).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    match (mean(|errors| &errors.model), mean(|errors| &errors.constant_velocity)) {
        (Some(own), Some(velocity)) => (format!("{own:.4} ({velocity:.4})"), own >= velocity),
        // None of its launches could be compared.
        _ => (String::new(), false),
    }
}

/// The mean errors of a model by tool type, normalised, beside those of predictors that do not learn.
fn errors(evaluation: &Evaluation, width: u16) -> Vec<Line<'static>> {
    let action = |of: &OneTool| of.rollout.last().map_or(f64::NAN, |errors| errors.mean);
    let of_tool = |launches: &LaunchErrors| {
        let Compared { model, constant_velocity, rapier, .. } = &launches.errors;
        let (tool, one, all) = (launches.tool, model.one_step.mean, action(model));
        let (contact, velocity) = (model.action_contact.mean, action(constant_velocity));
        let rapier = rapier.as_ref().map_or_else(String::new, |rapier| format!(", rapier {:.4}", action(rapier)));
        format!(
            "{tool}: {one:.4} after one prediction, {all:.4} after one action, {contact:.4} after a contact; after one \
             action constant velocity {velocity:.4}{rapier}"
        )
    };
    evaluation.launches.iter().flat_map(|launches| lines(&of_tool(launches), width, Style::new())).collect()
}

const EXPLANATION: &str = "{choose-model} chooses a model for the next clusters, {evaluate-model} evaluates it, {train-model} trains another one; models in the folder models/ are listed here.";

fn selected<'a>(lists: &Lists, ui: &Ui<'a>) -> Option<&'a ModelSummary> {
    ui.view.models.get(lists.model).or(ui.view.models.last())
}

/// Chooses the selected model for the next clusters.
pub fn choose(lists: &Lists, ui: &Ui) -> Vec<Effect> {
    let choose = |model: &ModelSummary| Effect::apply(command::Model(PriorSource::from(model.name.clone())));
    selected(lists, ui).map(choose).into_iter().collect()
}

/// Evaluates the selected model.
pub fn evaluate(lists: &Lists, ui: &Ui) -> Vec<Effect> {
    let evaluate = |model: &ModelSummary| match model.name.as_str() {
        "rapier" => Effect::info("its errors are listed beside those of every evaluated model"),
        "true" | "uniform" => Effect::info("there is nothing to evaluate: it is not a model"),
        "trained" => Effect::info("it is trained when it is needed: `mge dynamics train` trains one to evaluate"),
        "learned" => Effect::info("select the shipped model itself: `learned` stands for that of the task's tool set"),
        name => Effect::apply(command::ModelEvaluate(name.to_owned())),
    };
    selected(lists, ui).map(evaluate).into_iter().collect()
}

/// Opens the palette with the command that trains a model of the task's tool set, or of all of CREATE's tools if it has
/// types not in the paper.
pub fn train(ui: &Ui) -> Vec<Effect> {
    let kinds = ui.view.task.tool_set();
    let mut tools: Vec<&str> = kinds.iter().map(|kind| kind.name()).collect();
    tools.sort_unstable();
    if !kinds.iter().all(|kind| ToolKind::PAPER.contains(kind)) {
        tools = vec!["create"];
    }
    vec![Effect::palette(format!("model train {} models/{}.safetensors", tools.join(","), tools.join("-")))]
}
