//! A form: fields of one line each, checked while one types and on enter. A prompt is a form with one field, whose words
//! may be completed.

use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use ratatui::prelude::*;
use ratatui::widgets::Row;

use super::palette::Value;
use super::search::search;
use crate::tui::effect::{Effect, Layer, Response};
use crate::tui::widgets::popup::{frame, wrap};
use crate::tui::widgets::text_input::TextInput;
use crate::tui::widgets::theme::Theme;
use crate::tui::widgets::{columns, list};

/// Parses the texts of the fields into an effect, or says what is wrong with them.
type Reader = dyn Fn(&[&str]) -> Result<Effect, String>;
/// What a prompt does as one types.
type Live = dyn Fn(&str) -> Result<Effect, String>;
/// What stands in a field while it is empty, and its explanation if that is asked for, which takes longer, given its
/// place and the texts of all fields.
type Explainer = dyn Fn(usize, &[&str], bool) -> [String; 2];

/// Most completions that are shown at once, and below what a prompt changes as one types.
const LISTED: [usize; 2] = [12, 5];

/// A form.
pub struct Form {
    title: String,
    fields: Vec<Field>,
    selected: usize,
    /// The selected field was just entered: what is typed replaces its text.
    entered: bool,
    explain: Box<Explainer>,
    read: Box<Reader>,
    /// What the words of a prompt may be, and the place of the one that was chosen among those that fit.
    completions: Vec<Value>,
    picked: Option<usize>,
    /// What a prompt that acts as one types does, and the text with which it began.
    live: Option<(Box<Live>, String)>,
    /// What Enter does.
    pub enter: &'static str,
    /// Why the latest answer was refused.
    error: Option<String>,
    /// Where each field was last drawn.
    rows: Vec<(Rect, usize)>,
}

/// A field of a form.
#[derive(Default)]
pub struct Field {
    /// Its name; empty if it is the only one.
    pub name: &'static str,
    /// Its text.
    pub input: TextInput,
    /// The texts to choose from with the arrow keys; empty if it is typed.
    pub choices: Vec<String>,
    /// Whether it has had a text; false in a prompt.
    pub typed: bool,
    /// What it stands for when it was emptied; nothing if it may not be.
    pub emptied: &'static str,
}

/// The text of a field that was emptied.
pub const DEFAULT: &str = "default";

impl Form {
    /// A form with these fields.
    pub fn new(
        title: impl Into<String>,
        fields: Vec<Field>,
        explain: impl Fn(usize, &[&str], bool) -> [String; 2] + 'static,
        read: impl Fn(&[&str]) -> Result<Effect, String> + 'static,
    ) -> Self {
        Self {
            title: title.into(),
            fields,
            selected: 0,
            entered: false,
            explain: Box::new(explain),
            read: Box::new(read),
            completions: Vec::new(),
            picked: None,
            live: None,
            enter: "done",
            error: None,
            rows: Vec::new(),
        }
    }

    /// A question with a line for the answer, which begins as `text`.
    pub fn prompt(
        title: impl Into<String>,
        hint: impl Into<String>,
        text: impl Into<String>,
        read: impl Fn(&str) -> Result<Effect, String> + 'static,
    ) -> Self {
        let (hint, field) = (hint.into(), Field { input: TextInput::new(text), ..Field::default() });
        Self::new(title, vec![field], move |_, _, _| [String::new(), hint.clone()], move |texts| read(texts[0]))
    }

    /// The prompt with completions of its words.
    #[must_use]
    pub fn completing(mut self, completions: Vec<Value>) -> Self {
        // Another word may follow those that are typed in.
        if !self.fields[0].input.text().is_empty() {
            self.fields[0].input.insert(" ");
        }
        Self { completions, ..self }
    }

    /// The prompt, acting at every key, unless that fails; escape brings back what was.
    #[must_use]
    pub fn live(self, act: impl Fn(&str) -> Result<Effect, String> + 'static) -> Self {
        let before = self.texts()[0].to_owned();
        Self { live: Some((Box::new(act), before)), ..self }
    }

    /// What is to be done after the text has changed.
    fn changed(&mut self) -> Response {
        (self.error, self.picked) = (None, None);
        let effect = self.live.as_ref().and_then(|(act, _)| act(self.texts()[0]).ok());
        effect.map_or(Response::Stay, Response::Keep)
    }

    /// Where the word before the cursor begins.
    fn word(&self) -> usize {
        self.fields[0].input.before_cursor().rfind(' ').map_or(0, |space| space + 1)
    }

    /// The completions of the word before the cursor.
    fn fitting(&self) -> Vec<Value> {
        let typed = &self.fields[0].input.before_cursor()[self.word()..];
        let others = self.completions.iter().filter(|completion| completion.text != typed);
        search(others, typed).into_iter().cloned().collect()
    }

    /// Chooses the completion that is `by` after the chosen one.
    fn pick(&mut self, by: isize) {
        let last = self.fitting().len().saturating_sub(1);
        self.picked = Some(self.picked.map_or(0, |now| now.saturating_add_signed(by).min(last)));
    }

