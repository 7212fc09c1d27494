//! The selected lines of the Models, Figures and Log screens.

use super::log::LogState;
use super::{Screens, Ui};
use crate::tui::actions::Tab;
use mge_results::Composition;
use mge_workbench::FigureKind;

/// The selected line of each screen; the Log counts from its end.
#[derive(Debug, Default)]
pub struct Lists {
    /// Of the Models screen.
    pub model: usize,
    /// Of the Figures screen.
    pub figure: usize,
    /// What the figure of learning curves shows, and how, apart from its runs.
    pub composition: Composition,
    /// The name of its file without suffix; empty for the usual one.
    pub file: String,
    /// Of the Log screen, and which lines it shows.
    pub log: LogState,
}

/// Selects the line of the list on a screen that `line` returns for the selected and the last one, or the last one.
pub fn select_line(screens: &mut Screens, ui: &Ui, tab: Tab, line: impl Fn(usize, usize) -> usize) {
    let line = |now: usize, last: usize| line(now.min(last), last).min(last);
    let lists = &mut screens.lists;
    match tab {
        Tab::Runs => screens.runs.select_line(ui, line),
        Tab::Models => lists.model = line(lists.model, ui.view.models.len().saturating_sub(1)),
        Tab::Figures => lists.figure = line(lists.figure, FigureKind::ALL.len() - 1),
        Tab::Log => {
            let last = lists.log.lines(ui).len().saturating_sub(1);
            // Counted from the end.
            let selected = &lists.log.selected;
            selected.set(last - line(last - selected.get().min(last), last));
        }
        Tab::Scene | Tab::Edit | Tab::Schedule | Tab::Training => {}
    }
}
