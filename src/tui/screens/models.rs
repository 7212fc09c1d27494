//! The Models screen: dynamics models to choose and train.

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Margin, Rect};
use ratatui::style::Style;
use ratatui::text::Text;
use ratatui::widgets::{Row, Widget};

use super::lists::Lists;
use super::pane::{lines, pane};
use super::status::bar;
use super::{HitRegions, Ui};
use crate::tui::effect::Effect;
use crate::tui::view::ModelSummary;
use crate::tui::widgets::columns::{self, shortened};
use crate::tui::widgets::list;
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
    let room = usize::from(inside.width).saturating_sub(column + 3);
    let row = |index: usize| {
        let model = &view.models[index];
        let mark = if model.name == view.settings.prior.place() { ">" } else { " " };
        let style = if model.fits { Style::new() } else { theme.faint() };
        let name = shortened(&model.name, column, true);
        Row::new([mark.to_owned(), name, shortened(&model.about, room, false)]).style(style)
    };
    let length = |columns: usize| Constraint::Length(columns as u16);
    let widths = [length(1), length(column), Constraint::Fill(1)];
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
    }
    if let Some((name, done)) = &view.model_work {
        let progress = match done {
            Some(done) => format!("{} {name} {:.0} %", bar((1000.0 * done) as u64, 1000, 24, theme), 100.0 * done),
            None => format!("{name} ..."),
        };
        text.extend(paragraph(&progress, Style::new().fg(theme.accent)));
    }
    text.extend(paragraph(&ui.text(EXPLANATION), theme.faint()));
    text.render(below, buffer);
}

/// What the marks and columns of the list mean.
pub const COLUMNS: &str = "> chosen; grey: wrong tools";

const EXPLANATION: &str = "{choose-model} chooses a model for the next clusters, {train-model} trains another one; models in the folder models/ are listed here; `mge dynamics evaluate FILE > FILE.evaluation.json` adds their errors.";

fn selected<'a>(lists: &Lists, ui: &Ui<'a>) -> Option<&'a ModelSummary> {
    ui.view.models.get(lists.model).or(ui.view.models.last())
}

/// Chooses the selected model for the next clusters.
pub fn choose(lists: &Lists, ui: &Ui) -> Vec<Effect> {
    let choose = |model: &ModelSummary| Effect::apply(command::Model(PriorSource::from(model.name.clone())));
    selected(lists, ui).map(choose).into_iter().collect()
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
