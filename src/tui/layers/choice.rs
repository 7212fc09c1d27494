//! One of several: lists to choose from and questions before destructive things.

use crossterm::event::{KeyCode, KeyEvent};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use ratatui::style::Style;

use super::popup::{frame, wrap};
use super::{Deed, Wish};
use crate::tui::columns;
use crate::tui::theme::Theme;

/// A list to choose from.
pub struct Chooser {
    /// What is chosen.
    pub title: String,
    /// Name, explanation and what choosing does.
    pub items: Vec<(String, String, Deed)>,
    /// The selected item.
    pub selected: usize,
    /// Where the items are, and which is the first.
    pub shown: (Rect, usize),
}

impl Chooser {
    pub(super) fn key(&mut self, key: KeyEvent) -> Wish {
        let last = self.items.len().saturating_sub(1);
        match key.code {
            KeyCode::Esc | KeyCode::Char('q') => return Wish::Leave,
            KeyCode::Up | KeyCode::Char('k') => self.selected = self.selected.saturating_sub(1),
            KeyCode::Down | KeyCode::Char('j') => self.selected = (self.selected + 1).min(last),
            KeyCode::Home => self.selected = 0,
            KeyCode::End => self.selected = last,
            KeyCode::Enter | KeyCode::Char(' ') => {
                return self.items.get(self.selected).map_or(Wish::Leave, |(_, _, deed)| Wish::Do(deed.clone()));
            }
            KeyCode::Char(digit @ '1'..='9') => {
                let index = digit as usize - '1' as usize;
                if let Some((_, _, deed)) = self.items.get(index) {
                    return Wish::Do(deed.clone());
                }
            }
            _ => {}
        }
        Wish::Stay
    }

    pub(super) fn click(&mut self, at: Position) -> Wish {
        let (area, first) = self.shown;
        if !area.contains(at) || first + usize::from(at.y - area.y) >= self.items.len() {
            return Wish::Stay;
        }
        self.selected = first + usize::from(at.y - area.y);
        self.key(KeyCode::Enter.into())
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
    pub title: String,
    /// What will happen.
    pub text: String,
    /// Key, meaning and what it does. Escape does nothing.
    pub answers: Vec<(char, String, Deed)>,
    /// Where the answers are, the way back last.
    pub shown: Rect,
}

impl Confirm {
    pub(super) fn key(&mut self, key: KeyEvent) -> Wish {
        match key.code {
            KeyCode::Esc | KeyCode::Char('n') => Wish::Leave,
            KeyCode::Enter => self.answers.first().map_or(Wish::Leave, |(_, _, deed)| Wish::Do(deed.clone())),
            KeyCode::Char(c) => {
                let answer = self.answers.iter().find(|(key, ..)| *key == c);
                answer.map_or(Wish::Stay, |(_, _, deed)| Wish::Do(deed.clone()))
            }
            _ => Wish::Stay,
        }
    }

    pub(super) fn click(&mut self, at: Position) -> Wish {
        if !self.shown.contains(at) {
            return Wish::Stay;
        }
        let answer = self.answers.get(usize::from(at.y - self.shown.y));
        answer.map_or(Wish::Leave, |(_, _, deed)| Wish::Do(deed.clone()))
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
