//! The Figures screen: figures to look at and to export.

use std::hash::{DefaultHasher, Hash, Hasher};

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::lists::{Lists, line, select};
use super::pane::{WIDE, hint, pane};
use super::{HitRegions, Screens, Ui};
use crate::tui::actions::{Action, Context};
use crate::tui::effect::Effect;
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
    let (list, picture) = if area.width >= WIDE {
        let left = Rect { width: LIST, ..area };
        (left, Rect { x: left.right(), width: area.width - LIST, ..area })
    } else {
        let above = Rect { height: (rows + 2).min(area.height), ..area };
        (above, Rect { y: above.bottom(), height: area.height - above.height, ..area })
    };
    listed(&screens.lists, ui, list, buffer, regions);
    let kind = selected(&screens.lists);
    let inside = pane(kind.name(), picture, ui.theme, buffer);
    regions.set_preview(inside);
    if let Err(reason) = screens.preview.draw(kind.name(), covered, inside, ui.theme, buffer) {
        hint(&reason, inside, ui.theme, buffer);
    }
}

fn listed(lists: &Lists, ui: &Ui, area: Rect, buffer: &mut Buffer, regions: &mut HitRegions) {
    let theme = ui.theme;
    let inside = pane("figures", area, theme, buffer);
    regions.set_rows(inside, 0);
    for (y, (index, kind)) in (inside.y..inside.bottom()).zip(FigureKind::ALL.into_iter().enumerate()) {
        let text = format!("{:<10} {}", kind.name(), about(kind));
        line(&text, index == lists.figure, inside, y, theme, buffer);
    }
    let top = (inside.y + FigureKind::ALL.len() as u16 + 1).min(inside.bottom());
    let below = Rect { y: top, height: inside.bottom() - top, ..inside };
    let key = |action, context| ui.key(action, context);
    let (one, vector, pdf, all) = (
        key(Action::Confirm, Context::Figures),
        key(Action::Vector, Context::Figures),
        key(Action::Pdf, Context::Figures),
        key(Action::Export, Context::Everywhere),
    );
    let written = &ui.view.figures;
    if written.is_empty() {
        let text = format!(
            "Nothing exported yet. {one} exports the selected figure as PNG (the episode as GIF), {vector} as SVG, {pdf} as PDF, {all} all there is something for, into the folder figures/."
        );
        return hint(&text, below, theme, buffer);
    }
    for (y, path) in (below.y..below.bottom()).zip(written.iter().rev()) {
        let text = format!("wrote {}", path.display());
        buffer.set_stringn(below.x, y, text, usize::from(below.width), Style::new().fg(theme.good));
    }
}

fn selected(lists: &Lists) -> FigureKind {
    FigureKind::ALL[lists.figure.min(FigureKind::ALL.len() - 1)]
}

/// The selected figure, and the picture of it that is wanted; None while it has no room.
pub fn wanted(lists: &Lists, ui: &Ui, regions: &HitRegions) -> Option<(FigureKind, Wanted)> {
    let area = regions.preview()?;
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
