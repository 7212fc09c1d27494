//! What screens draw from.

use crate::tui::input;
use crate::tui::view::{RunSummary, Subject, ViewModel};
use crate::tui::widgets::theme::Theme;

/// What screens draw from.
#[derive(Clone, Copy)]
pub struct Ui<'a> {
    /// The view of the session.
    pub view: &'a ViewModel,
    /// What the scene shows.
    pub subject: &'a Subject,
    /// Colours and markers.
    pub theme: &'a Theme,
}

impl Ui<'_> {
    /// Replaces each `{name}` of an action in a text by its key.
    pub fn text(&self, text: &str) -> String {
        input::fill(text)
    }

    /// Whether it is the watched run.
    pub(super) fn is_watched(&self, run: &RunSummary) -> bool {
        self.subject.run().is_some_and(|watched| watched.path == run.path)
    }
}
