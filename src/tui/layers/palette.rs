//! Actions and commands by name: a fuzzy list and a command line in one.

use crossterm::event::{KeyCode, KeyEvent};
use nucleo_matcher::pattern::{CaseMatching, Normalization, Pattern};
use nucleo_matcher::{Config, Matcher, Utf32Str};
use ratatui::buffer::Buffer;
use ratatui::layout::{Constraint, Position, Rect};
use ratatui::style::Style;
use ratatui::text::{Line, Span, Text};
use ratatui::widgets::{Row, Widget};

use super::prompt::line;
use super::{Layer, Response};
use crate::tui::actions::{Context, Entry, entries};
use crate::tui::effect::Effect;
use crate::tui::input::Keymap;
use crate::tui::widgets::columns::{self, shortened};
use crate::tui::widgets::list;
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
    /// Its command with what follows, or its name, and an explanation, in one line.
    fn line(self) -> String {
        let usage = self.entry.verb().map_or_else(|| self.entry.name.to_owned(), Verb::usage);
        format!("{usage:<28} {}", self.entry.about)
    }
}

/// The command palette.
pub struct Palette {
    input: TextInput,
    items: Vec<Item>,
    found: Vec<Item>,
    selected: usize,
    /// Where what was found is.
    rows: Vec<(Rect, usize)>,
    /// Why the latest command was refused.
    error: Option<String>,
}

impl Palette {
    /// A palette of the actions that apply now and of all commands.
    pub fn new(contexts: &[Context]) -> Self {
        let items = entries().iter().map(|entry| {
            let applies = contexts.contains(&entry.context) && entry.context != Context::Typed;
            Item { entry, applies }
        });
        let items: Vec<Item> = items
            .filter(|item| item.applies || item.entry.verb().is_some() || item.entry.context.tab().is_some())
            .collect();
        let (found, rows) = (items.clone(), Vec::new());
        Self { input: TextInput::default(), items, found, selected: 0, rows, error: None }
    }

    /// A palette in which a command is begun.
    pub fn begun(contexts: &[Context], words: &str) -> Self {
        let mut palette = Self::new(contexts);
        palette.paste(&format!("{words} "));
        palette
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
            Some(item) => match (item.entry.verb(), item.entry.context.tab()) {
                (None, Some(tab)) => Response::Do(Effect::PerformOn(tab, item.entry.action)),
                _ => {
                    self.complete();
                    Response::Stay
                }
            },
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
        if let Some(verb) = self.found.get(self.selected).and_then(|item| item.entry.verb()) {
            self.input = TextInput::new(format!("{} ", verb.name));
            self.search();
        }
    }

    fn search(&mut self) {
        self.error = None;
        self.selected = 0;
        let text = self.input.text().trim();
        if is_command(text) {
            let begins = |item: &&Item| item.entry.verb().is_some_and(|verb| begins_with(text, verb.name));
            self.found = self.items.iter().filter(begins).copied().collect();
            return;
        }
        let pattern = Pattern::parse(text, CaseMatching::Ignore, Normalization::Smart);
        let mut matcher = Matcher::new(Config::DEFAULT);
        let mut characters = Vec::new();
        let mut score = |text: &str| pattern.score(Utf32Str::new(text, &mut characters), &mut matcher);
        let scored = self.items.iter().filter_map(|item| {
            let name = score(item.entry.name).max(item.entry.verb().and_then(|verb| score(verb.name)));
            name.map(|score| 2 * score).max(score(item.entry.about)).map(|score| (score, *item))
        });
        let mut found: Vec<(u32, Item)> = scored.collect();
        found.sort_by_key(|(score, _)| std::cmp::Reverse(*score));
        self.found = found.into_iter().map(|(_, item)| item).collect();
    }
}

impl Layer for Palette {
    fn key(&mut self, key: KeyEvent) -> Response {
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

    fn click(&mut self, at: Position) -> Response {
        match self.rows.iter().find(|(area, _)| area.contains(at)) {
            Some((_, index)) if self.error.is_none() => {
                self.selected = *index;
                self.choose()
            }
            _ => Response::Stay,
        }
    }

    fn paste(&mut self, text: &str) {
        self.input.insert(text);
        self.search();
    }

    fn refuse(&mut self, reason: String) {
        self.error = Some(reason);
    }

    fn draw(&mut self, area: Rect, keymap: &Keymap, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
        let inside = frame("commands", (116, 16), area, theme, buffer);
        let cursor = line(&self.input, ": ", inside, theme, buffer);
        let width = usize::from(inside.width);
        let mut below = Rect { y: inside.y + 1, height: inside.height - 1, ..inside };
        if let Some(error) = &self.error {
            let lines = [String::new()].into_iter().chain(wrap(error, width));
            Text::from_iter(lines).style(Style::new().fg(theme.bad)).render(below, buffer);
            return Some(cursor);
        }
        // What is selected is explained at the bottom if its line has no room for that.
        if let Some(item) = self.found.get(self.selected).filter(|item| columns::width(&item.line()) + 12 > width) {
            let lines = wrap(item.entry.about, width);
            below.height = below.height.saturating_sub(lines.len() as u16);
            let bottom = Rect { y: below.bottom(), height: inside.bottom() - below.bottom(), ..inside };
            Text::from_iter(lines).style(theme.faint()).render(bottom, buffer);
        }
        let row = |index: usize| {
            let item = self.found[index];
            let keys = match item.entry.context.tab().filter(|_| item.entry.verb().is_none()) {
                _ if item.applies => keymap.keys(item.entry).join(" "),
                Some(tab) => format!("on {}", tab.title()),
                None => String::new(),
            };
            let text = shortened(&item.line(), width.saturating_sub(keys.len() + 1), false);
            let room = width.saturating_sub(keys.len());
            let line = vec![Span::raw(columns::padded(&text, room)), Span::styled(keys, theme.strong())];
            Row::new([Line::from(line)])
        };
        let (count, all) = (self.found.len(), [Constraint::Fill(1)]);
        self.rows = list::draw(count, Some(self.selected), row, &all, below, theme, buffer);
        Some(cursor)
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
            Response::Do(Effect::PerformOn(tab, action)) => format!("perform on {} {action:?}", tab.title()),
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
            ("whole-range", "perform on Training WholeRange"),
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
