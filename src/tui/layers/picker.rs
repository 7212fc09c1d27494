//! A picker of what has a picture, with incremental search: families first, their variants inside.

use crossterm::event::{KeyCode, KeyEvent};
use ratatui::prelude::*;

use super::form::line;
use super::search::{Searched, search};
use crate::tui::effect::{Effect, Layer, Response};
use crate::tui::widgets::columns::{self, shortened};
use crate::tui::widgets::layout::grid;
use crate::tui::widgets::list;
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::text_input::TextInput;
use crate::tui::widgets::theme::Theme;

/// Something that is chosen by its picture.
#[derive(Debug, Clone)]
pub struct Item<T> {
    /// Its name; of a variant, that of its family.
    pub name: String,
    /// What tells it from others of its family, if it is a variant.
    pub variant: Option<String>,
    /// Its description.
    pub about: String,
    /// What is chosen.
    pub of: T,
}

impl<T> Item<T> {
    /// Its name below the picture, in at most so many columns.
    fn shown_name(&self, columns: usize) -> String {
        let end = self.variant.as_deref().unwrap_or_default();
        let name = shortened(&self.name, columns.saturating_sub(end.len()), self.variant.is_none());
        shortened(&(name + end), columns, true)
    }
}

impl<T> Searched for Item<T> {
    fn texts(&self) -> (Vec<&str>, &str) {
        (vec![&self.name], &self.about)
    }
}

/// The effect of choosing an item.
type Choose<T> = dyn Fn(&Item<T>) -> Effect;
/// How an item is drawn.
type Draw<T> = fn(&T, Rect, &Theme, &mut Buffer);

/// A picker.
pub struct Picker<T> {
    title: String,
    input: TextInput,
    items: Vec<Item<T>>,
    /// The name of the family that is open.
    family: Option<String>,
    /// The matching items, best match first.
    found: Vec<Item<T>>,
    selected: usize,
    /// Rows of a picture, and how it is drawn.
    picture: (u16, Draw<T>),
    choose: Box<Choose<T>>,
    /// Pictures per row, and rows, when it was last drawn.
    shape: [usize; 2],
    /// Where each visible match was last drawn.
    cells: Vec<(Rect, usize)>,
}

impl<T: Clone> Picker<T> {
    /// A picker of these items, given the rows of a picture and how it is drawn.
    pub fn new(
        title: &str,
        items: Vec<Item<T>>,
        picture: (u16, Draw<T>),
        choose: impl Fn(&Item<T>) -> Effect + 'static,
    ) -> Self {
        let mut picker = Self {
            title: title.to_owned(),
            input: TextInput::default(),
            items,
            family: None,
            found: Vec::new(),
            selected: 0,
            picture,
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
        let shown = |item: &&Item<T>| match &self.family {
            Some(family) => item.name == *family,
            None => !typed.is_empty() || item.variant.is_none(),
        };
        self.found = search(self.items.iter().filter(shown), typed).into_iter().cloned().collect();
    }

    fn chosen(&self) -> Option<&Item<T>> {
        self.found.get(self.selected)
    }

    /// The number of variants of an item whose family is not open.
    fn variants(&self, item: &Item<T>) -> usize {
        let is_open = self.family.is_some() || item.variant.is_some();
        self.items.iter().filter(|other| !is_open && other.variant.is_some() && other.name == item.name).count()
    }

    /// Opens a family, or closes it, with itself selected.
    fn open(&mut self, family: Option<String>) {
        let before = std::mem::replace(&mut self.family, family);
        self.input = TextInput::default();
        self.search();
        self.selected = self.found.iter().position(|item| Some(&item.name) == before.as_ref()).unwrap_or(0);
    }

    fn choose(&mut self) -> Response {
        let Some(item) = self.chosen() else { return Response::Stay };
        if self.variants(item) > 0 {
            self.open(Some(item.name.clone()));
            return Response::Stay;
        }
        Response::Do((self.choose)(item))
    }

    fn go(&mut self, by: isize) {
        let last = self.found.len().saturating_sub(1);
        self.selected = self.selected.saturating_add_signed(by).min(last);
    }
}

impl<T: Clone> Layer for Picker<T> {
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
        let tall = if area.height >= 30 { self.picture.0 } else { self.picture.0 - 1 };
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
                format!("{} of {}: {}{inside}", self.selected + 1, self.found.len(), item.about)
            }
            None => "nothing matches".to_owned(),
        };
        let bottom = Rect { y: inside.bottom().saturating_sub(1), height: 1, ..inside };
        Text::from_iter(wrap(&about, usize::from(inside.width))).style(theme.faint()).render(bottom, buffer);
        self.shape = [columns, rows].map(usize::from);
        // Scroll so far that the selected row is visible.
        let first = (self.selected / self.shape[0]).saturating_sub(self.shape[1] - 1) * self.shape[0];
        self.cells.clear();
        let whole = Rect { y: inside.y + 1, width: columns * WIDTH, height: rows * (tall + 1), ..inside };
        for (cell, index) in grid(whole, self.shape[0], self.shape[1]).into_iter().zip(first..self.found.len()) {
            let cell = cell.intersection(inside);
            let item = &self.found[index];
            self.picture.1(&item.of, Rect { height: cell.height.min(tall), ..cell }, theme, buffer);
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
    use crate::tui::screens::edit::tools;
    use mge_physics::Tool;

    fn picker(typed: &str) -> Picker<Tool> {
        let mut tools = Picker::new("", tools(), (4, |_, _, _, _| ()), |_| Effect::info(""));
        tools.paste(typed);
        tools
    }

    #[test]
    fn variants_are_inside_their_family_until_one_types() {
        let mut tools = picker("");
        assert!(tools.found.iter().all(|item| item.variant.is_none()) && tools.found.len() < 40, "families");
        tools.paste("trmpln 14");
        assert!(tools.found[0].about.starts_with("trampoline size 14"), "scattered letters find a name");
        let close = tools.key(KeyCode::Enter.into());
        assert!(matches!(close, Response::Do(_)), "a variant is chosen");
        let mut tools = picker("ramp");
        assert!(matches!(tools.key(KeyCode::Enter.into()), Response::Stay), "it is a family");
        assert!(tools.found.len() > 100 && tools.found.iter().all(|item| item.name == "ramp"));
        tools.key(KeyCode::Esc.into());
        assert!(tools.chosen().is_some_and(|item| item.name == "ramp" && item.variant.is_none()));
        assert!(matches!(tools.key(KeyCode::Esc.into()), Response::Leave));
    }

    #[test]
    fn a_number_is_found_in_what_is_shown_of_a_tool() {
        let tools = picker("ramp 45");
        assert!(!tools.found.is_empty() && tools.found.iter().all(|item| item.about.contains("45")));
    }

    #[test]
    fn a_variant_is_named_with_all_that_tells_it_from_others() {
        for item in tools() {
            let name = item.shown_name(17);
            let end = item.variant.as_deref().unwrap_or(&item.name);
            assert!(name.len() <= 17 && name.ends_with(end), "{name}: {end}");
        }
    }
}
