//! The selected lines of the Models, Figures and Log screens.

use super::figures::composer::Composer;
use crate::tui::actions::Tab;

/// The selected line of each screen; the Log counts from its end.
#[derive(Debug, Default)]
pub struct Lists {
    /// Of the Models screen.
    pub model: usize,
    /// Of the Figures screen.
    pub figure: usize,
    /// The composer of the learning-curve figure.
    pub composer: Composer,
    /// Of the Log screen, 0 for the latest line.
    pub log: usize,
}

/// Selects a row of a list of the Models or the Figures screen.
pub fn select_row(lists: &mut Lists, tab: Tab, row: usize) {
    match tab {
        Tab::Models => lists.model = row,
        Tab::Figures if lists.composer.is_open() => lists.composer.select(row),
        Tab::Figures => lists.figure = row,
        _ => {}
    }
}
