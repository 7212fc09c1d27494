//! Multiple choice: lists to choose from, and confirmations before something is lost.

use crossterm::event::{KeyCode, KeyEvent};
use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Position, Rect};
use ratatui::style::Stylize;
use ratatui::text::{Span, Text};
use ratatui::widgets::{Row, Widget};

use crate::tui::effect::{Effect, Layer, Response};
use crate::tui::input::Keymap;
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::theme::Theme;
use crate::tui::widgets::{columns, list};

/// A question and its answers.
pub struct Question {
    title: String,
    /// What will happen; empty for a list.
    text: String,
    answers: Vec<Answer>,
    selected: usize,
    /// Where each answer was last drawn.
    rows: Vec<(Rect, usize)>,
}

struct Answer {
    key: String,
    name: String,
    about: String,
    /// None to cancel.
    effect: Option<Effect>,
}

impl Question {
    /// A list to choose from: name, explanation and effect of each item; `selected` is the initial selection.
    pub fn list(title: impl Into<String>, items: Vec<(String, String, Effect)>, selected: usize) -> Self {
        // A key is one character, so only the first nine have one.
        let answer = |(number, (name, about, effect)): (usize, _)| Answer {
            key: if number < 10 { number.to_string() } else { String::new() },
            name,
            about,
            effect: Some(effect),
        };
        let answers = (1..).zip(items).map(answer).collect();
        Self { title: title.into(), text: String::new(), answers, selected, rows: Vec::new() }
    }

    /// A confirmation: what will happen, and the key, meaning and effect of each answer. Cancel is selected
    /// initially, so that Enter alone loses nothing.
    pub fn warning(title: &str, text: String, answers: Vec<(char, &str, Effect)>) -> Self {
        let answer = |key: &str, name: &str, effect| Answer {
            key: key.to_owned(),
            name: name.to_owned(),
            about: String::new(),
            effect,
        };
        let answers = answers.into_iter().map(|(key, name, effect)| answer(&key.to_string(), name, Some(effect)));
        let answers: Vec<Answer> = answers.chain([answer("esc", "cancel", None)]).collect();
        let selected = answers.len() - 1;
        Self { title: title.to_owned(), text, answers, selected, rows: Vec::new() }
    }

    fn choose(&mut self, index: usize) -> Response {
        // The layer closes after a choice, so the order of the answers no longer matters.
        self.answers.swap_remove(index).effect.map_or(Response::Leave, Response::Do)
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
            KeyCode::Char(typed) => match self.answers.iter().position(|answer| answer.key == typed.to_string()) {
                Some(index) => return self.choose(index),
                None if matches!(typed, 'n' | 'q') => return Response::Leave,
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
        !self.text.is_empty()
    }

    fn draw(&mut self, area: Rect, _: &Keymap, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
        let longest = |part: fn(&Answer) -> &String| {
            self.answers.iter().map(|answer| columns::width(part(answer))).max().unwrap_or(0) as u16
        };
        let widths = [longest(|answer| &answer.key), longest(|answer| &answer.name).min(60), longest(|a| &a.about)];
        let room = area.width.saturating_sub(8).min(60);
        let text = if self.is_warning() { wrap(&(self.text.clone() + "\n "), usize::from(room)) } else { Vec::new() };
        let above = text.len() as u16;
        let width = (widths.iter().sum::<u16>() + 2).max(if above > 0 { room } else { 0 });
        let inside = frame(&self.title, (width, above + self.answers.len() as u16), area, theme, buffer);
        Text::from_iter(text).render(inside, buffer);
        // Two columns separate the three parts.
        let room = inside.width.saturating_sub(widths[0] + 2);
        let name = widths[1].min(room);
        let widths = [widths[0], name, widths[2].min(room - name)];
        let row = |index: usize| {
            let Answer { key, name, about, .. } = &self.answers[index];
            let cut = |text: &str, width: u16| columns::shortened(text, usize::from(width), false).reset();
            Row::new([Span::styled(key, theme.strong()), cut(name, widths[1]), cut(about, widths[2])])
        };
        let [height, y] = [inside.height.saturating_sub(above), inside.bottom().min(inside.y + above)];
        let below = Rect { y, height, ..inside };
        let widths = widths.map(Constraint::Length);
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
        assert!(matches!(pressed(&[KeyCode::Char('1')]), Response::Stay), "no such answer");
    }
}
