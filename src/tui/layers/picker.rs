//! A picker of what has a picture, with incremental search: families first, their variants inside.

use crossterm::event::{KeyCode, KeyEvent};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use ratatui::style::Style;
use ratatui::text::Text;
use ratatui::widgets::Widget;

use super::form::line;
use super::search::{Searched, search};
use crate::tui::effect::{Effect, Layer, Response};
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::text_input::TextInput;
use crate::tui::widgets::theme::Theme;
use crate::tui::widgets::{columns, list};

/// Something that is chosen by its picture.
pub trait Pictured: Searched + Clone {
    /// Rows of its picture.
    const ROWS: u16;

    /// Its name below the picture, in at most so many columns.
    fn shown_name(&self, columns: usize) -> String;

    /// Draws its picture.
    fn draw(&self, area: Rect, theme: &Theme, buffer: &mut Buffer);

    /// The name of the one of which it is a variant, if it is one.
    fn family(&self) -> Option<&str> {
        None
    }
}

/// The effect of choosing an item.
type Choose<T> = dyn Fn(&T) -> Effect;

/// A picker.
pub struct Picker<T> {
    title: String,
    input: TextInput,
    items: Vec<T>,
    /// The name of the family that is open.
    family: Option<String>,
    /// The matching items, best match first.
    found: Vec<T>,
    selected: usize,
    choose: Box<Choose<T>>,
    /// Pictures per row, and rows, when it was last drawn.
    shape: [usize; 2],
    /// Where each visible match was last drawn.
    cells: Vec<(Rect, usize)>,
}

impl<T: Pictured> Picker<T> {
    /// A picker of these items.
    pub fn new(title: impl Into<String>, items: Vec<T>, choose: impl Fn(&T) -> Effect + 'static) -> Self {
        let mut picker = Self {
            title: title.into(),
            input: TextInput::default(),
            items,
            family: None,
            found: Vec::new(),
            selected: 0,
            choose: Box::new(choose),
            shape: [1, 1],
            cells: Vec::new(),
        };
        picker.search();
        picker
    }

    fn search(&mut self) {
        self.selected = 0;
        let typed = self.input.text();
        let shown = |item: &&T| match self.family.as_deref() {
            Some(family) => item.family().unwrap_or(item.names()[0]) == family,
            None => !typed.is_empty() || item.family().is_none(),
        };
        self.found = search(self.items.iter().filter(shown), typed).into_iter().cloned().collect();
    }

    fn chosen(&self) -> Option<&T> {
        self.found.get(self.selected)
    }

    /// The number of variants of an item whose family is not open.
    fn variants(&self, item: &T) -> usize {
        let of_it = |other: &&T| self.family.is_none() && other.family() == Some(item.names()[0]);
        self.items.iter().filter(of_it).count()
    }

    /// Opens a family, or closes it, with itself selected.
    fn open(&mut self, family: Option<String>) {
        let before = std::mem::replace(&mut self.family, family);
        self.input = TextInput::default();
        self.search();
        self.selected = self.found.iter().position(|item| Some(item.names()[0]) == before.as_deref()).unwrap_or(0);
    }

    fn choose(&mut self) -> Response {
        let Some(item) = self.chosen() else { return Response::Stay };
        if item.family().is_none() && self.variants(item) > 0 {
            self.open(Some(item.names()[0].to_owned()));
            return Response::Stay;
        }
        Response::Do((self.choose)(item))
    }

    fn go(&mut self, by: isize) {
        let last = self.found.len().saturating_sub(1);
        self.selected = self.selected.saturating_add_signed(by).min(last);
    }
}

impl<T: Pictured> Layer for Picker<T> {
    fn key(&mut self, key: KeyEvent) -> Response {
        let [columns, rows] = self.shape.map(|count| count as isize);
        match key.code {
            KeyCode::Esc if self.family.is_some() => self.open(None),
            KeyCode::Esc => return Response::Leave,
            KeyCode::Enter => return self.choose(),
            KeyCode::Left => self.go(-1),
            KeyCode::Right => self.go(1),
            KeyCode::Up => self.go(-columns),
            KeyCode::Down => self.go(columns),
            KeyCode::PageUp => self.go(-columns * rows),
            KeyCode::PageDown => self.go(columns * rows),
            KeyCode::Home => self.selected = 0,
            KeyCode::End => self.go(isize::MAX),
            _ if self.input.key(key) => self.search(),
            _ => {}
        }
        Response::Stay
    }

