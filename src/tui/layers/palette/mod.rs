//! The command palette: fuzzy search over actions and commands, and a command line.

mod arguments;

use crossterm::event::{KeyCode, KeyEvent};
use educe::Educe;
use ratatui::prelude::*;
use ratatui::widgets::Row;

use super::form::line;
use super::search::{Searched, search, similar};
use crate::tui::actions::{Context, Entry, entries};
use crate::tui::effect::{Effect, Layer, Response};
use crate::tui::view::Level;
use crate::tui::widgets::columns::{self, shortened};
use crate::tui::widgets::list;
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::text_input::TextInput;
use crate::tui::widgets::theme::Theme;
pub use arguments::{Arguments, Value};
use mge_base::spelling::SIMILAR;
use mge_base::text::counted;
use mge_workbench::{Command, Verb, verbs};

/// The command palette.
#[derive(Educe)]
#[educe(Default)]
pub struct CommandPalette {
    input: TextInput,
    /// Greatest number of rows.
    #[educe(Default = 16)]
    height: u16,
    actions: Vec<Value>,
    /// Everything that can be completed.
    arguments: Arguments,
    /// The actions that are found, then completions of the command being typed, or else commands with arguments.
    found: Vec<Value>,
    /// Commands entered so far, oldest first, and the index of the recalled one.
    history: Vec<String>,
    recalled: Option<usize>,
    /// The place of what Enter does: none unless the typed text names it, or it was chosen.
    selected: Option<usize>,
    /// Where each visible row was last drawn.
    rows: Vec<(Rect, usize)>,
    /// Why the latest command was refused.
    error: Option<String>,
}

impl CommandPalette {
    /// A palette of all actions and commands, first those that apply in the contexts of the screen.
    pub fn new(contexts: &[Context], arguments: Arguments, history: Vec<String>) -> Self {
        let applies = |entry: &Entry| contexts.contains(&entry.context) && entry.context != Context::Typed;
        let mut actions: Vec<Value> = entries().iter().map(|entry| Value::action(entry, applies(entry))).collect();
        actions.sort_by_key(|value| !value.action.is_some_and(|(_, applies)| applies));
        Self { found: actions.clone(), actions, arguments, history, ..Self::default() }
    }

    /// The palette with the actions of the screen first, as high as there is room.
    #[must_use]
    pub fn with_screen_first(mut self, contexts: &[Context]) -> Self {
        let place = |value: &Value| {
            let (entry, _) = value.action?;
            contexts.iter().position(|context| *context == entry.context)
        };
        self.actions.sort_by_key(|value| place(value).unwrap_or(usize::MAX));
        Self { found: self.actions.clone(), height: u16::MAX, ..self }
    }

    fn chosen(&self) -> Option<&Value> {
        self.found.get(self.selected?)
    }

    /// Carries out the typed line if it is a command, or else what is selected: chosen with the arrow keys, or named by
    /// the typed text.
    fn choose(&mut self) -> Response {
        let is_command = is_command(self.input.text().trim_start());
        let Some(value) = self.chosen().filter(|value| !is_command || value.action.is_none()) else {
            return self.command();
        };
        if value.is_document() {
            let text = format!("{}: {}", value.line(), value.about);
            return Response::Do(Effect::call(move |app| app.warn(Level::Info, &text)));
        }
        let Some((entry, applies)) = value.action else {
            self.complete();
            return if takes_no_more(self.input.text()) { self.command() } else { Response::Stay };
        };
        match (entry.same_verb(), entry.context.tab()) {
            _ if applies => Response::Do(Effect::call(|app| app.perform(entry))),
            (None, Some(tab)) => Response::Do(Effect::call(move |app| {
                app.show(tab);
                app.perform(entry);
            })),
            // A command whose arguments may be left out.
            (Some(verb), _) if self.input.text().trim() == verb.name && Command::parse(verb.name).is_ok() => {
                self.command()
            }
            _ => {
                self.complete();
                Response::Stay
            }
        }
    }

