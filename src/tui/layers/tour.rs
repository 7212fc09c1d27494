//! A short tour for the first start.

use crossterm::event::{KeyCode, KeyEvent};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;

use super::Response;
use crate::tui::actions::{Action, Context};
use crate::tui::input::Keymap;
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::theme::Theme;

/// A page of the tour.
#[derive(Default)]
pub struct Tour {
    page: usize,
}

/// Title and text; `{train}` stands for the key of the action of that name.
const PAGES: [(&str, &str); 4] = [
    (
        "a puzzle",
        "A ball falls. An agent places one tool every 1.33 seconds so that the ball reaches the subgoals 1, 2, ... in order and then the goal G.\n\nThe scene is at the left; curves and status are at the right. The mouse works everywhere.",
    ),
    (
        "learning",
        "{train} starts a training, {pause} pauses it, {stop} ends it; it goes on in the background while you do anything else.\n\n{clusters} computes the action clusters: where a learned model of the physics says that a tool helps. DDPG-MGE explores from them with probability epsilon; {epsilon} changes it, even while it trains.",
    ),
    (
        "touching things",
        "{next-object} selects an object, arrows or the mouse move it, {undo} takes it back. Then {clusters} computes the clusters of the changed task.\n\n{hand-play} lets you place tools yourself and see what the model predicts.",
    ),
    (
        "finding things",
        "{help} shows all keys. {palette} finds any action by its name and takes typed commands. The numbers 1 to 8 change the screen.\n\n{export} exports the figures as PNG. {quit} leaves.",
    ),
];

impl Tour {
    pub(super) fn key(&mut self, key: KeyEvent) -> Response {
        match key.code {
            KeyCode::Left | KeyCode::Backspace => self.page = self.page.saturating_sub(1),
            KeyCode::Right | KeyCode::Enter | KeyCode::Char(' ') if self.page + 1 < PAGES.len() => self.page += 1,
            KeyCode::Enter | KeyCode::Esc | KeyCode::Char(' ' | 'q' | 'x') => return Response::Leave,
            // Who knows what to press is not asked to press it twice.
            _ => return Response::Pass,
        }
        Response::Stay
    }

    pub(super) fn draw(&self, area: Rect, keymap: &Keymap, theme: &Theme, buffer: &mut Buffer) {
        let (title, text) = PAGES[self.page];
        let width = area.width.saturating_sub(8).min(56);
        let lines = wrap(&fill(text, keymap), usize::from(width));
        let title = format!("welcome, {}/{}: {title}", self.page + 1, PAGES.len());
        let inside = frame(&title, (width, lines.len() as u16 + 2), area, theme, buffer);
        for (y, line) in (inside.y..inside.bottom()).zip(&lines) {
            buffer.set_stringn(inside.x, y, line, usize::from(inside.width), Style::new());
        }
        let hint = if self.page + 1 < PAGES.len() { "enter: next   esc: skip" } else { "enter: begin" };
        buffer.set_stringn(
            inside.x,
            inside.bottom().saturating_sub(1),
            hint,
            usize::from(inside.width),
            theme.strong(),
        );
    }
}

fn fill(text: &str, keymap: &Keymap) -> String {
    let keys = [
        ("train", Action::Train, Context::Everywhere),
        ("pause", Action::Pause, Context::Everywhere),
        ("stop", Action::Stop, Context::Everywhere),
        ("clusters", Action::Clusters, Context::Everywhere),
        ("epsilon", Action::Epsilon, Context::Everywhere),
        ("undo", Action::Undo, Context::Everywhere),
        ("help", Action::Help, Context::Everywhere),
        ("palette", Action::Palette, Context::Everywhere),
        ("export", Action::Export, Context::Everywhere),
        ("quit", Action::Quit, Context::Everywhere),
        ("next-object", Action::NextObject, Context::Scene),
        ("hand-play", Action::HandPlay, Context::Scene),
    ];
    keys.iter().fold(text.to_owned(), |text, (name, action, context)| {
        text.replace(&format!("{{{name}}}"), &format!("`{}`", keymap.key_for(*action, *context)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_of_the_tour_is_named() {
        for (_, text) in PAGES {
            assert!(!fill(text, &Keymap::default()).contains('{'), "{text}");
        }
    }
}