    fn click(&mut self, at: Position) -> Response {
        let Some(index) = list::hit(&self.cells, at) else { return Response::Stay };
        self.selected = index;
        self.choose()
    }

    fn paste(&mut self, text: &str) {
        self.input.insert(text);
        self.search();
    }

    fn draw(&mut self, area: Rect, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
        /// Columns of a picture with its name.
        const WIDTH: u16 = 18;
        let tall = if area.height >= 30 { T::ROWS } else { T::ROWS - 1 };
        let columns = (area.width.saturating_sub(4) / WIDTH).clamp(1, 8);
        let rows = (area.height.saturating_sub(5) / (tall + 1)).clamp(1, 5);
        let (family, esc) =
            self.family.as_ref().map_or_else(|| (String::new(), "close"), |it| (format!(" · {it}"), "back"));
        let title = format!("{}{family} · type to search, enter: choose, esc: {esc}", self.title);
        let inside = frame(&title, (columns * WIDTH, rows * (tall + 1) + 2), area, theme, buffer);
        let cursor = line(&self.input, "> ", inside, theme, buffer);
        let about = match self.chosen() {
            Some(item) => {
                let variants = self.variants(item);
                let inside = if variants > 0 { format!(" · enter shows {variants} more") } else { String::new() };
                format!("{} of {}: {}{inside}", self.selected + 1, self.found.len(), item.about())
            }
            None => "nothing matches".to_owned(),
        };
        let bottom = Rect { y: inside.bottom().saturating_sub(1), height: 1, ..inside };
        Text::from_iter(wrap(&about, usize::from(inside.width))).style(theme.faint()).render(bottom, buffer);
        self.shape = [columns, rows].map(usize::from);
        // Scroll so far that the selected row is visible.
        let first = (self.selected / self.shape[0]).saturating_sub(self.shape[1] - 1) * self.shape[0];
        self.cells.clear();
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        for ((row, column), index) in places.zip(first..self.found.len()) {
            let cell = Rect {
                x: inside.x + column * WIDTH,
                y: inside.y + 1 + row * (tall + 1),
                width: WIDTH,
                height: tall + 1,
            };
            let cell = cell.intersection(inside);
            let item = &self.found[index];
            item.draw(Rect { height: cell.height.min(tall), ..cell }, theme, buffer);
            let name = item.shown_name(usize::from(WIDTH) - 1);
            let x = cell.x + WIDTH.saturating_sub(columns::width(&name) as u16) / 2;
            if cell.height > tall {
                let style = if index == self.selected { theme.selected() } else { Style::new() };
                buffer.set_style(Rect { y: cell.y + tall, height: 1, ..cell }, style);
                buffer.set_stringn(x, cell.y + tall, &name, usize::from(inside.right().saturating_sub(x)), style);
            }
            self.cells.push((cell, index));
        }
        Some(cursor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::layers::ToolItem;

    fn tools(typed: &str) -> Picker<ToolItem> {
        let mut tools = Picker::new("", ToolItem::all(), |_| Effect::info(""));
        tools.paste(typed);
        tools
    }

    #[test]
    fn variants_are_inside_their_family_until_one_types() {
        let mut tools = tools("");
        assert!(tools.found.iter().all(|item| item.family().is_none()) && tools.found.len() < 40, "families");
        tools.paste("trmpln 14");
        assert!(tools.found[0].about().starts_with("trampoline size 14"), "scattered letters find a name");
        let close = tools.key(KeyCode::Enter.into());
        assert!(matches!(close, Response::Do(_)), "a variant is chosen");
        let mut tools = self::tools("ramp");
        assert!(matches!(tools.key(KeyCode::Enter.into()), Response::Stay), "it is a family");
        assert!(tools.found.len() > 100 && tools.found.iter().all(|item| item.names() == ["ramp"]));
        tools.key(KeyCode::Esc.into());
        assert!(tools.chosen().is_some_and(|item| item.names() == ["ramp"] && item.family().is_none()));
        assert!(matches!(tools.key(KeyCode::Esc.into()), Response::Leave));
    }

    #[test]
    fn a_number_is_found_in_what_is_shown_of_a_tool() {
        let tools = tools("ramp 45");
        assert!(!tools.found.is_empty() && tools.found.iter().all(|item| item.about().contains("45")));
    }
}
