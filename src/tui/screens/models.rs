//! The Models screen: dynamics models to choose and train.

use ratatui::prelude::*;
use ratatui::widgets::{Row, Table};

use super::pane::{lines, pane};
use super::status::bar;
use super::{HitRegions, Ui, row_regions};
use crate::tui::effect::Effect;
use crate::tui::view::ModelSummary;
use crate::tui::widgets::columns::{self, shortened};
use crate::tui::widgets::list;
use mge_physics::ToolKind;
use mge_trainer::PriorSource;
use mge_workbench::command;

/// Draws the screen.
pub fn draw(selected: usize, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let Ui { view, theme, .. } = *ui;
    let inside = pane("dynamics models, which predict the rollouts behind the clusters", area, theme, buffer);
    let longest = view.models.iter().map(|model| columns::width(&model.name)).max().unwrap_or(0);
    let name = (longest as u16).clamp(16, inside.width / 3);
    let numbers = NUMBERS.iter().map(|(heading, _)| heading.len() as u16);
    let room = inside.width.saturating_sub(name + 3 + numbers.clone().map(|width| width + 1).sum::<u16>());
    let row = |index: usize| {
        let model = &view.models[index];
        let mark = if model.name == view.settings.prior.place() { ">" } else { " " };
        let style = if model.fits { Style::new() } else { theme.faint() };
        let warning = if model.is_no_better() { Style::new().fg(theme.warn) } else { style };
        let tools: Vec<&str> = model.tools.iter().map(|kind| kind.name()).collect();
        let tools = if tools.is_empty() { model.about.clone() } else { tools.join(", ") };
        let first = [mark.to_owned(), shortened(&model.name, usize::from(name), true)].map(Text::from);
        // A kind of model has none.
        let number = |number: Number| if model.tools.is_empty() { String::new() } else { number(model) };
        let numbers = NUMBERS.map(|(_, of)| Text::from(number(of)).style(warning).right_aligned());
        Row::new(first.into_iter().chain(numbers).chain([shortened(&tools, usize::from(room), false).into()]))
            .style(style)
    };
    let widths: Vec<Constraint> = [1, name].into_iter().chain(numbers).chain([room]).map(Constraint::Length).collect();
    let count = view.models.len();
    // A file may have been deleted since it was selected.
    let selected = selected.min(count.saturating_sub(1));
    let rows = Constraint::Length(count as u16);
    let [header, above, _, below] =
        Layout::vertical([Constraint::Length(1), rows, Constraint::Length(1), Constraint::Fill(1)]).areas(inside);
    let headings = ["", "model"].into_iter().chain(NUMBERS.map(|(heading, _)| heading)).chain(["tools"]);
    Widget::render(Table::new([Row::new(headings).style(theme.faint())], &widths), header, buffer);
    regions.extend(row_regions(list::draw(count, Some(selected), row, &widths, above, theme, buffer)));
    let below = below.inner(Margin::new(2, 0));
    let paragraph = |text: &str, style| lines(&format!("{text}\n "), below.width, style);
    let mut text = Text::default();
    if let Some(model) = view.models.get(selected) {
        text.extend(paragraph(&format!("{}: {}", model.name, model.about), Style::new()));
    }
    if let Some((name, done)) = &view.model_work {
        let progress = match done {
            Some(done) => format!("{} {name} {:.0} %", bar((1000.0 * done) as u64, 1000, 24), 100.0 * done),
            None => format!("{name} ..."),
        };
        text.extend(paragraph(&progress, Style::new().fg(theme.accent)));
    }
    text.extend(paragraph(&ui.text(EXPLANATION), theme.faint()));
    text.render(below, buffer);
}

/// The text of a number of a model; empty if it has none.
type Number = fn(&ModelSummary) -> String;

/// The columns of numbers: the error is marked if it is no better than that of constant velocity.
const NUMBERS: [(&str, Number); 4] = [
    ("launches", |model| model.trained[0].to_string()),
    ("epochs", |model| model.trained[1].to_string()),
    ("  loss", |model| model.losses.map_or_else(|| "-".to_owned(), |[_, loss]| format!("{loss:.4}"))),
    ("   error", |model| {
        let mark = if model.is_no_better() { "! " } else { "" };
        model.mean_error().map_or_else(String::new, |error| format!("{mark}{error:.4}"))
    }),
];

/// What the marks and columns of the list mean.
pub const COLUMNS: &str = "> chosen; grey: wrong tools; ! error no better than constant velocity";

const EXPLANATION: &str = "{choose-model} chooses a model for the next clusters, {train-model} trains another one; models in the folder models/ are listed here. Errors of your own are those in FILE.evaluation.json beside a model, which `mge dynamics evaluate` prints outside of the workbench; losses are those of validation, where the file keeps it.";

/// Chooses the selected model for the next clusters.
pub fn choose(selected: usize, ui: &Ui) -> Vec<Effect> {
    let choose = |model: &ModelSummary| Effect::apply(command::Model(PriorSource::from(model.name.clone())));
    ui.view.models.get(selected).or(ui.view.models.last()).map(choose).into_iter().collect()
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
