//! Confirmations before something is lost.

use crossterm::event::{KeyCode, KeyEvent};
use ratatui::prelude::*;
use ratatui::widgets::Row;

use crate::tui::effect::{Effect, Layer, Response};
use crate::tui::widgets::list;
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::theme::Theme;

/// Columns of the keys.
const KEYS: u16 = 3;
/// Columns of the text.
const WIDTH: u16 = 60;

/// Number of names in a question.
const MAX_NAMED: usize = 6;

/// The names, or some of them and the number of the others.
pub fn some_of(names: impl ExactSizeIterator<Item = String>) -> String {
    let more = names.len().saturating_sub(MAX_NAMED);
    let names = names.take(MAX_NAMED).collect::<Vec<_>>().join(", ");
    if more > 0 { format!("{names} and {more} more") } else { names }
}

/// A question and its answers.
pub struct Question {
    title: String,
    /// What will happen.
    text: String,
    /// Key, meaning and effect of each; none to cancel.
    answers: Vec<(String, String, Option<Effect>)>,
    selected: usize,
    /// Where each answer was last drawn.
    rows: Vec<(Rect, usize)>,
}

impl Question {
    /// A confirmation: what will happen, and the key, meaning and effect of each answer. Cancel is selected
    /// initially, so that Enter alone loses nothing.
    pub fn warning(title: &str, text: String, answers: Vec<(char, &str, Effect)>) -> Self {
        let selected = answers.len();
        let answers = answers.into_iter().map(|(key, name, effect)| (key.into(), name.into(), Some(effect)));
        let answers = answers.chain([("esc".into(), "cancel".into(), None)]).collect();
        Self { title: title.to_owned(), text, answers, selected, rows: Vec::new() }
    }

    fn choose(&mut self, index: usize) -> Response {
        // The layer closes after a choice, so the order of the answers no longer matters.
        self.answers.swap_remove(index).2.map_or(Response::Leave, Response::Do)
    }
}

impl Layer for Question {
    fn key(&mut self, key: KeyEvent) -> Response {
        let last = self.answers.len() - 1;
        match key.code {
            KeyCode::Up | KeyCode::Char('k') => self.selected = self.selected.saturating_sub(1),
            KeyCode::Down | KeyCode::Char('j') => self.selected = (self.selected + 1).min(last),
            KeyCode::Home => self.selected = 0,
            KeyCode::End => self.selected = last,
            KeyCode::Enter | KeyCode::Char(' ') => return self.choose(self.selected),
            KeyCode::Esc => return Response::Leave,
            KeyCode::Char(typed) => match self.answers.iter().position(|(key, ..)| *key == typed.to_string()) {
                Some(index) => return self.choose(index),
                // Not `q`: a key that has opened a question, pressed twice, does not answer it.
                None if typed == 'n' => return Response::Leave,
                None => {}
            },
            _ => {}
        }
        Response::Stay
    }

    fn click(&mut self, at: Position) -> Response {
        list::hit(&self.rows, at).map_or(Response::Stay, |index| self.choose(index))
    }

    fn is_warning(&self) -> bool {
        true
    }

    fn draw(&mut self, area: Rect, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
        let width = area.width.saturating_sub(8).min(WIDTH);
        let text = wrap(&(self.text.clone() + "\n "), usize::from(width));
        let above = text.len() as u16;
        let inside = frame(&self.title, (width, above + self.answers.len() as u16), area, theme, buffer);
        Text::from_iter(text).render(inside, buffer);
        let row = |index: usize| {
            let (key, name, _) = &self.answers[index];
            Row::new([Span::styled(key, theme.strong()), name.as_str().reset()])
        };
        let below = Rect { y: inside.y + above, ..inside }.intersection(inside);
        let widths = [Constraint::Length(KEYS), Constraint::Fill(1)];
        self.rows = list::draw(self.answers.len(), Some(self.selected), row, &widths, below, theme, buffer);
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn enter_alone_cancels_a_warning_and_its_answers_need_their_key() {
        let pressed = |codes: &[KeyCode]| {
            let delete = vec![('y', "delete", Effect::info(""))];
            let mut warning = Question::warning("delete", "It is lost.".into(), delete);
            codes.iter().map(|code| warning.key((*code).into())).last().unwrap()
        };
        let (enter, y, n) = (KeyCode::Enter, KeyCode::Char('y'), KeyCode::Char('n'));
        for cancelled in
            [&[enter][..], &[KeyCode::Esc], &[n], &[KeyCode::Down, enter], &[KeyCode::Home, KeyCode::End, enter]]
        {
            assert!(matches!(pressed(cancelled), Response::Leave), "{cancelled:?}");
        }
        for confirmed in [&[y][..], &[KeyCode::Up, enter], &[KeyCode::Char('k'), KeyCode::Char(' ')]] {
            assert!(matches!(pressed(confirmed), Response::Do(_)), "{confirmed:?}");
        }
        for other in ['1', 'q'] {
            assert!(matches!(pressed(&[KeyCode::Char(other)]), Response::Stay), "no such answer: {other}");
        }
    }
}
