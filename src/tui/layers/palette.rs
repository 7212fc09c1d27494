//! Actions and commands by name: a fuzzy list and a command line in one.

use crossterm::event::{KeyCode, KeyEvent};
use nucleo_matcher::pattern::{CaseMatching, Normalization, Pattern};
use nucleo_matcher::{Config, Matcher, Utf32Str};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use ratatui::style::Style;

use super::Response;
use super::prompt::line;
use crate::tui::actions::{Context, Entry, Script, entries};
use crate::tui::effect::Effect;
use crate::tui::input::Keymap;
use crate::tui::widgets::columns;
use crate::tui::widgets::columns::shortened;
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::text_input::TextInput;
use crate::tui::widgets::theme::Theme;
use crate::workbench::{Command, Verb, verbs};

/// What can be found.
#[derive(Clone, Copy)]
struct Item {
    entry: &'static Entry,
    /// It can be asked for as it stands; otherwise its command is to be typed.
    applies: bool,
}

impl Item {
    fn verb(self) -> Option<&'static Verb> {
        match self.entry.script {
            Script::Verb(verb) => Some(verb),
            _ => None,
        }
    }

    /// Its command with what follows, or its name.
    fn usage(self) -> String {
        match self.verb() {
            Some(verb) => verb.usage(),
            None => self.entry.name.to_owned(),
        }
    }

    /// Usage and explanation, in one line.
    fn line(self) -> String {
        format!("{:<28} {}", self.usage(), self.entry.about)
    }
}

/// The command palette.
pub struct Palette {
    input: TextInput,
    items: Vec<Item>,
    found: Vec<Item>,
    selected: usize,
    /// Where what was found is, and which is the first.
    shown: (Rect, usize),
    /// Why the latest command was refused.
    pub error: Option<String>,
}

impl Palette {
    /// A palette of the actions that apply now and of all commands.
    pub fn new(contexts: &[Context]) -> Self {
        let items = entries().iter().map(|entry| {
            let applies = contexts.contains(&entry.context) && entry.context != Context::Typed;
            Item { entry, applies }
        });
        let items: Vec<Item> = items.filter(|item| item.applies || item.verb().is_some()).collect();
        Self {
            input: TextInput::default(),
            found: items.clone(),
            items,
            selected: 0,
            shown: Default::default(),
            error: None,
        }
    }

    /// A palette in which a command is begun.
    pub fn begun(contexts: &[Context], words: &str) -> Self {
        let mut palette = Self::new(contexts);
        palette.paste(&format!("{words} "));
        palette
    }

    pub(super) fn paste(&mut self, text: &str) {
        self.input.insert(text);
        self.search();
    }

    pub(super) fn key(&mut self, key: KeyEvent) -> Response {
        match key.code {
            KeyCode::Esc => return Response::Leave,
            KeyCode::Up => self.selected = self.selected.saturating_sub(1),
            KeyCode::Down => self.selected = (self.selected + 1).min(self.found.len().saturating_sub(1)),
            KeyCode::Tab => self.complete(),
            KeyCode::Enter => return self.choose(),
            _ if self.input.key(key) => self.search(),
            _ => {}
        }
        Response::Stay
    }

    /// A line that begins with a command and has an argument is that command; otherwise
    /// the selected item counts.
    fn choose(&mut self) -> Response {
        let text = self.input.text().trim();
        if is_command(text) {
            return self.command();
        }
        match self.found.get(self.selected) {
            Some(item) if item.applies => Response::Do(Effect::Perform(item.entry.action)),
            Some(_) => {
                self.complete();
                Response::Stay
            }
            None => self.command(),
        }
    }

    /// What is written, as a command.
    fn command(&mut self) -> Response {
        match Command::parse(self.input.text()) {
            Ok(Some(command)) => return Response::Try(Effect::Apply(command)),
            Ok(None) => {}
            Err(error) => self.error = Some(error.to_string()),
        }
        Response::Stay
    }

    fn complete(&mut self) {
        if let Some(verb) = self.found.get(self.selected).and_then(|item| item.verb()) {
            self.input = TextInput::new(format!("{} ", verb.name));
            self.search();
        }
    }

    fn search(&mut self) {
        self.error = None;
        self.selected = 0;
        let text = self.input.text().trim();
        if is_command(text) {
            let begins = |item: &&Item| item.verb().is_some_and(|verb| begins_with(text, verb.name));
            self.found = self.items.iter().filter(begins).copied().collect();
            return;
        }
        let pattern = Pattern::parse(text, CaseMatching::Ignore, Normalization::Smart);
        let mut matcher = Matcher::new(Config::DEFAULT);
        let mut characters = Vec::new();
        let mut score = |text: &str| pattern.score(Utf32Str::new(text, &mut characters), &mut matcher);
        let scored = self.items.iter().filter_map(|item| {
            let name = score(item.entry.name).max(item.verb().and_then(|verb| score(verb.name)));
            name.map(|score| 2 * score).max(score(item.entry.about)).map(|score| (score, *item))
        });
        let mut found: Vec<(u32, Item)> = scored.collect();
        found.sort_by_key(|(score, _)| std::cmp::Reverse(*score));
        self.found = found.into_iter().map(|(_, item)| item).collect();
    }