    /// Completes the word before the cursor with the chosen completion, or the first one.
    fn complete(&mut self) -> Response {
        let fitting = self.fitting();
        if let Some(Value { text, .. }) = fitting.get(self.picked.unwrap_or(0)) {
            let end = if text.ends_with([':', '=', '<', '>']) { "" } else { " " };
            let word = self.word();
            self.fields[0].input.replace_from(word, &format!("{text}{end}"));
        }
        self.changed()
    }

    fn texts(&self) -> Vec<&str> {
        let is_emptied = |field: &Field| field.typed && field.input.text().trim().is_empty();
        let text = |field| if is_emptied(field) { field.emptied } else { field.input.text().trim() };
        self.fields.iter().map(text).collect()
    }

    /// What is wrong if a text was typed and taken away again, which does not stand for the usual one.
    fn emptied(&self) -> Option<String> {
        let is_empty = |field: &Field| field.typed && field.emptied.is_empty() && field.input.text().trim().is_empty();
        let field = self.fields.iter().find(|field| is_empty(field))?;
        Some(format!("`{}` is empty: write a value, or open the dialog again for the usual one", field.name))
    }

    /// What is wrong with what has been typed so far. A prompt with completions expects unfinished words.
    fn problem(&self, texts: &[&str]) -> Option<String> {
        let is_typed = self.completions.is_empty() && texts.iter().any(|text| !text.is_empty());
        self.emptied().or_else(|| (self.read)(texts).err()).filter(|_| is_typed)
    }

    /// Selects a field. What was wrong with the latest answer gives way to its explanation.
    fn select(&mut self, place: usize) {
        (self.selected, self.entered, self.error) = (place, true, None);
    }

    /// Chooses the text that is `by` after the present one, by an arrow key.
    fn choose(&mut self, by: usize) {
        let [shown, _] = (self.explain)(self.selected, &self.texts(), false);
        let Field { input, choices, .. } = &mut self.fields[self.selected];
        let is_now = |choice: &String| choice == if input.text().is_empty() { &shown } else { input.text() };
        let now = choices.iter().position(is_now).unwrap_or(0);
        *input = TextInput::new(choices[(now + by) % choices.len()].clone());
        self.error = None;
    }
}

impl Layer for Form {
    fn key(&mut self, key: KeyEvent) -> Response {
        let [shown, _] = (self.explain)(self.selected, &self.texts(), false);
        let field = &mut self.fields[self.selected];
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        let clears = key.code == KeyCode::Char('u') && control;
        field.typed |= !field.name.is_empty() && (clears || !field.input.text().is_empty());
        let choices = field.choices.len();
        if matches!(key.code, KeyCode::Char(_)) && !control && self.entered && choices == 0 {
            field.input = TextInput::default();
        }
        self.entered = false;
        // The value that stands in a field without a text is edited like a text.
        if key.code == KeyCode::Backspace && choices == 0 && !field.typed && field.input.text().is_empty() {
            (field.typed, field.input) = (!shown.is_empty(), TextInput::new(shown));
        }
        match key.code {
            KeyCode::Esc => {
                let before = self.live.as_ref().and_then(|(_, before)| (self.read)(&[before]).ok());
                return before.map_or(Response::Leave, Response::Do);
            }
            KeyCode::Enter if self.picked.is_some() => return self.complete(),
            KeyCode::Enter => match self.emptied().map_or_else(|| (self.read)(&self.texts()), Err) {
                Ok(effect) => return Response::Try(effect),
                Err(error) => self.error = Some(error),
            },
            KeyCode::Up if !self.completions.is_empty() => self.pick(-1),
            KeyCode::Down if !self.completions.is_empty() => self.pick(1),
            KeyCode::Tab if !self.completions.is_empty() => return self.complete(),
            KeyCode::Up | KeyCode::BackTab => self.select((self.selected + self.fields.len() - 1) % self.fields.len()),
            KeyCode::Down | KeyCode::Tab => self.select((self.selected + 1) % self.fields.len()),
            KeyCode::Left if choices > 0 => self.choose(choices - 1),
            KeyCode::Right | KeyCode::Char(' ') if choices > 0 => self.choose(1),
            _ if choices == 0 && self.fields[self.selected].input.key(key) => return self.changed(),
            _ => {}
        }
        Response::Stay
    }

    fn click(&mut self, at: Position) -> Response {
        match list::hit(&self.rows, at) {
            Some(place) if self.completions.is_empty() => self.select(place),
            Some(place) if place > 0 => {
                self.picked = Some(place - 1);
                return self.complete();
            }
            _ => {}
        }
        Response::Stay
    }

    fn paste(&mut self, text: &str) {
        if self.fields[self.selected].choices.is_empty() {
            self.fields[self.selected].input.insert(text);
            (self.error, self.picked) = (None, None);
        }
    }

    fn refuse(&mut self, reason: String) {
        self.error = Some(reason);
    }

