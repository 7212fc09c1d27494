//! What the Models, Figures and Log screens have in common: lines of which one is
//! selected.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use crate::tui::actions::{Action, Tab};
use crate::tui::view::ViewModel;
use crate::tui::widgets::theme::Theme;
use crate::workbench::FigureKind;

/// The selected line of each screen; the Log counts from its end.
#[derive(Debug, Default)]
pub struct Lists {
    /// Of the Models screen.
    pub model: usize,
    /// Of the Figures screen.
    pub figure: usize,
    /// Of the Log screen, 0 for the latest line.
    pub log: usize,
}

/// Draws one line of a list.
pub fn line(text: &str, selected: bool, area: Rect, y: u16, theme: &Theme, buffer: &mut Buffer) {
    let width = usize::from(area.width);
    let style = if selected { theme.selected() } else { Style::new() };
    buffer.set_stringn(area.x, y, format!("{text:width$}"), width, style);
}

/// Lines of a page.
const PAGE: usize = 10;

/// Another selected line; None if the action is none that selects.
pub fn select(action: Action, now: usize, last: usize) -> Option<usize> {
    let now = now.min(last);
    Some(match action {
        Action::Up => now.saturating_sub(1),
        Action::Down => (now + 1).min(last),
        Action::FarUp => now.saturating_sub(PAGE),
        Action::FarDown => (now + PAGE).min(last),
        Action::First => 0,
        Action::Last => last,
        _ => return None,
    })
}

/// Selects a row of a list of the Models or the Figures screen.
pub fn select_row(lists: &mut Lists, tab: Tab, view: &ViewModel, row: usize) {
    match tab {
        Tab::Models if row < view.models.len() => lists.model = row,
        Tab::Figures if row < FigureKind::ALL.len() => lists.figure = row,
        _ => {}
    }
}
