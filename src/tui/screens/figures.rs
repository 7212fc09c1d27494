//! The Figures screen: figures to look at and to export.

use std::hash::{DefaultHasher, Hash, Hasher};

use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Style;
use ratatui::text::Text;
use ratatui::widgets::{Row, Widget};

use super::lists::{Lists, select};
use super::pane::{WIDE, hint, pane};
use super::{HitRegions, Region, Screens, Ui};
use crate::tui::actions::Action;
use crate::tui::effect::Effect;
use crate::tui::widgets::list;
use crate::tui::widgets::preview::Wanted;
use crate::tui::widgets::theme::Depth;
use crate::workbench::FigureKind;

/// What a figure shows, in one line.
fn about(kind: FigureKind) -> &'static str {
    match kind {
        FigureKind::Scene => "the task's scene",
        FigureKind::Clusters => "the action clusters over the scene",
        FigureKind::Learning => "success of all runs that are open",
        FigureKind::Dashboard => "all that is logged of the watched run",
        FigureKind::Episode => "the greedy episode, or that of your hand",
    }
}

/// Columns of the list where there is room beside it.
const LIST: u16 = 56;

/// Draws the screen: the list at the left or above, the selected figure beside or below.
pub fn draw(screens: &Screens, ui: &Ui, covered: bool, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let rows = FigureKind::ALL.len() as u16;
    let [list, picture] = if area.width >= WIDE {
        Layout::horizontal([Constraint::Length(LIST), Constraint::Fill(1)]).areas(area)
    } else {
        Layout::vertical([Constraint::Length(rows + 2), Constraint::Fill(1)]).areas(area)
    };
    listed(&screens.lists, ui, list, buffer, regions);
    let kind = selected(&screens.lists);
    let inside = pane(kind.name(), picture, ui.theme, buffer);
    regions.add(inside, Region::Preview);
    if let Err(reason) = screens.preview.draw(kind.name(), covered, inside, ui.theme, buffer) {
        hint(&reason, inside, ui.theme, buffer);
    }
}

fn listed(lists: &Lists, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let theme = ui.theme;
    let inside = pane("figures", area, theme, buffer);
    let row = |index: usize| {
        let kind = FigureKind::ALL[index];
        Row::new([kind.name(), about(kind)])
    };
    let (count, widths) = (FigureKind::ALL.len(), [Constraint::Length(10), Constraint::Fill(1)]);
    regions.add_rows(list::draw(count, Some(lists.figure), row, &widths, inside, theme, buffer));
    let [_, below] = Layout::vertical([Constraint::Length(count as u16 + 1), Constraint::Fill(1)]).areas(inside);
    let written = ui.view.figures.iter().rev().map(|path| format!("wrote {}", path.display()));
    let text = Text::from_iter(written).style(Style::new().fg(theme.good));
    if text.height() > 0 {
        return text.render(below, buffer);
    }
    let text = "Nothing exported yet. {export-figure} exports the selected figure as PNG (the episode as GIF), {export-svg} as SVG, {export-pdf} as PDF, {export} all there is something for, into the folder figures/.";
    hint(&ui.text(text), below, theme, buffer);
}

fn selected(lists: &Lists) -> FigureKind {
    FigureKind::ALL[lists.figure.min(FigureKind::ALL.len() - 1)]
}

/// The selected figure, and the picture of it that is wanted; None while it has no room.
pub fn wanted(lists: &Lists, ui: &Ui, regions: &HitRegions) -> Option<(FigureKind, Wanted)> {
    let (area, _) =
        regions.all().iter().find(|(area, region)| matches!(region, Region::Preview) && !area.is_empty())?;
    let kind = selected(lists);
    let grey = ui.theme.depth == Depth::None;
    let wanted = Wanted { kind: kind.name(), stamp: stamp(ui), room: [area.width, area.height], grey };
    Some((kind, wanted))
}

/// A number that changes with everything a figure shows.
fn stamp(ui: &Ui) -> u64 {
    let view = ui.view;
    let mut hasher = DefaultHasher::new();
    std::sync::Arc::as_ptr(&view.task).hash(&mut hasher);
    view.prior.as_ref().map(std::sync::Arc::as_ptr).hash(&mut hasher);
    ui.subject.run().map(|run| &run.path).hash(&mut hasher);
    for run in view.runs.iter().filter(|run| run.opened) {
        (&run.path, run.done).hash(&mut hasher);
    }
    hasher.finish()
}

/// What an action does on this screen.
pub fn perform(lists: &mut Lists, action: Action) -> Vec<Effect> {
    if let Some(selected) = select(action, lists.figure, FigureKind::ALL.len() - 1) {
        lists.figure = selected;
        return Vec::new();
    }
    let kind = selected(lists);
    let format = match (action, kind) {
        (Action::Confirm | Action::Vector | Action::Pdf, FigureKind::Episode) => "gif",
        (Action::Confirm, _) => "png",
        (Action::Vector, _) => "svg",
        (Action::Pdf, _) => "pdf",
        _ => return Vec::new(),
    };
    vec![Effect::Export(vec![(kind, format)])]
}
