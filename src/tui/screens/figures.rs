//! The Figures screen: figures to look at and to export.

use std::hash::{DefaultHasher, Hash, Hasher};

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::Hits;
use super::frame::{WIDE, hint, pane};
use super::lists::{line, select};
use crate::tui::actions::{Action, Context};
use crate::tui::app::App;
use crate::tui::facts::Facts;
use crate::tui::preview::Wanted;
use crate::tui::theme::Depth;
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
pub fn draw(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let rows = FigureKind::ALL.len() as u16;
    let (list, picture) = if area.width >= WIDE {
        let left = Rect { width: LIST, ..area };
        (left, Rect { x: left.right(), width: area.width - LIST, ..area })
    } else {
        let above = Rect { height: (rows + 2).min(area.height), ..area };
        (above, Rect { y: above.bottom(), height: area.height - above.height, ..area })
    };
    listed(app, list, buffer, hits);
    let kind = selected(app);
    let inside = pane(kind.name(), picture, &app.theme, buffer);
    hits.preview = Some(inside);
    if let Err(reason) = app.preview.draw(kind.name(), !app.layers.is_empty(), inside, &app.theme, buffer) {
        hint(&reason, inside, &app.theme, buffer);
    }
}

fn listed(app: &App, area: Rect, buffer: &mut Buffer, hits: &mut Hits) {
    let theme = &app.theme;
    let inside = pane("figures", area, theme, buffer);
    hits.rows = Some((inside, 0));
    for (y, (index, kind)) in (inside.y..inside.bottom()).zip(FigureKind::ALL.into_iter().enumerate()) {
        let text = format!("{:<10} {}", kind.name(), about(kind));
        line(&text, index == app.lists.figure, inside, y, theme, buffer);
    }
    let top = (inside.y + FigureKind::ALL.len() as u16 + 1).min(inside.bottom());
    let below = Rect { y: top, height: inside.bottom() - top, ..inside };
    let key = |action, context| app.keymap.key_for(action, context);
    let (one, vector, all) = (
        key(Action::Confirm, Context::Figures),
        key(Action::Vector, Context::Figures),
        key(Action::Export, Context::Everywhere),
    );
    let written = &app.desk.facts().figures;
    if written.is_empty() {
        let text = format!(
            "Nothing exported yet. {one} exports the selected figure as PNG (the episode as GIF), {vector} as SVG, {all} all there is something for, into the folder figures/."
        );
        return hint(&text, below, theme, buffer);
    }
    for (y, path) in (below.y..below.bottom()).zip(written.iter().rev()) {
        let text = format!("wrote {}", path.display());
        buffer.set_stringn(below.x, y, text, usize::from(below.width), Style::new().fg(theme.good));
    }
}

fn selected(app: &App) -> FigureKind {
    FigureKind::ALL[app.lists.figure.min(FigureKind::ALL.len() - 1)]
}

/// Keeps the picture up to date; true if there is something new to see.
pub fn update(app: &mut App) -> bool {
    let Some(area) = app.hits.preview.filter(|area| area.width > 0 && area.height > 0) else { return false };
    let kind = selected(app);
    let wanted = Wanted {
        kind: kind.name(),
        stamp: stamp(app.desk.facts()),
        room: [area.width, area.height],
        grey: app.theme.depth == Depth::None,
    };
    let desk = &app.desk;
    app.preview.update(&wanted, || desk.figure(kind))
}

/// A number that changes with everything a figure shows.
fn stamp(facts: &Facts) -> u64 {
    let mut hasher = DefaultHasher::new();
    std::sync::Arc::as_ptr(&facts.task).hash(&mut hasher);
    facts.prior.as_ref().map(std::sync::Arc::as_ptr).hash(&mut hasher);
    facts.current.hash(&mut hasher);
    for run in facts.runs.iter().filter(|run| run.opened) {
        (&run.path, run.done).hash(&mut hasher);
    }
    hasher.finish()
}

/// What an action does on this screen.
pub fn perform(app: &mut App, action: Action) {
    if let Some(selected) = select(action, app.lists.figure, FigureKind::ALL.len() - 1) {
        app.lists.figure = selected;
        return;
    }
    let kind = selected(app);
    match (action, kind) {
        (Action::Confirm | Action::Vector, FigureKind::Episode) => app.export(kind.name(), "gif"),
        (Action::Confirm, _) => app.export(kind.name(), "png"),
        (Action::Vector, _) => app.export(kind.name(), "svg"),
        _ => {}
    }
}