    pub(super) fn click(&mut self, at: Position) -> Response {
        let (area, first) = self.shown;
        if self.error.is_some() || !area.contains(at) || first + usize::from(at.y - area.y) >= self.found.len() {
            return Response::Stay;
        }
        self.selected = first + usize::from(at.y - area.y);
        self.choose()
    }

    /// Explains what is selected at the bottom if its line has no room for that; the row
    /// above.
    fn explain(&self, inside: Rect, theme: &Theme, buffer: &mut Buffer) -> u16 {
        let width = usize::from(inside.width);
        let Some(item) = self.found.get(self.selected).filter(|item| columns::width(&item.line()) + 12 > width) else {
            return inside.bottom();
        };
        let lines = wrap(item.entry.about, width);
        let top = inside.bottom().saturating_sub(lines.len() as u16);
        for (y, line) in (top..inside.bottom()).zip(lines) {
            buffer.set_stringn(inside.x, y, line, width, theme.faint());
        }
        top
    }

    pub(super) fn draw(&mut self, area: Rect, keymap: &Keymap, theme: &Theme, buffer: &mut Buffer) -> (u16, u16) {
        let inside = frame("commands", (116, 16), area, theme, buffer);
        let cursor = line(&self.input, ": ", inside, theme, buffer);
        let width = usize::from(inside.width);
        if let Some(error) = &self.error {
            for (y, text) in (inside.y + 2..inside.bottom()).zip(wrap(error, width)) {
                buffer.set_stringn(inside.x, y, text, width, Style::new().fg(theme.bad));
            }
            return cursor;
        }
        let rows = inside.y + 1..self.explain(inside, theme, buffer);
        let first = (self.selected + 1).saturating_sub(rows.len());
        self.shown = (Rect { y: inside.y + 1, height: rows.len() as u16, ..inside }, first);
        for (y, (index, item)) in rows.zip(self.found.iter().enumerate().skip(first)) {
            let keys = if item.applies { keymap.keys(item.entry).join(" ") } else { String::new() };
            let style = if index == self.selected { theme.selected() } else { Style::new() };
            let room = width.saturating_sub(keys.len() + 1);
            let text = shortened(&item.line(), room, false);
            buffer.set_stringn(inside.x, y, format!("{text:width$}"), width, style);
            buffer.set_stringn(
                inside.x + room as u16,
                y,
                format!(" {keys}"),
                keys.len() + 1,
                style.patch(theme.strong()),
            );
        }
        cursor
    }
}

fn begins_with(text: &str, name: &str) -> bool {
    text.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
}

/// Whether a text is more than the beginning of a name: a command with its arguments.
fn is_command(text: &str) -> bool {
    let complete = |verb: &Verb| match text.strip_prefix(verb.name) {
        Some("") => verb.arguments.is_empty(),
        Some(rest) => rest.starts_with(' '),
        None => false,
    };
    verbs().any(complete)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crossterm::event::KeyModifiers;

    /// What is asked for after a text was typed and given.
    fn given(typed: &str) -> String {
        let mut palette = Palette::new(&[Context::Scene, Context::Everywhere]);
        palette.paste(typed);
        match palette.key(KeyEvent::new(KeyCode::Enter, KeyModifiers::NONE)) {
            Response::Try(Effect::Apply(command)) => format!("command {command}"),
            Response::Do(Effect::Perform(action)) => format!("action {action:?}"),
            Response::Stay => palette.error.unwrap_or_else(|| palette.input.text().to_owned()),
            _ => "something else".to_owned(),
        }
    }

    #[test]
    fn typed_commands_are_commands_and_everything_else_is_searched() {
        for (typed, expected) in [
            ("epsilon 0.3", "command epsilon 0.3"),
            ("undo", "command undo"),
            ("subgoal move 1 0 0.5", "command subgoal move 1 0 0.5"),
            ("train", "action Train"),
            ("hplay", "action HandPlay"),
            ("seed", "action Seed"),
            ("subgoal mo", "subgoal move "),
            ("epsilon 7", "7 is not within 0 and 1"),
            ("quarrel 7", "unknown command `quarrel 7`"),
        ] {
            let given = given(typed);
            assert!(given.contains(expected), "{typed}: {given}");
        }
    }

    #[test]
    fn tab_completes_a_command() {
        let mut palette = Palette::new(&[Context::Everywhere]);
        palette.paste("subgoal mo");
        palette.key(KeyEvent::new(KeyCode::Tab, KeyModifiers::NONE));
        assert_eq!(palette.input.text(), "subgoal move ");
    }
}