    fn draw(&mut self, area: Rect, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
        let (texts, count) = (self.texts(), self.fields.len());
        let problem = self.problem(&texts).filter(|_| self.error.is_none());
        let [_, explained] = (self.explain)(self.selected, &texts, true);
        let values: Vec<[String; 2]> = (0..count).map(|place| (self.explain)(place, &texts, false)).collect();
        let is_large = count > 1 || !self.completions.is_empty();
        let width = area.width.saturating_sub(8).min(if is_large { 72 } else { 64 });
        let fitting = self.fitting();
        let (about, style) = match (&self.error, self.picked.and_then(|picked| fitting.get(picked))) {
            (Some(error), _) => (error, Style::new().fg(theme.bad)),
            (None, Some(picked)) => (&picked.about, theme.faint()),
            (None, None) => (&explained, theme.faint()),
        };
        let room = usize::from(width);
        let whole = wrap(about, room);
        let problem = problem.map_or_else(Vec::new, |problem| wrap(&problem, room));
        // Estimates below the explanation are not of what is typed as long as that is wrong.
        let about = wrap(if problem.is_empty() { about } else { about.lines().next().unwrap_or_default() }, room);
        let rows = about.len() + problem.len().max(1);
        let tab = if self.completions.is_empty() { "" } else { "   tab: complete" };
        let title = format!("{} · enter: {}{tab}   esc: close", self.title, self.enter);
        // The popup keeps its height while one types.
        let listed = self.completions.len().min(LISTED[usize::from(self.live.is_some())]);
        let height = (count + rows.max(1 + whole.len()) + listed) as u16;
        let low = Rect { y: area.bottom().saturating_sub(height + 4), height: height + 2, ..area }.intersection(area);
        let area = if self.live.is_some() { low } else { area };
        let inside = frame(&title, (width, height), area, theme, buffer);
        let names = self.fields.iter().map(|field| field.name.len() as u16 + 1).max().filter(|width| *width > 1);
        let mut cursor = None;
        self.rows = inside.rows().take(count).zip(0..).collect();
        for (row, place) in self.rows.clone() {
            let (field, is_selected) = (&self.fields[place], place == self.selected);
            Line::styled(field.name, if is_selected { theme.strong() } else { theme.faint() }).render(row, buffer);
            let x = row.x + names.unwrap_or(0);
            let room = Rect { x, width: row.right().saturating_sub(x), ..row };
            let end = line(&field.input, if is_selected { "> " } else { "  " }, room, theme, buffer);
            if field.input.text().is_empty() && (!field.emptied.is_empty() || !field.typed) {
                let shown = columns::shortened(&values[place][0], usize::from(room.width.saturating_sub(3)), true);
                buffer.set_string(x + 2, row.y, shown, theme.faint());
            }
            cursor = if is_selected { Some(end) } else { cursor };
        }
        let [between, below] = [0, problem.len().max(1)]
            .map(|row| Rect { y: inside.y + (count + row) as u16, ..inside }.intersection(inside));
        Text::from_iter(problem).style(Style::new().fg(theme.bad)).render(between, buffer);
        let rows = about.len() as u16;
        Text::from_iter(about).style(style).render(below, buffer);
        let list = Rect { y: below.y + rows, height: below.height.saturating_sub(rows), ..below }.intersection(below);
        let row = |index: usize| {
            let (Value { text, about, .. }, room) = (&fitting[index], usize::from(list.width).saturating_sub(2));
            Row::new([columns::shortened(&format!("{text:<20}  {about}"), room, false)])
        };
        let drawn = list::draw(fitting.len(), self.picked, row, &[Constraint::Fill(1)], list, theme, buffer);
        self.rows.extend(drawn.into_iter().map(|(area, place)| (area, place + 1)));
        cursor
    }
}

/// Draws an input line, scrolled so that the cursor is visible. Returns the position of the cursor.
pub fn line(input: &TextInput, prefix: &str, area: Rect, theme: &Theme, buffer: &mut Buffer) -> Position {
    let start = area.x + prefix.len() as u16;
    let hidden = input.cursor_column().saturating_sub(area.right().saturating_sub(start + 1));
    let (_, shown) = columns::split(input.text(), usize::from(hidden));
    let text = Line::from(vec![Span::styled(prefix, theme.strong()), Span::styled(shown, Style::reset())]);
    text.render(Rect { width: area.width.saturating_sub(1), height: area.height.min(1), ..area }, buffer);
    Position::new((start + input.cursor_column()).min(area.right().saturating_sub(1)), area.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tui::widgets::theme::{Depth, Marker, Palette};

    #[test]
    fn the_cursor_is_after_the_text_and_stays_on_the_line() {
        let area = Rect::new(10, 5, 20, 1);
        let at = |text: &str| {
            let (theme, mut buffer) = (Theme::new(Palette::Dark, Depth::True, Marker::Braille), Buffer::empty(area));
            line(&TextInput::new(text), "> ", area, &theme, &mut buffer)
        };
        assert_eq!(at(""), Position::new(12, 5));
        assert_eq!(at("abc"), Position::new(15, 5));
        assert_eq!(at(&"abc".repeat(20)), Position::new(29, 5));
        assert_eq!(at(&"日本".repeat(20)), Position::new(29, 5));
    }
}