    /// Parses the typed line and carries it out.
    fn command(&mut self) -> Response {
        match Command::parse(self.input.text()) {
            Ok(Some(command)) => {
                let line = self.input.text().trim().to_owned();
                return Response::Try(Effect::new(|app| {
                    app.remember(line);
                    app.apply_typed(command)
                }));
            }
            Ok(None) => return Response::Leave,
            Err(error) => self.error = Some(error.to_string()),
        }
        Response::Stay
    }

    /// Completes the word before the cursor with the selected completion, or else the first one that begins with it or
    /// the only one in which it is found; without arguments, the command, as far as those that begin so have it in
    /// common. Nothing that was typed is lost.
    fn complete(&mut self) {
        let typed = self.input.before_cursor();
        let is_command = is_command(typed.trim_start());
        let begun = if is_command { typed.rfind(' ').map_or(0, |space| space + 1) } else { 0 };
        let word = &typed[begun..];
        let begins = |value: &&Value| value.text.to_lowercase().starts_with(&word.to_lowercase());
        let is_number = word.parse::<f64>().is_ok();
        let values = || self.found.iter().filter(|value| value.action.is_none());
        let only = || search(values(), word).pop().filter(|_| values().count() == 1 && !is_number);
        let chosen = self.chosen().filter(|value| value.action.is_none() && !value.is_document());
        let text = if let Some(value) = chosen.or(values().find(begins).or_else(only).filter(|_| is_command)) {
            // More text follows a folder or `KEY=`.
            let is_followed = self.input.text()[typed.len()..].starts_with(' ');
            let end = if value.text.ends_with(['/', '=']) || is_followed { "" } else { " " };
            if is_command { value.quoted() + end } else { value.line() + end }
        } else if is_command {
            return;
        } else if let Some(verb) = self.chosen().and_then(|value| value.action?.0.same_verb()) {
            format!("{} ", verb.name)
        } else {
            let actions = self.found.iter().filter(|value| value.action.is_some());
            let begin = actions.map(|value| &*value.text).filter(|name| name.starts_with(word));
            let common = begin.reduce(|a, b| &a[..a.bytes().zip(b.bytes()).take_while(|(a, b)| a == b).count()]);
            common.unwrap_or(word).to_owned()
        };
        self.input.replace_from(begun, &text);
        self.search();
    }

    /// Recalls an older or newer command of the history; false if there is none.
    fn recall(&mut self, older: bool) -> bool {
        let begins = self.input.text().is_empty() || self.recalled.is_some();
        let next = match (self.recalled, older) {
            (None, true) => self.history.len().checked_sub(1),
            (Some(now), true) => Some(now.saturating_sub(1)),
            (Some(now), false) => Some(now + 1).filter(|next| *next < self.history.len()),
            (None, false) => return false,
        };
        if !begins || (next.is_none() && older) {
            return false;
        }
        self.input = next.map_or_else(TextInput::default, |next| TextInput::new(self.history[next].clone()));
        self.search();
        self.recalled = next;
        true
    }

    fn search(&mut self) {
        (self.error, self.recalled, self.selected) = (None, None, None);
        let (written, text) = (self.input.before_cursor().trim_start(), self.input.text().trim_start());
        if is_command(text) {
            let verb = verb_of(text).map(|verb| verb.name);
            let has_it = |value: &&Value| value.action.and_then(|(entry, _)| Some(entry.same_verb()?.name)) == verb;
            self.found = self.actions.iter().filter(has_it).cloned().collect();
            if let Some(verb) = verb_of(written).filter(|verb| verb.name.len() < written.len()) {
                let words: Vec<&str> = written[verb.name.len()..].trim_start().split(' ').collect();
                self.found.extend(self.arguments.of(verb, &words));
            }
            return;
        }
        let (mut actions, values) = (search(&self.actions, text), self.arguments.lines_with(text));
        if actions.is_empty() {
            actions = similar(&self.actions, text, if values.is_empty() { 0.0 } else { SIMILAR });
        }
        self.found = actions.into_iter().cloned().chain(values).collect();
        self.selected = self.named(text);
    }

