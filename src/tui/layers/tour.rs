//! A short tour for new users.

use crossterm::event::{KeyCode, KeyEvent};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use ratatui::text::{Line, Text};
use ratatui::widgets::Widget;

use crate::tui::effect::{Layer, Response};
use crate::tui::input::Keymap;
use crate::tui::widgets::layout::beside_scene;
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
        "`{train}` opens a dialog that starts a training, `{pause}` pauses it, `{stop}` ends it; it continues in the background.\n\n`{clusters}` computes the action clusters: where a learned model of the physics says that a tool helps. DDPG-MGE explores from them with probability epsilon; `{epsilon}` changes it, even while it trains.",
    ),
    (
        "touching things",
        "`{next-object}` selects an object, arrows or the mouse move it, `{undo}` reverts it. Once computed, the clusters follow a moment later.\n\n`{hand-play}` lets you place tools yourself and see what the model predicts.",
    ),
    (
        "finding things",
        "`{help}` shows all keys. `{palette}` finds any action by its name and takes typed commands. The numbers 1 to 8 change the screen.\n\n{screen-figures} shows and exports figures. `{quit}` leaves.",
    ),
];

impl Layer for Tour {
    fn key(&mut self, key: KeyEvent) -> Response {
        match key.code {
            KeyCode::Left | KeyCode::Backspace => self.page = self.page.saturating_sub(1),
            KeyCode::Right | KeyCode::Enter | KeyCode::Char(' ') if self.page + 1 < PAGES.len() => self.page += 1,
            KeyCode::Enter | KeyCode::Esc | KeyCode::Char(' ' | 'q' | 'x') => return Response::Leave,
            // Any other key closes the tour and takes effect at once.
            _ => return Response::Pass,
        }
        Response::Stay
    }

    fn click(&mut self, _: Position) -> Response {
        self.key(KeyCode::Enter.into())
    }

    fn draw(&mut self, area: Rect, keymap: &Keymap, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
        let (title, text) = PAGES[self.page];
        // Keep the scene with the ball visible.
        let area = beside_scene(area);
        let width = area.width.saturating_sub(4).min(56);
        let lines = wrap(&keymap.fill(text), usize::from(width));
        let title = format!("welcome, {}/{}: {title}", self.page + 1, PAGES.len());
        let inside = frame(&title, (width, lines.len() as u16 + 2), area, theme, buffer);
        Text::from_iter(lines).render(inside, buffer);
        let hint = if self.page + 1 < PAGES.len() { "enter: next   esc: skip" } else { "enter: begin" };
        Line::styled(hint, theme.strong()).render(inside.rows().next_back()?, buffer);
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_of_the_tour_is_named() {
        for (_, text) in PAGES {
            assert!(!Keymap::default().fill(text).contains('{'), "{text}");
        }
    }
}
