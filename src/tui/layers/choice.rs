//! One of several: lists to choose from and questions before destructive things.

use crossterm::event::{KeyCode, KeyEvent};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use ratatui::style::Style;

use super::Response;
use crate::tui::effect::Effect;
use crate::tui::widgets::columns;
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::theme::Theme;

/// A list to choose from.
pub struct Chooser {
    /// What is chosen.
    title: String,
    /// Name, explanation and what choosing does.
    items: Vec<(String, String, Effect)>,
    /// The selected item.
    selected: usize,
    /// Where the items are, and which is the first.
    shown: (Rect, usize),
}

impl Chooser {
    /// A list with an item selected.
    pub fn new(title: impl Into<String>, items: Vec<(String, String, Effect)>, selected: usize) -> Self {
        Self { title: title.into(), items, selected, shown: Default::default() }
    }

    pub(super) fn key(&mut self, key: KeyEvent) -> Response {
        let last = self.items.len().saturating_sub(1);
        match key.code {
            KeyCode::Esc | KeyCode::Char('q') => return Response::Leave,
            KeyCode::Up | KeyCode::Char('k') => self.selected = self.selected.saturating_sub(1),
            KeyCode::Down | KeyCode::Char('j') => self.selected = (self.selected + 1).min(last),
            KeyCode::Home => self.selected = 0,
            KeyCode::End => self.selected = last,
            KeyCode::Enter | KeyCode::Char(' ') => return self.choose(self.selected),
            KeyCode::Char(digit @ '1'..='9') => return self.choose(digit as usize - '1' as usize),
            _ => {}
        }
        Response::Stay
    }

    fn choose(&mut self, index: usize) -> Response {
        // What is chosen leaves the list with it.
        if index < self.items.len() { Response::Do(self.items.swap_remove(index).2) } else { Response::Stay }
    }

    pub(super) fn click(&mut self, at: Position) -> Response {
        let (area, first) = self.shown;
        if !area.contains(at) || first + usize::from(at.y - area.y) >= self.items.len() {
            return Response::Stay;
        }
        self.choose(first + usize::from(at.y - area.y))
    }

    pub(super) fn draw(&mut self, area: Rect, theme: &Theme, buffer: &mut Buffer) {
        let names = self.items.iter().map(|(name, ..)| columns::width(name)).max().unwrap_or(0).min(40);
        let about = self.items.iter().map(|(_, about, _)| columns::width(about)).max().unwrap_or(0);
        let wanted = ((names + about + 6) as u16, self.items.len() as u16);
        let inside = frame(&self.title, wanted, area, theme, buffer);
        let first = (self.selected + 1).saturating_sub(usize::from(inside.height));
        self.shown = (inside, first);
        for (row, (index, (name, about, _))) in
            (inside.y..inside.bottom()).zip(self.items.iter().enumerate().skip(first))
        {
            let text = format!("{} {}  {about}", index + 1, columns::padded(name, names));
            let style = if index == self.selected { theme.selected() } else { Style::new() };
            let width = usize::from(inside.width);
            buffer.set_stringn(inside.x, row, columns::padded(&text, width), width, style);
        }
    }
}

/// A question that says what will happen.
pub struct Confirm {
    /// What is asked.
    title: String,
    /// What will happen.
    text: String,
    /// Key, meaning and what it does. Escape does nothing.
    answers: Vec<(char, String, Effect)>,
    /// Where the answers are, the way back last.
    shown: Rect,
}

impl Confirm {
    /// A question; each answer has its key, its meaning and what it does.
    pub fn new(title: &str, text: String, answers: Vec<(char, &str, Effect)>) -> Self {
        let answers = answers.into_iter().map(|(key, meaning, effect)| (key, meaning.to_owned(), effect)).collect();
        Self { title: title.to_owned(), text, answers, shown: Rect::default() }
    }

    pub(super) fn key(&mut self, key: KeyEvent) -> Response {
        match key.code {
            KeyCode::Esc | KeyCode::Char('n') => Response::Leave,
            KeyCode::Enter => self.answer(0),
            KeyCode::Char(c) => match self.answers.iter().position(|(key, ..)| *key == c) {
                Some(index) => self.answer(index),
                None => Response::Stay,
            },
            _ => Response::Stay,
        }
    }

    /// The answer in a row; below the last one is the way back.
    fn answer(&mut self, index: usize) -> Response {
        if index < self.answers.len() { Response::Do(self.answers.swap_remove(index).2) } else { Response::Leave }
    }

    pub(super) fn click(&mut self, at: Position) -> Response {
        if !self.shown.contains(at) {
            return Response::Stay;
        }
        self.answer(usize::from(at.y - self.shown.y))
    }

    pub(super) fn draw(&mut self, area: Rect, theme: &Theme, buffer: &mut Buffer) {
        let width = area.width.saturating_sub(8).min(60);
        let text = wrap(&self.text, usize::from(width));
        let height = text.len() + 2 + self.answers.len();
        let inside = frame(&self.title, (width, height as u16), area, theme, buffer);
        let rows = self.answers.len() as u16 + 1;
        self.shown = Rect { y: inside.y + text.len() as u16 + 1, height: rows, ..inside }.intersection(inside);
        let put = |row: usize, key: &str, text: &str, buffer: &mut Buffer| {
            let y = inside.y + row as u16;
            if y < inside.bottom() {
                let (x, _) = buffer.set_stringn(inside.x, y, key, usize::from(inside.width), theme.strong());
                buffer.set_stringn(x, y, text, usize::from(inside.right() - x), Style::new());
            }
        };
        for (row, line) in text.iter().enumerate() {
            put(row, "", line, buffer);
        }
        for (row, (key, meaning, _)) in (text.len() + 1..).zip(&self.answers) {
            put(row, &format!("{key}  "), meaning, buffer);
        }
        put(height - 1, "esc  ", "go on as before", buffer);
    }
}
