//! A palette of tools with small pictures and incremental search.

use crossterm::event::{KeyCode, KeyEvent};
use nucleo_matcher::pattern::AtomKind;
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use ratatui::style::Style;
use ratatui::text::Text;
use ratatui::widgets::Widget;

use super::form::line;
use super::palette::{ranked, scorer};
use crate::tui::effect::{Effect, Layer, Response};
use crate::tui::scene::picture;
use crate::tui::widgets::columns::{self, shortened};
use crate::tui::widgets::list;
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::text_input::TextInput;
use crate::tui::widgets::theme::Theme;
use mge_physics::{NO_OP, Tool, ToolKind, catalogue_tool};
use mge_task::Property;

/// A tool that can be chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolItem {
    /// The tool; its position does not matter.
    pub tool: Tool,
    /// Its description.
    text: String,
    /// The text that is searched.
    words: String,
}

impl ToolItem {
    /// A tool; `about` is appended to its description.
    fn new(tool: Tool, about: &str) -> Self {
        let text = [tool_text(&tool, true), about.to_owned()].join(" ").trim_end().to_owned();
        // `seesaw` finds a see_saw, too.
        let words = format!("{text} {}", tool.kind.name().replace('_', ""));
        Self { tool, text, words }
    }

    /// Every type, then the tools of CREATE's catalogue.
    pub fn all() -> Vec<Self> {
        let usual = |kind| Self::new(Tool::new(kind, [0.0; 2]), "");
        let of_catalogue = |number| Some(Self::new(*catalogue_tool(number)?, &format!("#{number}")));
        ToolKind::ALL.into_iter().map(usual).chain((0..NO_OP).filter_map(of_catalogue)).collect()
    }

    /// Its name, shortened to the columns below its picture.
    fn name(&self, columns: u16) -> String {
        // One of the catalogue is told apart from its type.
        let is_type = !self.text.contains('#') && Property::unusual(&self.tool).is_empty();
        let name = if is_type { self.tool.kind.name().to_owned() } else { tool_text(&self.tool, false) };
        shortened(&name, usize::from(columns), true)
    }
}

/// The type of a tool, its size and its unusual properties, with the names of the properties or only their initials.
pub fn tool_text(tool: &Tool, named: bool) -> String {
    let size = Some((Property::Size, Property::Size.of(tool))).filter(|_| tool.kind.has_size());
    let others = Property::unusual(tool).into_iter().filter(|(property, _)| *property != Property::Size);
    let word = |(property, value): (Property, f64)| match property {
        _ if named => format!(" {property} {value}"),
        Property::Size => format!(" {value}"),
        _ => format!(" {}{value}", &property.name()[..1]),
    };
    tool.kind.to_string() + &size.into_iter().chain(others).map(word).collect::<String>()
}

/// The effect of choosing a tool.
type Choose = dyn Fn(&ToolItem) -> Effect;

/// A palette of tools.
pub struct ToolPalette {
    title: String,
    input: TextInput,
    items: Vec<ToolItem>,
    /// Indices of the matching items, best match first.
    found: Vec<usize>,
    selected: usize,
    choose: Box<Choose>,
    /// Pictures per row, and rows, when it was last drawn.
    shape: [usize; 2],
    /// Where each visible match was last drawn.
    cells: Vec<(Rect, usize)>,
}

impl ToolPalette {
    /// A palette of these tools.
    pub fn new(title: impl Into<String>, items: Vec<ToolItem>, choose: impl Fn(&ToolItem) -> Effect + 'static) -> Self {
        let found = (0..items.len()).collect();
        Self {
            title: title.into(),
            input: TextInput::default(),
            items,
            found,
            selected: 0,
            choose: Box::new(choose),
            shape: [1, 1],
            cells: Vec::new(),
        }
    }

    fn search(&mut self) {
        self.selected = 0;
        // Substrings instead of fuzzy matching: scattered digits would match almost every number.
        let mut score = scorer(self.input.text(), AtomKind::Substring);
        self.found = ranked(0..self.items.len(), |index| score(&self.items[*index].words));
    }

    fn chosen(&self) -> Option<&ToolItem> {
        self.items.get(*self.found.get(self.selected)?)
    }

    fn choose(&self) -> Response {
        self.chosen().map_or(Response::Stay, |item| Response::Do((self.choose)(item)))
    }

    fn go(&mut self, by: isize) {
        let last = self.found.len().saturating_sub(1);
        self.selected = self.selected.saturating_add_signed(by).min(last);
    }
}

impl Layer for ToolPalette {
    fn key(&mut self, key: KeyEvent) -> Response {
        let [columns, rows] = self.shape.map(|count| count as isize);
        match key.code {
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
        let tall = if area.height >= 30 { 4 } else { 3 };
        let columns = (area.width.saturating_sub(4) / WIDTH).clamp(1, 8);
        let rows = (area.height.saturating_sub(5) / (tall + 1)).clamp(1, 5);
        let title = format!("{} · type to search, enter: choose, esc: close", self.title);
        let inside = frame(&title, (columns * WIDTH, rows * (tall + 1) + 2), area, theme, buffer);
        let cursor = line(&self.input, "> ", inside, theme, buffer);
        let about = match self.chosen() {
            Some(item) => format!("{} of {}: {}", self.selected + 1, self.found.len(), item.text),
            None => "no tool matches".to_owned(),
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
            let item = &self.items[self.found[index]];
            picture(&item.tool, Rect { height: cell.height.min(tall), ..cell }, theme, buffer);
            let name = item.name(WIDTH - 2);
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

    #[test]
    fn matches_at_the_beginning_of_a_word_come_first() {
        let item = |number: usize| ToolItem::new(Tool::new(ToolKind::Box, [0.0; 2]), &format!("#{number}"));
        let mut tools = ToolPalette::new("", vec![item(1234), item(23)], |_| Effect::info(""));
        tools.paste("23");
        assert!(tools.chosen().unwrap().text.ends_with("#23"));
    }

    #[test]
    fn only_a_tool_of_the_catalogue_is_named_with_its_size() {
        let tool = Tool::new(ToolKind::Box, [0.0; 2]);
        let name = |about: &str| ToolItem::new(tool, about).name(30);
        assert_eq!(name(""), "box");
        let size = name("#3").strip_prefix("box ").map(str::to_owned);
        assert!(size.is_some_and(|size| size.parse::<f64>().is_ok()), "{}", name("#3"));
    }
}