    /// The place of the action that a text names: in full, or as the only one that begins so; or of the task, run or
    /// setting of this name.
    fn named(&self, text: &str) -> Option<usize> {
        let begins =
            |value: &Value| value.action.is_some() && value.texts().0.iter().any(|name| name.starts_with(text));
        let mut begun = (0..self.found.len()).filter(|place| begins(&self.found[*place]));
        // What is named in full comes first.
        let named = self.found.iter().position(|value| match value.action {
            Some(_) => value.texts().0.contains(&text),
            None => value.text == text,
        });
        named.or_else(|| begun.next().filter(|_| !text.is_empty() && begun.next().is_none()))
    }
}

impl Layer for CommandPalette {
    fn key(&mut self, key: KeyEvent) -> Response {
        let (page, last) = (self.rows.len().max(1), self.found.len().saturating_sub(1));
        match key.code {
            KeyCode::Esc => return Response::Leave,
            KeyCode::Up if self.selected.unwrap_or(0) == 0 && self.recall(true) => {}
            KeyCode::Down if self.selected.unwrap_or(0) == 0 && self.recall(false) => {}
            KeyCode::Up => self.selected = self.selected.and_then(|index| index.checked_sub(1)),
            KeyCode::Down | KeyCode::PageDown => {
                let by = if key.code == KeyCode::Down { 1 } else { page };
                let value = self.found.iter().position(|value| value.action.is_none());
                let first = value.filter(|_| is_command(self.input.text())).unwrap_or(0);
                self.selected = Some(self.selected.map_or(first + by - 1, |index| index + by).min(last));
            }
            KeyCode::PageUp => self.selected = self.selected.map(|index| index.saturating_sub(page)),
            KeyCode::Home if self.input.text().is_empty() => self.selected = Some(0),
            KeyCode::End if self.input.text().is_empty() => self.selected = Some(last),
            KeyCode::Tab => self.complete(),
            KeyCode::Enter => return self.choose(),
            _ if self.input.key(key) => self.search(),
            _ => {}
        }
        Response::Stay
    }

    fn click(&mut self, at: Position) -> Response {
        let Some(index) = list::hit(&self.rows, at) else { return Response::Stay };
        self.selected = Some(index);
        self.choose()
    }

    fn paste(&mut self, text: &str) {
        self.input.insert(text);
        self.search();
    }

    fn refuse(&mut self, reason: String) {
        self.error = Some(reason);
    }

    fn draw(&mut self, area: Rect, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
        let (count, is_command) = (self.found.len(), is_command(self.input.text()));
        let commands = self.found.iter().filter(|value| value.action.is_some()).count();
        let commands = Some(commands).filter(|found| *found > 0).map(|found| counted(found, "command") + " · ");
        let title = format!("{}enter: run   tab: complete   esc: close", commands.unwrap_or_default());
        let inside = frame(&title, (116, self.height.min(area.height)), area, theme, buffer);
        let cursor = line(&self.input, ": ", inside, theme, buffer);
        let width = usize::from(inside.width);
        let mut below = Rect { y: inside.y + 1, height: inside.height - 1, ..inside };
        // What is wrong is at the bottom, or the description of the selected line if it has little room for it.
        let is_long = |value: &&Value| value.action.is_none() || columns::width(&value.line()) + 12 > width;
        let about = self.chosen().filter(is_long).map(|value| &*value.about);
        if let Some(text) = self.error.as_deref().or(about) {
            let style = if self.error.is_some() { Style::new().fg(theme.bad) } else { theme.faint() };
            let lines = wrap(text, width);
            below.height = below.height.saturating_sub(lines.len() as u16);
            let bottom = Rect { y: below.bottom(), height: inside.bottom() - below.bottom(), ..inside };
            Text::from_iter(lines).style(style).render(bottom, buffer);
        }
        let row = |index: usize| {
            let value = &self.found[index];
            let Some((entry, applies)) = value.action else {
                let text = if is_command { value.text.clone() } else { value.line() };
                return Row::new([Line::raw(shortened(&format!("  {text:<30}  {}", value.about), width, false))]);
            };
            let keys = match entry.context.tab().filter(|_| entry.same_verb().is_none()) {
                _ if applies => entry.keys.to_owned(),
                Some(tab) => format!("{} on {}", entry.keys, tab.name()),
                None => String::new(),
            };
            let room = width.saturating_sub(keys.len());
            let text = shortened(&value.line(), room.saturating_sub(1), false);
            Row::new([Line::from(vec![Span::raw(format!("{text:<room$}")), Span::styled(keys, theme.strong())])])
        };
        self.rows = list::draw(count, self.selected, row, &[Constraint::Fill(1)], below, theme, buffer);
        if let [(_, first), .., (_, last)] = self.rows[..]
            && self.rows.len() < count
        {
            let place = Line::raw(format!(" {}-{} of {count} ", first + 1, last + 1)).right_aligned();
            place.style(theme.faint()).render(Rect { y: inside.bottom(), height: 1, ..inside }, buffer);
        }
        Some(cursor)
    }
}

/// The verb with which a text begins: `model train` is not `model` with an argument.
fn verb_of(text: &str) -> Option<&'static Verb> {
    let begins = |name| text.strip_prefix(name).is_some_and(|rest: &str| rest.is_empty() || rest.starts_with(' '));
    verbs().filter(|verb| begins(verb.name)).max_by_key(|verb| verb.name.len())
}

/// Whether a text is a command: a verb followed by arguments, or one that takes none.
fn is_command(text: &str) -> bool {
    verb_of(text).is_some_and(|verb| verb.arguments.is_empty() || text != verb.name)
}

/// Whether a line is a command with its only argument.
fn takes_no_more(text: &str) -> bool {
    verb_of(text).is_some_and(|verb| !verb.arguments.contains(' '))
        && !text.ends_with(['/', '='])
        && Command::parse(text).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crossterm::event::KeyModifiers;

    fn palette(contexts: &[Context], history: &[&str]) -> CommandPalette {
        let arguments = Arguments::new(&crate::tui::testing::typical(), None);
        CommandPalette::new(contexts, arguments, history.iter().map(|line| (*line).to_owned()).collect())
    }

    /// What is shown after typing a text into the palette of the Scene screen and pressing enter: the error or the line
    /// in the palette, or else the commands given and the screen.
    fn entered(typed: &str) -> String {
        let mut palette = palette(&[Context::Scene, Context::Everywhere], &[]);
        palette.paste(typed);
        let (mut app, asked) = crate::tui::testing::app(crate::tui::testing::typical());
        match palette.key(KeyCode::Enter.into()) {
            Response::Try(effect) | Response::Do(effect) => {
                effect.carry_out(&mut app).unwrap();
                let screen = crate::tui::testing::text(&crate::tui::testing::shot(&mut app, 120, 40));
                format!("{:?} {screen}", asked.borrow())
            }
            _ => palette.error.unwrap_or_else(|| palette.input.text().to_owned()),
        }
    }

    #[test]
    fn typed_commands_are_carried_out_and_other_text_is_searched() {
        for (typed, expected) in [
            ("epsilon 0.3", "[\"epsilon 0.3\"]"),
            ("undo", "[\"undo\"]"),
            ("subgoal move 1 0 0.5", "[\"subgoal move 1 0 0.5\"]"),
            ("train", "train on the edited task1"),
            ("hand-play", "hand play: move the tool"),
            ("theme", "colours: light"),
            ("seed", "seed "),
            ("undoo", "unknown command `undoo`: did you mean `undo`?"),
            ("rolling success", "docs/glossary.md: rolling success: share of the latest 100 episodes"),
            ("hplay", "unknown command `hplay`"),
            ("sub", "unknown command `sub`"),
            ("subgoal mo", "subgoal move "),
            ("subgoal move", "subgoal move "),
            ("resume", "[\"resume\"]"),
            ("continue", "[\"continue\"]"),
            ("epsilon 7", "7 is not between 0 and 1"),
            ("quarrel 7 ü", "unknown command `quarrel 7 ü`"),
        ] {
            let response = entered(typed);
            assert!(response.contains(expected), "{typed}: {response}");
        }
    }

    #[test]
    fn enter_alone_closes_the_palette_and_a_selected_action_is_performed() {
        let press = |palette: &mut CommandPalette, code: KeyCode| palette.key(code.into());
        let mut empty = palette(&[Context::Everywhere], &[]);
        assert!(matches!(press(&mut empty, KeyCode::Enter), Response::Leave));
        press(&mut empty, KeyCode::Down);
        assert!(matches!(press(&mut empty, KeyCode::Enter), Response::Do(_)));
        empty.paste("train");
        (0..5).for_each(|_| drop(press(&mut empty, KeyCode::Backspace)));
        assert!(matches!(press(&mut empty, KeyCode::Enter), Response::Leave), "all is erased");
    }

    #[test]
    fn the_verb_of_a_typed_command_is_listed() {
        for (typed, verb) in [("epsilon 0.3", "epsilon"), ("undo", "undo")] {
            let mut written = palette(&[Context::Everywhere], &[]);
            written.paste(typed);
            assert!(written.found.iter().any(|value| value.text == verb), "{typed}");
        }
    }

    #[test]
    fn tab_completes_a_command_as_far_as_it_is_certain() {
        for (typed, completed) in [
            ("subgoal mo", "subgoal move "),
            ("too", "tool "),
            ("tool", "tool "),
            ("scr", "screen-"),
            ("task tk3", "task task3 "),
            ("model nowhere", "model nowhere"),
        ] {
            let mut palette = palette(&[Context::Everywhere], &[]);
            palette.paste(typed);
            palette.key(KeyCode::Tab.into());
            assert_eq!(palette.input.text(), completed);
        }
    }

    #[test]
    fn unknown_words_are_answered_with_similar_ones() {
        let listed = |typed: &str| {
            let mut palette = palette(&[Context::Everywhere], &[]);
            palette.paste(typed);
            let shown = |value: &Value| if value.action.is_some() { value.text.clone() } else { value.line() };
            palette.found.iter().map(shown).collect::<Vec<_>>()
        };
        assert_eq!(listed("undoo")[0], "undo");
        assert!(listed("nosuch cmd").len() > 1);
        assert_eq!(listed("model treu")[..2], ["model", "model true"]);
        assert_eq!(listed("terms numbers")[0], "docs/glossary.md: Glossary");
        assert!(
            listed("comparison other programs").contains(&"docs/comparisons.md: Compared with other programs".into())
        );
    }

    #[test]
    fn the_word_before_the_cursor_is_completed_and_what_follows_is_kept() {
        let mut palette = palette(&[Context::Everywhere], &[]);
        palette.paste("tool add ram 0 0");
        (0..4).for_each(|_| drop(palette.key(KeyCode::Left.into())));
        palette.key(KeyCode::Tab.into());
        assert_eq!(palette.input.text(), "tool add ramp 0 0");
    }

    #[test]
    fn tasks_runs_and_settings_are_found_by_their_names() {
        let offered = |typed: &str| {
            let mut palette = palette(&[Context::Everywhere], &[]);
            palette.paste(typed);
            palette.found.iter().filter(|value| value.action.is_none()).map(Value::line).collect::<Vec<_>>()
        };
        assert!(offered("gamma").contains(&"set ddpg.gamma".to_owned()));
        assert!(offered("task3").contains(&"task task3".to_owned()));
        assert!(offered("old").contains(&"open old".to_owned()));
        assert!(offered("").is_empty());
        assert!(offered("discount").contains(&"set ddpg.gamma".to_owned()), "by its description");
        assert_eq!(offered("a").iter().filter(|line| line.starts_with("set ")).count().min(20), 20, "not only tasks");
    }

    #[test]
    fn everything_that_can_be_done_is_listed_on_every_screen_and_found_by_other_words() {
        let listed = palette(&[Context::Runs, Context::Everywhere, Context::Typed], &[]);
        assert_eq!(listed.found.len(), entries().len());
        let found = |typed: &str| {
            let mut palette = palette(&[Context::Runs, Context::Everywhere], &[]);
            palette.paste(typed);
            Some(palette.chosen()?.action?.0.name)
        };
        assert_eq!((found("q"), found("exit")), (Some("quit"), Some("quit")));
        for (word, name) in [("new", "train"), ("undelete", "restore"), ("settings", "set"), ("history", "screen-log")]
        {
            assert_eq!(found(word), Some(name), "{word}");
        }
        assert_eq!(found("hand-place"), Some("hand-place"), "of another screen");
        let mut task = palette(&[Context::Everywhere], &[]);
        task.paste("task3");
        assert!(matches!(task.key(KeyCode::Enter.into()), Response::Try(_)), "it is opened");
        for (words, name) in [("backgrounds", "theme"), ("svg export", "export-svg"), ("critic value", "show-critic")] {
            let mut palette = palette(&[Context::Everywhere], &[]);
            palette.paste(words);
            assert_eq!(palette.found.first().map(|value| value.action.unwrap().0.name), Some(name), "{words}");
        }
    }

    #[test]
    fn arguments_are_completed_and_entered_commands_are_recalled() {
        let press =
            |palette: &mut CommandPalette, code: KeyCode| drop(palette.key(KeyEvent::new(code, KeyModifiers::NONE)));
        let mut written = palette(&[Context::Everywhere], &[]);
        written.paste("set ddpg.ga");
        press(&mut written, KeyCode::Tab);
        assert_eq!(written.input.text(), "set ddpg.gamma ");
        press(&mut written, KeyCode::Tab);
        assert_eq!(written.input.text(), "set ddpg.gamma 0.9 ");
        let mut chosen = palette(&[Context::Everywhere], &[]);
        chosen.paste("model ");
        press(&mut chosen, KeyCode::Down);
        press(&mut chosen, KeyCode::Down);
        press(&mut chosen, KeyCode::Tab);
        assert_eq!(chosen.input.text(), "model true ");
        let mut recalled = palette(&[Context::Everywhere], &["seed 1", "seed 2"]);
        let mut shown = |code: KeyCode| {
            press(&mut recalled, code);
            recalled.input.text().to_owned()
        };
        use KeyCode::{Down, Up};
        assert_eq!([Up, Up, Up, Down, Down, Down].map(&mut shown), ["seed 2", "seed 1", "seed 1", "seed 2", "", ""]);
    }

    #[test]
    fn the_selected_completion_is_inserted_and_quoted() {
        let mut view = crate::tui::testing::typical();
        view.runs.push(std::sync::Arc::new(crate::tui::testing::run_summary("my run")));
        let completed = |typed: &str, downs: usize| {
            let mut palette =
                CommandPalette::new(&[Context::Everywhere], Arguments::new(&view, None), vec!["seed 1".to_owned()]);
            palette.paste(typed);
            (0..downs).for_each(|_| drop(palette.key(KeyCode::Down.into())));
            palette.key(KeyCode::Tab.into());
            palette.input.text().to_owned()
        };
        assert_eq!(completed("epsilon ", 2), "epsilon linear:0.8:0.05:2000 ");
        assert_eq!(completed("tool set 1 max", 0), "tool set 1 max_angle=");
        assert_eq!(completed("open my", 0), "open 'my run' ");
        assert_eq!(completed("open run", 1), "open 'my run' ", "chosen, though it does not begin so");
        for typed in ["epsilon 0.25", "tool add ramp 0 0 20 angle=45", "quarrel 7", "set ddpg.gamma 0.8"] {
            assert_eq!(completed(typed, 0), typed, "nothing is lost");
        }
        let mut begun = palette(&[Context::Everywhere], &["seed 1"]);
        begun.paste("ep");
        begun.key(KeyCode::Up.into());
        assert_eq!(begun.input.text(), "ep", "what is written is kept");
    }
}
